"""A recording or checkpoint that is damaged is refused in one sentence; the recording is that of a belt."""

import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from sentences import RIG

from tests.conftest import refused
from tests.kinematics import unsettled_loop
from trackdyn.inputs.errors import DivergenceError, InputError
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recording import Recording, load_recording
from trackdyn.simulation.simulate import simulate


def changed(name, value):
    return lambda arrays: arrays.update({name: value})


def described(**fields):
    """A change of the description of a recording."""
    return lambda arrays: arrays.update(meta=np.array(json.dumps(json.loads(str(arrays["meta"])) | fields)))


def touched(array):
    """A copy of an array with one bit of its first number changed, or one number more."""
    array = np.append(array, np.zeros(1, array.dtype)) if not array.size else array.copy()
    array.reshape(-1)[:1].view(np.uint8)[0] ^= 1
    return array


DAMAGED = "not a trackdyn recording, or damaged"
DAMAGES = [
    ("no array", lambda arrays: arrays.pop("gap"), DAMAGED),
    ("no description", lambda arrays: arrays.pop("meta"), DAMAGED),
    ("no checksum", lambda arrays: arrays.pop("checksum"), DAMAGED),
    ("empty description", changed("meta", np.array("")), DAMAGED),
    ("a list as description", changed("meta", np.array("[1]")), DAMAGED),
    ("nested description", changed("meta", np.array("[" * 100_000)), DAMAGED),
    ("a number as description", changed("meta", np.arange(3.0)), DAMAGED),
    ("pickled", changed("time", np.array([{}], dtype=object)), DAMAGED),
    ("another format", described(format=2), "has recording format 2, this version reads"),
    ("format as text", described(format="a\nb"), "has recording format 'a\\nb'"),
    ("another rig", described(rig=[1]), DAMAGED),
]
DAMAGES += [
    (name, lambda arrays, name=name: arrays.update({name: touched(arrays[name])}), DAMAGED) for name in Recording.ARRAYS
]


@pytest.mark.parametrize("row", DAMAGES, ids=lambda row: row[0])
def test_a_damaged_recording_is_refused(tmp_path, belt_file, row):
    _, damage, word = row
    with np.load(belt_file) as data:
        arrays = dict(data)
    damage(arrays)
    path = tmp_path / "run.npz"
    np.savez(path, **arrays)
    refused(load_recording, path, words=[word], start=f"{path}: ")


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_a_recording_that_was_cut_off_is_refused(tmp_path, belt_file, share):
    path = tmp_path / "run.npz"
    path.write_bytes((content := belt_file.read_bytes())[: int(share * len(content))])
    refused(load_recording, path, words=[DAMAGED])


def test_a_small_file_that_unpacks_to_more_than_the_memory_is_refused(tmp_path, belt_file, monkeypatch):
    with np.load(belt_file) as data:
        arrays = dict(data)
    path = tmp_path / "run.npz"
    np.savez_compressed(path, **arrays | {"mean": np.zeros((1_000_000, 3))})
    monkeypatch.setattr("trackdyn.simulation.recording.virtual_memory", lambda: type("Memory", (), {"available": 4e6}))
    refused(load_recording, path, words=["takes 24 MB of memory, more than the 2 MB"])
    monkeypatch.undo()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("meta.npy", b" " * 20_000_000)
    refused(load_recording, path, words=[DAMAGED])


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("mean", lambda a: np.append(a[:-1], a[-1:] * np.nan, 0), "mean holds a value that is not a finite number"),
        ("raw", lambda a: a + 1e300, "raw holds a value beyond 1e+12"),
    ],
)
def test_numbers_that_no_run_gives_never_leave_one(belt_file, name, change, words):
    recording = load_recording(belt_file).checked()
    bad = replace(recording, **{name: change(getattr(recording, name))})
    refused(bad.checked, words=[words, "a smaller step"], error=DivergenceError)


@pytest.fixture
def checkpoint(tmp_path):
    """A checkpoint of a loop for which nothing is compiled, and its arrays."""
    path = tmp_path / "loop.npz"
    unsettled_loop(Scene(load_rig(RIG), 0.0)).save(path)
    with np.load(path) as data:
        return path, dict(data)


def test_a_damaged_checkpoint_is_refused(checkpoint):
    path, arrays = checkpoint
    assert Loop.load(path).time == 0.0
    changes = [(name, touched(array)) for name, array in arrays.items() if array.dtype.kind != "U"]
    changes += [("meta", np.array("{}")), ("state.rate", arrays["state.rate"].astype("f4"))]
    assert len(changes) > 100
    for name, array in changes[::7] + changes[-2:]:
        np.savez(path, **arrays | {name: array})
        for read in (Loop.load, lambda name: simulate(Scene(load_rig(RIG), 115.0), checkpoint=name)):
            refused(read, path, words=["not a checkpoint, or damaged"])
    assert path.exists()


def test_a_checkpoint_of_other_sources_or_of_another_scene_says_so(checkpoint, monkeypatch):
    path, _ = checkpoint
    scene = Scene(load_rig(RIG), 0.0)
    for other in (
        Scene(load_rig(RIG), 115.0),
        scene.with_(duration=2.0),
        scene.with_(rig=scene.rig.changed(gravity=9.8)),
    ):
        with pytest.raises(InputError, match="is the checkpoint of another scene; name another file to start again"):
            simulate(other, checkpoint=path)
    monkeypatch.setattr("trackdyn.simulation.loop_arrays.source_hash", lambda: "other")
    for read in (Loop.load, lambda name: simulate(scene, checkpoint=name)):
        refused(read, path, words=["was written by another version", "name another file to start again"])
    assert path.exists()


def test_a_recording_is_no_checkpoint(belt_file):
    refused(Loop.load, belt_file, words=["is a recording, not a checkpoint; name another file"])

"""A damaged recording of a belt is refused in one sentence."""

import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import refused
from trackdyn import DivergenceError, Recording, load_recording
from trackdyn.inputs.files import read_npz, write_npz


def changed(name, value):
    return lambda arrays: arrays.update({name: value})


def described(**fields):
    return lambda arrays: arrays.update(meta=np.array(json.dumps(json.loads(str(arrays["meta"])) | fields)))


def touched(array):
    """Return a copy of an array with one bit of its first number changed, or one number more."""
    array = np.append(array, np.zeros(1, array.dtype)) if not array.size else array.copy()
    array.reshape(-1)[:1].view(np.uint8)[0] ^= 1
    return array


DAMAGED = "not a trackdyn recording, or damaged"


@pytest.fixture
def arrays(belt_file):
    return dict(np.load(belt_file))


@pytest.mark.parametrize("row", [
    *((f"no {name}", lambda arrays, name=name: arrays.pop(name), DAMAGED) for name in ("gap", "meta", "checksum")),
    *((f"description {meta[:3]}", changed("meta", np.array(meta)), DAMAGED) for meta in ("", "[1]", "[" * 100_000)),
    ("a number as description", changed("meta", np.arange(3.0)), DAMAGED),
    ("pickled", changed("time", np.array([{}], dtype=object)), DAMAGED),
    ("another format", described(format=2), "has recording format 2, this version reads"),
    ("format as text", described(format="a\nb"), "has recording format 'a\\nb'"),
    ("another rig", described(rig=[1]), DAMAGED),
    *((name, lambda all, name=name: all.update({name: touched(all[name])}), DAMAGED) for name in Recording.ARRAYS),
], ids=lambda row: row[0])  # fmt: skip
def test_a_damaged_recording_is_refused(tmp_path, arrays, row):
    _, damage, word = row
    damage(arrays)
    np.savez(path := tmp_path / "run.npz", **arrays)
    refused(load_recording, path, words=[word], start=f"{path}: ")


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_a_recording_that_was_cut_off_is_refused(tmp_path, belt_file, share):
    path = tmp_path / "run.npz"
    path.write_bytes((content := belt_file.read_bytes())[: int(share * len(content))])
    refused(load_recording, path, words=[DAMAGED])


@pytest.mark.parametrize("name", ["gap", "more"])
def test_a_recording_with_other_arrays_than_this_version_records_is_refused(tmp_path, belt_file, name):
    meta, arrays = read_npz(belt_file, "recording", np.inf)
    arrays = {"more": arrays["gap"]} | arrays if name == "more" else {k: arrays[k] for k in arrays if k != name}
    write_npz(path := tmp_path / "run.npz", meta, arrays)
    refused(load_recording, path, start=f"{path}: has other arrays than this version records ('{name}'); run it again")


def test_a_small_file_that_unpacks_to_more_than_the_memory_is_refused(tmp_path, arrays, monkeypatch):
    path = tmp_path / "run.npz"
    np.savez_compressed(path, **arrays | {"mean": np.zeros((1_000_000, 3))})
    monkeypatch.setattr("trackdyn.simulation.recording.free_memory", lambda: 4e6)
    refused(load_recording, path, words=["takes 24 MB of memory, more than the 2 MB"])
    monkeypatch.undo()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("meta.npy", b" " * 20_000_000)
    refused(load_recording, path, words=[DAMAGED])


def test_numbers_beyond_physics_never_leave_a_run(belt_file):
    recording = load_recording(belt_file).checked()
    for value, words in ((np.nan, "raw has a value that is not a fini"), (1e300, "raw has a value beyond 1e+12")):
        raw = recording.raw.copy()
        raw[-1] = value
        refused(replace(recording, raw=raw).checked, words=[words, "a smaller step"], error=DivergenceError)

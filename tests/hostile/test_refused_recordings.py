"""A recording or checkpoint that is damaged is refused in one sentence; the recording is that of a belt."""

import json
import zipfile

import numpy as np
import pytest
from sentences import RIG, one_sentence

from trackdyn.errors import DivergenceError, InputError
from trackdyn.parameters.rig import load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.checkpoint import read_checkpoint
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recording import Recording, load_recording
from trackdyn.simulation.simulate import simulate


def described(change):
    """A change of the description of a recording."""

    def apply(arrays):
        meta = json.loads(str(arrays["meta"]))
        change(meta)
        arrays["meta"] = np.array(json.dumps(meta))

    return apply


def changed(name, value):
    return lambda arrays: arrays.update({name: value(arrays[name]) if callable(value) else value})


def spoiled(array):
    array = array.copy()
    array.flat[3] = np.nan
    return array


DAMAGES = [
    ("no array", lambda arrays: arrays.pop("gap"), "gap"),
    ("no description", lambda arrays: arrays.pop("meta"), "not a trackdyn recording, or damaged"),
    ("empty description", changed("meta", np.array("")), "not a trackdyn recording, or damaged"),
    ("a list as description", changed("meta", np.array("[1]")), "not a trackdyn recording, or damaged"),
    ("nested description", changed("meta", np.array("[" * 100_000)), "not a trackdyn recording, or damaged"),
    ("a number as description", changed("meta", np.arange(3.0)), "not a trackdyn recording, or damaged"),
    ("short array", changed("gap", lambda a: a[:-1]), "gap has float64 of the shape (499,)"),
    ("wide array", changed("mean", lambda a: np.hstack([a, a])), "mean has float64 of the shape (500, 6)"),
    ("flat array", changed("raw", np.ravel), "raw has float64 of the shape (1500,)"),
    ("text", changed("time", lambda a: a.astype(str)), "time has <U"),
    ("complex", changed("time", lambda a: a + 1j), "time has complex128"),
    ("not a number", changed("mean", spoiled), "mean holds a value that is not a finite number"),
    ("begin as list", changed("begin", np.zeros(2)), "begin has"),
    ("pickled", changed("time", np.array([{}], dtype=object)), "not a trackdyn recording, or damaged"),
    ("another format", described(lambda meta: meta.update(format=2)), "has recording format 2, this version reads"),
    ("format as text", described(lambda meta: meta.update(format="a\nb")), "has recording format 'a\\nb'"),
    ("no rig", described(lambda meta: meta.pop("rig")), "rig"),
    ("half a rig", described(lambda meta: meta["rig"].pop("sensor")), "sensor"),
    ("rig as list", described(lambda meta: meta.update(rig=[1])), "or damaged"),
    ("no scene", described(lambda meta: meta.pop("scene")), "scene"),
    ("a field of the scene", described(lambda meta: meta["scene"].update(speed=1)), "speed is not a known parameter"),
    ("no step", described(lambda meta: meta["scene"].pop("step")), "scene lacks step"),
    ("no ramp", described(lambda meta: meta["scene"].pop("ramp")), "scene lacks ramp"),
    ("speed as text", described(lambda meta: meta["scene"].update(motor_rpm="fast")), "motor_rpm = 'fast'"),
    ("another fidelity", described(lambda meta: meta["fidelity"].update(chain={"setting": "rope"})), "fidelity"),
    ("layout as text", described(lambda meta: meta.update(layout={"path_m": "far"})), "or damaged"),
    ("verdict as text", described(lambda meta: meta.update(resolved="yes")), "resolved is 'yes', not a state"),
    (
        "a number as verdict",
        described(lambda meta: meta.update(resolved={"state": 7, "reason": ""})),
        "is {'state': 7,",
    ),
    ("a verdict without state", described(lambda meta: meta.update(resolved={"reason": ""})), "state"),
    ("no reason", described(lambda meta: meta["fidelity"]["chain"].pop("reason")), "reason"),
    (
        "a number as reason",
        described(lambda meta: meta["fidelity"]["chain"].update(reason=1)),
        "reason that is no text",
    ),
    ("grooves as fractions", changed("groove", lambda a: a.astype(float)), "groove has float64 of the shape"),
    ("versions as list", described(lambda meta: meta.update(versions=[1])), "versions"),
]


ROWS = ("time", "raw", "mean", "gap", "cut", "change", "place", "wheel_rate", "energy", "force", "area", "groove")


def kept(part):
    """Some of the samples of every array."""
    return lambda arrays: arrays.update({name: arrays[name][part] for name in ROWS})


DAMAGES += [
    ("time reversed", changed("time", lambda a: a[::-1]), "time is not that of 1000 Hz"),
    ("time zero", changed("time", lambda a: 0 * a), "time is not that of 1000 Hz"),
    ("time doubled", changed("time", lambda a: 2 * a), "time is not that of 1000 Hz"),
    ("half of the samples", kept(slice(None, None, 2)), "250 samples are not the duration of the scene"),
    ("the first half", kept(slice(250)), "250 samples are not the duration of the scene"),
    ("no sample", kept(slice(0)), "0 samples are not the duration of the scene"),
    ("another duration", described(lambda m: m["scene"].update(duration=5.0)), "500 samples are not the duration"),
    ("another rate", described(lambda m: m["rig"]["sensor"].update(rate=500)), "500 samples are not the duration"),
    ("before the start", changed("begin", np.array(-5.0)), "begin = -5.0 is before the start"),
    ("too large", changed("raw", lambda a: a + 1e300), "raw holds a value beyond 1e+12"),
    ("a wheel more", changed("wheel_rate", lambda a: np.hstack([a, a])), "wheel_rate is not of the wheels"),
    ("pitches of a belt", lambda a: a.update(
        pitches=np.array([1]), area=np.zeros((500, 1, 2), int), groove=np.zeros((500, 1, 2), int),
        force=np.zeros((500, 1, 3))), "pitches are not those of the scene"),
    ("frames of a belt", lambda a: a.update(frame=np.zeros((2, 73)), frame_time=np.zeros(2)), "frame is not one"),
    ("a plane of a belt", changed("plane", np.zeros((500, 8))), "plane is not that of the scene"),
    ("links of a belt", changed("link_mean", np.zeros((500, 35, 3))), "link_mean is not of every link"),
    ("a spell before the record", changed("spells", np.zeros((1, 11))), "spells are not within the record"),
    ("spells of other pitches", changed("spells", np.full((1, 11), 99.0)), "spells have pitches other than"),
]  # fmt: skip


@pytest.mark.parametrize("row", DAMAGES, ids=lambda row: row[0])
def test_a_damaged_recording_is_refused(tmp_path, belt_file, row):
    _, damage, word = row
    with np.load(belt_file) as data:
        arrays = dict(data)
    damage(arrays)
    path = tmp_path / "run.npz"
    np.savez(path, **arrays)
    with pytest.raises(InputError) as caught:
        load_recording(path)
    assert one_sentence(caught, word).startswith(f"{path}: ")


def test_the_recording_that_was_not_damaged_is_read(belt_file):
    recording = load_recording(belt_file)
    assert recording.fault() is None and recording.checked() is recording


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_a_recording_that_was_cut_off_is_refused(tmp_path, belt_file, share):
    path = tmp_path / "run.npz"
    path.write_bytes((content := belt_file.read_bytes())[: int(share * len(content))])
    with pytest.raises(InputError) as caught:
        load_recording(path)
    one_sentence(caught, "not a trackdyn recording, or damaged")


def test_a_small_file_that_unpacks_to_more_than_the_memory_is_refused(tmp_path, belt_file, monkeypatch):
    with np.load(belt_file) as data:
        arrays = dict(data)
    path = tmp_path / "run.npz"
    np.savez_compressed(path, **arrays | {"mean": np.zeros((1_000_000, 3))})
    monkeypatch.setattr("trackdyn.simulation.recording.virtual_memory", lambda: type("Memory", (), {"available": 4e6}))
    with pytest.raises(InputError) as caught:
        load_recording(path)
    one_sentence(caught, "takes 24 MB of memory, more than the 2 MB")
    monkeypatch.undo()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("meta.npy", b" " * 20_000_000)
    with pytest.raises(InputError, match="not a trackdyn recording, or damaged"):
        load_recording(path)


def test_a_number_that_is_not_finite_never_leaves_a_run(belt_file):
    recording = load_recording(belt_file)
    arrays = {name: getattr(recording, name) for name in Recording.ARRAYS}
    broken = Recording(**arrays | {"mean": spoiled(recording.mean)}, meta=recording.meta)
    with pytest.raises(DivergenceError) as caught:
        broken.checked()
    one_sentence(caught, "mean holds a value that is not a finite number", "a smaller step")


@pytest.mark.parametrize(
    "change", [{}, {"parts": 1}, {"parts": {"scene": {}}}, {"parts": {"scene": 5, "layout": {}, "model": {}}}], ids=str
)
def test_a_damaged_checkpoint_is_refused(tmp_path, monkeypatch, change):
    monkeypatch.setattr("trackdyn.simulation.checkpoint.source_hash", lambda: "here")
    path = tmp_path / "state"
    with path.open("wb") as file:
        np.savez(file, meta=np.array(json.dumps({"sources": "here"} | change)), **{"state.pin": np.zeros(4)})
    for read in (Loop.load, lambda name: simulate(Scene(load_rig(RIG), 115.0), checkpoint=name)):
        with pytest.raises(InputError) as caught:
            read(path)
        one_sentence(caught, "not a checkpoint, or damaged; remove it to start again")
    assert path.exists()


def test_a_checkpoint_of_other_sources_says_so(tmp_path):
    path = tmp_path / "state"
    with path.open("wb") as file:
        np.savez(file, meta=np.array(json.dumps({"sources": "a\nb", "parts": {}})))
    with pytest.raises(InputError) as caught:
        read_checkpoint(path)
    one_sentence(caught, "remove it to start again")

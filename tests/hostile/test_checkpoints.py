"""Checkpoints and recordings of a chain whose checksums are whole and that hold what no run gives."""

import numpy as np
import pytest

from trackdyn.errors import InputError
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recording import load_recording


@pytest.fixture(scope="module")
def files(driven_loop, tmp_path_factory):
    """A checkpoint of a loop that was steered, and a record of it."""
    folder, loop = tmp_path_factory.mktemp("kept"), driven_loop()
    loop.drive(150.0, 0.1)
    loop.shift_tensioner(loop.layout["tensioner_shift_m"] + 1e-4)
    loop.record(0.2, pitches=tuple(range(1, 36)), frame_interval=0.05).save(folder / "run.npz")
    loop.save(folder / "loop.npz")
    return folder


def forged(files, tmp_path, name, changes):
    with np.load(files / name) as data:
        arrays = dict(data)
    for key, change in changes.items():
        arrays[key] = change(arrays[key])
    np.savez(tmp_path / name, **arrays)
    return tmp_path / name


CHECKPOINTS = {
    "nothing": {},
    "tooth": {"model.tooth.centre_x": lambda a: 0 * a + 1e300},
    "a little": {"model.tooth.radius": lambda a: a * (1 + 1e-6)},
    "step": {"model.step": lambda a: 2 * a},
    "wheel": {"model.wheels.x": lambda a: a + 1e-3},
    "body": {"model.shoes.link_body": lambda a: a + 99},
    "drive": {"model.drive.rate": lambda a: np.nan * a},
    "steps": {"state.steps": lambda a: 0 * a - 9},
    "pin": {"state.pin": lambda a: a * np.nan},
    "far": {"state.pin": lambda a: a + 1e300},
    "single": {"state.rate": lambda a: a.astype("f4")},
    "complex": {"state.rate": lambda a: a + 1j},
    "short": {"state.rate": lambda a: a[:-1]},
    "groove": {"work.near.groove": lambda a: a + 99},
    "area": {"work.tooth_area": lambda a: a + 99},
    "more": {"model.tooth.addendum": lambda a: np.array([a, a])},
}


@pytest.mark.parametrize("name", CHECKPOINTS)
def test_a_forged_checkpoint_is_refused(files, tmp_path, name):
    path = forged(files, tmp_path, "loop.npz", CHECKPOINTS[name])
    if name == "nothing":
        return Loop.load(path).step()
    with pytest.raises(InputError, match="not a checkpoint, or damaged; remove it to start again"):
        Loop.load(path)


def test_a_recording_is_no_checkpoint(files):
    with pytest.raises(InputError, match="is a recording, not a checkpoint; name another file"):
        Loop.load(files / "run.npz")


RECORDINGS = {
    "nothing": ({}, None),
    "area": ({"area": lambda a: a + 99}, "area is not 0 to 10"),
    "area alone": ({"groove": lambda a: 0 * a}, "area and groove are not of the same contacts"),
    "groove": ({"groove": lambda a: a + 99}, "groove is not 0 to 13"),
    "pitches": ({"pitches": lambda a: a + 1000}, "pitches are not those of the scene"),
    "force": ({"force": lambda a: a - 1.0}, "force is negative"),
    "gap": ({"gap": lambda a: a - 1.0}, "gap, cut or change is negative"),
    "frames": ({"frame_time": lambda a: a[::-1]}, "frame_time is not one every frame_interval"),
    "bodies": ({"frame": lambda a: a[:, 1:]}, "frame is not of the bodies"),
    "spell's pitch": ({"spells": lambda a: a + np.eye(11)[0] * 99}, "spells have pitches other than 0 to 34"),
    "spell's end": ({"spells": lambda a: a + np.eye(11)[5] * 99}, "spells are not within the record"),
}


@pytest.mark.parametrize("name", RECORDINGS)
def test_a_forged_recording_is_refused(files, tmp_path, name):
    """What a loop records says what was recorded, not what its scene had asked for."""
    changes, sentence = RECORDINGS[name]
    path = forged(files, tmp_path, "run.npz", changes)
    if sentence is None:
        assert load_recording(path).meta["scene"]["duration"] == 0.2
        assert len(load_recording(path).spells)
        return
    with pytest.raises(InputError, match=sentence) as caught:
        load_recording(path)
    assert "\n" not in str(caught.value)

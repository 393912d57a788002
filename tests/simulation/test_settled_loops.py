"""Shared settled loops give every scene the bytes of its own settling."""

import numpy as np
import pytest

from tests.conftest import assert_same_arrays, refused
from trackdyn import Scene, load_rig, simulate
from trackdyn.rig.laws import NORMAL_LAWS
from trackdyn.simulation import settling
from trackdyn.simulation.loop_arrays import flatten
from trackdyn.simulation.settling import SettledLoops, settle

SHORT = {"duration": 0.05, "lead_in": 0.0, "ramp": 0.05, "integrator": "linearly_implicit", "step": 5e-4}


@pytest.fixture(autouse=True)
def _nothing_kept(monkeypatch):
    monkeypatch.setattr(settling, "kept_folder", lambda: None)


@pytest.mark.parametrize("series", [
    [{}, {"motor_rpm": 210.0, "ring_radius": None}, {"motor_rpm": 210.0}], [{}, {"chain": "single_pin"}],
    [{"ring_radius": 0.311}, {"tension": "retensioned", "ring_radius": 0.311}],
], ids=str)  # fmt: skip
def test_scenes_of_a_series_are_those_of_single_runs(make_scene, series):
    """Also after a loop that a wrong key would take for theirs: all but `IRRELEVANT` is in it."""
    starts = SettledLoops()
    for fields in series:
        scene = make_scene(**SHORT | fields)
        recording, expected = simulate(scene, starts=starts), simulate(scene)
        assert recording.meta == expected.meta
        assert_same_arrays(recording, expected)


def test_a_step_is_refused_with_a_shared_loop_as_with_its_own():
    """The limits of a step know the speed, which the loop that is shared does not; a step nobody chose follows."""
    starts, rig = SettledLoops(), load_rig("parts").changed(chain__link_mass=6.0)  # light links bear small steps
    large = {"ring_radius": 0.313, "duration": 0.05, "lead_in": 0.0, "ramp": 0.05}
    slow = Scene(rig, 115.0, **large)
    steps = [simulate(Scene(rig, rpm, **large), starts=starts).meta["scene"]["step"] for rpm in (115.0, 110.0)]
    assert len(starts._settled) == 1 and max(steps) < slow.time_step
    pattern = r"step = 0\.0001: too large .* at a tension of 5\.\d+e\+04 N"
    refused(simulate, slow.with_(step=1e-4), starts=starts, match=pattern)


@pytest.fixture
def kept(monkeypatch, tmp_path):
    """Function that settles a scene as a new process does, and whether it used a stored loop."""
    monkeypatch.setattr(settling, "kept_folder", lambda: tmp_path)

    def start(scene):
        made = []
        with monkeypatch.context() as patch:
            patch.setattr(settling, "tensioned", lambda *a, of=settling.tensioned: made.append(1) or of(*a))
            return settle(scene), not made

    start.folder = tmp_path / "settled"
    return start


@pytest.mark.parametrize("fields", [{}, {"tension": "retensioned", "ring_radius": 0.311}], ids=str)
def test_a_loop_that_another_process_kept_is_the_same_to_the_last_bit(make_scene, kept, fields):
    scene = make_scene(115.0, **SHORT | fields)
    (made, first), (taken, second) = kept(scene), kept(scene.with_(motor_rpm=130.0, lead_in=0.1))
    assert (first, second) == (False, True) and made.layout == taken.layout
    assert_same(made, taken)


def assert_same(made, taken):
    for name in ("state", "work"):
        np.testing.assert_equal(flatten(getattr(taken.arrays, name)), flatten(getattr(made.arrays, name)))


def test_the_name_of_a_file_has_everything_that_its_loop_depends_on(make_scene, kept, monkeypatch):
    """Settings, the rig, the numbers behind a name, the sources; and a damaged file counts for none."""
    scene = make_scene(115.0, **SHORT)
    right, _ = kept(scene)
    heavy = scene.rig.changed(chain__link_mass=1.01 * scene.rig.chain.link_mass)
    for other in (scene.with_(ring_radius=0.310), make_scene(115.0, rig=heavy, **SHORT)):
        assert not kept(other)[1] and kept(other)[1]
    with monkeypatch.context() as patch:
        patch.setitem(NORMAL_LAWS, scene.normal_law, NORMAL_LAWS["elastic"])
        assert not kept(scene.with_())[1]
    with monkeypatch.context() as patch:
        patch.setattr(settling, "module_hash", lambda module: "another")
        assert not kept(scene)[1]
    assert kept(scene)[1]
    for file in kept.folder.iterdir():
        content = bytearray(file.read_bytes())
        content[len(content) // 2] ^= 1
        file.write_bytes(content)
    again, taken = kept(scene)
    assert not taken and kept(scene)[1]
    assert_same(right, again)


def test_the_last_loops_are_kept_in_files_and_in_memory(make_scene, kept, monkeypatch):
    monkeypatch.setattr(settling, "MOST_STORED", 2)
    scenes = [make_scene(115.0, ring_radius=ring, **SHORT) for ring in (0.308, 0.310, 0.306)]
    starts = SettledLoops(capacity=1)
    for scene in scenes[:2]:  # no file has them yet
        starts.at_rest(scene)
        assert len(starts._settled) == len(starts._tensioned) == 1
    for scene in scenes:
        kept(scene)
    assert len(list(kept.folder.iterdir())) == 2 and kept(scenes[2])[1]

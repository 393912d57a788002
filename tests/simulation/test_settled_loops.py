"""Settled loops that are shared give every scene the bytes that it would get alone."""

import pytest

from tests.conftest import assert_same_arrays
from trackdyn.inputs.errors import InputError
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.settling import SettledLoops
from trackdyn.simulation.simulate import simulate

SHORT = {"duration": 0.05, "lead_in": 0.0, "ramp": 0.05, "integrator": "linearly_implicit", "step": 5e-4}


def assert_shared(scene, starts):
    """A run from a loop that was settled before is the run alone, bit for bit."""
    recording, expected = simulate(scene, starts=starts), simulate(scene)
    assert recording.meta == expected.meta
    assert_same_arrays(recording, expected)


def test_a_series_of_scenes_is_what_each_would_be_alone(make_scene):
    starts = SettledLoops()
    for rpm, ring in ((115.0, 0.308), (210.0, None), (210.0, 0.308)):
        assert_shared(make_scene(rpm, ring_radius=ring, **SHORT), starts)


@pytest.mark.parametrize("fields", [{"chain": "single_pin"}, {"tension": "retensioned", "ring_radius": 0.311}], ids=str)
def test_scenes_that_settle_otherwise_do_not_share(make_scene, fields):
    """After a loop of the plain scene, which a wrong key would take for theirs: all but `LATER` is in it."""
    starts = SettledLoops()
    simulate(make_scene(115.0, **SHORT | {"ring_radius": fields.get("ring_radius", 0.308)}), starts=starts)
    assert_shared(make_scene(130.0, **SHORT | fields), starts)


def test_only_so_many_are_kept(make_scene):
    starts = SettledLoops(capacity=1)
    for ring in (0.308, 0.310):
        simulate(make_scene(115.0, ring_radius=ring, **SHORT), starts=starts)
        assert len(starts._settled) == len(starts._tensioned) == 1


def test_a_step_is_refused_with_a_shared_loop_as_alone():
    """The limits of a step know the speed, which the loop that is shared does not; a step nobody chose follows."""
    starts, rig = SettledLoops(), load_rig("parts").changed(chain__link_mass=6.0)  # light links bear small steps
    large = {"ring_radius": 0.313, "duration": 0.05, "lead_in": 0.0, "ramp": 0.05}
    slow = Scene(rig, 115.0, **large)
    steps = [simulate(Scene(rig, rpm, **large), starts=starts).meta["scene"]["step"] for rpm in (115.0, 110.0)]
    assert len(starts._settled) == 1 and max(steps) < slow.time_step
    with pytest.raises(InputError, match=r"step = 0\.0001: too large .* at a tension of 5\.\d+e\+04 N"):
        simulate(slow.with_(step=1e-4), starts=starts)

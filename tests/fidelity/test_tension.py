"""Tension locked, retensioned or sprung; drag; start of a loop; contact that is not resolved."""

import re

import numpy as np
import pytest

from laboratory.plausible.unknowns import file_ranges
from tests.conftest import recorded, refused
from tests.rigs.test_layouts import random_rig
from trackdyn import InputError, Loop, Scene, load_rig, simulate
from trackdyn.integrate.suspensions import chain_force
from trackdyn.model.arrays import BEARING
from trackdyn.model.constants import SPROCKET
from trackdyn.scene.step import largest_step
from trackdyn.simulation.energy_balance import open_share
from trackdyn.simulation.initial_tension import arc_depths, explained_depth
from trackdyn.simulation.settling import SettledLoops, settle

LARGE = 0.313


def test_a_large_ring_tightens_a_locked_loop_and_no_other(make_scene, rig):
    tension = {}
    for kind in ("locked", "retensioned", "sprung"):
        loop = Loop(make_scene(115.0, ring_radius=LARGE, step=5e-5, tension=kind))
        tension[kind] = loop.layout.settled_tension_n / rig.tension.pre_tension
    assert tension["locked"] > 2
    assert (tension["retensioned"], tension["sprung"]) == pytest.approx((1, 1), rel=0.15)
    # the spring carries the wheel where it settles
    suspensions = loop.model.suspensions
    loop.energy  # noqa: B018 -- forces of the state as it is
    q, direction = loop.state.suspension["q"][0], np.array([suspensions.along_x[0], suspensions.along_y[0]])
    spring = suspensions.preload[0] - suspensions.stiffness[0] * q
    assert abs(direction @ chain_force(loop.work, suspensions.wheel[0]) + spring) < 0.02 * suspensions.preload[0]
    assert q < -1e-4, "a larger ring pulls the wheel in"


def test_coulomb_drag_takes_its_torque_at_any_speed(make_scene, rig):
    recording = recorded(make_scene(210.0, duration=0.5, drag="coulomb"))
    turned = np.abs(recording.wheel_rate[1:, 1:]).sum(axis=0) / recording.rate
    expected = turned @ [wheel.bearing_torque for wheel in rig.wheels.values()]
    assert np.ptp(recording.energy[[0, -1], BEARING]) == pytest.approx(expected, rel=1e-3)


def test_a_sprung_tensioner_is_where_either_integrator_puts_it(make_scene):
    """Position and acceleration agree, and the energy balance closes; the wheel has moved in between."""
    moved, spread = [], []
    for integrator, step in (("semi_implicit", 5e-5), ("linearly_implicit", 1e-4)):
        loop = Loop(make_scene(150.0, tension="sprung", integrator=integrator, step=step, ramp=1.0))
        begin = float(loop.state.suspension["q"][0])
        loop.advance(2.0)
        recording = loop.record(1.0)
        moved.append(loop.state.suspension["q"][0] - begin)
        spread.append(recording.mean[:, 0, 1].std())
        assert abs(open_share(recording.energy, loop.model, 1.0)[0]) < 1e-3
    # both of first order: the position at one moment to some percent, the standard deviation to some per mille
    assert abs(moved[0]) > 1e-4 and moved[0] == pytest.approx(moved[1], rel=2e-2)
    assert spread[0] == pytest.approx(spread[1], rel=3e-3)


@pytest.mark.parametrize("equal_pitch", [0.3035, 0.308])
def test_no_loop_starts_in_the_steel(make_scene, rig, equal_pitch):
    """Contact search finds nothing deeper than r_C, such as 30 mm at the printed equal pitch."""
    changed = rig.changed(sprocket__equal_pitch_radius=equal_pitch)
    loop = SettledLoops().at_rest(make_scene(0.0, rig=changed, ring_radius=0.303, tension="retensioned"))
    angle = loop.state.wheel_angle[SPROCKET]
    bound = explained_depth(loop.model, rig.tension.pre_tension)
    assert arc_depths(loop.scene, loop.model, loop.work, angle).max() < bound < 1e-3
    # turned by a quarter of a pitch, arcs are buried, and that is refused
    loop.state.wheel_angle[SPROCKET] += 0.25 * 2 * np.pi / rig.sprocket.teeth
    refused(loop.check_meshing, match="mm inside a tooth")


def test_the_step_follows_the_tension_of_the_settled_loop(make_scene):
    scene = make_scene(115.0, ring_radius=LARGE, step=1e-3 / 6)  # the pre-tension allows it
    refused(Loop, scene, match=r"step = 0.000166\d*: .* at a tension of 1\.\d+e\+04 N")
    rig = load_rig("parts").changed(chain__link_mass=6.0)  # light links bear small steps
    scene = Scene(rig, 115.0, LARGE)
    loop = Loop(scene)
    tension = loop.layout.settled_tension_n
    assert tension > 2 * rig.tension.pre_tension
    assert loop.scene.step is None and loop.model.step <= largest_step(scene.model, tension) < scene.time_step
    assert loop.changed(motor_rpm=150.0).model.step == loop.model.step == loop.record(0.01).scene.step
    refused(loop.changed, step=1e-4, match=r"step = 0\.0001: too large")


def test_a_loop_that_chatters_while_it_settles_is_settled_in_finer_steps(rig, monkeypatch):
    """Steps of 5e-5 s throw bodies to and fro, at 1.5 rad/s and with strands of 22 to 55 kN."""
    stiff = rig.changed(
        tension__pre_tension=37e3, chain__link_mass=5.8, chain__link_inertia=0.0062, chain__connector_mass=7.8,
        bushing__stiffness=57.0, idler__inertia=0.71, road_wheel__bearing_drag=26.0, impact__speed_floor=0.032,
        wheel_contact__friction_static=0.051, wheel_contact__friction_dynamic=0.046, ring_contact__restitution=0.24,
    )  # fmt: skip
    assert settle(Scene(stiff, 0.0, None)).layout.tension_n == pytest.approx(stiff.tension.pre_tension, rel=0.01)
    monkeypatch.setattr("trackdyn.simulation.settling.HALVINGS", 0)
    monkeypatch.setattr("trackdyn.simulation.settling.kept_folder", lambda: None)
    refused(settle, Scene(stiff, 0.0, None), match=r"does not come to rest: .* 5e-05 s a body still turns at [1-9]\.")


def test_all_refusals_name_one_least_tension_which_is_possible():
    bench, least = load_rig("bench"), set()
    for tension in (0.0, 1000.0):
        slack = Scene(bench.changed(tension__pre_tension=tension), 0.0)
        refusal = refused(settle, slack, words=["idler shifted by -100 mm of tension.travel = 100 mm"])
        least.add(float(re.search(r"must exceed (\S+) N", refusal)[1]))
    assert len(least) == 1
    tension = 1.02 * least.pop()
    layout = settle(Scene(bench.changed(tension__pre_tension=tension), 0.0)).layout
    assert layout.settled_tension_n == pytest.approx(tension, rel=0.01)
    assert abs(layout.tensioner_shift_m) <= bench.tension.travel
    short = bench.changed(tension__travel=0.004, tension__pre_tension=15e3)
    refused(settle, Scene(short, 0.0), match=r"cannot be reached; .* by 4 mm of tension\.travel = 4 mm")


@pytest.mark.parametrize("name", ["paper", "parts"])
def test_both_ends_of_the_range_of_the_tension_are_possible(name):
    path = f"trackdyn/rigs/{name}.yaml"
    for tension in file_ranges(path)["tension.pre_tension"]:
        scene = Scene(load_rig(path).changed(tension__pre_tension=tension), 0.0)
        assert settle(scene).layout.tension_n == pytest.approx(tension, rel=0.01)


def test_a_rig_without_a_ring_is_tensioned_without_one(rig):
    bare = rig.changed(sprocket__ring="none")
    assert settle(Scene(bare, 0.0)).layout.settled_tension_n == pytest.approx(rig.tension.pre_tension, rel=0.01)
    layout = settle(Scene(bare, 0.0, rig.sprocket.ring_radius)).layout
    assert layout.tension_n == pytest.approx(rig.tension.pre_tension, rel=0.01)
    assert layout.settled_tension_n > 1.2 * layout.tension_n, "a ring that comes then tightens the loop"


@pytest.mark.parametrize("number", range(3))
def test_a_tension_is_set_to_a_hundredth_or_refused(number):
    """Tensions of 1 N to 100 kN, on rigs and layouts drawn at random."""
    rig = random_rig(number) if number % 2 else load_rig(("paper", "bench")[number // 2])
    tension = 10.0 ** np.random.default_rng([52, number]).uniform(0, 5)
    try:
        layout = settle(Scene(rig.changed(tension__pre_tension=tension), 100.0)).layout
    except InputError as error:
        assert re.search(r"pre_tension = .* N: (must exceed|cannot be reached)|does not come to rest", str(error))
    else:
        assert layout.tension_n == pytest.approx(tension, rel=0.01)
        assert abs(layout.tensioner_shift_m) <= rig.tension.travel


def test_friction_at_a_tension_far_beyond_that_of_its_limit_does_not_flip(make_scene):
    """Explicit friction on the teeth diverged at 1e-4 s at the 13 kN of the large ring."""
    resolved = simulate(make_scene(115.0, ring_radius=LARGE, step=1e-4, duration=2.0, lead_in=1.0)).resolution
    assert resolved.share < 1e-3 and resolved.state == "yes"

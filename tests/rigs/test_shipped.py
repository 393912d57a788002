"""Every included rig settles and runs with a closed loop and energy balance; the M113 as in Exudyn."""

import numpy as np
import pytest

from tests.conftest import RIG
from trackdyn import DivergenceError, Loop, Scene, load_rig
from trackdyn.integrate.suspensions import along, chain_force
from trackdyn.model.constants import SPROCKET
from trackdyn.rig.rig_file import shipped_rigs
from trackdyn.scene.build import check_stops
from trackdyn.simulation.energy_balance import open_share
from trackdyn.simulation.initial_tension import arc_depths, explained_depth
from trackdyn.simulation.step_check import PIECE
from trackdyn_replication.peers.comparison import require_exudyn, run_peer
from trackdyn_replication.study.settings import PEER_LAWS

STEP, PEER_STEP = 2e-5, 5e-4  # s, where the paper's rig agrees to 0.01 % of a link's way (Figure 14)


@pytest.mark.parametrize("name", shipped_rigs())
def test_it_settles_with_its_tension_on_its_wheels_and_nothing_in_steel(name, settled):
    loop = settled(name)
    rig, depth = loop.scene.rig, arc_depths(loop.scene, loop.model, loop.work, loop.state.wheel_angle[SPROCKET])
    # strands still swing when the tensioner stops; a chain without its ring sits deeper, and its strands are slacker
    for tension in (loop.layout.tension_n, loop.layout.settled_tension_n):
        assert tension == pytest.approx(rig.tension.pre_tension, rel=0.01)
    if loop.model.tooth.present:
        assert depth.max() < explained_depth(loop.model, rig.tension.pre_tension)
    check_stops(rig, loop.arrays.model.suspensions, loop.arrays.state.suspension)
    # forces of all wheels on the chain are its weight: one sum over contacts, the other over masses
    loop.energy  # noqa: B018 -- forces of the state as it is
    total = -sum(np.array(chain_force(loop.arrays.work, wheel)) for wheel in range(len(loop.model.wheels.x)))
    weight = loop.model.chain.gravity * loop.model.chain.mass.sum()
    # the loop is damped to rest, not solved for: strands swing by a few per cent of the weight
    assert total == pytest.approx([0.0, weight], abs=0.05 * weight)


@pytest.mark.parametrize("name", shipped_rigs())
def test_it_runs_with_a_closed_loop_and_energy_balance(name, settled):
    loop = settled(name)
    loop.lead_in()
    recording = loop.record(loop.scene.duration, frame_interval=0.01)
    share, exchanged = open_share(recording.energy, loop.model, loop.scene.duration)
    assert recording.gap.max() < 1.1e-10  # m: the paper's, and the rest after one projection a step at these speeds
    assert exchanged > 0 and abs(share) < 2e-2
    # wheels that the chain lies on turn with it: rim speed within a tenth of the chain's
    wheels, force = loop.model.wheels, 0.0
    for _ in range(20):  # over a passage, since fewer than ten links lie on a wheel at a time
        loop.advance(recording.periods.passage / 20)
        force += loop.work.wheel_force.sum(axis=0) / 20
    rim = -recording.wheel_rate[-50:].mean(axis=0) * (wheels.radius + wheels.half_thickness)
    rim = rim[1:][force[1:] > loop.scene.rig.tension.pre_tension]
    speed = abs(loop.scene.sprocket_rate) * loop.scene.rig.pin_circle
    assert len(rim) and rim == pytest.approx(np.full(len(rim), speed), rel=0.1)


def test_a_step_that_flips_is_refused_within_two_seconds(monkeypatch):
    """Where its limits are out of the way: rounding decides whether it flips, of three steps some do everywhere."""
    monkeypatch.setattr("trackdyn.scene.step.step_limits", lambda *_: {"none": 1.0})
    waited = []
    for step in (2e-4, 2.5e-4, 1e-3 / 3):
        loop = Loop(Scene(load_rig(RIG), 150.0, None, ramp=0.5, step=step))
        loop.advance(loop.scene.ramp)
        before = loop.time
        try:
            loop.record(3.0)
        except DivergenceError as error:
            assert "contacts are not resolved" in str(error)
            waited.append(loop.time - before)
    assert waited and max(waited) <= PIECE + 1e-9


def test_springs_of_arms_hold_what_lies_on_them(settled):
    loop = settled("m113")
    loop.energy  # noqa: B018
    suspensions, rig = loop.arrays.model.suspensions, loop.scene.rig
    assert len(suspensions.wheel) == 5
    for k, wheel in enumerate(suspensions.wheel):
        arm, q = rig.wheels[f"road_{k + 1}"].arm, loop.state.suspension["q"][k]
        lever = np.array([loop.model.wheels.x[wheel] - arm.x, loop.model.wheels.y[wheel] - arm.y])
        fx, fy = chain_force(loop.arrays.work, wheel)
        moment = lever[0] * (fy - arm.mass * rig.gravity) - lever[1] * fx
        spring = suspensions.preload[k] - arm.stiffness * q
        assert moment + spring == pytest.approx(0.0, abs=0.05 * arm.mass * rig.gravity * np.hypot(*lever))
        assert along(suspensions, k, q) == pytest.approx((-lever[1], lever[0]), abs=1e-9)


@pytest.mark.peer
def test_exudyn_agrees():
    """From rest over the ramp and 0.8 s; strands swing by about a millimetre from the first step on."""
    try:
        require_exudyn()
    except Exception as missing:
        pytest.skip(str(missing))
    rig = load_rig("m113")
    rig = rig.changed(**{f"{name}__arm": None for name, wheel in rig.wheels.items() if wheel.arm})
    fields = {"ramp": 0.4, "lead_in": 0.0, "duration": 0.8, "step": STEP, "contact_log": False, **PEER_LAWS}
    scene = Scene(rig, 60.0 * rig.sprocket.transmission_ratio, **fields)
    run, _ = run_peer(scene, PEER_STEP)
    loop = Loop(scene)
    centres = [loop.mass_centres]
    for _ in range(len(run.time) - 1):
        loop.advance(1.0 / rig.rate)
        centres.append(loop.mass_centres)
    apart = np.linalg.norm(np.array(centres) - run.centre, axis=2).max()
    travelled = abs(scene.sprocket_rate) * rig.pin_circle * (scene.ramp / 2 + scene.duration)
    # five times that of the paper's rig, since other loops are longer and slacker
    assert apart < 5e-4 * travelled and travelled > 1.5

"""The chain in MuJoCo with contacts of its own: what it must share with the simulator, and what happens where it is
missing.
"""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from replication.peers.answers import measured_accelerations, ours
from replication.peers.contact import make_contacts
from replication.peers.exudyn_loop import PeerWheels, start_of
from replication.peers.mujoco_contact import ACROSS, RUBBER, cushion, soft
from replication.peers.mujoco_loop import build, lay, run_mujoco, run_mujoco_loop, working_load
from replication.study.extremes.solvers import Pose, posed
from replication.study.settings import PEER_LAWS, PeerAnswers
from trackdyn.chain.riccati import accelerations as chain_accelerations
from trackdyn.errors import DivergenceError, InputError
from trackdyn.parameters.groove import true_depth
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop

pytestmark = pytest.mark.peer
STEP = 5e-4  # s


ASKED = {
    "speed_rpm": 210,
    "ring_radius_m": 0.308,
    "tolerance": 0.05,
    "ramp_s": 0.1,
    "lead_in_s": 0.05,
    "passages": 9,
    "steps_s": {"semi_implicit": [1e-4, 5e-5]},
    "exudyn_steps_s": [1e-3, 5e-4],
    "mujoco_steps_s": {"euler": [5e-4, 2.5e-4]},
}


@pytest.fixture(scope="module")
def scene(rig):
    """The scene of the table, short."""
    return Scene(rig, 115.0, 0.308, duration=1.0, lead_in=0.0, ramp=0.4, spells=False, **PEER_LAWS)


@pytest.fixture(scope="module")
def driven(scene):
    """A run of it in MuJoCo."""
    pytest.importorskip("mujoco")
    return run_mujoco(scene, "euler", STEP)


@pytest.fixture(scope="module")
def built(scene):
    """Model of the settled loop, its chain, start, contacts and wheels."""
    pytest.importorskip("mujoco")
    loop = Loop(scene)
    wheels = loop.model.wheels
    free = PeerWheels(tuple(map(float, wheels.inertia[1:])), tuple(map(float, wheels.drag[1:])))
    contacts = make_contacts(scene, loop.layout["tensioner_shift_m"])
    model = build(loop.model.chain, STEP, contacts, free, *working_load(scene))
    return model, loop.model.chain, start_of(loop.state), contacts, free


def test_a_bent_chain_at_rest_is_accelerated_as_by_the_simulators_solver(rig, built):
    """Gravity and all bushings, the cut one with them, on the settled loop with every contact taken away."""
    import mujoco

    _, chain, start, _, _ = built
    model = build(chain, STEP)
    data = mujoco.MjData(model)
    lay(model, data, chain, start)
    data.qvel[:] = 0.0
    model.opt.tolerance = 0.0
    mujoco.mj_forward(model, data)
    turn = np.zeros(70)
    for i in range(1, 70):
        turn[i] = turn[i - 1] + data.qacc[model.joint(f"joint{i}").dofadr[0]]
    turn += data.qacc[model.joint("turn").dofadr[0]] - turn[35]

    n, none = 70, np.zeros(70)
    turned = np.zeros(n)
    turned[-1] = -2 * pi
    bend = np.roll(start.angle, -1) - start.angle + turned
    torque = -chain.stiffness * (bend - chain.free_angle)
    state, work = posed(Pose(start.angle, none, none, none, none, torque))
    chain_accelerations(chain, state, work, 0.0, 0)
    found = work.sweep.response @ work.sweep.load
    assert np.abs(found).max() > 100  # rad/s2: bushings let go of the bent chain
    # the closing constraint is next to rigid, not rigid
    assert np.abs(turn - found).max() < 2e-3 * np.abs(found).max()


def test_every_bushing_resists_bend_and_rate(built):
    """A hinge's angle turns all bodies behind it, so what acts on it is its own bushing less that of the cut joint."""
    import mujoco

    _, chain, start, _, _ = built
    model = build(chain, STEP)
    data = mujoco.MjData(model)
    rate = np.random.default_rng(2).standard_normal(70)
    lay(model, data, chain, replace(start, rate=rate))
    mujoco.mj_forward(model, data)
    turned = np.zeros(70)
    turned[-1] = -2 * pi
    bend = np.roll(start.angle, -1) - start.angle + turned
    torque = -chain.stiffness * (bend - chain.free_angle) - chain.damping * (np.roll(rate, -1) - rate)
    for i in range(1, 70):
        found = data.qfrc_passive[model.joint(f"joint{i}").dofadr[0]]
        assert found == pytest.approx(torque[i - 1] - torque[-1], abs=1e-9)


def test_a_free_loop_swings_as_the_simulators_does(rig):
    """An oblong, spinning loop without wheels: bushings' damping and the terms of the rates, in the air."""
    pytest.importorskip("mujoco")
    scene = Scene(
        rig, 115.0, None, loop="free", duration=0.4, lead_in=0.0, ramp=0.1, step=2e-5, spells=False, **PEER_LAWS
    )
    loop = Loop(scene)
    chain, start = loop.model.chain, start_of(loop.state)
    runs = [run_mujoco_loop(build(chain, step), chain, start, 0.4, 0.1) for step in (2.5e-4, 1.25e-4)]
    loop.advance(0.4)
    weight = chain.mass / chain.mass.sum()
    # from the middle, since the simulator's own step shows in the fall of the whole
    there = 2 * runs[1].centre - runs[0].centre
    there, here = (place - (weight @ place)[..., None, :] for place in (there, loop.mass_centres))
    assert np.abs(there[-1] - there[0]).max() > 0.3  # m: it does spin
    assert np.abs(there[-1] - here).max() < 1e-5
    # nothing but gravity moves the whole
    middle = chain.mass @ (runs[1].centre[-1] - runs[1].centre[0]) / chain.mass.sum()
    velocity = loop.momentum[:2] / chain.mass.sum() - np.array([0.0, -rig.gravity * 0.4])
    np.testing.assert_allclose(middle, velocity * 0.4 + np.array([0.0, -rig.gravity * 0.4**2 / 2]), atol=2e-3)


def test_the_loop_goes_round_at_the_rigs_pace(rig, scene, driven):
    """Thirteen pitches a turn of the sprocket, whatever slides: the chain's angle about its middle, over the last half
    second.
    """
    centre = driven.centre[-501:]
    speed = np.hypot(*np.diff(centre, axis=0).transpose(2, 0, 1)).mean(axis=0) * rig.sensor.rate
    length = rig.chain.link_length + rig.connector_length
    assert speed.mean() * rig.loop_period(115.0) == pytest.approx(35 * length, rel=0.01)
    # idler and road wheel roll under the chain
    rolling = -np.abs(scene.sprocket_rate) * 13 * length / (2 * pi) / (rig.idler.radius + rig.chain.link_thickness / 2)
    assert driven.wheel_rate[-200:, 0].mean() == pytest.approx(rolling, rel=0.05)


def test_links_lie_as_deep_in_rubber_as_the_rigs_do(rig, scene, driven):
    """Number of links on every wheel and their mean depth, beside the simulator's own run of the same scene."""
    loop = Loop(scene)
    loop.advance(1.0)
    contacts = make_contacts(scene, loop.layout["tensioner_shift_m"])
    chain = loop.model.chain

    def depths(centre, angle):
        half = np.stack([np.cos(angle), np.sin(angle)], axis=-1)[..., ::2, :] * chain.length[0] / 2
        found = []
        for x, y, radius in contacts.circle:
            away = np.array([x, y]) - centre[..., ::2, :]
            along = np.clip((away * half).sum(-1) / (half**2).sum(-1), -1, 1)[..., None]
            found.append(radius + contacts.half_thickness - np.linalg.norm(along * half - away, axis=-1))
        return np.array(found)

    here, there = [], depths(driven.centre[1000:1401:4], driven.angle[1000:1401:4])
    for _ in range(101):
        here.append(depths(loop.mass_centres, loop.state.angle))
        loop.advance(4e-3)
    here = np.array(here).transpose(1, 0, 2)
    for mine, other in zip(here, there, strict=True):
        assert (other > 0).sum() == pytest.approx((mine > 0).sum(), rel=0.08)
        assert other[other > 0].mean() == pytest.approx(mine[mine > 0].mean(), rel=0.15)


def test_connectors_reach_into_the_steel_no_further_than_ours(rig, scene, driven, built):
    """Depth in the true groove: chords of concave arcs and MuJoCo's springs leave some hundredths of a millimetre."""
    _, chain, start, contacts, _ = built
    turned = start.sprocket_angle + scene.sprocket_rate * (driven.time[1000:] - scene.ramp / 2)
    pins = driven.centre[1000:, 1::2] - 0.5 * chain.length[1] * np.stack(
        [np.cos(driven.angle[1000:, 1::2]), np.sin(driven.angle[1000:, 1::2])], axis=2
    )
    deepest, groove = [], rig.groove_profile
    for k, angle in enumerate(turned):
        place = pins[k] - contacts.circle[0, :2]
        polar = np.arctan2(place[:, 1], place[:, 0]) - angle
        off = polar % (2 * pi / 13) - pi / 13
        away = np.hypot(*place.T)
        near = away < contacts.reach
        local = np.column_stack([-away * np.sin(off), away * np.cos(off)])[near]
        deepest.append(true_depth(groove, contacts.arc_radius, local).max())
    assert 1e-5 < np.max(deepest) < 3e-4  # m: they touch


def test_a_contact_is_a_spring_damper_and_inertance_of_the_given_size():
    """A mass of 10 kg on rubber, moving into it: the force that MuJoCo makes at the working depth."""
    mujoco = pytest.importorskip("mujoco")
    law = np.array([4e7, 0.5625, 0.4, 0.3, 0.1, 0.1, 3.0])
    given = cushion(law, 0.3, 2000.0, 0.2, RUBBER)
    assert law[0] * given.depth * np.sqrt(given.depth / (0.3 + given.depth)) == pytest.approx(2000.0)

    def force(depth, speed, slip):
        spec = mujoco.MjSpec()
        spec.option.gravity, spec.option.impratio, spec.option.cone = [0, 0, 0], ACROSS, mujoco.mjtCone.mjCONE_ELLIPTIC
        spec.worldbody.add_geom(name="rim", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.3, 0, 0])
        body = spec.worldbody.add_body(pos=[0, 0.32 - depth, 0], mass=10.0, inertia=[1, 1, 1], explicitinertial=True)
        for axis in ([1, 0, 0], [0, 1, 0]):
            body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        body.add_geom(
            name="link", type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[-0.05, 0, 0, 0.05, 0, 0], size=[0.02, 0, 0]
        )
        spec.add_pair(
            geomname1="rim", geomname2="link", condim=3, friction=[given.friction] * 2 + [0] * 3, **soft(given)
        )
        model = spec.compile()
        model.body_invweight0[:] = [[0, 0], [1, 1]]
        model.opt.tolerance = 0.0
        data = mujoco.MjData(model)
        data.qvel[:] = slip, -speed
        mujoco.mj_forward(model, data)
        return 10 * data.qacc[1] + RUBBER * data.qacc[1], -(10 + ACROSS * RUBBER) * data.qacc[0]

    assert force(given.depth, 0.0, 0.0)[0] == pytest.approx(2000.0, rel=1e-6)
    assert force(given.depth, 0.1, 0.0)[0] - 2000.0 == pytest.approx(0.1 * given.damping, rel=1e-6)
    nudge = 1e-3 * given.depth
    slope = (force(given.depth + nudge, 0.0, 0.0)[0] - 2000.0) / nudge  # the inertance grows with the depth, too
    assert slope == pytest.approx(1.5 * given.stiffness, rel=0.15)
    assert force(given.depth, 0.0, 1e-3)[1] == pytest.approx(1e-3 * min(given.creep, 4000 * ACROSS * RUBBER), rel=1e-6)


def test_the_measure_is_near_ours(rig, scene, driven):
    """Two models of one loop: a few percent apart, not the same."""
    span = rig.loop_period(115.0) / 35
    mine, _, _ = ours(scene.with_(duration=0.6, lead_in=0.4))
    other = measured_accelerations(driven.centre[801:, ::2], 1000.0, span).estimate().value
    assert other == pytest.approx(measured_accelerations(mine, 1000.0, span).estimate().value, rel=0.12)


def test_a_run_that_blows_up_ends_in_a_sentence(built, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    _, chain, start, contacts, free = built
    model = build(chain, 1e-3, contacts, free, 1e6, 1e-3)
    with pytest.raises(DivergenceError, match=r"mujoco: its motion is no longer finite with a step of 0.001 s"):
        run_mujoco_loop(model, chain, start, 0.5, 1e-3)
    assert not list(tmp_path.iterdir())  # no file of warnings


def test_a_step_that_is_no_part_of_the_sample_is_refused(built):
    _, chain, start, _, _ = built
    with pytest.raises(InputError, match=r"must divide the sample interval, 0.001 s"):
        run_mujoco_loop(build(chain, 3e-4), chain, start, 0.1, 1e-3)


@pytest.mark.parametrize("given", [{}, {"euler": [5e-4, 5e-4]}, {"euler": [5e-4, -1e-4]}, {"rk4": [5e-4, 2.5e-4]}])
def test_settings_that_give_no_limit_are_refused(given):
    with pytest.raises((ValueError, InputError), match="mujoco_steps_s"):
        PeerAnswers(**ASKED | {"mujoco_steps_s": given})

"""Joints whose pins part in rubber: against a dense system, the revolute chain, closed forms and conservation laws."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from trackdyn import Scene
from trackdyn.chain.kinematics import bushing_lead, bushing_torques, orient, place
from trackdyn.errors import InputError
from trackdyn.integrate.dynamics import solve_chain
from trackdyn.scene.limits import step_limits
from trackdyn.simulation.loop import Loop

FREE = {"loop": "free", "ring_radius": None, "spells": False}
PITCHES = 4


@pytest.fixture(scope="module")
def small(rig):
    """A rig of four pitches without gravity, its bushings soft."""
    return rig.changed(chain__pitches=PITCHES, sensor__pitch=2, gravity=0.0, bushing__stiffness=20.0,
                       bushing__damping=0.05, bushing__free_angle=-0.7)  # fmt: skip


def make_loop(rig, stiffness=3.5e7, damping=1.2e5, step=1e-4, apart=0.0, **fields):
    """A free loop of eight bodies that tumbles, its pins ``apart`` by some such length (m) and not parting."""
    rig = rig.changed(bushing__radial_stiffness=stiffness, bushing__radial_damping=damping)
    loop = Loop(Scene(rig, 300.0, step=step, **{"joint": "radial"} | FREE | fields))
    rng = np.random.default_rng(1)
    state, length = loop.state, loop.model.chain.length
    rows = length * np.array([-np.sin(state.angle), np.cos(state.angle)])
    extra = rng.normal(0.0, 5.0, len(state.angle))
    state.rate[:] += extra - rows.T @ np.linalg.solve(rows @ rows.T, rows @ extra)  # pins stay together
    state.pin[2:] += [0.3, 0.8]
    if apart:
        state.part[:, :2] = rng.normal(0.0, apart, (len(state.angle), 2))
    return loop


# --- one dense system


def dense(model, state, work, step):
    """Accelerations (3 n) of the mass centres: every body free, joined by forces that the accelerations change.

    Shares nothing with the sweep: points and rates from the places of the pins, forces from the law as documented.
    """
    chain, n = model.chain, len(state.angle)
    k, c = model.radial.stiffness, model.radial.damping
    z = step * (step * k + c)
    pins = np.column_stack([work.pin_x, work.pin_y])
    turn = np.array([[work.cos, -work.sin], [work.sin, work.cos]])
    centre = pins[:-1] + np.einsum("rci,ci->ir", turn, np.array([chain.com_x, chain.com_y]))
    ends = pins[:-1] + chain.length[:, None] * np.column_stack([work.cos, work.sin])
    velocity = np.column_stack([work.com_vx, work.com_vy])
    spin = np.array([[0.0, -1.0], [1.0, 0.0]])
    matrix = np.diag(np.ravel(np.column_stack([chain.mass, chain.mass, chain.inertia])))
    right = np.column_stack([work.force_x, work.force_y - chain.mass * chain.gravity, work.moment])
    for i in range(n):
        o = (i + 1) % n
        u = pins[o] - ends[i]
        middle = ends[i] + u / 2
        ro, ri, wo, wi = middle - centre[o], middle - centre[i], state.rate[o], state.rate[i]
        e = velocity[o] + wo * spin @ ro - velocity[i] - wi * spin @ ri  # of the material points
        mean = (wo + wi) / 2
        rate = e + mean * spin @ u
        # acceleration of the points from one another: rows of the six accelerations, and what the rates give
        rows = np.zeros((2, 3 * n))
        rows[:, 3 * o : 3 * o + 2], rows[:, 3 * o + 2] = np.eye(2), spin @ ro
        rows[:, 3 * i : 3 * i + 2], rows[:, 3 * i + 2] = -np.eye(2), -spin @ ri
        known = -(wo**2) * ro + wi**2 * ri
        opening = (wo**2 + wi**2) / 2 * u  # A = u'' + opening, as far as nothing turns faster
        force = -k * (u + step * rate) - c * (e - step * mean * spin @ rate) + z * (opening - known)
        for body, arm, sign in ((o, ro, 1.0), (i, ri, -1.0)):
            right[body, :2] += sign * force
            right[body, 2] += sign * (arm[0] * force[1] - arm[1] * force[0])
        matrix += z * rows.T @ rows
        twist = np.zeros(3 * n)
        twist[3 * o + 2], twist[3 * i + 2] = 1.0, -1.0
        matrix += bushing_lead(chain, step) * step * chain.damping * np.outer(twist, twist)
        right[o, 2] += work.torque[i]
        right[i, 2] -= work.torque[i]
    return np.linalg.solve(matrix, right.ravel()).reshape(n, 3), centre, pins


def scattered(loop, rng, apart=2e-3, speed=0.3, load=2e3):
    """Part the pins, load the bodies; angles that leave the cut about as far apart as the others."""
    state, work, n = loop.state, loop.work, len(loop.state.angle)
    state.angle[:] += rng.normal(0.0, 0.005, n)
    state.part[:, :2] = rng.normal(0.0, apart, (n, 2))
    state.part[:, 2:] = rng.normal(0.0, speed, (n, 2))
    orient(state.angle, work.cos, work.sin)
    place(loop.model.chain, state, work)
    bushing_torques(loop.model.chain, state, work)
    for loads, size in ((work.force_x, load), (work.force_y, load), (work.moment, 0.03 * load)):
        loads[:] = rng.normal(0.0, size, n)


@pytest.mark.parametrize("step", [1e-5, 1e-4, 2.5e-4])
@pytest.mark.parametrize(("stiffness", "damping"), [(3.5e7, 1.2e5), (1e5, 10.0), (1e9, 0.0)])
def test_sweep_solves_the_dense_system(small, stiffness, damping, step):
    loop = make_loop(small.changed(gravity=9.81), stiffness, damping, step)
    model, state, work = loop.model, loop.state, loop.work
    scattered(loop, np.random.default_rng(2))
    n = len(state.angle)
    expected, centre, pins = dense(model, state, work, step)
    solve_chain(model, state, work, step, None, None, work.radial)
    sweep = work.sweep
    alpha, base = sweep.response @ sweep.load, sweep.base @ sweep.load
    scale = np.abs(expected).max(axis=0)
    np.testing.assert_allclose(alpha, expected[:, 2], rtol=0, atol=1e-10 * scale[2])

    def at(body, point):
        r = point - centre[body]
        return expected[body, :2] + expected[body, 2] * np.array([-r[1], r[0]]) - state.rate[body] ** 2 * r

    np.testing.assert_allclose(base, at(0, pins[0]), rtol=0, atol=1e-10 * scale[:2].max())
    probe = model.sensor.body
    assert probe == 2
    np.testing.assert_allclose(sweep.probe @ sweep.load, at(probe, pins[probe]), rtol=0, atol=1e-10 * scale[:2].max())
    ends = pins[:-1] + model.chain.length[:, None] * np.column_stack([work.cos, work.sin])
    for i in range(n - 1):
        apart = at(i + 1, pins[i + 1]) - at(i, ends[i])
        np.testing.assert_allclose(work.radial.apart[i], apart, rtol=0, atol=1e-10 * scale[:2].max())
    # Newton's law of every body with the forces of its two joints
    outer = np.column_stack([work.force_x, work.force_y - model.chain.mass * model.chain.gravity])
    joints = np.roll(work.radial.force, 1, axis=0) - work.radial.force
    np.testing.assert_allclose(
        outer + joints, model.chain.mass[:, None] * expected[:, :2], rtol=0, atol=1e-9 * np.abs(joints).max()
    )


# --- the revolute chain


def motion_of(loop):
    """Angular accelerations and the acceleration of the first pin."""
    model, state, work = loop.model, loop.state, loop.work
    orient(state.angle, work.cos, work.sin)
    place(model.chain, state, work)
    bushing_torques(model.chain, state, work)
    solve_chain(model, state, work, model.step, None, None, work.radial)
    sweep = work.sweep
    return np.append(sweep.response @ sweep.load, sweep.base @ sweep.load)


def test_accelerations_tend_to_the_revolute_ones(small):
    """With pins together the difference falls as 1 / Z = 1 / (h^2 k), an order of ten for an order of ten."""
    revolute = motion_of(make_loop(small, joint="revolute"))
    errors = [np.abs(motion_of(make_loop(small, k, 0.0)) - revolute).max() for k in (1e10, 1e11, 1e12)]
    assert errors[0] < np.abs(revolute).max()
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.2)
    assert errors[1] / errors[2] == pytest.approx(10.0, rel=0.05)


def test_motion_tends_to_the_revolute_one(small):
    """After a tenth of a second, with the same loss factor: the pins part by tension over stiffness."""
    places = []
    for fields in ({"joint": "revolute"}, *({"stiffness": k, "damping": k / 300.0} for k in (1e7, 1e8, 1e9))):
        loop = make_loop(small, **fields)
        loop.advance(0.1)
        places.append(loop.mass_centres)
    errors = [np.abs(place - places[0]).max() for place in places[1:]]
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.2)
    # the revolute loop projects its closure and this one does not: both err by the step, and not quite alike
    assert errors[1] / errors[2] == pytest.approx(10.0, rel=0.3)


# --- the motion itself, in other coordinates


def rates_of_free_bodies(chain, k, c):
    """Right-hand side for bodies that only forces join: places (n, 2), angles, velocities, angular velocities."""
    n = len(chain.length)
    spin = np.array([[0.0, 1.0], [-1.0, 0.0]])  # r @ spin is e_z x r

    def derivative(_, y):
        place, angle, v, w = y[: 2 * n].reshape(n, 2), y[2 * n : 3 * n], y[3 * n : 5 * n].reshape(n, 2), y[5 * n :]
        along = np.column_stack([np.cos(angle), np.sin(angle)]) * chain.length[:, None] / 2
        out = np.arange(n) - n + 1  # the outboard body of each joint
        behind, ahead = place + along, (place - along)[out]
        u = ahead - behind
        ri, ro = behind + u / 2 - place, ahead - u / 2 - place[out]
        e = v[out] + w[out, None] * (ro @ spin) - v - w[:, None] * (ri @ spin)
        q = -k * u - c * e
        phi = np.append(angle[1:], angle[0] - 2 * np.pi) - angle
        torque = -chain.stiffness * (phi - chain.free_angle) - chain.damping * (w[out] - w)
        force = np.roll(q, 1, axis=0) - q
        about_o, about_i = (r[:, 0] * q[:, 1] - r[:, 1] * q[:, 0] for r in (ro, ri))
        moment = np.roll(about_o + torque, 1) - about_i - torque
        return np.concatenate([v.ravel(), w, (force / chain.mass[:, None]).ravel(), moment / chain.inertia])

    return derivative


def test_error_falls_with_the_first_power_of_the_step(small):
    """Against eight free bodies integrated to ten digits by another method."""
    seconds, k, c = 0.02, 3e4, 30.0
    errors = []
    for step in (1e-4, 5e-5, 2.5e-5):
        loop = make_loop(small, k, c, step, apart=1e-3)
        centre = loop.mass_centres
        v = np.column_stack([loop.work.com_vx, loop.work.com_vy])
        start = np.concatenate([centre.ravel(), loop.angles, v.ravel(), loop.rates])
        loop.advance(seconds)
        if not errors:
            rates = rates_of_free_bodies(loop.model.chain, k, c)
            exact = solve_ivp(rates, (0.0, seconds), start, "DOP853", rtol=1e-11, atol=1e-12)
            assert exact.success
            target = exact.y[:16, -1].reshape(8, 2)
            assert np.abs(target - centre).max() > 0.01  # it moves
            assert np.abs(loop.state.part[:, :2]).max() > 1e-3  # and parts
        errors.append(np.abs(loop.mass_centres - target).max())
    assert errors[-1] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.2)
    assert errors[1] / errors[2] == pytest.approx(2.0, abs=0.1)


# --- conservation


def test_joint_forces_change_neither_momentum(small):
    """Of the accelerations themselves, to rounding: force and reaction act at one point, however far the pins part."""
    loop = make_loop(small, 1e5, 50.0)
    model, state, work = loop.model, loop.state, loop.work
    scattered(loop, np.random.default_rng(5), load=0.0)
    solve_chain(model, state, work, model.step, None, None, work.radial)
    chain, alpha, x = model.chain, work.sweep.response @ work.sweep.load, loop.mass_centres
    outward = np.column_stack([work.cos, work.sin]) * chain.length[:, None]

    def relative(r):
        return alpha[:, None] * np.column_stack([-r[:, 1], r[:, 0]]) - state.rate[:, None] ** 2 * r

    steps = (relative(outward) + work.radial.apart)[:-1]
    pins = work.sweep.base @ work.sweep.load + np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])
    a = pins + relative(outward / 2)
    force = chain.mass[:, None] * a
    turning = x[:, 0] * force[:, 1] - x[:, 1] * force[:, 0] + chain.inertia * alpha
    assert np.abs(force).max() > 100.0
    assert np.abs(force.sum(axis=0)).max() < 1e-11 * np.abs(force).max()
    assert abs(turning.sum()) < 1e-11 * np.abs(turning).max()


def test_free_loop_keeps_its_momenta_with_the_step(small):
    """In steps to first order, as every body turns within a step and the velocities are those of the turned chain."""
    drift = []
    for step in (1e-4, 5e-5):
        loop = make_loop(small, 3e4, 30.0, step, apart=1e-3)
        before = loop.momentum
        loop.advance(0.1)
        assert np.abs(loop.state.part[:, :2]).max() > 1e-3
        drift.append(np.abs(loop.momentum - before).max() / np.abs(before).max())
    assert drift[1] < 1e-3
    assert drift[0] / drift[1] == pytest.approx(2.0, abs=0.2)


def test_account_of_work_closes_with_the_step(small):
    """Kinetic and elastic energy lose what the dampers take; what is open falls with the step."""
    share = []
    for step in (1e-4, 5e-5, 2.5e-5):
        loop = make_loop(small.changed(bushing__stiffness=0.0, bushing__damping=0.0), 3e4, 30.0, step, apart=1e-3)
        before = loop.energy
        loop.advance(0.1)
        change = {name: value - before[name] for name, value in loop.energy.items()}
        assert change["bushing_loss"] > 1e-3 * before["kinetic"]
        assert abs(change["bushing_elastic"]) > 0.3 * change["bushing_loss"]
        rest = sum(change[name] for name in ("kinetic", "bushing_elastic", "bushing_loss"))
        share.append(abs(rest) / change["bushing_loss"])
    assert share[-1] < 0.02
    assert share[0] / share[1] == pytest.approx(2.0, abs=0.4)
    assert share[1] / share[2] == pytest.approx(2.0, abs=0.2)


# --- closed forms


def test_spinning_ring_parts_by_tension_over_stiffness(small):
    """A regular polygon of equal bodies that turns steadily: T = m R w^2 / (2 sin(pi / n)) and u = T / k at each joint.

    The damper must not notice the turning: only e = u' - w x u vanishes there.
    """
    loop = make_loop(small, 3.5e6, 1e5)
    n, length, mass, spin, k = 8, 0.1, 6.0, -25.0, 3.5e6
    chain = loop.model.chain
    for name, value in {"length": length, "mass": mass, "inertia": 0.01, "com_x": length / 2, "com_y": 0.0}.items():
        getattr(chain, name)[:] = value
    state = loop.state
    half = np.pi / n
    # mass centres on a circle of R, half a body and half a parting along its tangent: R sin = (length cos + u) / 2
    stretch = mass * spin**2 / (2 * np.sin(half) * k)  # u = stretch R
    radius = length / 2 / (np.tan(half) - stretch / 2 / np.cos(half))
    u = stretch * radius
    state.angle[:] = -np.pi / 2 - 2 * half * np.arange(n)
    state.rate[:] = spin
    loop.state.part[:] = 0.0
    direction = state.angle - half
    state.part[:, :2] = u * np.column_stack([np.cos(direction), np.sin(direction)])
    state.part[:, 2:] = spin * state.part[:, :2] @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    first = np.array([radius, length / 2])  # body 0 runs downward at the right
    state.pin[:] = [*first, -spin * first[1], spin * first[0]]
    place_again = loop.pins
    assert np.hypot(*loop.mass_centres.T) == pytest.approx(radius, abs=1e-12)
    assert np.hypot(*(place_again[-1] - place_again[0])) == pytest.approx(u, rel=1e-9)  # the cut parts as the others do
    loop.advance(0.2)
    parted = np.hypot(*loop.state.part[:, :2].T)
    assert u > 5e-5
    assert parted == pytest.approx(u, rel=2e-3)  # the step turns 2.5e-3 rad
    assert loop.state.rate == pytest.approx(spin, rel=1e-5)
    assert np.hypot(*loop.joint_forces.T) == pytest.approx(u * k, rel=2e-3)
    assert loop.tension == pytest.approx(u * k, rel=2e-3)


@pytest.fixture(scope="module")
def settled(rig):
    """The loop on its wheels, tensioned."""
    return Loop(Scene(rig, 115.0, joint="radial"))


def test_loop_at_rest_parts_by_tension_over_stiffness(rig, settled):
    """Tension by Newton's law along the bodies from the cut on, without a word of the joints."""
    loop = settled.copy()
    loop.step()
    chain, work = loop.model.chain, loop.work
    outer = np.column_stack([work.force_x, work.force_y - chain.mass * chain.gravity])
    tension = work.sweep.load[:2] + np.cumsum(outer, axis=0)
    parted = loop.state.part[:, :2]
    assert loop.tension == pytest.approx(rig.tension.pre_tension, rel=0.02)
    force = -rig.bushing.radial_stiffness * parted
    np.testing.assert_allclose(force, tension, rtol=0, atol=0.02 * rig.tension.pre_tension)
    assert np.hypot(*parted.T).min() > 0.05e-3
    assert loop.gap == pytest.approx(rig.tension.pre_tension / rig.bushing.radial_stiffness, rel=0.02)


def test_running_loop_accounts_for_its_work(settled):
    loop = settled.copy()
    loop.advance(1.2)
    recording = loop.record(0.3, spells=False)  # refuses an open account
    assert 1e-4 < recording.gap.max() < 5e-4
    assert np.isfinite(recording.mean).all()


def test_copy_and_checkpoint_go_on_alike(settled, tmp_path):
    loop = settled.copy()
    loop.advance(0.05)
    loop.save(tmp_path / "kept.npz")
    other = Loop.load(tmp_path / "kept.npz")
    for each in (loop, other):
        each.advance(0.02)
    assert (loop.state.part == other.state.part).all()
    assert (loop.pins == other.pins).all()


# --- the scene


@pytest.mark.parametrize(
    ("fields", "field"),
    [
        ({"chain": "single_pin"}, "chain"), ({"space": "spatial"}, "joint"), ({"solver": "multipliers"}, "solver"),
        ({"integrator": "rk4"}, "integrator"), ({"integrator": "linearly_implicit"}, "integrator"),
        ({"closure": "elastic_damping"}, "closure"), ({"frame_interval": 0.01}, "frame_interval"),
        ({"joint": "welded"}, "joint"),
    ],
)  # fmt: skip
def test_refused_by_name_with_what_would_do(rig, fields, field):
    with pytest.raises(InputError, match=f"scene: {field} = .* use ") as caught:
        Scene(rig, 115.0, **{"joint": "radial"} | fields)
    assert "\n" not in str(caught.value)


def test_decided_and_said_why(rig):
    scene = Scene(rig, 115.0, joint="radial")
    assert scene.fidelity["joint"].setting == "radial"
    assert scene.fidelity["closure"].reason.startswith("as every other joint")
    assert Scene(rig, 115.0).fidelity["joint"].setting == "revolute"
    assert Scene(rig, 115.0).model.radial is None
    # the connector alone is lighter than connector and link: the teeth allow a shorter step, not a longer one
    teeth = "contact stiffness of the teeth (tooth_contact)"
    soft = scene.with_(rig=rig.changed(bushing__radial_damping=0.0), step=5e-5)
    scenes = scene.with_(joint="revolute"), scene, soft
    limits = [step_limits(each.model, rig.tension.pre_tension)[teeth] for each in scenes]
    assert limits[0] > limits[1] > limits[2] > 0.4 * limits[0]

"""The loop in space against a formulation with six coordinates a body and five constraints a joint."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.kinematics import along_chain, bodies_in_space, closed_rates, irregular_ring
from trackdyn.chain.kinematics import bushing_torques, forward_kinematics, orient
from trackdyn.chain.riccati import accelerate, accelerations
from trackdyn.integrate.plane import plane_dynamics, turn_plane, update_frame
from trackdyn.model.arrays import Plane, make_space_work, make_state, make_work
from trackdyn.model.constants import Chain, Space

# Both solve systems with condition numbers up to 1e5: 1e-11, and two decades for sums and the rank of least squares.
RELATIVE = 1e-9


def turned(omega, arm):
    return np.cross(omega, np.cross(omega, arm))


@pytest.fixture
def polygon(make_scene):
    """Function that makes a closed polygon in a random plane, at random rates that keep it closed, and its loads."""

    def make(n, seed):
        rng = np.random.default_rng(seed)
        length, angle, _ = irregular_ring(n, rng, (0.3 * np.pi / n, 0.2 * np.pi / n))
        heavy = np.arange(n) % 2 == 0
        chain = Chain(
            length, np.where(heavy, 10.0, 2.5), np.where(heavy, 0.012, 0.003), length * rng.uniform(0.4, 0.6, n),
            rng.uniform(-0.01, 0.01, n), 99.0, 12.4, -0.036, 9.81,
        )  # fmt: skip
        space = Space(
            np.where(heavy, 0.13, 0.033), np.where(heavy, 0.16, 0.035), np.zeros((0, 3, 3)), np.zeros((0, 3)),
            np.ones(3), np.ones(3), np.zeros(0), 0.005, 1e6, 1e3, 0,
        )  # fmt: skip
        rate = closed_rates(length, angle, rng.normal(0.0, 5.0, n))
        e = rng.normal(0.0, 1.0, 4)
        plane = Plane(rng.normal(0.0, 2.0, 4), e / np.linalg.norm(e))
        state = make_state(n, n // 2, 1)._replace(pin=rng.normal(0.0, 1.0, 4), angle=angle, rate=rate, plane=plane)
        loads = rng.normal(0.0, 300.0, (n, 3)), rng.normal(0.0, 30.0, (n, 3))
        return make_scene().model._replace(chain=chain, space=space), state, *loads

    return make


def by_the_package(model, state, force, moment):
    """Accelerations of mass centres and angular accelerations, body by body, and torques of the bushings."""
    n, chain = len(state.angle), model.chain
    work, space_work = make_work(n, n // 2, 1), make_space_work(n, 0)
    orient(state.angle, work.cos, work.sin)
    forward_kinematics(chain, state, work)
    work.force_x[:], work.force_y[:], space_work.force_z[:] = force.T
    space_work.moment_x[:], space_work.moment_y[:], work.moment[:] = moment.T
    update_frame(model, state, space_work)
    plane_dynamics(model, state, work, space_work)
    bushing_torques(chain, state, work, 0.0)
    accelerations(chain, state, work, 0.0)
    accelerate(chain, state, work, 0)
    across, *tilt = space_work.acceleration
    assert np.abs(space_work.acceleration).min() > 1e-2  # nothing is zero by chance
    a_p, _, omega, centre, end = bodies_in_space(chain, state)
    (p, q), zero = state.plane.motion[2:], np.zeros(n)
    # d/dt of (p, q, w_i) in P, which turns with (p, q, 0)
    spin = np.column_stack([*np.add.outer(tilt, zero), work.alpha])
    spin = (spin + np.cross([p, q, 0.0], np.column_stack([zero + p, zero + q, state.rate]))) @ a_p.T
    to_centre, to_end = (np.cross(spin, arm) + turned(omega, arm) for arm in (centre, end))
    return along_chain(a_p @ [work.pin_ax[0], work.pin_ay[0], across], to_end)[:-1] + to_centre, spin, work.torque


def by_multipliers(model, state, force, moment, torque):
    """Accelerations of mass centres and angular accelerations from Newton, Euler and multipliers of 5 n rows."""
    a_p, attitude, omega, centre, end = bodies_in_space(model.chain, state)
    n, chain, space = len(state.angle), model.chain, model.space
    mass, right = np.zeros((6 * n, 6 * n)), np.zeros(6 * n)
    rows, right_side = np.zeros((5 * n, 6 * n)), np.zeros(5 * n)
    for i in range(n):
        at, around = slice(6 * i, 6 * i + 3), slice(6 * i + 3, 6 * i + 6)
        mass[at, at] = chain.mass[i] * np.eye(3)
        mass[around, around] = attitude[i] * [space.along[i], space.across[i], chain.inertia[i]] @ attitude[i].T
        right[at] = a_p @ force[i] + chain.mass[i] * np.array([0.0, -chain.gravity, 0.0])
        right[around] = a_p @ moment[i] - np.cross(omega[i], mass[around, around] @ omega[i])
        right[around] += a_p[:, 2] * (torque[i - 1] - torque[i])
        o = (i + 1) % n
        next_at, next_around = slice(6 * o, 6 * o + 3), slice(6 * o + 3, 6 * o + 6)
        out, enter = end[i] - centre[i], -centre[o]
        block = slice(5 * i, 5 * i + 3)
        rows[block, at], rows[block, next_at] = np.eye(3), -np.eye(3)
        rows[block, around], rows[block, next_around] = np.cross(out, np.eye(3)), -np.cross(enter, np.eye(3))
        right_side[block] = turned(omega[o], enter) - turned(omega[i], out)
        # the relative angular velocity stays along the pin: d/dt [b . (omega_o - omega_i)] = 0, b turning with i
        for k in (0, 1):
            b = attitude[i][:, k]
            rows[5 * i + 3 + k, around], rows[5 * i + 3 + k, next_around] = -b, b
            right_side[5 * i + 3 + k] = -np.cross(omega[i], b) @ (omega[o] - omega[i])
    free, inverse = np.linalg.solve(mass, right), np.linalg.solve(mass, rows.T)
    multiplier = np.linalg.lstsq(rows @ inverse, right_side - rows @ free, rcond=1e-12)[0]
    result = (free + inverse @ multiplier).reshape(n, 6)
    return result[:, :3], result[:, 3:]


@pytest.mark.parametrize(("n", "seed"), [(6, 1), (8, 2), (10, 3), (6, 4)])
def test_accelerations_are_those_of_the_general_formulation(polygon, n, seed):
    loop = polygon(n, seed)
    *motion, torque = by_the_package(*loop)
    for values, expected in zip(motion, by_multipliers(*loop, torque), strict=True):
        np.testing.assert_allclose(values, expected, rtol=0, atol=RELATIVE * np.abs(expected).max())


def test_turning_the_plane_keeps_position_and_velocity_of_the_pin(polygon):
    """The exact rotation: components turn back, the pin's velocity in space stays, a turn is a turn."""
    (model, state, *_), step = polygon(6, 6), 0.01
    plane, (p, q) = state.plane, state.plane.motion[2:]

    def in_space(ahead):
        """Attitude of the plane, velocity and place of the pin; `advance` moves x and y itself."""
        a_p = bodies_in_space(model.chain, state)[0]
        across, speed = plane.motion[:2]
        return a_p, a_p @ [*state.pin[2:], speed], a_p @ [*state.pin[:2], across + ahead * speed]

    before, velocity, at = in_space(step)
    turn_plane(model._replace(step=step), state, make_space_work(6, 0))
    after, new_velocity, new_at = in_space(0.0)
    # errors of rounding of a few operations on numbers of the order of 1
    np.testing.assert_allclose([new_velocity, new_at], [velocity, at], rtol=0, atol=1e-14)
    assert np.linalg.norm(plane.attitude) == pytest.approx(1.0, abs=1e-15)
    expected = Rotation.from_rotvec([step * p, step * q, 0.0]).as_matrix()
    np.testing.assert_allclose(before.T @ after, expected, rtol=0, atol=1e-14)

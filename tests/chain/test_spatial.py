"""The loop in space against a formulation with six coordinates a body and five constraints a joint."""

from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.kinematics import closed_rates, irregular_ring
from trackdyn.chain.kinematics import bushing_torques, forward_kinematics, orient
from trackdyn.chain.riccati import accelerate, accelerations
from trackdyn.integrate.plane import plane_dynamics, turn_plane, update_frame
from trackdyn.model.arrays import Plane, make_space_work, make_state, make_work
from trackdyn.model.constants import Chain, Space

# Both solve systems with condition numbers up to some 1e5 in double precision: 1e-16 x 1e5 is 1e-11; two decades
# for sums over the bodies and the rank decision of the least squares.
RELATIVE = 1e-9


def rotation(e):
    """Rotation matrix of Euler parameters, the scalar first."""
    return Rotation.from_quat(np.roll(e, -1)).as_matrix()


def cross_matrix(v):
    return np.cross(v, -np.eye(3))


class Polygon:
    """Closed polygon of links and connectors in a random plane, at random rates that keep it closed."""

    def __init__(self, model, n, seed):
        rng = np.random.default_rng(seed)
        length, angle, _ = irregular_ring(n, rng, (0.3 * np.pi / n, 0.2 * np.pi / n))
        heavy = np.arange(n) % 2 == 0
        self.n = n
        self.chain = Chain(
            length, np.where(heavy, 10.0, 2.5), np.where(heavy, 0.012, 0.003), length * rng.uniform(0.4, 0.6, n),
            rng.uniform(-0.01, 0.01, n), 99.0, 12.4, -0.036, 9.81,
        )  # fmt: skip
        self.space = Space(
            np.where(heavy, 0.13, 0.033), np.where(heavy, 0.16, 0.035), np.zeros((0, 3, 3)), np.zeros((0, 3)),
            np.ones(3), np.ones(3), np.zeros(0), 0.005, 1e6, 1e3, 0,
        )  # fmt: skip
        self.model = model._replace(chain=self.chain, space=self.space)
        rate = closed_rates(length, angle, rng.normal(0.0, 5.0, n))
        e = rng.normal(0.0, 1.0, 4)
        self.plane = Plane(rng.normal(0.0, 2.0, 4), e / np.linalg.norm(e))
        self.state = make_state(n, n // 2, 1)._replace(
            pin=rng.normal(0.0, 1.0, 4), angle=angle, rate=rate, plane=self.plane
        )
        self.force, self.moment = rng.normal(0.0, 300.0, (n, 3)), rng.normal(0.0, 30.0, (n, 3))

    def loaded(self):
        """Work and its spatial arrays under the given loads and those of the moving plane."""
        work, space_work = make_work(self.n, self.n // 2, 1), make_space_work(self.n, 0)
        orient(self.state.angle, work.cos, work.sin)
        forward_kinematics(self.chain, self.state, work)
        work.force_x[:], work.force_y[:], space_work.force_z[:] = self.force.T
        space_work.moment_x[:], space_work.moment_y[:], work.moment[:] = self.moment.T
        update_frame(self.model, self.state, space_work)
        plane_dynamics(self.model, self.state, work, space_work)
        return work, space_work

    def solve(self):
        """Acceleration of the first pin (P), of the plane and of the angles, by the package."""
        work, space_work = self.loaded()
        bushing_torques(self.chain, self.state, work, 0.0)
        accelerations(self.chain, self.state, work, 0.0)
        accelerate(self.chain, self.state, work, 0)
        return np.array([work.pin_ax[0], work.pin_ay[0]]), space_work.acceleration, work.alpha, work.torque

    def bodies(self):
        """Attitude, angular velocity, arms to mass centre and output pin of every body, inertial frame."""
        a_p = rotation(self.plane.attitude)
        p, q = self.plane.motion[2:]
        attitude = np.array([a_p @ Rotation.from_euler("z", angle).as_matrix() for angle in self.state.angle])
        omega = np.array([a_p @ [p, q, w] for w in self.state.rate])
        centre = np.einsum(
            "nij,nj->ni", attitude, np.column_stack([self.chain.com_x, self.chain.com_y, np.zeros(self.n)])
        )
        end = np.einsum("nij,nj->ni", attitude, np.outer(self.chain.length, [1.0, 0.0, 0.0]))
        return a_p, attitude, omega, centre, end

    def solve_dense(self, torque):
        """Accelerations of mass centres and angular accelerations from Newton, Euler and multipliers of 5 n rows."""
        a_p, attitude, omega, centre, end = self.bodies()
        n, chain = self.n, self.chain
        h = a_p[:, 2]
        mass, right = np.zeros((6 * n, 6 * n)), np.zeros(6 * n)
        for i in range(n):
            inertia = (
                attitude[i] @ np.diag([self.space.along[i], self.space.across[i], chain.inertia[i]]) @ attitude[i].T
            )
            mass[6 * i : 6 * i + 3, 6 * i : 6 * i + 3] = chain.mass[i] * np.eye(3)
            mass[6 * i + 3 : 6 * i + 6, 6 * i + 3 : 6 * i + 6] = inertia
            right[6 * i : 6 * i + 3] = a_p @ self.force[i] + chain.mass[i] * np.array([0.0, -chain.gravity, 0.0])
            right[6 * i + 3 : 6 * i + 6] = (
                a_p @ self.moment[i] - np.cross(omega[i], inertia @ omega[i]) + h * (torque[i - 1] - torque[i])
            )
        rows, right_side = np.zeros((5 * n, 6 * n)), np.zeros(5 * n)
        for i in range(n):
            o = (i + 1) % n
            out, enter = end[i] - centre[i], -centre[o]
            block = slice(5 * i, 5 * i + 3)
            rows[block, 6 * i : 6 * i + 3], rows[block, 6 * o : 6 * o + 3] = np.eye(3), -np.eye(3)
            rows[block, 6 * i + 3 : 6 * i + 6] = -cross_matrix(out)
            rows[block, 6 * o + 3 : 6 * o + 6] = cross_matrix(enter)
            right_side[block] = np.cross(omega[o], np.cross(omega[o], enter)) - np.cross(
                omega[i], np.cross(omega[i], out)
            )
            # the relative angular velocity stays along the pin: d/dt [b . (omega_o - omega_i)] = 0, b turning with i
            for k in range(2):
                b = attitude[i][:, k]
                rows[5 * i + 3 + k, 6 * i + 3 : 6 * i + 6], rows[5 * i + 3 + k, 6 * o + 3 : 6 * o + 6] = -b, b
                right_side[5 * i + 3 + k] = -np.cross(omega[i], b) @ (omega[o] - omega[i])
        free = np.linalg.solve(mass, right)
        inverse = np.linalg.solve(mass, rows.T)
        multiplier = np.linalg.lstsq(rows @ inverse, right_side - rows @ free, rcond=1e-12)[0]
        accelerations = (free + inverse @ multiplier).reshape(n, 6)
        return accelerations[:, :3], accelerations[:, 3:]

    def spread(self, pin, plane, alpha):
        """Accelerations of mass centres and angular accelerations from the result of `solve`, body by body."""
        a_p, _, omega, centre, end = self.bodies()
        p, q = self.plane.motion[2:]
        acceleration = a_p @ [*pin, plane[0]]
        centres, angular = [], []
        for i in range(self.n):
            # d/dt of (p, q, w_i) in P, which turns with (p, q, 0)
            spin = a_p @ (np.array([plane[1], plane[2], alpha[i]]) + np.cross([p, q, 0.0], [p, q, self.state.rate[i]]))
            at_centre, acceleration = (
                acceleration + np.cross(spin, arm) + np.cross(omega[i], np.cross(omega[i], arm))
                for arm in (centre[i], end[i])
            )
            centres.append(at_centre)
            angular.append(spin)
        return np.array(centres), np.array(angular)


@pytest.fixture
def polygon(make_scene):
    """Function that makes a polygon: ``polygon(6, seed)``."""
    return partial(Polygon, make_scene().model)


@pytest.mark.parametrize(("n", "seed"), [(6, 1), (8, 2), (10, 3), (6, 4)])
def test_accelerations_are_those_of_the_general_formulation(polygon, n, seed):
    loop = polygon(n, seed)
    pin, plane, alpha, torque = loop.solve()
    centres, angular = loop.spread(pin, plane, alpha)
    expected, expected_angular = loop.solve_dense(torque)
    assert np.abs(plane).min() > 1e-2  # nothing is zero by chance
    np.testing.assert_allclose(centres, expected, rtol=0, atol=RELATIVE * np.abs(expected).max())
    np.testing.assert_allclose(angular, expected_angular, rtol=0, atol=RELATIVE * np.abs(expected_angular).max())


def test_turning_the_plane_keeps_position_and_velocity_of_the_pin(polygon):
    """The exact rotation: components turn back, the pin's velocity in space stays, a turn is a turn."""
    loop = polygon(6, 6)
    space_work = make_space_work(6, 0)
    plane, state, step = loop.plane, loop.state, 0.01
    before = rotation(plane.attitude)
    velocity = before @ [*state.pin[2:], plane.motion[1]]
    at = before @ [*state.pin[:2], plane.motion[0] + step * plane.motion[1]]  # `advance` moves x and y itself
    p, q = plane.motion[2:]
    turn_plane(loop.model._replace(step=step), state, space_work)
    after = rotation(plane.attitude)
    # errors of rounding of a few operations on numbers of the order of 1
    np.testing.assert_allclose(after @ [*state.pin[2:], plane.motion[1]], velocity, rtol=0, atol=1e-14)
    np.testing.assert_allclose(after @ [*state.pin[:2], plane.motion[0]], at, rtol=0, atol=1e-14)
    assert np.linalg.norm(plane.attitude) == pytest.approx(1.0, abs=1e-15)
    relative = before.T @ after
    expected = Rotation.from_rotvec([step * p, step * q, 0.0]).as_matrix()
    np.testing.assert_allclose(relative, expected, rtol=0, atol=1e-14)

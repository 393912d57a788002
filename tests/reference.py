"""Forward dynamics of the planar chain in absolute coordinates with joint multipliers.

Every body carries the coordinates of its mass centre and its angle, every joint two acceleration constraints:

    [ M  J^T ] [ q''     ]   [ Q     ]
    [ J   0  ] [ -lambda ] = [ gamma ].

This dense system checks the transfer-matrix solution (Eqs. 2-7), with which it shares the data of the chain only.
"""

from typing import NamedTuple

import numpy as np


class Accelerations(NamedTuple):
    """Accelerations and joint forces of a closed chain of ``n`` bodies (inertial frame, SI units)."""

    pins: np.ndarray  # (n, 2) accelerations of the input pins, m/s2
    alpha: np.ndarray  # (n,) angular accelerations, rad/s2
    # (n, 2) force on the outboard body ``j + 1`` at joint ``j``, N; the outboard body of the last joint is body 0
    pin_force: np.ndarray
    wheels: np.ndarray  # (w,) angular accelerations of the wheels, rad/s2


class WheelTerms(NamedTuple):
    """Terms of contacts and ``w`` wheels in the dense system; the first wheel does not accelerate."""

    matrix: np.ndarray  # (3 n + w, 3 n + w) inertia over input pins and angle of every body, and the wheels
    inertia: np.ndarray  # (w,) of the wheels, kg m2
    torque: np.ndarray  # (w,) on the wheels, N m


def reference_accelerations(
    chain, angle, rate, force_x, force_y, moment, implicit_step=0.0, torque=None, implicit_damping=None, wheels=None,
    cut=None,
):  # fmt: skip
    """Solve the Newton-Euler equations of all bodies (Eqs. 2-7) together with the joint constraints; SI units.

    Angles along the clockwise loop are not wrapped: neighbours differ by the joint angle. Loads act at mass centres,
    without gravity and bushings. The torque of a bushing on the outboard body is ``-k (phi - phi0) - c (phi' +
    implicit_step phi'')``, or ``torque``, which falls with the joint's acceleration by ``implicit_damping``. ``wheels``
    are `WheelTerms`. ``cut`` is a compliant last joint, with pins apart: its ``h^2 K + h C``, kg, force on body 0, N.
    """
    n, w = len(chain.length), 0 if wheels is None else len(wheels.inertia)
    angle, rate, force_x, force_y, moment = np.longdouble([angle, rate, force_x, force_y, moment])
    c, s = np.cos(angle), np.sin(angle)
    # (n, 2) arms from mass centres to pins, m
    to_input = -np.stack([c * chain.com_x - s * chain.com_y, s * chain.com_x + c * chain.com_y], axis=1)
    to_output = chain.length[:, None] * np.stack([c, s], axis=1) + to_input
    joints = [(i, (i + 1) % n) for i in range(n)]
    if torque is None:
        turn = np.array([angle[o] - angle[i] - (2.0 * np.pi if o < i else 0.0) for i, o in joints])
        torque = -chain.stiffness * (turn - chain.free_angle) - chain.damping * (np.roll(rate, -1) - rate)
        implicit_damping = implicit_step * chain.damping

    size = 3 * n + w
    mass_matrix, load = np.zeros((size, size), dtype=np.longdouble), np.zeros(size, dtype=np.longdouble)
    mass_matrix[range(3 * n), range(3 * n)] = np.stack([chain.mass, chain.mass, chain.inertia], axis=1).ravel()
    load[: 3 * n] = np.stack([force_x, force_y - np.asarray(chain.mass) * chain.gravity, moment], axis=1).ravel()
    jacobian, gamma = np.zeros((2 * n, size), dtype=np.longdouble), np.zeros(2 * n, dtype=np.longdouble)
    for j, (i, o) in enumerate(joints):
        rows = slice(2 * j, 2 * j + 2)
        jacobian[rows, 3 * o : 3 * o + 3] = _pin_jacobian(to_input[o])
        jacobian[rows, 3 * i : 3 * i + 3] = -_pin_jacobian(to_output[i])
        gamma[rows] = rate[o] ** 2 * to_input[o] - rate[i] ** 2 * to_output[i]
        bend = np.zeros(size, dtype=np.longdouble)
        bend[3 * o + 2], bend[3 * i + 2] = 1.0, -1.0
        load += torque[j] * bend
        mass_matrix += implicit_damping * np.outer(bend, bend)
    if cut is not None:
        stiff, force = cut
        end, known = jacobian[-2:], gamma[-2:]
        mass_matrix += stiff * end.T @ end
        load += end.T @ (np.asarray(force) + stiff * known)
        jacobian, gamma = jacobian[:-2], gamma[:-2]
    if wheels is not None:
        # from mass centres to pins: their accelerations are those of the coordinates and the centripetal ones
        to_pins, centripetal = np.eye(size, dtype=np.longdouble), np.zeros(size, dtype=np.longdouble)
        for i in range(n):
            to_pins[3 * i : 3 * i + 2, 3 * i : 3 * i + 3] = _pin_jacobian(to_input[i])
            centripetal[3 * i : 3 * i + 2] = -(rate[i] ** 2) * to_input[i]
        mass_matrix += to_pins.T @ wheels.matrix @ to_pins
        mass_matrix[range(3 * n, size), range(3 * n, size)] += wheels.inertia
        load -= to_pins.T @ (wheels.matrix @ centripetal)
        load[3 * n :] += wheels.torque
        jacobian, gamma = np.vstack([jacobian, np.eye(size)[3 * n]]), np.append(gamma, 0.0)

    zero = np.zeros((len(gamma), len(gamma)), dtype=np.longdouble)
    solution = _solve_symmetric(np.block([[mass_matrix, jacobian.T], [jacobian, zero]]), np.concatenate([load, gamma]))
    motion = solution[: 3 * n].reshape(n, 3)
    pins = np.array([_pin_jacobian(to_input[i]) @ motion[i] - rate[i] ** 2 * to_input[i] for i in range(n)])
    force = -solution[size : size + 2 * (n - (cut is not None))].reshape(-1, 2)
    return Accelerations(*(array.astype(float) for array in (pins, motion[:, 2], force, solution[3 * n : size])))


def _pin_jacobian(arm):
    """(2, 3) map from a body's (x'', y'', alpha) to the tangential acceleration of a pin."""
    return np.array([[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]]], dtype=np.longdouble)


def _solve_symmetric(matrix, rhs):
    """Solve a symmetric indefinite system: equilibrate, factor in double, refine in extended precision."""
    scale = np.ones(len(rhs), dtype=np.longdouble)
    for _ in range(4):  # kg, kg m2 and m are mixed in the matrix: bring every row and column to order one
        scale /= np.sqrt(np.max(np.abs(matrix * scale * scale[:, None]), axis=1))
    scale = np.exp2(np.rint(np.log2(scale)))  # powers of two: scaling rounds nothing
    matrix, rhs = matrix * scale * scale[:, None], rhs * scale
    inverse = np.linalg.inv(matrix.astype(float))
    solution = np.zeros_like(rhs)
    for _ in range(3):
        solution += inverse @ (rhs - np.sum(matrix * solution, axis=1)).astype(float)
    return solution * scale

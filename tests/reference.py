"""Forward dynamics of the planar chain in absolute coordinates with joint multipliers.

The second, independent formulation: every body carries the three coordinates of its mass centre and
its angle, every joint two acceleration constraints, and the whole is one dense system,

    [ M  J^T ] [ q''     ]   [ Q     ]
    [ J   0  ] [ -lambda ] = [ gamma ].

It costs O(n^3) and serves to check the transfer-matrix solution (Eqs. 2-7), so it shares nothing with
it but the data of the chain.
"""

from typing import NamedTuple

import numpy as np

from trackdyn.model.constants import Chain

_REFINEMENTS = 2
_SCALINGS = 4


class Accelerations(NamedTuple):
    """Accelerations and joint forces of a closed chain of ``n`` bodies (inertial frame, SI units)."""

    pin_ax: float  # acceleration of the input pin of body 0, m/s2
    pin_ay: float
    alpha: np.ndarray  # (n,) angular accelerations, rad/s2
    # (n, 2) force on the outboard body ``j + 1`` at joint ``j``, N; the outboard body of the last joint is body 0
    pin_force: np.ndarray


def reference_accelerations(
    chain: Chain,
    angle: np.ndarray,
    rate: np.ndarray,
    force_x: np.ndarray,
    force_y: np.ndarray,
    moment: np.ndarray,
    implicit_step: float = 0.0,
) -> Accelerations:
    """Solve the Newton-Euler equations of all bodies together with the joint constraints.

    Parameters
    ----------
    chain : Chain
        Data of ``n`` bodies, three or more, in order along a clockwise loop.
    angle, rate : (n,) arrays
        Angles, rad (not wrapped: neighbours differ by the joint angle), and their rates, rad/s.
    force_x, force_y, moment : (n,) arrays
        External wrench at each mass centre, N and N m, without gravity and bushings.
    implicit_step : float
        Step of the linearly implicit bushing damping, s: the torque on the outboard body is
        ``-k (phi - phi0) - c (phi' + implicit_step phi'')``.

    Returns
    -------
    Accelerations

    Raises
    ------
    numpy.linalg.LinAlgError
        The constraints are dependent, for example in a chain folded into one straight line.

    Notes
    -----
    Newton-Euler equations of the bodies of Eqs. 2-7. Assembly and residual use extended precision
    (where the platform has it), so that the refinements leave only the final rounding.
    """
    n = len(chain.length)
    angle, rate, force_x, force_y, moment = (
        np.asarray(v, dtype=np.longdouble) for v in (angle, rate, force_x, force_y, moment)
    )
    to_input, to_output = _pin_arms(chain, angle)
    inboard = np.arange(n)
    outboard = (inboard + 1) % n

    mass_matrix = np.diag(np.stack([chain.mass, chain.mass, chain.inertia], axis=1).ravel().astype(np.longdouble))
    load = np.stack([force_x, force_y - np.asarray(chain.mass) * chain.gravity, moment], axis=1).ravel()

    jacobian = np.zeros((2 * len(inboard), 3 * n), dtype=np.longdouble)
    gamma = np.zeros(2 * len(inboard), dtype=np.longdouble)
    implicit_damping = implicit_step * chain.damping
    for j, (i, o) in enumerate(zip(inboard, outboard, strict=True)):
        rows = slice(2 * j, 2 * j + 2)
        jacobian[rows, 3 * o : 3 * o + 3] = _pin_jacobian(to_input[o])
        jacobian[rows, 3 * i : 3 * i + 3] = -_pin_jacobian(to_output[i])
        gamma[rows] = rate[o] ** 2 * to_input[o] - rate[i] ** 2 * to_output[i]

        phi = angle[o] - angle[i] - (2.0 * np.pi if o < i else 0.0)
        torque = -chain.stiffness * (phi - chain.free_angle) - chain.damping * (rate[o] - rate[i])
        turn_o, turn_i = 3 * o + 2, 3 * i + 2
        load[turn_o] += torque
        load[turn_i] -= torque
        mass_matrix[[turn_o, turn_i], [turn_o, turn_i]] += implicit_damping
        mass_matrix[[turn_o, turn_i], [turn_i, turn_o]] -= implicit_damping

    zero = np.zeros((len(gamma), len(gamma)), dtype=np.longdouble)
    solution = _solve_symmetric(np.block([[mass_matrix, jacobian.T], [jacobian, zero]]), np.concatenate([load, gamma]))

    motion = solution[: 3 * n].reshape(n, 3)
    pin = _pin_jacobian(to_input[0]) @ motion[0] - rate[0] ** 2 * to_input[0]
    force = -solution[3 * n :].reshape(-1, 2).astype(float)
    return Accelerations(float(pin[0]), float(pin[1]), motion[:, 2].astype(float), force)


def _pin_arms(chain, angle):
    """Vectors mass centre -> input pin and mass centre -> output pin, inertial frame, (n, 2) each, m."""
    cos, sin = np.cos(angle), np.sin(angle)
    centre_x = cos * chain.com_x - sin * chain.com_y
    centre_y = sin * chain.com_x + cos * chain.com_y
    to_input = np.stack([-centre_x, -centre_y], axis=1)
    to_output = np.stack([cos * chain.length - centre_x, sin * chain.length - centre_y], axis=1)
    return to_input, to_output


def _pin_jacobian(arm):
    """(2, 3) map from a body's (x'', y'', alpha) to the tangential acceleration of a pin."""
    return np.array([[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]]], dtype=np.longdouble)


def _solve_symmetric(matrix, rhs):
    """Solve a symmetric indefinite system: equilibrate, factor in double, refine in extended precision."""
    scale = np.ones(len(rhs), dtype=np.longdouble)
    for _ in range(_SCALINGS):
        # kg, kg m2 and m stand side by side in the matrix: bring every row and column to order one.
        scale /= np.sqrt(np.max(np.abs(matrix * scale * scale[:, None]), axis=1))
    scale = np.exp2(np.rint(np.log2(scale)))  # powers of two: scaling rounds nothing
    matrix = matrix * scale * scale[:, None]
    rhs = rhs * scale
    inverse = np.linalg.inv(matrix.astype(float))
    solution = np.zeros_like(rhs)
    for _ in range(1 + _REFINEMENTS):
        residual = rhs - np.sum(matrix * solution, axis=1)
        solution = solution + inverse @ residual.astype(float)
    return solution * scale

"""The integrators by name, with the order that each declares, and the arrays that each needs."""

from typing import NamedTuple

import numpy as np

from trackdyn.chain.implicit import make_implicit_work

# order of the error of a smooth motion (closed chain and bushings, no contact that begins or ends)
ORDERS = {"semi_implicit": 1, "linearly_implicit": 1, "rk4": 4, "adaptive": 5}
SOLVERS = ("riccati", "transfer_product", "multipliers")
TRANSFER_PRODUCT, MULTIPLIERS = 1, 2


class RungeKutta(NamedTuple):
    """An explicit Runge-Kutta method and the arrays of its stages.

    Attributes
    ----------
    a : (s, s) array
        Coefficients of the stages.
    b, error : (s,) arrays
        Weights of the step; weights of the estimated error (all 0: fixed step).
    tolerance : float
        Relative and scaled absolute error a step may make; 0: fixed step.
    start, scale : (m,) arrays
        State at the start of a step, and the size of each entry below which the tolerance is absolute.
    slope : (s, m) array
        Derivative of the state at each stage.
    tooth_impact, wheel_impact : arrays
        Initial impact velocities at the start of the step: the stages do not change the memory.
    next_step : (1,) array
        Step that the error control would take next, s.
    counts : (2,) integer array
        Steps taken and rejected.
    """

    a: np.ndarray
    b: np.ndarray
    error: np.ndarray
    tolerance: float
    start: np.ndarray
    scale: np.ndarray
    slope: np.ndarray
    tooth_impact: np.ndarray
    wheel_impact: np.ndarray
    next_step: np.ndarray
    counts: np.ndarray


_RK4 = ([[0, 0, 0, 0], [1 / 2, 0, 0, 0], [0, 1 / 2, 0, 0], [0, 0, 1, 0]], [1 / 6, 1 / 3, 1 / 3, 1 / 6], [0, 0, 0, 0])
# Dormand and Prince 1980, 5(4); the weights of the error are those of the 5th less those of the 4th order
_DOPRI5 = (
    [
        [0, 0, 0, 0, 0, 0, 0],
        [1 / 5, 0, 0, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0, 0],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84, 0],
    ],
    [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84, 0],
    [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40],
)


def make_method(integrator: str, n: int, pitches: int, wheels: int, tolerance: float = 0.0):
    """What the time loop needs of an integrator: None for semi-implicit Euler, which needs nothing more."""
    if integrator == "semi_implicit":
        return None
    if integrator == "linearly_implicit":
        return make_implicit_work(n, wheels)
    a, b, error = (np.array(part, dtype=float) for part in (_RK4 if integrator == "rk4" else _DOPRI5))
    size = 4 + 2 * n + 2 * wheels + 7
    scale = np.ones(size)
    scale[4 + n : 4 + 2 * n] = 10.0  # angular velocities are of the order of 10 rad/s
    scale[4 + 2 * n + wheels : 4 + 2 * n + 2 * wheels] = 10.0
    scale[-7:] = np.inf  # the account of work does not steer the step
    return RungeKutta(
        a, b, error, tolerance if integrator == "adaptive" else 0.0, np.zeros(size), scale, np.zeros((len(b), size)),
        np.zeros(2 * pitches), np.zeros((pitches, wheels)), np.zeros(1), np.zeros(2, np.int64),
    )  # fmt: skip

"""Roots and least squares of a few unknowns: to import `scipy.optimize` for them takes longer than to settle a loop."""

from collections.abc import Callable
from itertools import combinations

import numpy as np

MOST_STEPS = 200  # halving alone needs 60 from the widest interval to the last digit


def root(function: Callable[[float], float], low: float, high: float, tolerance: float = 0.0) -> float:
    """A root between two places where a continuous function has different signs, by Chandrupatla's method.

    ``tolerance`` is the largest error beyond rounding. Raises `ValueError`: the function has one sign at both ends.
    Source: T. R. Chandrupatla: A new hybrid quadratic/bisection algorithm for finding the zero of a nonlinear function
    without using derivatives. Advances in Engineering Software 28 (1997) 145-149.
    """
    a, b, share = high, low, 0.5
    fa, fb = function(a), function(b)
    if fa * fb > 0.0:
        raise ValueError("the function has one sign at both ends")
    for _ in range(MOST_STEPS):
        best, width = a if abs(fa) < abs(fb) else b, abs(b - a)
        near = 2.0 * np.finfo(float).eps * abs(best) + 0.5 * tolerance
        if fa == 0.0 or fb == 0.0 or 2.0 * near > width:
            break
        x = a + min(max(share, near / width), 1.0 - near / width) * (b - a)
        c, fc, fx = a, fa, function(x)
        if fx * fa < 0.0:
            b, c, fb, fc = a, b, fa, fb
        a, fa = x, fx
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
        share = 0.5
        if phi**2 < xi and (1.0 - phi) ** 2 < 1.0 - xi:  # inverse quadratic interpolation lies between a and b
            share = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
    return best


def nonnegative_least_squares(matrix: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Least squares over a few unknowns of which none is negative: the best of all choices of those that are not 0."""
    best, least = np.zeros(matrix.shape[1]), float(target @ target)
    for count in range(1, len(best) + 1):
        for free in map(list, combinations(range(len(best)), count)):
            solution = np.linalg.lstsq(matrix[:, free], target, rcond=None)[0]
            rest = float(np.sum((matrix[:, free] @ solution - target) ** 2))
            if (solution >= 0.0).all() and rest < least:
                best, least = np.zeros(len(best)), rest
                best[free] = solution
    return best

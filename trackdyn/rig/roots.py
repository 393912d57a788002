"""Roots and least squares of a few unknowns: to import `scipy.optimize` for them takes longer than to settle a loop."""

from collections.abc import Callable
from itertools import combinations

import numpy as np

MOST_STEPS = 200  # halving alone needs 60 from the widest interval to the last digit


def root(function: Callable[[float], float], low: float, high: float, tolerance: float = 0.0) -> float:
    """A root between two places where a continuous function has different signs, by Brent's method.

    ``tolerance`` is the largest error beyond rounding. Raises `ValueError`: the function has one sign at both ends.
    Source: R. P. Brent: Algorithms for Minimization without Derivatives. Prentice-Hall, 1973, chapter 4.
    """
    a, b = low, high
    fa, fb = function(a), function(b)
    if fa * fb > 0.0:
        raise ValueError("the function has one sign at both ends")
    c, fc, d, e = a, fa, b - a, b - a
    for _ in range(MOST_STEPS):
        if abs(fc) < abs(fb):
            a, b, c, fa, fb, fc = b, c, b, fb, fc, fb
        near, half = 2.0 * np.finfo(float).eps * abs(b) + 0.5 * tolerance, 0.5 * (c - b)
        if fb == 0.0 or abs(half) <= near:
            break
        if abs(e) < near or abs(fa) <= abs(fb):
            d = e = half
        else:
            s = fb / fa
            if a == c:
                p, q = 2.0 * half * s, 1.0 - s
            else:
                q, r = fa / fc, fb / fc
                p, q = s * (2.0 * half * q * (q - r) - (b - a) * (r - 1.0)), (q - 1.0) * (r - 1.0) * (s - 1.0)
            p, q = abs(p), -q if p > 0.0 else q
            if 2.0 * p < min(3.0 * half * q - abs(near * q), abs(e * q)):
                d, e = p / q, d
            else:
                d = e = half
        a, fa = b, fb
        b += d if abs(d) > near else (near if half > 0.0 else -near)
        fb = function(b)
        if fb * fc > 0.0:
            c, fc, d, e = a, fa, b - a, b - a
    return b


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

"""Roots of functions without `scipy.optimize`, whose import takes longer than settling a loop."""

from collections.abc import Callable

import numpy as np

MOST_STEPS = 200  # bisection needs 60 from the widest interval to the last digit


def root(function: Callable[[float], float], low: float, high: float, tolerance: float = 0.0) -> float:
    """Return a root between two points at which a continuous function has different signs, by Chandrupatla's method.

    ``tolerance`` is the largest error beyond rounding. Raises `ValueError`: the function has one sign at both ends.
    Source: T. R. Chandrupatla, Advances in Engineering Software 28 (1997) 145-149.
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

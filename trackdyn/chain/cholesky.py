"""Solution of three equations with a symmetric positive definite matrix, for the sweeps of a chain and its plane."""

from math import sqrt

from trackdyn.jit import inlined


@inlined
def factored(a11, a12, a13, a22, a23, a33):
    """Return the Cholesky factor ``(l11, l21, l31, l22, l32, l33)`` of a symmetric positive definite 3 x 3 matrix."""
    l11 = sqrt(a11)
    l21 = a12 / l11
    l31 = a13 / l11
    l22 = sqrt(a22 - l21 * l21)
    l32 = (a23 - l31 * l21) / l22
    return l11, l21, l31, l22, l32, sqrt(a33 - l31 * l31 - l32 * l32)


@inlined
def solve_factored(factor, right):
    """Solve three equations by the Cholesky factor ``(l11, l21, l31, l22, l32, l33)`` of their matrix."""
    l11, l21, l31, l22, l32, l33 = factor
    y1 = right[0] / l11
    y2 = (right[1] - l21 * y1) / l22
    z3 = (right[2] - l31 * y1 - l32 * y2) / l33 / l33
    z2 = (y2 - l32 * z3) / l22
    return (y1 - l21 * z2 - l31 * z3) / l11, z2, z3

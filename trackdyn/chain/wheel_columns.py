"""Columns of the wheels in the sweep of a linearly implicit step (`chain.riccati`, `chain.implicit`).

Friction on a wheel that turns freely couples the bodies on it to the wheel's acceleration: the relation of the sweep
gets a column for every wheel but the sprocket, after the three of the cut load and the constant one.
"""

from trackdyn.chain.cholesky import solve_factored
from trackdyn.jit import fused
from trackdyn.model.arrays import Work


@fused
def add_slopes(implicit, i, dx, dy, s):
    """Add the contact slopes of a body to S and its coupling to the wheels' columns; shift these to its output."""
    slopes, column = implicit.inertia, implicit.column
    for wheel in range(1, column.shape[0]):
        for r in range(3):
            column[wheel, r] += implicit.couple[i, wheel, r]
        column[wheel, 2] += dy * column[wheel, 0] - dx * column[wheel, 1]
    return (
        s[0] - slopes[i, 0], s[1] - slopes[i, 1], s[2] - slopes[i, 3],
        s[3] - slopes[i, 2], s[4] - slopes[i, 4], s[5] - slopes[i, 5],
    )  # fmt: skip


@fused
def hinge_columns(implicit, joint, s, implicit_damping):
    """Transfer the wheels' columns across a joint, as in `riccati._hinge`."""
    column = implicit.column
    d = 1.0 / (s[5] - implicit_damping)
    for wheel in range(1, column.shape[0]):
        g = column[wheel, 2]
        implicit.gain[joint, wheel] = g * d
        column[wheel, 0] -= s[2] * d * g
        column[wheel, 1] -= s[4] * d * g
        column[wheel, 2] = -implicit_damping * d * g


@fused
def meet_columns(implicit, factor):
    """Solve for the wheels' columns of acceleration where the sweeps meet, into ``implicit.end`` and ``column``."""
    column, end = implicit.column, implicit.end
    implicit.row[:, :] = 0.0
    for wheel in range(1, column.shape[0]):
        end[wheel, 0], end[wheel, 1], end[wheel, 2] = solve_factored(factor, column[wheel])
        for r in range(3):
            column[wheel, r] = end[wheel, r]


@fused
def return_columns(implicit, work: Work, i, arm, motion):
    """Shift the wheels' columns from a body's output to its input; add the body to the row of each wheel.

    ``motion`` holds the columns of the acceleration of the body's input pin and of its angular acceleration.
    """
    (dx, dy), (x, y, a) = arm, motion
    z, gain = implicit.column, work.sweep.gain
    last = work.sweep.response.shape[0] - 1
    for wheel in range(1, z.shape[0]):
        alpha = z[wheel, 2]
        if i < last:
            p1, p2, q = gain[i, 0], gain[i, 1], gain[i, 2]
            alpha = q * alpha - p1 * z[wheel, 0] - p2 * z[wheel, 1] - implicit.gain[i, wheel]
        z[wheel, 0] += dy * alpha
        z[wheel, 1] -= dx * alpha
        z[wheel, 2] = alpha
        implicit.response[i, wheel] = alpha
    for wheel in range(1, z.shape[0]):
        # acceleration of this body as the friction on the wheel feels it
        u, v, w = implicit.couple[i, wheel, 0], implicit.couple[i, wheel, 1], implicit.couple[i, wheel, 2]
        if u != 0.0 or v != 0.0:
            for k in range(4):
                implicit.row[wheel, k] += u * x[k] + v * y[k] + w * a[k]
            for k in range(1, z.shape[0]):
                implicit.row[wheel, 3 + k] += u * z[k, 0] + v * z[k, 1] + w * z[k, 2]

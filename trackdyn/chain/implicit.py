"""The Riccati sweep of a linearly implicit step: contact and bushing slopes ride along with the inertia.

A force that depends on place and velocity is led to the end of the step by its slopes,
``f + h df/dq q' - (h C + h^2 K) q''``. Contacts act on one body each, so ``h C + h^2 K`` of a body adds
to its inertia and the sweep keeps its form; friction on a wheel that turns freely couples the bodies
on it to the wheel's acceleration, which is carried as one more column. Everything else is as in
`chain.riccati`.
"""

from typing import NamedTuple

import numpy as np

from trackdyn.chain.model import Chain
from trackdyn.chain.riccati import invert_closure
from trackdyn.jit import kernel


class ImplicitWork(NamedTuple):
    """What the contacts hand to the sweep, and what the sweep writes, for ``n`` bodies and ``w`` wheels.

    The columns of ``response``, ``base``, ``end`` are the three cut loads, the constant part and the
    acceleration of each wheel but the sprocket.

    Attributes
    ----------
    inertia : (n, 6) array
        ``h C + h^2 K`` of the contacts of a body about its input pin: xx, xy, yy, x-angle, y-angle, angle.
    couple : (n, w, 3) array
        Load on a body (force, moment about its input pin) for a unit acceleration of a wheel.
    wheel_inertia : (w,) array
        ``h C`` of the friction on each wheel, kg m2.
    column : (3, w + 3) array
        E of the sweep.
    gain : (n, w + 6) array
        As in `riccati.SweepWork`.
    response : (n, w + 3) array
        Angular acceleration of each body.
    base, probe, end : (2, w + 3), (2, w + 3), (3, w + 3) arrays
        Acceleration of the input pin of body 1; of that of the probe's body; of the output of the last body.
    row : (w, w + 3) array
        Acceleration of the bodies on each wheel, weighted with their coupling.
    matrix : (w + 2, w + 3) array
        Equations for the cut loads and the wheels.
    load : (w + 3,) array
        Their solution.
    """

    inertia: np.ndarray
    couple: np.ndarray
    wheel_inertia: np.ndarray
    column: np.ndarray
    gain: np.ndarray
    response: np.ndarray
    base: np.ndarray
    probe: np.ndarray
    end: np.ndarray
    row: np.ndarray
    matrix: np.ndarray
    load: np.ndarray


def make_implicit_work(n: int, wheels: int) -> ImplicitWork:
    """Allocate the arrays for ``n`` bodies and ``wheels`` wheels, the sprocket among them."""
    columns = 4 + wheels - 1
    return ImplicitWork(
        np.zeros((n, 6)),
        np.zeros((n, wheels, 3)),
        np.zeros(wheels),
        np.zeros((3, columns)),
        np.zeros((n, 3 + columns)),
        np.zeros((n, columns)),
        np.zeros((2, columns)),
        np.zeros((2, columns)),
        np.zeros((3, columns)),
        np.zeros((wheels, columns)),
        np.zeros((columns - 1, columns)),
        np.zeros(columns),
    )


@kernel
def accelerations(
    chain: Chain, cos, sin, rate, force_x, force_y, moment, torque, implicit_damping, wheel_torque, wheel_inertia,
    wheel_drag, wheel_rate, step, probe_body, compliance, cut_force_x, cut_force_y, work, implicit: ImplicitWork,
):  # fmt: skip
    """Accelerations of chain and wheels at the end of a linearly implicit step.

    Parameters
    ----------
    chain, cos, sin, rate, force_x, force_y, moment, torque, probe_body
        As in `riccati.sweep`, the forces led to the end of the step with the accelerations left out.
    implicit_damping : float
        ``h c + h^2 k`` of the bushings.
    wheel_torque, wheel_inertia, wheel_drag, wheel_rate : (w,) arrays
        Torque of the contacts, moment of inertia, bearing drag and rate of the wheels.
    step : float
        h, s.
    compliance, cut_force_x, cut_force_y : float
        ``1 / (h^2 K + h C)`` of a compliant cut and its force on body 1 (as in `riccati.close_compliant`);
        0 for a rigid cut.
    work : riccati.SweepWork
        Receives the accelerations in the form that the time loop reads: columns for the cut load.
    implicit : ImplicitWork
        ``inertia``, ``couple`` and ``wheel_inertia`` are read, the rest is written; its last entries
        of ``load`` are the accelerations of the wheels.
    """
    n = rate.shape[0]
    columns = implicit.load.shape[0]
    e = implicit.column
    gain, response, added = implicit.gain, implicit.response, implicit.inertia
    s11 = s12 = s13 = s22 = s23 = s33 = 0.0
    e[:] = 0.0
    e[0, 0] = e[1, 1] = e[2, 2] = 1.0
    for i in range(n):
        c, s = cos[i], sin[i]
        dx = chain.length[i] * c
        dy = chain.length[i] * s
        gx = chain.com_x[i] * c - chain.com_y[i] * s
        gy = chain.com_x[i] * s + chain.com_y[i] * c
        w2 = rate[i] * rate[i]
        m = chain.mass[i]
        s11 -= m + added[i, 0]
        s12 -= added[i, 1]
        s22 -= m + added[i, 2]
        s13 += m * gy - added[i, 3]
        s23 -= m * gx + added[i, 4]
        s33 -= chain.inertia[i] + m * (gx * gx + gy * gy) + added[i, 5]
        fx = force_x[i]
        fy = force_y[i] - m * chain.gravity
        ax = w2 * dx
        ay = w2 * dy
        e[0, 3] += fx + m * w2 * gx + s11 * ax + s12 * ay
        e[1, 3] += fy + m * w2 * gy + s12 * ax + s22 * ay
        e[2, 3] += moment[i] + gx * fy - gy * fx + s13 * ax + s23 * ay
        for k in range(4, columns):
            for r in range(3):
                e[r, k] += implicit.couple[i, k - 3, r]
        s33 += 2.0 * (dy * s13 - dx * s23) + dy * dy * s11 + dx * dx * s22 - 2.0 * dx * dy * s12
        s13 += dy * s11 - dx * s12
        s23 += dy * s12 - dx * s22
        for k in range(columns):
            e[2, k] += dy * e[0, k] - dx * e[1, k]
        if i < n - 1:
            d = 1.0 / (s33 - implicit_damping)
            p1 = s13 * d
            p2 = s23 * d
            p3 = s33 * d
            gain[i, 0] = p1
            gain[i, 1] = p2
            gain[i, 2] = p3
            for k in range(columns):
                g = e[2, k] - (torque[i] if k == 3 else 0.0)
                gain[i, 3 + k] = g * d
                e[0, k] -= p1 * g
                e[1, k] -= p2 * g
                e[2, k] -= p3 * g
            s11 -= p1 * s13
            s12 -= p1 * s23
            s22 -= p2 * s23
            s13 -= p1 * s33
            s23 -= p2 * s33
            s33 -= p3 * s33

    # end of the chain: S z + E = lambda
    l11 = np.sqrt(-s11)
    l21 = -s12 / l11
    l31 = -s13 / l11
    l22 = np.sqrt(-s22 - l21 * l21)
    l32 = (-s23 - l31 * l21) / l22
    l33 = np.sqrt(-s33 - l31 * l31 - l32 * l32)
    end, base = implicit.end, implicit.base
    for k in range(columns):
        y1 = (e[0, k] - (1.0 if k == 0 else 0.0)) / l11
        y2 = (e[1, k] - (1.0 if k == 1 else 0.0) - l21 * y1) / l22
        y3 = (e[2, k] - (1.0 if k == 2 else 0.0) - l31 * y1 - l32 * y2) / l33
        end[2, k] = y3 / l33
        end[1, k] = (y2 - l32 * end[2, k]) / l22
        end[0, k] = (y1 - l21 * end[1, k] - l31 * end[2, k]) / l11

    # back-substitution, one column after the other in e = [x'', y'', Omega']
    row = implicit.row
    row[:] = 0.0
    e[:] = end
    for i in range(n - 1, -1, -1):
        dx = chain.length[i] * cos[i]
        dy = chain.length[i] * sin[i]
        w2 = rate[i] * rate[i]
        for k in range(columns):
            a = e[2, k]
            if i < n - 1:
                a = (1.0 - gain[i, 2]) * a - gain[i, 0] * e[0, k] - gain[i, 1] * e[1, k] - gain[i, 3 + k]
            e[2, k] = a
            response[i, k] = a
            e[0, k] += dy * a + (w2 * dx if k == 3 else 0.0)
            e[1, k] -= dx * a - (w2 * dy if k == 3 else 0.0)
            for wheel in range(1, row.shape[0]):
                row[wheel, k] += (
                    implicit.couple[i, wheel, 0] * e[0, k]
                    + implicit.couple[i, wheel, 1] * e[1, k]
                    + implicit.couple[i, wheel, 2] * a
                )
        if i == probe_body:
            for k in range(columns):
                implicit.probe[0, k] = e[0, k]
                implicit.probe[1, k] = e[1, k]
    for k in range(columns):
        base[0, k] = e[0, k]
        base[1, k] = e[1, k]

    # cut loads and wheels: closure rows, torque law of the cut, motion of each wheel
    matrix, load = implicit.matrix, implicit.load
    unknowns = columns - 1
    for k in range(columns):
        j = k if k < 3 else (unknowns if k == 3 else k - 1)
        sign = -1.0 if k == 3 else 1.0
        matrix[0, j] = sign * (end[0, k] - base[0, k])
        matrix[1, j] = sign * (end[1, k] - base[1, k])
        matrix[2, j] = sign * implicit_damping * (response[0, k] - response[n - 1, k])
        for wheel in range(1, row.shape[0]):
            matrix[2 + wheel, j] = -sign * row[wheel, k]
    matrix[0, 0] -= compliance
    matrix[1, 1] -= compliance
    matrix[0, unknowns] -= compliance * cut_force_x
    matrix[1, unknowns] -= compliance * cut_force_y
    matrix[2, 2] += 1.0
    matrix[2, unknowns] += torque[n - 1]
    for wheel in range(1, row.shape[0]):
        matrix[2 + wheel, 2 + wheel] += wheel_inertia[wheel] + implicit.wheel_inertia[wheel] + step * wheel_drag[wheel]
        matrix[2 + wheel, unknowns] += wheel_torque[wheel] - wheel_drag[wheel] * wheel_rate[wheel]
    _eliminate(matrix)
    for k in range(columns):
        load[k] = 1.0 if k == 3 else matrix[k if k < 3 else k - 1, unknowns]

    # hand over in the form of the plain sweep, the wheels' columns folded into the constant one
    for k in range(4):
        for i in range(n):
            work.response[i, k] = response[i, k]
        for r in range(2):
            work.base[r, k] = base[r, k]
            work.probe[r, k] = implicit.probe[r, k]
        for r in range(3):
            work.end[r, k] = end[r, k]
        work.load[k] = load[k]
    invert_closure(compliance, implicit_damping, work)
    for k in range(4, columns):
        for i in range(n):
            work.response[i, 3] += response[i, k] * load[k]
        for r in range(2):
            work.base[r, 3] += base[r, k] * load[k]
            work.probe[r, 3] += implicit.probe[r, k] * load[k]
        for r in range(3):
            work.end[r, 3] += end[r, k] * load[k]


@kernel
def _eliminate(matrix):
    """Gauss-Jordan elimination with row exchange of the augmented ``(m, m + 1)`` matrix, in place."""
    size = matrix.shape[0]
    for column in range(size):
        pivot = column
        for r in range(column + 1, size):
            if abs(matrix[r, column]) > abs(matrix[pivot, column]):
                pivot = r
        if pivot != column:
            for k in range(size + 1):
                matrix[pivot, k], matrix[column, k] = matrix[column, k], matrix[pivot, k]
        scale = 1.0 / matrix[column, column]
        for k in range(column, size + 1):
            matrix[column, k] *= scale
        for r in range(size):
            if r != column:
                factor = matrix[r, column]
                for k in range(column, size + 1):
                    matrix[r, k] -= factor * matrix[column, k]

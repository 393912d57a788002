"""Linearly implicit steps: slopes of contacts and bushings ride along in the Riccati sweep.

A force that depends on place and velocity is led to the end of the step by its slopes,
``f + h df/dq q' - (h C + h^2 K) q''``. Contacts act on one body each, so ``h C + h^2 K`` of a body adds
to its inertia and the sweep keeps its form; friction on a wheel that turns freely couples the bodies
on it to the wheel's acceleration, which is carried as one more column (`chain.riccati.sweep`). The cut
load and the wheels' accelerations then follow from one small system.
"""

from typing import NamedTuple

import numpy as np

from trackdyn.chain.model import Chain
from trackdyn.chain.riccati import invert_closure, sweep
from trackdyn.jit import kernel


class ImplicitWork(NamedTuple):
    """What the contacts hand to the sweep, and what it writes, for ``n`` bodies and ``w`` wheels.

    Row 0 of the arrays with a row a wheel belongs to the sprocket, whose motion is prescribed, and stays 0.

    Attributes
    ----------
    inertia : (n, 6) array
        ``h C + h^2 K`` of the contacts of a body about its input pin: xx, xy, yy, x-angle, y-angle, angle.
    couple : (n, w, 3) array
        Load on a body (force, moment about its input pin) for a unit acceleration of a wheel.
    wheel_inertia : (w,) array
        ``h C`` of the friction on each wheel, kg m2.
    column : (w, 3) array
        Each wheel's column of E, and of z_b on the way back.
    gain : (n, w) array
        Its part of the acceleration across each joint.
    response : (n, w) array
        Angular acceleration of each body for a unit acceleration of a wheel.
    base, probe, end : (w, 2), (w, 2), (w, 3) arrays
        The same for the input pin of body 1, that of the probe's body, and the output of the last body.
    row : (w, w + 3) array
        Accelerations of the bodies on each wheel, weighted with their coupling: three cut loads,
        constant part, wheels.
    matrix : (w + 2, w + 3) array
        Equations for the cut loads and the wheels.
    load : (w + 3,) array
        Cut loads, 1, and the accelerations of the wheels but the sprocket.
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
    return ImplicitWork(
        np.zeros((n, 6)),
        np.zeros((n, wheels, 3)),
        np.zeros(wheels),
        np.zeros((wheels, 3)),
        np.zeros((n, wheels)),
        np.zeros((n, wheels)),
        np.zeros((wheels, 2)),
        np.zeros((wheels, 2)),
        np.zeros((wheels, 3)),
        np.zeros((wheels, wheels + 3)),
        np.zeros((wheels + 2, wheels + 3)),
        np.zeros(wheels + 3),
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
    wheels = wheel_inertia.shape[0]
    sweep(
        chain, cos, sin, rate, force_x, force_y, moment, torque, implicit_damping, probe_body, work, implicit
    )  # fmt: skip
    matrix, load = implicit.matrix, implicit.load
    last = wheels + 2
    for k in range(4):
        j = k if k < 3 else last
        sign = -1.0 if k == 3 else 1.0
        matrix[0, j] = sign * (work.end[0, k] - work.base[0, k])
        matrix[1, j] = sign * (work.end[1, k] - work.base[1, k])
        matrix[2, j] = sign * implicit_damping * (work.response[0, k] - work.response[n - 1, k])
        for wheel in range(1, wheels):
            matrix[2 + wheel, j] = -sign * implicit.row[wheel, k]
    for k in range(1, wheels):
        matrix[0, 2 + k] = implicit.end[k, 0] - implicit.base[k, 0]
        matrix[1, 2 + k] = implicit.end[k, 1] - implicit.base[k, 1]
        matrix[2, 2 + k] = implicit_damping * (implicit.response[0, k] - implicit.response[n - 1, k])
        for wheel in range(1, wheels):
            matrix[2 + wheel, 2 + k] = -implicit.row[wheel, 3 + k]
    matrix[0, 0] -= compliance
    matrix[1, 1] -= compliance
    matrix[0, last] -= compliance * cut_force_x
    matrix[1, last] -= compliance * cut_force_y
    matrix[2, 2] += 1.0
    matrix[2, last] += torque[n - 1]
    for wheel in range(1, wheels):
        matrix[2 + wheel, 2 + wheel] += wheel_inertia[wheel] + implicit.wheel_inertia[wheel] + step * wheel_drag[wheel]
        matrix[2 + wheel, last] += wheel_torque[wheel] - wheel_drag[wheel] * wheel_rate[wheel]
    _eliminate(matrix)
    for k in range(3):
        load[k] = work.load[k] = matrix[k, last]
    load[3] = work.load[3] = 1.0
    invert_closure(compliance, implicit_damping, work)

    # the wheels' columns, now known, are folded into the constant one
    for k in range(1, wheels):
        a = load[3 + k] = matrix[2 + k, last]
        for i in range(n):
            work.response[i, 3] += implicit.response[i, k] * a
        for r in range(2):
            work.base[r, 3] += implicit.base[k, r] * a
            work.probe[r, 3] += implicit.probe[k, r] * a
        for r in range(3):
            work.end[r, 3] += implicit.end[k, r] * a


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

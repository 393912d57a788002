"""Linearly implicit steps: the Riccati sweep includes the slopes of contacts and bushings.

A force of position and velocity is led to the end of the step by its slopes, ``f + h df/dq q' - (h C + h^2 K)
q''``. Contacts act on one body each, so ``h C + h^2 K`` of a body adds to its inertia and the sweep keeps its form;
friction on a wheel that turns freely couples the bodies on it to the wheel's acceleration, which is carried as one more
column (`chain.riccati.sweep`). The cut load and the wheels' accelerations then follow from one small system.
"""

from trackdyn.chain.kinematics import bearing_drag, maxwell_damping
from trackdyn.chain.riccati import invert_closure, sweep
from trackdyn.jit import kernel
from trackdyn.model.arrays import ImplicitWork, State, Work
from trackdyn.model.constants import Model


@kernel
def accelerations(model: Model, state: State, work: Work, implicit: ImplicitWork, cut):
    """Solve for accelerations of chain and wheels at the end of a linearly implicit step, ``model.step``.

    The loads of ``work`` are those led to the end of the step with the accelerations left out; its ``sweep`` receives
    the accelerations in the form that the time loop reads. Of ``implicit``, ``inertia``, ``couple`` and
    ``wheel_inertia`` are read, the rest is written. ``cut`` is the cut joint: ``1 / (h^2 K + h C)``, 0 if rigid, and
    the force on body 1 (N; `riccati.close`).
    """
    chain, step, swept = model.chain, model.step, work.sweep
    inertia = model.wheels.inertia
    n, wheels = state.rate.shape[0], inertia.shape[0]
    damping = step * chain.damping + step * step * chain.stiffness + step * maxwell_damping(step, model.maxwell)
    compliance, force_x, force_y = cut
    sweep(chain, state, work, damping, implicit)
    matrix, load = implicit.matrix, implicit.load
    last = wheels + 2
    for k in range(4):
        j = k if k < 3 else last
        sign = -1.0 if k == 3 else 1.0
        matrix[0, j] = sign * (swept.end[0, k] - swept.base[0, k])
        matrix[1, j] = sign * (swept.end[1, k] - swept.base[1, k])
        matrix[2, j] = sign * damping * (swept.response[0, k] - swept.response[n - 1, k])
        for wheel in range(1, wheels):
            matrix[2 + wheel, j] = -sign * implicit.row[wheel, k]
    for k in range(1, wheels):
        matrix[0, 2 + k] = implicit.end[k, 0] - implicit.base[k, 0]
        matrix[1, 2 + k] = implicit.end[k, 1] - implicit.base[k, 1]
        matrix[2, 2 + k] = damping * (implicit.response[0, k] - implicit.response[n - 1, k])
        for wheel in range(1, wheels):
            matrix[2 + wheel, 2 + k] = -implicit.row[wheel, 3 + k]
    for r, force in enumerate((force_x, force_y)):
        matrix[r, r] -= compliance
        matrix[r, last] -= compliance * force
    matrix[2, 2] += 1.0
    matrix[2, last] += work.torque[n - 1]
    for wheel in range(1, wheels):
        drag = bearing_drag(model.wheels, wheel, state.wheel_rate[wheel], work.carried)
        matrix[2 + wheel, 2 + wheel] += inertia[wheel] + implicit.wheel_inertia[wheel] + step * drag
        matrix[2 + wheel, last] += work.wheel_torque[wheel] - drag * state.wheel_rate[wheel]
    _eliminate(matrix)
    for k in range(3):
        load[k] = swept.load[k] = matrix[k, last]
    load[3] = swept.load[3] = 1.0
    invert_closure(compliance, damping, swept)
    # the wheels' accelerations are known: add their columns to the constant one
    for k in range(1, wheels):
        a = load[3 + k] = matrix[2 + k, last]
        for i in range(n):
            swept.response[i, 3] += implicit.response[i, k] * a
        for r in range(2):
            swept.base[r, 3] += implicit.base[k, r] * a
        for r in range(3):
            swept.end[r, 3] += implicit.end[k, r] * a


@kernel
def _eliminate(matrix):
    """Solve the augmented ``(m, m + 1)`` matrix in place by Gauss-Jordan elimination with row exchange."""
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

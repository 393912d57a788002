"""The load of the cut joint, from what every acceleration answers to it: rigid, or a spring and damper (A.6)."""

from trackdyn.jit import kernel
from trackdyn.model.work import SweepWork


@kernel
def close(cut_torque, implicit_damping, work: SweepWork):
    """Load of a rigid cut: the two position rows and the torque law of the cut joint."""
    n = work.response.shape[0]
    invert_closure(0.0, implicit_damping, work)
    b0 = work.base[0, 3] - work.end[0, 3]
    b1 = work.base[1, 3] - work.end[1, 3]
    _solve_closure(n, b0, b1, cut_torque, implicit_damping, work)


@kernel
def close_compliant(force_x, force_y, implicit_stiffness, cut_torque, implicit_damping, work: SweepWork):
    """Load of the elastic-damping cut, taken at the end of the step (A.6).

    ``force_x, force_y`` (N) of spring and damper on body 1 leave the acceleration of the gap out;
    ``implicit_stiffness`` is ``h^2 K + h C`` (kg), the force for a unit of it, 0: the force as it is. Bushing of the
    cut as in `sweep`.
    """
    n = work.response.shape[0]
    if implicit_stiffness == 0.0:
        work.load[0] = force_x
        work.load[1] = force_y
        work.load[2] = cut_torque
        work.load[3] = 1.0
        return
    # lambda = f + z (end'' - base''), written as (end'' - base'') - lambda / z = -f / z
    invert_closure(1.0 / implicit_stiffness, implicit_damping, work)
    b0 = work.base[0, 3] - work.end[0, 3] - force_x / implicit_stiffness
    b1 = work.base[1, 3] - work.end[1, 3] - force_y / implicit_stiffness
    _solve_closure(n, b0, b1, cut_torque, implicit_damping, work)


@kernel
def _solve_closure(n, b0, b1, cut_torque, implicit_damping, work: SweepWork):
    """Cut load from the right-hand sides of the two position rows and the torque law."""
    inv, load, response = work.inverse, work.load, work.response
    b2 = cut_torque - implicit_damping * (response[0, 3] - response[n - 1, 3])
    load[0] = inv[0, 0] * b0 + inv[0, 1] * b1 + inv[0, 2] * b2
    load[1] = inv[1, 0] * b0 + inv[1, 1] * b1 + inv[1, 2] * b2
    load[2] = inv[2, 0] * b0 + inv[2, 1] * b1 + inv[2, 2] * b2
    load[3] = 1.0


@kernel
def invert_closure(compliance, implicit_damping, work: SweepWork):
    """Inverse of the closure matrix: gap acceleration (less ``compliance`` times the load) and torque law."""
    end = work.end
    response = work.response
    n = response.shape[0]
    a00 = end[0, 0] - work.base[0, 0] - compliance
    a01 = end[0, 1] - work.base[0, 1]
    a02 = end[0, 2] - work.base[0, 2]
    a10 = end[1, 0] - work.base[1, 0]
    a11 = end[1, 1] - work.base[1, 1] - compliance
    a12 = end[1, 2] - work.base[1, 2]
    a20 = implicit_damping * (response[0, 0] - response[n - 1, 0])
    a21 = implicit_damping * (response[0, 1] - response[n - 1, 1])
    a22 = 1.0 + implicit_damping * (response[0, 2] - response[n - 1, 2])

    inv = work.inverse
    m00 = a11 * a22 - a12 * a21
    m01 = a02 * a21 - a01 * a22
    m02 = a01 * a12 - a02 * a11
    det = 1.0 / (a00 * m00 + a10 * m01 + a20 * m02)
    inv[0, 0] = m00 * det
    inv[0, 1] = m01 * det
    inv[0, 2] = m02 * det
    inv[1, 0] = (a12 * a20 - a10 * a22) * det
    inv[1, 1] = (a00 * a22 - a02 * a20) * det
    inv[1, 2] = (a02 * a10 - a00 * a12) * det
    inv[2, 0] = (a10 * a21 - a11 * a20) * det
    inv[2, 1] = (a01 * a20 - a00 * a21) * det
    inv[2, 2] = (a00 * a11 - a01 * a10) * det

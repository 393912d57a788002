"""Forward dynamics of the closed planar chain by the Riccati form of the transfer matrix method.

The state vector of a junction (Eq. 1) is split into ``z_b = [x'', y'', Omega']`` and the loads
``z_a = [q_x, q_y, m]``; in the plane both have three entries. Instead of multiplying transfer
matrices, which loses every digit after about seventeen bodies of this chain, the sweep carries the linear relation

    z_a = S z_b + E [lambda_x, lambda_y, lambda_m, 1]

from the input of body 1 (``S = 0``, ``E = [I, 0]``) to the output of body N, where it is solved.
``lambda`` is the load through the cut joint 70, continuous across it. Back-substitution gives every
acceleration as a linear function of ``lambda``; the two independent closure rows (the pins of the
cut coincide) and the torque law of the cut joint then fix ``lambda``. ``-S`` is the articulated-body
inertia of the bodies already swept: symmetric positive definite, so the recursion cannot break down.

Loads (m, q) act on a body at its input and (-m, -q) at its output.
"""

import numpy as np

from trackdyn.chain.radial import cross_joint, return_joint, span
from trackdyn.jit import kernel
from trackdyn.model.constants import Chain
from trackdyn.model.work import SweepWork, Work


@kernel
def accelerations(chain: Chain, state, work: Work, implicit_damping, probe_body):
    """Response of every acceleration to the cut load, and the load that holds the pins of the cut together.

    Every solver of the chain has these parameters and this result.

    Parameters
    ----------
    chain : Chain
        Constant data of the ``n`` bodies.
    state : State
        ``rate`` is read.
    work : Work
        ``cos``, ``sin``, the loads ``force_x``, ``force_y``, ``moment`` without gravity and the bushing ``torque`` at
        the start of the step are read, ``sweep`` is written.
    implicit_damping : float
        Step times bushing damping: the torque is taken as ``torque - implicit_damping * phi''``,
        which removes the step limit of the damping (N m s2/rad).
    probe_body : int
        Body whose input pin's acceleration is kept (the sensor's link).
    """
    sweep(chain, state, work, implicit_damping, probe_body, None, None)
    close(work.torque[state.rate.shape[0] - 1], implicit_damping, work.sweep)


@kernel
def sweep(chain: Chain, state, work: Work, implicit_damping, probe_body, implicit, radial):
    """Response of every acceleration to the load of the cut joint.

    Parameters
    ----------
    chain, state, work, implicit_damping, probe_body
        As in `accelerations`.
    implicit : ImplicitWork or None
        Slopes of the contact forces of a linearly implicit step: they add to the inertia, and every
        wheel that turns freely gets a column beside the four.
    radial : RadialWork or None
        Joints whose pins part: the sweep then runs from one point where a load acts to the next (`chain.radial`),
        and ``end`` and ``base`` are accelerations of such points.

    Notes
    -----
    Body: A.2 in the plane, ``S' = S - B`` with the inertia ``B`` about the input pin, then the shift
    ``T' S' T`` to the output pin. Joint: ``phi'' = (S_3 z_b + E_3 - tau) / D``, ``D = S_33 - h c``.
    """
    cos, sin, rate, torque = work.cos, work.sin, state.rate, work.torque
    force_x, force_y, moment = work.force_x, work.force_y, work.moment
    n = rate.shape[0]
    mass, inertia, length = chain.mass, chain.inertia, chain.length
    com_x, com_y = chain.com_x, chain.com_y
    gain = work.sweep.gain

    # S = [[s11, s12, s13], [., s22, s23], [., ., s33]] is symmetric. Rows of E belong to q_x, q_y, m.
    # The columns of lambda_x and lambda_y keep rows q_x, q_y; every entry is carried for plainness.
    s11 = s12 = s13 = s22 = s23 = s33 = 0.0
    ex0, ex1, ex2, ex3 = 1.0, 0.0, 0.0, 0.0
    ey0, ey1, ey2, ey3 = 0.0, 1.0, 0.0, 0.0
    em0, em1, em2, em3 = 0.0, 0.0, 1.0, 0.0
    if implicit is not None:
        wheel_columns = implicit.column
        wheel_columns[:, :] = 0.0

    for i in range(n):
        c = cos[i]
        s = sin[i]
        dx = length[i] * c
        dy = length[i] * s
        gx = com_x[i] * c - com_y[i] * s
        gy = com_x[i] * s + com_y[i] * c
        if radial is not None:
            bx, by, fx, fy = span(state.part, i)
            gx += bx
            gy += by
            dx += bx + fx
            dy += by + fy
        w2 = rate[i] * rate[i]
        m = mass[i]
        # inertia of the body about its input pin
        s11 -= m
        s22 -= m
        s13 += m * gy
        s23 -= m * gx
        s33 -= inertia[i] + m * (gx * gx + gy * gy)
        if implicit is not None:
            s11 -= implicit.inertia[i, 0]
            s12 -= implicit.inertia[i, 1]
            s22 -= implicit.inertia[i, 2]
            s13 -= implicit.inertia[i, 3]
            s23 -= implicit.inertia[i, 4]
            s33 -= implicit.inertia[i, 5]
            for wheel in range(1, wheel_columns.shape[0]):
                for r in range(3):
                    wheel_columns[wheel, r] += implicit.couple[i, wheel, r]
                wheel_columns[wheel, 2] += dy * wheel_columns[wheel, 0] - dx * wheel_columns[wheel, 1]
        fx = force_x[i]
        fy = force_y[i] - m * chain.gravity
        ex3 += fx + m * w2 * gx
        ey3 += fy + m * w2 * gy
        em3 += moment[i] + gx * fy - gy * fx
        # centripetal part of z_b,I = T z_b,O + w2 d
        ax = w2 * dx
        ay = w2 * dy
        ex3 += s11 * ax + s12 * ay
        ey3 += s12 * ax + s22 * ay
        em3 += s13 * ax + s23 * ay
        # shift to the output pin: S <- T' S T, E <- T' E
        s33 += 2.0 * (dy * s13 - dx * s23) + dy * dy * s11 + dx * dx * s22 - 2.0 * dx * dy * s12
        s13 += dy * s11 - dx * s12
        s23 += dy * s12 - dx * s22
        em0 += dy * ex0 - dx * ey0
        em1 += dy * ex1 - dx * ey1
        em2 += dy * ex2 - dx * ey2
        em3 += dy * ex3 - dx * ey3
        if i < n - 1:
            if radial is not None:
                inertia_part = (s11, s12, s13, s22, s23, s33)
                load_part = (ex0, ex1, ex2, ex3), (ey0, ey1, ey2, ey3), (em0, em1, em2, em3)
                inertia_part, load_part = cross_joint(radial, i, inertia_part, load_part)
                s11, s12, s13, s22, s23, s33 = inertia_part
                (ex0, ex1, ex2, ex3), (ey0, ey1, ey2, ey3), (em0, em1, em2, em3) = load_part
            d = 1.0 / (s33 - implicit_damping)
            p1 = s13 * d
            p2 = s23 * d
            p3 = s33 * d
            g3 = em3 - torque[i]
            if implicit is not None:
                for wheel in range(1, wheel_columns.shape[0]):
                    g = wheel_columns[wheel, 2]
                    implicit.gain[i, wheel] = g * d
                    wheel_columns[wheel, 0] -= p1 * g
                    wheel_columns[wheel, 1] -= p2 * g
                    wheel_columns[wheel, 2] -= p3 * g
            gain[i, 0] = p1
            gain[i, 1] = p2
            gain[i, 2] = p3
            gain[i, 3] = em0 * d
            gain[i, 4] = em1 * d
            gain[i, 5] = em2 * d
            gain[i, 6] = g3 * d
            ex0 -= p1 * em0
            ex1 -= p1 * em1
            ex2 -= p1 * em2
            ex3 -= p1 * g3
            ey0 -= p2 * em0
            ey1 -= p2 * em1
            ey2 -= p2 * em2
            ey3 -= p2 * g3
            em0 -= p3 * em0
            em1 -= p3 * em1
            em2 -= p3 * em2
            em3 -= p3 * g3
            s11 -= p1 * s13
            s12 -= p1 * s23
            s22 -= p2 * s23
            s13 -= p1 * s33
            s23 -= p2 * s33
            s33 -= p3 * s33

    # End of the chain: S z_b + E Lambda = lambda, solved for z_b,NO (3 x 4) by Cholesky of -S.
    l11 = np.sqrt(-s11)
    l21 = -s12 / l11
    l31 = -s13 / l11
    l22 = np.sqrt(-s22 - l21 * l21)
    l32 = (-s23 - l31 * l21) / l22
    l33 = np.sqrt(-s33 - l31 * l31 - l32 * l32)
    end = work.sweep.end
    for k in range(4):
        if k == 0:
            b1, b2, b3 = ex0 - 1.0, ey0, em0
        elif k == 1:
            b1, b2, b3 = ex1, ey1 - 1.0, em1
        elif k == 2:
            b1, b2, b3 = ex2, ey2, em2 - 1.0
        else:
            b1, b2, b3 = ex3, ey3, em3
        y1 = b1 / l11
        y2 = (b2 - l21 * y1) / l22
        y3 = (b3 - l31 * y1 - l32 * y2) / l33
        z3 = y3 / l33
        z2 = (y2 - l32 * z3) / l22
        z1 = (y1 - l21 * z2 - l31 * z3) / l11
        end[0, k] = z1
        end[1, k] = z2
        end[2, k] = z3
    if implicit is not None:
        for wheel in range(1, wheel_columns.shape[0]):
            y1 = wheel_columns[wheel, 0] / l11
            y2 = (wheel_columns[wheel, 1] - l21 * y1) / l22
            y3 = (wheel_columns[wheel, 2] - l31 * y1 - l32 * y2) / l33
            z3 = y3 / l33
            z2 = (y2 - l32 * z3) / l22
            implicit.end[wheel, 0] = (y1 - l21 * z2 - l31 * z3) / l11
            implicit.end[wheel, 1] = z2
            implicit.end[wheel, 2] = z3

    _back_substitute(chain, state, work, probe_body, implicit, radial)


@kernel
def _back_substitute(chain: Chain, state, work: Work, probe_body, implicit, radial):
    """Accelerations of every body from the output of the last one, four columns at a time."""
    cos, sin, rate, swept = work.cos, work.sin, state.rate, work.sweep
    n = rate.shape[0]
    gain, response, end = swept.gain, swept.response, swept.end
    x0, x1, x2, x3 = end[0, 0], end[0, 1], end[0, 2], end[0, 3]
    y0, y1, y2, y3 = end[1, 0], end[1, 1], end[1, 2], end[1, 3]
    a0, a1, a2, a3 = end[2, 0], end[2, 1], end[2, 2], end[2, 3]
    if implicit is not None:
        z = implicit.column
        implicit.row[:, :] = 0.0
        for wheel in range(1, z.shape[0]):
            for r in range(3):
                z[wheel, r] = implicit.end[wheel, r]
    p1 = p2 = q = 0.0
    for i in range(n - 1, -1, -1):
        if i < n - 1:
            p1 = gain[i, 0]
            p2 = gain[i, 1]
            q = 1.0 - gain[i, 2]
            a0 = q * a0 - p1 * x0 - p2 * y0 - gain[i, 3]
            a1 = q * a1 - p1 * x1 - p2 * y1 - gain[i, 4]
            a2 = q * a2 - p1 * x2 - p2 * y2 - gain[i, 5]
            a3 = q * a3 - p1 * x3 - p2 * y3 - gain[i, 6]
            if radial is not None:
                (x0, x1, x2, x3), (y0, y1, y2, y3) = return_joint(
                    radial, i, (x0, x1, x2, x3), (y0, y1, y2, y3), (a0, a1, a2, a3)
                )
        response[i, 0] = a0
        response[i, 1] = a1
        response[i, 2] = a2
        response[i, 3] = a3
        dx = chain.length[i] * cos[i]
        dy = chain.length[i] * sin[i]
        if radial is not None:
            bx, by, fx, fy = span(state.part, i)
            dx += bx + fx
            dy += by + fy
        w2 = rate[i] * rate[i]
        x0 += dy * a0
        x1 += dy * a1
        x2 += dy * a2
        x3 += dy * a3 + w2 * dx
        y0 -= dx * a0
        y1 -= dx * a1
        y2 -= dx * a2
        y3 -= dx * a3 - w2 * dy
        if implicit is not None:
            for wheel in range(1, z.shape[0]):
                a = z[wheel, 2]
                if i < n - 1:
                    a = q * a - p1 * z[wheel, 0] - p2 * z[wheel, 1] - implicit.gain[i, wheel]
                z[wheel, 0] += dy * a
                z[wheel, 1] -= dx * a
                z[wheel, 2] = a
                implicit.response[i, wheel] = a
                if i == probe_body:
                    implicit.probe[wheel, 0] = z[wheel, 0]
                    implicit.probe[wheel, 1] = z[wheel, 1]
            for wheel in range(1, z.shape[0]):
                # acceleration of this body as the friction on the wheel feels it
                u, v, w = implicit.couple[i, wheel, 0], implicit.couple[i, wheel, 1], implicit.couple[i, wheel, 2]
                if u != 0.0 or v != 0.0:
                    implicit.row[wheel, 0] += u * x0 + v * y0 + w * a0
                    implicit.row[wheel, 1] += u * x1 + v * y1 + w * a1
                    implicit.row[wheel, 2] += u * x2 + v * y2 + w * a2
                    implicit.row[wheel, 3] += u * x3 + v * y3 + w * a3
                    for k in range(1, z.shape[0]):
                        implicit.row[wheel, 3 + k] += u * z[k, 0] + v * z[k, 1] + w * z[k, 2]
        if i == probe_body:
            swept.probe[0, 0] = x0
            swept.probe[0, 1] = x1
            swept.probe[0, 2] = x2
            swept.probe[0, 3] = x3
            swept.probe[1, 0] = y0
            swept.probe[1, 1] = y1
            swept.probe[1, 2] = y2
            swept.probe[1, 3] = y3
            if radial is not None:
                for k in range(4):
                    swept.probe[0, k] -= response[i, k] * by
                    swept.probe[1, k] += response[i, k] * bx
                swept.probe[0, 3] -= w2 * bx
                swept.probe[1, 3] -= w2 * by
    if implicit is not None:
        for wheel in range(1, z.shape[0]):
            implicit.base[wheel, 0] = z[wheel, 0]
            implicit.base[wheel, 1] = z[wheel, 1]
    base = swept.base
    base[0, 0] = x0
    base[0, 1] = x1
    base[0, 2] = x2
    base[0, 3] = x3
    base[1, 0] = y0
    base[1, 1] = y1
    base[1, 2] = y2
    base[1, 3] = y3


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

    Parameters
    ----------
    force_x, force_y : float
        Spring and damper force on body 1 with the acceleration of the gap left out, N.
    implicit_stiffness : float
        ``h^2 K + h C``: force for a unit acceleration of the gap, kg; 0: the force as it is.
    cut_torque, implicit_damping : float
        Bushing of the cut joint, as in `sweep`.
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

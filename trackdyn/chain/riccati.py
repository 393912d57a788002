"""Forward dynamics of the closed planar chain by the Riccati form of the transfer matrix method (docs/model.md).

The state of a junction (Eq. 1) is split into ``z_b = [x'', y'', Omega']`` and the loads ``z_a = [q_x, q_y, m]``, which
act on a body at its input, and their opposites at its output. The sweep carries ``z_a = S z_b + E [lambda_x, lambda_y,
lambda_m, 1]`` from the input of body 1 (``S = 0``, ``E = [I, 0]``) to the output of body N; ``lambda`` is the load
through the cut joint 70. Back-substitution gives every acceleration as a linear function of it, and the two closure
rows (the pins of the cut coincide) and the torque law of the cut joint fix it.
"""

from math import sqrt

from trackdyn.chain.kinematics import mass_centre
from trackdyn.jit import fused, inlined, kernel
from trackdyn.model.arrays import SweepWork, Work
from trackdyn.model.constants import Chain


@inlined
def factored(a11, a12, a13, a22, a23, a33):
    """Return the Cholesky factor ``(l11, l21, l31, l22, l32, l33)`` of a symmetric positive definite 3 x 3 matrix."""
    l11 = sqrt(a11)
    l21, l31 = a12 / l11, a13 / l11
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


@inlined
def response_to(columns, i, load):
    """Return row ``i`` of the accelerations due to a cut load ``[lambda_x, lambda_y, lambda_m]``."""
    return columns[i, 0] * load[0] + columns[i, 1] * load[1] + columns[i, 2] * load[2]


@inlined
def closing_load(a, x, y):
    """Return the cut load that cancels the acceleration ``x, y`` of the gap; ``a`` is the inverse closure matrix."""
    return -(a[0, 0] * x + a[0, 1] * y), -(a[1, 0] * x + a[1, 1] * y), -(a[2, 0] * x + a[2, 1] * y)


@kernel
def accelerations(chain: Chain, state, work: Work, implicit_damping):
    """Compute the response of every acceleration to the cut load, and the load that closes the cut, in ``work.sweep``.

    The loads of ``work`` are without gravity, the bushing ``torque`` is that of the start of the step. With
    ``implicit_damping`` (N m s2/rad), the step times the bushing damping, it is taken as ``torque - implicit_damping *
    phi''``, which removes the step limit of the damping.
    """
    sweep(chain, state, work, implicit_damping, None)
    close(0.0, 0.0, 0.0, work.torque[state.rate.shape[0] - 1], implicit_damping, work.sweep)


@fused
def sweep(chain: Chain, state, work: Work, implicit_damping, implicit):
    """Compute the response of every acceleration to the cut load; ``implicit_damping`` as in `accelerations`.

    ``implicit`` (`model.arrays.ImplicitWork` or None) has the slopes of the contact forces of a linearly implicit step:
    they add to the inertia, and every wheel that turns freely gets a column after the four.

    The cost of a sweep is the latency of some twenty dependent operations per body. Two sweeps, from both ends of the
    chain to its middle, share no operand, and a processor works on both at once. With ``implicit`` one sweep takes
    all bodies.
    """
    n = state.rate.shape[0]
    middle = (n + 1) // 2 if implicit is None else n
    gain, torque = work.sweep.gain, work.torque
    # S = [[s11, s12, s13], [., s22, s23], [., ., s33]]; rows of E belong to q_x, q_y, m. Behind: the sweep from the
    # far end, which the load of the cut pulls the other way.
    s = behind_s = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    e = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))
    behind_e = ((-1.0, 0.0, 0.0, 0.0), (0.0, -1.0, 0.0, 0.0), (0.0, 0.0, -1.0, 0.0))
    if implicit is not None:
        implicit.column[:, :] = 0.0
    for i in range(middle):
        gx, gy, dx, dy = _arms(chain, work, i)
        w2 = state.rate[i] * state.rate[i]
        s, e = _add_body(chain, work, i, (gx, gy, w2), s, e)
        if implicit is not None:
            s = add_slopes(implicit, i, dx, dy, s)
        s, e = _shift(dx, dy, w2, s, e)
        if i < n - 1:
            if implicit is not None:
                hinge_columns(implicit, i, s, implicit_damping)
            s, e = _hinge(gain, i, torque[i], implicit_damping, s, e)
        if implicit is None:
            k = n - 1 - i
            if k >= middle:
                gx, gy, dx, dy = _arms(chain, work, k)
                w2 = state.rate[k] * state.rate[k]
                behind_s, behind_e = _shift(-dx, -dy, w2, behind_s, behind_e)
                behind_s, behind_e = _add_body(chain, work, k, (gx, gy, w2), behind_s, behind_e)
                if k > middle:
                    behind_s, behind_e = _hinge(gain, k - 1, -torque[k - 1], implicit_damping, behind_s, behind_e)
    _meet(work, s, e, behind_s, behind_e, implicit)
    _back_substitute(chain, state, work, middle, implicit)


@fused
def _arms(chain: Chain, work: Work, i):
    """Return the arms from a body's input pin to its mass centre and to its output pin, m."""
    gx, gy = mass_centre(chain, work, i)
    return gx, gy, chain.length[i] * work.cos[i], chain.length[i] * work.sin[i]


@fused
def _add_body(chain: Chain, work: Work, i, turning, s, e):
    """Add a body's equations about its input (A.2): ``S - B``, its loads; ``turning``: arm (m), square of its rate."""
    s11, s12, s13, s22, s23, s33 = s
    ex, ey, em = e
    (gx, gy, w2), m = turning, chain.mass[i]
    fx, fy = work.force_x[i], work.force_y[i] - m * chain.gravity
    s = (s11 - m, s12, s13 + m * gy, s22 - m, s23 - m * gx, s33 - (chain.inertia[i] + m * (gx * gx + gy * gy)))
    return s, (
        (ex[0], ex[1], ex[2], ex[3] + (fx + m * w2 * gx)),
        (ey[0], ey[1], ey[2], ey[3] + (fy + m * w2 * gy)),
        (em[0], em[1], em[2], em[3] + (work.moment[i] + gx * fy - gy * fx)),
    )


@fused
def _shift(dx, dy, w2, s, e):
    """Transfer the relation to a point of a body from one ``(dx, dy)`` before it: ``T' S T`` and ``T' E``.

    The first point's acceleration is ``T z_b + w^2 d``, its second term centripetal.
    """
    s11, s12, s13, s22, s23, s33 = s
    ex, ey, em = e
    ax, ay = w2 * dx, w2 * dy
    x3 = ex[3] + (s11 * ax + s12 * ay)
    y3 = ey[3] + (s12 * ax + s22 * ay)
    m3 = em[3] + (s13 * ax + s23 * ay)
    # the new first column's moment by halves: S_33 then needs no more than the two sums that S_13 and S_23 grow by
    grow13 = dy * s11 - dx * s12
    grow23 = dy * s12 - dx * s22
    s33 += (dy * (s13 + (s13 + grow13))) - (dx * (s23 + (s23 + grow23)))
    return (s11, s12, s13 + grow13, s22, s23 + grow23, s33), (
        (ex[0], ex[1], ex[2], x3),
        (ey[0], ey[1], ey[2], y3),
        (em[0] + (dy * ex[0] - dx * ey[0]), em[1] + (dy * ex[1] - dx * ey[1]), em[2] + (dy * ex[2] - dx * ey[2]),
         m3 + (dy * x3 - dx * y3)),
    )  # fmt: skip


@fused
def _hinge(gain, joint, torque, implicit_damping, s, e):
    """Transfer the relation across a joint with its torque on this side; store the joint's row of ``gain``.

    ``phi'' = (S_3 z_b + E_3 - tau) / D``, ``D = S_33 - h c``; of the third row no more than ``q = -h c / D`` goes over.
    """
    s11, s12, s13, s22, s23, s33 = s
    ex, ey, em = e
    d, g = 1.0 / (s33 - implicit_damping), em[3] - torque
    p1, p2, q = s13 * d, s23 * d, -implicit_damping * d
    gain[joint, 0], gain[joint, 1], gain[joint, 2] = p1, p2, q
    gain[joint, 3], gain[joint, 4], gain[joint, 5], gain[joint, 6] = em[0] * d, em[1] * d, em[2] * d, g * d
    return (s11 - p1 * s13, s12 - p1 * s23, q * s13, s22 - p2 * s23, q * s23, q * s33), (
        (ex[0] - p1 * em[0], ex[1] - p1 * em[1], ex[2] - p1 * em[2], ex[3] - p1 * g),
        (ey[0] - p2 * em[0], ey[1] - p2 * em[1], ey[2] - p2 * em[2], ey[3] - p2 * g),
        (q * em[0], q * em[1], q * em[2], torque + q * g),
    )


@fused
def _meet(work: Work, s, e, behind_s, behind_e, implicit):
    """Solve for ``z_b`` (3 x 4) where the sweeps meet, into ``end``: both relations added, by Cholesky of -S."""
    (s11, s12, s13, s22, s23, s33), (t11, t12, t13, t22, t23, t33) = s, behind_s
    factor = factored(-(s11 + t11), -(s12 + t12), -(s13 + t13), -(s22 + t22), -(s23 + t23), -(s33 + t33))
    end = work.sweep.end
    for k in range(4):
        right = (e[0][k] + behind_e[0][k], e[1][k] + behind_e[1][k], e[2][k] + behind_e[2][k])
        end[0, k], end[1, k], end[2, k] = solve_factored(factor, right)
    if implicit is not None:
        meet_columns(implicit, factor)


@fused
def _back_substitute(chain: Chain, state, work: Work, middle, implicit):
    """Substitute back from the middle, where the sweeps met, to both ends: four columns of acceleration a body."""
    rate, swept = state.rate, work.sweep
    n = rate.shape[0]
    gain, response, end, base = swept.gain, swept.response, swept.end, swept.base
    x = behind_x = (end[0, 0], end[0, 1], end[0, 2], end[0, 3])
    y = behind_y = (end[1, 0], end[1, 1], end[1, 2], end[1, 3])
    a = behind_a = (end[2, 0], end[2, 1], end[2, 2], end[2, 3])
    for j in range(middle):
        i = middle - 1 - j
        if i < n - 1:
            a = _across_joint(gain, i, x, y, a)
        response[i, 0], response[i, 1], response[i, 2], response[i, 3] = a
        _, _, dx, dy = _arms(chain, work, i)
        w2 = rate[i] * rate[i]
        x, y = _along_body(dx, dy, w2, x, y, a)
        if implicit is not None:
            return_columns(implicit, work, i, (dx, dy), (x, y, a))
        if implicit is None:
            i = middle + j
            if i < n:
                if j > 0:
                    behind_a = _across_joint(gain, i - 1, behind_x, behind_y, behind_a)
                response[i, 0], response[i, 1], response[i, 2], response[i, 3] = behind_a
                _, _, dx, dy = _arms(chain, work, i)
                behind_x, behind_y = _along_body(-dx, -dy, rate[i] * rate[i], behind_x, behind_y, behind_a)
    for k in range(4):
        base[0, k], base[1, k] = x[k], y[k]
        if implicit is None:
            end[0, k], end[1, k], end[2, k] = behind_x[k], behind_y[k], behind_a[k]
    if implicit is not None:
        for wheel in range(1, implicit.column.shape[0]):
            for r in range(2):
                implicit.base[wheel, r] = implicit.column[wheel, r]


@fused
def _across_joint(gain, joint, x, y, a):
    """Return columns of the angular acceleration across a joint, on the side that the sweep came from."""
    p1, p2, q = gain[joint, 0], gain[joint, 1], gain[joint, 2]
    return (
        q * a[0] - p1 * x[0] - p2 * y[0] - gain[joint, 3],
        q * a[1] - p1 * x[1] - p2 * y[1] - gain[joint, 4],
        q * a[2] - p1 * x[2] - p2 * y[2] - gain[joint, 5],
        q * a[3] - p1 * x[3] - p2 * y[3] - gain[joint, 6],
    )


@fused
def _along_body(dx, dy, w2, x, y, a):
    """Return columns of the acceleration of the point ``(dx, dy)`` before another of the same body."""
    return (
        (x[0] + dy * a[0], x[1] + dy * a[1], x[2] + dy * a[2], x[3] + (dy * a[3] + w2 * dx)),
        (y[0] - dx * a[0], y[1] - dx * a[1], y[2] - dx * a[2], y[3] - (dx * a[3] - w2 * dy)),
    )


@kernel
def close(compliance, shift_x, shift_y, cut_torque, implicit_damping, work: SweepWork):
    """Solve for the cut load: the two position rows and the torque law of the cut joint.

    A rigid cut has no compliance and no shift. A compliant one, ``lambda = f + z (end'' - base'')``, has ``1 / z`` and
    the shift ``f / z``: ``(end'' - base'') - lambda / z = -f / z``.
    """
    inv, load, response, n = work.inverse, work.load, work.response, work.response.shape[0]
    invert_closure(compliance, implicit_damping, work)
    b0 = work.base[0, 3] - work.end[0, 3] - shift_x
    b1 = work.base[1, 3] - work.end[1, 3] - shift_y
    b2 = cut_torque - implicit_damping * (response[0, 3] - response[n - 1, 3])
    for k in range(3):
        load[k] = inv[k, 0] * b0 + inv[k, 1] * b1 + inv[k, 2] * b2
    load[3] = 1.0


@kernel
def invert_closure(compliance, implicit_damping, work: SweepWork):
    """Invert the closure matrix: gap acceleration (less ``compliance`` times the load) and torque law."""
    end, base, response, inv = work.end, work.base, work.response, work.inverse
    last = response.shape[0] - 1
    a00, a01, a02 = end[0, 0] - base[0, 0] - compliance, end[0, 1] - base[0, 1], end[0, 2] - base[0, 2]
    a10, a11, a12 = end[1, 0] - base[1, 0], end[1, 1] - base[1, 1] - compliance, end[1, 2] - base[1, 2]
    a20 = implicit_damping * (response[0, 0] - response[last, 0])
    a21 = implicit_damping * (response[0, 1] - response[last, 1])
    a22 = 1.0 + implicit_damping * (response[0, 2] - response[last, 2])
    m00, m01, m02 = a11 * a22 - a12 * a21, a02 * a21 - a01 * a22, a01 * a12 - a02 * a11
    det = 1.0 / (a00 * m00 + a10 * m01 + a20 * m02)
    inv[0, 0], inv[0, 1], inv[0, 2] = m00 * det, m01 * det, m02 * det
    inv[1, 0], inv[1, 1] = (a12 * a20 - a10 * a22) * det, (a00 * a22 - a02 * a20) * det
    inv[1, 2] = (a02 * a10 - a00 * a12) * det
    inv[2, 0], inv[2, 1] = (a10 * a21 - a11 * a20) * det, (a01 * a20 - a00 * a21) * det
    inv[2, 2] = (a00 * a11 - a01 * a10) * det


@fused
def accelerate(chain: Chain, state, work: Work, last):
    """Compute accelerations of all bodies under the cut load, and of the input pins up to that of body ``last``."""
    alpha, rate, response, base = work.alpha, state.rate, work.sweep.response, work.sweep.base
    load = work.sweep.load[0], work.sweep.load[1], work.sweep.load[2]
    ax, ay = response_to(base, 0, load) + base[0, 3], response_to(base, 1, load) + base[1, 3]
    for i in range(alpha.shape[0]):
        alpha[i] = response_to(response, i, load) + response[i, 3]
    for i in range(last + 1):
        work.pin_ax[i], work.pin_ay[i] = ax, ay
        dx, dy = chain.length[i] * work.cos[i], chain.length[i] * work.sin[i]
        w2 = rate[i] * rate[i]
        ax -= alpha[i] * dy + w2 * dx
        ay += alpha[i] * dx - w2 * dy


# With the slopes of contacts, friction on a wheel that turns freely couples the bodies on it to its acceleration: the
# relation gets a column for every wheel but the sprocket, after the three of the cut load and the constant one.


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
    """Transfer the wheels' columns across a joint, as in `_hinge`."""
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
    """Shift the wheels' columns from a body's output to its input; add its ``motion`` to the row of each wheel."""
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

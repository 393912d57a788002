"""Pins in rubber that part radially: spring and damper at every revolute joint, inside the Riccati sweep.

At joint i the input pin of the outboard body stands ``u`` from the output pin of the inboard one. The load acts on both
bodies at one point P, half way between the pins, so that momentum and angular momentum are left alone: on the outboard
body it is ``q = -(k u + c e)`` with ``e = u' - w x u``, w the mean of both angular velocities, the velocity with which
the material points at P part. A loop that turns as a whole feels no damping, and the damper never gives energy back
(the power of q is ``-k u . u' - c e . e``). Taken at the end of the step, ``q = f - Z A`` with ``Z = h^2 k + h c`` and
A the acceleration of the outboard point P less that of the inboard one, which the sweep carries across a joint as
``z_b(out) = z_b(in) + [A, phi'']``. Terms of h^2 in q (the turn of u) are left out. ``Z -> inf`` is the revolute joint.
"""

from trackdyn.jit import kernel
from trackdyn.model.constants import Model
from trackdyn.model.state import State
from trackdyn.model.work import RadialWork, Work


@kernel
def lead_forces(model: Model, state: State, work: Work, step, radial: RadialWork):
    """Forces of all joints at the end of the step with the accelerations left out, and ``Z``."""
    k, c, part, rate = model.radial.stiffness, model.radial.damping, state.part, state.rate
    z = step * (step * k + c)
    radial.impedance[0] = z
    n = rate.shape[0]
    for i in range(n):
        wo = rate[i + 1] if i < n - 1 else rate[0]
        x, y, vx, vy = part[i, 0], part[i, 1], part[i, 2], part[i, 3]
        mean = 0.5 * (rate[i] + wo)
        ex = vx + mean * y
        ey = vy - mean * x
        radial.parting[i, 0] = ex
        radial.parting[i, 1] = ey
        # A less its centripetal part is u'' as far as the bodies do not turn faster and faster
        centripetal = 0.5 * z * (rate[i] * rate[i] + wo * wo)
        radial.ahead[i, 0] = centripetal * x - k * (x + step * vx) - c * (ex + step * mean * vy)
        radial.ahead[i, 1] = centripetal * y - k * (y + step * vy) - c * (ey - step * mean * vx)


@kernel
def span(part, i):
    """Vectors from the point P at a body's input to its input pin, and from its output pin to P there, m."""
    return 0.5 * part[i - 1, 0], 0.5 * part[i - 1, 1], 0.5 * part[i, 0], 0.5 * part[i, 1]


@kernel
def cross_joint(radial: RadialWork, i, s, e):
    """Relation ``z_a = S z_b + E lambda`` taken from the inboard to the outboard side of joint i's parting pins.

    With ``W = (Z I - S_xx)^-1``, ``p = W S_x`` and ``g = W (E_x - f)`` the points part with ``A = -(p z_b + g)``; what
    is left of the first two rows is ``Z p`` and ``f + Z g``, free of cancellation. ``s`` is ``s11, s12, s13, s22, s23,
    s33``, ``e`` the three rows of E; returned are both on the outboard side.
    """
    ex, ey, em = e
    s11, s12, s13, s22, s23, s33 = s
    z, gain = radial.impedance[0], radial.gain
    fx, fy = radial.ahead[i, 0], radial.ahead[i, 1]
    a = z - s22
    b = z - s11
    det = 1.0 / (a * b - s12 * s12)
    w11 = a * det
    w12 = s12 * det
    w22 = b * det
    p11 = w11 * s11 + w12 * s12
    p12 = w11 * s12 + w12 * s22  # W and S_xx commute: p is symmetric there
    p13 = w11 * s13 + w12 * s23
    p22 = w12 * s12 + w22 * s22
    p23 = w12 * s13 + w22 * s23
    x0 = w11 * ex[0] + w12 * ey[0]
    x1 = w11 * ex[1] + w12 * ey[1]
    x2 = w11 * ex[2] + w12 * ey[2]
    x3 = w11 * (ex[3] - fx) + w12 * (ey[3] - fy)
    y0 = w12 * ex[0] + w22 * ey[0]
    y1 = w12 * ex[1] + w22 * ey[1]
    y2 = w12 * ex[2] + w22 * ey[2]
    y3 = w12 * (ex[3] - fx) + w22 * (ey[3] - fy)
    gain[i, 0], gain[i, 1], gain[i, 2], gain[i, 3], gain[i, 4] = p11, p12, p13, p22, p23
    gain[i, 5], gain[i, 6], gain[i, 7], gain[i, 8] = x0, x1, x2, x3
    gain[i, 9], gain[i, 10], gain[i, 11], gain[i, 12] = y0, y1, y2, y3
    return (
        (z * p11, z * p12, z * p13, z * p22, z * p23, s33 + s13 * p13 + s23 * p23),
        (
            (z * x0, z * x1, z * x2, fx + z * x3),
            (z * y0, z * y1, z * y2, fy + z * y3),
            (
                em[0] + s13 * x0 + s23 * y0,
                em[1] + s13 * x1 + s23 * y1,
                em[2] + s13 * x2 + s23 * y2,
                em[3] + s13 * x3 + s23 * y3,
            ),
        ),
    )


@kernel
def return_joint(radial: RadialWork, i, x, y, a):
    """Columns of ``z_b`` taken back from the outboard to the inboard side of joint i; keeps those of A.

    ``x``, ``y`` and ``a`` are tuples of four: accelerations of the point P, and the angular one behind the hinge.
    """
    g, out = radial.gain, radial.response
    p11, p12, p13, p22, p23 = g[i, 0], g[i, 1], g[i, 2], g[i, 3], g[i, 4]
    x0 = p11 * x[0] + p12 * y[0] + p13 * a[0] + g[i, 5]
    x1 = p11 * x[1] + p12 * y[1] + p13 * a[1] + g[i, 6]
    x2 = p11 * x[2] + p12 * y[2] + p13 * a[2] + g[i, 7]
    x3 = p11 * x[3] + p12 * y[3] + p13 * a[3] + g[i, 8]
    y0 = p12 * x[0] + p22 * y[0] + p23 * a[0] + g[i, 9]
    y1 = p12 * x[1] + p22 * y[1] + p23 * a[1] + g[i, 10]
    y2 = p12 * x[2] + p22 * y[2] + p23 * a[2] + g[i, 11]
    y3 = p12 * x[3] + p22 * y[3] + p23 * a[3] + g[i, 12]
    out[i, 0], out[i, 1], out[i, 2], out[i, 3] = -x0, -x1, -x2, -x3
    out[i, 4], out[i, 5], out[i, 6], out[i, 7] = -y0, -y1, -y2, -y3
    return ((x[0] + x0, x[1] + x1, x[2] + x2, x[3] + x3), (y[0] + y0, y[1] + y1, y[2] + y2, y[3] + y3))


@kernel
def part_pins(state: State, work: Work, radial: RadialWork):
    """Once the cut load is known: force and ``u''`` of every joint but the cut, and ``sweep.base`` of the pin.

    The displacement of the cut joint is no coordinate: it is what the others leave open (`kinematics.place`).
    """
    part, rate, response, load = state.part, state.rate, work.sweep.response, work.sweep.load
    l0, l1, l2 = load[0], load[1], load[2]
    n, z, out, base = rate.shape[0], radial.impedance[0], radial.response, work.sweep.base
    before = response[0, 0] * l0 + response[0, 1] * l1 + response[0, 2] * l2 + response[0, 3]
    for i in range(n - 1):
        after = response[i + 1, 0] * l0 + response[i + 1, 1] * l1 + response[i + 1, 2] * l2 + response[i + 1, 3]
        ax = out[i, 0] * l0 + out[i, 1] * l1 + out[i, 2] * l2 + out[i, 3]
        ay = out[i, 4] * l0 + out[i, 5] * l1 + out[i, 6] * l2 + out[i, 7]
        radial.force[i, 0] = radial.ahead[i, 0] - z * ax
        radial.force[i, 1] = radial.ahead[i, 1] - z * ay
        # from the points P to the pins
        turn = 0.5 * (before + after)
        w2 = 0.5 * (rate[i] * rate[i] + rate[i + 1] * rate[i + 1])
        radial.apart[i, 0] = ax - turn * part[i, 1] - w2 * part[i, 0]
        radial.apart[i, 1] = ay + turn * part[i, 0] - w2 * part[i, 1]
        before = after
    radial.force[n - 1, 0] = l0
    radial.force[n - 1, 1] = l1
    x, y = 0.5 * part[n - 1, 0], 0.5 * part[n - 1, 1]
    for k in range(4):
        base[0, k] -= response[0, k] * y
        base[1, k] += response[0, k] * x
    base[0, 3] -= rate[0] * rate[0] * x
    base[1, 3] -= rate[0] * rate[0] * y


@kernel
def add_loss(model: Model, state: State, done, row, radial):
    """Energy that the dampers of the joints took in the last step into ``done[row]``, J.

    The velocity at the end of the step, which the damper acted with, times the mean over the step.
    """
    if radial is not None:
        part, rate, parting = state.part, state.rate, radial.parting
        n = rate.shape[0]
        loss = 0.0
        for i in range(n):
            mean = 0.5 * (rate[i] + (rate[i + 1] if i < n - 1 else rate[0]))
            ex = part[i, 2] + mean * part[i, 1]
            ey = part[i, 3] - mean * part[i, 0]
            loss += ex * (parting[i, 0] + ex) + ey * (parting[i, 1] + ey)
        done[row] += 0.5 * model.step * model.radial.damping * loss


@kernel
def add_energy(state: State, out, row, constants):
    """Energy in the springs of the joints into ``out[row]``, J; ``constants`` is ``model.radial``."""
    if constants is not None:
        stored = 0.0
        for i in range(state.rate.shape[0]):
            stored += state.part[i, 0] ** 2 + state.part[i, 1] ** 2
        out[row] += 0.5 * constants.stiffness * stored

"""Laws (Eqs. 8 to 11) and geometry (Eqs. 12 to 34) of contacts in the plane, on plain numbers."""

from math import atan2, copysign, exp, floor, pi, sqrt

from trackdyn.jit import kernel
from trackdyn.model.constants import Law, Tooth, Wheels

FORMS = {"cylinders": 0}  # of the elastic term, by the names that `rig.laws.NORMAL_LAWS` takes: two cylinders, Eq. 8


@kernel
def elastic_force(law: Law, depth, radius):
    """Return the elastic term (N) at a penetration ``depth`` (m), and its local power ``d ln F / d ln depth``.

    Eq. 8 has ``(pi/2) L E* d sqrt(d / (2 (R + d)))``. ``radius`` is ``|R1 - R2|`` for internal and ``R1 + R2`` for
    external contact, m. Another of the `FORMS` is chosen here by ``law.form``.
    """
    ratio = depth / (radius + depth)
    return law.stiffness * depth * sqrt(ratio), 1.5 - 0.5 * ratio


@kernel
def force_and_slopes(law: Law, depth, speed, impact_speed, radius):
    """Return the normal force of Eq. 8 (N), and its slopes with the penetration (N/m) and with its velocity (N s/m).

    ``depth`` (m, positive) is the penetration, ``speed`` (m/s, positive while it grows) its velocity and
    ``impact_speed`` the initial one. Where the bracket is clipped the force has no slope with the velocity.
    """
    elastic, power = elastic_force(law, depth, radius)
    factor = 1.0 + law.loss * speed / impact_speed
    damping = elastic * law.loss / impact_speed if 0.0 < factor < law.factor_limit else 0.0
    force = elastic * min(max(factor, 0.0), law.factor_limit)
    return force, force / depth * power, damping


@kernel
def implicit_speed(law: Law, elastic, speed, impact_speed, compliance):
    """Solve ``v + compliance F(v) = speed`` with the force F of Eq. 8 for the penetration velocity v, m/s.

    ``elastic`` is the elastic force (N), ``compliance`` the change of the velocity per unit of force, m/s/N.
    F grows with v, piece by piece in proportion: there is one v.
    """
    slope = law.loss / impact_speed
    v = (speed - compliance * elastic) / (1.0 + compliance * elastic * slope)
    factor = 1.0 + slope * v
    if factor < 0.0:
        return speed
    if factor > law.factor_limit:
        return speed - compliance * elastic * law.factor_limit
    return v


@kernel
def wheel_law(wheels: Wheels, wheel):
    """Return the law of the links on a wheel."""
    row = wheels.law[wheel]
    return Law(
        form=row["form"], stiffness=row["stiffness"], loss=row["loss"], friction_static=row["friction_static"],
        friction_dynamic=row["friction_dynamic"], transition_velocity=row["transition_velocity"],
        shear_stiffness=row["shear_stiffness"], speed_floor=row["speed_floor"], factor_limit=row["factor_limit"],
    )  # fmt: skip


@kernel
def tanh(x):
    """Return the hyperbolic tangent of ``x >= 0`` to two units in the last place, at half the cost of the library's.

    A rational function below 0.625 (S. L. Moshier, Cephes, tanh.c), above it the exponential.
    """
    if x < 0.625:
        s = x * x
        above = (-9.64399179425052238628e-1 * s - 9.92877231001918586564e1) * s - 1.61468768441708447952e3
        below = ((s + 1.12811678491632931402e2) * s + 2.23548839060100448583e3) * s + 4.84406305325125486048e3
        return x + x * s * (above / below)
    return 1.0 - 2.0 / (exp(2.0 * x) + 1.0)


@kernel
def sheared(law: Law, shear, slip, normal, step):
    """Return Dahl's elastic displacement (m) after ``step`` seconds of a slip (m/s), and its slope with the slip (s).

    The surface shears by ``shear`` before it slides: the friction force is ``-k shear`` with the shear stiffness k, and
    ``d shear / dt = slip - |slip| shear / limit`` with the ``limit`` mu_s N / k of full sliding (P. R. Dahl, AIAA
    Journal 14 (1976) 1675, exponent 1). The solution is exact for a constant ``normal`` force (N) and slip. The force
    depends on the path of the link, not on its speed.
    """
    limit = law.friction_static * normal / law.shear_stiffness
    if limit <= 0.0:
        return 0.0, 0.0
    end = copysign(limit, slip)
    start = min(max(shear, -limit), limit)  # a smaller force releases the excess
    rest = exp(-abs(slip) * step / limit)
    return end + (start - end) * rest, step * (1.0 - start / end) * rest


@kernel
def friction_coefficient(law: Law, slip):
    """Return the signed coefficient of Eq. 10 at the slip velocity (m/s): the friction force is against the slip."""
    if law.friction_static == 0.0:
        return 0.0
    x = abs(slip) / law.transition_velocity
    q = 0.25 * x * x + 0.75
    mu = law.friction_dynamic * tanh(4.0 * x) + (law.friction_static - law.friction_dynamic) * x / (q * q)
    return mu if slip >= 0.0 else -mu


@kernel
def stored_impact_speed(stored, speed, floor):
    """Return the initial impact velocity of a contact: the stored one, or ``speed`` (m/s) if it begins now."""
    return stored if stored > 0.0 else max(abs(speed), floor)


@kernel
def groove_index(teeth, x, y):
    """Return the index k (1 to m) of the groove at the point (x, y) of the sprocket frame (Eqs. 16, 17)."""
    gamma = atan2(y, x)
    if gamma < 0.0:
        gamma += 2.0 * pi
    k = int(floor(teeth * gamma / (2.0 * pi))) + 1
    return min(k, teeth)


@kernel
def in_groove(tooth: Tooth, k, cos, sin, x, y):
    """Return the direction of groove k (0: none) of a sprocket turned by ``cos, sin``, and a point in its frame."""
    if k == 0:
        return 1.0, 0.0, 1.0, 0.0
    ck = cos * tooth.groove_cos[k - 1] - sin * tooth.groove_sin[k - 1]
    sk = sin * tooth.groove_cos[k - 1] + cos * tooth.groove_sin[k - 1]
    return ck, sk, ck * x + sk * y, -sk * x + ck * y


@kernel
def find_area(tooth: Tooth, x, y):
    """Return the area touched by an arc centred at (x, y) of the groove frame, depth (m), normal and radius R (m).

    The area, 1 to 10, is the first annular sector of the search order that holds the point (Eqs. 20 to 23), 0 if none;
    the depth is that of Eqs. 29 and 33, the unit normal that of the force on the connector in the groove frame, and R
    of Eq. 8 is ``r_j + r_C`` (convex) or ``r_j - r_C`` (concave).
    """
    rc = tooth.arc_radius
    left = x <= 0.0
    areas = tooth.radius.shape[0]
    for step in range((areas + 1) // 2):
        j = step if left else areas - 1 - step
        ex, ey = x - tooth.centre_x[j], y - tooth.centre_y[j]
        along = ex * tooth.direction_x[j] + ey * tooth.direction_y[j]
        if along <= 0.0:  # more than 90 degrees off u_j
            continue
        d2 = ex * ex + ey * ey
        r = tooth.radius[j]
        if tooth.convex[j]:
            if d2 < r * r or d2 > (r + rc) * (r + rc):
                continue
        elif d2 < (r - rc) * (r - rc) or d2 > r * r:
            continue
        d = sqrt(d2)
        if along < tooth.cos_half_angle[j] * d:
            continue
        if tooth.convex[j]:
            return j + 1, rc + r - d, ex / d, ey / d, r + rc
        return j + 1, d + rc - r, -ex / d, -ey / d, r - rc
    return 0, 0.0, 0.0, 0.0, 0.0


@kernel
def closest_point(ax, ay, bx, by, cx, cy):
    """Return where line AB is closest to C (A: 0, B: 1), point Q of segment AB closest to C, and its distance, m."""
    ux, uy = bx - ax, by - ay
    s = ((cx - ax) * ux + (cy - ay) * uy) / (ux * ux + uy * uy)
    limited = min(max(s, 0.0), 1.0)
    qx, qy = ax + limited * ux, ay + limited * uy
    dx, dy = qx - cx, qy - cy
    return s, qx, qy, sqrt(dx * dx + dy * dy)

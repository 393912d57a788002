"""Normal and friction laws of one contact, on plain numbers (Eqs. 8 to 11)."""

from math import exp, sqrt

from trackdyn.jit import kernel
from trackdyn.model.constants import Law


@kernel
def elastic_force(stiffness, depth, radius):
    """Elastic term of Eq. 8: ``(pi/2) L E* d sqrt(d / (2 (R + d)))``, N.

    ``radius`` is ``|R1 - R2|`` for internal and ``R1 + R2`` for external contact, m.
    """
    return stiffness * depth * sqrt(depth / (radius + depth))


@kernel
def normal_force(law: Law, depth, speed, impact_speed, radius):
    """Normal force of Eq. 8 for penetration ``depth`` (m) and penetration velocity ``speed`` (m/s), N."""
    factor = 1.0 + law.loss * speed / impact_speed
    factor = min(max(factor, 0.0), law.factor_limit)
    return elastic_force(law.stiffness, depth, radius) * factor


@kernel
def implicit_speed(law: Law, elastic, speed, impact_speed, compliance):
    """Penetration velocity (m/s) under the force of Eq. 8 that it makes itself: v with ``v + compliance F(v) = speed``.

    ``elastic`` is the elastic force (N), ``compliance`` what a unit of the force takes from the velocity, m/s/N.
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
def normal_slopes(law: Law, depth, speed, impact_speed, radius):
    """Slopes of Eq. 8 with the penetration (N/m) and with its velocity (N s/m; 0 where the bracket is clipped)."""
    elastic = elastic_force(law.stiffness, depth, radius)
    factor = 1.0 + law.loss * speed / impact_speed
    damping = elastic * law.loss / impact_speed if 0.0 < factor < law.factor_limit else 0.0
    factor = min(max(factor, 0.0), law.factor_limit)
    return factor * elastic / depth * (1.5 - 0.5 * depth / (radius + depth)), damping


@kernel
def tanh(x):
    """Hyperbolic tangent of ``x >= 0`` to two units in the last place, at half the cost of the library's.

    A rational function below 0.625 (S. L. Moshier, Cephes, tanh.c), above it the exponential.
    """
    if x < 0.625:
        s = x * x
        above = (-9.64399179425052238628e-1 * s - 9.92877231001918586564e1) * s - 1.61468768441708447952e3
        below = ((s + 1.12811678491632931402e2) * s + 2.23548839060100448583e3) * s + 4.84406305325125486048e3
        return x + x * s * (above / below)
    return 1.0 - 2.0 / (exp(2.0 * x) + 1.0)


@kernel
def friction_coefficient(law: Law, slip):
    """Signed coefficient of Eq. 10 at the slip velocity (m/s): the friction force is against the slip."""
    if law.friction_static == 0.0:
        return 0.0
    x = abs(slip) / law.transition_velocity
    q = 0.25 * x * x + 0.75
    mu = law.friction_dynamic * tanh(4.0 * x) + (law.friction_static - law.friction_dynamic) * x / (q * q)
    return mu if slip >= 0.0 else -mu


@kernel
def stored_impact_speed(stored, speed, floor):
    """Initial impact velocity of a contact: the stored one, or ``speed`` (m/s) where it begins now."""
    if stored > 0.0:
        return stored
    return max(abs(speed), floor)

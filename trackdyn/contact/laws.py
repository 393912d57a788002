"""Normal and friction laws of one contact, on plain numbers (Eqs. 8 to 11)."""

from math import pi, sqrt, tanh
from typing import NamedTuple

from trackdyn.jit import kernel


class Law(NamedTuple):
    """Constants of a contact between two surfaces.

    Attributes
    ----------
    stiffness : float
        ``pi L E* / (2 sqrt 2)`` of Eq. 8, N/m.
    loss : float
        ``3 (1 - c_r^2) / 4`` of Eq. 8.
    friction_static, friction_dynamic : float
        Coefficients of Eq. 10.
    transition_velocity : float
        v_t of Eq. 10, m/s.
    speed_floor : float
        Least initial impact velocity, m/s.
    factor_limit : float
        Upper bound of the bracket of Eq. 8 (its lower bound is 0: contact never pulls).
    """

    stiffness: float
    loss: float
    friction_static: float
    friction_dynamic: float
    transition_velocity: float
    speed_floor: float
    factor_limit: float


def make_law(contact_length, composite_modulus, restitution, mu_s, mu_d, v_t, speed_floor, factor_limit) -> Law:
    """Constants of Eqs. 8 and 10 from material data (SI units)."""
    stiffness = pi * contact_length * composite_modulus / (2 * sqrt(2.0))
    return Law(stiffness, 0.75 * (1 - restitution**2), mu_s, mu_d, v_t, speed_floor, factor_limit)


@kernel
def elastic_force(stiffness, depth, radius):
    """Elastic part of Eq. 8: ``(pi/2) L E* d sqrt(d / (2 (R + d)))``, N.

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
def friction_coefficient(law: Law, slip):
    """Signed coefficient of Eq. 10 at the slip velocity (m/s): the friction force is against the slip."""
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

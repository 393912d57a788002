"""Normal and friction laws of one contact, on plain numbers (Eqs. 8 to 11)."""

from math import log1p, pi, sqrt, tanh
from typing import NamedTuple

from scipy.optimize import brentq

from trackdyn.jit import kernel

NORMAL_LAWS = ("printed", "delivered", "elastic")


class Law(NamedTuple):
    """Constants of a contact between two surfaces.

    Attributes
    ----------
    stiffness : float
        ``pi L E* / (2 sqrt 2)`` of Eq. 8, N/m.
    loss : float
        Factor chi of the relative penetration velocity: ``3 (1 - c_r^2) / 4`` of Eq. 8, the one that
        delivers c_r, or 0 for an elastic contact.
    friction_static, friction_dynamic : float
        Coefficients of Eq. 10; both 0: no friction.
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


# |1 - restitution| below which the two functions take their series: the equation itself loses its digits
NEARLY_ELASTIC = 1e-4
# chi e that counts as 1: below a restitution of about 0.026 the two differ by less than rounding
ALMOST_ONE = 1 - 1e-15


def _imbalance(loss, restitution):
    """``chi (1 + e) - ln((1 + chi) / (1 - chi e))``, the integral of ``m v dv = -f (1 + chi v / v0) d delta``."""
    return loss * (1 + restitution) - log1p(loss) + log1p(-loss * restitution)


def delivered_restitution(loss: float) -> float:
    """Restitution that a damping factor ``loss`` delivers, whatever the elastic law.

    Solution e of ``chi (1 + e) = ln((1 + chi) / (1 - chi e))``.
    """
    if loss < 1.5 * NEARLY_ELASTIC:
        return 1 - 2 / 3 * loss + 4 / 9 * loss**2
    upper = min(1.0, ALMOST_ONE / loss)
    if _imbalance(loss, upper) >= 0:
        return upper
    return float(brentq(lambda e: _imbalance(loss, e), 0.0, upper))


def delivering_loss(restitution: float) -> float:
    """Damping factor that delivers the restitution it is named after: the inverse of `delivered_restitution`."""
    lack = 1 - restitution
    if lack < NEARLY_ELASTIC:
        return 1.5 * lack * (1 + lack)
    upper = ALMOST_ONE / restitution
    if _imbalance(upper, restitution) >= 0:
        return upper
    return float(brentq(lambda chi: _imbalance(chi, restitution), 1e-6, upper, xtol=1e-14))


def make_law(
    contact_length, composite_modulus, restitution, mu_s, mu_d, v_t, speed_floor, factor_limit, normal_law="printed"
) -> Law:
    """Constants of Eqs. 8 and 10 from material data (SI units).

    ``normal_law`` is one of ``NORMAL_LAWS``: Eq. 8 as printed, the same with the factor that delivers
    ``restitution`` (its bracket then reaches 1 + chi in the first instant, so it is not clipped below
    that), or without any loss.
    """
    stiffness = pi * contact_length * composite_modulus / (2 * sqrt(2.0))
    loss = 0.0
    if normal_law == "printed":
        loss = 0.75 * (1 - restitution**2)
    elif normal_law == "delivered":
        loss = delivering_loss(restitution)
        factor_limit = max(factor_limit, 1.0 + loss)
    return Law(stiffness, loss, mu_s, mu_d, v_t, speed_floor, factor_limit)


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
def normal_slopes(law: Law, depth, speed, impact_speed, radius):
    """Slopes of Eq. 8 with the penetration (N/m) and with its velocity (N s/m; 0 where the bracket is clipped)."""
    elastic = elastic_force(law.stiffness, depth, radius)
    factor = 1.0 + law.loss * speed / impact_speed
    damping = elastic * law.loss / impact_speed if 0.0 < factor < law.factor_limit else 0.0
    factor = min(max(factor, 0.0), law.factor_limit)
    return factor * elastic / depth * (1.5 - 0.5 * depth / (radius + depth)), damping


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

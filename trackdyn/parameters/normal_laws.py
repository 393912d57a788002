"""Damping factors of the normal laws by name: how much of the speed a contact gives back (Eq. 8)."""

from collections.abc import Callable
from math import log1p
from typing import NamedTuple

from trackdyn.parameters.roots import root

# |1 - restitution| below which the two functions take their series: the equation itself loses its digits
NEARLY_ELASTIC = 1e-4
# chi e that counts as 1: below a restitution of about 0.026 the two differ by less than rounding
ALMOST_ONE = 1 - 1e-15


def _imbalance(loss, restitution):
    """``chi (1 + e) - ln((1 + chi) / (1 - chi e))``, the integral of ``m v dv = -f (1 + chi v / v0) d delta``."""
    return loss * (1 + restitution) - log1p(loss) + log1p(-loss * restitution)


def delivered_restitution(loss: float) -> float:
    """Restitution e of a damping factor, whatever the elastic law: ``chi (1 + e) = ln((1 + chi) / (1 - chi e))``."""
    if loss < 1.5 * NEARLY_ELASTIC:
        return 1 - 2 / 3 * loss + 4 / 9 * loss**2
    upper = min(1.0, ALMOST_ONE / loss)
    if _imbalance(loss, upper) >= 0:
        return upper
    return root(lambda e: _imbalance(loss, e), 0.0, upper)


def delivering_loss(restitution: float) -> float:
    """Damping factor that delivers the restitution it is named after: the inverse of `delivered_restitution`."""
    lack = 1 - restitution
    if lack < NEARLY_ELASTIC:
        return 1.5 * lack * (1 + lack)
    upper = ALMOST_ONE / restitution
    if _imbalance(upper, restitution) >= 0:
        return upper
    return root(lambda chi: _imbalance(chi, restitution), 1e-6, upper, 1e-14)


class NormalLaw(NamedTuple):
    """Damping factor chi of a restitution; ``unclipped`` if the bracket of Eq. 8 must reach 1 + chi at first."""

    loss: Callable[[float], float]
    unclipped: bool = False


NORMAL_LAWS = {
    "elastic": NormalLaw(lambda restitution: 0.0),
    "printed": NormalLaw(lambda restitution: 0.75 * (1 - restitution**2)),
    "delivered": NormalLaw(delivering_loss, unclipped=True),
}

"""Material laws: damping factors of normal laws (Eq. 8), Maxwell elements for a nearly constant loss factor."""

from collections.abc import Callable
from math import log1p, pi
from typing import Literal, NamedTuple

import numpy as np

from trackdyn.rig.roots import root

NEARLY_ELASTIC = 1e-4  # 1 - restitution below which series replace the equation, which loses its digits
ALMOST_ONE = 1 - 1e-15  # chi e that counts as 1: below a restitution of about 0.026 they differ by rounding
BushingLaw = Literal["viscous", "hysteretic"]
# frequencies at which the Maxwell elements lose most, Hz: the ends and the middle of the band of the law
BAND, ELEMENTS = (0.5, 50.0), 3


def _imbalance(loss, restitution):
    """Integrate ``m v dv = -f (1 + chi v / v0) d delta``: ``chi (1 + e) - ln((1 + chi) / (1 - chi e))``."""
    return loss * (1 + restitution) - log1p(loss) + log1p(-loss * restitution)


def delivered_restitution(loss: float) -> float:
    """Solve ``chi (1 + e) = ln((1 + chi) / (1 - chi e))`` for the restitution e of a damping factor chi."""
    if loss < 1.5 * NEARLY_ELASTIC:
        return 1 - 2 / 3 * loss + 4 / 9 * loss**2
    upper = min(1.0, ALMOST_ONE / loss)
    if _imbalance(loss, upper) >= 0:
        return upper
    return root(lambda e: _imbalance(loss, e), 0.0, upper)


def delivering_loss(restitution: float) -> float:
    """Return the damping factor that delivers a restitution: the inverse of `delivered_restitution`."""
    lack = 1 - restitution
    if lack < NEARLY_ELASTIC:
        return 1.5 * lack * (1 + lack)
    upper = ALMOST_ONE / restitution
    if _imbalance(upper, restitution) >= 0:
        return upper
    return root(lambda chi: _imbalance(chi, restitution), 1e-6, upper, 1e-14)


class NormalLaw(NamedTuple):
    """Normal law: the form of its elastic term, and the damping factor in its bracket."""

    loss: Callable[[float], float]  # damping factor chi of a restitution
    unclipped: bool = False  # the bracket of Eq. 8 must reach 1 + chi at first
    form: str = "cylinders"  # of `contact.laws.FORMS`


NORMAL_LAWS = {
    "elastic": NormalLaw(lambda restitution: 0.0),
    "printed": NormalLaw(lambda restitution: 0.75 * (1 - restitution**2)),
    "delivered": NormalLaw(delivering_loss, unclipped=True),
}


def maxwell_elements(loss_factor: float) -> tuple[np.ndarray, np.ndarray]:
    """Return relative stiffnesses and relaxation times (s) of Maxwell elements with a loss factor over ``BAND``.

    The loss factor is loss modulus over storage modulus. Stiffnesses are relative to that at rest. With ``x = w T``, an
    element of the stiffness g adds ``g x / (1 + x^2)`` to the loss modulus and ``g x^2 / (1 + x^2)`` to the storage
    modulus 1. The loss modulus less the loss factor times the storage modulus is linear in the stiffnesses: they are
    fitted over the band by least squares, and none is negative for loss factors up to 0.5.
    """
    time = 1.0 / (2 * pi * np.geomspace(*BAND, ELEMENTS))
    x2 = (2 * pi * np.geomspace(*BAND, 40 * ELEMENTS)[:, None] * time) ** 2
    # shares over the loss factor, which may be too small to divide by
    share = np.linalg.lstsq((np.sqrt(x2) - loss_factor * x2) / (1 + x2), np.ones(len(x2)), rcond=None)[0]
    return loss_factor * share, time

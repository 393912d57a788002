"""Maxwell branches of rubber whose loss factor hardly depends on the frequency."""

from math import pi
from typing import Literal

import numpy as np

from trackdyn.parameters.roots import nonnegative_least_squares

BushingLaw = Literal["viscous", "hysteretic"]
# Frequencies at which the branches lose most, Hz: the ends and the middle of the band that the law is meant for.
BAND = (0.5, 50.0)
BRANCHES = 3
# Of the loss factor, by how much the branches miss it within the band (0.05 to 0.3; `tests/chain/test_maxwell.py`).
RIPPLE = 0.07


def loss_branches(loss_factor: float) -> tuple[np.ndarray, np.ndarray]:
    """Stiffnesses, as shares of that at rest, and relaxation times (s) of branches with a loss factor over ``BAND``.

    The loss factor is loss modulus over storage modulus: the energy lost in a cycle over 2 pi times the largest stored.
    With ``x = w T``, a branch of the share g adds ``g x / (1 + x^2)`` to the loss modulus and ``g x^2 / (1 + x^2)`` to
    the storage modulus 1 at rest. The loss modulus less the loss factor times the storage modulus is linear in the
    shares; least squares over the band, none negative. A constant loss factor means a stiffness that grows with the
    frequency (Kramers-Kronig): across the band by about ``w^(2 loss_factor / pi)``.
    """
    time = 1.0 / (2 * pi * np.geomspace(*BAND, BRANCHES))
    x2 = (2 * pi * np.geomspace(*BAND, 40 * BRANCHES)[:, None] * time) ** 2
    # shares over the loss factor, which may be so small that nothing could be divided by it
    share = nonnegative_least_squares((np.sqrt(x2) - loss_factor * x2) / (1 + x2), np.ones(len(x2)))
    return loss_factor * share, time

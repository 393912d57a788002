"""Integrators and their properties: explicit Runge-Kutta methods by their tableau, others by flags."""

from collections.abc import Sequence
from math import inf
from typing import NamedTuple


class Tableau(NamedTuple):
    """Coefficients of the stages and weights of the step."""

    a: Sequence[Sequence[float]]
    b: Sequence[float]


class Method(NamedTuple):
    """Properties of an integrator."""

    order: int  # order of the error of a smooth motion: closed chain and bushings, no contact begins or ends
    # oscillation, decay: reach of the stability region along the imaginary and the negative real axis; inf where
    # nothing explicit can diverge
    oscillation: float
    decay: float
    # explicit Runge-Kutta method; None: the step of `integrate.semi_implicit`, bushing damping implicit in the sweep
    tableau: Tableau | None = None
    linearly_implicit: bool = False  # whether the sweep includes slopes of the contacts

    @property
    def staggered(self) -> bool:
        """Return whether velocities belong to the middle of a step and forces to its ends."""
        return self.tableau is None and not self.linearly_implicit


# Classical Runge-Kutta method: Kutta, Z. Math. Phys. 46 (1901).
_RK4 = Tableau([[0, 0, 0, 0], [1 / 2, 0, 0, 0], [0, 1 / 2, 0, 0], [0, 0, 1, 0]], [1 / 6, 1 / 3, 1 / 3, 1 / 6])

METHODS = {
    # the sweep includes the slopes of contacts and bushings (`chain.implicit`)
    "linearly_implicit": Method(order=1, oscillation=inf, decay=inf, linearly_implicit=True),
    # velocities with the accelerations at the start of the step, positions with the new velocities
    "semi_implicit": Method(order=1, oscillation=2.0, decay=2.0),
    "rk4": Method(order=4, oscillation=2.82, decay=2.78, tableau=_RK4),
}

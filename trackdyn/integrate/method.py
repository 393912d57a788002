"""What an integrator declares (`integrate.methods`)."""

from collections.abc import Sequence
from typing import NamedTuple


class Tableau(NamedTuple):
    """Coefficients of the stages, weights of the step, weights of its estimated error (None: a fixed step)."""

    a: Sequence[Sequence[float]]
    b: Sequence[float]
    error: Sequence[float] | None = None


class Method(NamedTuple):
    """What an integrator declares.

    Attributes
    ----------
    order : int
        Of the error of a smooth motion: closed chain and bushings, no contact that begins or ends.
    oscillation, decay : float
        Reach of the stability region along the imaginary and the negative real axis; inf where nothing explicit
        can diverge or the step is only where the method reports.
    tableau : Tableau or None
        Of an explicit Runge-Kutta method; None for the step of `integrate.semi_implicit`.
    linearly_implicit : bool
        Whether slopes of the contacts ride in the sweep.
    """

    order: int
    oscillation: float
    decay: float
    tableau: Tableau | None = None
    linearly_implicit: bool = False

    @property
    def adaptive(self) -> bool:
        """Whether the step is controlled by a tolerance."""
        return self.tableau is not None and self.tableau.error is not None

    @property
    def staggered(self) -> bool:
        """Whether velocities belong to the middle of a step and forces to its ends."""
        return self.tableau is None and not self.linearly_implicit

    @property
    def implicit_damping(self) -> bool:
        """Whether bushing damping and a compliant cut are implicit in the sweep."""
        return self.tableau is None

"""The integrators: a file each, found by its name, that declares the order and the limits in ``METHOD``.

An explicit Runge-Kutta method is its tableau and nothing else. The two methods of order 1 share the step of
`integrate.semi_implicit`; the linearly implicit one brings the arrays that its sweep needs.
"""

from collections.abc import Sequence
from importlib import import_module
from pkgutil import iter_modules
from typing import NamedTuple

from trackdyn.model.work import Work, make_implicit, make_stages


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
    def implicit_damping(self) -> bool:
        """Whether bushing damping and a compliant cut are implicit in the sweep."""
        return self.tableau is None


METHODS: dict[str, Method] = {
    module.name: import_module(f"{__name__}.{module.name}").METHOD for module in iter_modules(__path__)
}


def equip(work: Work, integrator: str, pitches: int, tolerance: float = 0.0) -> Work:
    """``work`` with the arrays of an integrator and without those of any other."""
    method, n, wheels = METHODS[integrator], len(work.cos), len(work.wheel_torque)
    tableau = method.tableau
    stages = None
    if tableau is not None:
        error = tableau.error if method.adaptive else [0.0] * len(tableau.b)
        stages = make_stages(tableau.a, tableau.b, error, tolerance if method.adaptive else 0.0, n, pitches, wheels)
    return work._replace(stages=stages, implicit=make_implicit(n, wheels) if method.linearly_implicit else None)

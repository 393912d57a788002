"""The integrators: what each declares, and the arrays that it needs.

An explicit Runge-Kutta method is its tableau and nothing else. The two methods of order 1 share the step of
`integrate.semi_implicit`; the linearly implicit one brings the arrays of its sweep (`chain.implicit`).
"""

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

from trackdyn.model.work import Work, make_implicit, make_stages


class Tableau(NamedTuple):
    """Coefficients of the stages, weights of the step, weights of its estimated error (None: a fixed step)."""

    a: Sequence[Sequence[float]]
    b: Sequence[float]
    error: Sequence[float] | None = None


class Method(NamedTuple):
    """What an integrator declares."""

    order: int  # of the error of a smooth motion: closed chain and bushings, no contact that begins or ends
    # oscillation, decay: reach of the stability region along the imaginary and the negative real axis; inf where
    # nothing explicit can diverge or the step is only where the method reports
    oscillation: float
    decay: float
    tableau: Tableau | None = None  # of an explicit Runge-Kutta method; None for the step of `integrate.semi_implicit`
    linearly_implicit: bool = False  # whether slopes of the contacts ride in the sweep

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


# Classical Runge-Kutta method: Kutta, Z. Math. Phys. 46 (1901).
_RK4 = Tableau([[0, 0, 0, 0], [1 / 2, 0, 0, 0], [0, 1 / 2, 0, 0], [0, 0, 1, 0]], [1 / 6, 1 / 3, 1 / 3, 1 / 6])
# Dormand and Prince, J. Comput. Appl. Math. 6 (1980), 5(4); the error's weights are those of the 5th less the 4th
# order.
_DORMAND_PRINCE = Tableau(
    [
        [0, 0, 0, 0, 0, 0, 0],
        [1 / 5, 0, 0, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0, 0],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84, 0],
    ],
    [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84, 0],
    [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40],
)

METHODS = {
    # the slopes of contacts and bushings ride along in the sweep (`chain.implicit`)
    "linearly_implicit": Method(order=1, oscillation=inf, decay=inf, linearly_implicit=True),
    # velocities with the accelerations at the start of the step, places with the new velocities
    "semi_implicit": Method(order=1, oscillation=2.0, decay=2.0),
    "rk4": Method(order=4, oscillation=2.82, decay=2.78, tableau=_RK4),
    "adaptive": Method(order=5, oscillation=inf, decay=inf, tableau=_DORMAND_PRINCE),
}


def equip(work: Work, integrator: str, pitches: int, tolerance: float = 0.0, branches: int = 0) -> Work:
    """``work`` with the arrays of an integrator and of no other; for bushings that have ``branches`` branches."""
    method, n, wheels = METHODS[integrator], len(work.cos), len(work.wheel_torque)
    tableau = method.tableau
    stages = None
    if tableau is not None:
        error = tableau.error if method.adaptive else [0.0] * len(tableau.b)
        controlled = tolerance if method.adaptive else 0.0
        stages = make_stages(tableau.a, tableau.b, error, controlled, n, pitches, wheels, branches)
    return work._replace(stages=stages, implicit=make_implicit(n, wheels) if method.linearly_implicit else None)

"""The integrators: a file each, found by its name, that declares the order and the limits in ``METHOD``.

An explicit Runge-Kutta method is its tableau and nothing else. The two methods of order 1 share the step of
`integrate.semi_implicit`; the linearly implicit one brings the arrays that its sweep needs.
"""

from importlib import import_module
from pkgutil import iter_modules

from trackdyn.integrate.method import Method, Tableau
from trackdyn.model.work import Work, make_implicit, make_stages

__all__ = ["METHODS", "Method", "Tableau", "equip"]

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

"""Which claims cannot be shown together: for every set of them a search aimed at that set alone.

A set is a conflict if no rig that its search finds shows all of its claims, and minimal if every smaller one in it can
be shown. That is said of the searches: each approach is an upper bound of the nearest one.
"""

import importlib
from collections.abc import Callable, Sequence
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd

from trackdyn.errors import InputError
from trackdyn.inference.search import BEND, Method, Problem, Round, Start, search
from trackdyn.parameters.validation import shown


class GroupedProblem(Problem):
    """A problem that knows of each residual which claim it belongs to."""

    groups: Sequence[str]


class _Aimed:
    """The residuals of some groups of a problem; its rows are the same."""

    def __init__(self, problem: GroupedProblem, groups: Sequence[str]):
        self.problem = problem
        self.rows, self.sources, self.task = problem.rows, problem.sources, problem.task
        self.kept = np.isin(list(problem.groups), list(groups))

    def residuals(self, values: dict) -> np.ndarray:
        return np.asarray(self.problem.residuals(values))[self.kept]


def aimed(problem: str, asked: dict, groups: list[str]) -> _Aimed:
    """A problem (``module:name`` of what makes it) with the residuals of some groups only."""
    module, _, name = problem.partition(":")
    return _Aimed(getattr(importlib.import_module(module), name)(**asked), groups)


def approach(
    problem: Callable[..., GroupedProblem],
    asked: dict,
    groups: Sequence[str],
    starts: Sequence[Start],
    rounds: Sequence[Round],
    method: Method = "dfols",
    radius: float = 0.1,
    jobs: int = 1,
    store: Path | str | None = None,
) -> tuple[float, str, list[float]]:
    """How near a search comes to some groups of residuals at once.

    Parameters
    ----------
    problem, asked, starts, rounds, method, radius, jobs, store
        As `inference.search.search`.
    groups : sequence of str
        The claims that are asked for together.

    Returns
    -------
    largest : float
        Largest residual of these groups at the best point, in tolerances; infinite if no start runs. What is minimised
        is the sum of squares.
    start : str
        Where that search began.
    x : list of float
        The point.
    """
    name = f"{problem.__module__}:{problem.__qualname__}"
    given = {"problem": name, "asked": asked, "groups": list(groups)}
    ends = search(aimed, given, starts, rounds, method, radius, None, jobs, store, log=lambda _: None)

    def largest(end) -> float:
        bent = np.abs(end.residuals).max(initial=0.0) if end.residuals else np.inf
        return float(BEND * np.sinh(bent / BEND)) if np.isfinite(bent) else float("inf")

    best = min(ends, key=largest)
    return largest(best), best.start, best.x


def minimal_conflicts(
    problem: Callable[..., GroupedProblem],
    asked: dict,
    groups: Sequence[str],
    starts: Sequence[Start],
    rounds: Sequence[Round],
    cutoff: float = 1.0,
    size: int = 3,
    **how,
) -> pd.DataFrame:
    """Nearest approach to every set of claims up to a size; sets that hold a smaller conflict are left out.

    Parameters
    ----------
    cutoff : float
        Largest residual with which a claim counts as shown, in tolerances.
    size : int
        Of the largest sets.
    **how
        Of `approach`.

    Returns
    -------
    DataFrame
        ``claims`` (``C16 C24``), ``size, approach, conflict, start, x``.

    Raises
    ------
    InputError
        A group that the problem does not have, or one that occurs twice.
    """
    known = set(problem(**asked).groups)
    if set(groups) - known or len(set(groups)) < len(groups):
        raise InputError(f"groups = {shown(list(groups))}: each of {', '.join(sorted(known))} once")
    rows: list[dict] = []
    conflicts: list[set] = []
    for count in range(1, size + 1):
        for chosen in combinations(groups, count):
            if any(found <= set(chosen) for found in conflicts):
                continue
            near, start, x = approach(problem, asked, chosen, starts, rounds, **how)
            if near > cutoff:
                conflicts.append(set(chosen))
            row = {"claims": " ".join(chosen), "size": count, "approach": near, "conflict": near > cutoff}
            rows.append(row | {"start": start, "x": x})
    return pd.DataFrame(rows, columns=["claims", "size", "approach", "conflict", "start", "x"])

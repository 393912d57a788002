"""Least squares from many starts: local searches in the unit cube, all their runs rows of the sweep engine.

A local search is a row, and so is every evaluation that it makes: searches run beside each other, a search that is
killed goes on where it was, and one that is given more evaluations repeats the first ones out of its store.
"""

import importlib
from collections.abc import Callable, Hashable, Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple, Protocol, TypeVar, get_args

import numpy as np

from trackdyn.errors import InputError, TrackdynError
from trackdyn.extras import required
from trackdyn.parameters.validation import shown
from trackdyn.sources import module_hash
from trackdyn.sweeps.engine import DONE, Maker, check_completed, key_of, results

K = TypeVar("K", bound=Hashable)
SearchMethod = Literal["dfols", "cma"]
# A residual grows as it is up to about so many tolerances and with its logarithm beyond: one target that is far off
# outweighs no ten that are near, and still has a gradient. Three tolerances: what is further off is lost either way.
BEND = 3.0
# What cannot run is worse than the nearest point that can, in every residual: by this at once, and this much more
# across the cube. So the model of a search slopes back to where rigs run.
REFUSED, SLOPE = 1.0, 10.0
LEAST_RADIUS = 1e-3  # of the cube: trust region or step at which a search has converged
ENDLESS = 100_000  # evaluations that a method is given: what stops it is the budget, whose size it must not see


class Problem(Protocol):
    """What is searched: a point of the unit cube is a row of the sweep engine, and its values are residuals."""

    rows: Maker
    sources: str

    def task(self, x: np.ndarray) -> dict:
        """Arguments of the row at a point; an `InputError` if there is none."""

    def residuals(self, values: dict) -> np.ndarray:
        """Signed residuals of a row that came out, in tolerances; none is NaN."""


class Start(NamedTuple):
    """Where a search begins: its name, a point of the unit cube, and which coordinates it may change."""

    name: str
    x: list[float]
    free: list[bool]


def bent(off) -> np.ndarray:
    """Residuals of which large ones grow with their logarithm (`BEND`); monotone, so that none lacks a gradient."""
    return BEND * np.arcsinh(np.asarray(off, dtype=float) / BEND)


class _SpentError(Exception):
    """The budget is spent."""


class _Evaluated:
    """Residuals at points, every one a row; keeps the best."""

    def __init__(self, problem: Problem, store: str | None, budget: int):
        self.problem, self.store, self.budget = problem, store, budget
        self.points: list[np.ndarray] = []  # that came out
        self.residuals: list[np.ndarray] = []
        self.count = 0
        self.refusal = ""

    def __call__(self, x: np.ndarray) -> np.ndarray:
        x = np.clip(np.round(np.asarray(x, dtype=float), 12), 0.0, 1.0)
        for known, residuals in zip(self.points, self.residuals, strict=True):
            if np.array_equal(known, x):
                return residuals
        if self.count >= self.budget:
            raise _SpentError
        self.count += 1
        values = self._values(x)
        if values is not None:
            self.points.append(x)
            self.residuals.append(np.asarray(self.problem.residuals(values), dtype=float))
            return self.residuals[-1]
        if not self.points:
            raise _SpentError
        far = np.linalg.norm(np.array(self.points) - x, axis=1)
        near = self.residuals[int(far.argmin())]
        return near + np.where(near < 0, -1.0, 1.0) * (REFUSED + SLOPE * far.min())

    def _values(self, x: np.ndarray) -> dict | None:
        try:
            task = self.problem.task(x)
        except InputError as error:
            self.refusal = str(error)
            return None
        key = key_of(task, self.problem.sources)
        row = results(self.problem.rows, {key: task}, 1, self.store)[key]
        check_completed([row], "the same command goes on from there")
        self.refusal = row["reason"]
        return row["values"] if row["state"] == DONE else None


def _dfols(evaluate: Callable, x: np.ndarray, radius: float) -> None:
    dfols = required("dfols")
    off = ("restarts.use_restarts", "init.random_initial_directions", "logging.save_diagnostic_info")
    params: dict[str, Any] = dict.fromkeys(off, False)
    # The package draws directions from numpy's global generator. Each search begins with the same one, so that it takes
    # the same way again, and leaves it as it was.
    before = np.random.get_state()  # noqa: NPY002
    np.random.seed(0)  # noqa: NPY002
    try:
        dfols.solve(
            evaluate, np.clip(x, 0.0, 1.0), bounds=(np.zeros(len(x)), np.ones(len(x))), rhobeg=radius,
            rhoend=min(LEAST_RADIUS, radius / 2), maxfun=ENDLESS, objfun_has_noise=True, user_params=params,
            do_logging=False, print_progress=False,
        )  # fmt: skip
    finally:
        np.random.set_state(before)  # noqa: NPY002


def _cma(evaluate: Callable, x: np.ndarray, radius: float) -> None:
    cma = required("cma")
    options = {"bounds": [0.0, 1.0], "seed": 1, "tolx": LEAST_RADIUS * radius, "maxfevals": ENDLESS, "verbose": -9}
    evaluate(np.clip(x, 0.0, 1.0))  # the method itself begins with points around the start
    strategy = cma.CMAEvolutionStrategy(np.clip(x, 0.0, 1.0), radius, options)
    strategy.optimize(lambda at: 0.5 * float(np.sum(evaluate(at) ** 2)))


METHODS = {"dfols": _dfols, "cma": _cma}


def minimise(
    problem: Problem,
    start: Start,
    evaluations: int,
    method: SearchMethod = "dfols",
    radius: float = 0.1,
    store: Path | str | None = None,
) -> dict:
    """One local search in the unit cube.

    Parameters
    ----------
    problem : Problem
        What is searched.
    start : Start
        Where it begins, and which coordinates are free.
    evaluations : int
        At most so many rows. The way to a point does not depend on them, so that a longer search begins as a shorter.
    method : str
        ``dfols`` (DFO-LS: a model of the residuals over a trust region, one evaluation a step; Cartis, Fiala, Marteau,
        Roberts, ACM TOMS 45, 2019) or ``cma`` (CMA-ES on the sum of squares; Hansen, arXiv:1604.00772).
    radius : float
        First trust region of ``dfols``, first standard deviation of ``cma``; of the unit cube.
    store : path or None
        Folder in which rows are kept.

    Returns
    -------
    dict
        ``x, cost, first_cost, evaluations, ended, residuals, costs`` (of each evaluation that came out).

    Raises
    ------
    InputError
        A method that there is not, or whose package is missing.
    TrackdynError
        A row failed for a reason that may pass.
    """
    if method not in get_args(SearchMethod):
        raise InputError(f"method = {shown(method)}: {' or '.join(get_args(SearchMethod))}")
    free = np.array(start.free, dtype=bool)
    complete = np.array(start.x, dtype=float)
    evaluated = _Evaluated(problem, None if store is None else str(store), evaluations)

    def at(free_values: np.ndarray) -> np.ndarray:
        x = complete.copy()
        x[free] = free_values
        return evaluated(x)

    ended = "converged"
    try:
        METHODS[method](at, complete[free], radius)
    except _SpentError:
        ended = "budget"
    if not evaluated.points:
        lost = {"x": complete.tolist(), "cost": None, "first_cost": None, "residuals": [], "costs": []}
        return lost | {"evaluations": evaluated.count, "ended": f"the start does not run: {evaluated.refusal}"}
    costs = [0.5 * float(residuals @ residuals) for residuals in evaluated.residuals]
    best = int(np.argmin(costs))
    return {
        "x": evaluated.points[best].tolist(), "cost": costs[best], "first_cost": costs[0],
        "evaluations": evaluated.count, "ended": ended, "residuals": evaluated.residuals[best].tolist(), "costs": costs,
    }  # fmt: skip


def _local(problem: str, requested: dict, start: list, store: str | None, **fields: Any) -> dict:
    module, _, name = problem.partition(":")
    made = getattr(importlib.import_module(module), name)(**requested)
    return minimise(made, Start(*start), store=store, **fields)


def rows_of_searches(memory: float) -> Callable[..., dict]:
    """What computes a local search as a row."""
    return _local


def local_searches(
    problem: Callable[..., Problem],
    requested: Mapping[K, tuple[dict, Start]],
    evaluations: int,
    jobs: int = 1,
    store: Path | str | None = None,
    **how: Any,
) -> dict[K, dict]:
    """Local searches beside each other.

    Parameters
    ----------
    problem : function
        Makes the `Problem`; it is looked up by its name in other processes.
    requested : mapping
        By any key what the problem is made of, plain data, and where a search begins.
    evaluations : int
        At most so many rows each, those of a shorter search among them.
    store : path or None
        Folder of all rows, in it a folder for each point where searches start: they share their rows.
    jobs : int
        Processes, each with a search of its own.
    **how
        Of `minimise`.

    Returns
    -------
    dict
        `minimise` by the keys of ``requested``.
    """
    sources = module_hash(problem.__module__)
    name = f"{problem.__module__}:{problem.__qualname__}"
    tasks, keys = {}, {}
    for of, (settings, start) in requested.items():
        task = {"problem": name, "requested": settings, "start": [start.name, list(start.x), list(start.free)]}
        task |= {"evaluations": evaluations} | how
        keys[of] = key_of(task, sources)
        tasks[keys[of]] = task | {"store": None if store is None else str(Path(store) / key_of(list(start.x)))}
    rows = results(rows_of_searches, tasks, jobs, None if store is None else Path(store) / "searches")
    check_completed(rows.values(), "the same command goes on from there")
    ends = {}
    for of, (_, start) in requested.items():
        row = rows[keys[of]]
        if row["state"] != DONE:
            raise TrackdynError(f"start {start.name}: {row['reason']}")
        lost = {cost: float("inf") for cost in ("cost", "first_cost") if row["values"][cost] is None}
        ends[of] = row["values"] | lost
    return ends

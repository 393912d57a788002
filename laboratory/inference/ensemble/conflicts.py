"""Which claims no rig shows together: minimal sets of them, each confirmed by searches that are aimed at it.

A set that a rig which ran shows is no conflict. For any other, searches start from the rigs nearest to it and see the
targets of that set alone. A set that they do not show either is a conflict; since sets that hold a smaller one are not
searched, it is a minimal one. The approaches are upper bounds of the nearest one that a rig can have.
"""

from collections.abc import Callable, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from laboratory.inference.ensemble.history import judged
from laboratory.inference.ensemble.local import ensemble_problem, plain, shipped_point
from laboratory.inference.ensemble.settings import ConflictSearch
from laboratory.inference.ensemble.stages import CONFLICTS, FIRST, SHIPPED, SHIPPED_RIG, Ensemble, read_errors
from laboratory.inference.ensemble.verdicts import all_judged, all_points, group_worst
from laboratory.inference.ensemble.waves import points_table
from laboratory.inference.search import Problem, Start, bent, local_searches, straight

SHOWN, FOUND, CONFLICT = "shown by a rig that ran", "shown by a search", "conflict"
OPEN, LARGER = "not searched", "holds a smaller one"
COLUMNS = ["claims", "size", "verdict", "sample", "sample_rig", "search", "search_rig", "evaluations"]
PAIR = 2  # larger sets stand in the table only where every smaller one in them is shown


def minimal_conflicts(
    problem: Callable[..., Problem],
    requested: Callable[[Sequence[str]], dict],
    worst: pd.DataFrame,
    points: pd.DataFrame,
    free: Sequence[bool],
    asked_for: ConflictSearch,
    cutoff: float,
    jobs: int = 1,
    store: Path | str | None = None,
    **how: Any,
) -> tuple[pd.DataFrame, np.ndarray]:
    """Minimal sets of claims that no rig shows.

    Parameters
    ----------
    problem : function
        Of `inference.search.local_searches`.
    requested : function
        From some claims to what the problem is made of that has the residuals of these alone.
    worst : (rigs, claims) DataFrame
        Of every rig that ran the largest residual of each claim; infinite where it has none.
    points : (rigs, d) DataFrame
        Where these rigs lie in the unit cube.
    free : sequence of bool
        Coordinates that a search may change.
    asked_for : ConflictSearch
        How much is searched.
    cutoff : float
        Largest residual with which a claim counts as shown.
    jobs, store, **how
        Of `inference.search.local_searches`.

    Returns
    -------
    table : DataFrame
        A row a set: ``claims`` (``C16 C24``), ``size``, ``verdict``, ``sample`` (nearest approach of the rigs that ran:
        the least over rigs of the largest residual) and which rig that is, ``search`` (the same of the searches; NaN
        where there was none), ``search_rig``: row of ``found``, ``evaluations`` of all its searches.
    found : (n, d) array
        Where the nearest searches ended.
    """
    rows: list[dict] = []
    found: list[list[float]] = []
    missing: list[set[str]] = []  # sets that nothing shows
    left = asked_for.sets
    for size in range(1, asked_for.size + 1):
        due: dict[tuple[str, ...], dict] = {}
        for chosen in combinations(worst.columns, size):
            near = worst[list(chosen)].max(axis=1)
            row = {"claims": " ".join(chosen), "size": size, "sample": float(near.min()), "sample_rig": near.idxmin()}
            if larger := any(smaller <= set(chosen) for smaller in missing):
                row["verdict"] = LARGER
            elif row["sample"] <= cutoff:
                row["verdict"] = SHOWN
            else:
                row["verdict"] = OPEN
                due[chosen] = row
            if not larger or size <= PAIR:
                rows.append(row)
        nearest = sorted(due, key=lambda chosen: due[chosen]["sample"])[:left]
        left -= len(nearest)
        tasks = {}
        for chosen in nearest:
            rigs = worst[list(chosen)].max(axis=1).sort_values(kind="stable").index[: asked_for.starts]
            for rig in rigs:
                start = Start(str(rig), points.loc[rig].to_list(), list(free))
                tasks[chosen, rig] = (requested(chosen), start)
        ends = local_searches(problem, tasks, asked_for.evaluations, jobs, store, enough=float(bent(cutoff)), **how)
        for chosen in nearest:
            of = [end for (searched, _), end in ends.items() if searched == chosen]
            far = [straight(np.abs(end["residuals"]).max()) if end["residuals"] else np.inf for end in of]
            best = int(np.argmin(far))
            due[chosen] |= {
                "search": far[best], "search_rig": len(found), "evaluations": sum(end["evaluations"] for end in of),
                "verdict": FOUND if far[best] <= cutoff else CONFLICT,
            }  # fmt: skip
            found.append(of[best]["x"])
        missing += [set(chosen) for chosen, row in due.items() if row["verdict"] != FOUND]
    table = pd.DataFrame(rows, columns=COLUMNS).astype({"search_rig": "Int64", "evaluations": "Int64"})
    return table, np.array(found).reshape(-1, points.shape[1])


def conflicts(e: Ensemble, jobs: int, store: Path | str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """`minimal_conflicts` of an ensemble, and the rigs that the searches found as points.

    The rigs that ran are those of all waves, the ends of the local searches, and the rig as it ships where no value
    lies outside its range: -1 in ``sample_rig``. Rigs in ``search_rig`` are those of the points.
    """
    known = read_errors(e)
    points = all_points(e)[e.unknowns.labels]
    judgements = [all_judged(e)]
    if (own := shipped_point(e)) is not None:
        points.loc[SHIPPED_RIG] = own
        judgements.append(judged(e.config, e.targets, e.outputs(SHIPPED), known, cheap=False))
    every = plain(e, known)

    def aimed(claims: Sequence[str]) -> dict:
        kept = zip(every["targets"], e.targets, strict=True)
        return every | {"targets": [one for one, target in kept if target.group in claims]}

    free = [not unknown.discrete for unknown in e.unknowns.unknowns]
    table, found = minimal_conflicts(
        ensemble_problem, aimed, group_worst(e, pd.concat(judgements)), points, free, e.form.conflicts, e.config.cutoff,
        jobs, store, method=e.config.method, radius=e.config.radius, directions=e.form.local_directions,
    )  # fmt: skip
    first = FIRST[CONFLICTS]
    return table.assign(search_rig=table["search_rig"] + first), points_table(e.unknowns, found, first)

"""A rig that meets as many printed numbers as it can: sequential linear programming of an exact penalty.

The cost of a rig is the sum of the excess of its residuals over a margin, which gives up a number that excludes others
rather than missing all by a little. S. P. Han, O. L. Mangasarian, Exact penalty functions in nonlinear programming,
Math. Program. 17 (1979) 251.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice, product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import linprog

from laboratory.plausible.distances import residuals, weights
from laboratory.plausible.draws import built, drawn_values, run_rigs
from laboratory.plausible.settings import PlausibleConfig
from laboratory.plausible.unknowns import Unknowns, file_ranges
from laboratory.plausible.verdicts import evidence
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.sweeps.engine import DONE
from trackdyn_replication.paper.claims import INDEPENDENT, judge_all, load_claims, load_sentences, printed_numbers
from trackdyn_replication.paper.scorecard import count, sentence_verdicts

INSIDE = 0.001, 0.999  # of the ranges
MARGIN = 0.96  # size of a residual that costs nothing
REACH = (0.25, 0.5, 1.0, 2.0)  # of the largest move: steps of an iteration, run side by side
MOVE_COST = 0.02  # of a move by a whole range, so that a value that helps nothing stays
LEAST_REACH = 0.005  # of a range, at which a search ends
WORTH = 0.1  # of the gain by the linear model, below which the reach is halved
SEARCHED = "linear programs"


def searched_unknowns(config: PlausibleConfig, name: str) -> Unknowns:
    """Return the unknowns of a search: those of the sample without the fields that it sets, and its own."""
    search = config.search.searches[name]
    own = {unknown.label: unknown for unknown in search.unknowns}
    drawn = [own.pop(unknown.label, unknown) for unknown in config.unknowns if unknown.label not in search.fields]
    rig = load_rig(config.near.rig).changed(**search.fields)
    return Unknowns([*drawn, *own.values()], rig, file_ranges(config.rig))


class Outcome(NamedTuple):
    """Residuals of a rig (`distances.residuals`), and counts of independent printed numbers met and sentences shown."""

    residuals: dict[str, float]
    numbers: int
    sentences: int


class Searching:
    """Searches whose rows are rows of the sweep engine, judged by the ``claims`` of a file."""

    def __init__(self, config: PlausibleConfig, claims: Path | str, jobs: int, store: Path | str):
        self.settings, self.jobs, self.store = config.search, jobs, store
        self.claims, self.sentences = load_claims(claims), load_sentences(claims)
        self.config = config.with_one_start
        radii = config.search.radii_m.items()
        detailed = {(rpm, config.ring_radius_m) for rpm, _ in radii} | {(config.speed_rpm, None)}
        self.scenes = [[rpm, ring, (rpm, ring) in detailed] for rpm, rings in radii for ring in rings]

    def outcomes(self, unknowns: Unknowns, points: Sequence[np.ndarray]) -> list[Outcome | None]:
        """Return the outcomes of points of the unit cube; None for a rig that does not run."""
        rigs = [built(unknowns.rig, fields)[0] for fields in map(unknowns.changes, map(unknowns.values, points))]
        rows = run_rigs(self.config, rigs, self.scenes, self.jobs, self.store)
        return [self._outcome(rig, row) for rig, row in zip(rigs, rows, strict=True)]

    def _outcome(self, rig: Rig | None, row: dict) -> Outcome | None:
        if rig is None or row["state"] != DONE:
            return None
        values = row["values"]["starts"][0]
        shown_by = evidence(self.config, self.scenes, values, rig)
        numbers = printed_numbers(self.claims, shown_by)
        met = numbers.loc[numbers["group"] == INDEPENDENT, "met"].sum()
        sentences = sentence_verdicts(judge_all(self.claims, shown_by), self.sentences)
        return Outcome(residuals(self.config, values), int(met), count(sentences)[0])

    def starts(self, name: str, unknowns: Unknowns) -> Iterator[tuple[str, np.ndarray]]:
        """Yield where a search begins, and how each point came: draws of the sample, then each of them scanned."""
        own, scan = self.settings.searches[name].values, self.settings.scan
        drawn = dict(enumerate(islice(drawn_values(self.config), max(self.settings.draws) + 1)))
        points = [(f"draw {draw}", drawn[draw] | own) for draw in self.settings.draws]
        for scanned in product(*scan.values()):
            changes = dict(zip(scan, scanned, strict=True))
            points += [(f"draw {draw}, scanned", drawn[draw] | own | changes) for draw in self.settings.draws]
        for begin, values in points:  # a value outside the range of an unknown in this search is taken to its bound
            within = [
                unknown.position(min(max(values[unknown.label], unknown.low), unknown.high))
                for unknown in unknowns.unknowns
            ]
            yield begin, np.clip(within, *INSIDE)

    def search(self, name: str) -> pd.DataFrame:
        """Return every row of a search: ``search, row, begin, cost, numbers, sentences`` and every unknown.

        It ``begin``s as a start (`starts`) or by linear programs, which continue from the start that meets most numbers
        and, of those, costs least, with differences of all unknowns to both sides and steps of several reaches.
        """
        unknowns = searched_unknowns(self.config, name)
        rows: list[dict] = []

        def evaluate(points: Sequence[np.ndarray], begins: Sequence[str] = ()) -> list[dict[str, float] | None]:
            points = [np.round(x, 12) for x in points]
            measured, begins = [], begins or [SEARCHED] * len(points)
            for begin, x, outcome in zip(begins, points, self.outcomes(unknowns, points), strict=True):
                at = {"search": name, "row": len(rows) + 1, "begin": begin}
                if outcome is not None:
                    counts = {"numbers": outcome.numbers, "sentences": outcome.sentences}
                    at |= {"cost": cost(outcome.residuals)} | counts
                rows.append(at | unknowns.values(x))
                measured.append(None if outcome is None else outcome.residuals)
            return measured

        begins, points = zip(*self.starts(name, unknowns), strict=True)
        measured = evaluate(points, begins)
        ran = [i for i, residual in enumerate(measured) if residual is not None]
        if ran:
            best = min(ran, key=lambda i: (-rows[i]["numbers"], rows[i]["cost"]))
            self._descend(points[best], measured[best], evaluate, rows)
        return pd.DataFrame(rows)

    def _descend(self, x: np.ndarray, residual: dict[str, float], evaluate, rows: list) -> None:
        most, reach = len(rows) + self.settings.rows, self.settings.reach
        while len(rows) < most and reach > LEAST_REACH:
            sides = [
                np.clip(x + move, *INSIDE)
                for half in (reach / 2, -reach / 2)
                for move in np.diag(np.full(len(x), half))
            ]
            of_sides = evaluate(sides)
            jacobian = _jacobian(x, residual, sides, of_sides)
            steps = [linear_step(x, residual, jacobian, reach * share) for share in REACH]
            tried, outcomes = [*sides, *steps], [*of_sides, *evaluate(steps)]
            best, before = int(np.argmin([cost(outcome) for outcome in outcomes])), cost(residual)
            promised = before - min(cost(residual, jacobian @ (step - x)) for step in steps)
            gained = before - cost(outcomes[best])
            if gained > 0:
                x, residual = tried[best], outcomes[best]
            if gained < WORTH * promised or not promised > 0:
                reach /= 2


def cost(residual: Mapping[str, float] | None, change: np.ndarray | float = 0.0) -> float:
    """Return the weighted excess of changed residuals over the margin; infinite for a rig that does not run."""
    if residual is None:
        return np.inf
    return float(weights(residual) @ np.maximum(np.abs(_sizes(residual) + change) - MARGIN, 0.0))


def _sizes(residual: Mapping[str, float]) -> np.ndarray:
    return np.array(list(residual.values()))


def _jacobian(x: np.ndarray, residual: Mapping, sides: Sequence[np.ndarray], outcomes: Sequence) -> np.ndarray:
    """Return differences of the residuals over every coordinate, to one side where the other one does not run."""
    n, slopes = len(x), []
    for i in range(n):
        near = [(x, residual), (sides[i], outcomes[i]), (sides[n + i], outcomes[n + i])]
        ran = [(point[i], _sizes(outcome)) for point, outcome in near if outcome is not None]
        (first, of_first), (last, of_last) = ran[max(len(ran) - 2, 0)], ran[-1]
        # zero where neither side runs: that coordinate stays
        slopes.append((of_last - of_first) / (last - first if last != first else 1.0))
    return np.column_stack(slopes)


def linear_step(x: np.ndarray, residual: Mapping[str, float], jacobian: np.ndarray, reach: float) -> np.ndarray:
    """Return the point of least cost by the linear model within a reach along each coordinate.

    Variables are the moves of the n coordinates, their sizes, and the excess of each of the m residuals.
    """
    sizes, (m, n) = _sizes(residual), jacobian.shape
    moves, excess = np.eye(n), np.eye(m)
    above = [
        np.hstack([side * jacobian, np.zeros((m, n)), -excess]) for side in (1, -1)
    ] + [np.hstack([side * moves, -moves, np.zeros((n, m))]) for side in (1, -1)]  # fmt: skip
    limits = [MARGIN - sizes, MARGIN + sizes, np.zeros(n), np.zeros(n)]
    low, high = INSIDE
    bounds = [(max(-reach, low - at), min(reach, high - at)) for at in x] + [(0, None)] * (n + m)
    costs = np.concatenate([np.zeros(n), np.full(n, MOVE_COST), weights(residual)])
    solution = linprog(costs, A_ub=np.vstack(above), b_ub=np.concatenate(limits), bounds=bounds)
    return np.clip(x + solution.x[:n], *INSIDE)

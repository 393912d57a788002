"""A rig that meets as many printed numbers as it can: damped least squares (Levenberg and Marquardt)."""

from collections.abc import Iterator, Sequence
from itertools import islice, product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from laboratory.plausible.distances import cost, residuals
from laboratory.plausible.draws import built, drawn_values, run_rigs
from laboratory.plausible.settings import PlausibleConfig
from laboratory.plausible.unknowns import Unknowns, file_ranges
from laboratory.plausible.verdicts import evidence
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.sweeps.engine import DONE
from trackdyn_replication.paper.claims import judge_all, load_claims, load_sentences, printed_numbers
from trackdyn_replication.paper.scorecard import count, sentence_verdicts

DAMPINGS = (0.1, 0.5, 2.0, 8.0, 30.0, 120.0)  # steps of an iteration, run side by side
INSIDE = 0.001, 0.999  # of the ranges
LARGEST_STEP = 0.18  # of a range
LEAST_SQUARES, INDEPENDENT = "least squares", "independent"
GAIN = 0.03  # share of the cost below which the differences are taken anew
LEAST_DIFFERENCE = 0.002  # of a range, at which a search ends


def searched_unknowns(config: PlausibleConfig, name: str) -> Unknowns:
    """Unknowns of a draw, some in other ranges, but for those that the search sets."""
    search = config.search.searches[name]
    own = {unknown.label: unknown for unknown in search.unknowns}
    drawn = [own.pop(unknown.label, unknown) for unknown in config.unknowns if unknown.label not in search.fields]
    return Unknowns([*drawn, *own.values()], load_rig(config.rig).changed(**search.fields), file_ranges(config.rig))


class Outcome(NamedTuple):
    """What a rig gave: residuals (`distances.residuals`), independent printed numbers that it meets, sentences that it
    shows.
    """

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
        """Outcomes of points of the unit cube; None for what does not run."""
        rigs = [built(unknowns.rig, fields)[0] for fields in map(unknowns.changes, map(unknowns.values, points))]
        rows = run_rigs(self.config, rigs, self.scenes, self.jobs, self.store)
        return [self._outcome(rig, row) for rig, row in zip(rigs, rows, strict=True)]

    def _outcome(self, rig: Rig | None, row: dict) -> Outcome | None:
        if rig is None or row["state"] != DONE:
            return None
        values = row["values"]["starts"][0]
        shown_by = evidence(self.config, self.scenes, values, rig)
        printed = printed_numbers(self.claims, shown_by)
        numbers = printed.loc[printed["group"] == INDEPENDENT, "met"].sum()
        judged = sentence_verdicts(judge_all(self.claims, shown_by), self.sentences)
        return Outcome(residuals(self.config, values), int(numbers), count(judged)[0])

    def starts(self, name: str, unknowns: Unknowns) -> Iterator[tuple[str, np.ndarray]]:
        """Yield where a search begins, and how each point came: draws of the sample, then each of them scanned.

        A value outside the range that the unknown has in this search is taken to its bound.
        """
        own, scan = self.settings.searches[name].values, self.settings.scan
        drawn = dict(enumerate(islice(drawn_values(self.config), max(self.settings.draws) + 1)))
        points = {f"draw {draw}": drawn[draw] | own for draw in self.settings.draws}
        for scanned in product(*scan.values()):
            changes = dict(zip(scan, scanned, strict=True))
            points |= {f"draw {draw}, scanned": drawn[draw] | own | changes for draw in self.settings.draws}
            for begin in list(points):
                values = points.pop(begin)
                within = [
                    unknown.position(min(max(values[unknown.label], unknown.low), unknown.high))
                    for unknown in unknowns.unknowns
                ]
                yield begin, np.clip(within, *INSIDE)

    def search(self, name: str) -> pd.DataFrame:
        """Return every row of a search: ``search, row, begin, cost, numbers, sentences`` and every unknown.

        ``begin`` says how a row came: a draw, a draw that was scanned, or the least squares. These go on from the row
        of least cost: an iteration takes differences of all unknowns, and steps of several dampings of which the best
        is kept. Broyden's update corrects the Jacobian by what the steps gave, as long as they gain enough.
        """
        unknowns = searched_unknowns(self.config, name)
        rows: list[dict] = []

        def evaluate(points: Sequence[np.ndarray], begins: Sequence[str] = ()) -> list[np.ndarray | None]:
            points = [np.round(x, 12) for x in points]
            vectors, begins = [], begins or [LEAST_SQUARES] * len(points)
            for begin, x, outcome in zip(begins, points, self.outcomes(unknowns, points), strict=True):
                at = {"search": name, "row": len(rows) + 1, "begin": begin}
                if outcome is not None:
                    at |= {"cost": cost(outcome.residuals), "numbers": outcome.numbers, "sentences": outcome.sentences}
                rows.append(at | unknowns.values(x))
                vectors.append(None if outcome is None else np.arcsinh(list(outcome.residuals.values())))
            return vectors

        begins, points = zip(*self.starts(name, unknowns), strict=True)
        vectors = evaluate(points, begins)
        costs = [np.inf if vector is None else float(vector @ vector) for vector in vectors]
        least = int(np.argmin(costs))
        if vectors[least] is not None:
            self._descend(points[least], vectors[least], evaluate, rows)
        return pd.DataFrame(rows)

    def _descend(self, x: np.ndarray, vector: np.ndarray, evaluate, rows: list) -> None:
        difference, jacobian = self.settings.difference, None
        most = len(rows) + self.settings.rows
        while len(rows) < most and difference > LEAST_DIFFERENCE:
            points, vectors = [], []
            if fresh := jacobian is None:
                moves = np.diag(np.where(x + difference < 1, difference, -difference))
                points = [x + move for move in moves]
                vectors = evaluate(points)
                slopes = [
                    np.zeros_like(vector) if moved is None else (moved - vector) / move[i]
                    for i, (move, moved) in enumerate(zip(moves, vectors, strict=True))
                ]
                jacobian = np.column_stack(slopes)
            normal, slope = jacobian.T @ jacobian, -jacobian.T @ vector
            steps = [np.linalg.solve(normal + damping * np.eye(len(x)), slope) for damping in DAMPINGS]
            tried = [np.clip(x + np.clip(step, -LARGEST_STEP, LARGEST_STEP), *INSIDE) for step in steps]
            results = evaluate(tried)
            for point, moved in zip(tried, results, strict=True):
                step = point - x
                if moved is not None and step @ step > 0:
                    jacobian = jacobian + np.outer(moved - vector - jacobian @ step, step) / (step @ step + 1e-4)
            costs = [np.inf if moved is None else float(moved @ moved) for moved in (*vectors, *results)]
            best, before = int(np.argmin(costs)), float(vector @ vector)
            if costs[best] < before:
                x, vector = [*points, *tried][best], [*vectors, *results][best]
            if min(costs[best], before) > (1 - GAIN) * before:
                jacobian = None
                difference *= 0.6 if fresh else 1.0

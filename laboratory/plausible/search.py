"""A rig that shows as much as it can within the ranges of real parts: CMA-ES."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from laboratory.plausible.distances import by_sentence, cost, statement_distances
from laboratory.plausible.draws import EQUAL_PITCH, built, run_rigs
from laboratory.plausible.settings import PlausibleConfig, Scenario
from laboratory.plausible.unknowns import Unknown, Unknowns, file_ranges
from replication.paper.claims import Claim
from trackdyn.extras import required
from trackdyn.rig.rig import load_rig
from trackdyn.sweeps.engine import DONE

LEAST_ROWS = 250  # before which a search is not judged to have ended: it has hardly left its start


def free_unknowns(config: PlausibleConfig, scenario: Scenario) -> Unknowns:
    """Equal-pitch radius, then the unknowns of a draw but for those that the way of the ring sets."""
    ring, equal_pitch = config.ring[scenario.ring], scenario.equal_pitch
    low, high = config.equal_pitch_m[equal_pitch]
    pitch = Unknown(names=[EQUAL_PITCH], low=low, high=high, source=f"printed 0.308 m, {equal_pitch}")
    others = [unknown for unknown in config.unknowns if unknown.label not in ring]
    return Unknowns([pitch, *others], load_rig(config.rig).changed(**ring), file_ranges(config.rig))


class Searching:
    """Rows of searches: costs of points, each a row of the sweep engine."""

    def __init__(self, config: PlausibleConfig, claims: Sequence[Claim], jobs: int, store: Path | str):
        self.config, self.claims, self.jobs, self.store = config, claims, jobs, store
        radii = config.search.radii_m.items()
        self.scenes = [[rpm, ring, ring == config.ring_radius_m] for rpm, rings in radii for ring in rings]
        self.sentences = len({claim.sentence for claim in claims})

    def costs(self, unknowns: Unknowns, points: Sequence[np.ndarray]) -> list[tuple[float, int]]:
        """Cost (`distances.cost`) and number of sentences shown of points; the largest cost for what does not run."""
        rigs = [built(unknowns.rig, fields)[0] for fields in unknowns.changes_at(points)]
        costs = []
        for rig, row in zip(rigs, run_rigs(self.config, rigs, self.scenes, self.jobs, self.store), strict=True):
            if row["state"] == DONE:
                distances = statement_distances(self.config, self.scenes, row["values"], rig, self.claims)
                costs.append((cost(distances), sum(max(sizes) <= 1 for sizes in by_sentence(distances).values())))
            else:
                costs.append((float(self.sentences), 0))
        return costs

    def search(self, name: str) -> pd.DataFrame:
        """CMA-ES from a start: ``start, ring, equal_pitch, row, cost, shown, ended`` and every unknown, a row each.

        It ends when the last rows have gained too little, or are as many as may be (``ended`` of the last one).
        """
        settings, unknowns = self.config.search, free_unknowns(self.config, self.config.search.scenario)
        start = np.asarray(unknowns.position(settings.starts[name]))
        options = {"bounds": [0.0, 1.0], "seed": settings.seed, "verbose": -9}
        strategy = required("cma").CMAEvolutionStrategy(np.clip(start, 0.001, 0.999), settings.spread, options)
        rows: list[dict] = []

        def evaluate(points: list[np.ndarray]) -> list[float]:
            costs = self.costs(unknowns, points)
            for x, (value, shown) in zip(points, costs, strict=True):
                head = {"start": name, **settings.scenario._asdict(), "row": len(rows) + 1}
                rows.append(head | {"cost": value, "shown": shown} | unknowns.values(x))
            return [value for value, _ in costs]

        evaluate([start])
        ended = ""
        while not ended:
            points = strategy.ask()
            strategy.tell(points, evaluate([np.clip(np.round(x, 12), 0, 1) for x in points]))
            best = np.minimum.accumulate([row["cost"] for row in rows])
            before = best[int((1 - settings.last) * len(best)) - 1]
            if len(rows) > LEAST_ROWS and before - best[-1] < settings.gain * before:
                ended = "gains too little"
            elif len(rows) + strategy.popsize > settings.rows:
                ended = "rows are spent"
        return pd.DataFrame(rows).assign(ended=[""] * (len(rows) - 1) + [ended])

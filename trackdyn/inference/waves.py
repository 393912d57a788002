"""Waves of rigs: points of the unit cube become scenes of a sweep, and its rows the numbers of each rig."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import qmc

from trackdyn.errors import TrackdynError
from trackdyn.inference.settings import Case, EnsembleConfig, Fidelity, Target
from trackdyn.inference.unknowns import Unknowns
from trackdyn.parameters.layout import can_close
from trackdyn.parameters.rig import Rig
from trackdyn.sweeps.row import DONE
from trackdyn.sweeps.sweep import sweep

# the radii over which C24 takes its mean
SPREAD_CLAIM = "C24"
# points that are drawn for one that is kept: half of all grooves cannot be cut, a third of all loops not closed
DRAWN = 8


def target_cases(targets: Sequence[Target]) -> list[Case]:
    """Cases that the targets need, in a fixed order."""
    return sorted({target.case for target in targets}, key=lambda case: (case.belt, case.rpm, case.ring or 0.0))


def study_cases(speeds: Iterable[float], radii: Iterable[float]) -> list[Case]:
    """Every ring and none at every speed."""
    return [Case(rpm, ring) for rpm in speeds for ring in (None, *radii)]


def buildable(unknowns: Unknowns, x) -> bool:
    """Whether there is a rig at a point: its groove can be cut, its loop closes around its wheels."""
    try:
        rig, _ = unknowns.to_rig(x)
    except TrackdynError:
        return False
    return can_close(rig)


def points_table(unknowns: Unknowns, points: np.ndarray, first: int) -> pd.DataFrame:
    """Points as a table: ``rig`` counted from ``first``, and a column an unknown with its position in 0 to 1."""
    return pd.DataFrame(
        points, columns=unknowns.labels, index=pd.RangeIndex(first, first + len(points), name="rig")
    ).reset_index()


def prior_points(unknowns: Unknowns, count: int, seed: int) -> np.ndarray:
    """(count, d) buildable points of a Latin hypercube.

    Raises
    ------
    TrackdynError
        Hardly any point gives a rig.
    """
    drawn = qmc.LatinHypercube(len(unknowns), seed=seed).random(DRAWN * count)
    kept = []
    for x in drawn:
        if len(kept) < count and buildable(unknowns, x):
            kept.append(x)
    if len(kept) < count:
        raise TrackdynError(
            f"of {len(drawn)} points of the unknowns' ranges only {len(kept)} give a groove; other ranges would do"
        )
    return np.array(kept)


def design(
    config: EnsembleConfig, unknowns: Unknowns, points: pd.DataFrame, cases: Sequence[Case], fields: dict
) -> pd.DataFrame:
    """A row a rig and case for `trackdyn.sweeps`; ``name`` is ``<rig> <case>``; ``fields`` of the scene that all share."""
    pitches = " ".join(map(str, range(1, unknowns.rig.chain.pitches + 1)))
    rows = []
    for point in points.itertuples(index=False):
        changes, scene = unknowns.changes(unknowns.values(point[1:]))
        for case in cases:
            row = {"name": f"{point[0]} {case.name}", "motor_rpm": case.rpm}
            if case.belt:
                row |= {
                    "ring_radius": "none",
                    "chain": "belt",
                    "spells": False,
                    "duration": config.belt_s,
                    "step": 1e-3,
                }
                row |= {"tension": "locked"}
            else:
                turn = unknowns.rig.loop_period(case.rpm) * unknowns.rig.sprocket.teeth / unknowns.rig.chain.pitches
                row |= {
                    "ring_radius": "none" if case.ring is None else case.ring,
                    "chain": "double_pin",
                    "spells": True,
                }
                row |= {
                    "duration": round(config.record_turns * turn, 3),
                    "lead_in": config.lead_in_s,
                    "pitches": pitches,
                }
                row |= scene | fields
            rows.append(row | changes)
    return pd.DataFrame(rows)


def run_rigs(
    config: EnsembleConfig,
    unknowns: Unknowns,
    points: pd.DataFrame,
    cases: Sequence[Case],
    fidelity: Fidelity,
    rig: Path | str,
    store: Path | str,
    jobs: int = 1,
    progress: bool = False,
    **fields,
) -> pd.DataFrame:
    """Run every case of every rig; a row that is refused with one step is tried again with the next.

    Returns
    -------
    DataFrame
        The design with ``state``, ``reason`` and the numbers of each row (`trackdyn.sweeps.sweep.sweep`).
    """
    left = design(config, unknowns, points, cases, {"integrator": fidelity.integrator} | fields)
    found = []
    for step in fidelity.steps_s:
        belts = left["chain"] == "belt"
        asked = left.assign(step=left["step"].where(belts, step) if "step" in left else step)
        results = sweep(asked, rig=rig, jobs=jobs, store=store, progress=progress)
        again = (results["state"] != DONE) & ~belts.to_numpy() & (step != fidelity.steps_s[-1])
        found.append(results[~again])
        left = left[again.to_numpy()].reset_index(drop=True)
        if left.empty:
            break
    return pd.concat(found, ignore_index=True)


def by_case(results: pd.DataFrame) -> dict[int, dict[str, pd.Series]]:
    """Rows that came out: rig, then name of the case."""
    done = results[results["state"] == DONE]
    parts = done["name"].str.partition(" ")
    found: dict[int, dict[str, pd.Series]] = {}
    for (_, row), rig, case in zip(done.iterrows(), parts[0], parts[2], strict=True):
        found.setdefault(int(rig), {})[case] = row
    return found


def rig_at(unknowns: Unknowns, point: pd.Series) -> Rig:
    """The rig of a row of a table of points."""
    return unknowns.to_rig(point[unknowns.labels].to_numpy(dtype=float))[0]

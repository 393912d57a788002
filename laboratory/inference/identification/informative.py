"""Which unknowns a record can tell, before anything is fitted: by what features change over each one's range."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from laboratory.inference.identification.experiment import Experiment, run_experiment
from laboratory.inference.identification.measured import Measured, joined
from laboratory.inference.identification.posterior import MEDIANS, evidence_shares, groups_of
from laboratory.inference.verdict import NARROW
from laboratory.plausible.unknowns import Unknown, Unknowns, file_ranges
from trackdyn.errors import InputError
from trackdyn.rig.rig import Rig
from trackdyn.rig.rig_file import DRAG_FIELDS

# Parameters that rulers and scales do not tell: rubber, tension, contact, drag, the fit of chain and sprocket.
CANDIDATES = (
    "bushing.stiffness", "tension.pre_tension", "sprocket.equal_pitch_radius", "groove.seat_depth",
    "ring_contact.youngs_modulus", "ring_contact.restitution", "ring_contact.transition_velocity",
    "wheel_contact.youngs_modulus", "wheel_contact.restitution", "wheel_contact.transition_velocity",
    "tooth_contact.restitution", "tooth_contact.friction_dynamic",
)  # fmt: skip
# and what a law of the bushings takes
OF_BUSHINGS = {"hysteretic": "bushing.loss_factor", "viscous": "bushing.damping"}
LOG_FROM = 4.0  # ratio of the bounds from which on an unknown is spread evenly in its logarithm
MOST = 4
BETWEEN = (0.25, 0.75)  # two positions in the range: a change over half of it


def unknown_of(text: str) -> Unknown:
    """An unknown from an option, ``section.field`` or ``section.field=LOW:HIGH``; `InputError` for another text."""
    name, equals, bounds = text.partition("=")
    if not equals:
        return Unknown(names=[name])
    try:
        low, high = map(float, bounds.split(":"))
        if not (np.isfinite([low, high]).all() and low < high):
            raise ValueError
    except ValueError:
        raise InputError(f"--unknown {text}: expected section.field=LOW:HIGH with LOW below HIGH") from None
    return Unknown(names=[name], low=low, high=high, source="given with --unknown")


def requested_unknowns(unknowns: Sequence[Unknown], rig: Rig, path: Path | str) -> Unknowns:
    """Unknowns with the ranges of the rig's file where none is given, each spread in the scale that suits its range."""
    spread = []
    for unknown in Unknowns(unknowns, rig, file_ranges(path)).unknowns:
        wide = unknown.low > 0 and unknown.high / unknown.low >= LOG_FROM
        spread.append(unknown.model_copy(update={"scale": "log" if wide else "linear"}))
    return Unknowns(spread, rig)


def tellable(
    measured: Sequence[Measured], rig: Rig, path: Path | str, store, jobs: int = 1, progress: bool = True
) -> tuple[list[Unknown], pd.DataFrame]:
    """The unknowns that the records can tell side by side, the best told first.

    Each candidate is moved alone from a quarter to three quarters of its range. With features that change in
    proportion, a discrepancy of the prior's median and the scatter of the records, that gives the standard deviation
    which each would keep beside those that are chosen already. One is chosen as long as its 90 % interval would be at
    most half as wide as before.

    Returns
    -------
    unknowns : list of Unknown
        Chosen ones, at most `MOST`.
    table : DataFrame
        ``unknown, alone, beside, chosen``: widths of 90 % intervals as shares of the prior's.

    Raises
    ------
    InputError
        The records tell none of the candidates.
    """
    ranges = file_ranges(path)
    names = *CANDIDATES, OF_BUSHINGS[rig.bushing.law], *(f"{wheel}.{DRAG_FIELDS[rig.drag][0]}" for wheel in rig.wheels)
    candidates = requested_unknowns([Unknown(names=[name]) for name in names if name in ranges], rig, path)
    # the slowest and the fastest record say what changes with speed
    by_speed = sorted(measured, key=lambda measurement: measurement.speed.rpm)
    ends = by_speed[:: max(len(by_speed) - 1, 1)]
    speeds = tuple(measurement.speed for measurement in ends)
    records = joined([measurement.statistics for measurement in ends], speeds)
    changes = [{unknown.label: unknown.value(x)} for unknown in candidates.unknowns for x in BETWEEN]
    bar = "what the records can tell" if progress else ""
    simulated = run_experiment(Experiment(rig, speeds), changes, store, jobs, bar)
    features = np.full((len(changes), len(records.values)), np.nan)
    features[simulated.ran] = simulated.features.reshape(-1, len(records.values))
    # a candidate of which one rig did not run changes nothing
    slopes = np.nan_to_num((features[1::2] - features[::2]) / (BETWEEN[1] - BETWEEN[0]))
    sizes = np.array([MEDIANS[group] for group in groups_of(records.features)])
    shares = evidence_shares(records.features, records.record)
    covariance = records.covariance + np.einsum("g,gpq->pq", sizes**2, shares)
    information = slopes @ np.linalg.solve(covariance, slopes.T)
    alone, chosen = _widths(information, []), []
    while len(chosen) < MOST:
        widths = _widths(information, chosen)
        widths[chosen] = np.inf
        best = int(np.argmin(widths))
        if widths[best] * 0.9 > NARROW:
            break
        chosen.append(best)
    if not chosen:
        best = int(np.argmin(alone))
        raise InputError(
            f"the records are not informative about any of {', '.join(candidates.labels)}: the best one, "
            f"{candidates.labels[best]}, keeps {100 * alone[best]:.0f} % of its range; use longer records, more speeds "
            "or --unknown with wider ranges"
        )
    table = pd.DataFrame({"unknown": candidates.labels, "alone": alone, "beside": _widths(information, chosen)})
    table["chosen"] = np.isin(np.arange(len(candidates)), chosen)
    return [candidates.unknowns[k] for k in chosen], table.sort_values("alone", ignore_index=True)


def _widths(information: np.ndarray, chosen: list[int]) -> np.ndarray:
    """Width of every candidate's 90 % interval beside the chosen ones, as a share of the prior's."""
    widths = np.empty(len(information))
    for k in range(len(information)):
        which = [*[index for index in chosen if index != k], k]
        precision = information[np.ix_(which, which)] + 12.0 * np.eye(len(which))  # an even prior of width 1
        widths[k] = min(2 * 1.645 * np.sqrt(np.linalg.inv(precision)[-1, -1]) / 0.9, 1.0)
    return widths

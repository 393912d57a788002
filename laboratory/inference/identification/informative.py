"""Which unknowns a record can tell, before anything is fitted: by what features change over each one's range."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from laboratory.inference.identification.experiment import Experiment, run_experiment
from laboratory.inference.identification.identify import changed
from laboratory.inference.identification.measured import Measured, joined
from laboratory.inference.identification.posterior import MEDIANS, evidence_shares, groups_of
from laboratory.inference.unknowns import Unknown, Unknowns, file_ranges
from laboratory.inference.verdict import NARROW
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
    complete = Unknowns(unknowns, rig, file_ranges(path)).unknowns
    return Unknowns([unknown.model_copy(update={"scale": _scale(unknown)}) for unknown in complete], rig)


def _scale(unknown: Unknown) -> str:
    return "log" if unknown.low > 0 and unknown.high / unknown.low >= LOG_FROM else "linear"


def tellable(
    measured: Sequence[Measured],
    rig: Rig,
    path: Path | str,
    store,
    jobs: int = 1,
    progress: bool = True,
    most: int = MOST,
) -> tuple[list[Unknown], pd.DataFrame]:
    """The unknowns that the records can tell side by side, the best told first.

    Each candidate is moved alone from a quarter to three quarters of its range. With features that change in
    proportion, a discrepancy of the prior's median and the scatter of the records, that gives the standard deviation
    which each would keep beside those that are chosen already. One is chosen as long as its 90 % interval would be at
    most half as wide as before.

    Returns
    -------
    unknowns : list of Unknown
        Chosen ones, at most ``most``.
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
    ends = sorted({0, len(measured) - 1}, key=lambda k: measured[k].speed.rpm)
    chosen_records = [measured[k] for k in ends] if len(measured) > 1 else list(measured)
    experiment = Experiment(rig, tuple(measurement.speed for measurement in chosen_records))
    changes = [
        changed(Unknowns([unknown], rig), {unknown.label: unknown.value(x)})
        for unknown in candidates.unknowns
        for x in BETWEEN
    ]
    simulated = run_experiment(experiment, changes, store, jobs, "what the records can tell" if progress else "")
    records = joined(chosen_records)
    sizes = np.array([MEDIANS[group] for group in groups_of(records.features)])
    shares = evidence_shares(records.features, records.record)
    covariance = records.covariance + np.einsum("g,gpq->pq", sizes**2, shares)
    slopes = _slopes(simulated.features(experiment), simulated.ran, len(records.values))
    information = slopes @ np.linalg.solve(covariance, slopes.T)
    alone = _widths(information, [])
    chosen: list[int] = []
    while len(chosen) < most:
        comparison = np.where(np.isin(np.arange(len(candidates)), chosen), np.inf, _widths(information, chosen))
        best = int(np.argmin(comparison))
        if comparison[best] * 0.9 > NARROW:
            break
        chosen.append(best)
    table = pd.DataFrame({"unknown": candidates.labels, "alone": alone, "beside": _widths(information, chosen)})
    table["chosen"] = np.isin(np.arange(len(candidates)), chosen)
    if not chosen:
        best = table.loc[table["alone"].idxmin()]
        raise InputError(
            f"the records are not informative about any of {', '.join(candidates.labels)}: the best one, "
            f"{best['unknown']}, keeps {100 * best['alone']:.0f} % of its range; use longer records, more speeds or "
            "--unknown with wider ranges"
        )
    return [candidates.unknowns[k] for k in chosen], table.sort_values("alone", ignore_index=True)


def _slopes(features: np.ndarray, ran: np.ndarray, count: int) -> np.ndarray:
    """(candidates, count) change of the features over the whole range of each candidate.

    ``ran`` says which of the rigs ran, two a candidate; the (rigs that ran, count) features are theirs. A candidate of
    which one did not run changes nothing.
    """
    values = np.full((len(ran), count), np.nan)
    values[ran] = features.reshape(-1, count)
    low, high = values[::2], values[1::2]
    return np.nan_to_num((high - low) / (BETWEEN[1] - BETWEEN[0]))


def _widths(information: np.ndarray, chosen: list[int]) -> np.ndarray:
    """Width of every candidate's 90 % interval beside the chosen ones, as a share of the prior's."""
    widths = np.empty(len(information))
    for k in range(len(information)):
        which = [*[index for index in chosen if index != k], k]
        precision = information[np.ix_(which, which)] + 12.0 * np.eye(len(which))  # an even prior of width 1
        widths[k] = min(2 * 1.645 * np.sqrt(np.linalg.inv(precision)[-1, -1]) / 0.9, 1.0)
    return widths

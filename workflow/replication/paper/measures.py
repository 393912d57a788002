"""Named measures of the evidence: what each claim compares with what is printed."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from replication.paper.cells import TIMES, Cell, value_difference
from replication.paper.evidence import Evidence, NotThere, Range
from trackdyn.measure.ring_rule import RULE, parse_rule

# Two readings of a maximum, neither of which is the spike of a touch-down (`measure.events.smoothed_maxima`).
READINGS = ("maximum, mean over 0.01 s", "maximum, after the touch")
SAME = 1e-9  # radii are compared with printed ones, m


class Measure(NamedTuple):
    """A measure of the evidence."""

    evaluate: Callable[[Evidence, list[float]], Any]  # of the evidence and the speeds that are judged
    table: str  # the runs whose speeds those are: ``records``, ``study``, ``meshing`` or ``peer``
    by_speed: bool  # whether it gives a value for each of them
    column: str = ""  # of ``metrics.csv``, if it is one
    events: tuple[str, ...] = ()  # a run and events of its passages (`measure.events`), if it is made of those


MEASURES: dict[str, Measure] = {}


def measure(table: str, by_speed: bool = False, events: tuple[str, ...] = (), **names):
    """Register a function under its own name, or as several measures: ``names`` have what each takes first.

    That is a column, a run, a side, or a run with events.
    """

    def register(function):
        if not names:
            MEASURES[function.__name__] = Measure(function, table, by_speed, events=events)
        for name, what in names.items():
            column = what if function.__name__ == "_values" else ""
            of_events = what if function.__name__ == "_times" else ()
            MEASURES[name] = Measure(partial(function, what), table, by_speed, column, of_events)
        return function

    return register


def _range(values) -> Range:
    values = np.asarray(values, dtype=float)
    return Range(float(values.min()), float(values.max()))


def _ratios(value: pd.Series, reference: pd.Series) -> pd.Series:
    """Ratios of values of the same name, infinite over nothing; nothing over nothing is left out."""
    value, reference = value.astype(float).align(reference.astype(float), join="inner")
    acts = (value != 0) | (reference != 0)
    if not acts.any():
        raise NotThere("no force acts")
    return value[acts] / reference[acts]


def _over(value, reference) -> float:
    """Quotient of two numbers."""
    return float(_ratios(pd.Series([value]), pd.Series([reference])).iloc[0])


def _some(values):
    """The values, if there are any."""
    if not len(values):
        raise NotThere("not run")
    return values


def _radii(e: Evidence, speeds, column: str, least: float = 0.0, below: float = np.inf) -> list[pd.Series]:
    """A column of the ring study by radius, at every speed, from a radius on and below another one (m)."""
    columns = [e.study(rpm)[column] for rpm in speeds]
    return [_some(values[(values.index >= least - SAME) & (values.index < below - SAME)]) for values in columns]


# Long records (Sect. 5)


def _column(evidence: Evidence, speeds, name: str, missing: str = "not recorded"):
    rows = evidence.records(speeds)
    if name not in rows or rows[name].isna().all():
        raise NotThere(missing)
    return rows[name]


@measure(
    "records", by_speed=True, rms="rms_g", sd="sd_g", high_frequency="high_frequency_g",
    line_frequencies_binfree="line_hz_binfree",
)  # fmt: skip
def _values(column, evidence, speeds):
    """A column of the long records (`measure.columns`), at every speed."""
    return _column(evidence, speeds, column).tolist()


@measure(
    "records", gap_after_projection="loop_gap_max_m", gap_before_projection="gap_before_projection_m",
    velocity_gap="velocity_gap_m_s",
)  # fmt: skip
def _largest(column, evidence, speeds):
    """Its largest value."""
    return float(_column(evidence, speeds, column).max())


@measure("records", by_speed=True, line_frequencies="line_hz", line_amplitudes="line_g")
def _by_start(column, evidence, speeds):
    """Range of a column over records that begin anywhere in a turn of the loop, at every speed."""
    starts = _some(evidence.starts).set_index("rpm")[column]
    return [_range(starts.loc[[rpm]]) for rpm in speeds]


@measure("records", by_speed=True)
def coarse_rms_difference(evidence, speeds):
    """RMS of the y acceleration with three surfaces a groove over that with ten arcs, less one, %, at every speed."""
    coarse = evidence.metrics.set_index("run")["rms_g"].reindex([f"coarse/{rpm:g}rpm" for rpm in speeds])
    if coarse.isna().any():
        raise NotThere("not run")
    return (100 * (coarse.to_numpy() / _column(evidence, speeds, "rms_g").to_numpy() - 1)).tolist()


@measure("records")
def high_frequency_growth(evidence, speeds):
    """Content at and above 20 Hz at the highest speed over that at the lowest."""
    values = _some(_values("high_frequency_g", evidence, speeds)[1:]) and _values("high_frequency_g", evidence, speeds)
    return _over(values[-1], values[0])


# The independent code (Fig. 14)


@measure("peer", peer_difference="difference_pct", peer_difference_of_a_belt="difference_belt_pct")
def _peer(column, evidence, speeds):
    """Largest difference of the vertical displacement from another code's, % of its range."""
    if column not in evidence.peer or evidence.peer[column].isna().all():
        raise NotThere("not run")
    return evidence.peer[column].tolist()


# The meshing process (Sect. 6.1)


@measure("meshing", areas_with_ring="ring", areas_without_ring="no_ring")
def _areas(run, evidence, speeds):
    """Areas that the left and the right arc visit."""
    row = evidence.meshing(run)
    return f"left {row['left_areas']}, right {row['right_areas']}"


@measure(
    "meshing",
    left_maximum_without_ring=("no_ring", *(f"left {reading}" for reading in READINGS)),
    right_maximum_without_ring=("no_ring", *(f"right {reading}" for reading in READINGS)),
    ends_without_ring=("no_ring", "right gone", "out"),
    left_touches_with_ring=("ring", "left touches"),
    ring_maximum_with_ring=("ring", *(f"ring {reading}" for reading in READINGS)),
    left_maximum_with_ring=("ring", *(f"left {reading}" for reading in READINGS)),
    ends_with_ring=("ring", "ring left", "out"),
)
def _times(events, evidence, speeds):
    """Times of events after the first contact, s; without a ring that of an arc, else the ring's first touch."""
    run, *names = events
    return evidence.event_times(run, names)


@measure(
    "meshing", ring_share=("ring", "ring"), left_share=("ring", "left"), left_share_without_ring=("no_ring", "left"),
    right_share_without_ring=("no_ring", "right"),
)  # fmt: skip
def _share(contact, evidence, speeds):
    """Time in contact, % of a turn."""
    run, side = contact
    return float(evidence.meshing(run)[f"{side}_share_pct"])


@measure("meshing", left_share_ratio="left_share_pct", left_force_ratio="left_rms_n", left_peak_ratio="left_peak_n")
def _ratio(column, evidence, speeds):
    """A measure of the left arc with the ring over that without."""
    return _over(evidence.meshing("ring")[column], evidence.meshing("no_ring")[column])


@measure("meshing")
def areas_at_maxima(evidence, speeds):
    """Areas in which the left and the right arc have their maxima without a ring, in both readings."""
    areas = evidence.events[evidence.events["run"] == "meshing/no_ring"].set_index("event")["area"]
    names = []
    for side in ("left", "right"):
        numbers = areas.reindex([f"{side} {reading}" for reading in READINGS]).dropna().astype(int)
        names.append(f"{side} {' or '.join(map(str, numbers.unique())) or 'none'}")
    return ", ".join(names)


@measure("meshing", events=("no_ring", "right gone", "out"))
def left_outlasts_right(evidence, speeds):
    """From the right arc's last contact to the left one's without a ring, s."""
    right, out = evidence.event_times("no_ring", ["right gone", "out"])
    return out - right


@measure("meshing")
def variation_of_forces(evidence, speeds):
    """SD with the ring over that without: of the force that varies most, and of the left arc's."""
    ring, without = evidence.meshing("ring"), evidence.meshing("no_ring")
    largest = _over(ring[["left_sd_n", "right_sd_n", "ring_sd_n"]].max(), without[["left_sd_n", "right_sd_n"]].max())
    return [float(largest), float(_over(ring["left_sd_n"], without["left_sd_n"]))]


@measure("meshing", events=("no_ring", "first left", "first right"))
def first_contacts_apart(evidence, speeds):
    """Time between the first contacts of the two arcs without a ring, s."""
    left, right = evidence.event_times("no_ring", ["first left", "first right"])
    return abs(left - right)


@measure("meshing")
def left_contact_force_ratio(evidence, speeds):
    """RMS of the left-arc force over the time in contact, with the ring over that without."""
    ring, without = (evidence.meshing(run).get("left_rms_contact_n") for run in ("ring", "no_ring"))
    if ring is None or without is None:
        raise NotThere("not recorded")
    return _over(ring, without)


@measure("meshing")
def ring_over_arcs(evidence, speeds):
    """Mean ring force over the mean force of both arcs, over the run."""
    a = evidence.meshing("ring")
    mean = {
        side: np.sqrt(max(a[f"{side}_rms_n"] ** 2 - a[f"{side}_sd_n"] ** 2, 0.0)) for side in ("left", "right", "ring")
    }
    return _over(mean["ring"], mean["left"] + mean["right"])


# The ring study (Sect. 6.2)


def _growth(evidence: Evidence, speeds, side: str) -> list[pd.Series]:
    """RMS and SD at the highest speed over those at the lowest, by radius; none where no force acts at either."""
    _some(speeds[1:])  # one speed shows no growth
    low, high = evidence.study(min(speeds)), evidence.study(max(speeds))
    return [_ratios(high[f"{side}_{name}"], low[f"{side}_{name}"]) for name in ("rms_n", "sd_n")]


@measure("study", left_growth_with_speed="left", ring_growth_with_speed="ring")
def _growths(side, evidence, speeds):
    """Range of both over all radii, from each speed to the next."""
    pairs = [_growth(evidence, pair, side) for pair in pairwise(_some(speeds))]
    return [_range(np.concatenate(growths)) for growths in zip(*_some(pairs), strict=True)]


@measure("study", by_speed=True, ring_rms_steps="ring_rms_n", ring_sd_steps="ring_sd_n")
def _steps(column, evidence, speeds):
    """Least ratio of a force at neighbouring radii, larger over smaller, at every speed."""
    columns = [values.reset_index(drop=True) for values in _radii(evidence, speeds, column)]
    # keeps missing values
    return [float(_ratios(values[1:], values.shift()[1:]).min(skipna=False)) for values in columns]


@measure("study")
def left_growth_over_ring_growth(evidence, speeds):
    """Growth of the left arc's RMS and SD with speed over the ring's, over all radii."""
    pairs = zip(_growth(evidence, speeds, "left"), _growth(evidence, speeds, "ring"), strict=True)
    return [_range(_ratios(left, ring)) for left, ring in pairs]


@measure("study")
def largest_growth_with_speed(evidence, speeds):
    """Largest growth of RMS or SD with speed over all radii: left arc, ring."""
    return [
        max(float(growth.max(skipna=False)) for growth in _growth(evidence, speeds, side)) for side in ("left", "ring")
    ]


@measure("study", by_speed=True)
def ring_growth_with_radius(evidence, speeds):
    """RMS of the ring force at the largest radius over that at the smallest, at every speed."""
    return [_over(values.iloc[-1], values.iloc[0]) for values in _radii(evidence, speeds, "ring_rms_n")]


@measure("study", by_speed=True)
def right_share_from_0305(evidence, speeds):
    """Largest share of right-arc contact for radii of 0.305 m and more, % of a turn, at every speed."""
    return [_range(values).high for values in _radii(evidence, speeds, "right_share_pct", 0.305)]


@measure("study", by_speed=True)
def right_share_below_0305(evidence, speeds):
    """Share of right-arc contact at the largest radius below 0.305 m, % of a turn, at every speed."""
    return [float(values.iloc[-1]) for values in _radii(evidence, speeds, "right_share_pct", below=0.305)]


@measure("study", by_speed=True)
def left_spread(evidence, speeds):
    """Largest deviation of the left-arc RMS from its mean over all radii, %, at every speed."""
    columns = [values.to_numpy() for values in _radii(evidence, speeds, "left_rms_n")]  # keeps missing values
    if not all(values.any() for values in columns):
        raise NotThere("no force acts")
    return [float(100 * np.abs(values / values.mean() - 1).max()) for values in columns]


@measure("study", by_speed=True)
def left_shares_from_0307(evidence, speeds):
    """Least and largest left-arc share over the radii of 0.307 m and more, % of a turn, at every speed."""
    return [_range(values) for values in _radii(evidence, speeds, "left_share_pct", 0.307)]


@measure("study", by_speed=True)
def radius_to_choose(evidence, speeds):
    """Radius to choose (m) at every speed, where the right arc is free and the left one touches for little."""
    rule = parse_rule(RULE, evidence.rig.sprocket.teeth)
    return [rule.radius(evidence.study(rpm).reset_index()) for rpm in speeds]


@measure("study", by_speed=True)
def excess_over_equal_pitch(evidence, speeds):
    """The radius to choose less the nearest reading of the rig's equal-pitch radius, m, at every speed."""
    readings, radii = evidence.rig.equal_pitch_radii.values(), radius_to_choose(evidence, speeds)
    return [min((radius - reading for reading in readings), key=abs) for radius in radii]


# Cells of the article


def _cells(e: Evidence, table: str, column: str, speeds) -> np.ndarray:
    """Cells of a column at some speeds; `NotThere` names those that are empty."""
    cells = [Cell(table, f"{rpm:g}", column) for rpm in speeds]
    if missing := [cell.row for cell in cells if cell not in e.cells]:
        raise NotThere(f"Table {table} is not filled in: {column} at {', '.join(missing)} rpm")
    return np.array([e.cells[cell] for cell in cells])


@measure(
    "records", by_speed=True,
    rms_against_experiment=("rms_g", "rms_experiment_g"), sd_against_experiment=("sd_g", "sd_experiment_g"),
    rms_against_simulation=("rms_g", "rms_simulation_g"), sd_against_simulation=("sd_g", "sd_simulation_g"),
)  # fmt: skip
def _against(what, e, speeds):
    """Difference of a column of our records from a column of Table 3, % of the latter."""
    ours, column = what
    return value_difference(e.records(speeds)[ours], _cells(e, "3", column, speeds)).tolist()


@measure("records", by_speed=True)
def coarse_less_accurate(e, speeds):
    """How much farther from the article's measured RMS three surfaces are than ten arcs, points."""
    measured, fine = _cells(e, "3", "rms_experiment_g", speeds), e.records(speeds)["rms_g"].to_numpy()
    coarse = fine * (1 + np.array(coarse_rms_difference(e, speeds)) / 100)
    return (value_difference(coarse, measured) - value_difference(fine, measured)).tolist()


@measure("records", by_speed=True)
def coarse_change_over_printed(e, speeds):
    """Change of the RMS by three surfaces less that by the algorithm of Ref. [2] in the article, points."""
    change = 100 * (_cells(e, "4", "rms_g", speeds) / _cells(e, "3", "rms_simulation_g", speeds) - 1)
    return (np.array(coarse_rms_difference(e, speeds)) - change).tolist()


@measure("peer")
def speed_over_printed(e, speeds):
    """CPU time of the independent code over ours at equal accuracy, over Recurdyn's over the article's."""
    if not {*TIMES} <= e.cells.keys():
        raise NotThere("Table 2 is not filled in")
    chosen = e.costs[e.costs["chosen"] == "yes"].set_index("code")["cpu_s_per_s"] if "chosen" in e.costs else {}
    if not {"trackdyn", "exudyn"} <= set(getattr(chosen, "index", ())):
        raise NotThere("not run")
    return float(chosen["exudyn"] / chosen["trackdyn"] * e.cells[TIMES[0]] / e.cells[TIMES[1]])

"""Named measures of the evidence, the quantities that claims compare with printed ones."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from trackdyn.measure.contacts import TOUCHING
from trackdyn.measure.events import RESOLUTION
from trackdyn.measure.ring_rule import DurationRule, RingRule
from trackdyn_replication.paper.evidence import Evidence, NotThere, Range
from trackdyn_replication.paper.published import CELLS, value_difference

SAME = 1e-9  # radii are compared with printed ones, m


class Measure(NamedTuple):
    """A measure of the evidence."""

    evaluate: Callable[[Evidence, list[float]], Any]  # of the evidence and the speeds that are judged
    table: str  # the runs whose speeds those are: ``records``, ``study``, ``meshing`` or ``peer``
    by_speed: bool = False  # whether it gives a value for each of them
    events: tuple[str, ...] = ()  # a run and events of its passages (`measure.events`), if it is made of those


def _range(values) -> Range:
    values = np.asarray(values, dtype=float)
    return Range(float(values.min()), float(values.max()))


def _ratios(value: pd.Series, reference: pd.Series) -> pd.Series:
    """Divide values of the same name; the ratio over zero is infinite, and zero over zero is left out."""
    value, reference = value.astype(float).align(reference.astype(float), join="inner")
    acts = (value != 0) | (reference != 0)
    if not acts.any():
        raise NotThere("no force acts")
    return value[acts] / reference[acts]


def _over(value, reference) -> float:
    """Divide two numbers as `_ratios`."""
    return float(_ratios(pd.Series([value]), pd.Series([reference])).iloc[0])


def _some(values):
    """Return the values; `NotThere` if there are none."""
    if not len(values):
        raise NotThere("not run")
    return values


def _column(evidence: Evidence, speeds, name: str) -> pd.Series:
    """Return a column of the long records (`measure.columns`), by speed."""
    rows = evidence.records(speeds)
    if name not in rows or rows[name].isna().all():
        raise NotThere("not recorded")
    return rows[name]


def _values(column: str) -> Measure:
    """Measure a column, at every speed."""
    return Measure(lambda e, speeds: _column(e, speeds, column).tolist(), "records", True)


def _largest(column: str) -> Measure:
    """Measure the largest value of a column."""
    return Measure(lambda e, speeds: float(_column(e, speeds, column).max()), "records")


def _by_start(column: str, evidence, speeds) -> list[Range]:
    """Return the range of a column over records that begin anywhere in a turn of the loop, by speed."""
    starts = _some(evidence.starts).set_index("rpm")[column]
    return [_range(starts.loc[[rpm]]) for rpm in speeds]


def _coarse_difference(evidence, speeds) -> list[float]:
    """Return the RMS of the y acceleration with three surfaces over that with ten arcs, less one, %, by speed."""
    coarse = evidence.metrics.set_index("run")["rms_g"].reindex([f"coarse/{rpm:g}rpm" for rpm in speeds])
    if coarse.isna().any():
        raise NotThere("not run")
    return (100 * (coarse.to_numpy() / _column(evidence, speeds, "rms_g").to_numpy() - 1)).tolist()


def _high_frequency_growth(evidence, speeds) -> float:
    """Return the content at and above 20 Hz at the highest speed over that at the lowest."""
    values = _column(evidence, speeds, "high_frequency_g")
    return _over(_some(values.iloc[1:]).iloc[-1], values.iloc[0])


def _peer(column: str, evidence, speeds) -> list[float]:
    """Return the largest difference of the vertical displacement from another code's, % of its range (Fig. 14)."""
    if column not in evidence.peer or evidence.peer[column].isna().all():
        raise NotThere("not run")
    return evidence.peer[column].tolist()


def _against(cell: str, evidence, speeds) -> list[float]:
    """Return the difference of the long records from a column of the article's Table 3, % of it, by speed."""
    theirs = evidence.cells.reindex(speeds)[cell]
    if missing := [f"{rpm:g}" for rpm in theirs.index[theirs.isna()]]:
        raise NotThere(f"Table 3 is not filled in: {cell} at {', '.join(missing)} rpm")
    return value_difference(_column(evidence, speeds, f"{cell.partition('_')[0]}_g"), theirs).tolist()


# The one reading of a maximum, which claims, Figures 19 to 22 and their tables share. Other readings
# (`measure.events.smoothed_maxima`, `measure.events.like_peaks`) are listed in ``events.csv`` and decide nothing.
MAXIMUM = f"maximum, mean over {RESOLUTION:g} s"


def _times(run: str, *names: str) -> Measure:
    """Measure times of events after the first contact, s: that of an arc without a ring, else the ring's."""
    return Measure(lambda e, speeds: e.event_times(run, names), "meshing", events=(run, *names))


def _apart(first: str, second: str, size: Callable[[float], float] = float) -> Measure:
    """Measure the time from one event to another without a ring, s; its ``size`` may be the absolute value."""

    def evaluate(e, speeds):
        begin, end = e.event_times("no_ring", [first, second])
        return size(end - begin)

    return Measure(evaluate, "meshing", events=("no_ring", first, second))


def _areas(run: str) -> Measure:
    """Measure the areas that the left and the right arc visit."""
    return Measure(lambda e, speeds: "left {left_areas}, right {right_areas}".format(**e.meshing(run)), "meshing")


def _share(run: str, side: str) -> Measure:
    """Measure the time in contact, % of a turn."""
    return Measure(lambda e, speeds: float(e.meshing(run)[f"{side}_share_pct"]), "meshing")


def _ratio(column: str, evidence, speeds) -> float:
    """Return the ratio of a column of the left arc with the ring to that without."""
    ring, without = (evidence.meshing(run).get(column) for run in ("ring", "no_ring"))
    if ring is None or without is None:
        raise NotThere("not recorded")
    return _over(ring, without)


def _areas_at_maxima(evidence, speeds) -> str:
    """Return the areas in which the left and the right arc have their maxima without a ring."""
    areas = evidence.events[evidence.events["run"] == "meshing/no_ring"].set_index("event")["area"]
    touched = {side: areas.get(f"{side} {MAXIMUM}", np.nan) for side in ("left", "right")}
    return ", ".join(f"{side} {'none' if np.isnan(area) else int(area)}" for side, area in touched.items())


def _variation_of_forces(evidence, speeds) -> list[float]:
    """Return the SD with the ring over that without: of the force that varies most, and of the left arc's."""
    _carrying(evidence, evidence.speeds("study"))
    ring, without = evidence.meshing("ring"), evidence.meshing("no_ring")
    largest = _over(ring[["left_sd_n", "right_sd_n", "ring_sd_n"]].max(), without[["left_sd_n", "right_sd_n"]].max())
    return [largest, _over(ring["left_sd_n"], without["left_sd_n"])]


def _ring_over_arcs(evidence, speeds) -> float:
    """Return the mean ring force over the mean force of both arcs, over the run."""
    a = evidence.meshing("ring")
    left, right, ring = (
        np.sqrt(max(a[f"{side}_rms_n"] ** 2 - a[f"{side}_sd_n"] ** 2, 0.0)) for side in ("left", "right", "ring")
    )
    return _over(ring, left + right)


def _carrying(evidence: Evidence, speeds) -> list[pd.DataFrame]:
    """Return the ring study at every speed; `NotThere` where the ring carries no load and so changes nothing."""
    tables = [evidence.study(rpm) for rpm in speeds]
    for rpm, table in zip(speeds, tables, strict=True):
        if len(idle := table.index[table["ring_share_pct"] <= TOUCHING]):
            raise NotThere(f"a ring of {idle[0]:g} m carries nothing at {rpm:g} rpm")
    return tables


def _growth(evidence: Evidence, speeds, side: str) -> list[float]:
    """Return RMS and SD at the highest speed over those at the lowest, means over the radii."""
    _some(speeds[1:])  # one speed shows no growth
    low, high = evidence.study(min(speeds)), evidence.study(max(speeds))
    return [
        float(_ratios(high[f"{side}_{name}"], low[f"{side}_{name}"]).mean(skipna=False)) for name in ("rms_n", "sd_n")
    ]


def _with_speed(column: str, evidence, speeds) -> list[float]:
    """Return a force over that at the lowest speed, mean over the radii, by speed."""
    lowest = evidence.study(min(speeds))[column]
    return [float(_ratios(evidence.study(rpm)[column], lowest).mean(skipna=False)) for rpm in speeds]


def _left_over_ring_growth(evidence, speeds) -> list[float]:
    """Return the growth of the left arc's RMS and SD with speed over the ring's."""
    pairs = zip(_growth(evidence, speeds, "left"), _growth(evidence, speeds, "ring"), strict=True)
    return [_over(left, ring) for left, ring in pairs]


def _largest_growth(evidence, speeds) -> list[float]:
    """Return the larger growth of RMS and SD with speed: left arc, ring."""
    _carrying(evidence, speeds)
    return [max(_growth(evidence, speeds, side)) for side in ("left", "ring")]


def _by_radius(value: Callable[[pd.Series], Any], column: str, least: float = 0.0, below: float = np.inf) -> Measure:
    """Measure a value of a column by radius, from a radius on and below another one (m), at every speed."""

    def evaluate(evidence, speeds):
        columns = [evidence.study(rpm)[column] for rpm in speeds]
        inside = (table[(table.index >= least - SAME) & (table.index < below - SAME)] for table in columns)
        return [value(_some(table)) for table in inside]

    return Measure(evaluate, "study", True)


def _least_step(values: pd.Series) -> float:
    """Return the least ratio of a force at neighbouring radii, larger over smaller; missing values count."""
    values = values.reset_index(drop=True)
    return float(_ratios(values.iloc[1:], values.shift().iloc[1:]).min(skipna=False))


def _spread(least: float, evidence, speeds) -> list[float]:
    """Return the largest deviation of the left arc's RMS from its mean over radii from ``least`` (m), %, by speed."""
    values = [table["left_rms_n"][table.index >= least - SAME] for table in _carrying(evidence, speeds)]
    if not all(forces.any() for forces in values):
        raise NotThere("no force acts")
    return [float(100 * (_some(forces) / forces.mean() - 1).abs().max(skipna=False)) for forces in values]


def _radius(evidence: Evidence, speeds) -> float:
    """Return the radius of the one ring to choose for some speeds, m; NaN: none serves (`measure.ring_rule`)."""
    return RingRule().radius(evidence.ring_runs(speeds))


def _radius_by_durations(evidence: Evidence, speeds) -> float:
    """Return the radius by the durations of contacts, m; NaN: none serves (`measure.ring_rule`)."""
    study = pd.concat([evidence.study(rpm).reset_index() for rpm in speeds])
    return DurationRule(evidence.rig.sprocket.teeth).radius(study)


def _excess_over_equal_pitch(evidence, speeds) -> list[float]:
    """Return the radius to choose less each reading of the rig's equal-pitch radius, m."""
    radius = _radius(evidence, speeds)
    return [radius - reading for reading in evidence.rig.equal_pitch_radii.values()]


MEASURES: dict[str, Measure] = {
    # long records (Sect. 5)
    "rms": _values("rms_g"), "sd": _values("sd_g"), "high_frequency": _values("high_frequency_g"),
    "line_frequencies_binfree": _values("line_hz_binfree"), "velocity_gap": _largest("velocity_gap_m_s"),
    "gap_after_projection": _largest("loop_gap_max_m"), "gap_before_projection": _largest("gap_before_projection_m"),
    "line_frequencies": Measure(partial(_by_start, "line_hz"), "records", True),
    "line_amplitudes": Measure(partial(_by_start, "line_g"), "records", True),
    "coarse_rms_difference": Measure(_coarse_difference, "records", True),
    "high_frequency_growth": Measure(_high_frequency_growth, "records"),
    # the independent code (Fig. 14), cells of the article
    "peer_difference": Measure(partial(_peer, "difference_pct"), "peer"),
    "peer_difference_of_a_belt": Measure(partial(_peer, "difference_belt_pct"), "peer"),
    **{
        cell.removesuffix("_g").replace("_", "_against_"): Measure(partial(_against, cell), "records", True)
        for cell in CELLS
    },
    # the meshing process (Sect. 6.1)
    "areas_with_ring": _areas("ring"), "areas_without_ring": _areas("no_ring"),
    "areas_at_maxima": Measure(_areas_at_maxima, "meshing"),
    "left_maximum_without_ring": _times("no_ring", f"left {MAXIMUM}"),
    "left_maximum_with_ring": _times("ring", f"left {MAXIMUM}"),
    "right_maximum_without_ring": _times("no_ring", f"right {MAXIMUM}"),
    "ring_maximum_with_ring": _times("ring", f"ring {MAXIMUM}"),
    "ends_without_ring": _times("no_ring", "right gone", "out"), "ends_with_ring": _times("ring", "ring left", "out"),
    "left_touches_with_ring": _times("ring", "left touches"), "left_outlasts_right": _apart("right gone", "out"),
    "first_contacts_apart": _apart("first left", "first right", abs),
    "later_first_contact": Measure(
        lambda e, speeds: float(np.max(e.event_times("no_ring", ["first left", "first right"]))), "meshing",
        events=("no_ring", "first left", "first right"),
    ),
    "ring_share": _share("ring", "ring"), "left_share": _share("ring", "left"),
    "left_share_without_ring": _share("no_ring", "left"), "right_share_without_ring": _share("no_ring", "right"),
    "left_share_ratio": Measure(partial(_ratio, "left_share_pct"), "meshing"),
    "left_force_ratio": Measure(partial(_ratio, "left_rms_n"), "meshing"),
    "left_peak_ratio": Measure(partial(_ratio, "left_peak_n"), "meshing"),
    "left_contact_force_ratio": Measure(partial(_ratio, "left_rms_contact_n"), "meshing"),
    "variation_of_forces": Measure(_variation_of_forces, "meshing"),
    "ring_over_arcs": Measure(_ring_over_arcs, "meshing"),
    # the ring study (Sect. 6.2)
    **{
        f"{name}_with_speed": Measure(partial(_with_speed, f"{name}_n"), "study", True)
        for name in ("left_rms", "ring_rms", "left_sd", "ring_sd")
    },
    "left_growth_over_ring_growth": Measure(_left_over_ring_growth, "study"),
    "largest_growth_with_speed": Measure(_largest_growth, "study"),
    "ring_rms_steps": _by_radius(_least_step, "ring_rms_n"), "ring_sd_steps": _by_radius(_least_step, "ring_sd_n"),
    "ring_growth_with_radius": _by_radius(lambda values: _over(values.iloc[-1], values.iloc[0]), "ring_rms_n"),
    "right_share_from_0305": _by_radius(lambda values: _range(values).high, "right_share_pct", 0.305),
    "right_share_below_0305": _by_radius(lambda values: float(values.iloc[-1]), "right_share_pct", below=0.305),
    "left_spread": Measure(partial(_spread, 0.0), "study", True),
    "left_spread_from_0305": Measure(partial(_spread, 0.305), "study", True),
    "left_shares_from_0307": _by_radius(_range, "left_share_pct", 0.307),
    "radius_to_choose": Measure(_radius, "study"),
    "radius_by_durations": Measure(_radius_by_durations, "study"),
    "radius_by_speed": Measure(lambda e, speeds: [_radius(e, [rpm]) for rpm in speeds], "study", True),
    "excess_over_equal_pitch": Measure(_excess_over_equal_pitch, "study"),
}  # fmt: skip

"""Choice of a ring: by the force of a tooth over that without a ring, or, as the paper argues, by durations; advice.

Bounds do not depend on which radii a study has, so that no end of their range moves them. The advice is the ring to
choose, its reason, price and wear, or the reason why no ring serves.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain, groupby, pairwise
from math import ceil, floor
from typing import NamedTuple

import numpy as np
import pandas as pd

from trackdyn.inputs.errors import InputError
from trackdyn.measure.columns import listed, plain, significant, with_error
from trackdyn.measure.contacts import TOUCHING
from trackdyn.rig.rig import Rig
from trackdyn.scene.scene import Periods

# The radii above the smallest one that must serve, too, as a share of its own: a millimetre at 0.3 m, the paper's step.
# A radius that serves between others that do not is a dip of a curve that is not monotonic, and moves with the grid.
SPAN = 1 / 300
# Gap between a radius that serves and one that does not, m, to which a study is refined around its choice, and most
# steps of refinement.
NARROW, ROUNDS = 5e-4, 3
ROUNDED = 5  # decimals of a radius that is added, m
DECIDED = 3.0  # standard errors by which a bound must be kept
OTHER_FORCES = (0.3, 0.7)  # further shares of which the choice is reported
# Points of a turn that the left arc may touch for beyond a tooth's share of it, 100 over the number of teeth, for which
# connectors that drive one after the other touch at least.
MARGIN_PCT = 2.0
ARCS = ("left", "right")
WITHOUT = "of that without a ring"
WORK_COLUMNS = ("teeth_sliding_j", "ring_sliding_j")
COMPARED = ("settled_tension_n", "ring_rms_n", "left_rms_n", *WORK_COLUMNS)  # weighed by a choice
RULE_COLUMNS = (
    *(f"{arc}_{name}" for arc in ARCS for name in ("share_pct", "peak_n", "peak_error_n", "rms_n")), "ring_peak_n",
    *COMPARED,
)  # fmt: skip


def conditions(study: pd.DataFrame) -> list[str]:
    """Return the columns of a study with the conditions of a run: speed (rev/min), and load (N) if any."""
    return [name for name in ("rpm", "load_n") if name in study]


def condition_name(row) -> str:
    """Return speed and load of a row of a study in words."""
    load = getattr(row, "load_n", 0.0)
    return f"{row.rpm:g} rpm{f' under {load:g} N' if load else ''}"


def with_tooth_forces(study: pd.DataFrame) -> pd.DataFrame:
    """Return a study with the force of a tooth, and its ratio to that without a ring at the same speed and load.

    ``study`` has a row per radius (m; NaN: no ring), speed and load (`conditions`), with columns of ``metrics.csv``.
    Added are ``tooth_peak_n``, ``tooth_peak_error_n`` and ``tooth_rms_n``, the larger of both arcs' mean peaks, its
    standard error and the larger RMS (N); ``tooth_ratio`` and ``tooth_ratio_error``, that peak over the one without a
    ring and its standard error (1); ``tension_ratio``, the tension of the strand over that without a ring (1). They are
    NaN where a run, or the one without a ring, has no result.
    """
    of_arcs = [[f"{arc}_{name}" for arc in ARCS] for name in ("peak_n", "peak_error_n", "rms_n")]
    table = study.reindex(columns=dict.fromkeys((*study.columns, *chain(*of_arcs), "settled_tension_n"))).copy()
    peaks, errors, rms = (table[columns].to_numpy(float) for columns in of_arcs)
    larger = np.nan_to_num(peaks).argmax(axis=1)[:, None]
    table["tooth_peak_n"] = peaks.max(axis=1)
    table["tooth_peak_error_n"] = np.take_along_axis(errors, larger, axis=1)[:, 0]
    table["tooth_rms_n"] = rms.max(axis=1)
    by, compared = conditions(table), ["tooth_peak_n", "tooth_peak_error_n", "settled_tension_n"]
    bare = table[table["ring_radius_m"].isna()].groupby(by, as_index=False)[compared].first()
    same = table[by].merge(bare, on=by, how="left").set_axis(table.index)
    force, error, tension = (same[name] for name in compared)
    with np.errstate(divide="ignore", invalid="ignore"):
        table["tooth_ratio"] = ratio = table["tooth_peak_n"] / force.where(force > 0)
        own = table["tooth_peak_error_n"] / table["tooth_peak_n"].where(table["tooth_peak_n"] > 0)
    table["tooth_ratio_error"] = ratio * np.hypot(own.fillna(0.0), (error / force).fillna(0.0))
    table["tension_ratio"] = table["settled_tension_n"] / tension
    return table


class Window(NamedTuple):
    """Neighbouring radii of a study with which a bound is kept, m, and the next ones, with which not; NaN: none."""

    below: float
    radii: tuple[float, ...]
    above: float

    @property
    def first(self) -> float:
        """The smallest of the radii, m."""
        return self.radii[0]

    @property
    def last(self) -> float:
        """The largest of the radii, m."""
        return self.radii[-1]

    def __str__(self) -> str:
        if len(self.radii) == 1:
            return f"{self.first:.5g} m"
        apart = 1e3 * max(high - low for low, high in pairwise(self.radii))
        return f"{self.first:.5g} to {self.last:.5g} m ({len(self.radii)} radii, up to {apart:.2g} mm apart)"


def windows(kept: Mapping[float, bool]) -> list[Window]:
    """Return the windows of the radii (m) of a study by whether a bound is kept with each."""
    runs = [list(run) for _, run in groupby(sorted(kept), key=lambda radius: kept[radius])]
    ends = [float("nan"), *(run[-1] for run in runs)], [*(run[0] for run in runs), float("nan")]
    return [Window(ends[0][k], tuple(map(float, run)), ends[1][k + 1]) for k, run in enumerate(runs) if kept[run[0]]]


class _Smallest:
    """A rule that takes the smallest ring that keeps its bound, as do those within `SPAN` above it."""

    wear: float = 0.0

    def kept(self, study: pd.DataFrame, errors: float = 0.0) -> dict[float, bool]:
        """Return whether a ring keeps the bound at every speed it was run at, by its radius (m)."""
        raise NotImplementedError

    def serving(self, study: pd.DataFrame, errors: float = 0.0) -> dict[float, bool]:
        """Return whether a ring serves, also when worn, by radius (m); bounds are kept by this many ``errors``."""
        by, keeps = conditions(study), self.kept(study, errors)
        count = len(study.drop_duplicates(by))
        counts = study.drop_duplicates([*by, "ring_radius_m"])["ring_radius_m"].value_counts()
        first = {radius: window.first for window in windows(keeps) for radius in window.radii}
        return {
            radius: bool(counts[radius] == count)  # run at every speed and load
            and all(keeps[other] for other in keeps if radius <= other <= radius * (1 + SPAN))
            and radius - first[radius] >= self.wear - 1e-9
            for radius in keeps
        }

    def radius(self, study: pd.DataFrame, errors: float = 0.0) -> float:
        """Return the radius to choose, m; NaN if no ring of a study (`with_tooth_forces`) serves."""
        serves = self.serving(study, errors)
        return float(min((radius for radius in serves if serves[radius]), default=float("nan")))


@dataclass(frozen=True)
class RingRule(_Smallest):
    """The rule: the smallest ring that halves the largest force of a tooth, as do all within `SPAN` above it.

    That force is the largest in a passage, mean over passages, of the arc with more. With the ring it is at every speed
    at most the share ``tooth_force`` of that without a ring. A ring as made may be larger, within `SPAN`. It wears, and
    gets smaller: rings down to ``wear`` (m) below keep the bound, too.

    Raises `InputError`: the share is not above 0 and at most 1, the wear is negative or not finite.
    """

    tooth_force: float = 0.5
    wear: float = 0.0

    def __post_init__(self) -> None:
        if not 0 < self.tooth_force <= 1:
            accepted = "above 0 and at most 1, the force of a tooth over that without a ring, such as 0.5"
            raise InputError(f"tooth_force = {self.tooth_force:g}: must be {accepted}")
        if not 0 <= self.wear < float("inf"):
            raise InputError(f"wear = {self.wear:g}: must be a length from 0 on, m, such as 0.002")

    def __str__(self) -> str:
        wear = f", and {1e3 * self.wear:g} mm below" if self.wear else ""
        return f"tooth_peak_n <= {self.tooth_force:g} of that without a ring, smallest{wear}"

    def kept(self, study: pd.DataFrame, errors: float = 0.0) -> dict[float, bool]:
        """Return whether a ring keeps the bound by a number of standard ``errors``, by its radius (m)."""
        rings = with_tooth_forces(study).dropna(subset="ring_radius_m")
        keeps = rings["tooth_ratio"] + errors * rings["tooth_ratio_error"].fillna(0.0) <= self.tooth_force
        return keeps.groupby(rings["ring_radius_m"]).all().to_dict()

    @staticmethod
    def worst(study: pd.DataFrame) -> pd.Series:
        """Return the largest force of a tooth at any speed over that without a ring, by radius (m); without NaN."""
        ratios = with_tooth_forces(study).groupby("ring_radius_m")["tooth_ratio"]
        return ratios.agg(lambda values: values.max(skipna=False)).dropna()

    def refined(self, study: pd.DataFrame) -> list[float]:
        """Return radii, m, that would refine the choice of a study; empty if that is known to `NARROW`.

        Inside the gap below the choice, and below the window that it may wear through; without a choice, inside the
        gaps next to windows that are too narrow, or to the ring that is nearest to the bound. Radii at most `SPAN`
        apart from the smallest that it may wear to, to `SPAN` above it.
        """
        radii = sorted(study["ring_radius_m"].dropna().unique())
        all_windows, chosen = windows(self.kept(study)), self.radius(study)
        gaps, more = list[tuple[float, float]](), list[float]()
        below = [radius for radius in radii if radius < chosen]
        if below and not self.serving(study)[below[-1]]:
            gaps.append((below[-1], chosen))
        for window in all_windows:
            if chosen != chosen or chosen in window.radii:
                gaps.append((window.below, window.first))
                if window.last - window.first <= max(2 * NARROW, self.wear):
                    gaps.append((window.last, window.above))
            # where it would be the smallest that has worn by as much
            if self.wear and window.first + self.wear <= window.last:
                more.append(window.first + self.wear + 0.5 * 10**-ROUNDED)
        if not all_windows and len(least := self.worst(study)):
            near = radii.index(least.idxmin())
            gaps = list(pairwise(radii[max(near - 1, 0) : near + 2]))
        for low, high in gaps:
            count = ceil((high - low) / NARROW - 1e-9) if high - low > NARROW else 1
            # three at once cost as much as two in turn, and no second start of processes
            more += [low + (high - low) * k / count for k in range(1, count)] if count <= 3 else [(low + high) / 2]
        if chosen == chosen:
            spanned = [radius for radius in radii if chosen - self.wear <= radius <= chosen * (1 + SPAN)]
            if self.wear:
                more += [(low + high) / 2 for low, high in pairwise(spanned) if high - low > SPAN * chosen]
            if spanned[-1] == chosen != radii[-1]:
                more.append(floor(chosen * (1 + SPAN) * 10**ROUNDED) / 10**ROUNDED)
        return sorted({round(float(radius), ROUNDED) for radius in more} - set(radii))

    def band(self, study: pd.DataFrame) -> dict[float, float]:
        """Return the radii to choose with `OTHER_FORCES` in place of the share, m."""
        return {share: RingRule(share, self.wear).radius(study) for share in OTHER_FORCES}


@dataclass(frozen=True)
class DurationRule(_Smallest):
    """The paper's criterion, in numbers of ours: the smallest ring with which the right arc touches for less than
    `TOUCHING` of a turn and the left one for at most a tooth's share, 100 % over ``teeth``, and `MARGIN_PCT` points.
    """

    teeth: int

    def kept(self, study: pd.DataFrame, errors: float = 0.0) -> dict[float, bool]:
        """Return whether a ring keeps both bounds at every speed it was run at, by its radius (m)."""
        rings = study.dropna(subset="ring_radius_m")
        keeps = (rings["right_share_pct"] < TOUCHING) & (rings["left_share_pct"] <= 100.0 / self.teeth + MARGIN_PCT)
        return keeps.groupby(rings["ring_radius_m"]).all().to_dict()


def held_for(study: pd.DataFrame, rule: RingRule, rig: Rig) -> str:
    """Return the loads for which the advice on a study of a rig holds, and the drag of the track in addition.

    The drag (N) is the motor's power over the speed of the chain less the load, with the ring to choose or without one.
    """
    chosen, loads = rule.radius(study), sorted(study["load_n"].unique())
    rows = study[study["ring_radius_m"].isna() if chosen != chosen else study["ring_radius_m"] == chosen]
    speed = rows["rpm"].map(lambda rpm: rig.pitch / Periods.at(rig, rpm).passage)
    drag = (rows["motor_power_w"] / speed - rows["load_n"]).dropna()
    own = f"its own drag, {_span(drag)} N" if len(drag) else "its own drag"
    if loads == [0.0]:
        return f"this holds for a track that pulls nothing: the motor overcomes {own}"
    return f"this holds for loads of {listed([f'{load:g}' for load in loads])} N on the chain, in addition to {own}"


def _everywhere(study: pd.DataFrame) -> str:
    return f"at every speed{' and load' if 'load_n' in study and study['load_n'].any() else ''}"


def advice(
    study: pd.DataFrame, rule: RingRule, durations: DurationRule, grips: pd.DataFrame | None = None
) -> list[str]:
    """Return sentences on a study: the ring to choose first, then its force, price and wear; or why no ring serves.

    After these the windows of radii in which the force is as small, the right arc is free and a tooth drives; the
    choice with other shares, and by the durations of the paper. ``grips`` are runs of the recommended ring with another
    law of its friction (`sweeps.ring.other_grips`).
    """
    table = with_tooth_forces(study)
    rings, bare = table.dropna(subset="ring_radius_m"), table["ring_radius_m"].isna() & (table["tooth_peak_n"] > 0)
    run = dict.fromkeys(condition_name(row) for row in rings.sort_values(conditions(table)).itertuples())
    known = {condition_name(row) for row in table[bare].itertuples()}
    if unknown := [at for at in run if at not in known]:
        sentences = [f"no ring can be chosen: the force of a tooth without a ring at {listed(unknown)} is not known"]
    elif (chosen := rule.radius(study)) == chosen:
        sentences = _choice(table, rule, chosen) + ([] if grips is None else [_other_grips(grips, rule)])
    else:
        sentences = _none(table, rule)
    for name, keeps in (
        (f"force of a tooth at most {rule.tooth_force:g} {WITHOUT}", rings["tooth_ratio"] <= rule.tooth_force),
        (f"right arc free, below {TOUCHING:g} % of a turn", rings["right_share_pct"] < TOUCHING),
        ("a tooth is touched", rings["tooth_peak_n"] > 0),
    ):
        radii = windows(keeps.groupby(rings["ring_radius_m"]).all().to_dict())
        sentences.append(f"{name}, {_everywhere(study)}: {'; '.join(map(str, radii)) or 'no radius'}")
    others = (f"{_radius(radius)} with {share:g}" for share, radius in rule.band(study).items())
    sentences.append(f"with another share instead of {rule.tooth_force:g} the rule recommends {', '.join(others)}")
    return [*sentences, _by_durations(rings, durations)]


def _choice(table: pd.DataFrame, rule: RingRule, chosen: float) -> list[str]:
    """Return sentences on a ring that serves."""
    rows = table[table["ring_radius_m"] == chosen].sort_values(conditions(table))
    sentences = [f"recommended: a ring of radius {chosen:.4g} m"]
    if chosen == table["ring_radius_m"].max():
        largest = f"the recommended radius is the largest of the study, {chosen:.5g} m"
        sentences.insert(0, f"{largest}: a larger one may load a tooth by more")
    forces = listed([f"{significant(row.tooth_peak_n)} N at {condition_name(row)}" for row in rows.itertuples()])
    ratios = listed([f"{ratio:.2f}" for ratio in rows["tooth_ratio"]])
    bound = f"{ratios} {WITHOUT}, at most {rule.tooth_force:g} as asked"
    sentences.append(f"the largest force of a tooth in a passage is {forces}: {bound}")
    if (decided := rule.radius(table, DECIDED)) != chosen:
        apart = (rule.tooth_force - rows["tooth_ratio"]) / rows["tooth_ratio_error"]
        row, errors = rows.loc[apart.idxmin()], apart.min()
        why = f"rings within {SPAN:.1%} of it keep the bound by less than {DECIDED:g} errors"
        if errors < DECIDED:
            value = f"{plain(with_error(row['tooth_ratio'], row['tooth_ratio_error']))} (standard error) {WITHOUT}"
            why = f"at {condition_name(row)} the force is {value}, {errors:.2g} of its errors below the bound, and "
            why += f"{DECIDED:g} decide; a smaller step does, or a ring of {_radius(decided)}"
        sentences.append(f"this is not decided: {why}")
    if untouched := [condition_name(row) for row in rows[rows["tooth_peak_n"] == 0].itertuples()]:
        sentences.append(f"friction drive: no tooth is touched at {listed(untouched)}, only the ring drives")
    sentences.append(_price(table, rows))
    if "mobilised_friction" in rows and rows["mobilised_friction"].notna().any():
        grip = f"a friction of {_span(rows['mobilised_friction'])} is in use, its tangential over its normal force"
        sentences.append(f"the ring's grip: {grip} (mobilised friction)")
    window = next(window for window in windows(rule.kept(table)) if chosen in window.radii)
    return [*sentences, _wear(table, chosen, window)]


def _other_grips(grips: pd.DataFrame, rule: RingRule) -> str:
    """Return a sentence on the force of a tooth with a ring that is soft or hard in shear."""
    words = []
    for row in grips.sort_values("shear_stiffness").itertuples():
        force = "no result" if row.tooth_ratio != row.tooth_ratio else f"{row.tooth_ratio:.2f} {WITHOUT}"
        used = getattr(row, "mobilised_friction", float("nan"))
        used = "" if used != used else f", a friction of {significant(float(used), 2)} in use"
        words.append(f"{force} with {1e-3 * row.shear_stiffness:g} kN/m a link{used}")
    hold = grips["tooth_ratio"] <= rule.tooth_force
    verdict = "the ring serves with both" if hold.all() else "the choice depends on how much the ring grips"
    law = "if the ring gives way in shear instead (friction_law: dahl)"
    return f"{law}, the force of a tooth at {condition_name(grips.iloc[0])} is {listed(words)}: {verdict}"


def _price(table: pd.DataFrame, rows: pd.DataFrame) -> str:
    """Return a sentence on the price of a ring: tension, sliding work and power with it and without a ring."""
    by = conditions(table)
    bare = rows[by].merge(table[table["ring_radius_m"].isna()], on=by, how="left")
    words = [f"tension of the strand {_span(rows['tension_ratio'])} times that without a ring"]
    for text, columns, unit in (
        ("sliding of teeth and ring", ["teeth_sliding_j", "ring_sliding_j"], "J a turn"),
        ("motor power", ["motor_power_w"], "W"),
    ):
        if {*columns} <= {*table}:
            before, after = (of.reindex(columns=columns).sum(axis=1, min_count=1) for of in (bare, rows))
            words.append(f"{text} {_span(before)} -> {_span(after)} {unit}")
    force = f", force of the ring {_span(rows['ring_peak_n'])} N" if "ring_peak_n" in rows else ""
    return f"its price: {', '.join(words)}{force}"


def _wear(table: pd.DataFrame, chosen: float, window: Window) -> str:
    """Return a sentence on the wear after which a ring no longer keeps the bound."""
    worn = 1e3 * (chosen - window.first)
    if window.below != window.below:
        return f"wear: the bound is kept by every smaller ring of the study, for {worn:.2g} mm"
    fails = _worst(table[table["ring_radius_m"] == window.below])
    span = f"{worn:.2g} to " if worn > 0.01 else "at most "
    return f"wear: the bound fails after {span}{1e3 * (chosen - window.below):.2g} mm, at {window.below:.5g} m {fails}"


def _none(table: pd.DataFrame, rule: RingRule) -> list[str]:
    """Return sentences on the reason why no ring serves."""
    rings, worst = table.dropna(subset="ring_radius_m"), rule.worst(table)
    bound = f"the force of a tooth at {rule.tooth_force:g} {WITHOUT} {_everywhere(table)}"
    if worst.empty:
        return [f"no ring can be chosen: none of these has a result {_everywhere(table)}, to keep {bound}"]
    least = rings[rings["ring_radius_m"] == worst.idxmin()]
    row, sentences = least.loc[least["tooth_ratio"].idxmax()], list[str]()
    arc = max(ARCS, key=lambda arc: row[f"{arc}_peak_n"])
    if serving := windows(rule.kept(table)):
        widest = max(serving, key=lambda window: window.last - window.first)
        if (width := widest.last - widest.first) < rule.wear:
            why = f"not over {1e3 * rule.wear:g} mm of wear: the widest window has {1e3 * width:.2g} mm"
        else:
            larger = _worst(rings[rings["ring_radius_m"] == widest.above])
            why = f"not a ring up to {SPAN:.1%} larger: at {widest.above:.5g} m {larger}"
        sentences.append(f"no ring of these serves: {'; '.join(map(str, serving))} keep {bound}, but {why}")
        if width < NARROW:
            sentences.append(f"the window is narrower than {1e3 * NARROW:g} mm, which a ring as made may miss")
    else:
        sentences.append(f"no ring of these keeps {bound}")
    condition = f"{row['ring_radius_m']:.5g} m, at {condition_name(row)}, on the {arc} arc"
    sentences.append(f"the least share that any keeps {_everywhere(table)} is {row['tooth_ratio']:.2f}: {condition}")
    touching = rings[rings["right_share_pct"] >= TOUCHING]
    free = set(rings["ring_radius_m"]) - set(touching["ring_radius_m"])
    back = touching[touching["ring_radius_m"] > min(free, default=float("inf"))]
    if len(back):
        first = back.loc[back["ring_radius_m"].idxmin()]
        share = f"{first['right_share_pct']:.2g} % of a turn at {condition_name(first)}"
        sentences.append(f"the right arc comes back at {first['ring_radius_m']:.5g} m: {share}")
    elif not free:
        sentences.append("the right arc is never free")
    tight = rings.loc[rings["ring_radius_m"].idxmax()]
    tension = f"tension of the strand {significant(float(tight['tension_ratio']))} times that without a ring"
    return [*sentences, f"the largest ring of the study, {tight['ring_radius_m']:.5g} m: {tension}"]


def _by_durations(rings: pd.DataFrame, durations: DurationRule) -> str:
    """Return a sentence on the ring by the durations of the paper, and the force of a tooth with it."""
    bounds = f"right arc below {TOUCHING:g} %, left arc at most a tooth's share of a turn and {MARGIN_PCT:g} points"
    radius = durations.radius(rings)
    rows = rings[rings["ring_radius_m"] == radius]
    force = f"; {_worst(rows)}" if len(rows) and rows["tooth_ratio"].notna().all() else ""
    return f"by contact durations, as the paper argues ({bounds}): {_radius(radius)}{force}"


def _worst(rows: pd.DataFrame) -> str:
    """Word the force of a tooth at the speed where its share is largest."""
    if rows["tooth_ratio"].isna().any():
        return f"is not known at {condition_name(rows[rows['tooth_ratio'].isna()].iloc[0])}"
    row = rows.loc[rows["tooth_ratio"].idxmax()]
    return f"a tooth bears {row['tooth_ratio']:.2f} {WITHOUT} at {condition_name(row)}"


def _span(values: pd.Series) -> str:
    return " to ".join(dict.fromkeys(significant(float(value)) for value in (values.min(), values.max())))


def _radius(radius: float) -> str:
    return f"{radius:.4g} m" if radius == radius else "none"


def compared(study: pd.DataFrame, rule: RingRule, durations: DurationRule) -> pd.DataFrame:
    """Return rows of `with_tooth_forces`, by speed, of the rings to compare, named in ``ring``.

    These are no ring, the one to choose and its neighbours, a millimetre or more away where there are such, the one by
    durations, and the one with the least force of a tooth.
    """
    table, names = with_tooth_forces(study), dict[float, list[str]]()
    radii, chosen, worst = sorted(table["ring_radius_m"].dropna().unique()), rule.radius(study), rule.worst(table)
    below, above = ([r for r in radii if sign * (r - chosen) > 0] for sign in (-1, 1))
    for name, near, far in (
        ("smaller", below[-1:], [r for r in below if chosen - r >= 2 * NARROW - 1e-9][-1:]),
        ("recommended", [chosen] if chosen == chosen else [], []),
        ("larger", above[:1], [r for r in above if r - chosen >= 2 * NARROW - 1e-9][:1]),
        ("by durations", [] if (radius := durations.radius(study)) != radius else [radius], []),
        ("least force", [worst.idxmin()] if len(worst) else [], []),
    ):
        for radius in far or near:
            names.setdefault(radius, []).append(name)
    named = table["ring_radius_m"].map({radius: ", ".join(words) for radius, words in names.items()})
    table["ring"] = named.mask(table["ring_radius_m"].isna(), "none")
    return table.dropna(subset="ring").sort_values([*conditions(table), "ring_radius_m"], na_position="first")

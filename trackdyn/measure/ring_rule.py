"""Rules to choose a ring: by the force of a tooth over that without a ring, and, as the paper argues, by durations.

Bounds do not depend on which radii a study has, so that no end of their range moves them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain, groupby, pairwise
from math import ceil, floor
from typing import NamedTuple

import numpy as np
import pandas as pd

from trackdyn.inputs.errors import InputError
from trackdyn.measure.contacts import TOUCHING

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

    def decided(self, study: pd.DataFrame) -> float:
        """Return the radius to choose if a bound must be kept by `DECIDED` of its standard errors, m; or NaN."""
        return self.radius(study, DECIDED)

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

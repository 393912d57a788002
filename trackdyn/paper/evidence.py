"""What the runs say about each claim: named measures of the collected results."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd


@dataclass(frozen=True)
class Evidence:
    """Collected results of the pipeline.

    Attributes
    ----------
    metrics : DataFrame
        ``metrics.csv``.
    events : DataFrame
        ``events.csv``: ``run, event, mean_s, sd_s`` relative to the first contact of a passage.
    rpm : float
        Speed of the meshing process (Sect. 6.1).
    radius : float
        Its ring radius, m.
    peer : DataFrame or None
        ``peers/summary.csv``: the comparison with an independent code.
    """

    metrics: pd.DataFrame
    events: pd.DataFrame
    rpm: float
    radius: float
    peer: pd.DataFrame | None = None

    def records(self) -> pd.DataFrame:
        """The long records of Sect. 5, by rising speed."""
        rows = self.metrics[self.metrics["run"].str.fullmatch(r"[\d.]+rpm")]
        return rows.sort_values("rpm")

    def meshing(self, name: str) -> pd.Series:
        """The run ``ring`` or ``no_ring`` of Sect. 6.1."""
        return self.metrics.set_index("run").loc[f"meshing/{name}"]

    def study(self, rpm: float | None = None) -> pd.DataFrame:
        """The ring study at one speed (default: that of Sect. 6.1), by rising radius, without 'none'."""
        rows = self.metrics[self.metrics["run"].str.startswith("ring/") & (self.metrics["rpm"] == (rpm or self.rpm))]
        return rows.dropna(subset="ring_radius_m").sort_values("ring_radius_m")

    def study_speeds(self) -> list[float]:
        """Speeds of the ring study."""
        return sorted(self.metrics[self.metrics["run"].str.startswith("ring/")]["rpm"].unique())

    def event_times(self, run: str, names: list[str]) -> list[float]:
        """Mean times of events after the first contact, s; NaN for one that never happens."""
        rows = self.events[self.events["run"] == f"meshing/{run}"].set_index("event")["mean_s"]
        return [float(rows.get(name, np.nan)) for name in names]


# Maxima of the force after a mean over the resolution of the printed times; events.csv has both readings.
MAXIMUM = "maximum, mean over 0.01 s"

MEASURES: dict[str, Callable[[Evidence], Any]] = {}
# The paper says these in words only: the number that a claim compares with is our reading, not printed.
BOUND_IS_OURS = {
    "left_contact_ratio",
    "ring_over_arcs",
    "force_growth_with_speed",
    "right_share_from_0305",
    "left_force_spread",
}


def measure(function: Callable[[Evidence], Any]) -> Callable[[Evidence], Any]:
    """Register a measure under its function's name."""
    MEASURES[function.__name__] = function
    return function


@measure
def peer_difference(e: Evidence) -> float | None:
    """Largest difference of the vertical displacement from the independent code's, % of its range; None without it."""
    if e.peer is None or "difference_pct" not in e.peer or e.peer["difference_pct"].isna().all():
        return None
    return float(e.peer["difference_pct"].iloc[0])


def _rising(values) -> bool:
    return bool(np.all(np.diff(np.asarray(values, dtype=float)) > 0))


@measure
def loop_gap_max(e: Evidence):
    """Largest gap of the cut joint over the records of all speeds, m."""
    return float(e.records()["loop_gap_max_m"].max())


@measure
def rms_and_sd_rise_with_speed(e: Evidence):
    """RMS and SD of the y acceleration both rise from speed to speed."""
    r = e.records()
    return _rising(r["rms_g"]) and _rising(r["sd_g"])


@measure
def line_frequencies(e: Evidence):
    """Main line of the paper's own FFT at every speed, Hz."""
    return e.records()["line_hz"].tolist()


@measure
def line_amplitudes(e: Evidence):
    """Amplitude of that line at every speed, g."""
    return e.records()["line_g"].tolist()


@measure
def line_frequencies_binfree(e: Evidence):
    """Main line at every speed, free of the picket fence, Hz."""
    return e.records()["line_hz_binfree"].tolist()


@measure
def high_frequency_rises_with_speed(e: Evidence):
    """RMS of the content above 20 Hz rises from speed to speed."""
    return _rising(e.records()["high_frequency_g"])


@measure
def areas_without_ring(e: Evidence):
    """Areas that the left and the right arc visit without a ring."""
    row = e.meshing("no_ring")
    return f"left {row['left_areas']}, right {row['right_areas']}"


@measure
def areas_with_ring(e: Evidence):
    """Areas that the left and the right arc visit with the ring."""
    row = e.meshing("ring")
    return f"left {row['left_areas']}, right {row['right_areas']}"


@measure
def events_without_ring(e: Evidence):
    """Left maximum, right maximum, right gone and out after the first contact without a ring, s."""
    return e.event_times("no_ring", [f"left {MAXIMUM}", f"right {MAXIMUM}", "right gone", "out"])


@measure
def events_with_ring(e: Evidence):
    """Ring maximum, left touches, left maximum, ring left and out after the ring's first touch, s."""
    return e.event_times("ring", [f"ring {MAXIMUM}", "left touches", f"left {MAXIMUM}", "ring left", "out"])


@measure
def left_contact_ratio(e: Evidence):
    """Left-arc share and RMS force with the ring relative to those without."""
    a, b = e.meshing("ring"), e.meshing("no_ring")
    return [a["left_share_pct"] / b["left_share_pct"], a["left_rms_n"] / b["left_rms_n"]]


@measure
def ring_over_arcs(e: Evidence):
    """Mean ring force over the mean force of both arcs, over the run."""
    a = e.meshing("ring")
    mean = {
        side: np.sqrt(max(a[f"{side}_rms_n"] ** 2 - a[f"{side}_sd_n"] ** 2, 0.0)) for side in ("left", "right", "ring")
    }
    return float(mean["ring"] / (mean["left"] + mean["right"]))


@measure
def force_growth_with_speed(e: Evidence):
    """RMS force at the highest over that at the lowest speed with the ring: left arc, ring."""
    speeds = e.study_speeds()
    low, high = (e.study(rpm).set_index("ring_radius_m").loc[e.radius] for rpm in (speeds[0], speeds[-1]))
    return [high["left_rms_n"] / low["left_rms_n"], high["ring_rms_n"] / low["ring_rms_n"]]


@measure
def ring_force_rises_with_radius(e: Evidence):
    """RMS and SD of the ring force rise with the radius at every speed."""
    return all(_rising(e.study(v)["ring_rms_n"]) and _rising(e.study(v)["ring_sd_n"]) for v in e.study_speeds())


@measure
def right_share_from_0305(e: Evidence):
    """Largest share of right-arc contact for radii of 0.305 m and more at any speed, % of a turn."""
    return float(
        max(s[s["ring_radius_m"] >= 0.305 - 1e-9]["right_share_pct"].max() for s in map(e.study, e.study_speeds()))
    )


@measure
def left_force_spread(e: Evidence):
    """Largest deviation of the left-arc RMS from its mean over radii of 0.305 m and more, %."""
    s = e.study()
    values = s[s["ring_radius_m"] >= 0.305 - 1e-9]["left_rms_n"]
    return float(100 * (values / values.mean() - 1).abs().max())


@measure
def left_shares_from_0307(e: Evidence):
    """Left-arc share for every radius of 0.307 m and more, % of a turn."""
    s = e.study()
    return s[s["ring_radius_m"] >= 0.307 - 1e-9]["left_share_pct"].tolist()


@measure
def smallest_radius_that_serves(e: Evidence):
    """Smallest radius without right contact whose left share is within 2 points of the least one, m."""
    s = e.study()
    good = s[(s["right_share_pct"] < 0.5) & (s["left_share_pct"] <= s["left_share_pct"].min() + 2.0)]
    return float(good["ring_radius_m"].min())


@measure
def engaged_without_ring(e: Evidence):
    """Left-arc contact from first touch to out without a ring, % of a turn."""
    row = e.meshing("no_ring")
    return 100 * (row["left_phase_end"] - row["left_phase_start"])


@measure
def shares_with_ring(e: Evidence):
    """Share of ring contact and of left-arc contact, % of a turn."""
    row = e.meshing("ring")
    return [row["ring_share_pct"], row["left_share_pct"]]

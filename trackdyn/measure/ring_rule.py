"""Which ring serves: bounds of contact measures at every speed, and the choice among the radii that keep them.

Bounds are absolute, so that no end of a range of radii moves them: an ever tighter ring has an ever shorter contact of
the left arc.
"""

import operator
from collections.abc import Callable
from math import floor, isnan
from typing import Any, NamedTuple

import pandas as pd

from trackdyn.measure.cells import plain, with_error
from trackdyn.measure.columns import error_of, heading
from trackdyn.measure.contacts import TOUCHING
from trackdyn.measure.uncertainty import ROUNDING

# Points of a turn that the left arc may touch for beyond a tooth's share of it, 100 over the number of teeth, for which
# connectors that drive one after the other touch at least. Ours; the paper has a plateau near 10 %, and no rule.
MARGIN_PCT, MARGINS_PCT = 2.0, (1.0, 3.0)
# The radii above the smallest one that must serve, too, as a share of its own: a millimetre at 0.3 m, the paper's step.
# A radius that serves between others that do not is a dip of a curve that is not monotonic, and moves with the grid.
SPAN = 1 / 300
# Gap between a radius that serves and one that does not, m, to which a study is refined around its choice, in at most
# so many steps; of a window in which the rule holds that is narrower this is said.
NARROW, ROUNDS = 5e-4, 3
ROUNDED = 5  # decimals of a radius that is added, m
WORK_COLUMNS = ("teeth_sliding_j", "ring_sliding_j")
COMPARED = ("settled_tension_n", "ring_rms_n", "left_rms_n", *WORK_COLUMNS)  # what a choice weighs
RULE_COLUMNS = ("right_share_pct", "left_share_pct", *COMPARED)


class Bound(NamedTuple):
    """A bound that a measure must keep at every speed."""

    column: str
    sign: str
    keeps: Callable[[Any, float], Any]
    limit: float
    share: str = ""  # what the limit is made of

    @property
    def words(self) -> str:
        """The bound as a person reads it."""
        return f"{heading(self.column)} {self.sign} {self.limit:.3g}{self.share}"

    def missed(self, rings: pd.DataFrame) -> pd.DataFrame:
        """Rows of rings that do not keep the bound, or of which it is not known (NaN)."""
        return rings[~self.keeps(rings[self.column], self.limit)]

    def worst(self, missed: pd.DataFrame) -> str:
        """The speed at which rows miss the bound by most, and at how many others they do."""
        row = missed.loc[(missed[self.column] - self.limit).abs().fillna(float("inf")).idxmax()]
        others = f", and at {len(missed) - 1} other speed{'s' * (len(missed) > 2)}" if len(missed) > 1 else ""
        value, error = row[self.column], row.get(error_of(self.column) or "", 0.0)
        if value != value:
            return f"{heading(self.column)} at {row['rpm']:g} rpm is not known{others}"
        number = plain(with_error(value, error)) if error > ROUNDING * value else f"{value:.4g}"
        return f"{heading(self.column)} at {row['rpm']:g} rpm is {number}, must be {self.sign} {self.limit:.4g}{others}"


class RingRule(NamedTuple):
    """The rule for a sprocket with so many teeth: the smallest ring with which the right arc is free and the left one
    touches briefly, at every speed, as they do with all within `SPAN` above it.
    """

    teeth: int
    margin: float = MARGIN_PCT  # points of a turn

    def __str__(self) -> str:
        return f"right_share_pct < {TOUCHING:g}, left_share_pct <= tooth + {self.margin:g}, smallest"

    @property
    def bounds(self) -> tuple[Bound, Bound]:
        """What both arcs must keep."""
        share = f" (a tooth's share of a turn + {self.margin:g} points)"
        return (
            Bound("right_share_pct", "<", operator.lt, TOUCHING),
            Bound("left_share_pct", "<=", operator.le, 100.0 / self.teeth + self.margin, share),
        )

    def missed(self, study: pd.DataFrame) -> set[float]:
        """Radii that do not keep every bound at every speed, m."""
        rings = study.dropna(subset="ring_radius_m")
        return set().union(*(bound.missed(rings)["ring_radius_m"] for bound in self.bounds))

    def radius(self, study: pd.DataFrame) -> float:
        """The radius to choose, m; NaN if none serves. ``study`` has a row per radius and speed, columns of metrics."""
        missed = self.missed(study)
        radii = sorted(set(study["ring_radius_m"].dropna()) - missed)
        serve = (radius for radius in radii if not any(radius < other <= radius * (1 + SPAN) for other in missed))
        return float(next(serve, float("nan")))

    def window(self, study: pd.DataFrame) -> "Window | None":
        """The radii that keep every bound around the one to choose; around the smallest that does if none serves."""
        radii, missed = sorted(study["ring_radius_m"].dropna().unique()), self.missed(study)
        chosen = self.radius(study)
        keep = [radius for radius in radii if radius not in missed]
        if not keep:
            return None
        first = last = radii.index(chosen if chosen == chosen else keep[0])
        while first and radii[first - 1] not in missed:
            first -= 1
        while last < len(radii) - 1 and radii[last + 1] not in missed:
            last += 1
        below, above = (radii[k] if 0 <= k < len(radii) else float("nan") for k in (first - 1, last + 1))
        return Window(below, radii[first], radii[last], above)

    def refined(self, study: pd.DataFrame) -> list[float]:
        """Radii, m, by which a study would say more of its choice: the middle of gaps at the ends of its `window`, and
        one within `SPAN` above the choice, where none was run; empty if the window is known to `NARROW`.
        """
        if (window := self.window(study)) is None:
            return []
        radii, chosen, more = sorted(study["ring_radius_m"].dropna().unique()), self.radius(study), []
        if window.first - window.below > NARROW:
            more.append((window.below + window.first) / 2)
        if window.above - window.last > NARROW and window.last - window.first <= 2 * NARROW:
            more.append((window.last + window.above) / 2)
        if chosen == chosen != radii[-1] and not any(chosen < r <= chosen * (1 + SPAN) for r in radii):
            more.append(floor(chosen * (1 + SPAN) * 10**ROUNDED) / 10**ROUNDED)
        return sorted({round(float(radius), ROUNDED) for radius in more} - set(radii))

    def band(self, study: pd.DataFrame) -> dict[float, float]:
        """Radii that the rule chooses with each of `MARGINS_PCT` over a tooth's share, m."""
        return {margin: self._replace(margin=margin).radius(study) for margin in MARGINS_PCT}


class Window(NamedTuple):
    """Neighbouring radii of a study that keep every bound, m, and the next ones, which do not; NaN: there is none."""

    below: float
    first: float
    last: float
    above: float

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of the window, m: half way to the radii that do not keep the bounds."""
        low = self.first if isnan(self.below) else (self.below + self.first) / 2
        return low, self.last if isnan(self.above) else (self.last + self.above) / 2

    def __str__(self) -> str:
        low, high = self.ends
        text = f"the rule holds from {low:.5g} to {high:.5g} m"
        gaps = [gap for gap in (self.first - self.below, self.above - self.last) if gap == gap]
        text += f", ends known to {1e3 * max(gaps) / 2:.2g} mm" if gaps else ""
        # at the end of the study it may be wider than is known
        narrow = high - low < NARROW and len(gaps) == 2
        return text + (f": narrower than {1e3 * NARROW:g} mm, which a ring as made may miss" if narrow else "")


def advice(study: pd.DataFrame, rule: RingRule) -> list[str]:
    """Sentences: the one radius to choose for all speeds, the window in which the rule holds, what its margin moves,
    and what decides; or that no radius serves.

    Then the radii that keep each bound. A choice at the end of the study comes first.
    """
    rings, chosen, window = study.dropna(subset="ring_radius_m"), rule.radius(study), rule.window(study)
    radii, sentences = sorted(rings["ring_radius_m"].unique()), ["no radius of these serves at every speed"]
    misses = {bound: dict(list(bound.missed(rings).groupby("ring_radius_m"))) for bound in rule.bounds}
    if window and chosen == chosen:
        sentences, index = [f"recommended: a ring of radius {chosen:.4g} m"], radii.index(chosen)
        if index == len(radii) - 1:
            sentences.insert(
                0, f"the recommended radius is the largest of the study, {chosen:.5g} m: a larger one may serve better"
            )
        each = (
            f"{f'{radius:.4g} m' if radius == radius else 'none'} with {margin:g}"
            for margin, radius in rule.band(study).items()
        )
        margins = f"with another margin instead of {MARGIN_PCT:g} points the rule recommends {', '.join(each)}"
        sentences += [str(window), margins]
        for words, k in (("smaller", index - 1), ("larger", index + 1)):
            if 0 <= k < len(radii):
                missed = "; ".join(bound.worst(rows[radii[k]]) for bound, rows in misses.items() if radii[k] in rows)
                serves = "keeps every bound, " + ("but a slightly larger one does not" if k < index else "too")
                sentences.append(f"the next {words} radius, {radii[k]:.5g} m: {missed or serves}")
    elif lonely := [f"{radius:.5g}" for radius in radii if not any(radius in rows for rows in misses.values())]:
        sentences[0] += f": {', '.join(lonely)} m keep every bound, but not all radii up to {SPAN:.1%} above them"
        sentences.append(str(window))
    for bound, rows in misses.items():
        keep = [f"{radius:.5g}" for radius in radii if radius not in rows]
        sentences.append(f"{bound.words}, at every speed: {', '.join(keep) + ' m' if keep else 'no radius'}")
    return sentences


def compared(study: pd.DataFrame, rule: RingRule) -> pd.DataFrame:
    """Rows of a study of the ring to choose, its neighbours, and none, by speed; ``ring`` says which it is."""
    radii, chosen = sorted(study["ring_radius_m"].dropna().unique()), rule.radius(study)
    if chosen != chosen:
        return study.iloc[:0].assign(ring="")
    index = radii.index(chosen)
    names = {index - 1: "smaller", index: "recommended", index + 1: "larger"}
    named = {radius: names[k] for k, radius in enumerate(radii) if k in names}
    words = study["ring_radius_m"].map(named).mask(study["ring_radius_m"].isna(), "none")
    return study.assign(ring=words).dropna(subset="ring").sort_values(["rpm", "ring_radius_m"], na_position="first")

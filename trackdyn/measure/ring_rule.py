"""Which ring serves: bounds of contact measures at every speed, and the choice among the radii that keep them.

Bounds are absolute, so that no end of a range of radii moves them: an ever tighter ring has an ever shorter contact of
the left arc.
"""

import operator
import re
from math import floor, isnan
from typing import NamedTuple

import numpy as np
import pandas as pd

from trackdyn.inputs.errors import InputError, shown
from trackdyn.measure.catalogue import OF_SIDES
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
RULE = f"right_share_pct < {TOUCHING:g}, left_share_pct <= tooth + {MARGIN_PCT:g}, smallest"
WORK_COLUMNS = ("teeth_sliding_j", "ring_sliding_j")
COMPARED = ("settled_tension_n", "ring_rms_n", "left_rms_n", *WORK_COLUMNS)  # what a choice weighs
RULE_COLUMNS = ("rms_g", "sd_g", *WORK_COLUMNS, *(measure.column for side in OF_SIDES.values() for measure in side))
_OF_A_SIDE = (measure.column.removeprefix("left_") for measure in OF_SIDES["left"])
_KNOWN = f"rms_g, sd_g, {', '.join(WORK_COLUMNS)}, or left_, right_ or ring_ with {', '.join(_OF_A_SIDE)}"
_BOUND = re.compile(r"(\w+)\s*(<=?|>=?)\s*(?:(tooth)\s*\+\s*)?(-?\d+(?:\.\d*)?(?:e-?\d+)?)")
KEEPS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}


class Bound(NamedTuple):
    """A bound that a measure must keep at every speed."""

    column: str
    sign: str
    number: float
    tooth: float  # share of a turn of one tooth, %, that the number is added to, or 0

    def __str__(self) -> str:
        return f"{self.column} {self.sign} {'tooth + ' if self.tooth else ''}{self.number:g}"

    @property
    def limit(self) -> float:
        """The number that the measure is compared with."""
        return self.tooth + self.number

    @property
    def words(self) -> str:
        """The bound as a person reads it."""
        share = f" (a tooth's share of a turn + {self.number:g} points)" if self.tooth else ""
        return f"{heading(self.column)} {self.sign} {self.limit:.3g}{share}"

    def missed(self, rings: pd.DataFrame) -> pd.DataFrame:
        """Rows of rings that do not keep the bound, or of which it is not known (NaN)."""
        return rings[~KEEPS[self.sign](rings[self.column], self.limit)]

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
    """Bounds, and which of the rings that keep all of them is chosen.

    That is the ``smallest`` above which all within `SPAN` keep them, too, the ``largest``, or that of the least value
    of a column at its worst speed.
    """

    bounds: tuple[Bound, ...]
    choice: str

    def __str__(self) -> str:
        choice = self.choice if self.choice in ("smallest", "largest") else f"least {self.choice}"
        return ", ".join((*map(str, self.bounds), choice))

    def missed(self, study: pd.DataFrame) -> set[float]:
        """Radii that do not keep every bound at every speed, m."""
        rings = study.dropna(subset="ring_radius_m")
        return set().union(*(bound.missed(rings)["ring_radius_m"] for bound in self.bounds))

    def radius(self, study: pd.DataFrame) -> float:
        """The radius to choose, m; NaN if none serves. ``study`` has a row per radius and speed, columns of metrics."""
        rings, missed = study.dropna(subset="ring_radius_m"), self.missed(study)
        rings = rings[~rings["ring_radius_m"].isin(missed)]
        if self.choice == "smallest":
            alone = [
                any(radius < other <= radius * (1 + SPAN) for other in missed) for radius in rings["ring_radius_m"]
            ]
            rings = rings[~np.array(alone, dtype=bool)]
        if rings.empty or self.choice in ("smallest", "largest"):
            return float(rings["ring_radius_m"].max() if self.choice == "largest" else rings["ring_radius_m"].min())
        return float(rings.groupby("ring_radius_m")[self.choice].max().idxmin())

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
        for the ``smallest`` one within `SPAN` above it, where none was run; empty if the window is known to `NARROW`.
        """
        if (window := self.window(study)) is None:
            return []
        radii, chosen, more = sorted(study["ring_radius_m"].dropna().unique()), self.radius(study), []
        smallest = self.choice == "smallest"
        if window.first - window.below > NARROW:
            more.append((window.below + window.first) / 2)
        if window.above - window.last > NARROW and not (smallest and window.last - window.first > 2 * NARROW):
            more.append((window.last + window.above) / 2)
        if smallest and chosen == chosen != radii[-1] and not any(chosen < r <= chosen * (1 + SPAN) for r in radii):
            more.append(floor(chosen * (1 + SPAN) * 10**ROUNDED) / 10**ROUNDED)
        return sorted({round(float(radius), ROUNDED) for radius in more} - set(radii))

    def band(self, study: pd.DataFrame) -> dict[float, float]:
        """Radii that the rule chooses with each of `MARGINS_PCT` over a tooth's share, m; empty without that share."""
        radii = {}
        for margin in MARGINS_PCT if any(bound.tooth for bound in self.bounds) else ():
            bounds = (bound._replace(number=margin) if bound.tooth else bound for bound in self.bounds)
            radii[margin] = self._replace(bounds=tuple(bounds)).radius(study)
        return radii


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

    @property
    def narrow(self) -> bool:
        """Whether the window is narrower than `NARROW`; one at the end of the study may be wider than is known."""
        return self.ends[1] - self.ends[0] < NARROW and not (isnan(self.below) or isnan(self.above))

    def __str__(self) -> str:
        text = "the rule holds from {:.5g} to {:.5g} m".format(*self.ends)
        gaps = [gap for gap in (self.first - self.below, self.above - self.last) if gap == gap]
        text += f", ends known to {1e3 * max(gaps) / 2:.2g} mm" if gaps else ""
        return text + (f": narrower than {1e3 * NARROW:g} mm, which a ring as made may miss" if self.narrow else "")


def parse_rule(text: str, teeth: int) -> RingRule:
    """A rule such as `RULE` of a sprocket with so many teeth: bounds, then the choice, with commas between.

    Raises `InputError`: it cannot be read.
    """
    *terms, last = [words.strip() for words in text.split(",")]
    bounds, choice = [], last.removeprefix("least ").strip()
    for term in terms:
        match = _BOUND.fullmatch(term)
        if match is None:
            expected = "a column, <, <=, > or >=, and a number or tooth + a number"
            raise InputError(f"rule: {shown(term)} is not a bound; expected {expected}, as in {RULE!r}")
        bounds.append(Bound(match[1], match[2], float(match[4]), 100.0 / teeth if match[3] else 0.0))
    if choice not in ("smallest", "largest") and (choice == last or choice not in RULE_COLUMNS):
        raise InputError(f"rule: {shown(last)} is not a choice; end with smallest, largest or least COLUMN: {_KNOWN}")
    for bound in bounds:
        if bound.column not in RULE_COLUMNS:
            raise InputError(f"rule: {shown(bound.column)} is not a column that a rule can bound: {_KNOWN}")
    return RingRule(tuple(bounds), choice)


def advice(study: pd.DataFrame, rule: RingRule) -> list[str]:
    """Sentences: the one radius to choose for all speeds, the window in which the rule holds, what its margin moves,
    the ring of least sliding on the teeth, and what decides; or that no radius serves.

    Then what every bound is kept by, and what would be chosen at one speed alone. A choice at the end of the study is
    said first.
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
        sentences.append(str(window))
        if band := rule.band(study):
            each = (
                f"{f'{radius:.4g} m' if radius == radius else 'none'} with {margin:g}"
                for margin, radius in band.items()
            )
            low, high = window.ends
            moves = any(not abs(radius - chosen) <= high - low for radius in band.values())
            more = "; the margin, which is ours, moves the choice by more than that window" if moves else ""
            sentences.append(
                f"with another margin instead of {MARGIN_PCT:g} points the rule recommends {', '.join(each)}{more}"
            )
        sentences += _sliding_sentences(rings, chosen)
        for words, k in (("smaller", index - 1), ("larger", index + 1)):
            if 0 <= k < len(radii):
                missed = "; ".join(bound.worst(rows[radii[k]]) for bound, rows in misses.items() if radii[k] in rows)
                dip = words == "smaller" and rule.choice == "smallest"
                serves = "keeps every bound" + (", but a slightly larger one does not" if dip else ", too")
                sentences.append(f"the next {words} radius, {radii[k]:.5g} m: {missed or serves}")
    elif lonely := [f"{radius:.5g}" for radius in radii if not any(radius in rows for rows in misses.values())]:
        sentences[0] += f": {', '.join(lonely)} m keep every bound, but not all radii up to {SPAN:.1%} above them"
        sentences.append(str(window))
    for bound, rows in misses.items():
        keep = [f"{radius:.5g}" for radius in radii if radius not in rows]
        sentences.append(f"{bound.words}, at every speed: {', '.join(keep) + ' m' if keep else 'no radius'}")
    if study["rpm"].nunique() > 1:
        alone = {rpm: rule.radius(rows) for rpm, rows in study.groupby("rpm")}
        each = (f"{f'{radius:.4g} m' if radius == radius else 'none'} at {rpm:g} rpm" for rpm, radius in alone.items())
        sentences.append(f"for a single speed: {', '.join(each)}")
    return sentences


def _least_sliding(rings: pd.DataFrame) -> float | None:
    """The radius of the least sliding work on the teeth at its worst speed, m; None if no work is known."""
    by_radius = rings.groupby("ring_radius_m")["teeth_sliding_j"]
    work = by_radius.max()[by_radius.count() == rings["rpm"].nunique()]
    return None if work.empty else float(work.idxmin())


def _sliding_sentences(rings: pd.DataFrame, chosen: float) -> list[str]:
    """Sentence on the ring of least sliding beside the chosen one, and on what it costs in tension."""
    least, by_radius = _least_sliding(rings), rings.groupby("ring_radius_m")
    if least is None or least == chosen:
        return [] if least is None else ["no ring of the study slides less on the teeth"]
    work, tension = by_radius["teeth_sliding_j"].max(), by_radius["settled_tension_n"].max()
    return [
        f"least sliding on the teeth: {least:.5g} m, {work[least]:.3g} J per turn instead of {work[chosen]:.3g} J, "
        f"with {100 * (tension[least] / tension[chosen] - 1):+.0f} % strand tension"
    ]


def compared(study: pd.DataFrame, rule: RingRule) -> pd.DataFrame:
    """Rows of a study of the rings that an advice names, and without one, by speed; ``ring`` says which it is."""
    radii, chosen = sorted(study["ring_radius_m"].dropna().unique()), rule.radius(study)
    if chosen != chosen:
        return study.iloc[:0].assign(ring="")
    index = radii.index(chosen)
    named = {radii[k]: words for words, k in (("smaller", index - 1), ("larger", index + 1)) if 0 <= k < len(radii)}
    least = _least_sliding(study.dropna(subset="ring_radius_m"))
    if least is not None:
        named[least] = "least sliding"
    words = study["ring_radius_m"].map(named | {chosen: "recommended"}).mask(study["ring_radius_m"].isna(), "none")
    return study.assign(ring=words).dropna(subset="ring").sort_values(["rpm", "ring_radius_m"], na_position="first")

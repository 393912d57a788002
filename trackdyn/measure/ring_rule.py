"""Which ring serves: bounds of contact measures at every speed, and the choice among the radii that keep them."""

import operator
import re
from typing import NamedTuple

import pandas as pd

from trackdyn.errors import InputError, shown
from trackdyn.measure.columns import PLACES, SIDE_COLUMNS, error_of, heading
from trackdyn.measure.contacts import TOUCHING
from trackdyn.measure.convergence import ROUNDING

NEAR_LEAST = 2.0  # points of a turn: how near the least left contact a ring that serves must come (claim C26)
# ours; the paper states none
RULE = f"right_share_pct < {TOUCHING:g}, left_share_pct <= least + {NEAR_LEAST:g}, smallest"
COLUMNS = ("rms_g", "sd_g", *(f"{side}_{name}" for side in PLACES for name in SIDE_COLUMNS))
_KNOWN = f"rms_g, sd_g, or left_, right_ or ring_ with {', '.join(SIDE_COLUMNS)}"
_BOUND = re.compile(r"(\w+)\s*(<=?|>=?)\s*(?:(least)\s*\+\s*)?(-?\d+\.?\d*(?:e-?\d+)?)")


KEEPS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}


class Bound(NamedTuple):
    """What a measure must keep at every speed."""

    column: str
    sign: str
    number: float
    over_least: bool  # counted from the least value of all rings at the speed

    def __str__(self) -> str:
        return f"{self.column} {self.sign} {'least + ' * self.over_least}{self.number:g}"

    def missed(self, rings: pd.DataFrame) -> pd.DataFrame:
        """Rows of rings that do not keep the bound, or of which it is not known (NaN), with their ``limit``."""
        values = rings[self.column]
        limit = self.number + (values.groupby(rings["rpm"]).transform("min") if self.over_least else 0.0)
        return rings.assign(limit=limit)[~KEEPS[self.sign](values, limit)]

    def worst(self, missed: pd.DataFrame) -> str:
        """The speed at which rows miss the bound by most, and at how many others they do."""
        row = missed.loc[(missed[self.column] - missed["limit"]).abs().fillna(float("inf")).idxmax()]
        others = f", and at {len(missed) - 1} more of the speeds" if len(missed) > 1 else ""
        value, error = row[self.column], row.get(error_of(self.column) or "", 0.0)
        if value != value:
            return f"{heading(self.column)} at {row['rpm']:g} rpm is not known{others}"
        scatter = f" +- {error:.2g}" if error > ROUNDING * value else ""
        return (
            f"{heading(self.column)} at {row['rpm']:g} rpm is {value:.4g}{scatter}, "
            f"must be {self.sign} {row['limit']:.4g}{others}"
        )


class RingRule(NamedTuple):
    """Bounds, and which of the rings that keep all of them is chosen: ``smallest``, ``largest``, or of the least value
    of a column at its worst speed.
    """

    bounds: tuple[Bound, ...]
    choice: str

    def __str__(self) -> str:
        choice = self.choice if self.choice in ("smallest", "largest") else f"least {self.choice}"
        return ", ".join((*map(str, self.bounds), choice))

    def radius(self, study: pd.DataFrame) -> float:
        """The radius to choose, m; NaN if none serves. ``study`` has a row a radius and speed, columns of metrics."""
        rings = study.dropna(subset="ring_radius_m")
        missed = set().union(*(bound.missed(rings)["ring_radius_m"] for bound in self.bounds))
        rings = rings[~rings["ring_radius_m"].isin(missed)]
        if rings.empty or self.choice in ("smallest", "largest"):
            return float(rings["ring_radius_m"].max() if self.choice == "largest" else rings["ring_radius_m"].min())
        return float(rings.groupby("ring_radius_m")[self.choice].max().idxmin())


def parse_rule(text: str) -> RingRule:
    """A rule such as `RULE`: bounds, then the choice, with commas between. Raises `InputError`: it cannot be read."""
    *terms, last = [words.strip() for words in text.split(",")]
    bounds, choice = [], last.removeprefix("least ").strip()
    for term in terms:
        match = _BOUND.fullmatch(term)
        if match is None:
            expected = "a column, <, <=, > or >=, and a number or least + a number"
            raise InputError(f"--rule: {shown(term)} is no bound; expected {expected}, as in {RULE!r}")
        bounds.append(Bound(match[1], match[2], float(match[4]), bool(match[3])))
    if choice not in ("smallest", "largest") and (choice == last or choice not in COLUMNS):
        raise InputError(f"--rule: {shown(last)} is no choice; end with smallest, largest or least COLUMN: {_KNOWN}")
    for bound in bounds:
        if bound.column not in COLUMNS:
            raise InputError(f"--rule: {shown(bound.column)} is no column that a rule can bound: {_KNOWN}")
    return RingRule(tuple(bounds), choice)


def advice(study: pd.DataFrame, rule: RingRule) -> list[str]:
    """Sentences: the radius to choose and by which rule, and how far the next ones are from it; or that none serves.

    Then what every bound is kept by, and what would be chosen at one speed alone.
    """
    rings, chosen = study.dropna(subset="ring_radius_m"), rule.radius(study)
    radii, sentences = sorted(rings["ring_radius_m"].unique()), ["no radius of these serves at every speed"]
    misses = {bound: dict(list(bound.missed(rings).groupby("ring_radius_m"))) for bound in rule.bounds}
    if chosen == chosen:
        sentences, index = [f"choose {chosen:g} m, by the rule {rule}"], radii.index(chosen)
        for words, k in (("next smaller", index - 1), ("next larger", index + 1)):
            if not 0 <= k < len(radii):
                sentences.append(f"{words}: none was run; beyond the end of the radii the rule may choose another one")
                continue
            missed = "; ".join(bound.worst(of[radii[k]]) for bound, of in misses.items() if radii[k] in of)
            sentences.append(
                f"{words}, {radii[k]:g} m: {missed or f'serves, too: {_changes(study, chosen, radii[k])}'}"
            )
    for bound, of in misses.items():
        keep = [f"{radius:g}" for radius in radii if radius not in of]
        sentences.append(f"{bound} at every speed: {', '.join(keep) + ' m' if keep else 'no radius'}")
    if study["rpm"].nunique() > 1:
        alone = {rpm: rule.radius(rows) for rpm, rows in study.groupby("rpm")}
        each = (f"{rpm:g} rpm {f'{of:g} m' if of == of else 'none'}" for rpm, of in alone.items())
        sentences.append(f"at one speed alone: {', '.join(each)}")
    return sentences


def _changes(study: pd.DataFrame, chosen: float, other: float) -> str:
    """What another ring changes, over all speeds."""
    columns = ["left_share_pct", "right_share_pct", "left_rms_n", "ring_rms_n"]
    rows = study.set_index(["ring_radius_m", "rpm"])[columns]
    change = rows.loc[other] - rows.loc[chosen]
    ranges = [f"{heading(name)} {change[name].min():+.2g} to {change[name].max():+.2g}" for name in columns]
    return ", ".join(ranges)

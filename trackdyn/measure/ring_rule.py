"""Which ring serves: bounds of contact measures at every speed, and the choice among the radii that keep them."""

import re
from typing import NamedTuple

import pandas as pd

from trackdyn.errors import InputError, shown
from trackdyn.measure.columns import OF_A_SIDE, PLACES, error_of, heading
from trackdyn.measure.contacts import TOUCHING

NEAR_LEAST = 2.0  # points of a turn: how near the least left contact a ring that serves must come (claim C26)
# ours; the paper states none
RULE = f"right_share_pct < {TOUCHING:g}, left_share_pct <= least + {NEAR_LEAST:g}, smallest"
COLUMNS = ("rms_g", "sd_g", *(f"{side}_{name}" for side in PLACES for name, (*_, error) in OF_A_SIDE.items() if error))
_KNOWN = f"rms_g, sd_g, or left_, right_ or ring_ with {', '.join(name for name, of in OF_A_SIDE.items() if of[2])}"
_BOUND = re.compile(r"(\w+)\s*(<=?|>=?)\s*(?:(least)\s*\+\s*)?(-?\d+\.?\d*(?:e-?\d+)?)")


class Bound(NamedTuple):
    """What a measure must keep at every speed."""

    column: str
    sign: str
    number: float
    over_least: bool  # counted from the least value of all rings at the speed

    def __str__(self) -> str:
        return f"{self.column} {self.sign} {'least + ' * self.over_least}{self.number:g}"

    def limit(self, values: pd.Series) -> float:
        """The bound at a speed of which ``values`` are those of all rings."""
        return self.number + (float(values.min()) if self.over_least else 0.0)

    def kept(self, value: float, limit: float) -> bool:
        """Whether a value keeps the bound; one that is not known (NaN) does not."""
        return {"<": value < limit, "<=": value <= limit, ">": value > limit, ">=": value >= limit}[self.sign]


class Miss(NamedTuple):
    """A bound that a ring does not keep at a speed (rev/min)."""

    bound: Bound
    rpm: float
    value: float
    error: float
    limit: float

    def __str__(self) -> str:
        if self.value != self.value:
            return f"{heading(self.bound.column)} at {self.rpm:g} rpm is not known"
        error = f" +- {self.error:.2g}" if self.error == self.error and self.error else ""
        return (
            f"{heading(self.bound.column)} at {self.rpm:g} rpm is {self.value:.4g}{error}, "
            f"must be {self.bound.sign} {self.limit:.4g}"
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

    def misses(self, study: pd.DataFrame) -> dict[float, list[Miss]]:
        """What every radius (m) of a study misses; an empty list: it serves."""
        rings = study.dropna(subset="ring_radius_m").sort_values(["ring_radius_m", "rpm"])
        found: dict[float, list[Miss]] = {float(radius): [] for radius in rings["ring_radius_m"].unique()}
        for bound in self.bounds:
            for rpm, rows in rings.groupby("rpm"):
                limit, error = bound.limit(rows[bound.column]), error_of(bound.column) or ""
                for row in rows.to_dict("records"):
                    if not bound.kept(value := row[bound.column], limit):
                        miss = Miss(bound, float(rpm), value, row.get(error, float("nan")), limit)
                        found[row["ring_radius_m"]].append(miss)
        return found

    def radius(self, study: pd.DataFrame) -> float:
        """The radius to choose, m; NaN if none serves. ``study`` has a row a radius and speed, columns of metrics."""
        serving = [radius for radius, missed in self.misses(study).items() if not missed]
        if not serving or self.choice in ("smallest", "largest"):
            return {"smallest": min, "largest": max}.get(self.choice, min)(serving, default=float("nan"))
        rows = study[study["ring_radius_m"].isin(serving)]
        return float(rows.groupby("ring_radius_m")[self.choice].max().idxmin())


def parse_rule(text: str) -> RingRule:
    """A rule such as `RULE`: bounds, then the choice, with commas between. Raises `InputError`: it cannot be read."""
    *terms, last = [part.strip() for part in text.split(",")]
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
    misses, chosen = rule.misses(study), rule.radius(study)
    radii, found = list(misses), ["no radius of these serves at every speed"]
    if chosen == chosen:
        found, place = [f"choose {chosen:g} m, by the rule {rule}"], radii.index(chosen)
        for words, k in (("next smaller", place - 1), ("next larger", place + 1)):
            if not 0 <= k < len(radii):
                found.append(f"{words}: none was run; beyond the end of the radii the rule may choose another one")
            else:
                missed = _worst(misses[radii[k]]) or f"serves, too: {_changes(study, chosen, radii[k])}"
                found.append(f"{words}, {radii[k]:g} m: {missed}")
    for bound in rule.bounds:
        keep = [f"{radius:g}" for radius, missed in misses.items() if all(miss.bound != bound for miss in missed)]
        found.append(f"{bound} at every speed: {', '.join(keep) + ' m' if keep else 'no radius'}")
    if study["rpm"].nunique() > 1:
        alone = {rpm: rule.radius(rows) for rpm, rows in study.groupby("rpm")}
        each = (f"{rpm:g} rpm {f'{of:g} m' if of == of else 'none'}" for rpm, of in alone.items())
        found.append(f"at one speed alone: {', '.join(each)}")
    return found


def _worst(missed: list[Miss]) -> str:
    """Of every bound that is missed the speed at which it is missed by most, and at how many others it is, too."""
    found = []
    for bound in dict.fromkeys(miss.bound for miss in missed):
        speeds = [miss for miss in missed if miss.bound == bound]
        worst = max(speeds, key=lambda miss: abs(miss.value - miss.limit))
        others = f", and at {len(speeds) - 1} more of the speeds" if len(speeds) > 1 else ""
        found.append(f"{worst}{others}")
    return "; ".join(found)


def _changes(study: pd.DataFrame, chosen: float, other: float) -> str:
    """What another ring changes, over all speeds."""
    columns = ["left_share_pct", "right_share_pct", "left_rms_n", "ring_rms_n"]
    rows = study.set_index(["ring_radius_m", "rpm"])[columns]
    change = rows.loc[other] - rows.loc[chosen]
    ranges = [f"{heading(name)} {change[name].min():+.2g} to {change[name].max():+.2g}" for name in columns]
    return ", ".join(ranges)

"""Unknown parameters of a rig: what each can be, the source of that range, and the way from the unit cube to rigs."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from trackdyn.errors import InputError, TrackdynError
from trackdyn.rig.layout import can_close
from trackdyn.rig.rig import Rig, parameter_table
from trackdyn.rig.validation import Section, plain_number, shown

# how far from its bounds a value may be rounded, as a share of the range
EDGE = 1e-9


class Unknown(Section):
    """A parameter that is not known.

    Attributes
    ----------
    names : list of str
        Fields of the rig by dotted name (`Rig.value`) that share the value.
    low, high : float or None
        Its range; the one in the rig's file where it is not given.
    ranges : list of pairs
        Several ranges instead of one, such as the readings of a printed number; each is as likely as it is wide.
    scale : str
        ``linear`` or ``log``: in what the unknown is evenly spread.
    of : str or None
        The value is a ratio to this other field of the rig.
    source : str
        Where the range comes from; the words in the rig's file where it is not given.
    """

    names: Annotated[list[str], Field(min_length=1)]
    low: float | None = None
    high: float | None = None
    ranges: list[Annotated[list[float], Field(min_length=2, max_length=2)]] = Field(default_factory=list)
    scale: Literal["linear", "log"] = "linear"
    of: str | None = None
    source: str = ""

    @model_validator(mode="after")
    def _complete(self):
        for low, high in self.intervals:
            if not low < high or (self.scale == "log" and not low > 0):
                positive = " and above 0" if self.scale == "log" else ""
                raise InputError(f"unknown {self.label}: range {low:g} to {high:g}: bounds must be rising{positive}")
        return self

    @property
    def label(self) -> str:
        """Its first field."""
        return self.names[0]

    @property
    def intervals(self) -> list[tuple[float, float]]:
        """Ranges of a number; none as long as the rig's file is to give them."""
        if self.ranges:
            return [(low, high) for low, high in self.ranges]
        return [(self.low, self.high)] if self.low is not None and self.high is not None else []

    def _edges(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower ends in the scale, and where on 0 to 1 each interval begins and the last one ends."""
        ends = np.array(self.intervals, dtype=float)
        ends = np.log(ends) if self.scale == "log" else ends
        width = ends[:, 1] - ends[:, 0]
        return ends[:, 0], np.concatenate([[0.0], np.cumsum(width) / width.sum()])

    def value(self, x: float) -> float:
        """Value at a position of 0 to 1 in the range."""
        low, begins = self._edges()
        ends = np.array(self.intervals, dtype=float)
        k = int(np.clip(np.searchsorted(begins, x, side="right") - 1, 0, len(low) - 1))
        share = (x - begins[k]) / (begins[k + 1] - begins[k])
        if self.scale == "log":
            return float(ends[k, 0] * (ends[k, 1] / ends[k, 0]) ** share)
        return float(ends[k, 0] + share * (ends[k, 1] - ends[k, 0]))

    def position(self, value: float) -> float:
        """Position of a value; NaN for one outside all ranges."""
        _, begins = self._edges()
        for k, (low, high) in enumerate(self.intervals):
            scaled = np.log([low, high, value]) if self.scale == "log" and value > 0 else np.array([low, high, value])
            share = (scaled[2] - scaled[0]) / (scaled[1] - scaled[0])
            if -EDGE <= share <= 1 + EDGE:
                return float(begins[k] + np.clip(share, 0, 1) * (begins[k + 1] - begins[k]))
        return float("nan")

    def inside(self, value: float) -> float:
        """The value, or the end of the ranges that is nearest to it."""
        ends = [end for interval in self.intervals for end in interval]
        return min(ends, key=lambda end: abs(end - value)) if np.isnan(self.position(value)) else value


class Unknowns:
    """Unknowns of a rig in a fixed order: d of them, so that a rig is a point of the d-dimensional unit cube.

    Parameters
    ----------
    unknowns : sequence of Unknown
        A ratio comes behind what it is a ratio to.
    rig : Rig
        Everything else.
    ranges : mapping
        ``section.field`` to low, high and source, for unknowns without a range (`file_ranges`).

    Raises
    ------
    InputError
        One sentence: a field that the rig does not have, one that occurs twice, one without a range.
    """

    def __init__(self, unknowns, rig: Rig, ranges: Mapping[str, tuple[float, float, str]] | None = None):
        ranges = dict(ranges or {})
        self.rig = rig
        self.unknowns: list[Unknown] = []
        names: set[str] = set()
        for unknown in unknowns:
            for name in (*unknown.names, *filter(None, [unknown.of])):
                _number(rig, name, unknown.label)
            for name in unknown.names:
                if name in names:
                    raise InputError(f"unknown {name}: occurs twice; keep one of them")
                names.add(name)
            self.unknowns.append(_ranged(unknown, ranges))

    def __len__(self) -> int:
        return len(self.unknowns)

    @property
    def labels(self) -> list[str]:
        """Name of every unknown."""
        return [unknown.label for unknown in self.unknowns]

    def values(self, x) -> dict[str, float]:
        """Value of every unknown at a (d,) point of the unit cube, by label; `InputError` for one outside of it."""
        x = np.asarray(x, dtype=float)
        if x.shape != (len(self),) or not ((x >= 0) & (x <= 1)).all():
            raise InputError(f"x = {shown(x.tolist())}: must be {len(self)} numbers between 0 and 1")
        return {
            unknown.label: unknown.value(float(coordinate))
            for unknown, coordinate in zip(self.unknowns, x, strict=True)
        }

    def position(self, values: Mapping[str, float]) -> np.ndarray:
        """(d,) point of the unit cube for values by label; NaN where one lies outside its range."""
        return np.array([unknown.position(values[unknown.label]) for unknown in self.unknowns])

    def changes(self, values: Mapping[str, float]) -> dict[str, float]:
        """Fields of the rig (``section.field``) that values by label set."""
        fields: dict[str, float] = {}
        for unknown in self.unknowns:
            base = unknown.of
            factor = 1.0 if base is None else fields[base] if base in fields else _number(self.rig, base, base)
            fields |= dict.fromkeys(unknown.names, float(values[unknown.label]) * factor)
        return fields

    def to_rig(self, x) -> Rig:
        """The rig at a point of the unit cube."""
        return self.rig.changed(**self.changes(self.values(x)))

    def near(self, values: Mapping[str, float], factors) -> Rig:
        """The rig with every unknown of ``values`` by label times its factor, within its range; readings of a printed
        number (``ranges``) stay.
        """
        pairs = zip(self.unknowns, factors, strict=True)
        moved = {
            unknown.label: unknown.inside(values[unknown.label] * factor)
            for unknown, factor in pairs
            if not unknown.ranges
        }
        return self.rig.changed(**self.changes({**values, **moved}))

    def of_rig(self, rig: Rig) -> dict[str, float]:
        """Value of every unknown in a rig, by label."""
        values = {}
        for unknown in self.unknowns:
            value = _number(rig, unknown.names[0], unknown.label)
            values[unknown.label] = value / _number(rig, unknown.of, unknown.label) if unknown.of else value
        return values


def buildable(unknowns: Unknowns, x) -> bool:
    """Whether there is a rig at a point: its groove can be cut, its loop closes around its wheels."""
    try:
        return can_close(unknowns.to_rig(x))
    except TrackdynError:
        return False


def file_ranges(path: Path | str) -> dict[str, tuple[float, float, str]]:
    """``section.field`` of a rig's file to low, high and the source of the range, where it has one."""
    table = parameter_table(path).dropna(subset=["low", "high"])
    message = table["source"].str.rpartition("range:")[2].str.strip()
    rows = zip(table["name"], table["low"], table["high"], message, strict=True)
    return {name: (float(low), float(high), source) for name, low, high, source in rows}


def _ranged(unknown: Unknown, ranges: Mapping[str, tuple[float, float, str]]) -> Unknown:
    """The unknown with what is known of its range from the rig's file."""
    if unknown.intervals:
        return unknown
    if unknown.of or unknown.names[0] not in ranges:
        raise InputError(f"unknown {unknown.label}: has no range; give low and high, here or in the rig's file")
    low, high, source = ranges[unknown.names[0]]
    fields = unknown.model_dump() | {"low": low, "high": high, "source": unknown.source or source}
    return Unknown(**fields)


def _number(rig: Rig, name: str, label: str) -> float:
    """Value of a field that is a number."""
    try:
        value = rig.value(name)
        return plain_number(value)
    except InputError as error:
        raise InputError(f"unknown {shown(label)}: {error}") from None
    except ValueError:
        raise InputError(f"unknown {label}: {name} = {shown(value)} is not a number") from None

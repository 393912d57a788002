"""Unknown parameters of a rig: the range of each, and the way from the unit cube to rigs."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from trackdyn.inputs.errors import InputError, naming
from trackdyn.inputs.validation import Section
from trackdyn.rig.rig import Rig, parameter_table

# how far from its bounds a value may be rounded, as a share of the range
EDGE = 1e-9


class Unknown(Section):
    """An unknown parameter: its range, and the scale on which it is evenly spread."""

    names: Annotated[list[str], Field(min_length=1)]  # fields of the rig by dotted name that share the value
    low: float | None = None  # None: as in the rig's file
    high: float | None = None
    scale: Literal["linear", "log"] = "linear"
    of: str | None = None  # another field of the rig, of which the value is a share
    source: str = ""  # of the range

    @model_validator(mode="after")
    def _complete(self):
        own = self.low is not None and self.high is not None
        if own and (not self.low < self.high or (self.scale == "log" and not self.low > 0)):
            positive = " and above 0" if self.scale == "log" else ""
            message = f"range {self.low:g} to {self.high:g}: bounds must be rising{positive}"
            raise InputError(f"unknown {self.label}: {message}")
        return self

    @property
    def label(self) -> str:
        """Its first field."""
        return self.names[0]

    def value(self, x: float) -> float:
        """Return the value at a position of 0 to 1 in the range."""
        if self.scale == "log":
            return float(self.low * (self.high / self.low) ** x)
        return float(self.low + x * (self.high - self.low))

    def position(self, value: float) -> float:
        """Return the position of a value; NaN for one outside the range."""
        low, high = self.low, self.high
        if self.scale == "log" and value > 0:
            low, high, value = np.log([low, high, value])
        x = (value - low) / (high - low)
        return float(np.clip(x, 0, 1)) if -EDGE <= x <= 1 + EDGE else float("nan")


class Unknowns:
    """Unknowns of a rig in a fixed order, a ratio after its denominator: a rig is a point of a unit cube.

    ``ranges`` (`file_ranges`) are those of unknowns that state none.
    """

    def __init__(self, unknowns: Iterable[Unknown], rig: Rig, ranges: Mapping[str, tuple[float, float]]):
        self.rig = rig
        self.unknowns: list[Unknown] = []
        names: set[str] = set()
        for unknown in unknowns:
            for name in (*unknown.names, *filter(None, [unknown.of])):
                with naming(f"unknown {unknown.label}"):
                    rig.value(name)
            for name in unknown.names:
                if name in names:
                    raise InputError(f"unknown {name}: occurs twice; keep one of them")
                names.add(name)
            if unknown.low is None or unknown.high is None:
                if unknown.of or unknown.label not in ranges:
                    problem = "has no range; give low and high, here or in the rig's file"
                    raise InputError(f"unknown {unknown.label}: {problem}")
                low, high = ranges[unknown.label]
                unknown = Unknown(**unknown.model_dump() | {"low": low, "high": high})
            self.unknowns.append(unknown)

    @property
    def labels(self) -> list[str]:
        """Name of every unknown."""
        return [unknown.label for unknown in self.unknowns]

    def values(self, x) -> dict[str, float]:
        """Return the value of every unknown at a (d,) point of the unit cube, by label."""
        pairs = zip(self.unknowns, x, strict=True)
        return {unknown.label: unknown.value(float(coordinate)) for unknown, coordinate in pairs}

    def changes(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return the fields of the rig (``section.field``) that values by label set."""
        fields: dict[str, float] = {}
        for unknown in self.unknowns:
            base = unknown.of
            factor = 1.0 if base is None else fields[base] if base in fields else self.rig.value(base)
            fields |= dict.fromkeys(unknown.names, float(values[unknown.label]) * factor)
        return fields


def file_ranges(path: Path | str) -> dict[str, tuple[float, float]]:
    """Return low and high of the fields (``section.field``) of a rig's file that have them."""
    table = parameter_table(path).dropna(subset=["low", "high"])
    return {row.name: (float(row.low), float(row.high)) for row in table.itertuples(index=False)}

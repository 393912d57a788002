"""Meaning of the columns of a sensor's file: the mapping that a user states, and the names of the columns."""

import re
import unicodedata
from collections.abc import Iterable, Sequence
from contextlib import suppress
from itertools import zip_longest
from math import isfinite
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, get_args

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, model_validator

from trackdyn.inputs.errors import InputError, shown
from trackdyn.inputs.validation import Finite, NotNegative, Positive, Section, parse_number, typed, validated
from trackdyn.inputs.yaml_file import read_yaml

RATES = (100.0, 1_000_000.0)  # Hz, of any record, whatever states its rate
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
Axis = Literal["ax", "ay", "az"]
AXES: tuple[Axis, ...] = get_args(Axis)
_PER_S2 = ("{}/s2", "{}/s/s", "{}_s2", "{}s-2", "{}.s-2", "{}s2", "{}ps2", "{}/sec2")
_ACCELERATION = {"g": "g", "gn": "g", "mg": "mg", "gal": "cm/s2"} | {
    form.format(length): f"{length}/s2" for length in ("m", "cm", "mm") for form in _PER_S2
}
TIMES = {"\N{GREEK SMALL LETTER MU}s": "us"} | {
    name: unit
    for unit, names in {
        "s": "s sec secs second seconds", "ms": "ms msec msecs millis millisec millisecond milliseconds",
        "us": "us usec usecs micros microsec microsecond microseconds",
        "ns": "ns nsec nsecs nanos nanosec nanosecs nanosecond nanoseconds",
    }.items()
    for name in names.split()
}  # fmt: skip
_UNIT = "|".join(map(re.escape, sorted(_ACCELERATION | TIMES, key=len, reverse=True)))
# number and unit
_IN_CELL = re.compile(rf"([+-]? ?[\d.,'\u2019\u2009 ]+(?:e[+-]?\d+)?) ?({_UNIT})", re.IGNORECASE)
# name of a column of whole units of a time that is split, such as secs and nsecs
_TIME_PART = re.compile(rf"(.*?)({'|'.join(sorted(TIMES, key=len, reverse=True))})")
_IN_BRACKETS = re.compile(r"(.*?)\s*[\[(](?!\d+[\])])((?:[^\[\]()]|\([^()]*\))*)[\])]")
_AT_THE_END = re.compile(rf"(.+?)(?<![\s_/,:])[\s_/,:]+({_UNIT})")
_AXIS_NAME = re.compile(r"(?:a|acc|accel|acceleration|accelerometer)[\s_.-]*([xyz])")
UNITS = _ACCELERATION | dict.fromkeys(("counts", "count", "raw", "lsb", "digits"), "counts")
_TIME_NAME = re.compile(r"t|(?:date[\s_-]?)?time|time[\s_-]?stamps?|elapsed[\s_-]?time")
_TIME_WORDS = re.compile(
    "time|stamp|zeit|temps|tiempo|tempo|tijd|tid|clock|date|datum|seconds|x_value|\N{CJK UNIFIED IDEOGRAPH-6642}"
)
Name = Annotated[str, BeforeValidator(lambda value: str(value) if type(value) is int else value), Field(min_length=1)]


def _degrees(value: float | str) -> float:
    """Return an angle in deg, of 44 or 44deg. Raises `InputError`: it is not an angle."""
    with suppress(ValueError):
        if isfinite(angle := parse_number(re.sub(r"\s*(deg|\N{DEGREE SIGN})$", "", str(value)))):
            return angle
    raise InputError(f"turn = {shown(value)}: must be an angle in deg, such as 44deg")


class SensorMapping(Section):
    """Facts that a sensor's file does not state: the options of ``trackdyn compare``, or a small YAML file."""

    model_config = ConfigDict(populate_by_name=True)

    time: Name | None = Field(
        None, description="Column of the time stamps, or none: the rows are evenly timed (with a rate)."
    )
    rate: Annotated[float, Field(ge=RATES[0], le=RATES[1])] | None = Field(
        None, description="Samples per second, Hz; from the stamps by default."
    )
    unit: Literal["g", "mg", "m/s2", "cm/s2", "mm/s2"] | None = Field(
        None, description="Unit of ay and of columns of its unit, g, mg, m/s2, cm/s2 or mm/s2; the header's by default."
    )
    axes: dict[Axis, Name] = Field(
        default_factory=dict,
        description=(
            "Column of an axis by its name or number from 1 (#3 where a name is a number, too), such as ay=channel3; a "
            "minus in front, ay=-channel3, flips its sign."
        ),
    )
    range: Positive | None = Field(None, description="Range of the sensor, g; the rig's by default.")
    scale: Positive | None = Field(
        None, description="Units of the file per g, such as counts or mV, of ay and of columns of its unit."
    )
    zero: dict[Axis, Finite] | Finite = Field(
        0.0, description="Value of the file that is 0 g, of ay and of columns of its unit, 512, or of an axis, ay=512."
    )
    turn: Annotated[float | str, AfterValidator(_degrees)] = Field(
        0.0,
        description="Angle about z by which ax and ay are turned, from x towards y, such as 44deg; none by default.",
    )
    bits: Annotated[int, Field(ge=8, le=32)] | None = Field(
        None, description="Bits of raw counts whose full scale is the range, instead of a scale."
    )
    resample: bool = Field(False, description="Interpolate samples with jittery time stamps to a constant rate.")
    gaps: Literal["bridge", "longest"] | None = Field(
        None, description="bridge: interpolate over few lost samples; longest: keep the longest part without a gap."
    )
    start: NotNegative = Field(0.0, alias="from", description="First instant to keep, s since the first row.")
    to: Positive | None = Field(None, description="Last instant to keep, s since the first row.")
    group: Name | None = Field(
        None,
        description=(
            "Prefix of the columns, such as front in front/ay; or, where a column names the sensor of each row, that "
            "name, such as ACC or node=2; or none: all rows are of one sensor."
        ),
    )
    sensors: dict[str, "SensorMapping"] = Field(
        default_factory=dict,
        description="Keys of each sensor of the rig, by its name; keys outside hold for all of them.",
    )

    @model_validator(mode="before")
    @classmethod
    def _complete(cls, data: Any) -> Any:
        """Add the common keys to the mapping of each sensor."""
        if not isinstance(data, dict) or not isinstance(sensors := data.get("sensors"), dict):
            return data
        common = {name: value for name, value in data.items() if name != "sensors"}
        return data | {"sensors": {name: _on_top(common, own) for name, own in sensors.items()}}

    @model_validator(mode="after")
    def _consistent(self):
        if self.to is not None and self.to <= self.start:
            raise InputError(f"to = {self.to:g}: must be after from = {self.start:g}")
        if self.time == "none" and self.rate is None:
            raise InputError("time = none needs a rate in Hz, such as rate 1000")
        if any(own.sensors for own in self.sensors.values()):
            raise InputError("sensors: must not be in the mapping of a sensor; list all sensors on one level")
        if self.bits and not self.range:
            raise InputError(f"bits = {self.bits} needs the range in g that they span, such as range 16")
        if self.counts_per_g and (self.unit or (self.scale and self.bits)):
            raise InputError("scale, bits and unit all state the unit of a column; give one of them")
        return self

    def of_sensors(self, names: Iterable[str], path: Path | str, only: str | None = None) -> dict[str, "SensorMapping"]:
        """Return the mapping of each sensor of a rig, or of the ``only`` one that is compared; or `InputError`."""
        names = list(names)
        compared = names if only is None else [only]
        if not self.sensors and len(compared) == 1:
            return {compared[0]: self}
        if only not in self.sensors if only else self.sensors.keys() != set(names):
            mapped = f"those of {', '.join(self.sensors)}" if self.sensors else "the columns of one"
            of_rig = f"the rig has {len(names)} sensor{'s' * (len(names) > 1)}, {', '.join(names)}"
            remedy = f"write sensors: {{{names[0]}: {{group: NAME}}, ...}} into the mapping, one group per sensor, or"
            raise InputError(f"{path}: {of_rig}, and the mapping names {mapped}; {remedy} name the sensor to compare")
        return {name: self.sensors[name] for name in compared}

    @property
    def counts_per_g(self) -> float | None:
        """Units of the file per g; None if none are stated."""
        return 2.0 ** (self.bits - 1) / self.range if self.bits and self.range else self.scale


def _on_top(common: Any, own: Any) -> Any:
    """Merge the keys of ``own`` into ``common``, axis by axis; validation refuses any that are not mappings."""
    if not (isinstance(common, dict) and isinstance(own, dict)):
        return own if isinstance(common, dict) else common
    axes = common.get("axes", {}), own.get("axes", {})
    both = {"axes": axes[0] | axes[1]} if all(isinstance(pairs, dict) for pairs in axes) else {}
    return common | own | both


@typed
def load_mapping(path: Path | str | None = None, **options: Any) -> SensorMapping:
    """Read a mapping from a YAML file, or `InputError`; options other than None, empty or False replace its fields."""
    data = {} if path is None else read_yaml(path)
    if isinstance(data, dict):
        options = {name: value for name, value in options.items() if value not in (None, {}) and value is not False}
        data = _on_top(data, options)
        if isinstance(sensors := data.get("sensors"), dict):
            data["sensors"] = {name: _on_top(own, options) for name, own in sensors.items()}
    return validated(SensorMapping, data, "the options of the sensor" if path is None else str(path))


class Column(NamedTuple):
    """Column of a file: position, from 0, and name as written, which consists of ``base`` and unit."""

    position: int
    name: str
    base: str
    unit: str
    sign: int = 1  # -1: the values are negated

    @property
    def described(self) -> str:
        """Number, and name if that is another."""
        number = str(self.position + 1)
        return f"column {number}" if self.name == number else f"column {number} {shown(self.name)}"


def _plain(name: str) -> str:
    name = unicodedata.normalize("NFKC", name.strip("'\" ")).casefold().replace("\N{MINUS SIGN}", "-")
    return " ".join(name.split())


def _column(index: int, name: str, unit: str) -> Column:
    plain = _plain(name)
    match = _IN_BRACKETS.fullmatch(plain) or _AT_THE_END.fullmatch(plain.replace("^", "").replace("**", ""))
    base, own = (match[1], match[2]) if match else (plain, "")
    # of the name, and of the line or the cells below it
    name_unit, row_unit = (re.sub(r"[\s()\[\]^*\u00b7\u22c5]", "", text) for text in (own, _plain(unit)))
    known = [UNITS.get(unit, TIMES.get(unit)) for unit in (name_unit, row_unit)]
    contradict = all(known) and known[0] != known[1]
    return Column(index, name, base, f"{name_unit} and {row_unit}" if contradict else name_unit or row_unit)


def columns_of(names: Sequence[str], units: Sequence[str] = ()) -> list[Column]:
    """Return the columns of these names, with the units in the line below."""
    return [_column(k, *both) for k, both in enumerate(zip_longest(names, units, fillvalue=""))]


def is_unit(text: str) -> bool:
    """Return whether a field is the unit of an acceleration or of a time."""
    return _column(0, "", text).unit in UNITS | TIMES


def _position(name: str) -> int | None:
    """Return the position, from 0, of a column that is named by its number, ``3`` or ``#3``; else None."""
    number = re.fullmatch(r"#?([1-9]\d{0,3})", name, re.ASCII)
    return int(number[1]) - 1 if number else None


def named(columns: Sequence[Column], name: str) -> list[Column]:
    """List the columns of a name, with or without its unit, or of a number; ``#3`` is always the third."""
    position = _position(name)
    counted = [] if position is None else list(columns[position : position + 1])
    if name.startswith("#") and counted:
        return counted
    same = [c for c in columns if _plain(c.name) == _plain(name)] or [c for c in columns if c.base == _plain(name)]
    return counted + [column for column in same if column not in counted]


def stated_columns(mapping: SensorMapping) -> dict[str, str]:
    """Return the names of columns that a mapping states, by axis and ``time``."""
    return {**mapping.axes} | ({"time": mapping.time} if mapping.time not in (None, "none") else {})


def stated_positions(mapping: SensorMapping) -> dict[str, int]:
    """Return the positions of columns that a mapping chooses by number, from 0, by axis and ``time``."""
    positions = {key: _position(name.removeprefix("-")) for key, name in stated_columns(mapping).items()}
    return {key: position for key, position in positions.items() if position is not None}


def candidates(columns: Sequence[Column], mapping: SensorMapping) -> dict[str, list[Column]]:
    """Return the columns that may be ``time``, ``ax``, ``ay`` and ``az``, by the mapping or their names."""
    if mapping.group and (of_group := of_group_in(columns, mapping.group)):
        others = {c.position: c for c in columns if not _AXIS_NAME.fullmatch(c.base)}
        columns = [(others | of_group)[k] for k in sorted(others | of_group)]
    chosen, stated = {}, stated_columns(mapping)
    for key, name in stated.items():
        flipped = [column._replace(sign=-1) for column in named(columns, name[1:])] if name.startswith("-") else []
        chosen[key] = named(columns, name) or flipped
    used = {column.position for of_key in chosen.values() for column in of_key}
    for column in columns:
        letter, timed = _AXIS_NAME.fullmatch(column.base), mapping.time != "none"
        key = f"a{letter[1]}" if letter else "time" if timed and _TIME_NAME.fullmatch(column.base) else ""
        if key and key not in stated and column.position not in used:
            chosen.setdefault(key, []).append(column)
    return chosen


def is_header(names: Sequence[str], mapping: SensorMapping) -> bool:
    """Return whether names are a header; a line of a preamble may have enough fields for columns by number."""
    chosen, by_number = candidates(columns_of(names), mapping), "ay" in stated_positions(mapping)
    return bool(chosen.get("ay")) and (not by_number or all(map(chosen.get, stated_columns(mapping))))


def of_group_in(columns: Iterable[Column], group: str) -> dict[int, Column]:
    """Return the columns whose names begin with a group, by position and without this prefix."""
    prefix = re.compile(rf"{re.escape(_plain(group))}[\s/_.:-]+")
    matches = [(column, match) for column in columns if (match := prefix.match(column.base))]
    return {column.position: column._replace(base=column.base[match.end() :]) for column, match in matches}


def in_cell(cell: str) -> tuple[str, str]:
    """Split a cell into the text of a number and its unit; without a unit return the cell and an empty text."""
    if cell[-1:].isdecimal() and "s" not in cell:
        return cell, ""
    match = _IN_CELL.fullmatch(cell.replace("\N{SUPERSCRIPT TWO}", "2").replace("^", ""))
    return (match[1].rstrip(), match[2]) if match else (cell, "")


def time_like(columns: Sequence[Column]) -> list[Column]:
    """List the columns that may be the time by their names or units."""
    # words are apart: TempSensor has temp and sensor, no temps
    likely = [c for c in columns if _TIME_WORDS.search(re.sub(r"(?<=[a-z])(?=[A-Z])", " ", c.name).casefold())]
    likely += [column for column in columns if column.base in TIMES and column not in likely]
    return likely + [column for column in columns if column.unit in TIMES and column not in likely]


def parts_of_time(columns: Sequence[Column]) -> list[tuple[Column, str, str]]:
    """List the columns of a unit of time, such as ``secs`` and ``nsecs``: column, name before the unit, and unit."""
    parts = []
    for column in columns:
        if (match := _TIME_PART.fullmatch(column.base)) and not match[1][-1:].isalnum():
            parts.append((column, match[1], TIMES[match[2]]))
        elif column.unit in TIMES:
            parts.append((column, column.base, TIMES[column.unit]))
    return parts

"""Parameters of a rig: a value in its unit, with its kind and its source.

Each entry of a file is ``{value, unit, kind, source}``, in the unit that is named here: none is converted. The kind is
the origin of the number: ``printed`` in the paper (or another publication that the source names), ``derived`` from
printed numbers, ``assumed``, or ``fitted`` (the source states to which result).
"""

import re
from collections.abc import Iterator
from functools import cache
from types import NoneType
from typing import Annotated, Any, NamedTuple, get_args, get_origin

from pydantic import BeforeValidator, Field, GetCoreSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema

from trackdyn.inputs.errors import shown
from trackdyn.inputs.validation import Section, plain_count, plain_number
from trackdyn.inputs.yaml_file import ENTRY_KEYS, KINDS, RANGE_KEYS

NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")  # of a wheel or a sensor
WORD = "name"  # unit of values that are words
FROM_FILE = "from a file"  # entries of a file state their units, values in Python do not
LARGEST_VALUE = 1e20  # size of any value in its unit: squares and ratios of such values are still numbers
LEAST_VALUE = 1e-40  # size of any value that is not 0, for the same reason


def number_of(value: Any) -> float:
    """Return a number as a float; NaN for anything else."""
    try:
        return float("nan") if isinstance(value, (str, bool)) else float(value)
    except (TypeError, ValueError, OverflowError):  # an integer may have more digits than a number
        return float("nan")


def _rows(value: Any) -> tuple[tuple[float, ...], ...]:
    """Return a table of finite numbers, with rows of equal length."""
    rows = value if isinstance(value, (list, tuple)) else ()
    if not rows or not all(isinstance(row, (list, tuple)) and row for row in rows):
        raise ValueError(f"= {shown(value)}: must be a list of rows of numbers, such as [[0, 1], [2, 3]]")
    if len({len(row) for row in rows}) != 1:
        raise ValueError(f"= {shown(value)}: rows must have equal lengths")
    return tuple(tuple(plain_number(item) for item in row) for row in rows)


def entry_value(entry: Any, unit: str) -> Any:
    """Return the value of an entry of a file; `ValueError` names the key that is missing or wrong."""
    if not isinstance(entry, dict):
        quoted = f'"{unit}"' if "," in unit else unit  # YAML would end the value at the comma
        form = f"{{value: {shown(entry)}, unit: {quoted}, kind: assumed, source: ...}}"
        raise ValueError(f"= {shown(entry)} has no unit; write {form}")
    value = entry.get("value")
    if missing := ENTRY_KEYS - entry.keys():
        raise ValueError(f"lacks {', '.join(sorted(missing))}; every parameter has value, unit, kind and source")
    if unknown := entry.keys() - ENTRY_KEYS - {*RANGE_KEYS}:
        key = shown(next(iter(unknown)))
        raise ValueError(f"has the unknown key {key}; expected value, unit, kind, low, high, source")
    if entry.keys() & {*RANGE_KEYS} and not number_of(entry.get("low")) <= number_of(entry.get("high")):
        raise ValueError("needs low and high as rising numbers, or neither")
    # a short form without a unit is a word
    if unit != WORD and (entry["unit"] == WORD or isinstance(value, (bool, str))):
        raise ValueError(f"= {shown(value)}: must be a number{'' if unit == '1' else f' in {unit}'}")
    if str(entry["unit"]) != unit:
        raise ValueError(f"has the unit {shown(entry['unit'])}; it must be given in {unit!r}")
    if entry["kind"] not in KINDS:
        raise ValueError(f"has the kind {shown(entry['kind'])}; expected {', '.join(KINDS)}")
    if not isinstance(entry["source"], str) or not entry["source"].strip():
        raise ValueError("has no source; say in words where the number comes from")
    return value


class Quantity:
    """Unit and bounds of a parameter, as annotation of its type; a number is at most ``LARGEST_VALUE`` in size.

    ``Annotated[float, Quantity("N/m", gt=0)]`` is a required number, ``Annotated[float | None, ...]`` an optional one,
    ``Annotated[Table, Quantity("m, m, m, 1")]`` a table whose columns have these units.
    """

    def __init__(self, unit: str, **bounds: float):
        self.unit, self.bounds = unit, bounds

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        absent = NoneType in get_args(source)
        kind = next(variant for variant in get_args(source) if variant is not NoneType) if absent else source
        parse = {float: plain_number, int: plain_count, tuple: _rows}.get(get_origin(kind) or kind, lambda name: name)

        def unwrap(entry: Any, info: ValidationInfo) -> Any:
            if absent and entry is None:
                return None
            from_file = info.context is FROM_FILE or isinstance(entry, dict)  # else it is in this unit
            value = entry_value(entry, self.unit) if from_file else entry
            plain = parse(value)
            if parse is _rows and len(plain[0]) != (columns := self.unit.count(",") + 1):
                raise ValueError(f"= {shown(value)}: rows must have {columns} numbers each, in {self.unit}")
            if kind is float and 0.0 < abs(plain) < LEAST_VALUE:
                raise ValueError(f"= {shown(value)}: must be 0 or at least {LEAST_VALUE:g} in size")
            return plain

        bounds: dict[str, Any] = {"le": LARGEST_VALUE, "ge": -LARGEST_VALUE} if kind in (float, int) else {}
        field, unwrapped = Field(**bounds | self.bounds), BeforeValidator(unwrap)
        if absent:
            return handler.generate_schema(Annotated[Annotated[kind, field] | None, unwrapped])
        return handler.generate_schema(Annotated[kind, unwrapped, field])


Table = tuple[tuple[float, ...], ...]
Length = Annotated[float, Quantity("m", gt=0, le=1000)]
Position = Annotated[float, Quantity("m")]
Mass = Annotated[float, Quantity("kg", gt=0)]
Inertia = Annotated[float, Quantity("kg m2", gt=0)]
Tilt = Annotated[float, Quantity("deg", ge=-10, le=10)]
Slope = Annotated[float, Quantity("deg", gt=-90, lt=90)]
Friction = Annotated[float, Quantity("1", ge=0, le=2)]


class FieldValue(NamedTuple):
    """Value of a field, its unit (None for a section), and the keys that lead to it in the data of a rig."""

    value: Any
    unit: str | None
    keys: tuple[str, ...]


@cache
def _units(model: type[Section]) -> dict[str, str | None]:
    """Return the units of the fields of a type of section by name; None for a section in it."""
    return {
        name: next((item.unit for item in info.metadata if isinstance(item, Quantity)), None)
        for name, info in model.model_fields.items()
    }


def fields_of(section: Section, prefix: str = "", keys: tuple[str, ...] = ()) -> Iterator[tuple[str, FieldValue]]:
    """Yield fields and sections by dotted names; a wheel, a surface or a sensor is a section by its name."""
    for name, unit in _units(type(section)).items():
        value, here = getattr(section, name), (*keys, name)
        yield prefix + name, FieldValue(value, unit, here)
        if isinstance(value, Section):
            yield from fields_of(value, f"{prefix}{name}.", here)
        elif isinstance(value, dict):
            for key, entry in value.items():
                yield key, FieldValue(entry, None, (*here, key))
                yield from fields_of(entry, f"{key}.", (*here, key))


@cache
def possible_fields(model: type[Section], prefix: str = "") -> frozenset[str]:
    """Return all dotted names of fields in a section of this type, ``*`` for a wheel, a surface or a sensor."""
    names = {prefix + name for name, unit in _units(model).items() if unit}
    for name, info in model.model_fields.items():
        inner = "*." if get_origin(info.annotation) is dict else f"{prefix}{name}."
        for kind in get_args(info.annotation) or (info.annotation,):  # a section, or an optional one
            if isinstance(kind, type) and issubclass(kind, Section):
                names |= possible_fields(kind, inner)
    return frozenset(names)


def outside_range(entry: dict) -> str:
    """Return the side on which an entry's value leaves its range, ``below`` or ``above``; empty if within."""
    value, low, high = (number_of(entry.get(key)) for key in ("value", "low", "high"))
    return "below" if value < low else "above" if value > high else ""


def entries_of(data: dict, prefix: str = "") -> dict[str, dict]:
    """Return the entries of a rig file (`rig_file.read_rig`) by the names of their fields."""
    entries = {}
    for key, section in data.items():
        if "value" in section:
            entries[prefix + key] = section
        else:
            entries |= entries_of(section, prefix if key in ("wheels", "surfaces", "sensors") else f"{prefix}{key}.")
    return entries

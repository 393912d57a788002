"""A parameter of a rig: a value in a unit of its own, with its kind and its source.

Each entry of a file is ``{value, unit, kind, source}``. The unit must be the one named here: units are never
converted silently. The kind says where the number comes from: ``printed`` in the paper (or another publication that
the source names), ``derived`` from printed numbers, ``assumed``, or ``fitted`` (its source says to what).
"""

import re
from collections.abc import Iterator
from difflib import get_close_matches
from types import NoneType
from typing import Annotated, Any, NamedTuple, get_args, get_origin

from pydantic import BeforeValidator, Field, GetCoreSchemaHandler, ValidationInfo
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema

from trackdyn.errors import InputError, shown
from trackdyn.rig.validation import Section, plain_count, plain_number
from trackdyn.rig.yaml_file import ENTRY_KEYS, KINDS

RANGE_KEYS = {"low", "high"}  # range that a real part can have, of a value that is assumed or fitted
WORDS = ("name",)  # units of values that are words
FROM_FILE = "from a file"  # there every entry states its unit, in Python none does
# bounds as pydantic puts them into a schema behind a validator of our own, and as JSON Schema writes them
BOUNDS = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}
LARGEST = 1e20  # size of any value in its unit: squares and ratios of such values are still numbers
LEAST = 1e-40  # size of any value that is not 0, for the same reason


def number_of(value: Any) -> float:
    """A number as a float; NaN for anything else."""
    try:
        return float("nan") if isinstance(value, (str, bool)) else float(value)
    except (TypeError, ValueError, OverflowError):  # an integer may have more digits than a number
        return float("nan")


def _rows(value: Any) -> tuple[tuple[float, ...], ...]:
    """A table of finite numbers, its rows of one length."""
    if (
        not isinstance(value, (list, tuple))
        or not value
        or not all(isinstance(row, (list, tuple)) and row for row in value)
    ):
        raise ValueError(f"= {shown(value)}: must be a list of rows of numbers, such as [[0, 1], [2, 3]]")
    rows = tuple(tuple(plain_number(item) for item in row) for row in value)
    if len({len(row) for row in rows}) != 1:
        raise ValueError(f"= {shown(value)}: rows must have equal lengths")
    return rows


def _unwrap(unit: str, kind: type, absent: bool = False):
    def unwrap(entry: Any, info: ValidationInfo) -> Any:
        if absent and entry is None:
            return None
        if isinstance(entry, dict):
            value = _value(entry, unit)
        elif info.context is FROM_FILE:
            raise ValueError(
                f"= {shown(entry)} has no unit; write {{value: {shown(entry)}, unit: "
                + (f'"{unit}"' if "," in unit else unit)  # YAML would end the value at the comma
                + ", kind: assumed, source: ...}"
            )
        else:  # from Python, already in the right unit
            value = entry
        plain = {float: plain_number, int: plain_count, tuple: _rows}.get(kind, lambda name: name)(value)
        if kind is tuple and len(plain[0]) != (columns := unit.count(",") + 1):
            raise ValueError(f"= {shown(value)}: rows must have {columns} numbers each, in {unit}")
        if kind is float and 0.0 < abs(plain) < LEAST:
            raise ValueError(f"= {shown(value)}: must be 0 or at least {LEAST:g} in size")
        return plain

    return BeforeValidator(unwrap)


def _value(entry: dict, unit: str) -> Any:
    """Value of an entry of the file, whose other keys are checked."""
    if missing := ENTRY_KEYS - entry.keys():
        raise ValueError(f"lacks {', '.join(sorted(missing))}; every parameter has value, unit, kind and source")
    if unknown := entry.keys() - ENTRY_KEYS - RANGE_KEYS:
        raise ValueError(
            f"has the unknown key {shown(next(iter(unknown)))}; expected value, unit, kind, low, high, source"
        )
    if RANGE_KEYS & entry.keys() and not number_of(entry.get("low")) <= number_of(entry.get("high")):
        raise ValueError("needs low and high as rising numbers, or neither")
    if entry["unit"] == "name" and unit not in WORDS:  # a short form that is no number with a unit
        raise ValueError(f"= {shown(entry['value'])}: must be a number{_in(unit)}")
    if str(entry["unit"]) != unit:
        raise ValueError(f"has the unit {shown(entry['unit'])}; it must be given in {unit!r}")
    if entry["kind"] not in KINDS:
        raise ValueError(f"has the kind {shown(entry['kind'])}; expected {', '.join(KINDS)}")
    if not isinstance(entry["source"], str) or not entry["source"].strip():
        raise ValueError("has no source; say in words where the number comes from")
    value = entry["value"]
    if isinstance(value, bool) or (isinstance(value, str) and unit not in WORDS):
        raise ValueError(f"= {shown(value)}: must be a number{_in(unit)}")
    return value


def _in(unit: str) -> str:
    return "" if unit == "1" else f" in {unit}"


class Quantity:
    """Unit and bounds of a parameter, behind its Python type; a number is at most ``LARGEST`` in size.

    ``Annotated[float, Quantity("N/m", gt=0)]`` is a number that must be there, ``Annotated[float | None, ...]`` one
    that may be left out, ``Annotated[Table | None, Quantity("s, N")]`` a table whose columns have these units.
    """

    def __init__(self, unit: str, **bounds: float):
        self.unit, self.bounds = unit, bounds

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        absent = NoneType in get_args(source)
        kind = next(variant for variant in get_args(source) if variant is not NoneType) if absent else source
        unwrap = _unwrap(self.unit, get_origin(kind) or kind, absent)
        bounds: dict[str, Any] = {"le": LARGEST, "ge": -LARGEST} if kind in (float, int) else {}
        field = Field(**bounds | self.bounds)
        if absent:
            return handler.generate_schema(Annotated[Annotated[kind, field] | None, unwrap])
        return handler.generate_schema(Annotated[kind, unwrap, field])

    def __get_pydantic_json_schema__(self, core_schema: Any, handler: Any) -> dict:
        """In the schema for editors a parameter is what stands in the file: value, unit, kind and source."""
        word, number = {"type": "string", "pattern": r"\S"}, {"type": "number"}
        value = {BOUNDS.get(key, key): bound for key, bound in handler(core_schema).items()}
        entry = {"value": value, "unit": {"const": self.unit}, "kind": {"enum": list(KINDS)}, "source": word}
        return {
            "type": "object",
            "properties": entry | dict.fromkeys(sorted(RANGE_KEYS), number),
            "required": sorted(ENTRY_KEYS),
            "dependentRequired": {"low": ["high"], "high": ["low"]},
            "additionalProperties": False,
        }


Table = tuple[tuple[float, ...], ...]
Length = Annotated[float, Quantity("m", gt=0, le=1000)]
Position = Annotated[float, Quantity("m")]
Mass = Annotated[float, Quantity("kg", gt=0)]
Inertia = Annotated[float, Quantity("kg m2", gt=0)]
Tilt = Annotated[float, Quantity("deg", ge=-10, le=10)]
Slope = Annotated[float, Quantity("deg", gt=-90, lt=90)]
Friction = Annotated[float, Quantity("1", ge=0, le=2)]
RollingArm = Annotated[float, Quantity("m", ge=0, le=1)]


NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")  # a wheel or a sensor may have it


class FieldValue(NamedTuple):
    """Value of a field and its unit."""

    value: Any
    unit: str


def _unit(info: FieldInfo) -> str | None:
    """Unit of a field; None for a section."""
    return next((item.unit for item in info.metadata if isinstance(item, Quantity)), None)


def fields_of(section: Section, prefix: str = "") -> Iterator[tuple[str, FieldValue]]:
    """Name, value and unit of every field of a section and of the sections in it."""
    for name, info in type(section).model_fields.items():
        value = getattr(section, name)
        if isinstance(value, dict):
            for key, entry in value.items():
                yield from fields_of(entry, f"{key}.")
        elif isinstance(value, Section):
            yield from fields_of(value, f"{prefix}{name}.")
        elif unit := _unit(info):
            yield prefix + name, FieldValue(value, unit)


def may_have(model: type[Section], name: str) -> bool:
    """Whether a section of this type may have a field of this name, whatever its wheels and surfaces are called."""
    first, _, rest = name.partition(".")
    if first not in model.model_fields:
        groups = (info for info in model.model_fields.values() if get_origin(info.annotation) is dict)
        return bool(rest and NAME.fullmatch(first)) and any(_inside(info, rest) for info in groups)
    info = model.model_fields[first]
    if not rest:
        return _unit(info) is not None
    return get_origin(info.annotation) is not dict and _inside(info, rest)


def _inside(info: FieldInfo, name: str) -> bool:
    kinds = get_args(info.annotation) or (info.annotation,)  # a section, or one that may be left out
    return any(may_have(kind, name) for kind in kinds if isinstance(kind, type) and issubclass(kind, Section))


def keys_of(section: Section, name: str) -> list[str]:
    """Keys that lead to a field, or to a section, in the data of a section (`model_dump`); `InputError` if none."""
    keys, fields = name.split("."), type(section).model_fields
    groups = [key for key in fields if isinstance(getattr(section, key), dict)]
    keys[:0] = [key for key in groups if keys[0] not in fields and keys[0] in getattr(section, key)]
    inner: Any = section
    for key in keys:
        if isinstance(inner, dict) and key in inner:
            inner = inner[key]
        elif isinstance(inner, Section) and key in type(inner).model_fields:
            inner = getattr(inner, key)
        else:
            raise no_field(section, name)
    return keys


def no_field(section: Section, name: str) -> InputError:
    """The refusal of a name that is no field of a rig."""
    close = get_close_matches(name, [field for field, _ in fields_of(section)], 2)
    hint = f"did you mean {' or '.join(close)}?" if close else "a name such as bushing.stiffness is accepted"
    return InputError(f"{shown(name)} is not a parameter of the rig; {hint}")


def outside_range(entry: dict) -> str:
    """Side on which the value of an entry leaves its range, ``below`` or ``above``; empty if it does not."""
    value, low, high = (number_of(entry.get(key)) for key in ("value", "low", "high"))
    return "below" if value < low else "above" if value > high else ""


def entries_of(data: dict, prefix: str = "") -> dict[str, dict]:
    """Entries of a rig file (`rig_file.read_rig`) by the names of their fields."""
    entries = {}
    for key, section in data.items():
        if "value" in section:
            entries[prefix + key] = section
        else:
            entries |= entries_of(section, prefix if key in ("wheels", "surfaces", "sensors") else f"{prefix}{key}.")
    return entries

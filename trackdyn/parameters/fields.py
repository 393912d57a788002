"""Fields of a rig by dotted name: ``gravity``, ``sprocket.ring_radius``, ``road_1.arm.stiffness``.

The members of ``wheels`` and ``surfaces`` are sections by their own names.
"""

import re
from collections.abc import Iterator
from difflib import get_close_matches
from typing import Any, NamedTuple, get_args, get_origin

from pydantic.fields import FieldInfo

from trackdyn.errors import InputError
from trackdyn.parameters.quantities import Quantity
from trackdyn.parameters.validation import Section, shown

NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")  # of a wheel


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


def entries_of(data: dict, prefix: str = "") -> dict[str, dict]:
    """Entries of a rig file (`rig_file.read_rig`) by the names of their fields."""
    entries = {}
    for key, section in data.items():
        if "value" in section:
            entries[prefix + key] = section
        else:
            entries |= entries_of(section, prefix if key in ("wheels", "surfaces") else f"{prefix}{key}.")
    return entries

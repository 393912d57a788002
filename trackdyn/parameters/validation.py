"""Data against a schema; every defect ends in one sentence."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from math import isfinite
from numbers import Real
from typing import Annotated, Any, TypeVar, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, PlainSerializer, ValidationError, WrapValidator

from trackdyn.errors import InputError, shown

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class Section(BaseModel):
    """A group of settings: unknown keys are refused, values cannot be changed afterwards.

    A number is no truth value and no text, nor the other way round.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    def __eq__(self, other: Any) -> bool:
        """Whether all fields are equal; what was worked out from them and kept, mostly arrays, is not asked."""
        return type(self) is type(other) and all(
            getattr(self, name) == getattr(other, name) for name in type(self).model_fields
        )


SectionType = TypeVar("SectionType", bound=Section)


def not_one_of(value: Any, accepted: Iterable[str]) -> str:
    """Why a value that should be one of some names is rejected: all of them, and the one that may be meant."""
    *others, last = map(repr, accepted)
    meant = get_close_matches(value[:100], accepted, 1) if isinstance(value, str) else []
    did = f"; did you mean {meant[0]!r}?" if meant else ""
    return f"= {shown(value)}: use {' or '.join(filter(None, (', '.join(others), last)))}{did}"


@dataclass(frozen=True)
class OneOf:
    """Mark of a `Literal`: its names and those of a registry are accepted, and `not_one_of` says so of others."""

    registry: Mapping[str, Any] = field(default_factory=dict)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        def accept(value: Any, _: Any) -> str:
            accepted = tuple(dict.fromkeys((*get_args(source), *self.registry)))
            if not isinstance(value, str) or value not in accepted:
                raise ValueError(not_one_of(value, accepted))
            return str(value)

        # a name of the registry alone is none of the literal's: written as text, it is no surprise
        return handler.generate_schema(Annotated[source, WrapValidator(accept), PlainSerializer(str, str)])


def validated(
    schema: type[SectionType], data: Any, name: str, missing: str = "add it", context: Any = None
) -> SectionType:
    """``data`` as an object of ``schema`` (``context``: for its validators); or `InputError` with file and field."""
    if not isinstance(data, dict):
        raise InputError(f"{name}: must hold sections, a mapping of names to values")
    try:
        return schema.model_validate(data, context=context)
    except ValidationError as error:
        raise InputError(sentence(name, _first(error.errors()), missing)) from None
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def plain_number(value: Any) -> Any:
    """A number as Python's own float, whichever library it comes from; anything else goes on to be refused.

    Accepts integers, fractions, NumPy scalars and arrays without dimensions.
    """
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    try:
        if not isinstance(value, (Real, np.number)) or isinstance(value, (bool, np.bool_, np.complexfloating)):
            raise ValueError
        number = float(value)
        if not isfinite(number):
            raise ValueError
    except (TypeError, ValueError, OverflowError):  # NumPy counts a span of time among numbers
        raise ValueError(f"= {shown(value)}: must be a finite number") from None
    return number


def plain_count(value: Any) -> Any:
    """A whole number as Python's own int; see `plain_number`."""
    number = plain_number(value)
    if number != int(number):
        raise ValueError(f"= {shown(value)}: must be a whole number")
    return int(number)


def parse_number(text: str | float) -> float:
    """A number as tables write it (or `ValueError`); ``float`` also reads ``1_15`` and the digits of every script."""
    if isinstance(text, str) and ("_" in text or not text.isascii()):
        raise ValueError(text)
    return float(text)


def _first(errors: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """What to say first: of a missing field and an unknown one beside it, the latter, and what it may be meant for."""
    lacking = [error for error in errors if error["type"] == "missing"]
    for error in errors if errors[0]["type"] == "missing" else []:
        missing = [str(other["loc"][-1]) for other in lacking if other["loc"][:-1] == error["loc"][:-1]]
        if error["type"] == "extra_forbidden" and missing:
            return {**error, "meant": get_close_matches(str(error["loc"][-1]), missing, 1)}
    return errors[0]


def sentence(name: str, error: Mapping[str, Any], missing: str) -> str:
    """Pydantic's finding as one sentence with the file, the field, the value and what would be accepted."""
    parts = [str(key) for key in error["loc"]]
    where = ".".join(key if re.fullmatch(r"\w{1,60}", key) else shown(key) for key in parts) or "the file"
    if error["type"] == "extra_forbidden":
        meant = f" ({error['meant'][0]}?)" if error.get("meant") else ""
        return f"{name}: {where} is not a known parameter; remove it or correct its spelling{meant}"
    if error["type"] == "missing":
        return f"{name}: {where} is missing; {missing}"
    if error["type"] == "value_error":
        return f"{name}: {where} {error['ctx']['error']}"
    value = error["input"]
    value = value.get("value", value) if isinstance(value, dict) else value
    problem = error["msg"][0].lower() + error["msg"][1:]
    return f"{name}: {where} = {shown(value)}: {problem}"


def within(name: str, value: float, least: float, most: float, what: str = "") -> float:
    """A number between two, else `InputError` with name, value and range; ``what`` the bounds are of, with a unit."""
    try:
        number = plain_number(value)
    except ValueError as error:
        raise InputError(f"{name} {error}") from None
    if not least <= number <= most:
        raise InputError(f"{name} = {number:g}: must be between {least:g} and {most:g}{what}")
    return number

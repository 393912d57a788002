"""Reading YAML against a schema; every defect ends in one sentence."""

import re
from math import isfinite
from numbers import Real
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np
import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from trackdyn.errors import InputError

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class Section(BaseModel):
    """A group of settings: unknown keys are refused, values cannot be changed afterwards."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    def __eq__(self, other: Any) -> bool:
        """Whether all fields are equal; what was worked out from them and kept, arrays for the most part, is not asked."""
        return type(self) is type(other) and all(
            getattr(self, name) == getattr(other, name) for name in type(self).model_fields
        )


SectionType = TypeVar("SectionType", bound=Section)


def read_yaml(path: Path | str) -> Any:
    """Contents of a YAML file, or one sentence about why it cannot be read."""
    path = Path(path)
    try:
        return yaml.safe_load(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; give the path of an existing YAML file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as UTF-8 text ({error.__class__.__name__})") from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f" at line {mark.line + 1}" if mark else ""
        raise InputError(f"{path}: is not valid YAML{line}; correct the syntax there") from None


def validated(schema: type[SectionType], data: Any, name: str, missing: str = "add it") -> SectionType:
    """``data`` as an object of ``schema``.

    Raises
    ------
    InputError
        One sentence with the file ``name``, the field, the value and what would be accepted.
    """
    if not isinstance(data, dict):
        raise InputError(f"{name}: holds no sections; a mapping of names to values is needed")
    try:
        return schema.model_validate(data)
    except ValidationError as error:
        raise InputError(sentence(name, error.errors()[0], missing)) from None
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def plain_number(value: Any) -> Any:
    """A number as Python's own float, whichever library it comes from; anything else goes on to be refused.

    Accepts integers, fractions, NumPy scalars and arrays without dimensions.
    """
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not isinstance(value, (Real, np.number)) or isinstance(value, (bool, np.bool_, complex, np.complexfloating)):
        raise ValueError(f"= {value!r} is not accepted: a finite number is needed")
    try:
        number = float(value)
    except OverflowError:
        number = float("inf")
    if not isfinite(number):
        raise ValueError(f"= {value!r} is not accepted: a finite number is needed")
    return number


def parse_tolerance(text: str | float) -> float:
    """``2%``, ``0.02`` or 0.02 as a share.

    Raises
    ------
    InputError
        It is not a number between 0 and 1.
    """
    match = re.fullmatch(r"\s*([0-9.eE+-]+)\s*(%?)\s*", str(text))
    try:
        value = float(match[1]) / (100 if match[2] else 1)
    except (TypeError, ValueError):
        value = float("nan")
    if not 0 < value < 1:
        raise InputError(f"tolerance = {text!r} is not accepted: a share between 0 and 1, such as 2% or 0.02, would do")
    return value


def sentence(name: str, error: dict, missing: str) -> str:
    """What pydantic found, as one sentence with the file, the field, the value and what would be accepted."""
    where = ".".join(str(part) for part in error["loc"]) or "the file"
    if error["type"] == "extra_forbidden":
        return f"{name}: {where} is not a known parameter; remove it or correct its spelling"
    if error["type"] == "missing":
        return f"{name}: {where} is missing; {missing}"
    if error["type"] == "value_error":
        return f"{name}: {where} {error['ctx']['error']}"
    shown = error["input"]
    shown = shown.get("value", shown) if isinstance(shown, dict) else shown
    problem = error["msg"][0].lower() + error["msg"][1:]
    return f"{name}: {where} = {shown!r} is not accepted: {problem}"

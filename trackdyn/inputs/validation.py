"""Validation of data by a schema, with error messages of one sentence."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cache, wraps
from inspect import Parameter, Signature, isfunction, signature
from math import isfinite
from numbers import Real
from pathlib import Path
from sys import float_info
from types import SimpleNamespace, UnionType
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, Self, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, PlainSerializer, ValidationError, WrapValidator

from trackdyn.inputs.errors import InputError, naming, shown

FROM_THE_RIG = "of the rig"  # default of a field that is computed from the rig
Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
SectionType = TypeVar("SectionType", bound="Section")
Typed = TypeVar("Typed", bound=Callable[..., Any])
_INHERITED = frozenset(vars(BaseModel)) | {"__annotations__", "__private_attributes__", "__signature__"}
# declared type -> its description in messages, and the classes that it accepts
_ACCEPTED: dict[Any, tuple[str, tuple[type, ...]]] = {
    bool: ("True or False", (bool, np.bool_)), float: ("a finite number", (Real,)), int: ("a whole number", (Real,)),
    str: ("text", (str,)), Path: ("a path", (Path,)), type(None): ("None", (type(None),)),
    Callable: ("a function", (Callable,)), Mapping: ("a mapping", (Mapping,)), dict: ("a mapping", (dict,)),
    Sequence: ("a sequence such as a list", (Sequence, np.ndarray)), Any: ("anything", (object,)),
}  # fmt: skip

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)


class _Sentences(ModelMetaclass):
    """Metaclass whose constructors raise `InputError` with one sentence; data of files are `validated`."""

    def __call__(cls, *args: Any, **fields: Any) -> Any:
        try:
            return super().__call__(*args, **fields)
        except ValidationError as error:
            raise InputError(sentence(cls.__name__.lower(), _first(error.errors()), "add it")) from None
        except TypeError as error:
            try:
                signature(cls.__init__).bind(None, *args, **fields)
            except TypeError as misfit:
                raise InputError(f"{cls.__name__.lower()}: {misfit}") from None
            raise error

    def __dir__(cls) -> list[str]:
        """Return the names for completion and ``help``, without pydantic's own."""
        return [name for name in super().__dir__() if not _of_pydantic(name)]


def _of_pydantic(name: str) -> bool:
    return name not in ("model_copy", "__doc__", "__init__") and (name in _INHERITED or name.startswith("__pydantic_"))


def _refuse_change(owner: Any, name: str) -> None:
    """Raise `InputError` that names the method which returns a changed copy, if ``name`` is a field."""
    if name in type(owner).model_fields:
        kind = type(owner).__name__
        remedy = {"Rig": "rig.changed(...)", "Scene": "scene.with_(...)"}.get(kind, "model_copy(update=...)")
        raise InputError(f"{kind.lower()}: {name} cannot be changed; {remedy} returns another one")


class FrozenDict(dict):
    """Read-only dictionary of a frozen object; changes raise `InputError`."""

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        owner = "this dictionary belongs to an object that cannot be changed"
        raise InputError(f"{owner}; rig.changed(...) returns another")

    __setitem__ = __delitem__ = __ior__ = clear = pop = popitem = setdefault = update = _refuse  # type: ignore[assignment]

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset(self.items()))

    def __reduce__(self) -> tuple:
        return type(self), (dict(self),)


class Section(BaseModel, metaclass=_Sentences):
    """Immutable group of settings without unknown keys; numbers, truth values and text are not converted."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Show in ``help`` the types and defaults of the fields, without validators."""
        types = {name: info.annotation for name, info in cls.model_fields.items()}
        with suppress(NameError):  # a section that is defined further down
            types = get_type_hints(SimpleNamespace(__annotations__=types))
        own = signature(cls.__init__).parameters.values()
        first = {p.name: p for p in own if p.kind is not p.VAR_KEYWORD and p.name not in ("self", "data")}
        for name, info in cls.model_fields.items():
            default = Parameter.empty if info.is_required() else FROM_THE_RIG
            if not (info.is_required() or info.default_factory_takes_validated_data):
                default = info.get_default(call_default_factory=True)
            first.setdefault(name, Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=types[name]))
        cls.__signature__ = Signature([*first.values()])

    def __dir__(self) -> list[str]:
        return [name for name in super().__dir__() if not _of_pydantic(name)]

    def __setattr__(self, name: str, value: Any) -> None:
        _refuse_change(self, name)
        super().__setattr__(name, value)

    def __delattr__(self, name: str) -> None:
        _refuse_change(self, name)
        super().__delattr__(name)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy with other values of some fields, validated; `InputError` as for a new object."""
        if not update:
            return super().model_copy(deep=deep)
        return type(self)(**{name: getattr(self, name) for name in self.model_fields_set} | dict(update))

    def __eq__(self, other: Any) -> bool:
        """Return whether all fields are equal; cached values computed from them are not compared."""
        fields = type(self).model_fields
        return type(self) is type(other) and all(getattr(self, name) == getattr(other, name) for name in fields)


def not_one_of(value: Any, accepted: Iterable[str]) -> str:
    """Return the error message for a value that is none of the accepted names, with a similar one."""
    *others, last = map(repr, accepted)
    meant = get_close_matches(value[:100], accepted, 1) if isinstance(value, str) else []
    did = f"; did you mean {meant[0]!r}?" if meant else ""
    return f"= {shown(value)}: use {' or '.join(filter(None, (', '.join(others), last)))}{did}"


@dataclass(frozen=True)
class OneOf:
    """Annotation of a `Literal` or ``str``: its names and those of a registry are accepted (`not_one_of`)."""

    registry: Mapping[str, Any] = field(default_factory=dict)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        def accept(value: Any, _: Any) -> str:
            accepted = tuple(dict.fromkeys((*get_args(source), *self.registry)))
            if not isinstance(value, str) or value not in accepted:
                raise ValueError(not_one_of(value, accepted))
            return str(value)

        # a name that only the registry has is written as text, or pydantic would warn that it is none of the literal's
        return handler.generate_schema(Annotated[source, WrapValidator(accept), PlainSerializer(str, str)])


def validated(
    schema: type[SectionType], data: Any, name: str, missing: str = "add it", context: Any = None
) -> SectionType:
    """Return ``data`` as an object of ``schema``, with a ``context`` for its validators; or `InputError`."""
    if not isinstance(data, dict):
        raise InputError(f"{name}: must hold sections, a mapping of names to values")
    with naming(name):
        try:
            return schema.model_validate(data, context=context)
        except ValidationError as error:
            raise InputError(sentence(name, _first(error.errors()), missing)) from None


def plain_number(value: Any) -> Any:
    """Return a real number, NumPy scalar or array without dimensions as a float; else raise `ValueError`."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    real = isinstance(value, (Real, np.number)) and not isinstance(value, (bool, np.bool_, np.complexfloating))
    with suppress(TypeError, ValueError, OverflowError):  # NumPy counts a span of time among numbers
        if real and isfinite(number := float(value)):
            return number
    raise ValueError(f"= {shown(value)}: must be a finite number")


def plain_count(value: Any) -> Any:
    """Return a whole number as a Python int, or raise `ValueError`; see `plain_number`."""
    number = plain_number(value)
    if number != int(number):
        raise ValueError(f"= {shown(value)}: must be a whole number")
    return int(number)


def parse_number(text: str | float) -> float:
    """Return a number in ASCII digits (else `ValueError`); ``float`` also reads ``1_15`` and other scripts."""
    if isinstance(text, str) and ("_" in text or not text.isascii()):
        raise ValueError(text)
    return float(text)


def _first(errors: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """Return the first error to report; an unknown field comes before a missing one, with the closest name."""
    lacking = [error for error in errors if error["type"] == "missing"]
    for error in errors if errors[0]["type"] == "missing" else []:
        missing = [str(other["loc"][-1]) for other in lacking if other["loc"][:-1] == error["loc"][:-1]]
        if error["type"] == "extra_forbidden" and missing:
            return {**error, "meant": get_close_matches(str(error["loc"][-1]), missing, 1)}
    return errors[0]


def sentence(name: str, error: Mapping[str, Any], missing: str) -> str:
    """Return pydantic's ``error`` as a sentence with file, field, value; ``missing`` is the remedy for no field."""
    keys = (str(key) for key in error["loc"])
    location = ".".join(key if re.fullmatch(r"\w{1,60}", key) else shown(key) for key in keys) or "the file"
    if error["type"] == "extra_forbidden":
        meant = f" ({error['meant'][0]}?)" if error.get("meant") else ""
        return f"{name}: {location} is not a known parameter; remove it or correct its spelling{meant}"
    if error["type"] == "missing":
        return f"{name}: {location} is missing; {missing}"
    if error["type"] == "value_error":
        return f"{name}: {location} {error['ctx']['error']}"
    value = error["input"]
    value = value.get("value", value) if isinstance(value, dict) else value
    problem = error["msg"][0].lower() + error["msg"][1:]
    if error["type"] in ("model_type", "dict_type"):
        problem = "must be a mapping of names to values"
        if error["type"] == "model_type":
            problem += f", or in Python an instance of {error['ctx']['class_name']}"
    return f"{name}: {location} = {shown(value)}: {problem}"


def within(name: str, value: float, least: float, most: float, suffix: str = "") -> float:
    """Return a number within limits, else `InputError` with name, value and range, followed by ``suffix``."""
    try:
        number = plain_number(value)
    except ValueError as error:
        raise InputError(f"{name} {error}") from None
    if not least <= number <= most:
        raise InputError(f"{name} = {number:g}: must be between {least:g} and {most:g}{suffix}")
    return number


def typed(target: Typed) -> Typed:
    """Check the types of arguments of a function, or of the public methods of a class (`InputError`).

    Classes, numbers, truth values, sequences, mappings, callables and unions of these are checked; items are not.
    """
    if isinstance(target, type):
        for name, member in list(vars(target).items()):
            if isfunction(member) and (name == "__init__" or not name.startswith("_")):
                setattr(target, name, typed(member))
        return target
    names = list(signature(target).parameters)

    @cache
    def hints() -> dict[str, Any]:  # with the first call, when all names are defined
        return get_type_hints(target)

    @wraps(target)
    def call(*args: Any, **kwargs: Any) -> Any:
        declared = hints()
        for name, value in (*zip(names, args, strict=False), *kwargs.items()):
            hint = declared.get(name, Any)
            members = get_args(hint) if get_origin(hint) in (Union, UnionType) else [hint]
            kinds = [get_origin(member) or member for member in members]
            if not any(_is_a(value, kind) for kind in kinds):
                accepted = (_ACCEPTED[kind][0] if kind in _ACCEPTED else kind.__name__ for kind in kinds)
                raise InputError(f"{name} = {shown(value)}: must be {' or '.join(accepted)}")
        return target(*args, **kwargs)

    return call  # type: ignore[return-value]


def _is_a(value: Any, kind: Any) -> bool:
    """Return whether a value is of a declared class, as far as `typed` checks."""
    if kind in (float, int) and isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    accepted = _ACCEPTED[kind][1] if kind in _ACCEPTED else kind
    if isinstance(value, {float: (bool, np.bool_), int: (bool, np.bool_), Sequence: (str, bytes)}.get(kind, ())):
        return False
    if kind is float and isinstance(value, int) and abs(value) > float_info.max:
        return False
    return isinstance(value, accepted) and (kind is not int or value == value // 1)

"""A value of another type than a public function declares is refused by its name, before any other check."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from inspect import isclass, isfunction
from types import NoneType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import pytest

import trackdyn
from tests.conftest import refused
from trackdyn.fieldtest.compare import compare_with_sensor
from trackdyn.inputs.errors import shown
from trackdyn.inputs.validation import typed
from trackdyn.measure.planner import plan

VALUES = [None, 3.7, True, b"bytes", [1], {"a": 1}, object, 1j, np.zeros(3), "x"]
ACCEPTED = {  # by declared type; of other classes none of the values is an instance
    NoneType: (NoneType,), float: (float,), bool: (bool,), str: (str,),
    Callable: (type,), Mapping: (dict,), Sequence: (list, np.ndarray), type: (type,),
}  # fmt: skip
FUNCTIONS = {
    **{name: value for name in trackdyn.__all__ if isfunction(value := getattr(trackdyn, name))},
    **{f"Loop.{name}": partial(value, None) for name, value in vars(trackdyn.Loop).items()
       if isfunction(value) and not name.startswith("_")},
    "Loop": trackdyn.Loop, "Recording.save": partial(trackdyn.Recording.save, None),
    "Rig.value": partial(trackdyn.Rig.value, None), "plan": plan, "compare_with_sensor": compare_with_sensor,
}  # fmt: skip


def wrong_values(function):
    function = function.__init__ if isclass(function) else getattr(function, "func", function)
    for name, declared in get_type_hints(function).items():
        kinds = [get_origin(kind) or kind for kind in get_args(declared) or [declared]]
        kinds = [get_origin(declared)] if get_origin(declared) in ACCEPTED else kinds
        if name != "return" and Any not in kinds:
            accepted = tuple(kind for declared in kinds for kind in ACCEPTED.get(declared, ()))
            yield from ((name, value) for value in VALUES if not isinstance(value, accepted))


ROWS = [(function, *row) for function in FUNCTIONS for row in wrong_values(FUNCTIONS[function])]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row[0]}({row[1]}={shown(row[2])})")
def test_an_argument_of_another_type_is_refused(row):
    function, name, value = row
    refused(FUNCTIONS[function], start=f"{name} = ", **{name: value})


def test_arguments_of_the_declared_type_pass():
    @typed
    def call(number: float, count: int = 1, text: str | None = None, *rest: int, flag: bool = False) -> tuple:
        return number, count, text, flag

    assert call(np.float32(1), 2.0, flag=np.True_) == (1.0, 2.0, None, True)
    assert call(np.array(3), np.int64(2), "a")[:2] == (3, 2)
    for field, *arguments in (("count", 1.0, 1.5), ("number", 10**400), ("count", np.nan, True), ("text", 1.0, 1, 2)):
        refused(call, *arguments, start=f"{field} = ")

"""What the rows of a design ask for, each with a key by which its result is known again."""

import re
from functools import cache
from math import isnan
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from trackdyn.errors import InputError
from trackdyn.parameters.rig import Rig, load_rig
from trackdyn.parameters.rig_file import DEFAULT
from trackdyn.parameters.validation import parse_number, shown, validated, within
from trackdyn.scene.fidelity import CHOICES, preset
from trackdyn.scene.scene import FOLLOWS, LEAST_STEP, LONGEST_RUN, Scene, StopRule
from trackdyn.simulation.settling import LATER
from trackdyn.sources import module_hash
from trackdyn.sweeps.store import key_of

FLAGS = ("spells", "every_link", "sliding")
# but for the longest turns: the row's duration says that
KNOWN = tuple(f"known.{name}" for name in StopRule.model_fields if name != "longest_turns")
TRUTH = {"true": True, "false": False}
# what a row has where it says nothing, but for what it then takes from its rig
DEFAULTS = {
    name: None if name in FOLLOWS else field.default
    for name, field in Scene.model_fields.items()
    if not field.is_required()
}
# of the columns that say nothing of the scene: the row's name; and what stands for several fields
OWN = ("name", "preset", "rig")


class SweepRow(NamedTuple):
    """A row, ready to be computed."""

    key: str  # hash of rig, scene, what ends the run, and the sources of all that computes a row
    same_start: str  # rows that sort together share what settling gives
    rig: dict  # values of the rig's file
    changes: dict  # those that the row replaces (``section__field``)
    scene: dict  # fields of the scene; ``step`` may be several, of which the first counts that comes out
    # when contacts have converged (`trackdyn.measure.stopping.StopRule`); empty: they do not end the run
    known: dict
    reason: str  # why the row is refused already, or nothing

    @property
    def task(self) -> dict:
        """What `sweeps.row.Rows` takes."""
        return {name: getattr(self, name) for name in ("rig", "changes", "scene", "known")}


@cache
def columns() -> tuple[str, ...]:
    """Every column that a design may have beside the fields of a rig."""
    return (*OWN, *(name for name in Scene.model_fields if name != "rig"), *KNOWN)


def refuse_columns(table: pd.DataFrame, where: str) -> None:
    """Refuse (`InputError`) a design whose columns do not make scenes: one that nothing is known of, or one missing."""
    for name in table.columns:
        if name not in columns() and not Rig.may_have(name):
            raise InputError(
                f"{where}: {shown(name)} is not a column of a design; expected a field of the scene such as "
                "motor_rpm, one of the rig such as sprocket.ring_radius, name, preset or rig"
            )
    if "motor_rpm" not in table.columns:
        raise InputError(f"{where}: has no column motor_rpm; add it")
    if not len(table):
        raise InputError(f"{where}: has no rows; a row a scene is needed")


def requested_rows(table: pd.DataFrame, rig: str = DEFAULT) -> list[SweepRow]:
    """What every row of a design asks for; a value that cannot be read is the row's ``reason``.

    ``rig`` is the file of the rig, or the name of a shipped one, where a row names no other. Raises `InputError` if all
    rows are of that rig, and it cannot be used.
    """
    rigs: dict[str, tuple[dict, str] | InputError] = {}
    if "rig" not in table.columns:
        _rig(rig, rigs)
    named = [(name, table[name].tolist()) for name in table.columns]
    return [_row({name: values[k] for name, values in named}, rig, rigs) for k in range(len(table))]


def _row(cells: dict[str, Any], rig: str, rigs: dict[str, tuple[dict, str] | InputError]) -> SweepRow:
    values = {name: value for name, cell in cells.items() if (value := _plain(cell)) is not None}
    base: dict = {}
    fields: dict = {}
    changes: dict = {}
    known: dict = {}
    content, reason = "", ""
    try:
        if "ring_radius" in cells and "ring_radius" not in values:
            raise InputError("ring_radius is empty; expected a radius in m, or none")
        if "motor_rpm" not in values:
            raise InputError("motor_rpm is empty; a speed in rev/min is needed")
        base, content = _rig(str(values.get("rig", rig)), rigs)
        if "preset" in values:
            preset(str(values["preset"]))  # refused here, not by the row when it runs
            fields["preset"] = str(values["preset"])
        for name, value in values.items():
            if name in Scene.model_fields and name != "rig":
                fields[name] = _field(name, value)
            elif name in KNOWN:
                known[name.removeprefix("known.")] = _number(value)
            elif name not in OWN:
                changes[name.replace(".", "__")] = _number(value)
        if fields["motor_rpm"] == 0:
            raise InputError("motor_rpm = 0: must be above 0, for a row records a running track")
        if known:
            validated(StopRule, known | {"longest_turns": 1}, "known")
    except InputError as error:
        reason = str(error)
    # what the row asks for, whether it says so or leaves it to the defaults
    scene = DEFAULTS | fields
    rig_is = [content, changes]
    asks = [rig_is, scene, known, module_hash("trackdyn.sweeps.row"), values if reason else None]
    settles = {name: value for name, value in scene.items() if name not in (*LATER, "ring_radius")}
    same_start = f"{key_of(rig_is, settles)} {fields.get('ring_radius', '')}"
    return SweepRow(key_of(*asks), same_start, base, changes, fields, known, reason)


def _plain(cell: Any) -> Any:
    """A cell as Python's own value; None: nothing stands there."""
    if isinstance(cell, (np.ndarray, np.generic)):
        cell = cell.tolist()
    if isinstance(cell, str):
        return cell.strip() or None
    if cell is None or cell is pd.NaT or (isinstance(cell, float) and isnan(cell)):
        return None
    return cell if isinstance(cell, (bool, int, float, list, tuple)) else str(cell)


def _rig(path: str, rigs: dict[str, tuple[dict, str] | InputError]) -> tuple[dict, str]:
    """Values of a rig's file and their hash, read once."""
    if path not in rigs:
        try:
            values = load_rig(path).model_dump()
            rigs[path] = values, key_of(values)
        except InputError as error:
            rigs[path] = error
    rig = rigs[path]
    if isinstance(rig, InputError):
        raise rig
    return rig


def _number(value: Any) -> Any:
    """A number where there is one, 115 like 115.0; what is none goes on to be refused by the field."""
    try:
        return value if isinstance(value, (bool, list, tuple)) else parse_number(value)
    except (ValueError, OverflowError):
        return value


def _field(name: str, value: Any) -> Any:
    """A field of a scene out of its cell."""
    text = value.lower() if isinstance(value, str) else ""
    if name in CHOICES:
        return value
    if name in FLAGS:
        return TRUTH.get(text, value)
    if name == "pitches":
        parts = text.replace(";", " ").split() if text else [""]
        return [int(word) for word in parts] if all(re.fullmatch("[0-9]+", word) for word in parts) else value
    if name == "step":
        steps = value if isinstance(value, (list, tuple)) else text.replace(";", " ").split()
        if len(steps) > 1:
            return [within("step", _number(step), LEAST_STEP, LONGEST_RUN, " s") for step in steps]
    return None if name == "ring_radius" and text == "none" else _number(value)

"""Sweeps: compute a table of scenes; every result is stored under a key of everything that it depends on."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from joblib import cpu_count

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.files import check_writable, write_csv
from trackdyn.inputs.validation import parse_number, shown, typed, within
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.rig.rig_file import DEFAULT
from trackdyn.scene.scene import LONGEST_RUN, Scene, StopRule
from trackdyn.scene.step import LEAST_STEP
from trackdyn.simulation.settling import IRRELEVANT
from trackdyn.sources import module_hash
from trackdyn.sweeps.design import check_ending, check_header, read_table
from trackdyn.sweeps.engine import DONE, REFUSED, key_of, without_values
from trackdyn.sweeps.engine import results as computed
from trackdyn.sweeps.sweep_row import run_row

# the longest turns follow from the duration of the row
STOP_RULE = tuple(f"stop_rule.{name}" for name in StopRule.model_fields if name != "longest_turns")
# values of fields that a row leaves open, except those that follow from its rig
DEFAULTS = {
    name: None if field.default_factory else field.default
    for name, field in Scene.model_fields.items()
    if not field.is_required()
}
ROW_COLUMNS = ("name", "preset", "rig")  # a name of the row, and names that set several fields of the scene
# columns of a design other than the fields of a rig
DESIGN_COLUMNS = (*ROW_COLUMNS, *(name for name in Scene.model_fields if name != "rig"), *STOP_RULE)


class SweepRow(NamedTuple):
    """Key and arguments of a row."""

    key: str  # hash of rig, scene, stop rule, and the sources that compute a row
    same_start: str  # sort key: neighbours share settled loops
    # arguments of `sweep_row.run_row`: values of the rig's file, those that the row replaces (``section__field``),
    # fields of the scene, of which ``step`` may be several, and the fields of a `StopRule`, or none
    task: dict[str, dict]
    reason: str  # of a refusal; empty if the row can be computed


def read_design(design: pd.DataFrame | Path | str) -> pd.DataFrame:
    """Read a design; `InputError`: it is no table, has no rows, has an unknown column, or lacks ``motor_rpm``."""
    table, source = (design, "design") if isinstance(design, pd.DataFrame) else (read_table(design), str(design))
    check_header(list(table.columns), source)
    for name in table.columns:
        if name not in DESIGN_COLUMNS and not Rig.may_have(name):
            fields = "of the scene such as motor_rpm, one of the rig such as sprocket.ring_radius, name, preset or rig"
            raise InputError(f"{source}: {shown(name)} is not a column of a design; expected a field {fields}")
    if "motor_rpm" not in table.columns:
        raise InputError(f"{source}: has no column motor_rpm; add it")
    if not len(table):
        raise InputError(f"{source}: has no rows; give one per scene")
    return table


def requested_rows(table: pd.DataFrame, rig: str = DEFAULT) -> list[SweepRow]:
    """Return the rows of a design, with ``rig`` if they name none; invalid values are the ``reason`` of their row."""
    read = cache(lambda path: load_rig(path).model_dump())
    if "rig" not in table.columns:
        read(rig)  # `InputError` if it cannot be used
    return [_row(cells, rig, read) for cells in table.to_dict("records")]


def _row(cells: dict[str, Any], rig: str, read: Callable[[str], dict]) -> SweepRow:
    values = {name: value for name, cell in cells.items() if (value := _value(cell)) is not None}
    task: dict[str, dict] = {"rig": {}, "changes": {}, "scene": {}, "stop_rule": {}}
    try:
        if "ring_radius" in cells and "ring_radius" not in values:
            raise InputError("ring_radius is empty; expected a radius in m, or none")
        if "motor_rpm" not in values:
            raise InputError("motor_rpm is empty; a speed in rev/min is needed")
        task["rig"] = read(str(values.get("rig", rig)))
        for name, value in values.items():
            if name == "preset":
                task["scene"][name] = str(value)
            elif name in Scene.model_fields and name != "rig":
                task["scene"][name] = _field(name, value)
            elif name in STOP_RULE:
                task["stop_rule"][name.removeprefix("stop_rule.")] = value
            elif name not in ROW_COLUMNS:
                task["changes"][name.replace(".", "__")] = value
        if task["scene"]["motor_rpm"] == 0:
            raise InputError("motor_rpm = 0: must be above 0, since rows record a running track")
    except InputError as error:
        return row_of(task, str(error), values)
    return row_of(task)


def row_of(task: dict[str, dict], reason: str = "", refused: dict | None = None) -> SweepRow:
    """Return the row of a task (`SweepRow`), or of values that are ``refused`` for a ``reason``."""
    # a default that a row states gives the same key
    scene = DEFAULTS | task["scene"]
    key = key_of(task | {"scene": scene}, module_hash("trackdyn.sweeps.sweep_row"), refused)
    settling = {name: value for name, value in scene.items() if name not in (*IRRELEVANT, "ring_radius")}
    same_start = f"{key_of(task['rig'], task['changes'], settling)} {task['scene'].get('ring_radius', '')}"
    return SweepRow(key, same_start, task, reason)


def computed_rows(rows: list[SweepRow], jobs: int | None, store: Path | str | None, bar: str) -> list[dict]:
    """Return the result of every row (`engine.results`), in their order; `InputError`: ``jobs`` is out of range."""
    if jobs is not None:
        jobs = int(within("jobs", jobs, 1, 1024, " processes"))
    results_by_key = {row.key: without_values(row.key, REFUSED, row.reason) for row in rows if row.reason}
    due = {row.key: row.task for row in sorted(rows, key=lambda row: row.same_start) if not row.reason}
    results_by_key |= computed(run_row, due, jobs or cpu_count(), store, bar)
    return [results_by_key[row.key] for row in rows]


def _value(cell: Any) -> Any:
    """Return the value of a cell as a Python object, a number if it can be read as one, None if it is empty."""
    if isinstance(cell, (np.ndarray, np.generic)):
        cell = cell.tolist()
    if isinstance(cell, (list, tuple)):
        return [_value(item) for item in cell]
    if isinstance(cell, str):
        cell = cell.strip() or None
    if isinstance(cell, bool) or pd.isna(cell):
        return cell if isinstance(cell, bool) else None
    try:
        return parse_number(cell)
    except (ValueError, OverflowError, TypeError):  # its field refuses it
        return cell


def _field(name: str, value: Any) -> Any:
    """Return a field of a scene from the value of its cell. Raises `InputError`: one of several steps is missing."""
    if isinstance(value, str):
        if name in ("pitches", "step"):
            value = _value(value.replace(";", " ").split())
        elif name in ("contact_log", "every_link"):
            value = {"true": True, "false": False}.get(value.lower(), value)
        elif (name, value.lower()) == ("ring_radius", "none"):
            return None
    if name == "pitches":
        pitches = value if isinstance(value, list) else [value]
        return [int(pitch) if isinstance(pitch, float) and pitch.is_integer() else pitch for pitch in pitches]
    if name == "step" and isinstance(value, list):
        if not value:
            raise InputError("step has no number; expected seconds, or an empty cell")
        return [within("step", step, LEAST_STEP, LONGEST_RUN, " s") for step in value]
    return value


@typed
def sweep(
    design: pd.DataFrame | Path | str,
    out: Path | str | None = None,
    rig: Path | str = DEFAULT,
    jobs: int | None = None,
    store: Path | str | None = None,
    progress: bool = False,
) -> pd.DataFrame:
    """Compute every row of a design.

    Parameters
    ----------
    design : DataFrame or path
        Table with one row per scene: fields of `Scene`, parameters of the rig as ``section.field``, a ``preset``, a
        ``rig`` file, a ``name``; ``stop_rule.share_pct``, ``stop_rule.force`` and ``stop_rule.passages`` end a run when
        its contacts have converged (`StopRule`). Of several values of ``step`` the first is used that is neither
        refused nor diverges. An empty cell is the default.
    out : path or None
        Table to write (.csv).
    rig : path or str
        File or name of the rig of rows that name no other.
    jobs : int or None
        Processes; all cores by default.
    store : path or None
        Folder in which rows are stored when they are done; that of ``out`` (``.rows``) by default. A stored row is
        reused while its scene, its rig and the sources that computed it are the same.
    progress : bool
        Show the number of rows left and the remaining time.

    Returns
    -------
    DataFrame
        The design, then ``key``, ``state`` (done, refused, diverged or failed), ``reason``, the columns of
        ``metrics.csv``, the layout of the loop, measures of the whole loop if every link is recorded, and versions and
        hashes of the program.

    Raises
    ------
    InputError
        The design, ``out`` or ``store`` cannot be used. Errors of a row are its ``reason``.
    """
    if out is not None:
        check_ending(out, "out")
        check_writable(out)
        if isinstance(design, (Path, str)) and Path(out).resolve() == Path(design).resolve():
            raise InputError(f"out = {shown(str(out))}: is the design; give another name")
        store = store or Path(out).with_suffix(".rows")
    table = read_design(design)
    by_row = computed_rows(requested_rows(table, str(rig)), jobs, store, "sweep" if progress else "")
    values, outcomes = pd.DataFrame([row["values"] for row in by_row]), pd.DataFrame(by_row)[["key", "state", "reason"]]
    results = pd.concat([table.reset_index(drop=True).apply(_storable), outcomes, values], axis=1)
    if out is not None:
        write_csv(out, results)
    return results


def batches(design: pd.DataFrame | Path | str, rig: Path | str, count: int) -> list[pd.DataFrame]:
    """Split a design into ``count`` batches of equal size that share settled loops; of fewer rows the first repeats."""
    table = read_design(design)
    rows = requested_rows(table, str(rig))
    first = {row.key: k for k, row in reversed(list(enumerate(rows)))}
    order = sorted(first.values(), key=lambda k: rows[k].same_start)
    return [table.iloc[sorted(batch) if len(batch) else order[:1]] for batch in np.array_split(order, count)]


def content_key(design: Path | str, rig: Path | str) -> str:
    """Return a key of the content of a design and of everything that its rows depend on, or the reason of a refusal."""
    try:
        table = read_design(design)
        return key_of(table.to_csv(), [row.key for row in requested_rows(table, str(rig))])
    except InputError as error:
        return str(error)


def _storable(column: pd.Series) -> pd.Series:
    """Return a column as numbers if all of its cells are, as text otherwise."""
    try:
        return pd.to_numeric(column) if column.dtype != bool else column
    except (ValueError, TypeError, OverflowError):
        lists = column.map(lambda cell: cell.tolist() if isinstance(cell, np.ndarray) else cell)
        words = lists.map(lambda cell: " ".join(map(str, cell)) if isinstance(cell, (list, tuple)) else cell)
        return words.map(lambda cell: "" if cell is None or cell != cell else str(cell))


def states_summary(results: pd.DataFrame) -> str:
    """Return the number of rows of each state as text."""
    counts = sorted(results["state"].value_counts().items(), key=lambda item: (item[0] != DONE, item[0]))
    return ", ".join(f"{count} {state}" for state, count in counts)

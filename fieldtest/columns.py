"""Which columns of a source are time and axes; one question asks for all that the names do not tell."""

import re
from itertools import combinations
from typing import NamedTuple

import numpy as np

from fieldtest.logger_text import Source, listed
from fieldtest.sensor_mapping import (
    AXES,
    RATES,
    TIME_UNITS,
    UNIT_ASKED,
    Column,
    SensorMapping,
    choose,
    columns_of,
    parts_of_time,
    time_like,
    unit_of,
)
from trackdyn.inputs.errors import InputError, shown

TIME_KEYS = ("time", "fraction")
_HEAD = 500  # rows that tell most columns from stamps
Columns = dict[str, Column]  # by axis, time, and fraction of a second


class Axis(NamedTuple):
    """Column of an axis, and how its numbers become g."""

    column: Column
    unit: str  # in words
    zero: float  # value of the file that is 0 g
    factor: float  # acceleration of a unit of the file, g, with the sign of the axis


def columns_in(source: Source, mapping: SensorMapping, gravity: float) -> tuple[Columns, dict[str, Axis]]:
    """Columns of time and axes, and how the numbers of these become g.

    Raises `InputError`: a column that may be several, or all that is missing at once.
    """
    path, questions = source.path, []
    columns: Columns = {}
    for key, candidates in choose(source.names, source.units, mapping).items():
        if len(candidates) > 1:
            said = " and ".join(f"{column.position + 1} ({shown(column.name)})" for column in candidates)
            number = f"'#{candidates[0].position + 1}'"
            field = f"time: {number}" if key == "time" else f"axes: {{{key}: {number}}}"
            raise InputError(f"{path}: columns {said} may all be {key}; say which with `{field}`.")
        if not candidates:
            raise InputError(f"{path}: no column {mapping.named[key]!r} for {key}; there are {listed(source.names)}.")
        columns[key] = candidates[0]
    for (key, column), (second, same) in combinations(columns.items(), 2):
        if column.position == same.position:
            raise InputError(f"{path}: column {shown(column.name)} is named for {key} and {second}; name two columns.")
    if "ay" not in columns:
        questions.append(
            f"no column for ay among {listed(source.names)}; name it, `axes: {{ay: NAME}}`, or by its number, "
            "`axes: {ay: 2}`, with a minus to turn its sign, `axes: {ay: -NAME}`"
        )
    axes = _axes(source, columns, mapping, gravity, questions)
    if mapping.time != "none":
        columns |= _times(source, columns, mapping, questions)
    if questions:
        raise InputError(f"{path}: {'; '.join(questions)}.")
    return {key: column for key, column in columns.items() if key in axes or key in TIME_KEYS}, axes


def _axes(
    source: Source, columns: Columns, mapping: SensorMapping, gravity: float, questions: list[str]
) -> dict[str, Axis]:
    """Axes with their units; for a unit of ay, or of a named axis, that is not known a sentence joins ``questions``."""
    axes: dict[str, Axis] = {}
    for axis in AXES:
        if column := columns.get(axis):
            # unit, scale and zero are stated of an axis that is named, and of those with the unit of ay
            stated = axis in mapping.axes or ("ay" in columns and column.unit == columns["ay"].unit)
            zero = mapping.zero.get(axis, 0.0) if isinstance(mapping.zero, dict) else mapping.zero * stated
            if unit := unit_of(column, mapping, stated, gravity):
                axes[axis] = Axis(column, unit[0], zero, column.sign * unit[1])
            elif axis == "ay" or axis in mapping.axes:
                said = f"has the unit {shown(column.unit)}" if column.unit else "does not say its unit"
                questions.append(f"column {shown(column.name)} {said}; {UNIT_ASKED}")
    everything = columns_of(source.names, source.units)
    if "ay" not in columns and not any(unit_of(column, mapping, True, gravity) for column in everything):
        questions.append(UNIT_ASKED)
    return axes


def _times(source: Source, columns: Columns, mapping: SensorMapping, questions: list[str]) -> Columns:
    """The column of time, if there is one, and that of its fractions; what is missing joins ``questions``."""
    used = {column.position for column in columns.values()}
    parts = [part for part in parts_of_time(source.names, source.units) if part[0].position not in used]
    time = columns.get("time")
    whole = {prefix: column for column, prefix, unit in parts if unit == "s"}
    prefixes = {"", time.base} if time else whole.keys()
    fine = [(column, prefix, unit) for column, prefix, unit in parts if unit != "s" and prefix in prefixes]
    if not time and len(fine) == 1:
        time = whole[fine[0][1]]
    elif (
        not time
        and source.names
        and 0 not in used
        and re.fullmatch(r"|.*[=:]", source.names[0])
        and _counts_up(source, 0)
    ):
        time = columns_of(source.names, source.units)[0]
    if not time:
        _ask_time(source, mapping, used, questions)
        return {}
    if time.position in source.dated:
        time = time._replace(unit="s")
    fractions = [
        column._replace(unit=unit) for column, _, unit in fine if _are_fractions(source, time, column, TIME_UNITS[unit])
    ]
    return {"time": time} | ({"fraction": fractions[0]} if len(fractions) == 1 else {})


def _are_fractions(source: Source, time: Column, fine: Column, unit_s: float) -> bool:
    """Whether the stamps are whole seconds, and another column of a finer unit holds what is below a second."""
    seconds, rest = source.numbers([time.position, fine.position], time.position, True).T
    if time.unit not in ("", "s", "sec", "secs") or not np.isfinite(rest).any():
        return False
    return bool((np.nan_to_num(seconds) % 1 == 0).all() and np.nanmin(rest) >= 0 and np.nanmax(rest) * unit_s < 1)


def _counts_up(source: Source, column: int) -> bool:
    """Whether each number of a column is above the one before, by other steps than those of a counter of its rows."""
    step = np.diff(source.stamps(column))
    return step.size > 8 and bool((step > 0).all() and (step != 1).any())


def _ask_time(source: Source, mapping: SensorMapping, used: set[int], questions: list[str]) -> None:
    """Ask for a column of time that is not used but may be one, or for the rate of a file that has none."""
    named = [column for column in time_like(source.names, source.units) if column.position not in used]
    head = source.only(np.arange(len(source.lines)) < _HEAD)
    candidates = [column for column in named if source.rises(column.position)] + [
        column
        for column in columns_of(source.names, source.units)
        if column.position not in used
        and column not in named
        and all(_counts_up(rows, column.position) for rows in (head, source))
    ]
    if candidates:
        questions.append(
            f"the time may be in {' or '.join(column.described for column in candidates[:4])}; say so, "
            f"`time: '#{candidates[0].position + 1}'`, or that it is not, `time: none, rate: HZ`"
        )
    elif mapping.rate is None:
        among = "" if questions else f" among {listed(source.names)}"
        questions.append(
            f"no column of time{among}; name it, `time: NAME`, or give the rate of the samples, "
            f"{RATES[0]:,.0f} to {RATES[1]:,.0f} Hz, `time: none, rate: HZ`"
        )

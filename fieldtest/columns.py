"""What of a source is read, and how; one question asks for all that the names of its columns do not tell."""

import re
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from fieldtest.logger_text import Source, listed, number_in
from fieldtest.sensor_mapping import (
    AXES,
    METRES,
    RATES,
    TIME_UNITS,
    UNIT_ASKED,
    UNITS,
    Column,
    SensorMapping,
    Wanted,
    of_group_in,
    parts_of_time,
    time_like,
)
from fieldtest.stamps import Rate
from trackdyn.inputs.errors import InputError, shown

TIME_KEYS = ("time", "fraction")
_HEAD = 500  # rows that tell most columns from stamps, and, with as many of the others, how many names a column holds
_MOST = 100  # sensors of a table
# of two sensors, not of one: mean length of a run of rows, and how much shorter a step within a sensor's own rows is,
# or how much other their scatter or mean (in standard deviations) is
_SHORT_RUN, _SHORTER, _OTHER_SCATTER, _OTHER_MEAN = 3.0, 1.5, 1.5, 0.5
_UNEVEN, _EVEN = 0.3, 0.1  # standard deviation of the steps between stamps over their mean


class Axis(NamedTuple):
    """Column of an axis, and how its numbers become g."""

    column: Column
    unit: str  # in words
    zero: float  # value of the file that is 0 g
    factor: float  # acceleration of a unit of the file, g, with the sign of the axis


class Reading(NamedTuple):
    """Columns of a source, and how their rows become a record."""

    columns: dict[str, Column]  # by axis, time, and fraction of a second
    axes: dict[str, Axis]
    rate: Any  # `Rate` that is stated, or None: that of the stamps
    range_g: float
    largest: float  # highest value that the sensor writes, g
    bits: int | None  # of raw counts
    window: tuple[float, float]  # first and last instant, s since the first row
    gaps: str | None  # bridge or longest; None: there are none
    resample: bool
    day_first: bool | None  # of dates; None: as they are written


def reading_of(source: Source, mapping: SensorMapping, wanted: Wanted, range_g: float, gravity: float) -> Reading:
    """Say what is read: with one g, m/s2, and the range of the sensor, unless the mapping has it.

    Raises `InputError`: a column that may be several, or all that is missing at once.
    """
    range_g = float(mapping.range or range_g)
    for name, value in (("range_g", range_g), ("gravity", gravity)):
        if not value > 0:
            raise InputError(f"{name} is {value!r}; give a number above zero.")
    questions: list[str] = []
    columns = _chosen(source, wanted)
    if "ay" not in columns:
        questions.append(
            f"no column for ay among {listed(source.names)}; name it, `axes: {{ay: NAME}}`, or by its number, "
            "`axes: {ay: 2}`, with a minus to turn its sign, `axes: {ay: -NAME}`"
        )
    counts = mapping.counts_per_g
    axes: dict[str, Axis] = {}
    unit_stated = "counts" if counts else mapping.unit
    in_g = {"g": 1.0, "mg": 1e-3} | {name: metres / gravity for name, metres in METRES.items()}
    in_g |= {"counts": 1.0 / counts} if counts else {}

    def unit_of(column: Column, stated: bool) -> str | None:
        """Unit as the user states it, or else the header; None if neither states one that is known."""
        own = UNITS.get(column.unit)
        unit = unit_stated if stated or not column.unit or own == unit_stated else None
        return (unit or own) if (unit or own) in in_g else None

    for key in filter(columns.get, AXES):
        # unit, scale and zero are stated of an axis that is named, and of those with the unit of ay
        column, stated = columns[key], key in mapping.axes
        stated |= "ay" in columns and column.unit == columns["ay"].unit
        zero = mapping.zero.get(key, 0.0) if isinstance(mapping.zero, dict) else mapping.zero * stated
        if unit := unit_of(column, stated):
            words = f"counts of 1/{counts:.6g} g" if unit == "counts" else unit
            if column.unit and unit != UNITS.get(column.unit, column.unit):
                words += f" as stated, not in {column.unit} as the file says"
            axes[key] = Axis(column, words, zero, column.sign * in_g[unit])
        elif key == "ay" or key in mapping.axes:
            words = f"has the unit {shown(column.unit)}" if column.unit else "does not say its unit"
            questions.append(f"column {shown(column.name)} {words}; {UNIT_ASKED}")
    if "ay" not in columns and not any(unit_of(column, True) for column in source.columns):
        questions.append(UNIT_ASKED)
    if wanted.timed:
        columns |= _times(source, columns, mapping.rate is not None, questions)
    if questions:
        raise InputError(f"{'; '.join(questions)}.")
    return Reading(
        columns={key: column for key, column in columns.items() if key in axes or key in TIME_KEYS},
        axes=axes,
        rate=Rate(mapping.rate, "as given") if mapping.rate else None,
        range_g=range_g,
        # the highest count is one less than the lowest
        largest=range_g - 1.0 / counts if mapping.bits and counts else range_g,
        bits=mapping.bits,
        window=(mapping.start, np.inf if mapping.to is None else mapping.to),
        gaps=mapping.gaps,
        resample=mapping.resample,
        day_first=None if mapping.dates is None else mapping.dates == "day-first",
    )


def _chosen(source: Source, wanted: Wanted) -> dict[str, Column]:
    """Columns by axis and time. Raises `InputError`: one may be several, or none, or that of another key."""
    columns: dict[str, Column] = {}
    for key, candidates in wanted.choose(source.columns).items():
        if len(candidates) > 1:
            words = " and ".join(f"{column.position + 1} ({shown(column.name)})" for column in candidates)
            number = f"'#{candidates[0].position + 1}'"
            field = f"time: {number}" if key == "time" else f"axes: {{{key}: {number}}}"
            raise InputError(f"columns {words} may all be {key}; say which with `{field}`.")
        if not candidates:
            raise InputError(f"no column {wanted.named[key]!r} for {key}; there are {listed(source.names)}.")
        columns[key] = candidates[0]
    for (key, column), (second, same) in combinations(columns.items(), 2):
        if column.position == same.position:
            raise InputError(f"column {shown(column.name)} is named for {key} and {second}; name two columns.")
    return columns


def _times(source: Source, columns: dict[str, Column], rated: bool, questions: list[str]) -> dict[str, Column]:
    """The column of time, if there is one, and that of its fractions; what is missing joins ``questions``."""
    used = {column.position for column in columns.values()}
    free = [column for column in source.columns if column.position not in used]
    parts, time = parts_of_time(free), columns.get("time")
    whole = {prefix: column for column, prefix, unit in parts if unit == "s"}
    prefixes = {"", time.base} if time else whole.keys()
    fine = [(column, prefix, unit) for column, prefix, unit in parts if unit != "s" and prefix in prefixes]
    if not time and len(fine) == 1:
        time = whole[fine[0][1]]
    elif not time and free and not free[0].position and re.fullmatch(r"|.*[=:]", free[0].name) and _counts(source, 0):
        time = free[0]
    if not time:
        _ask_time(source, free, rated, questions)
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


def _counts(source: Source, column: int) -> bool:
    """Whether each number of a column is above the one before, by other steps than those of a counter of its rows."""
    step = np.diff(source.stamps(column))
    return step.size > 8 and bool((step > 0).all() and (step != 1).any())


def _rises(source: Source, column: int) -> bool:
    """Whether a column may hold stamps: dates, words, or numbers that rise and never fall."""
    values = source.stamps(column)
    return values.size < 2 or bool((np.diff(values) >= 0).all() and np.ptp(values) > 0)


def _ask_time(source: Source, free: list[Column], rated: bool, questions: list[str]) -> None:
    """Ask for a column of time that is not used but may be one, or for the rate of a file that has none."""
    named = time_like(free)
    head = source.only(np.arange(len(source.lines)) < _HEAD)
    candidates = [column for column in named if _rises(source, column.position)] + [
        column
        for column in free
        if column not in named and all(_counts(rows, column.position) for rows in (head, source))
    ]
    if candidates:
        questions.append(
            f"the time may be in {' or '.join(column.described for column in candidates[:4])}; say so, "
            f"`time: '#{candidates[0].position + 1}'`, or that it is not, `time: none, rate: HZ`"
        )
    elif not rated:
        among = "" if questions else f" among {listed(source.names)}"
        questions.append(
            f"no column of time{among}; name it, `time: NAME`, or give the rate of the samples, "
            f"{RATES[0]:,.0f} to {RATES[1]:,.0f} Hz, `time: none, rate: HZ`"
        )


def rows_of_group(source: Source, group: str) -> Source:
    """The rows of one sensor; all of them where a group is of columns. Raises `InputError`: there is neither."""
    if of_group_in(source.columns, group):
        return source
    for column in range(len(source.columns)):
        chosen = np.array(source.texts(column)) == group
        if chosen.any():
            return source.only(chosen)
    raise InputError(f"no column's name begins with the group {group!r}, and no row holds it.")


def require_one_sensor(source: Source, used: dict[str, Column], values: dict[str, np.ndarray]) -> None:
    """Refuse (`InputError`) rows of several sensors, which would be read as those of one."""
    stamps = [values["time"]] if "time" in values else []
    positions = {column.position for column in used.values()}
    if not stamps:
        timed = {column.position for column in time_like(source.columns)} | source.dated
        fractions = {column.position for column, _, unit in parts_of_time(source.columns) if unit != "s"}
        stamps = [source.stamps(k) for k in timed - fractions - positions]
        stamps = [t for t in stamps if t.size == values["ay"].size]
    rows = np.arange(values["ay"].size)
    seen = source.only((rows < _HEAD) | (rows % (rows.size // _HEAD + 1) == 0))
    for column in set(range(len(source.columns))) - positions - source.dated:
        if not 2 <= len(set(seen.texts(column))) <= _MOST:
            continue
        texts = source.texts(column)
        names = sorted(set(texts))
        if not len(names) <= _MOST or len(texts) <= 2 * len(names):
            continue
        numbers = [number for name in names if np.isfinite(number := number_in(name))]
        codes, measured = np.array(list(map(names.index, texts))), any(number % 1 for number in numbers)
        if measured or not _tells(codes, values["ay"], stamps, len(numbers) < len(names)):
            continue
        first = next(filter(None, names))
        raise InputError(
            f"column {column + 1} ({shown(source.columns[column].name)}) says of which sensor a row is "
            f"({', '.join(map(shown, names))}); choose the rows of one, `group: {first}`."
        )


def _tells(codes: np.ndarray, ay: np.ndarray, stamps: list[np.ndarray], words: bool) -> bool:
    """Whether rows with another code are those of another sensor."""
    for t in stamps:
        # taken sensor by sensor the stamps rise, which they do not, or stand, as the rows are written
        step, own = np.diff(t), np.concatenate([np.diff(t[codes == code]) for code in set(codes)])
        if ((step < 0).any() and not (own < 0).any()) or (words and (step <= 0).any() and not (own <= 0).any()):
            return True
    change = np.flatnonzero(codes[1:] != codes[:-1])
    returns = change[codes[change + 1] == codes[0]]
    period = int(returns[0]) + 1 if returns.size else codes.size
    periodic = period < codes.size / 2 and (codes[period:] == codes[:-period]).all()
    own = pd.Series(ay).groupby(codes)
    jumps = np.nanstd(np.diff(ay)[change]) > _SHORTER * np.nanstd(own.diff())
    if codes.size > _SHORT_RUN * (1 + change.size):
        return bool(periodic and jumps)
    if (words and periodic) or jumps:
        return True
    whole = float(np.nanstd(ay))
    spreads, means = own.std(), own.mean()
    if np.ptp(means) > _OTHER_MEAN * whole or spreads.max() > _OTHER_SCATTER * spreads.min():
        return True
    return any(_scatter(t) > _UNEVEN and max(_scatter(t[codes == code]) for code in set(codes)) < _EVEN for t in stamps)


def _scatter(t: np.ndarray) -> float:
    step = np.diff(t)
    return float(np.std(step) / np.mean(step)) if step.size and np.mean(step) > 0 else 0.0

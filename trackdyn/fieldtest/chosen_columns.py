"""Columns and units of a record; one message asks for everything that names of columns do not tell."""

import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pandas as pd

from trackdyn.fieldtest.logger_text import Source, joined, number_in
from trackdyn.fieldtest.sensor_mapping import (
    AXES,
    RATES,
    TIME_UNITS,
    UNITS,
    Column,
    SensorMapping,
    candidates,
    named,
    of_group_in,
    parts_of_time,
    stated_columns,
    time_like,
)
from trackdyn.fieldtest.stamps import NO_STAMPS, is_index
from trackdyn.inputs.errors import InputError, shown

TIME_KEYS = ("time", "fraction")
_METRES = {"m/s2": 1.0, "cm/s2": 1e-2, "mm/s2": 1e-3}  # m/s2 in each
_UNIT_ASKED = f"give its unit, `unit: g`, {', '.join(['mg', *_METRES])}, or the counts or mV per g, `scale: N`, or "
_UNIT_ASKED += "`range: G, bits: N`"
_HEAD = 500  # rows that tell most columns from stamps and, with as many of the others, how many codes a column has
_MOST = 16  # sensors of a table
_FEWEST = 20  # rows that tell several samples per row
# of two sensors: longest mean run of rows, and least ratio of the steps between all rows to those within a sensor's, of
# scatters, or difference of means (standard deviations); of one: least ratio of steps within to those between rows
_SHORT_RUN, _SHORTER, _OTHER_SCATTER, _OTHER_MEAN, _ONE = 3.0, 1.5, 1.5, 0.5, 1.25
# stamps of one sensor: share of the steps near the median, relative distance from it, and ratio of their mean to it
_MOST_STEPS, _NEAR, _LONGER = 0.8, 0.25, 1.3
# of samples in one row: largest difference of means (standard deviations) and of spreads of columns, least ratio of
# steps across several columns to those between neighbours, and largest ratio of these to those to the next row
_SAME, _CLOSER, _ALIKE = 0.25, 1.2, 1.3


class Axis(NamedTuple):
    """Column of an axis, and the conversion of its numbers to g."""

    column: Column
    unit: str  # as text
    zero: float  # value of the file that is 0 g
    factor: float  # acceleration of a unit of the file, g, with the sign of the axis


def chosen_columns(source: Source, mapping: SensorMapping, gravity: float) -> tuple[dict[str, Column], dict[str, Axis]]:
    """Return columns by ``time``, ``fraction`` (of a second) and axis, and the axes; or ask all in one `InputError`."""
    questions: list[str] = []
    columns = _by_key(source, mapping, questions)
    _require_a_sample_a_row(source, columns)
    if "ay" not in columns:
        remedy = "name it, `axes: {ay: NAME}`, or give its number, `axes: {ay: 2}`, with a minus to flip its sign, "
        questions.append(f"no column for ay among {joined(source.names)}; {remedy}`axes: {{ay: -NAME}}`")
    counts = mapping.counts_per_g
    axes: dict[str, Axis] = {}
    unit_stated = "counts" if counts else mapping.unit
    in_g = {"g": 1.0, "mg": 1e-3} | {name: metres / gravity for name, metres in _METRES.items()}
    in_g |= {"counts": 1.0 / counts} if counts else {}

    def unit_of(column: Column, stated: bool) -> str | None:
        """Return the unit that the user states, or else the header's; None if neither is known."""
        own = UNITS.get(column.unit)
        unit = unit_stated if stated or not column.unit or own == unit_stated else None
        return (unit or own) if (unit or own) in in_g else None

    for key in filter(columns.get, AXES):
        # unit, scale and zero are stated for an axis that is named, and for those with the unit of ay
        column, stated = columns[key], key in mapping.axes
        stated |= "ay" in columns and column.unit == columns["ay"].unit
        zero = mapping.zero.get(key, 0.0) if isinstance(mapping.zero, dict) else mapping.zero * stated
        if unit := unit_of(column, stated):
            words = f"counts of 1/{counts:.6g} g" if unit == "counts" else unit
            if column.unit and unit != UNITS.get(column.unit, column.unit):
                words += f" as stated, not in {column.unit} as in the file"
            axes[key] = Axis(column, words, zero, column.sign * in_g[unit])
        elif key == "ay" or key in mapping.axes:
            words = f"has the unit {shown(column.unit)}" if column.unit else "states no unit"
            questions.append(f"column {shown(column.name)} {words}; {_UNIT_ASKED}")
    if "ay" not in columns and not any(unit_of(column, True) for column in source.columns):
        questions.append(_UNIT_ASKED)
    if mapping.turn and "ax" not in axes:
        questions.append("to turn ay, ax must be read, too; name its column, `axes: {ax: NAME}`")
    if mapping.time != "none":
        columns |= _times(source, columns, mapping.rate is not None, questions)
    if questions:
        raise InputError(f"{'; '.join(questions)}.")
    return {key: column for key, column in columns.items() if key in axes or key in TIME_KEYS}, axes


def _by_key(source: Source, mapping: SensorMapping, questions: list[str]) -> dict[str, Column]:
    """Return columns by axis and ``time``, or `InputError`; a choice among several is added to ``questions``."""
    choices = candidates(source.columns, mapping)
    if key := next((key for key, of_key in choices.items() if not of_key), ""):
        raise InputError(f"no column {stated_columns(mapping)[key]!r} for {key}; there are {joined(source.names)}.")
    columns = {key: of_key[0] for key, of_key in choices.items()}
    if several := {key: of_key for key, of_key in choices.items() if len(of_key) > 1}:
        words = [f"{_numbered(of_key)} may all be {key}" for key, of_key in several.items()]
        numbers = {key: f"{key}: '#{of_key[0].position + 1}'" for key, of_key in several.items()}
        fields = [numbers.pop("time")] if "time" in numbers else []
        fields += [f"axes: {{{', '.join(numbers.values())}}}"] if numbers else []
        questions.append(f"columns {', '.join(words)}; choose with `{', '.join(fields)}`")
    for (key, column), (second, same) in combinations(columns.items(), 2):
        if column.position == same.position:
            raise InputError(f"column {shown(column.name)} is named for {key} and {second}; name two columns.")
    return columns


def _numbered(columns: list[Column]) -> str:
    return " and ".join(f"{column.position + 1} ({shown(column.name)})" for column in columns)


def _require_a_sample_a_row(source: Source, columns: dict[str, Column]) -> None:
    """Refuse (`InputError`) rows of several samples, of which one column would be read."""
    count, head = len(source.lines), None
    others = {column.position for key, column in columns.items() if key != "ay"} | source.dated
    alike = [re.sub(r"\d+", "1", column.name) for column in source.columns]
    for start in [columns["ay"].position] if "ay" in columns else range(min(len(alike), 3)):
        same = [k for k in range(len(alike)) if k not in others and alike[k] == alike[start]]
        for every in range(1, 5):  # a row of columns without names may have several signals in turn
            positions = [k for k in same if not (k - start) % every] if every == 1 or alike[start] == "1" else []
            if len(positions) < 2:
                continue
            head = head or source.only(np.arange(count) < min(4 * _HEAD, count - 1))  # the last row may be shorter
            row = [head.stamps(k) for k in positions]
            if len({values.size for values in row}) == 1 and row[0].size >= _FEWEST and _are_one_signal(row):
                first, last = (source.columns[k].described for k in (positions[0], positions[-1]))
                rows = f"each row has {len(row)} samples, written row by row"
                remedy = "write one per row, as docs/your-loggers-file.md shows"
                raise InputError(f"{first} to {last} continue one another and the next row: {rows}; {remedy}.")


def _are_one_signal(row: list[np.ndarray]) -> bool:
    """Return whether columns, (N,) each, are samples of one signal in turn, which the next row continues."""
    spread, mean = np.std(row, axis=1), np.mean(row, axis=1)
    if max(spread) >= (1 + _SAME) * min(spread) or np.ptp(mean) >= _SAME * min(spread):
        return False

    def size(steps: np.ndarray) -> float:  # a few impacts count less than in a root mean square
        return float(np.abs(steps).mean())

    within, on = size(np.diff(row, axis=0)), size(row[0][1:] - row[-1][:-1])
    far = max(size(np.diff(row[0])), *(size(values - row[0]) for values in row[1:]))
    equal = max(within, on) < _ALIKE * min(within, on)
    return bool(equal and within < min(spread) and _CLOSER * max(within, on) < far)


def _times(source: Source, columns: dict[str, Column], rated: bool, questions: list[str]) -> dict[str, Column]:
    """Return the column of time, if any, and that of its fractions; a missing one is added to ``questions``."""
    used = {column.position for column in columns.values()}
    free = [column for column in source.columns if column.position not in used]
    parts, time = parts_of_time(free), columns.get("time")
    whole = {prefix: column for column, prefix, unit in parts if unit == "s"}
    prefixes = {"", time.base} if time else whole.keys()
    fine = [(column, prefix, unit) for column, prefix, unit in parts if unit != "s" and prefix in prefixes]
    if not time and len(fine) == 1:
        time = whole[fine[0][1]]
    elif not time and free and not free[0].position:
        # of an index, or of cells such as t:0.001; LabVIEW has a name for it
        unnamed = re.fullmatch(r"|.*[=:]", free[0].name) and _counts(source, 0) and not _is_index(source, free[0])
        time = free[0] if unnamed or free[0].name == "X_Value" else None
    if not time:
        _ask_time(source, free, rated, questions)
        return {}
    if time.position in source.dated:
        time = time._replace(unit="s")
    # whole seconds, and a column of a finer unit with the rest below a second
    fractions = []
    for column, _, unit in fine:
        seconds, rest = source.numbers([time.position, column.position], time.position).T
        below = np.isfinite(rest).any() and np.nanmin(rest) >= 0 and np.nanmax(rest) * TIME_UNITS[unit] < 1
        if time.unit in ("", "s", "sec", "secs") and below and (np.nan_to_num(seconds) % 1 == 0).all():
            fractions.append(column._replace(unit=unit))
    return {"time": time} | ({"fraction": fractions[0]} if len(fractions) == 1 else {})


def _counts(source: Source, column: int) -> bool:
    """Return whether the numbers of a column rise, by other steps than those of row numbers."""
    step = np.diff(source.stamps(column))
    return step.size > 8 and bool((step > 0).all() and (step != 1).any())


def _is_index(source: Source, column: Column) -> bool:
    """Return whether a column without a name and a unit may be row numbers."""
    return not (column.name or column.unit) and is_index(source.stamps(column.position))


def _ask_time(source: Source, free: list[Column], rated: bool, questions: list[str]) -> None:
    """Ask for a column of time that is not used but may be one, or for the rate of a file that has none."""
    likely, rising = time_like(free), []
    head = source.only(np.arange(len(source.lines)) < _HEAD)
    for column in likely:
        values = source.stamps(column.position)
        if values.size < 2 or ((np.diff(values) >= 0).all() and np.ptp(values) > 0):  # dates, words, or stamps
            rising.append(column)
    for column in free:
        counts = column not in likely and all(_counts(rows, column.position) for rows in (head, source))
        if counts and not (rated and _is_index(source, column)):
            rising.append(column)
    if rising:
        remedy = f"choose it, `time: '#{rising[0].position + 1}'`, or read no stamps, {NO_STAMPS}"
        questions.append(f"the time may be in {' or '.join(column.described for column in rising[:4])}; {remedy}")
    elif not rated:
        among = "" if questions else f" among {joined(source.names)}"
        rate = f"the rate of the samples, {RATES[0]:,.0f} to {RATES[1]:,.0f} Hz, {NO_STAMPS}"
        questions.append(f"no column of time{among}; name it, `time: NAME`, or give {rate}")


def rows_of_group(source: Source, mapping: SensorMapping) -> Source:
    """Return the rows of the mapping's group, or `InputError`; all of them where it is a group of columns, or none."""
    if mapping.group in (None, "none") or of_group_in(source.columns, mapping.group):
        return source
    for code in re.split(",(?=[^,=]+=)", mapping.group):
        source = _rows_of_code(source, mapping, code)
    return source


def _rows_of_code(source: Source, mapping: SensorMapping, group: str) -> Source:
    """Return the rows of one code, ``2`` or ``node=2``, as `rows_of_group` does."""
    name, _, code = group.rpartition("=")
    among = named(source.columns, name) if name else []
    if not among:
        of_time = {column.position for column in time_like(source.columns)} | source.dated
        among, code = [column for column in source.columns if column.position not in of_time], group
    rows_of = {column.position: np.array(source.texts(column.position)) == code for column in among}
    if not any(rows.any() for rows in rows_of.values()):  # pandas writes 2.0 for 2
        number = number_in(code)
        for column in among:
            same = [text for text in set(source.texts(column.position)) if number_in(text) == number]
            rows_of[column.position] = np.isin(source.texts(column.position), same)
    holders = [column for column in among if rows_of[column.position].any()]
    if len(holders) > 1:
        used = {key: columns[0] for key, columns in candidates(source.columns, mapping).items() if len(columns) == 1}
        with suppress(InputError):
            read = {key: used[key].position for key in used.keys() & {"ay", "time"}}
            values = {key: source.numbers([k], k)[:, 0] for key, k in read.items()}
            apart = [column for column, _ in _sensor_columns(source, used, values)] if "ay" in values else []
            unused = [column for column in holders if column not in used.values()]
            holders = [column for column in holders if column in apart] or unused
    if not holders:
        raise InputError(f"no column's name begins with the group {group!r}, and no row has it.")
    if len(holders) > 1:
        fields = " or ".join(f"`group: {_quoted(_group(source, column, code))}`" for column in holders[:4])
        raise InputError(f"columns {_numbered(holders)} have {code!r}; choose with {fields}.")
    return replace(source.only(rows_of[holders[0].position]), group=_group(source, holders[0], code))


def _group(source: Source, column: Column, code: str) -> str:
    """Return the group of a code in a column, among rows that are chosen already, as a mapping names it."""
    return ",".join(filter(None, (source.group, f"{column.name or f'#{column.position + 1}'}={code}")))


def _quoted(text: str) -> str:
    """Quote a text for YAML in a sentence."""
    return text if re.fullmatch(r"\w[\w=.-]*", text) else "'" + text.replace("'", "''") + "'"


def require_one_sensor(source: Source, used: dict[str, Column], values: dict[str, np.ndarray]) -> None:
    """Refuse (`InputError`) rows of several sensors, which would be read as those of one."""
    for column, codes in _sensor_columns(source, used, values):
        group = _quoted(_group(source, column, next(filter(None, codes))))
        remedy = f"choose the rows of one, `group: {group}`, or, if all are of one sensor, `group: none`"
        sensors = f"the sensor of each row ({', '.join(map(shown, codes))})"
        raise InputError(f"column {_numbered([column])} names {sensors}; {remedy}.")


def _sensor_columns(
    source: Source, used: dict[str, Column], values: dict[str, np.ndarray]
) -> Iterator[tuple[Column, list[str]]]:
    """Yield columns whose few codes tell several sensors apart, and these; ``values`` are numbers of ``used``."""
    stamps = [values["time"]] if "time" in values else []
    positions = {column.position for column in used.values()}
    if not stamps:
        timed = {column.position for column in time_like(source.columns)} | source.dated
        fractions = {column.position for column, _, unit in parts_of_time(source.columns) if unit != "s"}
        stamps = [source.stamps(k) for k in timed - fractions - positions]
        stamps = [t for t in stamps if t.size == values["ay"].size]
    rows = np.arange(values["ay"].size)
    seen = source.only((rows < _HEAD) | (rows % (rows.size // _HEAD + 1) == 0))
    for column in source.columns:
        if column.position in positions | source.dated or not 2 <= len(set(seen.texts(column.position))) <= _MOST:
            continue
        texts = source.texts(column.position)
        numbers = {text: number_in(text) for text in set(texts)}
        names = sorted(numbers, key=lambda text: (np.nan_to_num(numbers[text], nan=np.inf), text))
        if len(names) > _MOST or len(texts) <= 2 * len(names) or any(number % 1 > 0 for number in numbers.values()):
            continue
        codes = np.array(list(map(names.index, texts)))
        if _interleaved(codes, values["ay"], stamps, not all(map(np.isfinite, numbers.values()))):
            yield column, names


def _interleaved(codes: np.ndarray, ay: np.ndarray, stamps: list[np.ndarray], words: bool) -> bool:
    """Return whether rows with different codes are of different sensors, by their stamps or by even ones and ``ay``."""
    groups = [np.flatnonzero(codes == code) for code in set(codes)]
    change = np.flatnonzero(codes[1:] != codes[:-1])
    for t in stamps:
        # sensor by sensor the stamps rise, but in the order of the rows they fall or repeat
        step, own = np.diff(t), np.concatenate([np.diff(t[rows]) for rows in groups])
        falls, repeats = np.count_nonzero(step < 0), np.count_nonzero(step <= 0)
        # numbers may count rows or follow a temperature: a defect of the stamps is no sensor, nor are coarse ones
        as_often = words or (step.any() and np.median(own) < (1 + _NEAR) * np.median(np.abs(step[step != 0])))
        fewest = 1 if words else change.size / 4
        apart = falls >= fewest and not (own < 0).any()
        if apart or (repeats >= fewest and as_often and not (own <= 0).any()):
            return True
    own = pd.Series(ay).groupby(codes)
    across, within = np.nanstd(np.diff(ay)[change]), np.nanstd(own.diff())
    alternate = codes.size <= _SHORT_RUN * (1 + change.size)
    if not (alternate and any(all(_even(t[rows]) for rows in groups) for t in stamps or [np.arange(codes.size)])):
        returns = change[codes[change + 1] == codes[0]]
        period = int(returns[0]) + 1 if returns.size else codes.size
        periodic = period < codes.size / 2 and (codes[period:] == codes[:-period]).all()
        return bool(periodic and across > _SHORTER * within)
    if words or across > _SHORTER * within or _ONE * across < within:
        return bool(_ONE * across >= within)
    scatter = 3 / min(map(len, groups)) ** 0.5  # of means and of spreads, in standard deviations
    spreads, means = own.std(), own.mean()
    other_spread = spreads.max() > (_OTHER_SCATTER + scatter) * spreads.min()
    return bool(np.ptp(means) > (_OTHER_MEAN + scatter) * np.nanstd(ay) or other_spread)


def _even(t: np.ndarray) -> bool:
    step = np.diff(t)
    usual = np.median(step) if step.size else 0.0
    near = np.abs(step - usual) <= _NEAR * usual
    return bool(usual > 0 and near.mean() >= _MOST_STEPS and step.mean() <= _LONGER * usual)

"""What of a source is read, and how; one question asks for all that the names of its columns do not tell."""

import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from trackdyn.fieldtest.logger_text import Source, listed, number_in
from trackdyn.fieldtest.sensor_mapping import (
    AXES,
    METRES,
    RATES,
    TIME_UNITS,
    UNIT_ASKED,
    UNITS,
    Column,
    SensorMapping,
    Wanted,
    named,
    of_group_in,
    parts_of_time,
    time_like,
)
from trackdyn.fieldtest.stamps import Rate, is_index
from trackdyn.inputs.errors import InputError, shown

TIME_KEYS = ("time", "fraction")
_HEAD = 500  # rows that tell most columns from stamps, and, with as many of the others, how many names a column holds
_MOST = 16  # sensors of a table
_FEWEST = 20  # rows that tell several samples a row
# of two sensors, not of one: mean length of a run of rows, and how much shorter a step within a sensor's own rows is,
# or how much other their scatter or mean (in standard deviations) is; of one: how much shorter the step between rows is
_SHORT_RUN, _SHORTER, _OTHER_SCATTER, _OTHER_MEAN, _ONE = 3.0, 1.5, 1.5, 0.5, 1.25
# stamps of one sensor: share of the steps near the median one, the distance from it, and their mean over it
_MOST_STEPS, _NEAR, _LONGER = 0.8, 0.25, 1.3
# of samples side by side: how far means (in standard deviations) and spreads of columns lie apart at most, how much
# shorter than across several the steps from one to the next are, and how equal these and that to the next row
_SAME, _CLOSER, _ALIKE = 0.25, 1.2, 1.3


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
    turn: float  # of the axes about z, deg
    one_sensor: bool  # all rows are of it, whatever their columns hold


def reading_of(source: Source, mapping: SensorMapping, wanted: Wanted, range_g: float, gravity: float) -> Reading:
    """Say what is read: with one g, m/s2, and the range of the sensor, unless the mapping has it.

    Raises `InputError`: a column that may be several, or all that is missing at once.
    """
    range_g = float(mapping.range or range_g)
    for name, value in (("range_g", range_g), ("gravity", gravity)):
        if not value > 0:
            raise InputError(f"{name} is {value!r}; give a number above zero.")
    questions: list[str] = []
    columns = _chosen(source, wanted, questions)
    _require_a_sample_a_row(source, columns)
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
    if mapping.turn and "ax" not in axes:
        questions.append("to turn ay, ax must be read, too; name its column, `axes: {ax: NAME}`")
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
        turn=float(mapping.turn),
        one_sensor=mapping.group == "none",
    )


def _chosen(source: Source, wanted: Wanted, questions: list[str]) -> dict[str, Column]:
    """Columns by axis and time; that one may be several joins ``questions``.

    Raises `InputError`: one is none, or that of another key.
    """
    columns: dict[str, Column] = {}
    several: dict[str, list[Column]] = {}
    for key, candidates in wanted.choose(source.columns).items():
        if not candidates:
            raise InputError(f"no column {wanted.named[key]!r} for {key}; there are {listed(source.names)}.")
        columns[key] = candidates[0]
        several |= {key: candidates} if len(candidates) > 1 else {}
    if several:
        words = [
            " and ".join(f"{column.position + 1} ({shown(column.name)})" for column in candidates)
            + f" may all be {key}"
            for key, candidates in several.items()
        ]
        numbers = {key: f"{key}: '#{candidates[0].position + 1}'" for key, candidates in several.items()}
        fields = [numbers.pop("time")] if "time" in numbers else []
        fields += [f"axes: {{{', '.join(numbers.values())}}}"] if numbers else []
        questions.append(f"columns {', '.join(words)}; say which with `{', '.join(fields)}`")
    for (key, column), (second, same) in combinations(columns.items(), 2):
        if column.position == same.position:
            raise InputError(f"column {shown(column.name)} is named for {key} and {second}; name two columns.")
    return columns


def _require_a_sample_a_row(source: Source, columns: dict[str, Column]) -> None:
    """Refuse (`InputError`) rows of several samples, of which one column would be read."""
    count, head = len(source.lines), None
    others = {column.position for key, column in columns.items() if key != "ay"} | source.dated
    alike = [re.sub(r"\d+", "1", column.name) for column in source.columns]
    for start in [columns["ay"].position] if "ay" in columns else range(min(len(alike), 3)):
        same = [k for k in range(len(alike)) if k not in others and alike[k] == alike[start]]
        for every in range(1, 5):  # a row of columns without names may hold several signals in turn
            positions = [k for k in same if not (k - start) % every] if every == 1 or alike[start] == "1" else []
            if len(positions) < 2:
                continue
            head = head or source.only(np.arange(count) < min(4 * _HEAD, count - 1))  # the last row may be shorter
            row = [head.stamps(k) for k in positions]
            if len({values.size for values in row}) == 1 and _are_one_signal(row):
                first, last = (source.columns[k].described for k in (positions[0], positions[-1]))
                raise InputError(
                    f"{first} to {last} join on to one another and to the next row: each row holds {len(row)} "
                    "samples, written row by row; write one a row, as docs/your-loggers-file.md shows."
                )


def _are_one_signal(row: list[np.ndarray]) -> bool:
    """Whether columns, (N,) each, are samples of one signal in turn, of which the next row goes on."""
    spread, mean = [values.std() for values in row], [values.mean() for values in row]
    if row[0].size < _FEWEST or max(spread) >= (1 + _SAME) * min(spread) or np.ptp(mean) >= _SAME * min(spread):
        return False
    within, on = _size(np.diff(row, axis=0)), _size(row[0][1:] - row[-1][:-1])
    far = max(_size(np.diff(row[0])), *(_size(values - row[0]) for values in row[1:]))
    equal = max(within, on) < _ALIKE * min(within, on)
    return bool(equal and within < min(spread) and _CLOSER * max(within, on) < far)


def _size(steps: np.ndarray) -> float:
    """Mean size: a few impacts make up the most of a root of squares."""
    return float(np.abs(steps).mean())


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
    elif not time and free and not free[0].position:
        # of an index, or of cells that say what they hold; LabVIEW has a name for it
        unnamed = re.fullmatch(r"|.*[=:]", free[0].name) and _counts(source, 0) and not _is_index(source, free[0])
        time = free[0] if unnamed or free[0].name == "X_Value" else None
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


def _is_index(source: Source, column: Column) -> bool:
    """Whether a column without a name and a unit may hold the numbers of the rows."""
    return not (column.name or column.unit) and is_index(source.stamps(column.position))


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
        if column not in named
        and all(_counts(rows, column.position) for rows in (head, source))
        and not (rated and _is_index(source, column))
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


def rows_of_group(source: Source, wanted: Wanted) -> Source:
    """The rows of one sensor; all of them where a group is of columns, or none.

    Raises `InputError`: no row is of that group, or several columns may name it.
    """
    if wanted.group in (None, "none") or of_group_in(source.columns, wanted.group):
        return source
    for code in re.split(",(?=[^,=]+=)", wanted.group):
        source = _rows_of_code(source, wanted, code)
    return source


def _rows_of_code(source: Source, wanted: Wanted, group: str) -> Source:
    """The rows of one code, ``2`` or ``node=2``, as `rows_of_group` says."""
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
        chosen = wanted.choose(source.columns)
        used = {key: columns[0] for key, columns in chosen.items() if len(columns) == 1}
        with suppress(InputError):
            values = {
                key: source.numbers([used[key].position], used[key].position)[:, 0]
                for key in used
                if key in ("ay", "time")
            }
            apart = [column for column, _ in _sensor_columns(source, used, values)] if "ay" in values else []
            holders = [column for column in holders if column in apart] or [
                column for column in holders if column not in used.values()
            ]
    if not holders:
        raise InputError(f"no column's name begins with the group {group!r}, and no row holds it.")
    if len(holders) > 1:
        words = " and ".join(f"{column.position + 1} ({shown(column.name)})" for column in holders)
        fields = " or ".join(f"`group: {_quoted(_group(source, column, code))}`" for column in holders[:4])
        raise InputError(f"columns {words} hold {code!r}; say which is meant, {fields}.")
    return replace(source.only(rows_of[holders[0].position]), group=_group(source, holders[0], code))


def _group(source: Source, column: Column, code: str) -> str:
    """Rows of a code in a column, of those that are chosen already, as a mapping names them."""
    return ",".join(filter(None, (source.group, f"{column.name or f'#{column.position + 1}'}={code}")))


def _quoted(text: str) -> str:
    """A text as YAML and a sentence hold it."""
    return text if re.fullmatch(r"\w[\w=.-]*", text) else "'" + text.replace("'", "''") + "'"


def require_one_sensor(source: Source, used: dict[str, Column], values: dict[str, np.ndarray]) -> None:
    """Refuse (`InputError`) rows of several sensors, which would be read as those of one."""
    for column, codes in _sensor_columns(source, used, values):
        group = _quoted(_group(source, column, next(filter(None, codes))))
        raise InputError(
            f"column {column.position + 1} ({shown(column.name)}) says of which sensor a row is "
            f"({', '.join(map(shown, codes))}); choose the rows of one, `group: {group}`, or, if all are of one "
            "sensor, `group: none`."
        )


def _sensor_columns(
    source: Source, used: dict[str, Column], values: dict[str, np.ndarray]
) -> Iterator[tuple[Column, list[str]]]:
    """Columns with few codes that tell the rows of several sensors apart, and these codes.

    ``values`` are numbers of the columns that are ``used``, (N,), by axis and time.
    """
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
        if _tells(codes, values["ay"], stamps, not all(map(np.isfinite, numbers.values()))):
            yield column, names


def _tells(codes: np.ndarray, ay: np.ndarray, stamps: list[np.ndarray], words: bool) -> bool:
    """Whether rows with another code are those of another sensor: by stamps of its own, or even ones and its signal."""
    groups = [np.flatnonzero(codes == code) for code in set(codes)]
    change = np.flatnonzero(codes[1:] != codes[:-1])
    for t in stamps:
        # taken sensor by sensor the stamps rise, which they do not, or stand, as the rows are written
        step, own = np.diff(t), np.concatenate([np.diff(t[rows]) for rows in groups])
        falls, stands = np.count_nonzero(step < 0), np.count_nonzero(step <= 0)
        # numbers may count rows or follow a temperature: a defect of the stamps is no sensor, nor are coarse ones
        as_often = words or np.median(own) < (1 + _NEAR) * np.median(np.abs(step[step != 0]))
        if (falls >= (1 if words else change.size / 4) and not (own < 0).any()) or (
            stands >= (1 if words else change.size / 4) and as_often and not (own <= 0).any()
        ):
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

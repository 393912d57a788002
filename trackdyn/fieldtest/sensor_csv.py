"""Records of an acceleration sensor: a logger's file as time in s and three axes in g.

Files have many forms. One with a single meaning is read, and the record lists what was done; anything ambiguous is
refused with the option that decides it, because a gap, a wrong rate or a wrong unit would change all results.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from trackdyn.fieldtest import samples, stamps
from trackdyn.fieldtest.chosen_columns import TIME_KEYS, Axis, chosen_columns, require_one_sensor, rows_of_group
from trackdyn.fieldtest.header import layout_of
from trackdyn.fieldtest.logger_text import Source, joined, rows_of, table_of
from trackdyn.fieldtest.sensor_mapping import AXES, TIME_UNITS, Column, SensorMapping, time_like
from trackdyn.fieldtest.text_file import read_logger_text
from trackdyn.inputs.errors import InputError, naming, shown
from trackdyn.inputs.files import write_text
from trackdyn.inputs.validation import typed

BEYOND = 1.0001  # of the range of a sensor: rounding
NEAR_HALF = 0.02  # relative distance of the mean of a converter's counts from half of them
MOST_MESSAGES = 0.5  # largest share of rows that are no samples in a record


@dataclass(frozen=True)
class SensorRecord:
    """One record of the sensor (Eq. 40), N samples."""

    path: Path  # file it was read from
    time: np.ndarray  # (N,) time from its first sample on, s
    # ax, ay, az: (N,) specific force in the sensor's axes, g; None for an axis that the file lacks
    ax: np.ndarray | None
    ay: np.ndarray
    az: np.ndarray | None
    rate: float  # sampling rate, Hz
    clipped: int  # number of rows with an axis at the end of the sensor's range, or at a value where it is saturated
    # how it was read, by name: rows, columns, time, rate, steps, dropped, clipped
    done: Mapping[str, str] = field(default_factory=dict, compare=False)
    # column of each axis, with a minus in front where its sign was flipped
    columns: Mapping[str, str] = field(default_factory=dict, compare=False)
    # by axis, value of the file that is 0 g, and g per unit of the file, with the sign of the axis
    scales: Mapping[str, tuple[float, float]] = field(default_factory=dict, compare=False)
    turn: float = field(default=0.0, compare=False)  # of the axes about z, relative to those of the file, deg
    doubts: tuple[str, ...] = field(default=(), compare=False)  # warnings on the record
    synthetic: bool = field(default=False, compare=False)  # True if a comment of the file states that it is synthetic

    @property
    def seconds(self) -> float:
        """Length of the record, s."""
        return self.ay.size / self.rate

    @property
    def wraps(self) -> bool:
        """True if the signal wraps at the end of its range, so that no other check applies."""
        return any(samples.WRAPS in doubt for doubt in self.doubts)

    def averaged(self, rate: float) -> "SensorRecord":
        """Return the record of a sensor of a lower ``rate`` (Hz), means over its samples; itself if it is no faster."""
        if (count := samples.whole_ratio(self.rate, rate)) == 1 or self.rate < rate:
            return self
        axes = {axis: values for axis in AXES if (values := getattr(self, axis)) is not None}
        slower: dict[str, Any] = {axis: samples.means(values, self.rate, rate) for axis, values in axes.items()}
        rate = self.rate / count if count else rate
        done = {**self.done, "averaged": f"over {self.rate / rate:.6g} samples each, to {rate:g} Hz"}
        return replace(self, **slower, time=np.arange(slower["ay"].size) / rate, rate=rate, done=done)

    def require_turns(self, turn_s: float, turns: float = 1.0) -> None:
        """Refuse (`InputError`) a record of fewer turns of the loop, each of ``turn_s`` seconds."""
        if self.seconds < turns * turn_s:
            timing = f"{self.done.get('time', 'no stamps')}; {self.rate:.7g} Hz"
            short = f"the record of {self.seconds:.4g} s ({timing}) is shorter than {turns:g} turn{'s' * (turns != 1)}"
            remedy = f"at least {turns * turn_s:.4g} s, or, if that is not its rate, read no stamps, {stamps.NO_STAMPS}"
            raise InputError(f"{self.path}: {short} of the loop; record {remedy}.")


@typed
def read_sensor(
    source: pd.DataFrame | Path | str,
    mapping: SensorMapping | None = None,
    range_g: float = 20.0,
    gravity: float = 9.81,
) -> SensorRecord:
    """Read a sensor's record and check each value of it.

    Parameters
    ----------
    source : DataFrame, Path or str
        A table, or a file of one in the text of any logger.
    mapping : SensorMapping, optional
        Meaning of its columns, where their names and values do not tell.
    range_g : float
        Range of the sensor, g, unless the mapping states it; infinity if it is not known.
    gravity : float
        One g, m/s2.

    Returns
    -------
    SensorRecord
        Time in s and axes in g; ``done`` describes how it was read.

    Raises
    ------
    InputError
        The record is ambiguous or defective; the message names file, field, line and value.
    """
    mapping = mapping or SensorMapping()
    table = isinstance(source, pd.DataFrame)
    path = Path("the table" if table else source)
    text = "" if table else read_logger_text(path)
    range_g = float(mapping.range or range_g)
    with naming(path):
        rows = rows_of_group(table_of(source) if table else rows_of(*layout_of(text, mapping)), mapping)
        for name, value in (("range_g", range_g), ("gravity", gravity)):
            if not value > 0:
                raise InputError(f"{name} is {value!r}; give a number above zero.")
        return _record(path, rows, mapping, *chosen_columns(rows, mapping, gravity), range_g)


def _samples(
    source: Source, columns: dict[str, Column], mapping: SensorMapping
) -> tuple[Source, dict[str, np.ndarray], np.ndarray]:
    """Return the rows that are samples, their numbers by key, and a mask of those below a message; or `InputError`."""
    keys, positions = list(columns), [column.position for column in columns.values()]
    time = columns["time"].position if "time" in columns else None
    table = source.numbers(positions, time)
    wrong = np.isnan(table)
    absent = wrong[:, [k for k, key in enumerate(keys) if key in AXES]].all(axis=1)
    if time is not None and absent.any():
        t = table[:, positions.index(time)]
        others = absent & np.isfinite(t) & (np.array(source.texts(columns["ay"].position)) == "")
        step = np.diff(t[~absent])
        if step.size and 10 * np.count_nonzero(step > 1.5 * np.nanmedian(step)) < np.count_nonzero(others):
            source, table, wrong = source.only(~others), table[~others], wrong[~others]
    broken = np.zeros(len(table), bool)
    if wrong.any():
        row, index = map(int, np.argwhere(wrong)[0])
        messages = np.array([len(cells) != len(source.columns) for cells in source.cells], bool)
        if time is not None:
            messages |= wrong[:, positions.index(time)]
        if mapping.gaps is None or messages.mean() > MOST_MESSAGES:
            source.refuse(row, positions[index], keys[index] in TIME_KEYS)
        broken = np.diff(np.cumsum(messages)[~messages], prepend=0) > 0
        source, table = source.only(~messages) if messages.any() else source, table[~messages]
    return source, dict(zip(keys, table.T, strict=True)), broken


def _repeated(source: Source, values: dict[str, np.ndarray]) -> np.ndarray:
    """Return a mask, (N,), of rows whose cells repeat the row above, among them a stamp that is not coarse."""
    rows = values["ay"].size
    times = [values["time"]] if "time" in values else [source.stamps(c.position) for c in time_like(source.columns)]
    for t in times:
        step = np.diff(t)
        repeats = t.size == rows and (step == 0).any() and (step > 0).any()
        if repeats and 2 * stamps.rounding(t) < np.median(step[step > 0]):
            cells: Sequence = source.rows or source.cells
            return np.array([False, *(row == above for above, row in pairwise(cells))])
    return np.zeros(rows, bool)


def _record(
    path: Path, rows: Source, mapping: SensorMapping, columns: dict[str, Column], axes: dict[str, Axis], range_g: float
) -> SensorRecord:
    """Return the record of the rows: cropped, in s and g, checked, evenly timed."""
    source, values, broken = _samples(rows, columns, mapping)
    if mapping.group != "none":
        require_one_sensor(source, columns, values)
    if (count := values["ay"].size) < 2:
        raise InputError(f"the file has {count} data rows; give at least 2.")
    time = columns.get("time")
    if "fraction" in columns:
        values["time"] = values["time"] - values["time"][0] + values["fraction"] * TIME_UNITS[columns["fraction"].unit]
    repeated = _repeated(source, values)
    source, broken = source.only(~repeated) if repeated.any() else source, broken[~repeated]
    values = {key: column[~repeated] for key, column in values.items()}
    count -= int(np.count_nonzero(repeated))
    hz: Any = mapping.rate  # of the stamps, if it is None
    seen = stamps.in_seconds(time, values["time"], bool(hz)) if time else None
    instants = seen.t if seen else np.arange(count) / hz
    window = samples.window_of(instants, mapping.start, np.inf if mapping.to is None else mapping.to)
    first = window.start
    doubts = []
    for key, axis in axes.items():
        inside = values[key][window]
        marks, stray = samples.marks(inside), samples.stray(inside)
        if mapping.gaps:
            values[key][window] = np.where(marks | stray, np.nan, inside)
        elif marks.any():
            row, others = int(np.argmax(marks)), np.count_nonzero(marks) - 1
            field = f"field {axis.column.name} in {source.where(first + row)}{f' and {others} more' * bool(others)}"
            like = "like a logger's mark of no sample, or a blow beyond the range"
            remedy = "leave these rows out, `gaps: bridge` or `gaps: longest`, or record with a wider range"
            raise InputError(f"{field} is {inside[row]:g}, far from all other values, {like}; {remedy}.")
        elif stray.any():
            row = int(np.argmax(stray))
            share = f"{np.count_nonzero(stray)} of {stray.size} rows of {axis.column.described}"
            odd = f"the first in {source.where(first + row)}, are {inside[row]:g} and off their neighbours"
            remedy = "RMS is not that of the motion; `gaps: longest` leaves them out"
            doubts.append(f"{share}, {odd}, like errors of a bus: {remedy}")
    counts = {key: samples.signed(values[key], mapping.bits) for key in axes}
    in_g = {key: axis.factor * (counts[key][0][window] - axis.zero) for key, axis in axes.items()}
    signals = pd.DataFrame(in_g, copy=False)
    lines, seen, broken = np.asarray(source.lines)[window], seen and seen.within(window), broken[window]
    done = _described(source, columns, axes, counts)
    left_out = {"outside of from and to": count - len(signals), "that repeat the row above": np.sum(repeated)}
    if any(left_out.values()):
        done["dropped"] = ", ".join(f"{number} rows {words}" for words, number in left_out.items() if number)
    if mapping.gaps:
        beyond = signals.abs() > range_g * BEYOND
        if beyond.any(axis=1).mean() <= samples.BRIDGED_SHARE:
            signals = signals.mask(beyond)
        lost = stamps.lost_rows(seen.t, hz, mapping.resample) if seen else np.zeros(len(signals) - 1)
        if not seen or mapping.gaps == "longest":  # without stamps the samples behind a message cannot be counted
            lost = np.where(broken[1:], np.inf, lost)
        seen, signals, skipped, done["gaps"] = samples.without_gaps(seen, lost, signals, mapping.gaps)
        lines, first = lines[skipped:], first + skipped

    def where(row: int) -> str:
        return source.where(int(np.searchsorted(source.lines, lines[min(row, lines.size - 1)])))

    source_of_hz, even, done["time"] = "as given", True, "rows counted, no stamps"
    if seen and time:
        hz, source_of_hz, even, steps = stamps.judge_stamps(seen, where, hz, mapping.resample)
        described = " and ".join(columns[key].described for key in TIME_KEYS if key in columns)
        done["time"] = f"{described} in {seen.unit}, to {seen.rounding:.2g} s; {steps}"
    done["rate"] = f"{hz:.7g} Hz, {source_of_hz}"
    _require_range(signals, axes, where, range_g)
    # the highest count is one less than the lowest
    largest = range_g - 1.0 / mapping.counts_per_g if mapping.bits and mapping.counts_per_g else range_g
    clipped, done["clipped"], saturated = samples.clipped(signals, largest, range_g)
    if np.ptp(ay := signals["ay"].to_numpy()) <= 1e-9 * max(1.0, np.abs(ay).max()):
        column = f"column {shown(columns['ay'].name)} is {values['ay'][window.start]:.6g} in every row"
        remedy = "choose another one for ay, `axes: {ay: NAME}`, or record the moving track"
        raise InputError(f"{column}; {remedy}.")
    since = instants[first] + np.arange(ay.size) / hz
    doubts = doubts or saturated or samples.wrapped(ay) or samples.stuck(ay, since, largest, where)
    doubts = doubts or samples.at_rest(signals[signals.std().idxmax()].to_numpy(), hz, since)
    if seen and not even:
        signals, done["resampled"] = samples.on_even_instants(seen.t, signals, hz)
    if hz > samples.HIGHEST_RATE_HZ:
        signals, hz, done["decimated"] = samples.decimated(signals, hz)
    if {"resampled", "decimated"} & done.keys():
        signals = signals.clip(-range_g, range_g)
    if mapping.turn:
        signals["ax"], signals["ay"] = turned(signals["ax"], signals["ay"], float(mapping.turn))
        done["turned"] = f"ax and ay by {mapping.turn:g} deg about z"
    read = {axis: signals[axis].to_numpy(copy=True) for axis in signals}
    return SensorRecord(
        path=path, time=np.arange(len(signals)) / hz, rate=float(hz), clipped=clipped, done=done,
        ax=read.get("ax"), ay=read["ay"], az=read.get("az"),
        columns={key: f"{'-' * (axis.column.sign < 0)}{axis.column.name}" for key, axis in axes.items()},
        scales={key: (axis.zero, axis.factor) for key, axis in axes.items()},
        turn=float(mapping.turn), doubts=tuple(f"{path}: {doubt}" for doubt in doubts), synthetic=source.synthetic,
    )  # fmt: skip


def _described(source: Source, columns: dict[str, Column], axes: dict[str, Axis], counts) -> dict[str, str]:
    """Describe the rows and columns that are read; ``counts`` are numbers and a note by axis."""
    words = []
    for (key, axis), (numbers, note) in zip(axes.items(), counts.values(), strict=True):
        column = f"{'-' * (axis.column.sign < 0)}{axis.column.described}"
        words.append(f"{key} = {column} in {axis.unit}{note}, first value {numbers[0]:g}")
    used = {column.position for column in columns.values()}
    if unused := [name for k, name in enumerate(source.names) if k not in used and name]:
        words.append(f"not used: {joined(unused)}")
    rows = f"{counts['ay'][0].size}{f' of {source.group}' * bool(source.group)}, from {source.where(0)} on"
    rows += f"; below them, left out: {joined(source.left_out)}" * bool(source.left_out)
    return {"rows": rows, "columns": "; ".join(words)}


def _require_range(signals: pd.DataFrame, axes: dict[str, Axis], where, range_g: float) -> None:
    """Refuse (`InputError`) a value beyond the range of the sensor; the zero of the file may not be 0."""
    for key, signal in signals.items():
        if not (beyond := signal.abs().to_numpy() > range_g * BEYOND).any():
            continue
        k, axis, mean = int(np.argmax(beyond)), axes[str(key)], float(np.mean(signal.to_numpy()))
        zero, unit = axis.zero + mean / axis.factor, "m/s2" if axis.unit == "g" else "g"
        half = 2.0 ** round(np.log2(abs(zero))) if zero else 1.0  # of the counts of a converter
        zero = half if abs(zero / half - 1) < NEAR_HALF else zero
        shifted = (signal - mean).abs().max() <= range_g
        remedy = f"where 0 g is not 0, perhaps `zero: {zero:.6g}`, or " * bool(shifted)
        remedy += "if few rows are no samples, `gaps: bridge`, or " * bool(beyond.mean() <= samples.BRIDGED_SHARE)
        field = f"field {axis.column.name} in {where(k)} is {signal.iloc[k]:.6g} g if it is in {axis.unit}"
        remedy = f"check the unit, `unit: {unit}`, for raw counts `scale: N`, {remedy}give the range of the sensor"
        raise InputError(f"{field}, beyond the sensor's range of +-{range_g:g} g; {remedy}, `range: G`.")


def turned(ax: Any, ay: Any, angle: float) -> tuple[Any, Any]:
    """Return components along axes that are turned about z by an ``angle`` (deg), from x towards y."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return c * ax + s * ay, c * ay - s * ax


def write_sensor_csv(path, t_s, ax, ay, az, comments: Iterable[str] = ()) -> None:
    """Write (N,) times ``t_s`` in s and axes in g, without those that are None, below lines of ``comments``."""
    decimals = next((d for d in range(3, 9) if np.max(np.abs(t_s - np.round(t_s, d))) <= 1e-9), 9)  # to a nanosecond
    axes = {f"{name}_g": values for name, values in zip(AXES, (ax, ay, az), strict=True) if values is not None}
    table = pd.DataFrame({"t_s": [f"{instant:.{decimals}f}" for instant in t_s], **axes})
    lines = [f"# {line}".rstrip() for comment in comments for line in str(comment).splitlines() or [""]]
    write_text(path, "\n".join([*lines, table.to_csv(index=False, float_format="%.4f", lineterminator="\n")]))

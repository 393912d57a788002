"""Records of an acceleration sensor: what a logger wrote, as time in s and three axes in g.

A file may come in many forms; what can be read in one way only is read, with a list of what was done, and what is
doubtful is refused with the option that decides it, because a gap, a wrong rate or a wrong unit would quietly move
everything derived from the record.
"""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pandas as pd

from trackdyn.fieldtest import samples, stamps
from trackdyn.fieldtest.columns import TIME_KEYS, Axis, Reading, reading_of, require_one_sensor, rows_of_group
from trackdyn.fieldtest.header import find_rows
from trackdyn.fieldtest.logger_text import Source, listed, table_of
from trackdyn.fieldtest.sensor_mapping import AXES, TIME_UNITS, SensorMapping, time_like, wanted_columns
from trackdyn.fieldtest.text_file import read_logger_text
from trackdyn.inputs.errors import InputError, naming, shown
from trackdyn.inputs.files import write_text
from trackdyn.inputs.validation import typed

BEYOND = 1.0001  # of the range of a sensor: rounding
NEAR_HALF = 0.02  # share by which the mean of a converter's counts may be off half of them
MOST_MESSAGES = 0.5  # share of rows that are no samples, up to which the others are a record
CSV_COLUMNS = ("t_s", "ax_g", "ay_g", "az_g")


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
    # column of each axis, with a minus in front where its sign was turned
    columns: Mapping[str, str] = field(default_factory=dict, compare=False)
    # by axis, value of the file that is 0 g, and g a unit of the file, with the sign of the axis
    scales: Mapping[str, tuple[float, float]] = field(default_factory=dict, compare=False)
    turn: float = field(default=0.0, compare=False)  # of the axes about z, deg, beside those of the file
    doubts: tuple[str, ...] = field(default=(), compare=False)  # sentences on what seems wrong with the record
    synthetic: bool = field(default=False, compare=False)  # whether a comment of the file says that it is synthetic

    @property
    def seconds(self) -> float:
        """Length of the record, s."""
        return self.ay.size / self.rate

    @property
    def wraps(self) -> bool:
        """Whether the signal wraps at the end of its range, so that nothing else can be told of it."""
        return any(samples.WRAPS in doubt for doubt in self.doubts)

    def averaged(self, rate: float) -> "SensorRecord":
        """The record of a sensor of a lower ``rate`` (Hz): means over its samples; this one, if it is no faster."""
        if (count := samples.whole_ratio(self.rate, rate)) == 1 or self.rate < rate:
            return self
        axes = {axis: values for axis in AXES if (values := getattr(self, axis)) is not None}
        slower: dict[str, Any] = {axis: samples.means(values, self.rate, rate) for axis, values in axes.items()}
        rate = self.rate / count if count else rate
        return replace(
            self, **slower, time=np.arange(slower["ay"].size) / rate, rate=rate,
            done={**self.done, "averaged": f"over {self.rate / rate:.6g} samples each, to {rate:g} Hz"},
        )  # fmt: skip

    def require_turns(self, turn_s: float, turns: float = 1.0) -> None:
        """Refuse (`InputError`) a record of fewer turns of the loop, each of ``turn_s`` seconds."""
        if self.seconds < turns * turn_s:
            raise InputError(
                f"{self.path}: the record of {self.seconds:.4g} s ({self.done.get('time', 'no stamps')}; "
                f"{self.rate:.7g} Hz) is shorter than {turns:g} turn{'s' * (turns != 1)} of the loop; record at "
                f"least {turns * turn_s:.4g} s, or, if that is not its rate, read no stamps, `time: none, rate: HZ`."
            )


@typed
def read_sensor(
    source: pd.DataFrame | Path | str,
    mapping: SensorMapping | None = None,
    range_g: float = 20.0,
    gravity: float = 9.81,
) -> SensorRecord:
    """Read a sensor's record and check every value of it.

    Parameters
    ----------
    source : DataFrame, Path or str
        A table, or a file of one in the text of any logger.
    mapping : SensorMapping, optional
        What its columns are, where their names and values do not tell.
    range_g : float
        Range of the sensor, g, unless the mapping has it; infinity if it is not known.
    gravity : float
        One g, m/s2.

    Returns
    -------
    SensorRecord
        Time in s and axes in g; ``done`` says how it was read.

    Raises
    ------
    InputError
        What is doubtful or defective, by file, field, line and value.
    """
    mapping = mapping or SensorMapping()
    wanted = wanted_columns(mapping)
    table = isinstance(source, pd.DataFrame)
    path = Path("the table" if table else source)
    text = "" if table else read_logger_text(path)
    with naming(path):
        rows = table_of(source) if table else find_rows(text, wanted)
        rows = rows_of_group(rows, wanted)
        reading = reading_of(rows, mapping, wanted, range_g, gravity)
        return _record(path, rows, reading)


def _samples(source: Source, reading: Reading) -> tuple[Source, dict[str, np.ndarray], np.ndarray]:
    """The rows that are samples, their numbers by axis, time and fraction, and whether what is none stands above them.

    Rows of other sensors are left out and, if there may be gaps, messages. Raises `InputError`: a cell that holds no
    number, unless there may be gaps.
    """
    keys, positions = list(reading.columns), [column.position for column in reading.columns.values()]
    time = reading.columns["time"].position if "time" in reading.columns else None
    table = source.numbers(positions, time, reading.day_first)
    wrong = np.isnan(table)
    absent = wrong[:, [k for k, key in enumerate(keys) if key in AXES]].all(axis=1)
    if time is not None and absent.any():
        t = table[:, positions.index(time)]
        others = absent & np.isfinite(t) & (np.array(source.texts(reading.columns["ay"].position)) == "")
        step = np.diff(t[~absent])
        if step.size and 10 * np.count_nonzero(step > 1.5 * np.nanmedian(step)) < np.count_nonzero(others):
            source, table, wrong = source.only(~others), table[~others], wrong[~others]
    broken = np.zeros(len(table), bool)
    if wrong.any():
        row, index = map(int, np.argwhere(wrong)[0])
        messages = source.misfits()
        if time is not None:
            messages |= wrong[:, positions.index(time)]
        if reading.gaps is None or messages.mean() > MOST_MESSAGES:
            source.refuse(row, positions[index], keys[index] in TIME_KEYS)
        broken = np.diff(np.cumsum(messages)[~messages], prepend=0) > 0
        source, table = source.only(~messages) if messages.any() else source, table[~messages]
    return source, dict(zip(keys, table.T, strict=True)), broken


def _repeated(source: Source, values: dict[str, np.ndarray]) -> np.ndarray:
    """(N,) whether a row repeats the one above it: with all cells the same, among them a stamp that is not coarse."""
    rows = values["ay"].size
    times = [values["time"]] if "time" in values else [source.stamps(c.position) for c in time_like(source.columns)]
    for t in times:
        step = np.diff(t)
        stands = t.size == rows and (step == 0).any() and (step > 0).any()
        if stands and 2 * stamps.rounding(t) < np.median(step[step > 0]):
            return source.repeats()
    return np.zeros(rows, bool)


def _record(path: Path, rows: Source, reading: Reading) -> SensorRecord:
    """The record out of the rows: cropped, in s and g, checked, evenly timed."""
    source, values, broken = _samples(rows, reading)
    columns, axes, stated, range_g = reading.columns, reading.axes, reading.rate, reading.range_g
    if not reading.one_sensor:
        require_one_sensor(source, columns, values)
    if (count := values["ay"].size) < 2:
        raise InputError(f"the file holds {count} data rows; give at least 2.")
    time = columns.get("time")
    if "fraction" in columns:
        values["time"] = values["time"] - values["time"][0] + values["fraction"] * TIME_UNITS[columns["fraction"].unit]
    repeated = _repeated(source, values)
    source, broken = source.only(~repeated) if repeated.any() else source, broken[~repeated]
    values = {key: column[~repeated] for key, column in values.items()}
    count -= int(np.count_nonzero(repeated))
    seen = stamps.in_seconds(time, values["time"], bool(stated)) if time else None
    instants = seen.t if seen else np.arange(count) / stated.hz
    window = samples.window_of(instants, *reading.window)
    first = window.start
    doubts = []
    for key, axis in axes.items():
        inside = values[key][window]
        if (marks := samples.marks(inside)).any() and not reading.gaps:
            _refuse_marks(source, axis, inside, marks, first)
        if (stray := samples.stray(inside)).any() and not reading.gaps:
            row = int(np.argmax(stray))
            doubts.append(
                f"{np.count_nonzero(stray)} of {stray.size} rows of {axis.column.described}, the first in "
                f"{source.where(first + row)}, are {inside[row]:g} and off the rows beside them, as errors of a bus: "
                "RMS is not that of the motion; `gaps: longest` leaves them out"
            )
        elif reading.gaps:
            values[key][window] = np.where(marks | stray, np.nan, inside)
    counts = {key: samples.signed(values[key], reading.bits) for key in axes}
    signals = pd.DataFrame(
        {key: axis.factor * (counts[key][0][window] - axis.zero) for key, axis in axes.items()}, copy=False
    )
    lines, seen, broken = np.asarray(source.lines)[window], seen and seen.within(window), broken[window]
    done = _described(source, reading, counts)
    left_out = [
        (count - len(signals), "outside of from and to"),
        (np.count_nonzero(repeated), "that repeat the row above"),
    ]
    if dropped := [f"{number} rows {words}" for number, words in left_out if number]:
        done["dropped"] = ", ".join(dropped)
    if reading.gaps:
        beyond = signals.abs() > range_g * BEYOND
        if beyond.any(axis=1).mean() <= samples.BRIDGED_SHARE:
            signals = signals.mask(beyond)
        lost = stamps.lost_rows(seen, len(signals), stated, reading.resample)
        if not seen or reading.gaps == "longest":  # without stamps the samples behind a message cannot be counted
            lost = np.where(broken[1:], np.inf, lost)
        seen, signals, skipped, done["gaps"] = samples.without_gaps(seen, lost, signals, reading.gaps)
        lines, first = lines[skipped:], first + skipped

    def where(row: int) -> str:
        return source.where(int(np.searchsorted(source.lines, lines[min(row, lines.size - 1)])))

    rate, even, done["time"] = stated, True, "rows counted, no stamps"
    if seen and time:
        rate, even, steps = stamps.judge_stamps(seen, where, stated, reading.resample)
        described = " and ".join(columns[key].described for key in TIME_KEYS if key in columns)
        done["time"] = f"{described} in {seen.unit}, to {seen.rounding:.2g} s; {steps}"
        done["time"] += {None: "", True: "; dates are day-first", False: "; dates are month-first"}[reading.day_first]
    done["rate"] = f"{rate.hz:.7g} Hz, {rate.source}"
    _require_range(signals, axes, where, range_g)
    clipped, done["clipped"], saturated = samples.clipped(signals, reading.largest, range_g)
    doubts = doubts or saturated
    if np.ptp(ay := signals["ay"].to_numpy()) <= 1e-9 * max(1.0, np.abs(ay).max()):
        raise InputError(
            f"column {shown(columns['ay'].name)} is {values['ay'][window.start]:.6g} in every row; choose another one "
            "for ay, `axes: {ay: NAME}`, or record the moving track."
        )
    hz, since = rate.hz, instants[first] + np.arange(ay.size) / rate.hz
    doubts = doubts or samples.wrapped(ay) or samples.standing_still(ay, since, reading.largest, where)
    doubts = doubts or samples.at_rest(signals[signals.std().idxmax()].to_numpy(), hz, since)
    if seen and not even:
        signals, done["resampled"] = samples.on_even_instants(seen.t, signals, hz)
    if hz > samples.HIGHEST_RATE_HZ:
        signals, hz, done["decimated"] = samples.decimated(signals, hz)
    if {"resampled", "decimated"} & done.keys():
        signals = signals.clip(-range_g, range_g)
    if reading.turn:
        signals["ax"], signals["ay"] = turned(signals["ax"], signals["ay"], reading.turn)
        done["turned"] = f"ax and ay by {reading.turn:g} deg about z"
    read = {axis: signals[axis].to_numpy(copy=True) for axis in signals}
    return SensorRecord(
        path=path, time=np.arange(len(signals)) / hz, rate=float(hz), clipped=clipped, done=done,
        ax=read.get("ax"), ay=read["ay"], az=read.get("az"),
        columns={key: f"{'-' * (axis.column.sign < 0)}{axis.column.name}" for key, axis in axes.items()},
        scales={key: (axis.zero, axis.factor) for key, axis in axes.items()},
        turn=reading.turn, doubts=tuple(f"{path}: {doubt}" for doubt in doubts), synthetic=source.synthetic,
    )  # fmt: skip


def _refuse_marks(source: Source, axis: Axis, values: np.ndarray, marks: np.ndarray, first: int) -> NoReturn:
    row, others = int(np.argmax(marks)), np.count_nonzero(marks) - 1
    raise InputError(
        f"field {axis.column.name} in {source.where(first + row)}{f' and {others} more' * bool(others)} is "
        f"{values[row]:g}, far from all other values, as loggers mark what is no sample, or as a blow beyond the range "
        "stands; leave these rows out, `gaps: bridge` or `gaps: longest`, or record with a wider range."
    )


def _described(source: Source, reading: Reading, counts) -> dict[str, str]:
    """Words on the rows and columns that are read."""
    said = [
        f"{key} = {'-' * (axis.column.sign < 0)}{axis.column.described} in {axis.unit}{counts[key][1]}, first value "
        f"{counts[key][0][0]:g}"
        for key, axis in reading.axes.items()
    ]
    used = {column.position for column in reading.columns.values()}
    if unused := [name for k, name in enumerate(source.names) if k not in used and name]:
        said.append(f"not used: {listed(unused)}")
    below = f"; below them, left out: {listed(source.left_out)}" if source.left_out else ""
    group = f" of {source.group}" * bool(source.group)
    rows = f"{counts['ay'][0].size}{group}, from {source.where(0)} on{below}"
    return {"rows": rows, "columns": "; ".join(said)}


def _require_range(signals: pd.DataFrame, axes: dict[str, Axis], where, range_g: float) -> None:
    """Refuse (`InputError`) a value beyond the range of the sensor, perhaps as the zero of the file is not 0."""
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
        raise InputError(
            f"field {axis.column.name} in {where(k)} is {signal.iloc[k]:.6g} g if it is in {axis.unit}, beyond the "
            f"sensor's range of +-{range_g:g} g; check the unit, `unit: {unit}`, for raw counts `scale: N`, {remedy}"
            "give the range of the sensor, `range: G`."
        )


def turned(ax: Any, ay: Any, angle: float) -> tuple[Any, Any]:
    """Components along axes that are turned about z by an ``angle`` (deg), from x towards y."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return c * ax + s * ay, c * ay - s * ax


def write_sensor_csv(path, t_s, ax, ay, az, comments: Iterable[str] = ()) -> None:
    """Write (N,) times ``t_s`` in s, and axes in g but those that are None, below lines of ``comments``.

    Times have 3 decimals, or up to 9 where they are no whole milliseconds, axes 4. Raises `InputError`: arrays of
    unequal length, of fewer than 2 samples or not finite, or a folder that cannot be written.
    """
    columns: dict[str, np.ndarray] = {}
    for name, values in zip(CSV_COLUMNS, (t_s, ax, ay, az), strict=True):
        if values is None and name != "t_s":
            continue
        array = np.empty(0)
        with suppress(TypeError, ValueError):
            array = np.asarray(values, dtype=float)
        t = columns.setdefault("t_s", array)
        if array.ndim != 1 or array.size < 2 or array.size != t.size or not np.isfinite(array).all():
            raise InputError(
                f"{path}: {name} = {shown(array if array.size else values)}: must be an array of finite numbers, as "
                "many as t_s has and at least 2."
            )
        columns[name] = array
    if np.any(np.diff(t) <= 0.0):
        raise InputError(f"{path}: t_s = {shown(t)}: must increase from sample to sample; sort them by time.")
    lines = [f"# {line}".rstrip() for comment in comments for line in str(comment).splitlines() or [""]]
    decimals = next((d for d in range(3, 9) if np.max(np.abs(t - np.round(t, d))) <= 1e-9), 9)  # to a nanosecond
    table = pd.DataFrame(columns).assign(t_s=[f"{instant:.{decimals}f}" for instant in t])
    text = table.to_csv(index=False, float_format="%.4f", lineterminator="\n")
    write_text(path, "\n".join([*lines, text]))

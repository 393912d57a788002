"""Records of an acceleration sensor: what a logger wrote, as time in s and three axes in g.

A file may come in many forms; what can be read in one way only is read, with a list of what was done, and what is
doubtful is refused with the option that decides it, because a gap, a wrong rate or a wrong unit would quietly move
everything derived from the record.
"""

from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np

from trackdyn.errors import InputError, shown
from trackdyn.files import write_text
from trackdyn.rig.validation import typed
from trackdyn.sensor import samples, stamps
from trackdyn.sensor.formats import format_of
from trackdyn.sensor.header import find_rows
from trackdyn.sensor.logger_files import read_channels, read_logger_text
from trackdyn.sensor.logger_text import Source, listed
from trackdyn.sensor.sensor_mapping import AXES, Column, SensorMapping, choose, time_like, time_unit_of, unit_of
from trackdyn.sensor.stamps import RATES, Rate

COLUMNS = ("t_s", "ax_g", "ay_g", "az_g")


@dataclass(frozen=True)
class SensorRecord:
    """One record of the sensor (Eq. 40), N samples."""

    path: Path  # file it was read from
    t_s: np.ndarray  # (N,) time from its first sample on, s
    # ax_g, ay_g, az_g: (N,) specific force in the sensor's axes, g; None for an axis that the file lacks
    ax_g: np.ndarray | None
    ay_g: np.ndarray
    az_g: np.ndarray | None
    rate_hz: float  # sampling rate, Hz
    clipped: int  # number of rows with an axis at the end of the sensor's range, or at a value where it is saturated
    # how it was read, by name: rows, columns, time, rate, steps, dropped, clipped
    done: Mapping[str, str] = field(default_factory=dict, compare=False)
    # column of each axis, with a minus in front where its sign was turned
    columns: Mapping[str, str] = field(default_factory=dict, compare=False)
    # by axis, value of the file that is 0 g, and g a unit of the file, with the sign of the axis
    scales: Mapping[str, tuple[float, float]] = field(default_factory=dict, compare=False)
    doubts: tuple[str, ...] = field(default=(), compare=False)  # sentences on what seems wrong with the record
    synthetic: bool = field(default=False, compare=False)  # whether a comment of the file says that it is synthetic

    @property
    def seconds(self) -> float:
        """Length of the record, s."""
        return self.ay_g.size / self.rate_hz

    def averaged(self, count: int) -> "SensorRecord":
        """The record of a sensor that is slower by a whole factor: means of ``count`` samples each."""
        if count == 1:
            return self
        complete = self.t_s.size // count * count

        def mean(values):
            return None if values is None else values[:complete].reshape(-1, count).mean(axis=1)

        return replace(
            self, t_s=self.t_s[:complete:count], ax_g=mean(self.ax_g), ay_g=mean(self.ay_g), az_g=mean(self.az_g),
            rate_hz=self.rate_hz / count,
            done={**self.done, "averaged": f"over {count} samples each, to {self.rate_hz / count:g} Hz"},
        )  # fmt: skip

    def require_turns(self, turn_s: float, turns: float = 1.0) -> None:
        """Refuse (`InputError`) a record of fewer turns of the loop, each of ``turn_s`` seconds."""
        if self.seconds < turns * turn_s:
            raise InputError(
                f"{self.path}: the record of {self.seconds:.4g} s is shorter than {turns:g} "
                f"turn{'s' * (turns != 1)} of the loop; record at least {turns * turn_s:.4g} s."
            )


@typed
def read_sensor_csv(
    path: Path | str, mapping: SensorMapping | None = None, range_g: float = 20.0, gravity: float = 9.81
) -> SensorRecord:
    """Read a sensor's file, CSV or a format of `trackdyn.sensor.logger_files`, and check every value of it.

    ``range_g`` is the range of the sensor, g, unless the mapping has it (infinity: not known), ``gravity`` one g in
    m/s2. Raises `InputError`: what is doubtful or defective, by file, field, line and value.
    """
    path, mapping = Path(path), mapping or SensorMapping()
    range_g = mapping.range or range_g
    for name, value in (("range_g", range_g), ("gravity", gravity)):
        if not value > 0:
            raise InputError(f"{path}: {name} is {value!r}; give a number above zero.")
    with ExitStack() as opened:
        source, mapping = _source(path, mapping, opened)
        columns = _columns(source, mapping)
        axes = _axes(path, columns, mapping, gravity)
        time = columns["time"].position if "time" in columns else None
        day_first = mapping.dates and mapping.dates == "day-first"
        used = {key: column for key, column in columns.items() if key in axes or key == "time"}
        positions = [column.position for column in used.values()]
        table = source.table(positions, time, mapping.gaps is not None, day_first)
    return _record(source, mapping, columns.get("time"), axes, dict(zip(used, table.T, strict=True)), float(range_g))


def _source(path: Path, mapping: SensorMapping, opened: ExitStack) -> tuple[Source, SensorMapping]:
    """Rows of a text, or the channels of a group, which are read while ``opened`` is; with the mapping for them."""
    sought = f"column {mapping.axes['ay']!r} for ay" if "ay" in mapping.axes else "column for ay"
    sought += f" of the group {mapping.group!r}" * bool(mapping.group)

    def ay_of(names, group=""):
        if group and mapping.group and mapping.group != group:
            return ""
        own = mapping.within(group)
        # a line of a preamble may have as many fields as a number asks for: what is named tells the header
        candidates = choose(names, [""] * len(names), own)
        if candidates.get("ay") and ("ay" not in own.numbers or all(candidates[key] for key in own.named)):
            return candidates["ay"][0].name
        return ""

    if kind := format_of(path):
        channels = read_channels(path, kind, ay_of, sought, opened)
        if mapping.bits and channels.bits and mapping.bits > channels.bits:
            raise InputError(f"{path}: has {channels.bits} bits a sample; give --bits {channels.bits}.")
        return channels, mapping.within(channels.group)
    numbers = mapping.numbers if "ay" in mapping.numbers and mapping.numbers.keys() == mapping.named.keys() else {}
    text = read_logger_text(path)
    return find_rows(path, text, lambda names: bool(ay_of(names)), sought, list(numbers.values())), mapping


def _columns(source: Source, mapping: SensorMapping) -> dict[str, Column]:
    """Columns of time and axes. Raises `InputError`: one is missing or may be several."""
    path, columns = source.path, {}
    for key, candidates in choose(source.names, source.units, mapping).items():
        if len(candidates) > 1:
            said = " and ".join(f"{column.position + 1} ({shown(column.name)})" for column in candidates)
            number = f"#{candidates[0].position + 1}"
            option = f"--time '{number}'" if key == "time" else f"--axis {key}={number}"
            raise InputError(f"{path}: columns {said} may all be {key}; say which with {option}.")
        if not candidates:
            raise InputError(f"{path}: no column {mapping.named[key]!r} for {key}; there are {listed(source.names)}.")
        columns[key] = candidates[0]
    rate = source.rates.get(columns["ay"].position)
    for key, column in list(columns.items()):
        other = source.rates.get(column.position)
        if rate and other and abs(other.hz / rate.hz - 1) > 1e-6:
            if key in mapping.named:
                raise InputError(
                    f"{path}: {shown(column.name)} has {other.hz:.7g} samples a second and ay {rate.hz:.7g}; "
                    f"name another column for {key} or none."
                )
            del columns[key]
    if not ("time" in columns or mapping.time == "none" or rate):
        _require_no_time(source, mapping, {column.position for column in columns.values()})
    for (key, column), (second, same) in combinations(columns.items(), 2):
        if column.position == same.position:
            raise InputError(f"{path}: column {shown(column.name)} is named for {key} and {second}; name two columns.")
    if "time" in columns and columns["time"].position in source.dated:
        columns["time"] = columns["time"]._replace(unit="s")
    return columns


def _require_no_time(source: Source, mapping: SensorMapping, used: set[int]) -> None:
    """Refuse (`InputError`) columns that may be the time but are not ``used``, or a file that has no rate at all."""
    candidates = [
        column
        for column in time_like(source.names, source.units)
        if column.position not in used and source.rises(column.position)
    ]
    if candidates:
        raise InputError(
            f"{source.path}: the time may be in {' or '.join(column.described for column in candidates)}; say so with "
            f"--time '#{candidates[0].position + 1}', or that it is not with --time none --rate HZ."
        )
    if mapping.rate is None:
        numbers = f", and no number that is surely the sampling rate ({', '.join(source.doubtful[:8])})"
        raise InputError(
            f"{source.path}: no column of time among {listed(source.names)}{numbers * bool(source.doubtful)}; name it "
            f"with --time NAME, or give its rate, {RATES[0]:,.0f} to {RATES[1]:,.0f} Hz, with --time none --rate HZ."
        )


class _Axis(NamedTuple):
    """Column of an axis, and how its numbers become g."""

    column: Column
    unit: str  # in words
    zero: float  # value of the file that is 0 g
    factor: float  # acceleration of a unit of the file, g, with the sign of the axis


def _axes(path: Path, columns: dict[str, Column], mapping: SensorMapping, gravity: float) -> dict[str, _Axis]:
    """Axes with their units. Raises `InputError`: that of ay, or of an axis that was named, is not known."""
    axes: dict[str, _Axis] = {}
    for axis in AXES:
        if column := columns.get(axis):
            # unit, scale and zero are stated of an axis that is named, and of those with the unit of ay
            stated = axis in mapping.axes or column.unit == columns["ay"].unit
            zero = mapping.zero.get(axis, 0.0) if isinstance(mapping.zero, dict) else mapping.zero * stated
            try:
                unit, factor = unit_of(path, column, mapping, stated, gravity)
            except InputError:
                if axis == "ay" or axis in mapping.axes:
                    raise
            else:
                axes[axis] = _Axis(column, unit, zero, column.sign * factor)
    return axes


def _record(source, mapping, time, axes, values, range_g) -> SensorRecord:
    """The record out of ``values``, (N,) by axis and time: cropped, in s and g, checked, evenly timed."""
    path, count, line = source.path, values["ay"].size, source.first_line
    if count < 2:
        raise InputError(f"{path}: the file holds {count} data rows; give at least 2.")
    by_file = source.rates.get(axes["ay"].column.position)
    stated = Rate(mapping.rate, "as given") if mapping.rate else by_file
    seen = time and stamps.in_seconds(path, time.name, values["time"], time_unit_of(path, time))
    window = samples.window_of(path, seen.t if seen else np.arange(count) / stated.hz, mapping)
    signals = {key: axis.factor * (values[key][window] - axis.zero) for key, axis in axes.items()}
    line, seen = line + window.start, seen and seen.within(window)
    done = _described(source, axes, time, values)
    done["dropped"] = f"{count - signals['ay'].size} rows outside of --from and --to"
    if mapping.gaps:
        lost = stamps.lost_rows(seen, signals["ay"].size, stated, mapping.resample)
        seen, signals, skipped, done["gaps"] = samples.without_gaps(path, seen, lost, signals, mapping.gaps)
        line += skipped
    rate, even, done["time"] = stated, True, "rows counted, no stamps"
    if seen and time:
        rate, even, steps = stamps.judge_stamps(path, seen, line, stated, mapping.resample)
        done["time"] = f"{time.described} in {seen.unit}, to {seen.rounding:.2g} s; {steps}"
        done["time"] += f"; dates are {mapping.dates}" * bool(mapping.dates)
    done["rate"] = f"{rate.hz:.7g} Hz, {rate.source}"
    if by_file and abs(rate.hz / by_file.hz - 1) > 1e-6:
        done["rate"] += f", not {by_file.hz:.7g} Hz, {by_file.source}"
    _require_range(path, signals, axes, line, range_g)
    # the highest count is one less than the lowest
    largest = range_g - 1.0 / mapping.counts_per_g if mapping.bits and mapping.counts_per_g else range_g
    clipped, done["clipped"], doubts = samples.clipped(path, signals, largest, range_g)
    doubts += [f"{path}: the library that reads it says: {remark}" for remark in source.remarks]
    if np.ptp(signals["ay"]) <= 1e-9 * max(1.0, np.abs(signals["ay"]).max()):
        raise InputError(
            f"{path}: column {shown(axes['ay'].column.name)} is {values['ay'][window.start]:.6g} in every row; choose "
            "another one for ay with --axis ay=NAME, or record the moving track."
        )
    hz = rate.hz
    if seen and not even:
        signals, done["resampled"] = samples.on_even_instants(seen.t, signals, hz, range_g)
    if hz > samples.FASTEST:
        signals, hz, done["decimated"] = samples.decimated(signals, hz, range_g)
    return SensorRecord(
        path=path, t_s=np.arange(signals["ay"].size) / hz, rate_hz=float(hz), clipped=clipped, done=done,
        ax_g=signals.get("ax"), ay_g=signals["ay"], az_g=signals.get("az"),
        columns={key: f"{'-' * (axis.column.sign < 0)}{axis.column.name}" for key, axis in axes.items()},
        scales={key: (axis.zero, axis.factor) for key, axis in axes.items()},
        doubts=tuple(doubts), synthetic=source.synthetic,
    )  # fmt: skip


def _described(source, axes, time, values) -> dict[str, str]:
    """Words on the rows and columns that are read."""
    said = [
        f"{key} = {'-' * (axis.column.sign < 0)}{axis.column.described} in {axis.unit}, first value {values[key][0]:g}"
        for key, axis in axes.items()
    ]
    used = {column.position for column in (time, *(axis.column for axis in axes.values())) if column}
    if unused := [name for k, name in enumerate(source.names) if k not in used and name]:
        said.append(f"not used: {listed(unused)}")
    below = f"; below them, left out: {listed(source.left_out)}" if source.left_out else ""
    rows = f"{values['ay'].size}, from line {source.first_line} on{below}"
    return {"rows": rows, "columns": "; ".join(said)}


def _require_range(path: Path, signals: samples.Axes, axes: dict[str, _Axis], line: int, range_g: float) -> None:
    """Refuse (`InputError`) a value beyond the range of the sensor, perhaps as the zero of the file is not 0."""
    beyond = np.abs(list(signals.values())) > range_g * 1.0001
    if not beyond.any():
        return
    index, k = np.argwhere(beyond)[0]
    (key, signal), mean = list(signals.items())[index], float(np.mean(list(signals.values())[index]))
    axis = axes[key]
    shifted = np.abs(signal - mean).max() <= range_g
    remedy = f"where 0 g is not 0, --zero, perhaps {axis.zero + mean / axis.factor:.4g}, or " * bool(shifted)
    raise InputError(
        f"{path}: field {axis.column.name} in line {line + k} is {signal[k]:.6g} g if it is in {axis.unit}, beyond the "
        f"sensor's range of +-{range_g:g} g; check the unit (--unit, for raw counts --scale), {remedy}give the range "
        "of the sensor, --range G."
    )


def write_sensor_csv(path, t_s, ax, ay, az, comments: Iterable[str] = ()) -> None:
    """Write (N,) times ``t_s`` in s, and axes in g but those that are None, below lines of ``comments``.

    Times have 3 decimals, or up to 9 where they are no whole milliseconds, axes 4. Raises `InputError`: arrays of
    unequal length, of fewer than 2 samples or not finite, or a folder that cannot be written.
    """
    columns = {
        name: np.asarray(values, dtype=float)
        for name, values in zip(COLUMNS, (t_s, ax, ay, az), strict=True)
        if values is not None
    }
    t = columns["t_s"]
    for name, values in columns.items():
        if values.ndim != 1 or values.size != t.size or values.size < 2 or not np.isfinite(values).all():
            raise InputError(
                f"{path}: {name} = {shown(values)}: must be an array of finite numbers, as many as t_s has and at "
                "least 2."
            )
    if np.any(np.diff(t) <= 0.0):
        raise InputError(f"{path}: t_s = {shown(t)}: must increase from sample to sample; sort them by time.")
    lines = [f"# {line}".rstrip() for comment in comments for line in str(comment).splitlines() or [""]]
    lines.append(",".join(columns))
    decimals = next((d for d in range(3, 9) if np.max(np.abs(t - np.round(t, d))) <= 1e-9), 9)  # to a nanosecond
    row = f"%.{decimals}f" + ",%.4f" * (len(columns) - 1)
    lines.extend(row % values for values in zip(*(values.tolist() for values in columns.values()), strict=True))
    write_text(path, "\n".join(lines) + "\n")

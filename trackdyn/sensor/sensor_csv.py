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
from trackdyn.sensor.header import find_layout
from trackdyn.sensor.logger_files import Channels, read_channels, read_logger_text
from trackdyn.sensor.logger_text import Layout, listed
from trackdyn.sensor.sensor_mapping import (
    AXES,
    Column,
    SensorMapping,
    choose,
    said_otherwise,
    time_like,
    time_unit_of,
    typed_name,
    unit_of,
)
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
        layout, mapping, synthetic = _layout(path, mapping, opened)
        columns, units = _columns(layout, mapping)
        time = columns["time"].position if "time" in columns else None
        day_first = mapping.dates and mapping.dates == "day-first"
        positions = [column.position for column in columns.values()]
        table = layout.table(positions, time, mapping.gaps is not None, day_first)
    values = dict(zip(columns, table.T, strict=True))
    reading = _Reading(layout, mapping, columns, units, values, float(range_g), gravity)
    return replace(reading.record(), synthetic=synthetic)


def _layout(path: Path, mapping: SensorMapping, opened: ExitStack) -> tuple[Layout | Channels, SensorMapping, bool]:
    """Header and rows of a text, or the channels of a group, with the mapping for it; whether it is synthetic.

    Channels are read while ``opened`` is.
    """
    sought = f"column {mapping.axes['ay']!r} for ay" if "ay" in mapping.axes else "column for ay"
    sought += f" of the group {mapping.group!r}" * bool(mapping.group)

    def ay_of(names, group=""):
        if group and mapping.group and mapping.group != group:
            return ""
        own = mapping.within(group)
        named = set(own.named) - ({"time"} if own.time == "none" else set())
        # a line of a preamble may have as many fields as a number asks for: what is named tells the header
        candidates = choose(names, [""] * len(names), own)
        if candidates.get("ay") and ("ay" not in own.numbers or all(candidates[key] for key in named)):
            return candidates["ay"][0].name
        return ""

    if kind := format_of(path):
        channels = read_channels(path, kind, ay_of, sought, opened)
        if mapping.bits and channels.bits and mapping.bits > channels.bits:
            raise InputError(f"{path}: has {channels.bits} bits a sample; give --bits {channels.bits}.")
        return channels, mapping.within(channels.group), False
    text = read_logger_text(path)
    numbers, named = mapping.numbers, set(mapping.named) - ({"time"} if mapping.time == "none" else set())
    positions = list(numbers.values()) if "ay" in numbers and named == set(numbers) else []
    layout = find_layout(path, text, lambda names: bool(ay_of(names)), sought, positions)
    comments = [line for line in text.split("\n", layout.first_line)[:-1] if line.lstrip().startswith("#")]
    return layout, mapping, "synthetic" in "".join(comments).casefold()


def _columns(layout: Layout | Channels, mapping: SensorMapping) -> tuple[dict[str, Column], dict[str, str]]:
    """Columns of time and axes, and units of the axes."""
    path = layout.path
    chosen = choose(layout.names, layout.units, mapping)
    for key, candidates in chosen.items():
        if len(candidates) > 1:
            said = " and ".join(f"{column.position + 1} ({shown(column.name)})" for column in candidates)
            number = f"#{candidates[0].position + 1}"
            option = f"--time '{number}'" if key == "time" else f"--axis {key}={number}"
            raise InputError(f"{path}: columns {said} may all be {key}; say which with {option}.")
        if not candidates and (key, mapping.time) != ("time", "none"):
            raise InputError(f"{path}: no column {mapping.named[key]!r} for {key}; there are {listed(layout.names)}.")
    columns = {key: candidates[0] for key, candidates in chosen.items() if candidates}
    _require_one_rate(layout, mapping, columns)
    _require_time(layout, mapping, columns)
    for (key, column), (other, same) in combinations(columns.items(), 2):
        if column.position == same.position:
            raise InputError(f"{path}: column {shown(column.name)} is named for {key} and {other}; name two columns.")
    units = {}
    for axis in AXES:
        try:
            if axis in columns:
                units[axis] = unit_of(path, columns[axis], mapping, mapping.states(axis, columns))
        except InputError:
            if axis == "ay" or axis in mapping.axes:
                raise
            del columns[axis]  # nobody asked for it
    if "time" in columns and isinstance(layout, Layout) and layout.is_dated(columns["time"].position):
        columns["time"] = columns["time"]._replace(unit="s")
    return columns, units


def _require_one_rate(layout: Layout | Channels, mapping: SensorMapping, columns: dict[str, Column]) -> None:
    """Leave out what has not the rate of ay. Raises `InputError`: it was named."""
    rate = layout.rates.get(columns["ay"].position)
    for key, column in list(columns.items()):
        other = layout.rates.get(column.position)
        if rate and other and abs(other.hz / rate.hz - 1) > 1e-6:
            if key in mapping.named:
                raise InputError(
                    f"{layout.path}: {shown(column.name)} has {other.hz:.7g} samples a second and ay {rate.hz:.7g}; "
                    f"name another column for {key} or none."
                )
            del columns[key]


def _require_time(layout: Layout | Channels, mapping: SensorMapping, columns: dict[str, Column]) -> None:
    """Refuse (`InputError`) a file that has no rate, and no column of time that can be recognised."""
    if "time" in columns or mapping.time == "none" or layout.rates.get(columns["ay"].position):
        return
    taken = {column.position for column in columns.values()}
    candidates = [
        typed_name(column)
        for column in time_like(layout.names, layout.units)
        if column.position not in taken and layout.rises(column.position)
    ]
    if candidates:
        raise InputError(
            f"{layout.path}: the time may be in {', '.join(candidates)}; say so with --time {candidates[0]}, or that "
            "it is not with --time none --rate HZ."
        )
    if mapping.rate is None and layout.doubtful:
        raise InputError(
            f"{layout.path}: no channel of time, and no number that is surely its sampling rate "
            f"({', '.join(layout.doubtful[:8])}); give the rate, {RATES[0]:,.0f} to {RATES[1]:,.0f} samples a second, "
            "with --rate HZ, or name the channel of time with --time NAME."
        )
    if mapping.rate is None:
        raise InputError(
            f"{layout.path}: no column of time among {listed(layout.names)}; name it with --time NAME, or give --time "
            "none --rate HZ."
        )


class _Reading(NamedTuple):
    """Columns of a file, and how their numbers are read."""

    layout: Layout | Channels
    mapping: SensorMapping
    columns: dict[str, Column]  # by key: ``time`` and the axes
    units: dict[str, str]  # by axis
    values: dict[str, np.ndarray]  # (N,) of every column
    range_g: float
    gravity: float  # 1 g, m/s2

    def record(self) -> SensorRecord:
        """The record: cropped, in s and g, checked, evenly timed. Raises `InputError`: a number is doubtful."""
        path, mapping, columns, range_g = self.layout.path, self.mapping, self.columns, self.range_g
        count = self.values["ay"].size
        if count < 2:
            raise InputError(f"{path}: the file holds {count} data rows; give at least 2.")
        done, stated, seen = self.described(), self.layout.rates.get(columns["ay"].position), None
        rate = mapping.rate or (stated.hz if stated else np.nan)
        if "time" in columns:
            time = columns["time"]
            seen = stamps.in_seconds(path, time.name, self.values["time"], time_unit_of(path, time))
        window = samples.window_of(path, np.arange(count) / rate if seen is None else seen.t, mapping)
        scales = {axis: (mapping.zero_of(axis, columns), self.scale(axis)) for axis in self.units}
        axes = {axis: factor * (self.values[axis][window] - zero) for axis, (zero, factor) in scales.items()}
        line, seen = self.layout.first_line + window.start, seen and seen.within(window)
        done["dropped"] = f"{count - axes['ay'].size} rows outside of --from and --to"
        if mapping.gaps:
            lost = stamps.lost_rows(seen, axes["ay"].size, mapping.rate, mapping.resample)
            seen, axes, skipped, done["gaps"] = samples.without_gaps(path, seen, lost, axes, mapping.gaps)
            line += skipped
        even, done["time"] = True, "rows counted, no stamps"
        if seen is not None:
            rate, even, done["time"] = self.clock(seen, line, stated)
        done["rate"] = f"{rate:.7g} Hz, {self.source_of_rate(stated)}"
        self.require_range(axes, line)
        # the highest count is one less than the lowest
        largest = range_g - 1.0 / mapping.counts_per_g if mapping.bits and mapping.counts_per_g else range_g
        clipped, done["clipped"], doubts = samples.clipped(path, axes, largest, range_g)
        doubts += [f"{path}: the library that reads it says: {remark}" for remark in self.layout.remarks]
        if np.ptp(axes["ay"]) <= 1e-9 * max(1.0, np.abs(axes["ay"]).max()):
            raise InputError(
                f"{path}: column {shown(columns['ay'].name)} is {self.values['ay'][window.start]:.6g} in every row; "
                "choose another one for ay with --axis ay=NAME, or record the moving track."
            )
        if seen is not None and not even:
            axes, done["resampled"] = samples.on_even_instants(seen.t, axes, rate, range_g)
        if rate > samples.FASTEST:
            axes, rate, done["decimated"] = samples.decimated(axes, rate, range_g)
        return SensorRecord(
            path, np.arange(axes["ay"].size) / rate, axes.get("ax"), axes["ay"], axes.get("az"), float(rate), clipped,
            done, {axis: f"{columns[axis].minus}{columns[axis].name}" for axis in axes}, scales, tuple(doubts),
        )  # fmt: skip

    def scale(self, axis: str) -> float:
        """Acceleration of a unit of the file in an axis, g, with the sign of the axis."""
        scale = {"g": 1.0, "mg": 1e-3, "counts": 1.0 / (self.mapping.counts_per_g or np.inf)}
        scale |= {f"{name}/s2": length / self.gravity for name, length in (("m", 1.0), ("cm", 1e-2), ("mm", 1e-3))}
        return self.columns[axis].sign * scale[self.units[axis]]

    def words(self, axis: str) -> str:
        """The unit of an axis."""
        unit = self.units[axis]
        return f"counts of 1/{self.mapping.counts_per_g:.6g} g" if unit == "counts" else unit

    def first(self, key: str) -> str:
        """The first value of a column as the file has it."""
        layout = self.layout
        return layout.first(self.columns[key].position) if isinstance(layout, Layout) else f"{self.values[key][0]:g}"

    def described(self) -> dict[str, str]:
        """Words on the rows and columns that are read."""
        layout, columns = self.layout, self.columns
        axes = [
            f"{axis} = {columns[axis].minus}{columns[axis].described} in {self.words(axis)}"
            f"{said_otherwise(columns[axis], unit)}, first value {self.first(axis)}"
            for axis, unit in self.units.items()
        ]
        used = {column.position for column in columns.values()}
        unused = [name for k, name in enumerate(layout.names) if k not in used and name]
        below = f"; below them, left out: {listed(layout.left_out)}" if layout.left_out else ""
        return {
            "rows": f"{self.values['ay'].size}, from line {layout.first_line} on{below}",
            "columns": "; ".join(axes) + (f"; not used: {listed(unused)}" if unused else ""),
        }

    def clock(self, seen: stamps.Stamps, line: int, stated: Rate | None) -> tuple[float, bool, str]:
        """Rate by the stamps ``seen``, from ``line`` on, Hz, whether rows are even in time, and words on the stamps."""
        mapping, column = self.mapping, self.columns["time"]
        by_file = stated.name if stated and not mapping.rate else ""
        rate = mapping.rate or (stated and stated.hz)
        clock = stamps.judge_stamps(self.layout.path, seen, line, rate, mapping.resample, by_file)
        words = f"{column.described} in {seen.unit}, first value {self.first('time')}, to {seen.rounding:.2g} s; "
        return clock.rate_hz, clock.even, words + clock.steps + f"; dates are {mapping.dates}" * bool(mapping.dates)

    def source_of_rate(self, stated: Rate | None) -> str:
        """Words on where the rate comes from: the user, the stamps or the file."""
        rate, by_file = self.mapping.rate, f"as the file states ({stated.name})" if stated else ""
        source = "given" if rate else "found" if "time" in self.columns else by_file
        differs = rate and stated and abs(rate / stated.hz - 1) > 1e-6
        return f"{source}, not {stated.hz:.7g} Hz {by_file}" if stated and differs else source

    def require_range(self, axes: samples.Axes, line: int) -> None:
        """Refuse (`InputError`) a value beyond the range of the sensor, perhaps as the zero of the file is not 0."""
        beyond = np.abs(list(axes.values())) > self.range_g * 1.0001
        if not beyond.any():
            return
        index, k = np.argwhere(beyond)[0]
        axis = list(axes)[index]
        mean = float(np.mean(axes[axis]))
        zero = self.mapping.zero_of(axis, self.columns) + mean / self.scale(axis)
        shifted = np.abs(axes[axis] - mean).max() <= self.range_g
        remedy = f"where 0 g is not 0, --zero, perhaps {zero:.4g}, or " * bool(shifted)
        raise InputError(
            f"{self.layout.path}: field {self.columns[axis].name} in line {line + k} is {axes[axis][k]:.6g} g if it is "
            f"in {self.words(axis)}, beyond the sensor's range of +-{self.range_g:g} g; check the unit (--unit, for "
            f"raw counts --scale), {remedy}give the range of the sensor, --range G."
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

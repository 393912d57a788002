"""Records of an acceleration sensor: what a logger wrote, as time in s and three axes in g.

A file may come in many forms; what can be read in one way only is read, with a list of what was done, and what is
doubtful is refused with the option that decides it, because a gap, a wrong rate or a wrong unit would quietly move
everything derived from the record.
"""

from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import combinations
from pathlib import Path

import numpy as np
import scipy  # its parts are loaded where they are used

from trackdyn.errors import InputError, shown
from trackdyn.files import write_text
from trackdyn.rig.validation import typed
from trackdyn.sensor import stamps
from trackdyn.sensor.formats import format_of
from trackdyn.sensor.logger_files import Channels, Rate, read_channels, read_logger_text
from trackdyn.sensor.logger_text import Layout, find_layout, is_dated, listed, parse
from trackdyn.sensor.sensor_mapping import (
    AXES,
    Column,
    SensorMapping,
    choose,
    is_unit,
    said_otherwise,
    time_like,
    time_unit_of,
    typed_name,
    unit_of,
)
from trackdyn.sensor.stamps import RATES

COLUMNS = ("t_s", "ax_g", "ay_g", "az_g")
FASTEST = 20_000.0  # Hz; a faster record is decimated to it
_CLIPPED = 0.5  # share of clipped rows from which on nothing is left of the motion
# rows at the extreme value, and times the rows at the value next to it, from which on a sensor is taken for saturated:
# a sine of few levels stands 2.4 times as often at its highest one
_STANDING, _MORE_OFTEN = 5, 3.0


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
    # what reading did, by name: rows, columns, time, rate, steps, dropped, clipped
    done: Mapping[str, str] = field(default_factory=dict, compare=False)
    # column of each axis, with a minus in front where its sign was turned
    columns: Mapping[str, str] = field(default_factory=dict, compare=False)
    # of each axis, value of the file that is 0 g, and g a unit of the file, with the sign of the axis
    scales: Mapping[str, tuple[float, float]] = field(default_factory=dict, compare=False)
    doubts: tuple[str, ...] = field(default=(), compare=False)  # what seems wrong with the record, in sentences
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
        """Refuse a record that holds too little of the loop's turns of ``turn_s`` seconds."""
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
        columns, units, table = _columns(layout, mapping)
    values = dict(zip(columns, table.T, strict=True))
    record = _record(layout, mapping, columns, units, values, float(range_g), gravity)
    return replace(record, synthetic=synthetic)


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
            return candidates["ay"][0][0].name
        return ""

    if kind := format_of(path):
        channels = read_channels(path, kind, ay_of, sought, opened)
        if mapping.bits and channels.bits and mapping.bits > channels.bits:
            raise InputError(f"{path}: has {channels.bits} bits a sample; give --bits {channels.bits}.")
        return channels, mapping.within(channels.group), False
    text = read_logger_text(path)
    numbers, named = mapping.numbers, set(mapping.named) - ({"time"} if mapping.time == "none" else set())
    places = list(numbers.values()) if "ay" in numbers and named == set(numbers) else []
    layout = find_layout(path, text, lambda names: bool(ay_of(names)), sought, places, is_unit)
    comments = [line for line in text.split("\n", layout.first_line)[:-1] if line.lstrip().startswith("#")]
    return layout, mapping, "synthetic" in "".join(comments).casefold()


def _columns(layout: Layout | Channels, mapping: SensorMapping) -> tuple[dict, dict[str, str], np.ndarray]:
    """Columns of time and axes, each with a sign, units of the axes, and the numbers, (N, c)."""
    path = layout.path
    chosen = choose(layout.names, layout.units, mapping)
    for key, meant in chosen.items():
        if len(meant) > 1:
            said = " and ".join(f"{column.position + 1} ({shown(column.name)})" for column, _ in meant)
            number = f"#{meant[0][0].position + 1}"
            option = f"--time '{number}'" if key == "time" else f"--axis {key}={number}"
            raise InputError(f"{path}: columns {said} may all be {key}; say which with {option}.")
        if not meant and (key, mapping.time) != ("time", "none"):
            raise InputError(f"{path}: no column {mapping.named[key]!r} for {key}; there are {listed(layout.names)}.")
    columns = {key: candidates[0] for key, candidates in chosen.items() if candidates}
    if isinstance(layout, Channels):
        _require_one_rate(layout, mapping, columns)
    if "time" not in columns and mapping.time != "none" and stated_rate(layout, columns) is None:
        taken = {column.position for column, _ in columns.values()}
        candidates = [c for c in time_like(layout.names, layout.units) if c.position not in taken and rises(layout, c)]
        if candidates:
            typed = [typed_name(column) for column in candidates]
            raise InputError(
                f"{path}: the time may be in {', '.join(typed)}; say so with --time {typed[0]}, or that it "
                "is not with --time none --rate HZ."
            )
        if mapping.rate is None:
            raise InputError(f"{path}: {_no_rate(layout)}")
    for (key, (column, _)), (other, (same, _)) in combinations(columns.items(), 2):
        if column.position == same.position:
            raise InputError(f"{path}: column {shown(column.name)} is named for {key} and {other}; name two columns.")
    units = {}
    for axis in AXES:
        try:
            if axis in columns:
                units[axis] = unit_of(path, columns[axis][0], mapping, mapping.states(axis, columns))
        except InputError:
            if axis == "ay" or axis in mapping.axes:
                raise
            del columns[axis]  # nobody asked for it
    if "time" in columns and isinstance(layout, Layout) and is_dated(layout, columns["time"][0].position):
        columns["time"] = columns["time"][0]._replace(unit="s"), 1
    places = [column.position for column, _ in columns.values()]
    gaps, day_first = mapping.gaps is not None, mapping.dates and mapping.dates == "day-first"
    if isinstance(layout, Channels):
        return columns, units, layout.table(places, gaps)
    stamps_at = columns["time"][0].position if "time" in columns else None
    return columns, units, parse(layout, places, stamps_at, gaps, day_first)


def stated_rate(layout: Layout | Channels, columns: Mapping) -> Rate | None:
    """Samples a second that a file states of its column for ay."""
    return layout.rates[columns["ay"][0].position] if isinstance(layout, Channels) else None


def rises(layout: Layout | Channels, column: Column) -> bool:
    """Whether the values of a column may be stamps."""
    if isinstance(layout, Channels):
        return layout.rising(column.position)
    if is_dated(layout, column.position):
        return True
    try:
        step = np.diff(parse(layout, [column.position]), axis=0)
    except InputError:
        return True  # of a form that is not read yet
    return bool((step >= 0).all() and step.any())


def _require_one_rate(layout: Channels, mapping: SensorMapping, columns: dict) -> None:
    """Leave out what has not the rate of ay, or refuse it if it was named."""
    rate = stated_rate(layout, columns)
    for key, (column, _) in list(columns.items()):
        other = layout.rates[column.position]
        if rate and other and abs(other.hz / rate.hz - 1) > 1e-6:
            if key in mapping.named:
                raise InputError(
                    f"{layout.path}: {shown(column.name)} has {other.hz:.7g} samples a second and ay {rate.hz:.7g}; "
                    f"name another column for {key} or none."
                )
            del columns[key]


def _no_rate(layout: Layout | Channels) -> str:
    if isinstance(layout, Channels) and layout.doubtful:
        return (
            f"no channel of time, and no number that is surely its sampling rate ({', '.join(layout.doubtful[:8])}); "
            f"give the rate, {RATES[0]:,.0f} to {RATES[1]:,.0f} samples a second, with --rate HZ, or name the channel "
            "of time with --time NAME."
        )
    return f"no column of time among {listed(layout.names)}; name it with --time NAME, or give --time none --rate HZ."


def _record(layout, mapping, columns, units, values, range_g, gravity) -> SensorRecord:
    """The record of the columns' numbers: cropped, in s and g, checked, evenly timed."""
    path, count, names = layout.path, values["ay"].size, {axis: column.name for axis, (column, _) in columns.items()}
    if count < 2:
        raise InputError(f"{path}: the file holds {count} data rows; give at least 2.")
    stated = stated_rate(layout, columns)
    counts = mapping.counts_per_g or np.inf
    scale = {"g": 1.0, "mg": 1e-3, "counts": 1.0 / counts}
    scale |= {f"{length}/s2": factor / gravity for length, factor in (("m", 1.0), ("cm", 1e-2), ("mm", 1e-3))}
    largest = range_g - (1.0 / counts if mapping.bits else 0.0)  # the highest count is one less than the lowest
    used = {column.position for column, _ in columns.values()}
    unused = [name for k, name in enumerate(layout.names) if k not in used and name]
    signs = {axis: "-" * (columns[axis][1] < 0) for axis in units}
    words = {unit: f"counts of 1/{counts:.6g} g" if unit == "counts" else unit for unit in scale}

    def first(key):
        return layout.first(columns[key][0].position) if isinstance(layout, Layout) else f"{values[key][0]:g}"

    message = [
        f"{axis} = {signs[axis]}{columns[axis][0].described} in {words[unit]}"
        f"{said_otherwise(columns[axis][0], unit)}, first value {first(axis)}"
        for axis, unit in units.items()
    ]
    below = f"; below them, left out: {listed(layout.left_out)}" if layout.left_out else ""
    done = {"rows": f"{count}, from line {layout.first_line} on{below}"}
    done["columns"] = "; ".join(message) + (f"; not used: {listed(unused)}" if unused else "")

    seen = clock = None
    if "time" in columns:
        seen = stamps.in_seconds(path, names["time"], values["time"], time_unit_of(path, columns["time"][0]))
    rate = mapping.rate or (stated.hz if stated else np.nan)
    window = _part(path, np.arange(count) / rate if seen is None else seen.t, mapping)
    scales = {axis: (mapping.zero_of(axis, columns), columns[axis][1] * scale[unit]) for axis, unit in units.items()}
    axes = {axis: factor * (values[axis][window] - zero) for axis, (zero, factor) in scales.items()}
    rows = axes["ay"].size
    done["dropped"] = f"{count - rows} rows outside of --from and --to"
    line = layout.first_line + window.start
    if seen is not None:
        seen = seen._replace(t=seen.t[window] - seen.t[window.start])
    if mapping.gaps:
        seen, axes, skipped, done["gaps"] = _mended(path, seen, axes, mapping)
        line, rows = line + skipped, axes["ay"].size
    done["time"] = "rows counted, no stamps"
    if seen is not None:
        by_file = stated.name if stated and not mapping.rate else ""
        clock = stamps.judge_stamps(path, seen, line, mapping.rate or (stated and stated.hz), mapping.resample, by_file)
        rate = clock.rate_hz
        column = columns["time"][0]
        done["time"] = (
            f"{column.described} in {seen.unit}, first value {first('time')}, to {seen.rounding:.2g} s; {clock.steps}"
        )
        if mapping.dates:
            done["time"] += f"; dates are {mapping.dates}"
    by_file = f"as the file states ({stated.name})" if stated else ""
    source = "given" if mapping.rate else "found" if seen is not None else by_file
    if mapping.rate and stated and abs(mapping.rate / stated.hz - 1) > 1e-6:
        source += f", not {stated.hz:.7g} Hz {by_file}"
    done["rate"] = f"{rate:.7g} Hz, {source}"

    size = np.abs(list(axes.values()))
    if size.max() > range_g * 1.0001:
        axis, k = np.argwhere(size > range_g * 1.0001)[0]
        name = list(axes)[axis]
        middle = float(np.mean(values[name][window]))
        shifted = np.abs(axes[name] - np.mean(axes[name])).max() <= range_g
        remedy = f"where 0 g is not 0, --zero, perhaps {middle:.4g}, or " * bool(shifted)
        raise InputError(
            f"{path}: field {names[name]} in line {line + k} is {axes[name][k]:.6g} g if it is in "
            f"{words[units[name]]}, beyond the sensor's range of +-{range_g:g} g; check the unit (--unit, for raw "
            f"counts --scale), {remedy}give the range of the sensor, --range G."
        )
    at_end, doubts = size.max(axis=0) >= largest * (1.0 - 1e-6), []
    ends = f"at the end of the range of {range_g:g} g"
    for axis, samples in axes.items():
        levels = [level for level in _standing(samples) if abs(level) < largest * (1.0 - 1e-6)]
        standing = np.isin(samples, levels)
        if not levels:
            continue
        at_end |= standing
        said = f"{' and '.join(f'{level:.6g}' for level in levels)} g, the extreme of {axis}"
        ends += f" or at {said}"
        doubts.append(
            f"{path}: {np.count_nonzero(standing)} of {rows} rows stand at {said}: the sensor is saturated there, RMS "
            f"and peaks are too small; record with a wider range, or state this one, --range {abs(levels[-1]):.6g}"
        )
    doubts += [f"{path}: the library that reads it says: {remark}" for remark in getattr(layout, "remarks", ())]
    clipped = int(np.count_nonzero(at_end))
    done["clipped"] = f"{clipped} of {rows} rows {ends}"
    if clipped > _CLIPPED * rows:
        raise InputError(
            f"{path}: {clipped} of {rows} rows stand {ends}; record with a wider range, or give the sensor's with "
            "--range."
        )
    if np.ptp(axes["ay"]) <= 1e-9 * max(1.0, np.abs(axes["ay"]).max()):
        raise InputError(
            f"{path}: column {shown(names['ay'])} is {values['ay'][window.start]:.6g} in every row; choose another one "
            "for ay with --axis ay=NAME, or record the moving track."
        )
    if seen is not None and clock is not None and not clock.even:
        even = np.arange(int(seen.t[-1] * rate * (1 + 1e-12)) + 1) / rate
        splines = {axis: scipy.interpolate.CubicSpline(seen.t, samples) for axis, samples in axes.items()}
        axes = {axis: np.clip(spline(even), -range_g, range_g) for axis, spline in splines.items()}
        done["resampled"] = f"{rows} rows onto {even.size} even instants, by cubic splines"
    if rate > FASTEST:
        ratio = Fraction(FASTEST / rate).limit_denominator(1000)
        slower = {
            axis: scipy.signal.resample_poly(samples, ratio.numerator, ratio.denominator, padtype="line")
            for axis, samples in axes.items()
        }
        axes = {axis: np.clip(samples, -range_g, range_g) for axis, samples in slower.items()}
        rate = float(rate * ratio)
        done["decimated"] = f"{rows} rows to {axes['ay'].size}, {rate:.7g} Hz, behind an anti-alias filter"
    time = np.arange(axes["ay"].size) / rate
    named = {axis: f"{sign}{names[axis]}" for axis, sign in signs.items()}
    return SensorRecord(
        path, time, axes.get("ax"), axes["ay"], axes.get("az"), float(rate), clipped, done, named, scales, tuple(doubts)
    )


def _standing(values: np.ndarray) -> list[float]:
    """Extreme values at which a signal stands: more samples than a signal that only peaks there has."""
    levels, counts = np.unique(values, return_counts=True)
    ends = ((0, 1), (-1, -2)) if levels.size > 2 else ()
    return [
        float(levels[end]) for end, following in ends if counts[end] >= max(_STANDING, _MORE_OFTEN * counts[following])
    ]


def _mended(path, seen, axes, mapping) -> tuple:
    """Stamps and axes without gaps as ``mapping.gaps`` has it, the rows left out before them, and what was done."""
    names, values = list(axes), np.array(list(axes.values()))
    count = values.shape[1]
    lost = np.zeros(count - 1) if seen is None else stamps.lost_rows(seen, mapping.rate, mapping.resample)
    if mapping.gaps == "longest":
        window = stamps.longest_part(lost, np.isnan(values).any(axis=0))
        if window.stop - window.start < 2:
            raise InputError(f"{path}: no two rows without a gap between them; record the sample again.")
        seen = seen and seen._replace(t=seen.t[window] - seen.t[window.start])
        done = f"rows {window.start + 1} to {window.stop} of {count} kept, the longest part without a gap"
        return seen, dict(zip(names, values[:, window], strict=True)), window.start, done
    t = np.arange(count) if seen is None else seen.t
    rows, gap, longest = stamps.bridged(lost, np.vstack([t, values]))
    if longest > stamps.BRIDGED or np.count_nonzero(gap) > stamps.BRIDGED_SHARE * count or rows.shape[1] < 2:
        raise InputError(
            f"{path}: {np.count_nonzero(gap) or count - rows.shape[1]} samples are missing, up to {longest} in a row; "
            f"at most {stamps.BRIDGED} in a row and {stamps.BRIDGED_SHARE:.0%} are bridged; keep the longest part with "
            "--gaps longest, or cut the record with --from and --to."
        )
    seen = seen and seen._replace(t=rows[0] - rows[0, 0])
    done = (
        f"{np.count_nonzero(gap)} samples in {np.count_nonzero(np.diff(gap.astype(int)) > 0)} gaps interpolated, at "
        f"most {longest} in a row"
    )
    return seen, dict(zip(names, rows[1:], strict=True)), 0, done


def _part(path: Path, t: np.ndarray, mapping: SensorMapping) -> slice:
    """The rows from ``mapping.start`` to ``mapping.to``, s since the first row."""
    since = t - t[0]
    begun = np.flatnonzero(since >= mapping.start)
    first = int(begun[0]) if begun.size else t.size
    ended = np.flatnonzero(since[first:] > (np.inf if mapping.to is None else mapping.to))
    last = first + int(ended[0]) if ended.size else t.size
    if last - first < 2:
        to = "the end" if mapping.to is None else f"--to {mapping.to:g}"
        raise InputError(
            f"{path}: {last - first} rows lie between --from {mapping.start:g} and {to}, in s since the first row; the "
            f"file holds {since[-1]:.6g} s."
        )
    return slice(first, last)


def write_sensor_csv(path, t_s, ax, ay, az, comments: Iterable[str] = ()) -> None:
    """Write (N,) times in s, and axes in g but those that are None, below lines of comments.

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

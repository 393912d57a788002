"""Samples of a sensor, (N,) per axis: cropped, without gaps, within the range of the sensor, evenly timed."""

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pandas as pd
import scipy  # its modules are loaded where they are used

from trackdyn.fieldtest.stamps import Stamps
from trackdyn.inputs.errors import InputError

HIGHEST_RATE_HZ = 20_000.0  # Hz; a faster record is decimated to it
RATE_TOLERANCE = 0.01  # of a ratio of rates that is taken for whole; changes the mean of a wave of 300 Hz by 0.3 %
_CLIPPED = 0.5  # share of clipped rows from which on nothing is left of the motion
# least rows at the extreme value, and ratio to those at the next value, of a saturated sensor: a sine of few levels is
# 2.4 times as often at its highest one
_STANDING, _MORE_OFTEN = 5, 3.0
# samples in a row, and share of a record, that are interpolated: with both at their limit, the RMS of 30 trials on the
# default run at 1 kHz changed by at most 0.34 % (0.06 % with gaps of 3), as impacts are lost in a gap
BRIDGED, BRIDGED_SHARE = 10, 0.01
# rows in a row, their seconds, and multiple of the run that 99 % of the runs do not exceed, from which on rows that
# repeat one value are no samples: a fast sensor repeats values of few levels
_STILL, _STILL_S, _MUCH_LONGER = 20, 0.1, 5.0
# marks of no sample: least distance from all other values, in their extent, least levels of the others, most marks a
# side; and values that loggers write: 9s, and ends of 16 and 32 bits
_APART, _FEWEST_LEVELS, _MOST_MARKS = 0.5, 8, 3
_MARKS = {sign * (10.0**n - 1) for n in range(3, 8) for sign in (1, -1)} | {
    value for bits in (16, 32) for value in (-(2.0 ** (bits - 1)), 2.0 ** (bits - 1) - 1, 2.0**bits - 1)
}
# errors of a bus: least number, ratio of their distance from the neighbours' mean to that of other rows, least such
# distance in standard deviations of the signal, least levels of the signal
_STRAY, _OFF, _OFF_SPREAD, _MANY_LEVELS = 8, 4.0, 0.2, 100
# a signal that wraps: least jumps, their least size in its extent, and largest sum of its ends in its extent
_JUMPS, _WHOLE, _SYMMETRIC = 5, 0.75, 0.05
WRAPS = "wraps at the end of its range"
# rest: length of a window (s), least windows, ratio to the longest quiet stretch within the motion, largest ratio of
# content to that of the first windows and change of mean (g), largest share of quiet windows within the motion, and
# least ratio of the content of motion and rest
_WINDOW_S, _REST, _LONGER_REST, _QUIET, _TURNED_G, _SELDOM, _MOVED = 0.25, 6, 3, 1.5, 0.1, 0.1, 2.5
_WIDTHS = (8, 10, 12, 14, 16, 18, 20, 24, 32)  # bits of counts


def window_of(t: np.ndarray, start: float, to: float) -> slice:
    """Return the rows of ``t``, (N,) s, from ``start`` to ``to``, s since the first; `InputError` if fewer than two."""
    since = t - t[0]
    first = int(np.argmax(np.append(since >= start, True)))
    last = first + int(np.argmax(np.append(since[first:] > to, True)))
    if last - first < 2:
        ends = f"`from: {start:g}` and {'the end' if to == np.inf else f'`to: {to:g}`'}, in s since the first row"
        raise InputError(f"{last - first} rows are between {ends}; the file has {since[-1]:.6g} s.")
    return slice(first, last)


def without_gaps(
    stamps: Stamps | None, lost: np.ndarray, axes: pd.DataFrame, gaps: str
) -> tuple[Stamps | None, pd.DataFrame, int, str]:
    """Return stamps and axes without gaps, the number of rows dropped before them, and a remark; or `InputError`.

    ``lost`` are numbers of rows missing between rows, (N - 1,); other samples are missing where ``axes`` are NaN.
    """
    count, missing = len(axes), axes.isna().any(axis=1).to_numpy()
    if gaps == "longest":
        stretch = np.cumsum(missing | np.append(False, lost > 0))
        longest = np.bincount(stretch[~missing], minlength=1).argmax()
        rows = np.flatnonzero((stretch == longest) & ~missing)
        if rows.size < 2:
            raise InputError("no two rows without a gap between them; record the motion again.")
        window = slice(int(rows[0]), int(rows[-1]) + 1)
        done = f"rows {window.start + 1} to {window.stop} of {count} kept, the longest part without a gap"
        return stamps and stamps.within(window), axes[window], window.start, done
    if np.isinf(lost).any():
        unknown = "without stamps it is not known how many samples a message among the rows replaces"
        raise InputError(f"{unknown}; keep the longest part, `gaps: longest`.")
    index = np.concatenate([[0], np.cumsum(1 + lost)]).astype(int)
    table = axes.assign(t=np.arange(count) if stamps is None else stamps.t).set_index(index)[~missing]
    between = np.diff(table.index) - 1
    most, bridged = int(between.max(initial=0)), int(between.sum())
    if most > BRIDGED or bridged > BRIDGED_SHARE * count or len(table) < 2:
        lacking = f"{index[-1] + 1 - len(table)} samples are missing, up to {most} in a row"
        remedy = "keep the longest part, `gaps: longest`, or cut the record, `from: S` and `to: S`"
        raise InputError(f"{lacking}; at most {BRIDGED} in a row and {BRIDGED_SHARE:.0%} are bridged; {remedy}.")
    done = f"{bridged} samples in {np.count_nonzero(between)} gaps interpolated, at most {most} in a row"
    table = table.reindex(range(table.index[0], table.index[-1] + 1)).interpolate("pchip")
    t = table.pop("t").to_numpy()
    return stamps and stamps._replace(t=t - t[0]), table, 0, done


def clipped(axes: pd.DataFrame, largest: float, range_g: float) -> tuple[int, str, list[str]]:
    """Count rows at the ``largest`` value of a sensor, g, or at one where it is saturated; add a note and warnings.

    Raises `InputError`: most rows are clipped.
    """
    at_end = (axes.abs().max(axis=1) >= largest * (1.0 - 1e-6)).to_numpy()
    ends, saturated = f"at the end of the range of {range_g:g} g", []
    for axis, samples in axes.items():
        levels, counts = np.unique(samples.to_numpy(), return_counts=True)
        extremes = []
        for end, following in ((0, 1), (-1, -2)) if levels.size > 2 else ():
            often = counts[end] >= max(_STANDING, _MORE_OFTEN * counts[following])
            if often and abs(levels[end]) < largest * (1.0 - 1e-6):
                extremes.append(float(levels[end]))
        if not extremes:
            continue
        standing = np.isin(samples, extremes)
        at_end = at_end | standing
        extreme = f"{' and '.join(f'{level:.6g}' for level in extremes)} g, the extreme of {axis}"
        ends += f" or at {extreme}"
        share = f"{np.count_nonzero(standing)} of {samples.size} rows are at {extreme}"
        remedy = f"record with a wider range, or state this one, `range: {abs(extremes[-1]):.6g}`"
        saturated.append(f"{share}: the sensor is saturated there, RMS and peaks are too small; {remedy}")
    count, rows = int(np.count_nonzero(at_end)), at_end.size
    if count > _CLIPPED * rows:
        remedy = "record with a wider range, or give the sensor's, `range: G`"
        raise InputError(f"{count} of {rows} rows are {ends}; {remedy}.")
    return count, f"{count} of {rows} rows {ends}", saturated


def marks(values: np.ndarray) -> np.ndarray:
    """Return a mask, (N,), of marks of no sample: extremes that repeat, or that loggers write, far from all others."""
    levels, counts = np.unique(values[np.isfinite(values)], return_counts=True)
    marked = np.zeros(values.size, bool)
    for sign in (1, -1) if levels.size > _FEWEST_LEVELS else ():
        ends, often = levels[::sign], counts[::sign]
        beyond = np.abs(np.diff(ends))[:_MOST_MARKS] > _APART * np.abs(ends[-2] - ends[1 : _MOST_MARKS + 1])
        number = int(np.argmax(beyond)) + 1 if beyond.any() else 0
        here = np.isin(values, ends[:number])
        known = all(often[k] > 1 or ends[k] in _MARKS for k in range(number))
        runs = np.diff(np.flatnonzero(np.diff(here, prepend=False, append=False)))[::2]
        # a long row of one value, but not three rows, is a logger that had not begun
        short = not runs.size or runs.max() <= BRIDGED or runs.size > 2 or ends[0] in _MARKS
        if known and short and here.mean() < _CLIPPED:
            marked |= here
    return marked


def stray(values: np.ndarray) -> np.ndarray:
    """Return a mask, (N,), of 0 or -1 if it is an error of a bus: too frequent, and off its neighbours' mean."""
    levels, counts = np.unique(values, return_counts=True)
    off = np.abs(values[1:-1] - (values[2:] + values[:-2]) / 2)
    for value in {0.0, -1.0} & set(levels) if levels.size > _MANY_LEVELS else ():
        here, k = values == value, int(np.searchsorted(levels, value))
        near = np.delete(counts[max(k - 5, 0) : k + 6], min(k, 5))
        often = counts[k] >= max(_STRAY, _MORE_OFTEN * np.median(near))
        if often and np.median(off[here[1:-1]]) > max(_OFF * np.median(off), _OFF_SPREAD * np.nanstd(values)):
            return here
    return np.zeros(values.size, bool)


def wrapped(ay: np.ndarray) -> list[str]:
    """Warn of a signal that jumps by its whole extent, more often than by less."""
    step, extent = np.abs(np.diff(ay)), float(np.ptp(ay))
    jumps, halves = (np.count_nonzero(step > share * extent) for share in (_WHOLE, 0.5))
    if abs(ay.max() + ay.min()) >= _SYMMETRIC * extent or jumps < _JUMPS or jumps < halves - jumps:
        return []
    jumping = f"ay jumps {jumps} times from row to row by nearly its extent of {extent:.4g} g"
    return [f"{jumping}: it {WRAPS}, RMS and peaks are wrong; record with a wider range"]


def signed(values: np.ndarray, bits: int | None) -> tuple[np.ndarray, str]:
    """Convert unsigned two's-complement counts, 65535 for -1, to signed ones, if steps get shorter; add a note."""
    finite = values[np.isfinite(values)]
    if finite.size < 2 or finite.min() < 0 or (finite != np.round(finite)).any():
        return values, ""
    bits = bits or next((n for n in _WIDTHS if finite.max() < 2**n), 64)
    negative = np.where(values >= 2 ** (bits - 1), values - 2**bits, values)
    both = finite.min() < 2 ** (bits - 2) and finite.max() >= 3 * 2 ** (bits - 2)
    if not both or 2 * np.nansum(np.abs(np.diff(negative))) > np.nansum(np.abs(np.diff(values))):
        return values, ""
    return negative, f" (of {bits} bits, negative from {2 ** (bits - 1)} on)"


def stuck(ay: np.ndarray, since: np.ndarray, largest: float, where: Callable[[int], str]) -> list[str]:
    """Return a warning of the longest run of rows with one ``ay``, (N,) g below ``largest``, if it is much longer."""
    moved = np.flatnonzero(np.append(True, np.diff(ay) != 0))
    runs = np.diff(moved, append=ay.size)
    first, count = int(moved[np.argmax(runs)]), int(runs.max())
    last = first + count - 1
    short = since[last] - since[first] < _STILL_S or abs(ay[first]) >= largest * (1.0 - 1e-6)
    if short or count < max(_STILL, _MUCH_LONGER * np.quantile(runs, 0.99, method="lower")):
        return []
    cuts = [f"`from: {since[last + 1]:.6g}`" for _ in since[last + 2 :][:1]]
    cuts += [f"`to: {since[first - 1]:.6g}`"] * (first > 1)
    rows = f"the {count} rows from {where(first)} to {where(last)} have one ay, {ay[first]:.6g} g"
    return [f"{rows}: the logger had not begun, or the sensor hung; cut them off, {' or '.join(cuts)}"]


def at_rest(ay: np.ndarray, rate: float, since: np.ndarray) -> list[str]:
    """Warn of a record, (N,) g, that begins or ends at rest: with far less content from 2 Hz on than any motion."""
    count = round(_WINDOW_S * rate)
    if ay.size < 2 * _REST * count:
        return []
    slow = pd.Series(ay).rolling(2 * count + 1, center=True, min_periods=1).mean().to_numpy()
    whole = ay.size // count * count
    content = np.sqrt(np.mean((ay - slow)[:whole].reshape(-1, count) ** 2, axis=1))
    mean = ay[:whole].reshape(-1, count).mean(axis=1)
    begin, end = _rest(content, mean), content.size - _rest(content[::-1], mean[::-1])
    if begin >= end:
        return []
    usual = np.median(content[begin:end])
    moving = begin + np.flatnonzero(content[begin:end] >= usual / 2)  # a start takes a while
    warnings = []
    for side, level, cut in (
        ("begins", content[:begin], f"`from: {since[moving[0] * count]:.6g}`"),
        ("ends", content[end:], f"`to: {since[(moving[-1] + 1) * count - 1]:.6g}`"),
    ):
        words = f"the record {side} at rest: for {level.size * _WINDOW_S:g} s its content from 2 Hz on is"
        if level.size:
            warnings.append(f"{words} {np.median(level):.2g} g, otherwise {usual:.2g} g; leave that out, {cut}")
    return warnings


def _rest(content: np.ndarray, mean: np.ndarray) -> int:
    """Count the windows at rest at the beginning, by the content and the mean, g, of each; gravity turns the mean."""
    still, upright = np.median(content[:_REST]), np.median(mean[:_REST])
    loud = np.flatnonzero((content >= _QUIET * still) | (np.abs(mean - upright) > _TURNED_G))
    if loud.size == 0 or loud[0] < _REST:
        return 0
    motion = content[loud[0] : loud[-1] + 1]
    longest = int(np.diff(loud).max(initial=1)) - 1
    resting = loud[0] >= _LONGER_REST * longest and 1 - loud.size / motion.size < _SELDOM
    return int(loud[0]) if resting and np.median(motion) > _MOVED * np.median(content[: loud[0]]) else 0


def on_even_instants(t: np.ndarray, axes: pd.DataFrame, rate: float) -> tuple[pd.DataFrame, str]:
    """Interpolate axes at even instants of ``rate`` Hz by cubic splines through the stamps ``t``, s; add a note."""
    even = np.arange(int(t[-1] * rate * (1 + 1e-12)) + 1) / rate
    resampled = pd.DataFrame(scipy.interpolate.CubicSpline(t, axes.to_numpy())(even), columns=axes.columns)
    return resampled, f"{t.size} rows onto {even.size} even instants, by cubic splines"


def whole_ratio(rate: float, slower: float) -> int:
    """Return the samples at ``rate`` per sample of a ``slower`` rate (Hz); 0 if they are not whole, to 1 %."""
    count = max(round(rate / slower), 1)
    return count if abs(rate / slower / count - 1) <= RATE_TOLERANCE else 0


def means(values: np.ndarray, rate: float, slower: float) -> np.ndarray:
    """Return (M,) means over the samples of a ``slower`` rate (Hz) of (N,) values, which are means of their samples."""
    if count := whole_ratio(rate, slower):
        return values[: values.size // count * count].reshape(-1, count).mean(axis=1)
    # the integral is known at the ends of the samples
    integral = scipy.interpolate.CubicSpline(np.arange(values.size + 1) / rate, np.append(0, np.cumsum(values)) / rate)
    ends = np.arange(int(values.size / rate * slower * (1 + 1e-12)) + 1) / slower
    return np.diff(integral(ends)) * slower


def decimated(axes: pd.DataFrame, rate: float) -> tuple[pd.DataFrame, float, str]:
    """Decimate axes of ``rate`` Hz to about ``HIGHEST_RATE_HZ`` behind an anti-alias filter; add rate (Hz) and note."""
    ratio = Fraction(HIGHEST_RATE_HZ / rate).limit_denominator(1000)
    slower = scipy.signal.resample_poly(axes.to_numpy(), ratio.numerator, ratio.denominator, padtype="line")
    words = f"{len(axes)} rows to {len(slower)}, {float(rate * ratio):.7g} Hz, behind an anti-alias filter"
    return pd.DataFrame(slower, columns=axes.columns), float(rate * ratio), words

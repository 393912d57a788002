"""Samples of a sensor, (N,) a column by axis: cropped, without gaps, within the range of the sensor, evenly timed."""

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pandas as pd
import scipy  # its parts are loaded where they are used

from trackdyn.fieldtest.stamps import Stamps
from trackdyn.inputs.errors import InputError

HIGHEST_RATE_HZ = 20_000.0  # Hz; a faster record is decimated to it
RATE_TOLERANCE = 0.01  # of a ratio of rates that is taken for whole; changes what a mean leaves of 300 Hz by 0.3 %
_CLIPPED = 0.5  # share of clipped rows from which on nothing is left of the motion
# rows at the extreme value, and times the rows at the value next to it, from which on a sensor is taken for saturated:
# a sine of few levels stands 2.4 times as often at its highest one
_STANDING, _MORE_OFTEN = 5, 3.0
# samples in a row, and share of a record, that are interpolated: with so many both ways, the RMS of 30 trials on the
# default run at 1 kHz changed by at most 0.34 % (0.06 % with gaps of 3), as impacts are lost in a gap
BRIDGED, BRIDGED_SHARE = 10, 0.01
# rows in a row, their seconds, and times the run that 99 of 100 do not pass, from which on a sensor is taken for
# standing still: a fast one repeats values of few levels
_STILL, _STILL_S, _MUCH_LONGER = 20, 0.1, 5.0
# distance from all other values, in their extent, from which on an extreme that repeats is no sample; and values that
# loggers write instead of one: 9s, and ends of 16 and 32 bits
_APART, _FEWEST_LEVELS, _MOST_MARKS = 0.5, 8, 3
# errors of a bus: their least number, and times further from the mean of the rows beside them than others are, and than
# the standard deviation of the signal
_STRAY, _OFF, _OFF_SPREAD, _MANY_LEVELS = 8, 4.0, 0.2, 100
_MARKS = {sign * (10.0**n - 1) for n in range(3, 8) for sign in (1, -1)} | {
    value for bits in (16, 32) for value in (-(2.0 ** (bits - 1)), 2.0 ** (bits - 1) - 1, 2.0**bits - 1)
}
# steps of so much of the extent of a signal, with both ends at one distance from 0, from which on it is taken to wrap
_JUMPS, _WHOLE, _SYMMETRIC = 5, 0.75, 0.05
WRAPS = "wraps at the end of its range"
# a record begins or ends at rest for so many windows (s), and times the longest stretch within the motion, of which
# content is below a multiple of that of the first ones and the mean is theirs (g), as few windows of the motion are
_WINDOW_S, _REST, _LONGER_REST, _QUIET, _TURNED_G, _SELDOM, _MOVED = 0.25, 6, 3, 1.5, 0.1, 0.1, 2.5
_WIDTHS = (8, 10, 12, 14, 16, 18, 20, 24, 32)  # bits of counts


def window_of(t: np.ndarray, start: float, to: float) -> slice:
    """Rows of ``t``, (N,) s, from ``start`` to ``to``, s since the first. Raises `InputError`: fewer than two."""
    since = t - t[0]
    begun = since >= start
    first = np.argmax(begun) if begun.any() else t.size
    beyond = since[first:] > to
    last = first + (np.argmax(beyond) if beyond.any() else beyond.size)
    if last - first < 2:
        end = "the end" if to == np.inf else f"`to: {to:g}`"
        raise InputError(
            f"{last - first} rows are between `from: {start:g}` and {end}, in s since the first row; the file holds "
            f"{since[-1]:.6g} s."
        )
    return slice(int(first), int(last))


def without_gaps(
    stamps: Stamps | None, lost: np.ndarray, axes: pd.DataFrame, gaps: str
) -> tuple[Stamps | None, pd.DataFrame, int, str]:
    """Stamps and axes without gaps, rows left out before them, and words on what was done.

    ``lost`` are the numbers of rows missing between rows, (N - 1,); other samples of ``axes`` are missing where NaN
    stands. ``gaps`` is ``longest`` or ``bridge`` (`SensorMapping.gaps`). Raises `InputError`: too much is missing.
    """
    count, missing = len(axes), axes.isna().any(axis=1).to_numpy()
    if gaps == "longest":
        window = _longest_stretch(lost, missing)
        if window.stop - window.start < 2:
            raise InputError("no two rows without a gap between them; record the motion again.")
        done = f"rows {window.start + 1} to {window.stop} of {count} kept, the longest part without a gap"
        return stamps and stamps.within(window), axes[window], window.start, done
    if np.isinf(lost).any():
        raise InputError(
            "without stamps it is not known how many samples a message among the rows replaces; keep the longest part, "
            "`gaps: longest`."
        )
    index = np.concatenate([[0], np.cumsum(1 + lost)]).astype(int)
    rows = axes.assign(t=np.arange(count) if stamps is None else stamps.t).set_index(index)[~missing]
    between = np.diff(rows.index) - 1
    longest, bridged = int(between.max(initial=0)), int(between.sum())
    if longest > BRIDGED or bridged > BRIDGED_SHARE * count or len(rows) < 2:
        raise InputError(
            f"{index[-1] + 1 - len(rows)} samples are missing, up to {longest} in a row; at most {BRIDGED} in a row "
            f"and {BRIDGED_SHARE:.0%} are bridged; keep the longest part, `gaps: longest`, or cut the record, "
            "`from: S` and `to: S`."
        )
    done = f"{bridged} samples in {np.count_nonzero(between)} gaps interpolated, at most {longest} in a row"
    rows = rows.reindex(range(rows.index[0], rows.index[-1] + 1)).interpolate("pchip")
    t = rows.pop("t").to_numpy()
    return stamps and stamps._replace(t=t - t[0]), rows, 0, done


def _longest_stretch(lost: np.ndarray, missing: np.ndarray) -> slice:
    """The most rows in a row of which none is ``missing``, and between which none are ``lost``."""
    stretch = np.cumsum(missing | np.concatenate([[False], lost > 0]))
    if missing.all():
        return slice(0, 0)
    rows = np.flatnonzero((stretch == np.bincount(stretch[~missing]).argmax()) & ~missing)
    return slice(int(rows[0]), int(rows[-1]) + 1)


def clipped(axes: pd.DataFrame, largest: float, range_g: float) -> tuple[int, str, list[str]]:
    """Rows with an axis at the end of the sensor's range, or at a value where the sensor is saturated.

    Returned are their number, words on where they stand, and a sentence on every axis that is saturated.
    ``largest`` is the highest value that the sensor writes, g. Raises `InputError`: most rows are such ones.
    """
    at_end = (axes.abs().max(axis=1) >= largest * (1.0 - 1e-6)).to_numpy()
    ends, saturated = f"at the end of the range of {range_g:g} g", []
    for axis, samples in axes.items():
        levels = [level for level in _standing(samples.to_numpy()) if abs(level) < largest * (1.0 - 1e-6)]
        if not levels:
            continue
        standing = np.isin(samples, levels)
        at_end = at_end | standing
        extreme = f"{' and '.join(f'{level:.6g}' for level in levels)} g, the extreme of {axis}"
        ends += f" or at {extreme}"
        saturated.append(
            f"{np.count_nonzero(standing)} of {samples.size} rows stand at {extreme}: the sensor is saturated "
            "there, RMS and peaks are too small; record with a wider range, or state this one, "
            f"`range: {abs(levels[-1]):.6g}`"
        )
    count, rows = int(np.count_nonzero(at_end)), at_end.size
    if count > _CLIPPED * rows:
        raise InputError(
            f"{count} of {rows} rows stand {ends}; record with a wider range, or give the sensor's, `range: G`."
        )
    return count, f"{count} of {rows} rows {ends}", saturated


def marks(values: np.ndarray) -> np.ndarray:
    """(N,) whether a value is a mark of no sample: an extreme that repeats, or that loggers write, far from all others.

    Up to three values may be marks on either side; a long row of one, but not three, is a logger that had not begun.
    """
    levels, counts = np.unique(values[np.isfinite(values)], return_counts=True)
    marked = np.zeros(values.size, bool)
    for sign in (1, -1) if levels.size > _FEWEST_LEVELS else ():
        ends, often = levels[::sign], counts[::sign]
        beyond = np.abs(np.diff(ends))[:_MOST_MARKS] > _APART * np.abs(ends[-2] - ends[1 : _MOST_MARKS + 1])
        number = int(np.argmax(beyond)) + 1 if beyond.any() else 0
        here = np.isin(values, ends[:number])
        known = all(often[k] > 1 or ends[k] in _MARKS for k in range(number))
        runs = np.diff(np.flatnonzero(np.diff(here, prepend=False, append=False)))[::2]
        short = not runs.size or runs.max() <= BRIDGED or runs.size > 2 or ends[0] in _MARKS
        if known and short and here.mean() < _CLIPPED:
            marked |= here
    return marked


def stray(values: np.ndarray) -> np.ndarray:
    """(N,) whether 0 or -1 is an error of a bus: far more frequent than values near it, and off the rows beside it."""
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
    """A sentence on a signal that jumps by its whole extent, more often than by less; none on any other."""
    step, extent = np.abs(np.diff(ay)), float(np.ptp(ay))
    jumps = np.count_nonzero(step > _WHOLE * extent)
    symmetric = abs(ay.max() + ay.min()) < _SYMMETRIC * extent
    if not symmetric or jumps < _JUMPS or jumps < np.count_nonzero(step > 0.5 * extent) - jumps:
        return []
    return [
        f"ay jumps {jumps} times from row to row by nearly all of its {extent:.4g} g: it {WRAPS}, RMS and peaks are "
        "wrong; record with a wider range"
    ]


def signed(values: np.ndarray, bits: int | None) -> tuple[np.ndarray, str]:
    """Counts of which the negative ones are written without a sign, 65535 for -1, with it; and words, if they are.

    Read so the signal jumps by the whole range of the counts where it passes zero: of both readings the one with
    clearly shorter steps is right.
    """
    finite = values[np.isfinite(values)]
    if finite.size < 2 or finite.min() < 0 or (finite != np.round(finite)).any():
        return values, ""
    bits = bits or next((n for n in _WIDTHS if finite.max() < 2**n), 64)
    wrapped = np.where(values >= 2 ** (bits - 1), values - 2**bits, values)
    both = finite.min() < 2 ** (bits - 2) and finite.max() >= 3 * 2 ** (bits - 2)
    if not both or 2 * np.nansum(np.abs(np.diff(wrapped))) > np.nansum(np.abs(np.diff(values))):
        return values, ""
    return wrapped, f" (of {bits} bits, negative from {2 ** (bits - 1)} on)"


def standing_still(ay: np.ndarray, t: np.ndarray, largest: float, where: Callable[[int], str]) -> list[str]:
    """A sentence on the longest run of rows that repeat ``ay``, (N,) g, if it is far longer than others.

    Rows at the end of the range, ``largest`` g, are clipped: they say nothing of the logger. ``t``, (N,), is the time
    since the first row of the file, s.
    """
    moved = np.flatnonzero(np.append(True, np.diff(ay) != 0))
    runs = np.diff(moved, append=ay.size)
    first, count = int(moved[np.argmax(runs)]), int(runs.max())
    at_end = abs(ay[first]) >= largest * (1.0 - 1e-6) or t[first + count - 1] - t[first] < _STILL_S
    if at_end or count < max(_STILL, _MUCH_LONGER * np.quantile(runs, 0.99, method="lower")):
        return []
    last = first + count - 1
    cuts = [f"`from: {t[last + 1]:.6g}`" for _ in t[last + 2 :][:1]] + [f"`to: {t[first - 1]:.6g}`"] * (first > 1)
    return [
        f"the {count} rows from {where(first)} to {where(last)} have one ay, {ay[first]:.6g} g, as of a logger "
        f"that had not begun or a sensor that hung: cut them off, {' or '.join(cuts)}"
    ]


def at_rest(ay: np.ndarray, rate: float, since: np.ndarray) -> list[str]:
    """Sentences on a record, (N,) g, that begins or ends at rest: with far less content than any stretch of motion.

    The content is that from 2 Hz on, in windows of 0.25 s. ``since``, (N,), is the time since the first row, s.
    """
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
    return [
        f"the record {side} at rest: for {level.size * _WINDOW_S:g} s its content from 2 Hz on is "
        f"{np.median(level):.2g} g, otherwise {usual:.2g} g; leave that out, {cut}"
        for side, level, cut in (
            ("begins", content[:begin], f"`from: {since[moving[0] * count]:.6g}`"),
            ("ends", content[end:], f"`to: {since[(moving[-1] + 1) * count - 1]:.6g}`"),
        )
        if level.size
    ]


def _rest(content: np.ndarray, mean: np.ndarray) -> int:
    """Number of windows at rest with which a record begins, by their (W,) content and mean, g, which gravity turns."""
    still, upright = np.median(content[:_REST]), np.median(mean[:_REST])
    loud = np.flatnonzero((content >= _QUIET * still) | (np.abs(mean - upright) > _TURNED_G))
    if loud.size == 0 or loud[0] < _REST:
        return 0
    motion = content[loud[0] : loud[-1] + 1]
    longest = int(np.diff(loud).max(initial=1)) - 1
    as_quiet = 1 - loud.size / motion.size
    at_rest = loud[0] >= _LONGER_REST * longest and as_quiet < _SELDOM
    return int(loud[0]) if at_rest and np.median(motion) > _MOVED * np.median(content[: loud[0]]) else 0


def _standing(values: np.ndarray) -> list[float]:
    """Extreme values at which a signal stands: more samples than a signal that only peaks there has."""
    levels, counts = np.unique(values, return_counts=True)
    ends = ((0, 1), (-1, -2)) if levels.size > 2 else ()
    return [
        float(levels[end]) for end, following in ends if counts[end] >= max(_STANDING, _MORE_OFTEN * counts[following])
    ]


def on_even_instants(t: np.ndarray, axes: pd.DataFrame, rate: float) -> tuple[pd.DataFrame, str]:
    """Axes at even instants of ``rate`` Hz by cubic splines through the stamps ``t``, s; and words on it."""
    even = np.arange(int(t[-1] * rate * (1 + 1e-12)) + 1) / rate
    resampled = scipy.interpolate.CubicSpline(t, axes.to_numpy())(even)
    words = f"{t.size} rows onto {even.size} even instants, by cubic splines"
    return pd.DataFrame(resampled, columns=axes.columns), words


def whole_ratio(rate: float, slower: float) -> int:
    """Samples at ``rate`` that take the time of one at a ``slower`` rate (Hz); 0 if these are not whole, to 1 %."""
    count = max(round(rate / slower), 1)
    return count if abs(rate / slower / count - 1) <= RATE_TOLERANCE else 0


def means(values: np.ndarray, rate: float, slower: float) -> np.ndarray:
    """(M,) means over the samples of a ``slower`` rate (Hz) of (N,) values that are means over their own samples.

    Their integral is known at the ends of the samples; between them it is a cubic spline.
    """
    if count := whole_ratio(rate, slower):
        return values[: values.size // count * count].reshape(-1, count).mean(axis=1)
    integral = scipy.interpolate.CubicSpline(np.arange(values.size + 1) / rate, np.append(0, np.cumsum(values)) / rate)
    ends = np.arange(int(values.size / rate * slower * (1 + 1e-12)) + 1) / slower
    return np.diff(integral(ends)) * slower


def decimated(axes: pd.DataFrame, rate: float) -> tuple[pd.DataFrame, float, str]:
    """Axes of ``rate`` Hz at ``HIGHEST_RATE_HZ`` Hz or so behind an anti-alias filter, their rate (Hz), and words."""
    ratio = Fraction(HIGHEST_RATE_HZ / rate).limit_denominator(1000)
    slower = scipy.signal.resample_poly(axes.to_numpy(), ratio.numerator, ratio.denominator, padtype="line")
    words = f"{len(axes)} rows to {len(slower)}, {float(rate * ratio):.7g} Hz, behind an anti-alias filter"
    return pd.DataFrame(slower, columns=axes.columns), float(rate * ratio), words

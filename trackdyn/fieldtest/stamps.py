"""Time stamps of a record: its rate, and whether its rows are even in time.

Stamps are rounded, to decimals or to single precision, so their steps vary although the samples are even. A straight
line through all stamps tells rounding from lost rows: rounded ones stay within one unit of it.
"""

import re
import warnings
from collections.abc import Callable
from itertools import compress, product
from typing import NamedTuple

import numpy as np
import pandas as pd
from pandas.tseries.api import guess_datetime_format

from trackdyn.fieldtest.sensor_mapping import RATES, TIME_UNITS, TIMES, Column
from trackdyn.inputs.errors import InputError, shown

TOLD_APART = (100.0, 20_000.0)  # Hz; narrow enough that they tell s, ms, us and ns apart
_EVEN = 0.1  # intervals by which a step may differ beyond rounding
_SAME_RATE = 1e-3
_GAP = 2.5  # intervals; a longer step is not interpolated
_BITS = (16, 24, 32)  # of counters that begin again at 0
_SINCE_1970_MS = 1e11  # larger stamps are ms of a calendar, not row numbers
NO_STAMPS = "`time: none, rate: HZ`"
_REMEDY = (
    "cut the record with `from: S` and `to: S`, mend few with `gaps: bridge` or keep the longest part with "
    f"`gaps: longest`, or read it without stamps, {NO_STAMPS}, if only these are wrong"
)

_ISO = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d([.,]\d{1,9})?)?(Z|[+-]\d\d(:?\d\d)?)?", re.ASCII)  # ISO 8601
_HALF = r"\s?([AaPp])\.?[Mm]\.?"  # of the day
_CLOCK = rf"\d{{1,2}}:\d\d(:\d\d)?([.,:]\d{{1,9}})?({_HALF})?"
_DAY = (
    r"(\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[-/.]\d{1,2}[-/.](\d{4}|\d\d)|\d{8}"
    r"|\d{1,2}[- ]?[A-Za-z]{3,9}\.?[- ]?\d{2,4}|[A-Za-z]{3,9} \d{1,2},? \d{4})"
)
_ZONE = r"([A-Z]{3,4}|Z|[+-]\d\d(:?\d\d)?)"
_WEEKDAY = r"(Mon|Tue|Wed|Thu|Fri|Sat|Sun)[a-z]*,? "
DATE = re.compile(
    rf"({_WEEKDAY})?{_DAY}((T|,? +|[_-]){_CLOCK} ?{_ZONE}?)?|(\d{{1,6}}( days?,? |\.))?\d?{_CLOCK}"
    rf"|\d{{8}}[T _-]?\d{{6}}[.,]\d{{1,9}}{_ZONE}?",
    re.ASCII,
)
# days, and hours, minutes and seconds, or the last two
_DURATION = re.compile(r"^(?:(\d{1,6})(?: days?,? |\.))?(?:(\d{1,3}):)?(\d{1,3}):(\d\d(?:\.\d{1,9})?)$", re.ASCII)
# patterns in dates and times, and their replacements
_FORMS: dict[str, str | Callable[[re.Match[str]], str]] = {
    r"(?<=\d),(?=\d)|(?<=:\d\d):(?=\d{3})": ".",
    rf"^{_WEEKDAY}": "",
    r"(?<=\d) ?[A-Z]{3,4}$": "",  # the name of a zone
    r"^(\d{4})(\d\d)(\d\d)[T _-]?(\d\d)(\d\d)(\d\d\.)": r"\1-\2-\3 \4:\5:\6",
    r"^([^:]*\d)[_-](\d{1,2}:)": r"\1 \2",
    r"^(\d{1,2}[-/.]\d{1,2}[-/.])(?=\d\d\D)": r"\g<1>20",  # a year of two digits
    rf"(?<=\d){_HALF}$": lambda half: f" {half[1].upper()}M",
    r"(:\d\d:\d\d)(?![\d.])": r"\1.0",
}


class Stamps(NamedTuple):
    """Time of the rows from the first one on, s, the unit of the file's stamps and their rounding, s."""

    t: np.ndarray
    unit: str
    rounding: float
    guessed: str = ""  # unit, where the file states none and this one gives a likely rate

    def within(self, window: slice) -> "Stamps":
        """Return the stamps of some rows, from the first of them on."""
        return self._replace(t=self.t[window] - self.t[window.start])


def seconds_of(texts: list[str]) -> np.ndarray:
    """Return (N,) seconds since the first row of dates, times of day or durations; NaN for any other text.

    A clock continues over midnight, one of 12 hours over noon, one of minutes over the hour. Whether 1/2 is in February
    follows from the whole record: in the other order some dates do not exist, or midnight takes a month.
    """
    valid = [bool(DATE.fullmatch(text)) for text in texts]
    for written, form in _FORMS.items():
        if any(re.search(written, text) for text in texts[:100]):
            texts = [re.sub(written, form, text) for text in texts]
    first = next(compress(texts, valid), "")
    if _DURATION.fullmatch(first):
        days, hours, minutes, rest = pd.Series(texts).str.extract(_DURATION).astype(float).to_numpy().T
        seconds = 86_400.0 * np.nan_to_num(days) + (rest + minutes * 60.0 + np.nan_to_num(hours) * 3600.0)
        rows = np.flatnonzero(np.isfinite(seconds))
        back = -np.diff(seconds[rows], prepend=seconds[rows[:1]])
        turns = (3600.0,) if first.count(":") == 1 else (86_400.0, 43_200.0)
        seconds[rows] += np.cumsum(np.select([(back > turn / 2) & (back <= turn) for turn in turns], turns, 0.0))
        return seconds - seconds[rows[0]]
    clock = bool(re.fullmatch(_CLOCK, first, re.ASCII))
    texts = [f"2000-01-01 {text}" for text in texts] if clock else texts
    orders = (True,) if _ISO.fullmatch(first) else (True, False)
    seconds = min((_since_first(texts, valid, day_first) for day_first in orders), key=_improbability)
    rows = np.flatnonzero(np.isfinite(seconds))
    seconds[rows] += 86_400.0 * np.cumsum(clock & (np.diff(seconds[rows], prepend=0.0) < -43_200.0))
    return seconds


def _since_first(texts: list[str], valid: list[bool], day_first: bool) -> np.ndarray:
    """Return (N,) seconds since the first of dates in the form of the first valid one; NaN for any other form."""
    texts = [text if right else "" for text, right in zip(texts, valid, strict=True)]
    first = next(filter(None, texts), "")
    form: str | None = "ISO8601"
    if not _ISO.fullmatch(first):
        # pandas guesses no form where the hour of the day is not the hour as written
        first = re.sub(r"\d{1,2}(:\d\d:\d\d\.\d+) [AP]M$", r"10\1 AM", first)
        # with dayfirst pandas also reads 2024/05/01 day first, and elsewhere swaps day and month where they do not fit
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            form = guess_datetime_format(first, dayfirst=day_first and not re.match(r"\d{4}", first))
    instants = pd.to_datetime(texts, format=form or "NaT", utc=True, errors="coerce")
    return (instants - instants[instants.notna().argmax()]).to_numpy() / np.timedelta64(1, "s")


def _improbability(seconds: np.ndarray) -> tuple[int, float]:
    """Return how many dates of a reading do not exist, and the days that it spans."""
    exist = seconds[np.isfinite(seconds)]
    return seconds.size - exist.size, float(np.ptp(exist)) // 86_400.0 if exist.size else 0.0


def in_seconds(time: Column, values: np.ndarray, stated: bool) -> Stamps:
    """Convert ``values``, (N,), of a column to s since the first, by its unit or the likely one; or `InputError`."""
    unit = TIMES.get(time.unit, TIMES.get(time.base))
    if time.unit and not unit:
        remedy = f"{', '.join(TIME_UNITS)} are read, choose another column, `time: NAME`, or give {NO_STAMPS}"
        raise InputError(f"column {shown(time.name)} has the unit {shown(time.unit)}; {remedy}.")
    values, words = _unwrapped(values)
    if not (unit or stated) and values[0] < _SINCE_1970_MS and _may_count(values):
        counts = "rises by 1 from row to row and states no unit, so it may be the row number"
        remedy = f"give the rate, {NO_STAMPS}, or, if these are ms, `rate: 1000`"
        raise InputError(f"column {shown(time.name)} {counts}; {remedy}.")
    step = np.median(np.abs(np.diff(values))) or np.mean(np.diff(values))
    rates = {u: 1.0 / (step * s) if step > 0 else np.inf for u, s in TIME_UNITS.items()}
    low, high = RATES if unit else TOLD_APART
    # a rate at the end of the range may come out a little beyond it
    fits = [u for u, hz in rates.items() if low / 1.01 <= hz <= high * 1.01 and u == (unit or u)]
    if not fits:
        wrong = f"{rates[unit or 's']:.6g} rows per second if it is in {unit or 's'}, {low:,.0f} to {high:,.0f}"
        remedy = f"name another column with `time: NAME`, or give {NO_STAMPS}"
        raise InputError(f"field {time.name} gives {wrong} are accepted; {remedy}.")
    size = TIME_UNITS[fits[0]]
    return Stamps((values - values[0]) * size, fits[0] + words, rounding(values) * size, "" if unit else fits[0])


def is_index(values: np.ndarray) -> bool:
    """Return whether numbers rise by one whole number from row to row, as those of every row or every fifth do."""
    step = np.diff(values)
    return step.size > 0 and bool(step[0] >= 1 and step[0] % 1 == 0 and (step == step[0]).all())


def _may_count(values: np.ndarray) -> bool:
    """Return whether numbers rise by 1, except for lost rows; ms of a rate other than 1000 Hz skip some evenly."""
    step = np.diff(values)
    if step.size < 2 or np.median(step) != 1 or (step < 1).any() or (step % 1).any():
        return False
    line = values - np.polyval(np.polyfit(row := np.arange(values.size), values, 1), row)
    return bool(np.count_nonzero(step > 1) < 3 or np.ptp(line) > 1.2)


def _unwrapped(values: np.ndarray) -> tuple[np.ndarray, str]:
    """Return stamps, continued where their counter begins again at 0, and a note if they are."""
    step = np.diff(values)
    over, near = step < 0, 3 * np.median(np.abs(step))
    if not over.any() or values.min() < 0:
        return values, ""
    for bits, unit in product(_BITS, TIME_UNITS.values()):
        size = 2**bits * unit
        if values.max() < size and values[:-1][over].min() > size - near and values[1:][over].max() < near:
            return values + size * np.append(0, np.cumsum(over)), f" of a counter of {bits} bits that began again"
    return values, ""


def rounding(values: np.ndarray) -> float:
    """Return the unit to which stamps are rounded: a power of ten, or the spacing of single precision."""
    noise = 4 * np.spacing(np.abs(values).max())
    decimals = next((d for d in range(10) if np.abs(values - np.round(values, d)).max() <= noise), None)
    unit = noise if decimals is None else 10.0**-decimals
    seen = values[:: max(values.size // 2000, 1)]
    with np.errstate(over="ignore"):
        some = seen.astype(np.float32)
    whole = some.astype(float)
    # written in full, as short as single precision allows, or to these decimals
    copies = whole, some.astype(str).astype(float), np.round(whole, 9 if decimals is None else decimals)
    if any(np.abs(copy - seen).max() <= noise for copy in copies):
        unit = max(unit, float(np.spacing(np.abs(some).max())))
    return float(unit)


def lost_rows(t: np.ndarray, rate: float | None, resample: bool) -> np.ndarray:
    """Return (N - 1,) counts of rows missing between rows of the stamps ``t``, (N,) s."""
    step = np.diff(t)
    usual = 1.0 / rate if rate else float(np.median(step) or np.mean(step))
    return np.where(step > (_GAP if resample else 1.5) * usual, np.maximum(np.round(step / usual) - 1.0, 0.0), 0.0)


def judge_stamps(
    stamps: Stamps, where: Callable[[int], str], rate: float | None, resample: bool
) -> tuple[float, str, bool, str]:
    """Return the rate of a record, Hz, its source, whether rows are even in time, words on steps; or `InputError`."""
    t, q, n = stamps.t, stamps.rounding, stamps.t.size
    step = np.diff(t)
    if step.min() < 0.0:
        k = int(np.argmax(step < 0.0))
        back = f"the time in {where(k + 1)} is {-step[k]:.6g} s before that of the row above"
        if step.max() <= 0.0:
            raise InputError(f"{back}, as in every row: the newest row is first; sort the rows by time.")
        wrong = f"only stamps are wrong, such as 0.8 for 0.008, read them without, {NO_STAMPS}"
        remedy = "else sort the rows, or cut the record with `from: S` and `to: S`"
        raise InputError(f"{back}; if the rows are in order and {wrong}; {remedy}.")
    if t[-1] == 0.0:
        raise InputError(f"the stamps of all {n} rows are equal; read them without, {NO_STAMPS}.")
    if (gaps := step > _GAP * max(np.median(step), np.mean(step)) + q).any():
        k = int(np.argmax(gaps))
        gap = f"a gap from {t[k]:.9g} to {t[k + 1]:.9g} s (since the first row) before {where(k + 1)}"
        raise InputError(f"{gap}, {np.median(step):.6g} s is usual; {_REMEDY}.")
    row = np.arange(n)
    fitted = float(1.0 / np.polyfit(row, t, 1)[0] if n > 2 else 1.0 / t[1])
    fitted = float(round(fitted)) if abs(fitted / round(fitted) - 1.0) < 1e-6 else fitted
    if rate and abs(fitted / rate - 1.0) > (10 if resample else 1) * _SAME_RATE + q / t[-1]:
        remedy = f"give `rate: {fitted:.6g}` if the stamps are right, else {NO_STAMPS}"
        raise InputError(f"the stamps run at {fitted:.6g} Hz, not at {rate:.6g} Hz, as given; {remedy}.")
    hz = rate or fitted
    odd, equal = np.abs(step * hz - 1.0), np.ptp(step) * hz < 1e-6
    low, high, scatter = 1e3 * step.min(), 1e3 * step.max(), 1e3 * np.std(step)
    line = "equal steps" if equal else f"steps {low:.4g} to {high:.4g} ms, {scatter:.2g} ms rms about their mean"
    if q * hz > 1.5:
        remedy = f"read it without them, {NO_STAMPS}, if all rows are of one sensor"
        raise InputError(f"stamps of {q:.2g} s are too coarse for {hz:.5g} rows per second; {remedy}.")
    if q * hz >= 0.4:
        # a step cannot tell a lost row from rounding; a few odd ones cannot either, many at even distances can
        count, expected = np.count_nonzero(odd > 0.5), n * abs(1.0 / (q * hz) - 1.0)
        explained = count <= expected + 0.5 if rate else count == 0 or count >= 3
        even = explained and np.ptp(t - row / hz) <= 1.2 * q
    else:
        half = (n - 1) // 2
        drift = t[half] / (t[2 * half] - t[half]) - 1.0 if half else 0.0
        even = odd.max() <= _EVEN + q * hz and abs(drift) <= _SAME_RATE + 4 * q / t[-1] + 4 * _EVEN / n
    if even or (resample and step.min() > 0.0):
        source = f"from the stamps{f', taken for {stamps.guessed}' * bool(stamps.guessed)}"
        return hz, "as given" if rate else source, bool(even), line
    k = int(np.argmin(step) if step.min() == 0.0 else np.argmax(odd))
    odd_step = f"the stamps before {where(k + 1)} are {step[k]:.6g} s apart, {1.0 / hz:.6g} s is the mean ({line})"
    remedy = f"`resample: true` interpolates onto an even grid if no two are equal, else {_REMEDY}"
    raise InputError(f"{odd_step}, rows are missing or unevenly timed; {remedy}.")

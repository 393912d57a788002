"""What the time stamps of a record tell: its rate, and whether its rows are even in time.

Stamps are rounded, to decimals or to single precision, so the steps between them vary although the samples are even.
Rounding is told from lost rows by the straight line through all stamps: rounded ones stay within one unit of it.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from trackdyn.errors import InputError

RATES = (100.0, 20_000.0)  # Hz; narrow enough that they tell s, ms, us and ns apart
UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_EVEN = 0.1  # of an interval, by which a step may differ beyond rounding
_SAME_RATE = 1e-3
_GAP = 2.5  # intervals; what lies between is no longer interpolated
_REMEDY = (
    "cut the record with --from and --to, or read it without stamps, --time none --rate HZ, if only these are at fault"
)


class Stamps(NamedTuple):
    """Time of the rows from the first one on, s, the unit of the file's stamps and what they are rounded to, s."""

    t: np.ndarray
    unit: str
    rounding: float


class Clock(NamedTuple):
    """Samples a second, whether the rows are even, and a line about the steps."""

    rate_hz: float
    even: bool
    steps: str


def in_seconds(path: Path, name: str, values: np.ndarray, unit: str | None) -> Stamps:
    """Stamps in s since the first one; a unit that is not known is the only one that gives a rate within ``RATES``.

    Raises `InputError`: no unit fits, or not the one that is known.
    """
    step = np.median(np.diff(values)) or np.mean(np.diff(values))
    rates = {u: 1.0 / (step * s) if step > 0 else np.inf for u, s in UNITS.items()}
    # a rate at the end of the range may be found a little beyond it
    fits = [u for u, hz in rates.items() if RATES[0] / 1.01 <= hz <= RATES[1] * 1.01 and u == (unit or u)]
    if not fits:
        raise InputError(
            f"{path}: field {name} gives {rates[unit or 's']:.6g} rows a second if it is in "
            f"{unit or 's'}, {RATES[0]:g} to "
            f"{RATES[1]:g} are accepted; name another column with --time, or give --time none --rate HZ."
        )
    return Stamps((values - values[0]) * UNITS[fits[0]], fits[0], _rounding(values) * UNITS[fits[0]])


def _rounding(values: np.ndarray) -> float:
    """What stamps are rounded to: a power of ten, or the spacing of single precision."""
    noise = 4 * np.spacing(np.abs(values).max())
    decimals = next((d for d in range(10) if np.abs(values - np.round(values, d)).max() <= noise), None)
    found = noise if decimals is None else 10.0**-decimals
    seen = values[:: max(values.size // 2000, 1)]
    some = seen.astype(np.float32)
    # written in full, as short as single precision allows, or with so many decimals
    kept = (
        some.astype(float),
        some.astype(str).astype(float),
        np.round(some.astype(float), 9 if decimals is None else decimals),
    )
    if any(np.abs(one - seen).max() <= noise for one in kept):
        found = max(found, float(np.spacing(np.abs(some).max())))
    return float(found)


def judge_stamps(path: Path, stamps: Stamps, first_line: int, rate: float | None, resample: bool) -> Clock:
    """Rate of a record, and whether its rows are even; ``rate`` is what the user says it is.

    Raises `InputError`: rows are missing, jitter or drift without leave to resample, or have not the rate given.
    """
    t, q, n = stamps.t, stamps.rounding, stamps.t.size
    step = np.diff(t)
    if step.min() < 0.0:
        k = int(np.argmax(step < 0.0))
        raise InputError(
            f"{path}: the time in line {first_line + k + 1} is {-step[k]:.6g} s before that of the row above; sort the "
            "rows or cut the record with --from and --to."
        )
    gaps = np.flatnonzero(step > _GAP * max(np.median(step), np.mean(step)) + q)
    if gaps.size:
        k = int(gaps[0])
        raise InputError(
            f"{path}: a gap from {t[k]:.9g} to {t[k + 1]:.9g} s (since the first row) before line "
            f"{first_line + k + 1}, {np.median(step):.6g} s is usual; {_REMEDY}."
        )
    row = np.arange(n)
    found = 1.0 / np.polyfit(row, t, 1)[0] if n > 2 else 1.0 / t[1]
    found = float(round(found)) if abs(found / round(found) - 1.0) < 1e-6 else float(found)
    if rate is not None and abs(found / rate - 1.0) > (10 if resample else 1) * _SAME_RATE + q / t[-1]:
        raise InputError(
            f"{path}: the stamps run at {found:.6g} Hz, not at --rate {rate:g}; leave it out, or give --time none if "
            "the stamps are wrong."
        )
    hz = rate or found
    odd = np.abs(step * hz - 1.0)
    low, high, scatter = 1e3 * step.min(), 1e3 * step.max(), 1e3 * np.std(step)
    line = f"steps {low:.4g} to {high:.4g} ms, {scatter:.2g} ms rms about their mean"
    if np.ptp(step) * hz < 1e-6:
        line = "equal steps"
    if q * hz > 1.5:
        raise InputError(
            f"{path}: stamps of {q:.2g} s are too coarse for {hz:.5g} rows a second; read it without "
            "them, --time none --rate HZ."
        )
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
        return Clock(hz, bool(even), line)
    k = int(np.argmin(step) if step.min() == 0.0 else np.argmax(odd))
    raise InputError(
        f"{path}: the stamps before line {first_line + k + 1} are {step[k]:.6g} s apart, "
        f"{1.0 / hz:.6g} s is the mean ({line}), rows are missing or unevenly timed; "
        f"--resample interpolates onto an even grid if no two are equal, else {_REMEDY}."
    )

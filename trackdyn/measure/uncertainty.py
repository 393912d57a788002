"""Uncertainty of measures: scatter over passages, differences of two runs, limits, and step errors.

A measure of a record in steady running is a mean over passages of a pitch (`Series`). Batches of passages give the
scatter of the mean, the marginal standard error rule its transient, and pairs of passages at equal times the difference
of two runs with the same start, which scatters less than either (common random numbers: Law, Simulation Modeling and
Analysis, 5th edition, 2015, ch. 11.2). Runs at several steps give the limit at a step of zero (`limit_of`).
"""

import csv
from collections.abc import Callable, Mapping
from functools import cache
from itertools import pairwise
from math import cos, hypot, inf, isqrt, pi, sin, sqrt, tan
from pathlib import Path
from typing import NamedTuple

import numpy as np

from trackdyn.rig.roots import root

CONFIDENCE = 0.95
MANY_DEGREES = 1000  # of freedom, above which Student's distribution is the normal one to 0.1 %
ROUNDING = 1e-9  # relative standard error that is rounding, and is not shown
NAN = float("nan")


def batch_error(values) -> tuple[float, float]:
    """Return the standard error of the mean of (m,) successive values, and the half width of its 95 % interval.

    It is that of overlapping batch means (Meketon and Schmeiser, Winter Simulation Conference, 1984, 227-230): batches
    of about the root of the number of values, so that neighbours are correlated, or make up for each other, only within
    a batch (Flegal and Jones, Annals of Statistics 38, 2010, 1034-1070). NaN for fewer than two values.
    """
    count, size = len(values), isqrt(len(values))
    if count < 2:
        return NAN, NAN
    values = np.subtract(values, values[0], dtype=float)  # values that repeat have an error of exactly 0
    off = np.lib.stride_tricks.sliding_window_view(values, size).mean(axis=1) - values.mean()
    error = sqrt(size * float(off @ off) / (count - size + 1) / (count - size))
    return error, student(batch_degrees(count)) * error


@cache
def batch_degrees(count: int) -> int:
    """Return the degrees of freedom of the `batch_error` of ``count`` values, to a whole number; 0 for fewer than two.

    Mean and variance of the squared error of independent values are those of a chi-square distribution with them.
    """
    if count < 2:
        return 0
    size = isqrt(count)
    lag = np.arange(count - size + 1)
    covariance = np.maximum(size - lag, 0) / size**2 - 1 / count  # of two batches that begin ``lag`` values apart
    pairs = np.where(lag, 2, 1) * (len(lag) - lag)
    return round((len(lag) * covariance[0]) ** 2 / float(pairs @ covariance**2))


@cache
def student(degrees: int, confidence: float = CONFIDENCE) -> float:
    """Return the two-sided quantile of Student's distribution: half of the interval of a mean, in standard errors.

    It solves Eqs. 26.7.3 and 26.7.4 of Abramowitz and Stegun, Handbook of Mathematical Functions, 1964, since the
    import of `scipy.special` takes longer than all measures of a short record. NaN for fewer than one degree.
    """
    if degrees < 1:
        return NAN
    degrees = min(degrees, MANY_DEGREES)
    powers = np.arange(degrees % 2, degrees - 1, 2)
    factors = np.cumprod(np.append(1.0, (powers[1:] - 1) / powers[1:]))[: len(powers)]

    def beyond(angle: float) -> float:
        series = sin(angle) * float(factors @ cos(angle) ** powers)
        return (2 * (angle + series) / pi if degrees % 2 else series) - confidence

    return sqrt(degrees) * tan(root(beyond, 0.0, pi / 2))


def welch_degrees(whole: float, *parts: tuple[float, int]) -> int:
    """Return the degrees of freedom of a ``whole`` standard error; ``parts`` are contributions and their degrees.

    They follow from the formula of Welch and Satterthwaite (JCGM 100:2008, G.4.1, rounded down); other contributions
    have infinite degrees.
    """
    if not whole > 0:
        return MANY_DEGREES
    inverse = sum((error / whole) ** 4 / degrees for error, degrees in parts if error > 0 and degrees > 0)
    return int(min(max(1.0 / inverse, 1.0), MANY_DEGREES)) if inverse else MANY_DEGREES


def ratio_values(numerator: np.ndarray, denominator: np.ndarray) -> np.ndarray:
    """Return (m,) values whose mean is ``sum(numerator) / sum(denominator)``, 0 of zeros.

    Their scatter is that of the ratio to first order (Cochran, Sampling Techniques, 3rd edition, 1977, Eq. 6.13).
    """
    if not denominator.sum():
        return np.zeros(len(numerator))
    ratio = numerator.sum() / denominator.sum()
    return ratio + (numerator - ratio * denominator) / denominator.mean()


def turn_edges(samples: int, turn: float) -> np.ndarray:
    """Return the edges of the whole turns in a record, in samples; a turn that ends on the last sample counts."""
    return np.rint(np.arange(int(samples / turn + 1e-9) + 1) * turn).astype(int)


def turn_error(a, turn: float, statistic: Callable[[np.ndarray], float]) -> float:
    """Return the standard error of a statistic over whole turns of ``turn`` samples; NaN for fewer than two."""
    return batch_error([statistic(a[first:last]) for first, last in pairwise(turn_edges(len(a), turn))])[0]


class LineError(NamedTuple):
    """Standard errors of frequency and amplitude of the highest bin and of the bin-free line."""

    bin_hz: float = NAN
    bin_amplitude: float = NAN
    hz: float = NAN
    amplitude: float = NAN
    beyond_hz: float = NAN  # frequency of the line from the phases of the revolutions less the stated one, Hz


def line_error(a, rate_hz: float, bin_hz: float, loop_hz: float) -> LineError:
    """Return the standard errors of the dominant peak of a record, from the line in each revolution of the loop.

    The complex amplitude of the line is computed for every revolution (complex demodulation: Bloomfield, Fourier
    Analysis of Time Series, 2nd edition, 2000, ch. 7). The scatter of its modulus gives the error of the amplitude, the
    scatter of its phase about a straight line that of the frequency. The amplitude of a bin is the mean of the same
    numbers with the phase of the bin. The frequency of a bin has the standard uncertainty of a uniform distribution,
    the width of the bin over the root of 12 (JCGM 100:2008, 4.3.7).

    ``bin_hz`` is the highest bin (`spectra.main_line`), ``loop_hz`` the line (`spectra.main_line_binfree`). Amplitudes
    need two whole revolutions, the frequency three; without these their errors are NaN.
    """
    a = np.asarray(a, dtype=float) - np.mean(a)
    edges = turn_edges(a.size, rate_hz / loop_hz)
    count, resolution = len(edges) - 1, float(rate_hz / a.size / np.sqrt(12.0))
    if count < 2:
        return LineError(resolution)
    times = 0.5 * (edges[:-1] + edges[1:] - 1) / rate_hz
    first = _demodulated(a, rate_hz, edges, loop_hz)
    mean = first.mean()
    turned = first * np.conj(mean) / abs(mean)
    hz, phase, since = NAN, turned.imag / abs(mean), times - times.mean()
    slope = float(since @ phase / (since @ since))
    if count > 2:
        residual = phase - phase.mean() - since * slope
        hz = float(np.sqrt(residual @ residual / (count - 2) / (since @ since)) / (2 * np.pi))
    harmonic = max(1, round(bin_hz / loop_hz))  # of the loop, of the bin
    lines = first if harmonic == 1 else _demodulated(a, rate_hz, edges, harmonic * loop_hz)
    phase_factor = np.exp(-2j * np.pi * (bin_hz - harmonic * loop_hz) * times)
    complete = (lines * phase_factor).mean()
    scatter = ((lines - lines.mean()) * phase_factor * np.conj(complete) / abs(complete)).real
    return LineError(resolution, batch_error(scatter)[0], hz, batch_error(turned.real)[0], slope / (2 * np.pi))


def _demodulated(a: np.ndarray, rate_hz: float, edges: np.ndarray, hz: float) -> np.ndarray:
    """Return the (n,) complex amplitude of a frequency in n intervals of a signal, with phases from its start."""
    products = a * np.exp(-2j * np.pi * hz / rate_hz * np.arange(a.size))
    return 2.0 * np.add.reduceat(products[: edges[-1]], edges[:-1]) / np.diff(edges)


LEAST_PASSAGES = 9  # of a record: with fewer the scatter is uncertain
DRIFT = 0.25  # largest difference of turns before a record, and of its halves, as a share of a tolerance
COVERAGE = 2.0  # standard errors of a 95 % interval of a normal distribution


class Estimate(NamedTuple):
    """A value with its standard error and the half width of its 95 % interval; NaN for too few passages."""

    value: float
    error: float
    half_width: float


class Series(NamedTuple):
    """A measure by passage."""

    values: np.ndarray  # (m,) values to average: mean squares for RMS and SD, the measure for the others
    passage: np.ndarray  # (m,) integers, passages of the record
    root: bool = False  # the measure is the root of the mean
    scale: float | None = None  # reference of its tolerances; None: its value

    def between(self, first: int = 0, last: float = inf) -> "Series":
        """Return the passages from ``first`` on and before ``last``."""
        inside = (self.passage >= first) & (self.passage < last)
        return self._replace(values=self.values[inside], passage=self.passage[inside])

    def linear(self) -> np.ndarray:
        """Return (m,) values with the measure as mean, and its scatter to first order."""
        if not self.root or not len(self.values):
            return self.values
        mean = float(self.values.mean())
        value = float(np.sqrt(max(mean, 0.0)))
        return value + (self.values - mean) * (0.5 / value if value else 1.0)

    def estimate(self) -> Estimate:
        """Return the measure with its standard error by batch means."""
        values = self.linear()
        return Estimate(float(values.mean()), *batch_error(values)) if len(values) else Estimate(NAN, NAN, NAN)

    def transient(self) -> int:
        """Return the number of passages to cut at the beginning, by the marginal standard error rule.

        MSER (White, Simulation 69, 1997, 323-334) minimizes the standard error of the rest, at least half of all.
        """
        if (count := len(self.values)) < 2:
            return 0
        remaining = np.arange(count, 0, -1)
        total, square = (np.cumsum(values[::-1])[::-1] for values in (self.values, self.values**2))
        marginal = (square - total**2 / remaining) / remaining**2
        return int(self.passage[np.argmin(marginal[: count // 2 + 1])])


def paired(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the last values of two series in equal numbers: runs with the same end have passages at equal times."""
    count = min(len(first), len(second))
    return first[len(first) - count :], second[len(second) - count :]


class TotalError(NamedTuple):
    """Errors of a measure of a record, relative to the reference of its tolerance."""

    bias: float  # difference from the limit at a step of zero
    bias_error: float  # two standard errors of it
    half_width: float  # half of the 95 % interval of the record
    scatter: float  # two standard errors: the half width for many batches

    def margin(self, tolerance: float) -> float:
        """Return the tolerance of the half width; 0 if the bias exceeds the tolerance."""
        rest = tolerance - self.bias
        return sqrt(rest**2 - self.bias_error**2) if rest > self.bias_error else 0.0


def difference(run: Series, limit: np.ndarray) -> tuple[float, float]:
    """Return a measure of a run less its limit, over their common passages, and its standard error."""
    pairs = np.subtract(*paired(run.linear(), limit))
    return float(pairs.mean()), batch_error(pairs)[0]


def judge_series(
    measures: Mapping[str, Series], tolerances: Mapping[str, float], least: int = LEAST_PASSAGES
) -> tuple[int, dict[str, Estimate], dict[str, bool]]:
    """Return the number of passages to cut, the measures of the rest, and whether they keep their tolerances.

    None is cut if all together keep them; otherwise the longest transient of these measures. A tolerance is kept if
    half of the 95 % interval is within it, and at least ``least`` passages count.
    """
    cut = max((measures[name].transient() for name in tolerances if name in measures), default=0)
    for first in dict.fromkeys((0, cut)):
        rest = {name: measure.between(first) for name, measure in measures.items()}
        means = {name: measure.estimate() for name, measure in rest.items()}
        reached = {
            name: name in rest
            and len(rest[name].values) >= least
            and bool(means[name].half_width <= tolerance * (rest[name].scale or abs(means[name].value) or NAN))
            for name, tolerance in tolerances.items()
        }
        if all(reached.values()):
            break
    return first, means, reached


def drifts(measures: Mapping[str, Series], tolerances: Mapping[str, float]) -> bool:
    """Return whether the halves of a record differ by more than their scatter and than `DRIFT` of a tolerance."""
    for name, tolerance in tolerances.items():
        if name in measures and len(measures[name].values) >= 2 * LEAST_PASSAGES:
            halves = np.array_split(measures[name].linear(), 2)  # batches do not scatter by a slow transient
            first, second = (float(half.mean()) for half in halves)
            scatter = hypot(*(batch_error(half)[0] for half in halves))
            scale = measures[name].scale or abs(first + second) / 2
            if abs(second - first) > max(COVERAGE * scatter, DRIFT * tolerance * scale):
                return True
    return False


class Limit(NamedTuple):
    """A measure at a step of zero, extrapolated."""

    value: float  # the limit
    error: float  # standard error
    convergence: float  # part of the error that is convergence, not scatter
    values: np.ndarray  # (m,) by passage, whose mean is the limit


def extrapolated(fine: Series, coarse: Series, weight: float) -> np.ndarray:
    """Extrapolate a measure (m,), by passage, beyond the finer of two runs by ``weight`` times their difference."""
    near, far = paired(fine.linear(), coarse.linear())
    return near + weight * (near - far)


def limit_of(runs: Mapping[float, Series]) -> Limit:
    """Return the limit of a measure, by step (s), at a step of zero; its error is in proportion to the step.

    It is the Richardson extrapolation of the two finest steps (Roache, Journal of Fluids Engineering 116, 1994,
    405-413). Its error combines the scatter over passages and the difference from the extrapolation of the next coarser
    pair of steps, which tests convergence; with only two steps, the difference from the finer one.
    """
    steps = sorted(runs)[:3]
    limits = [extrapolated(runs[fine], runs[coarse], fine / (coarse - fine)) for fine, coarse in pairwise(steps)]
    values, coarser = [*limits, runs[steps[0]].linear()][:2]
    value, convergence = float(values.mean()), float(abs(values.mean() - coarser.mean()))
    return Limit(value, float(np.hypot(batch_error(values)[0], convergence)), convergence, values)


def error_against(series: Series, limit: Limit) -> tuple[float, float]:
    """Return a measure less its limit, and the standard error of this difference."""
    error = np.hypot(difference(series, limit.values)[1], limit.convergence)
    return float(series.estimate().value - limit.value), float(error)


# Largest differences of the included rigs at their default steps from the limit at a step of zero, with rings and
# without one, by columns of a run, over `catalogue.Column.size`. The study `default_step` writes this file.
_LINES = Path(__file__).with_name("step_errors.csv").read_text(encoding="utf-8").splitlines()[1:]
STEP_ERRORS = {columns: tuple(map(float, errors)) for columns, *errors in csv.reader(_LINES)}

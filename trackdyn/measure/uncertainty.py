"""How sure a measure is: its scatter over passages, its difference between two runs, its limit, what the step adds.

A measure of a record in steady running is a mean over passages of a pitch (`Series`). Batches of passages give the
scatter of the mean, the marginal standard error rule its transient, and pairs of passages at equal times the difference
of two runs that start alike, which scatters less than either (common random numbers: Law, Simulation Modeling and
Analysis, 5th edition, 2015, ch. 11.2). Runs at several steps give the limit at a step of zero (`limit_of`).
"""

import csv
from collections.abc import Callable, Mapping
from functools import cache
from itertools import pairwise
from math import cos, hypot, pi, sin, sqrt, tan
from pathlib import Path
from typing import NamedTuple

import numpy as np

from trackdyn.rig.roots import root

CONFIDENCE = 0.95
MANY_DEGREES = 1000  # of freedom: Student's distribution is the normal one to 0.1 % from there on
ROUNDING = 1e-9  # share of a value: a smaller standard error is rounding, and is not shown
NAN = float("nan")


def batches_of(count: int) -> tuple[int, int]:
    """Size and number of the batches that so many successive values make: about the root of their number each."""
    size = max(1, int(np.sqrt(count)))
    return size, count // size


def batch_error(values) -> tuple[float, float]:
    """Standard error of the mean of (m,) successive values, and the half width of its 95 % interval.

    Consistent batch means: batches of about the root of the number of values, so that what a value has in common with
    its neighbours stays within a batch (Flegal and Jones, Annals of Statistics 38, 2010, 1034-1070); the interval is
    Student's with one degree of freedom less than batches. NaN for fewer than two batches.
    """
    values = np.asarray(values, dtype=float)
    size, batches = batches_of(len(values))
    if batches < 2:
        return NAN, NAN
    means = values[len(values) - batches * size :].reshape(batches, size).mean(axis=1)
    error = float(means.std(ddof=1) / np.sqrt(batches))
    return error, student(batches - 1) * error


@cache
def student(degrees: int, confidence: float = CONFIDENCE) -> float:
    """Half of the interval of a mean, in standard errors of so many degrees of freedom: Student's distribution.

    Abramowitz and Stegun, Handbook of Mathematical Functions, 1964, Eqs. 26.7.3 and 26.7.4: to import `scipy.special`
    for it takes longer than all measures of a short record. NaN for fewer than one degree.
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
    """Degrees of freedom of a ``whole`` standard error, some parts of which have few: those standard errors and theirs.

    What is not among the parts has any number (Welch and Satterthwaite: JCGM 100:2008, G.4.1, rounded down). Without
    parts `MANY_DEGREES`.
    """
    if not whole > 0:
        return MANY_DEGREES
    rest = sum((error / whole) ** 4 / degrees for error, degrees in parts if error > 0 and degrees > 0)
    return int(min(max(1.0 / rest, 1.0), MANY_DEGREES)) if rest else MANY_DEGREES


def ratio_values(numerator: np.ndarray, denominator: np.ndarray) -> np.ndarray:
    """(m,) values whose mean is ``sum(numerator) / sum(denominator)``, 0 of zeros, and whose scatter is that of it.

    To first order that of what the numerator is off its share of the denominator (Cochran, Sampling Techniques, 3rd
    edition, 1977, Eq. 6.13). Both are (m,), over passages in order of time.
    """
    if not denominator.sum():
        return np.zeros(len(numerator))
    ratio = numerator.sum() / denominator.sum()
    return ratio + (numerator - ratio * denominator) / denominator.mean()


def turn_edges(samples: int, turn: float) -> np.ndarray:
    """Edges of the whole turns in a record, both in samples; a turn that ends on the last one counts."""
    return np.rint(np.arange(int(samples / turn + 1e-9) + 1) * turn).astype(int)


def turn_error(a, turn: float, statistic: Callable[[np.ndarray], float]) -> float:
    """Standard error of a statistic of a signal over whole turns of so many samples; NaN for fewer than two."""
    values = [statistic(a[first:last]) for first, last in pairwise(turn_edges(len(a), turn))]
    return float(np.std(values, ddof=1) / np.sqrt(len(values))) if len(values) > 1 else NAN


class LineError(NamedTuple):
    """Standard errors of the highest bin's frequency and amplitude, and of those of the bin-free line."""

    bin_hz: float
    bin_amplitude: float
    hz: float
    amplitude: float
    beyond_hz: float  # frequency of the line by the phases of the revolutions, above the one that was stated, Hz


def line_error(a, rate_hz: float, bin_hz: float, loop_hz: float) -> LineError:
    """Standard errors of the dominant peak of a record, from the line in each whole revolution of the loop.

    The complex amplitude of the line is taken revolution by revolution (complex demodulation: Bloomfield, Fourier
    Analysis of Time Series, 2nd edition, 2000, ch. 7). The scatter of its length gives the error of the amplitude, the
    scatter of its phase about a straight line that of the frequency. The amplitude of a bin is the mean of the same
    numbers, each turned by as much as the bin is off the line. The frequency of a bin is known to its width: as of an
    even distribution, its standard uncertainty is the width over the root of 12 (JCGM 100:2008, 4.3.7).

    ``a`` is a signal of ``rate_hz`` samples per second, ``bin_hz`` the highest bin (`spectra.main_line`), ``loop_hz``
    the line itself (`spectra.main_line_binfree`). Errors are in Hz and the unit of the signal. Of fewer than two whole
    revolutions amplitudes have no error, of fewer than three the frequency has none: NaN.
    """
    a = np.asarray(a, dtype=float) - np.mean(a)
    width = rate_hz / a.size
    edges = turn_edges(a.size, rate_hz / loop_hz)
    count = len(edges) - 1
    resolution = float(width / np.sqrt(12.0))
    if count < 2:
        return LineError(resolution, NAN, NAN, NAN, NAN)
    times = 0.5 * (edges[:-1] + edges[1:] - 1) / rate_hz
    first = _demodulated(a, rate_hz, edges, loop_hz)
    mean = first.mean()
    turned = first * np.conj(mean) / abs(mean)
    amplitude = float(turned.real.std(ddof=1) / np.sqrt(count))
    hz, phase, since = NAN, turned.imag / abs(mean), times - times.mean()
    slope = float(since @ phase / (since @ since))
    if count > 2:
        rest = phase - phase.mean() - since * slope
        hz = float(np.sqrt(rest @ rest / (count - 2) / (since @ since)) / (2 * np.pi))
    # the harmonic of the loop that the bin belongs to
    harmonic = max(1, round(bin_hz / loop_hz))
    lines = first if harmonic == 1 else _demodulated(a, rate_hz, edges, harmonic * loop_hz)
    phase_factor = np.exp(-2j * np.pi * (bin_hz - harmonic * loop_hz) * times)
    complete = (lines * phase_factor).mean()
    scatter = ((lines - lines.mean()) * phase_factor * np.conj(complete) / abs(complete)).real
    bin_amplitude = float(np.sqrt(scatter @ scatter / (count - 1) / count))
    return LineError(resolution, bin_amplitude, hz, amplitude, slope / (2 * np.pi))


def _demodulated(a: np.ndarray, rate_hz: float, edges: np.ndarray, hz: float) -> np.ndarray:
    """(n,) complex amplitude of a frequency in each of n parts of a signal, its phase from the signal's start."""
    products = a * np.exp(-2j * np.pi * hz / rate_hz * np.arange(a.size))
    return 2.0 * np.add.reduceat(products[: edges[-1]], edges[:-1]) / np.diff(edges)


# Passages that a record needs at least: fewer batches than three say little about their own scatter.
LEAST = 9
DRIFT = 0.25  # share of a tolerance that turns before a record, and its halves, may differ by
SURE = 2.0  # standard errors: the 95 % of a normal distribution


class Estimate(NamedTuple):
    """A value with its standard error and the half width of its 95 % interval; NaN where one passage gives none."""

    value: float
    error: float
    half_width: float


class Series(NamedTuple):
    """A measure passage by passage."""

    values: np.ndarray  # (m,) what is averaged: a mean square for RMS and SD, the measure itself for the others
    passage: np.ndarray  # (m,) integers: passage of the record that each belongs to
    root: bool = False  # the measure is the root of the mean
    scale: float | None = None  # what its tolerances refer to; None: its value

    def since(self, first: int) -> "Series":
        """Without the passages before ``first``."""
        return self._replace(values=self.values[self.passage >= first], passage=self.passage[self.passage >= first])

    def until(self, last: int) -> "Series":
        """Without the passages from ``last`` on."""
        return self._replace(values=self.values[self.passage < last], passage=self.passage[self.passage < last])

    def linear(self) -> np.ndarray:
        """(m,) values whose mean is the measure, and whose scatter is its own to first order."""
        if not self.root or not len(self.values):
            return self.values
        mean = float(self.values.mean())
        value = float(np.sqrt(max(mean, 0.0)))
        return value + (self.values - mean) * (0.5 / value if value else 1.0)

    def estimate(self) -> Estimate:
        """Mean, and its standard error by batch means."""
        values = self.linear()
        return Estimate(float(values.mean()), *batch_error(values)) if len(values) else Estimate(NAN, NAN, NAN)

    def transient(self) -> int:
        """Passages to leave out at the beginning, by the marginal standard error rule.

        MSER (White, Simulation 69, 1997, 323-334): the beginning is cut where the standard error of what is left would
        be least. More than half of the values is never cut.
        """
        values, count = self.values, len(self.values)
        if count < 2:
            return 0
        left = np.arange(count, 0, -1)
        total = np.cumsum(values[::-1])[::-1]
        square = np.cumsum((values[::-1]) ** 2)[::-1]
        marginal = (square - total**2 / left) / left**2
        return int(self.passage[np.argmin(marginal[: count // 2 + 1])])


def paired(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The last values of two series, as many as both have: runs that end alike have passages at equal times."""
    count = min(len(first), len(second))
    return first[len(first) - count :], second[len(second) - count :]


class WholeError(NamedTuple):
    """Errors of a measure of a record, as tolerances are given."""

    bias: float  # difference from the limit at a step of zero
    doubt: float  # two standard errors of it
    half_width: float  # half of the 95 % interval of the record
    scatter: float  # two standard errors: the half width, had it many batches

    @property
    def total(self) -> float:
        """Difference from the limit and both scatters."""
        return self.bias + hypot(self.doubt, self.half_width)

    def room(self, tolerance: float) -> float:
        """Share of a tolerance that is left for the interval of the record; 0 if nothing is."""
        rest = tolerance - self.bias
        return sqrt(rest**2 - self.doubt**2) if rest > self.doubt else 0.0


def whole_error(run: Series, alike: Series, limit: np.ndarray, scale: float) -> WholeError:
    """Whole error of a measure of a run, whose ``limit`` passage by passage (`extrapolated`) a finer run gives.

    ``alike`` is the run as far as the limit goes, ``scale`` as from `catalogue.scale_of`.
    """
    bias, doubt = difference(alike, limit)
    _, error, half_width = run.estimate()
    return WholeError(*(value / scale for value in (abs(bias), SURE * doubt, half_width, SURE * error)))


def difference(run: Series, limit: np.ndarray) -> tuple[float, float]:
    """A measure of a run less its limit over the passages that both have, and the standard error of it."""
    pairs = np.subtract(*paired(run.linear(), limit))
    return float(pairs.mean()), batch_error(pairs)[0]


def judge_series(
    measures: Mapping[str, Series], tolerances: Mapping[str, float], least: int = LEAST
) -> tuple[int, dict[str, Estimate], dict[str, bool]]:
    """The beginning to leave out, in passages, the measures of the rest, and whether they keep their tolerances.

    Passages that are alike within the tolerances need no cut: all of them count. Else the longest transient of the
    measures with a tolerance is left out. A tolerance is kept if half of the 95 % interval, by batch means, is within
    it and at least so many passages count.
    """
    cut = max((measures[name].transient() for name in tolerances if name in measures), default=0)
    for first in dict.fromkeys((0, cut)):
        rest = {name: measure.since(first) for name, measure in measures.items()}
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
    """Whether the halves of a record differ: a start that has not died away, which batches of neighbours do not see.

    By more than their scatter, and by more than `DRIFT` of a tolerance.
    """
    for name, tolerance in tolerances.items():
        if name in measures and len(measures[name].values) >= 2 * LEAST:
            halves = np.array_split(measures[name].linear(), 2)
            first, second = (float(half.mean()) for half in halves)
            scatter = hypot(*(batch_error(half)[0] for half in halves))
            scale = measures[name].scale or abs(first + second) / 2
            if abs(second - first) > max(SURE * scatter, DRIFT * tolerance * scale):
                return True
    return False


class Limit(NamedTuple):
    """A measure at a step of zero, extrapolated."""

    value: float  # the limit
    error: float  # its standard error, all in all
    doubt: float  # the share of the error that is convergence, not scatter
    values: np.ndarray  # (m,) what the limit is the mean of, passage by passage


def weight_of_finer(fine: float, coarse: float) -> float:
    """Share of the difference of two steps (s) by which the finer one misses the limit, by a method of order 1."""
    return fine / (coarse - fine)


def extrapolated(fine: Series, coarse: Series, weight: float) -> np.ndarray:
    """(m,) a measure passage by passage beyond the finer of two runs, by a ``weight`` of their difference."""
    near, far = paired(fine.linear(), coarse.linear())
    return near + weight * (near - far)


def limit_of(runs: Mapping[float, Series]) -> Limit:
    """The limit of a measure, by step, s, whose error is in proportion to the step.

    From the two finest steps (Richardson extrapolation: Roache, Journal of Fluids Engineering 116, 1994, 405-413). Its
    error joins the scatter of passages of this combination of both runs, and how far the next coarser pair of steps
    would extrapolate to, without which convergence is taken on trust; of two steps alone, the whole extrapolation.
    """
    steps = sorted(runs)

    def limit(fine: float, coarse: float) -> np.ndarray:
        return extrapolated(runs[fine], runs[coarse], weight_of_finer(fine, coarse))

    values = limit(*steps[:2])
    coarser = limit(*steps[1:3]) if len(steps) > 2 else runs[steps[0]].linear()
    value, doubt = float(values.mean()), float(abs(values.mean() - coarser.mean()))
    return Limit(value, float(np.hypot(batch_error(values)[0], doubt)), doubt, values)


def error_against(series: Series, limit: Limit) -> tuple[float, float]:
    """A measure less its limit, and the standard error of this difference."""
    error = np.hypot(difference(series, limit.values)[1], limit.doubt)
    return float(series.estimate().value - limit.value), float(error)


# The largest difference from the limit at a step of zero that the included rigs have at their default steps, with rings
# and without one, by columns of a run, in parts of `catalogue.Measure.size`. The study `default_step` writes this file.
STEP_ERRORS = {
    columns: (float(with_ring), float(without_ring))
    for columns, with_ring, without_ring in csv.reader(
        Path(__file__).with_name("step_errors.csv").read_text(encoding="utf-8").splitlines()[1:]
    )
}

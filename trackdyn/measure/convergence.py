"""When is a measure known? Its series over passages, its difference between two runs, and the tolerance that both keep.

A measure of a record in steady running is a mean over passages of a pitch (`Series`). Batches of passages give the
scatter of the mean, the marginal standard error rule its transient, and pairs of passages at equal times the difference
of two runs that start alike, which scatters less than either (common random numbers: Law, Simulation Modeling and
Analysis, 5th edition, 2015, ch. 11.2).
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from trackdyn.measure.uncertainty import batch_error

# measures whose tolerances are a share of the value, and a share of a sprocket turn
RELATIVE = ("rms", "sd", "line", "high_frequency", "left_peak", "right_peak")
SHARES = ("left_share", "right_share", "ring_share")
NAN = float("nan")
# Passages that a record needs at least: fewer batches than three say little about their own scatter.
LEAST = 9
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

    def since(self, first: int) -> "Series":
        """Without the passages before ``first``."""
        return self._replace(values=self.values[self.passage >= first], passage=self.passage[self.passage >= first])

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


def scale_of(measure: str, value: float) -> float:
    """What a tolerance is relative to: a turn of the sprocket (shares are in %), or the size of a value; NaN for 0."""
    return 100.0 if measure in SHARES else abs(value) or NAN


def paired(one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The last values of two series, as many as both have: runs that end alike have passages at equal times."""
    count = min(len(one), len(other))
    return one[len(one) - count :], other[len(other) - count :]


def difference(one: Series, other: Series) -> tuple[float, float]:
    """A measure of one run less that of another over the passages that both have, and its standard error."""
    pairs = np.subtract(*paired(one.linear(), other.linear()))
    return float(pairs.mean()), batch_error(pairs)[0]


def settled(
    found: Mapping[str, Series], tolerances: Mapping[str, float], least: int = LEAST
) -> tuple[int, dict[str, Estimate], dict[str, bool]]:
    """The beginning to leave out, in passages, the measures of the rest, and whether they keep their tolerances.

    Passages that are alike within the tolerances need no cut: all of them count. Else the longest transient of the
    measures with a tolerance is left out. A tolerance is kept if half of the 95 % interval, by batch means, is within
    it and at least so many passages count.
    """
    cut = max((found[name].transient() for name in tolerances if name in found), default=0)
    for first in dict.fromkeys((0, cut)):
        rest = {name: measure.since(first) for name, measure in found.items()}
        means = {name: measure.estimate() for name, measure in rest.items()}
        kept = {
            name: name in rest
            and len(rest[name].values) >= least
            and bool(means[name].half_width <= tolerance * scale_of(name, means[name].value))
            for name, tolerance in tolerances.items()
        }
        if all(kept.values()):
            break
    return first, means, kept

"""Features of a record of ay that need no alignment in time: lines, orders, bands and crests, each as a logarithm.

A record is cut into whole turns of the loop. In the spectrum of one turn the bins are orders of the loop, so that its
lines and the passing of pitches stand in known bins, whatever the speed. Powers are averaged over turns before the
logarithm is taken: a difference of features is a relative difference of amplitudes.
"""

from collections.abc import Sequence
from itertools import chain, pairwise
from typing import NamedTuple

import numpy as np
import scipy.fft
from sklearn.covariance import LedoitWolf

from trackdyn.errors import InputError

LINES = 5  # harmonics of the dominant peak
PASSING = 3  # multiples of the order at which pitches pass
BESIDE = 2  # loop orders to either side that belong to such an order: what turns with the loop modulates it
BANDS_HZ = (1.0, 3.0, 6.0, 12.0, 25.0, 50.0, 100.0, 200.0)
HIGH_HZ = 25.0  # lower edge from which on a band is of high frequency: glue, links that bend, short contacts
FLOOR_G = 0.01  # amplitudes below it are not told from nothing: a logarithm has no other bottom
TAIL = 0.005  # share of the samples beyond either tail
LEAST_TURNS = 4  # turns of a record: the variance of Student's distribution with one less exists from there on
RESAMPLED = 2000  # bootstrap samples: the error of a standard deviation from them is 1.6 %


class Feature(NamedTuple):
    """A number of a record: ``group`` says which discrepancy it shares."""

    name: str
    group: str


def features_of(rate: float) -> list[Feature]:
    """The features of a record sampled at ``rate``, Hz: bands end at 0.4 of it."""
    bands = [(low, high) for low, high in pairwise(BANDS_HZ) if high <= 0.4 * rate]
    features = [Feature(f"line_{k}", "lines") for k in range(1, LINES + 1)]
    features += [Feature("sd", "lines")]
    features += [Feature(f"passing_{k}", "passing") for k in range(1, PASSING + 1)]
    features += [Feature(f"band_{low:g}_{high:g}_hz", "high" if low >= HIGH_HZ else "low") for low, high in bands]
    return features + [Feature(name, "crest") for name in ("tail_low", "tail_high", "peak")]


def features_in_a_row(rates: Sequence[float]) -> tuple[tuple[Feature, ...], np.ndarray]:
    """The features of records sampled at ``rates``, Hz, one record after the other, and the (p,) record of each."""
    listed = [features_of(rate) for rate in rates]
    return tuple(chain.from_iterable(listed)), np.repeat(np.arange(len(listed)), list(map(len, listed)))


def turns_of(ay, rate: float, turn_s: float) -> np.ndarray:
    """(turns, samples) A record ``ay`` of this ``rate`` (Hz), cut into whole turns of the loop of ``turn_s``, s."""
    samples = turn_s * rate
    count = int(len(ay) / samples + 1e-9)
    starts = np.rint(np.arange(count) * samples).astype(int)
    length = int(samples + 1e-9)  # a last sample is left out where turns are no whole number of them
    return np.stack([ay[start : start + length] for start in starts])


def turn_statistics(ay, rate: float, turn_s: float, pitches: int) -> np.ndarray:
    """(turns, features) What is averaged over turns: powers of lines, orders and bands (g2), widths of tails and peak
    (g).

    ``ay``, sampled at ``rate`` (Hz), is along the normal of the link, g; a turn takes ``turn_s`` (s) and as many
    ``pitches`` as the loop has.
    """
    blocks = turns_of(np.asarray(ay, dtype=float), rate, turn_s)
    blocks = blocks - blocks.mean(axis=1, keepdims=True)
    count = blocks.shape[1]
    power = 2.0 * np.abs(scipy.fft.rfft(blocks, axis=1) / count) ** 2  # (turns, orders) mean square of order k
    power[:, 0] = 0.0
    low, middle, high = np.quantile(blocks, [TAIL, 0.5, 1.0 - TAIL], axis=1)
    columns = []
    for name, _ in features_of(rate):
        kind, *where = name.split("_")
        if kind == "line":
            columns.append(2.0 * power[:, int(where[0])])  # an amplitude, as the paper gives it
        elif kind == "sd":
            columns.append(power.sum(axis=1))
        elif kind == "passing":
            order = int(where[0]) * pitches
            columns.append(power[:, order - BESIDE : order + BESIDE + 1].sum(axis=1))
        elif kind == "band":
            first, last = (round(float(edge) * turn_s) for edge in where[:2])
            columns.append(power[:, first:last].sum(axis=1))
        elif name == "peak":
            columns.append(np.abs(blocks).max(axis=1))
        else:
            columns.append(middle - low if name == "tail_low" else high - middle)
    return np.stack(columns, axis=1)


def features(statistics: np.ndarray, rate: float, weights: np.ndarray | None = None) -> np.ndarray:
    """(..., features) Logarithms of the mean statistics of turns (`turn_statistics`), amplitudes in g.

    ``weights`` (..., turns) take turns more than once; all once by default.
    """
    turns = len(statistics)
    mean = (np.full(turns, 1.0 / turns) if weights is None else weights / turns) @ statistics
    crest = np.array([group == "crest" for _, group in features_of(rate)])
    return 0.5 * np.log(np.where(crest, mean**2, mean) + FLOOR_G**2)


def covariance(statistics: np.ndarray, rate: float, seed: int = 0) -> np.ndarray:
    """(features, features) Covariance of `features` from the record itself: a bootstrap whose blocks are turns.

    ``statistics`` are those of `turn_statistics` at a ``rate`` (Hz); equal seeds give equal samples.

    There are more features than turns: correlations are shrunk towards none by the weight that Ledoit and Wolf (2004)
    give for this many turns, and all is widened to the variance of Student's distribution with one degree of freedom
    less than turns. Raises `InputError`: fewer than `LEAST_TURNS` turns.
    """
    turns = len(statistics)
    if turns < LEAST_TURNS:
        raise InputError(f"the record holds {turns} whole turns of the loop; at least {LEAST_TURNS} are needed")
    rng = np.random.default_rng(seed)
    resampled = features(statistics, rate, rng.multinomial(turns, np.full(turns, 1.0 / turns), size=RESAMPLED))
    sample_covariance = np.cov(resampled.T) * turns / (turns - 1)
    spread = np.std(statistics, axis=0)
    weight = LedoitWolf().fit((statistics - statistics.mean(axis=0)) / np.where(spread > 0, spread, 1.0)).shrinkage_
    shrunk = (1 - weight) * sample_covariance + weight * np.diag(np.diag(sample_covariance))
    return shrunk * (turns - 1) / (turns - 3)

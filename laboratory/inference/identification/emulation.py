"""All features of all records at a point of the unit cube, with the covariance of what the emulator does not know.

Features move together, and so do an emulator's errors in them: principal components are emulated (Higdon et al., J. Am.
Stat. Assoc. 103, 2008). How far they err is learnt by cross-validation: all is fitted again without a part of the
simulations, and compared with these. Leaving points out of a fit that had seen them promised half of the errors, and
none of the outliers.
"""

from typing import NamedTuple

import numpy as np
from scipy import stats
from scipy.linalg import solve_triangular
from scipy.optimize import minimize
from sklearn.covariance import LedoitWolf
from threadpoolctl import threadpool_limits

from laboratory.inference.emulator import Emulator, Terms
from trackdyn.errors import InputError

KEPT = 0.995  # part of the variance, in discrepancies squared, that the components keep
MOST = 14  # components
ITERATIONS = 40  # of the search for lengths and noise
SEARCHED = 160  # simulations that it looks at: each evaluation costs their number cubed
ROUNDING = 1e-8  # variance of every feature, over scale squared: two that are the same have a covariance, too
FOLDS = 8  # of the cross-validation
# standard deviation of what the logarithm of the errors' variance changes by from the middle to an end
PRIOR_SLOPE = 0.5
SLOPE_STEP = 0.02  # of the central difference, as a share of the range of an unknown
LEAST_DEGREES, MOST_DEGREES = 2.0, 200.0  # of freedom: hardly a variance, hardly a tail


class Prediction(NamedTuple):
    """Features at m points: ``mean`` (m, p) and ``covariance`` (m, p, p) of a simulation there."""

    mean: np.ndarray
    covariance: np.ndarray


class Components:
    """Principal components of p features and a process for each, from n simulations: what `FeatureEmulator` is made of.

    Attributes
    ----------
    axes : (k, p) array
        Of the components, orthonormal in features over ``scale``.
    """

    def __init__(self, x: np.ndarray, y: np.ndarray, scale: np.ndarray):
        self.middle, self.scale = y.mean(axis=0), scale
        scaled = (y - self.middle) / scale
        _, size, axes = np.linalg.svd(scaled, full_matrices=False)
        share = np.cumsum(size**2) / np.sum(size**2)
        self.axes = axes[: min(int(np.searchsorted(share, KEPT)) + 1, MOST, len(size))]
        self._processes = Processes(x, (scaled @ self.axes.T).T)

    def __call__(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Features (m, p) at (m, d) points, and standard deviations (m, k) of the components."""
        mean, variance = self._processes(points)
        return self.middle + self.scale * (mean.T @ self.axes), np.sqrt(variance).T


class FeatureEmulator:
    """Emulator of p features over d inputs from n simulations.

    Parameters
    ----------
    x : (n, d) array
        Points of the unit cube.
    features : (n, p) array
        What the simulations gave.
    scale : (p,) array
        What a difference of each feature is measured in when components are chosen (`posterior.medians`).

    Attributes
    ----------
    x : (n, d) array
        As given.
    degrees : float
        Of freedom of the Student distribution of the errors (`tails`), whose covariance matrix a prediction gives up
        to a factor: inverse gamma with half of these degrees as shape and rate, the same for all features at a point.
    """

    def __init__(self, x, features, scale):
        x, y = np.atleast_2d(np.asarray(x, dtype=float)), np.asarray(features, dtype=float)
        if not np.isfinite(y).all():
            raise InputError("emulator: a feature of a simulation is no number")
        scale = np.asarray(scale, dtype=float)
        self.x = x
        with threadpool_limits(1):  # matrices so small lose by being shared out
            self._learn(x, y, scale)

    def _learn(self, x: np.ndarray, y: np.ndarray, scale: np.ndarray) -> None:
        self._components = Components(x, y, scale)
        axes = self._components.axes
        # errors in features over scale, and standard deviations that were promised for the components
        errors, sd = np.empty_like(y), np.empty((len(x), len(axes)))
        fold = np.arange(len(x)) % FOLDS
        for one in range(FOLDS):
            out = fold == one
            part = Components(x[~out], y[~out], scale)
            mean, promised = part(x[out])
            errors[out] = (y[out] - mean) / scale
            sd[out] = np.sqrt(promised**2 @ (part.axes @ axes.T) ** 2)
        covariances = np.empty((*y.shape, y.shape[1]))
        for one in range(FOLDS):  # covariances of so many features fit the errors that they were learnt from too well
            out = fold == one
            covariances[out] = Spread(errors[~out], sd[~out], axes).covariance(sd[out])
        weighted = np.linalg.solve(covariances, errors[:, :, None])[:, :, 0]
        self._log_variance, self.degrees = tails((errors * weighted).sum(axis=1), y.shape[1], _quadratic(x))
        self._log_variance[0] += np.log(self._slope_factor(x, weighted, covariances, scale))
        self._spread = Spread(errors, sd, axes)

    def _slope_factor(self, x: np.ndarray, weighted: np.ndarray, covariances: np.ndarray, scale: np.ndarray) -> float:
        """Factor on the variance of errors that look like another value of an unknown, at least 1.

        A resonance in the wrong place errs along the slope of the features, the direction that shifts a posterior. The
        median is compared with that of Student's distribution, because few points at the edge of a design err far more.
        """
        local, squares = np.exp(_quadratic(x) @ self._log_variance), []
        for moved in SLOPE_STEP * np.eye(x.shape[1]):
            low, high = (self._components(np.clip(x + away, 0.0, 1.0))[0] for away in (-moved, moved))
            slope = (high - low) / scale  # up to a factor, which cancels
            known = (slope * np.linalg.solve(covariances, slope[:, :, None])[:, :, 0]).sum(axis=1)
            squares.append((slope * weighted).sum(axis=1) ** 2 / known / local)
        return max(float(np.median(squares) / stats.f.median(1, self.degrees)), 1.0)

    def __call__(self, points) -> Prediction:
        """Features at (m, d) points of the unit cube."""
        points = np.atleast_2d(points)
        mean, sd = self._components(points)
        variance = np.exp(_quadratic(points) @ self._log_variance)
        scale = self._components.scale
        return Prediction(mean, self._spread.covariance(sd) * variance[:, None, None] * np.outer(scale, scale))


class Spread:
    """Covariance of (n, p) errors in features where (n, k) standard deviations were promised for components with such
    axes.
    """

    def __init__(self, errors: np.ndarray, sd: np.ndarray, axes: np.ndarray):
        standard = errors @ axes.T / sd
        # errors that are larger than the processes say widen them, smaller ones do not narrow them
        self._widen = np.maximum(np.sqrt((standard**2).mean(axis=0)), 1.0)
        covariance = LedoitWolf().fit(standard).covariance_
        root = np.sqrt(np.diag(covariance))
        self._correlation, self._axes = covariance / np.outer(root, root), axes
        rest = errors - errors @ axes.T @ axes
        size = np.sqrt(
            (rest**2).mean(axis=0) + ROUNDING
        )  # scaled, because shrinking to one variance widens features with small errors
        self._rest = LedoitWolf().fit(rest / size).covariance_ * np.outer(size, size)

    def covariance(self, sd: np.ndarray) -> np.ndarray:
        """(m, p, p) of the errors where the components have (m, k) standard deviations."""
        weighted = (sd * self._widen)[:, :, None] * self._axes
        emulated = weighted.transpose(0, 2, 1) @ self._correlation @ weighted
        return emulated + self._rest + ROUNDING * np.eye(self._axes.shape[1])


def _quadratic(x: np.ndarray) -> np.ndarray:
    """(n, 1 + 2 d) What the logarithm of a variance over the unit cube is made of: steeper towards an end, or both."""
    centred = 2.0 * x - 1.0
    return np.column_stack([np.ones(len(x)), centred, centred**2 - 1.0 / 3.0])


def tails(distance: np.ndarray, count: int, terms: np.ndarray) -> tuple[np.ndarray, float]:
    """How the variance of errors changes with the place, and the degrees of freedom of their Student distribution.

    Emulators err far more in some places than in others (the stiffest bushings, the slackest strands), and resonances
    that the simulations step over make them err far more at single points, then in all features. Squared distances of
    ``count`` features' errors, (n,), are distributed as F over the local variance; what is given maximises the
    likelihood, with a normal prior on all coefficients but the first.

    Returns
    -------
    coefficients : (k,) array
        Of ``terms`` (n, k), for the logarithm of the variance.
    degrees : float
    """

    def unlikely(at):
        local = terms @ at[:-1]
        likelihood = stats.f.logpdf(distance / count * np.exp(-local), count, np.exp(at[-1])) - local
        return 0.5 * np.sum((at[1:-1] / PRIOR_SLOPE) ** 2) - np.sum(likelihood)

    start = np.append(np.zeros(terms.shape[1]), np.log(10.0))
    bounds = [(-3.0, 3.0)] * terms.shape[1] + [tuple(np.log([LEAST_DEGREES, MOST_DEGREES]))]
    found = minimize(unlikely, start, method="L-BFGS-B", bounds=bounds).x
    return found[:-1], float(np.exp(found[-1]))


class Part:
    """Some features of an emulator, in an order of one's own."""

    def __init__(self, emulator: FeatureEmulator, which):
        self._emulator, self._which = emulator, np.asarray(which)
        self.degrees = emulator.degrees

    def __call__(self, points) -> Prediction:
        """As that of the emulator."""
        mean, covariance = self._emulator(points)
        return Prediction(mean[:, self._which], covariance[:, self._which[:, None], self._which])


class Processes:
    """Processes of k outputs over the same inputs: lengths and noise from some simulations, then all of them.

    Predictions are those of `Emulator.predict` for each; one by one they take several times as long.
    """

    def __init__(self, x: np.ndarray, outputs: np.ndarray):
        found = [Emulator(x[:SEARCHED], y[:SEARCHED], ITERATIONS).terms() for y in outputs]
        self._terms = Terms(*map(np.stack, zip(*found, strict=True)))
        t = self._terms
        inputs = (x - t.input_mean[0]) / t.input_scale[0]
        self._trained = inputs / t.lengths[:, None, :]
        rest = (outputs - t.slope @ inputs.T - t.offset[:, None]) / t.size[:, None]
        lower = np.linalg.cholesky(self._kernel(self._trained) + t.noise[:, None, None] * np.eye(len(x)))
        self._root = np.stack([solve_triangular(one, np.eye(len(x)), lower=True) for one in lower])
        self._weights = np.einsum("knm,kn->km", self._root, np.einsum("knm,km->kn", self._root, rest))

    def _kernel(self, scaled: np.ndarray) -> np.ndarray:
        """(k, m, n) covariance of the processes at (k, m, d) inputs over lengths with those at the simulations."""
        squared = (scaled**2).sum(-1)[:, :, None] + (self._trained**2).sum(-1)[:, None, :]
        squared -= 2.0 * scaled @ self._trained.transpose(0, 2, 1)
        far = np.sqrt(5.0 * np.maximum(squared, 0.0))
        return self._terms.amplitude[:, None, None] * (1.0 + far + far**2 / 3.0) * np.exp(-far)

    def __call__(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and variance (k, m) of outputs at (m, d) points, noise included."""
        t = self._terms
        inputs = (points - t.input_mean[0]) / t.input_scale[0]
        kernel = self._kernel(inputs / t.lengths[:, None, :])
        mean = np.einsum("kmn,kn->km", kernel, self._weights)
        known = self._root @ kernel.transpose(0, 2, 1)
        variance = (t.amplitude + t.noise)[:, None] - np.einsum("knm,knm->km", known, known)
        trend = t.slope @ inputs.T + t.offset[:, None]
        return trend + t.size[:, None] * mean, t.size[:, None] ** 2 * np.maximum(variance, 1e-12)

"""All features of all records at a point of the unit cube, with the covariance of what the emulator does not know.

Features move together, and so do an emulator's errors in them: principal components are emulated (Higdon et al., J. Am.
Stat. Assoc. 103, 2008), each by a linear trend and a Gaussian process of what it leaves (scikit-learn). How far they
err is learnt by cross-validation: all is fitted again without some simulations, and compared with these.

The covariance of the errors is the same at every point. One that follows the variance of the processes, or the size of
the errors from point to point, draws a posterior of some 40 features to the points where it is small: intervals of 90 %
then held 82 % of the truths, and damping was overestimated.
"""

import warnings
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import stats
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize
from sklearn.covariance import LedoitWolf
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
from sklearn.linear_model import RidgeCV
from sklearn.preprocessing import StandardScaler
from threadpoolctl import threadpool_limits

from trackdyn.errors import InputError

EXPLAINED = 0.995  # fraction of the variance, in discrepancies squared, that the components explain
MOST = 14  # components
ITERATIONS = 40  # steps of the search for lengths and noise
SEARCHED = 160  # simulations that it looks at: each evaluation costs their number cubed
LENGTHS = (0.2, 100.0)  # bounds of the lengths, for inputs that have a variance of 1
# for a component that has a variance of 1 and jumps (an arc that lets go, an area that changes)
NOISE = (1e-6, 1.0)
ROUNDING = 1e-8  # variance of every feature, over scale squared: two that are the same have a covariance, too
FOLDS = 8  # parts of the cross-validation
SLOPE_STEP = 0.02  # step of the central difference, as a share of the range of an unknown
LEAST_DEGREES, MOST_DEGREES = 2.0, 200.0  # freedom of Student's distribution: hardly a variance, hardly a tail
LEAST_JUDGED = 32  # simulations whose errors make a covariance; of fewer, all simulations' errors do


class Emulator(NamedTuple):
    """Emulator of p features over the d-dimensional unit cube."""

    mean: Callable[[np.ndarray], np.ndarray]  # features (m, p) at (m, d) points
    # (p, p), of the errors up to a factor, which is inverse gamma with half of ``degrees`` as shape and rate, and the
    # same for all features at a point: the errors have a Student distribution (`tails`)
    covariance: np.ndarray
    degrees: float  # of freedom

    def subset(self, which: np.ndarray) -> "Emulator":
        """Emulator of some of the features, ``which`` (p,) of them."""
        return Emulator(lambda points: self.mean(points)[:, which], self.covariance[np.ix_(which, which)], self.degrees)


@threadpool_limits.wrap(limits=1)  # matrices so small lose by being shared out
def fitted_emulator(x, features, scale: np.ndarray, judged: int = 0) -> Emulator:
    """Fit an emulator of p features over d inputs to n simulations.

    Parameters
    ----------
    x : (n, d) array
        Points of the unit cube.
    features : (n, p) array
        What the simulations gave.
    scale : (p,) array
        What a difference of each feature is measured in when components are chosen (`posterior.medians`).
    judged : int
        So many simulations, the last ones, are where the posterior is: their errors make the covariance, if there are
        `LEAST_JUDGED`. 0: all.

    Raises
    ------
    InputError
        A feature of a simulation is no number.
    """
    if not np.isfinite(features).all():
        raise InputError("emulator: a feature of a simulation is no number")
    judged = judged if judged >= LEAST_JUDGED else len(x)
    components = Components(x, features, scale)
    fold, errors = np.arange(len(x)) % FOLDS, np.empty_like(features)
    for left_out in range(FOLDS):
        out = fold == left_out
        errors[out] = (features[out] - Components(x[~out], features[~out], scale)(x[out])) / scale
    errors, fold, axes = errors[-judged:], fold[-judged:], components.axes
    weighted, slopes = np.empty_like(errors), _slopes(components, x[-judged:]) / scale
    known = np.empty(slopes.shape[:2])
    for left_out in range(FOLDS):  # a covariance fits the errors that it was learnt from too well
        out = fold == left_out
        inverse = np.linalg.inv(error_covariance(errors[~out], axes))
        weighted[out] = errors[out] @ inverse
        known[:, out] = np.einsum("dnp,pq,dnq->dn", slopes[:, out], inverse, slopes[:, out])
    variance, degrees = tails((errors * weighted).sum(axis=1), features.shape[1])
    # A resonance at the wrong frequency errs along the slope of the features, which shifts a posterior.
    # The median is compared with that of Student's distribution: few points at the edge of a design err far more.
    along = (slopes * weighted).sum(axis=2) ** 2 / known / variance
    widened = max(float(np.median(along) / stats.f.median(1, degrees)), 1.0)
    covariance = error_covariance(errors, axes) * variance * widened * np.outer(scale, scale)
    return Emulator(components, covariance, degrees)


def _slopes(components: "Components", points: np.ndarray) -> np.ndarray:
    """(d, m, p) differences of the features along each input at (m, d) points, up to a factor."""
    moved = SLOPE_STEP * np.eye(points.shape[1])
    low, high = ([components(np.clip(points + sign * change, 0.0, 1.0)) for change in moved] for sign in (-1, 1))
    return np.array(high) - np.array(low)


def error_covariance(errors: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """(p, p) covariance of (n, p) errors: of their (k, p) components, and of what these leave."""
    along = errors @ axes.T
    return axes.T @ _shrunk(along) @ axes + _shrunk(errors - along @ axes)


def _shrunk(errors: np.ndarray) -> np.ndarray:
    """Covariance after Ledoit and Wolf; scaled first, because shrinking to one variance widens small errors."""
    size = np.sqrt((errors**2).mean(axis=0) + ROUNDING)
    return LedoitWolf(assume_centered=True).fit(errors / size).covariance_ * np.outer(size, size)


def tails(distance: np.ndarray, count: int) -> tuple[float, float]:
    """Factor on the covariance, and degrees of freedom of the Student distribution, of errors in ``count`` features.

    Resonances that the simulations step over make emulators err far more at single points, then in all features.
    Squared distances, (n,), over ``count`` are distributed as F; what is given maximises the likelihood.
    """

    def unlikely(at):
        return -np.sum(stats.f.logpdf(distance / count * np.exp(-at[0]), count, np.exp(at[1])) - at[0])

    bounds = [(-3.0, 3.0), (np.log(LEAST_DEGREES), np.log(MOST_DEGREES))]
    variance, degrees = np.exp(minimize(unlikely, [0.0, np.log(10.0)], method="L-BFGS-B", bounds=bounds).x)
    return float(variance), float(degrees)


class Components:
    """Principal components of p features (n, p) from n simulations at points (n, d), and a process for each.

    Lengths and noise of each process are fitted to some simulations, then all are used. Predicted one after the other,
    by scikit-learn, they take several times as long. Called with (m, d) points it gives the features (m, p).

    Attributes
    ----------
    axes : (k, p) array
        Of the components, orthonormal in features over ``scale``.
    """

    def __init__(self, x: np.ndarray, features: np.ndarray, scale: np.ndarray):
        self._middle, self._scale = features.mean(axis=0), scale
        scaled = (features - self._middle) / scale
        _, size, axes = np.linalg.svd(scaled, full_matrices=False)
        share = np.cumsum(size**2) / np.sum(size**2)
        self.axes = axes[: min(int(np.searchsorted(share, EXPLAINED)) + 1, MOST, len(size))]
        outputs = self.axes @ scaled.T

        self._scaler = StandardScaler().fit(x)
        inputs = self._scaler.transform(x)
        trends = [RidgeCV(alphas=np.logspace(-3, 3, 13)).fit(inputs, output) for output in outputs]
        self._slope = np.array([trend.coef_ for trend in trends])
        self._offset = np.array([trend.intercept_ for trend in trends])
        rest = outputs - self._trend(inputs)
        self._size = np.maximum(rest.std(axis=1, keepdims=True), 1e-12 * (1.0 + np.abs(outputs).max()))
        self._lengths, self._weights = np.empty(self._slope.shape), np.empty(outputs.shape)
        for k, errors in enumerate(rest / self._size):
            kernel = _searched(inputs[:SEARCHED], errors[:SEARCHED])
            smooth, noise = kernel.k1, kernel.k2.noise_level
            self._lengths[k] = smooth.k2.length_scale
            solved = cho_solve(cho_factor(smooth(inputs) + noise * np.eye(len(x)), lower=True), errors)
            self._weights[k] = smooth.k1.constant_value * solved
        self._trained = inputs / self._lengths[:, None, :]

    def _trend(self, inputs: np.ndarray) -> np.ndarray:
        return self._slope @ inputs.T + self._offset[:, None]

    def __call__(self, points: np.ndarray) -> np.ndarray:
        inputs = self._scaler.transform(points)
        scaled = inputs / self._lengths[:, None, :]
        squared = (scaled**2).sum(-1)[:, :, None] + (self._trained**2).sum(-1)[:, None, :]
        squared -= 2.0 * scaled @ self._trained.transpose(0, 2, 1)
        far = np.sqrt(5.0 * np.maximum(squared, 0.0))
        kernel = (1.0 + far + far**2 / 3.0) * np.exp(-far)  # Matern, nu = 5/2
        outputs = self._trend(inputs) + self._size * (kernel @ self._weights[:, :, None])[:, :, 0]
        return self._middle + self._scale * (outputs.T @ self.axes)


def _searched(inputs: np.ndarray, output: np.ndarray):
    """Kernel of the greatest likelihood."""

    def search(objective, start, bounds):
        options = {"maxiter": ITERATIONS}
        optimum = minimize(objective, start, jac=True, bounds=bounds, method="L-BFGS-B", options=options)
        return optimum.x, optimum.fun

    lengths = np.full(inputs.shape[1], 2.0 * np.sqrt(inputs.shape[1]))
    kernel = ConstantKernel(1.0, (1e-3, 1e3)) * Matern(lengths, LENGTHS, nu=2.5) + WhiteKernel(0.1, NOISE)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its bound: an input without effect
        return GaussianProcessRegressor(kernel, optimizer=search).fit(inputs, output).kernel_

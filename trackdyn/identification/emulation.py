"""All features of all records at a point of the unit cube, with the covariance of what the emulator does not know.

Features move together, and so do an emulator's errors in them: principal components are emulated (Higdon et al., J. Am.
Stat. Assoc. 103, 2008), and what leaving out each simulation in turn shows of their errors goes into the covariance.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from sklearn.covariance import LedoitWolf

from trackdyn.errors import InputError
from trackdyn.inference.emulator import Emulator

KEPT = 0.995  # part of the variance, in discrepancies squared, that the components keep
MOST = 14  # components
ITERATIONS = 40  # of the search for lengths and noise
SEARCHED = 160  # simulations that it looks at: each evaluation costs their number cubed


class Prediction(NamedTuple):
    """Features at m points: ``mean`` (m, p) and ``covariance`` (m, p, p) of a simulation there."""

    mean: np.ndarray
    covariance: np.ndarray


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
    left_out : (n, p) array
        Predictions of each simulation by the others.
    standard_errors : (n, k) array
        Errors of the components when a simulation is left out, over their standard deviations, before these are widened.
    """

    def __init__(self, x, features, scale):
        self.x, y = np.atleast_2d(np.asarray(x, dtype=float)), np.asarray(features, dtype=float)
        if not np.isfinite(y).all():
            raise InputError("emulator: a feature of a simulation is no number")
        self.middle, self.scale = y.mean(axis=0), np.asarray(scale, dtype=float)
        scaled = (y - self.middle) / self.scale
        _, size, axes = np.linalg.svd(scaled, full_matrices=False)
        share = np.cumsum(size**2) / np.sum(size**2)
        count = min(int(np.searchsorted(share, KEPT)) + 1, MOST, len(size))
        self.axes = axes[:count]
        components = scaled @ self.axes.T
        self._processes = [_Process(self.x, one) for one in components.T]
        errors = np.stack([process.left_out_error for process in self._processes], axis=1)
        sd = np.stack([process.left_out_sd for process in self._processes], axis=1)
        self.standard_errors = errors / sd
        # errors that are larger than the processes say widen them, smaller ones do not narrow them
        self._widen = np.maximum(np.sqrt((self.standard_errors**2).mean(axis=0)), 1.0)
        covariance = LedoitWolf().fit(self.standard_errors).covariance_
        root = np.sqrt(np.diag(covariance))
        self._correlation = covariance / np.outer(root, root)
        rest = scaled - components @ self.axes
        self._rest = LedoitWolf().fit(rest).covariance_ * np.outer(self.scale, self.scale)
        self.left_out = self.middle + self.scale * ((components - errors) @ self.axes)
        self._stacked = _Stacked(self._processes)

    def __call__(self, points) -> Prediction:
        """Features at (m, d) points of the unit cube."""
        mean, variance = self._stacked(np.atleast_2d(points))
        loads = self.axes * self.scale
        sd = np.sqrt(variance).T * self._widen
        weighted = sd[:, :, None] * loads
        covariance = weighted.transpose(0, 2, 1) @ self._correlation @ weighted + self._rest
        return Prediction(self.middle + mean.T @ loads, covariance)


class Part:
    """Some features of an emulator, in an order of one's own."""

    def __init__(self, emulator: FeatureEmulator, which):
        self._emulator, self._which = emulator, np.asarray(which)

    def __call__(self, points) -> Prediction:
        """As that of the emulator."""
        mean, covariance = self._emulator(points)
        return Prediction(mean[:, self._which], covariance[:, self._which[:, None], self._which])


class _Process:
    """A component: lengths and noise from some simulations, then all of them."""

    def __init__(self, x: np.ndarray, y: np.ndarray):
        found = Emulator(x[:SEARCHED], y[:SEARCHED], ITERATIONS)
        process = found._process
        self.input_mean, self.input_scale = found._inputs.mean_, found._inputs.scale_
        inputs = (x - self.input_mean) / self.input_scale
        self.slope, self.offset = found._trend.coef_, float(found._trend.intercept_)
        self.size = found._scale
        self.amplitude = float(process.kernel_.k1.k1.constant_value)
        self.lengths = np.broadcast_to(process.kernel_.k1.k2.length_scale, (x.shape[1],))
        self.noise = float(process.kernel_.k2.noise_level) + process.alpha
        self.inputs = inputs
        rest = (y - inputs @ self.slope - self.offset) / self.size
        kernel = process.kernel_(inputs) + process.alpha * np.eye(len(x))
        lower = np.linalg.cholesky(kernel)
        self.root = solve_triangular(lower, np.eye(len(x)), lower=True)
        self.weights = self.root.T @ (self.root @ rest)
        precision = np.einsum("ki,ki->i", self.root, self.root)
        self.left_out_error = self.size * self.weights / precision
        self.left_out_sd = self.size / np.sqrt(precision)


class _Stacked:
    """Predictions of k processes at once: what scikit-learn gives for each, without a call for each."""

    def __init__(self, processes: list[_Process]):
        first = processes[0]
        self.input_mean, self.input_scale = first.input_mean, first.input_scale

        def gathered(name):
            return np.stack([getattr(process, name) for process in processes])

        self.slope, self.offset, self.size = gathered("slope"), gathered("offset"), gathered("size")
        self.amplitude, self.noise, self.lengths = gathered("amplitude"), gathered("noise"), gathered("lengths")
        self.trained = first.inputs / self.lengths[:, None, :]
        self.root, self.weights = gathered("root"), gathered("weights")

    def __call__(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and variance (k, m) of components, noise included."""
        inputs = (points - self.input_mean) / self.input_scale
        scaled = inputs / self.lengths[:, None, :]
        squared = (scaled**2).sum(-1)[:, :, None] + (self.trained**2).sum(-1)[:, None, :]
        squared -= 2.0 * scaled @ self.trained.transpose(0, 2, 1)
        far = np.sqrt(5.0 * np.maximum(squared, 0.0))
        kernel = self.amplitude[:, None, None] * (1.0 + far + far**2 / 3.0) * np.exp(-far)
        mean = np.einsum("kmn,kn->km", kernel, self.weights)
        known = self.root @ kernel.transpose(0, 2, 1)
        variance = (self.amplitude + self.noise)[:, None] - np.einsum("knm,knm->km", known, known)
        trend = inputs @ self.slope.T + self.offset
        return trend.T + self.size[:, None] * mean, self.size[:, None] ** 2 * np.maximum(variance, 1e-12)

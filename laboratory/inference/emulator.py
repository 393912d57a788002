"""Emulators: what a simulation would give at a point of the unit cube, with how well that is known.

One Gaussian process an output (scikit-learn): a linear trend, and a Matern process of what it leaves with a length for
every input and a part of noise for what jumps (an arc that lets go, an area that changes).
"""

import warnings
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
from sklearn.linear_model import RidgeCV
from sklearn.preprocessing import StandardScaler

from trackdyn.errors import InputError

LEAST_POINTS = 8
LENGTHS = (0.2, 100.0)  # of inputs that have a variance of 1
NOISE = (1e-6, 1.0)  # of a residual that has a variance of 1


class Terms(NamedTuple):
    """Numbers of a trained process; ``u`` are the inputs less ``input_mean`` over ``input_scale``."""

    input_mean: np.ndarray  # (d,) of the inputs
    input_scale: np.ndarray  # (d,) of the inputs
    slope: np.ndarray  # (d,) of the trend ``slope . u + offset``
    offset: float
    size: float  # standard deviation of what the trend leaves; the numbers below are of that over ``size``
    amplitude: float  # variance of the Matern process (nu = 5/2)
    noise: float  # variance of the noise
    lengths: np.ndarray  # (d,) of the Matern process, in ``u``


class Emulator:
    """One output as a function of ``d`` inputs.

    Parameters
    ----------
    x : (n, d) array
        Inputs.
    y : (n,) array
        Outputs; points where it is not finite are left out.
    iterations : int
        Bound of the search for lengths and noise; each costs n^3.

    Raises
    ------
    InputError
        Fewer than eight points, or shapes that do not fit.
    """

    def __init__(self, x, y, iterations: int = 25):
        x, y = np.atleast_2d(np.asarray(x, dtype=float)), np.asarray(y, dtype=float)
        if y.shape != (len(x),):
            raise InputError(
                f"emulator: {len(x)} points and outputs of shape {y.shape} do not match; expected one output per point"
            )
        known = np.isfinite(y) & np.isfinite(x).all(axis=1)
        if known.sum() < LEAST_POINTS:
            raise InputError(f"emulator: {known.sum()} points have an output; at least {LEAST_POINTS} are needed")
        self.x, self.y, self.iterations = x[known], y[known], iterations
        self._inputs = StandardScaler().fit(self.x)
        inputs = self._inputs.transform(self.x)
        self._trend = RidgeCV(alphas=np.logspace(-3, 3, 13)).fit(inputs, self.y)
        rest = self.y - self._trend.predict(inputs)
        self._scale = float(rest.std())
        self._process = self._fit(inputs, rest / self._scale) if self._scale > 1e-12 * (1 + abs(self.y).max()) else None

    def _fit(self, inputs: np.ndarray, rest: np.ndarray) -> GaussianProcessRegressor:
        lengths = np.full(inputs.shape[1], 2.0 * np.sqrt(inputs.shape[1]))
        kernel = ConstantKernel(1.0, (1e-3, 1e3)) * Matern(lengths, LENGTHS, nu=2.5) + WhiteKernel(0.1, NOISE)

        def search(objective, start, bounds):
            found = minimize(
                objective, start, jac=True, bounds=bounds, method="L-BFGS-B", options={"maxiter": self.iterations}
            )
            return found.x, found.fun

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its bound: an input without effect
            return GaussianProcessRegressor(kernel, optimizer=search).fit(inputs, rest)

    def predict(self, x) -> tuple[np.ndarray, np.ndarray]:
        """Mean and variance at (m, d) inputs: what a simulation there would give, noise included."""
        inputs = self._inputs.transform(np.atleast_2d(np.asarray(x, dtype=float)))
        mean = self._trend.predict(inputs)
        if self._process is None:
            return mean, np.zeros(len(mean))
        rest, sd = self._process.predict(inputs, return_std=True)
        return mean + self._scale * rest, (self._scale * sd) ** 2

    def terms(self) -> Terms:
        """What the process was found to be, for predictions of many at once."""
        if self._process is None:
            raise InputError("emulator: the output never changes, so that it has no process")
        product, noise = self._process.kernel_.k1, self._process.kernel_.k2
        return Terms(
            self._inputs.mean_,
            self._inputs.scale_,
            self._trend.coef_,
            float(self._trend.intercept_),
            self._scale,
            float(product.k1.constant_value),
            float(noise.noise_level) + self._process.alpha,
            np.broadcast_to(product.k2.length_scale, self._inputs.mean_.shape),
        )

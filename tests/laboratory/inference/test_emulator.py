"""Emulators against functions that are known in closed form."""

import numpy as np
import pytest
from scipy.stats import qmc

from laboratory.inference.emulator import Emulator
from laboratory.inference.identification.emulation import FeatureEmulator
from trackdyn.errors import InputError


def points(count, d, seed=1):
    return qmc.LatinHypercube(d, seed=seed).random(count)


def bent(x):
    return 3.0 * x[:, 0] + np.sin(4.0 * x[:, 1])


def test_a_smooth_function_is_known_between_the_points():
    x, new = points(60, 4), points(50, 4, seed=2)
    mean, variance = Emulator(x, bent(x)).predict(new)
    assert np.abs(mean - bent(new)).max() < 0.05
    assert np.sqrt(variance).max() < 0.1


def test_the_variance_of_noise_is_that_of_the_noise():
    """Two inputs of four matter, noise has a variance of 0.04: the emulator says so, and half as much again at most."""
    rng = np.random.default_rng(3)
    x = points(200, 4)
    _, variance = Emulator(x, bent(x) + rng.normal(0, 0.2, 200)).predict(points(50, 4, seed=2))
    assert 0.02 < variance.mean() < 0.06


def test_points_without_an_output_are_left_out_and_too_few_are_refused():
    x = points(30, 2)
    y = bent(x)
    y[::2] = np.nan
    assert len(Emulator(x, y).y) == 15
    with pytest.raises(InputError, match="7 points have an output"):
        Emulator(x[:7], bent(x[:7]))
    with pytest.raises(InputError, match="do not match"):
        Emulator(x, y[:5])


def test_errors_that_look_like_another_value_of_an_unknown_are_promised():
    """A line whose place jitters by 0.02 from simulation to simulation: estimates of its place from the error alone.

    The covariance of errors in all places, without regard to the slope, promises a third of them: 90 % intervals then
    hold 33 to 44 %.
    """
    rng = np.random.default_rng(1)

    def simulated(x):
        away = np.linspace(0, 1, 16) - x - 0.02 * rng.standard_normal(x.shape)
        return np.exp(-0.5 * (away / 0.12) ** 2)

    x, unseen = qmc.Sobol(1, seed=1).random(64), rng.uniform(0.02, 0.98, (300, 1))
    emulator = FeatureEmulator(x, simulated(x), np.full(16, 0.1))
    mean, covariance = emulator(unseen)
    slope = emulator(unseen + 0.01).mean - emulator(unseen - 0.01).mean
    weight = np.linalg.solve(covariance, slope[:, :, None])[:, :, 0]
    standard = (weight * (simulated(unseen) - mean)).sum(axis=1) / np.sqrt((weight * slope).sum(axis=1))
    inside = (abs(standard) < 1.645).mean()
    assert 0.8 < inside < 0.97  # 90 %, learnt from 64 points: three standard deviations of both samples

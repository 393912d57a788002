"""Emulators against functions that are known in closed form."""

import numpy as np
from scipy.stats import qmc

from laboratory.inference.identification.emulation import fitted_emulator


def points(count, d, seed=1):
    return qmc.LatinHypercube(d, seed=seed).random(count)


def bent(x):
    return 3.0 * x[:, 0] + np.sin(4.0 * x[:, 1])


def test_errors_are_as_large_as_the_noise_of_simulations():
    """Two inputs of four matter, noise has a variance of 0.04: that is promised, and half as much again at most."""
    rng, x = np.random.default_rng(3), points(200, 4)
    y = bent(x)[:, None] + rng.normal(0, 0.2, (200, 2))
    variances = np.diagonal(fitted_emulator(x, y, np.ones(2)).covariance)
    assert (variances > 0.02).all()
    assert (variances < 0.06).all()


def test_errors_count_where_the_last_simulations_are():
    """Half of the range jitters: an emulator whose last simulations are in the other half promises small errors."""
    rng = np.random.default_rng(4)
    x = np.concatenate([rng.uniform(0.5, 1.0, (64, 1)), rng.uniform(0.0, 0.5, (64, 1))])
    y = np.column_stack([np.sin(3 * x[:, 0]), np.cos(3 * x[:, 0])])
    y[:64] += rng.normal(0, 0.3, (64, 2))
    everywhere, there = (np.trace(fitted_emulator(x, y, np.ones(2), last).covariance) for last in (0, 64))
    assert there < everywhere / 3


def test_errors_that_look_like_another_value_of_an_unknown_are_promised():
    """A line whose frequency jitters by 0.02 from simulation to simulation: estimates of it from the error alone.

    The covariance of errors in all places, without regard to the slope, promises a third of them: 90 % intervals then
    hold 33 to 44 %.
    """
    rng = np.random.default_rng(1)

    def simulated(x):
        away = np.linspace(0, 1, 16) - x - 0.02 * rng.standard_normal(x.shape)
        return np.exp(-0.5 * (away / 0.12) ** 2)

    x, unseen = qmc.Sobol(1, seed=1).random(64), rng.uniform(0.02, 0.98, (300, 1))
    emulator = fitted_emulator(x, simulated(x), np.full(16, 0.1))
    slope = emulator.mean(unseen + 0.01) - emulator.mean(unseen - 0.01)
    weight = np.linalg.solve(emulator.covariance, slope.T).T
    standard = (weight * (simulated(unseen) - emulator.mean(unseen))).sum(axis=1) / np.sqrt(
        (weight * slope).sum(axis=1)
    )
    inside = (abs(standard) < 1.645).mean()
    assert 0.8 < inside < 0.97  # 90 %, learnt from 64 points: three standard deviations of both samples

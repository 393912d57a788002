"""The emulator of all features: against scikit-learn, against leaving points out one by one, and on points of
its own.
"""

import numpy as np
import pytest
from sklearn.covariance import LedoitWolf

from laboratory.inference.identification.emulation import FeatureEmulator, tails


def truth(x):
    """Five features of two unknowns; the last two are almost the same."""
    a, b = x[:, 0], x[:, 1]
    return np.stack([a + b**2, np.sin(3 * a), a * b, np.exp(b), np.exp(b) + 0.01 * a], axis=1)


@pytest.fixture(scope="module")
def design():
    return np.random.default_rng(1).uniform(size=(60, 2))


@pytest.fixture(scope="module")
def noisy(design):
    return truth(design) + 0.05 * np.random.default_rng(2).standard_normal((60, 5))


@pytest.fixture(scope="module")
def emulator(design, noisy):
    return FeatureEmulator(design, noisy, np.full(5, 0.1))


@pytest.mark.parametrize("degrees", [4.0, 40.0])
def test_tails_are_those_that_errors_were_drawn_with(degrees):
    """Normal errors of three features over a common chi: twice as large as promised, more so towards one end, with the
    degrees given.
    """
    rng = np.random.default_rng(7)
    factor = degrees / rng.chisquare(degrees, 4000)
    distance = factor * (2.0**2) * (rng.standard_normal((4000, 3)) ** 2).sum(axis=1)
    place = np.linspace(-1, 1, 4000)
    terms = np.column_stack([np.ones(4000), place])
    (size, slope), found = tails(distance * np.exp(0.7 * place), 3, terms)
    assert np.exp(0.5 * size) == pytest.approx(2.0, rel=0.05) and slope == pytest.approx(0.7, abs=0.1)
    assert found == pytest.approx(degrees, rel=0.2 if degrees < 10 else 0.6)


def test_what_the_emulator_steps_over_makes_it_unsure(design):
    """A narrow resonance at a corner: most points are predicted well, a few badly, and the tail says so."""

    def peaked(x):
        smooth = truth(x)
        peak = np.exp(-((x[:, :1] - 0.9) ** 2 + (x[:, 1:] - 0.9) ** 2) / (2 * 0.03**2))
        return smooth + peak * [1.0, -1.0, 0.5, 2.0, 2.0]

    x = np.vstack([design, [[0.9, 0.9], [0.91, 0.87]]])
    plain, resonant = FeatureEmulator(x, truth(x), np.full(5, 0.1)), FeatureEmulator(x, peaked(x), np.full(5, 0.1))
    assert resonant.degrees < 0.5 * plain.degrees
    far, near = resonant(np.array([[0.2, 0.2], [0.88, 0.88]])).covariance[:, 0, 0]
    assert near >= far


def test_new_points_lie_where_the_covariance_says(emulator):
    rng = np.random.default_rng(4)
    points = rng.uniform(size=(200, 2))
    mean, covariance = emulator(points)
    off = truth(points) + 0.05 * rng.standard_normal((200, 5)) - mean
    distance = np.array([one @ np.linalg.solve(c, one) for one, c in zip(off, covariance, strict=True)])
    # chi-squared with 5 degrees: mean 5; the share beyond its 90 % quantile 9.24 is 10 %. Lengths and noise of a
    # process are estimates from 60 points: twice as often is allowed for, and so is half
    assert 2.5 < distance.mean() < 8
    assert 0.02 < (distance > 9.24).mean() < 0.25


def test_features_that_move_together_err_together(design):
    """Two copies of a feature: their difference is known better than either."""
    jump = np.random.default_rng(5).standard_normal(60) * 0.2
    y = np.stack([truth(design)[:, 0] + jump, truth(design)[:, 0] + jump], axis=1)
    covariance = FeatureEmulator(design, y, np.full(2, 0.1))(np.array([[0.5, 0.5]])).covariance[0]
    assert covariance[0, 1] / covariance[0, 0] > 0.99
    assert LedoitWolf().fit(y - y.mean(axis=0)).covariance_[0, 1] > 0

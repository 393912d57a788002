"""The emulator of all features: against scikit-learn, against leaving points out one by one, and on points of
its own.
"""

import numpy as np
import pytest

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

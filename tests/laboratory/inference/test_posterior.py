"""The posterior against closed forms: its density, its draws, and what it predicts of a record that it has not seen."""

import numpy as np
import pytest
from scipy.special import gammaln
from scipy.stats import loggamma, multivariate_normal, norm

from laboratory.inference.identification.emulation import Emulator
from laboratory.inference.identification.features import Feature
from laboratory.inference.identification.posterior import (
    MEDIANS,
    SHARED,
    SPREAD,
    MeasuredRecords,
    Posterior,
    sample,
)

FEATURES = (Feature("line_1", "lines"), Feature("passing_1", "passing"))
SLOPES = np.array([2.0, -1.0])
DEGREES = 50.0
CONSTANT = gammaln(DEGREES / 2) - DEGREES / 2 * np.log(DEGREES / 2)  # that the density leaves out


def linear(count):
    """An emulator of features in proportion to one unknown, ``count`` records of the same two."""

    return Emulator(lambda points: np.tile(points @ SLOPES[None, :], count), 1e-6 * np.eye(2 * count), DEGREES)


def records(values, count):
    scatter = 1e-4 * np.eye(2 * count)
    return MeasuredRecords(FEATURES * count, np.repeat(np.arange(count), 2), np.asarray(values, dtype=float), scatter)


def test_density_is_that_of_the_normal_distribution():
    posterior = Posterior(records([0.9, -0.4, 1.1, -0.6], 2), linear(2), 1)
    assert posterior.groups == ["lines", "passing"]
    for point in ([0.5, -3.0, -2.0, 0.0], [0.1, -4.0, -1.0, 0.7]):
        lines, passing = np.exp(2 * np.array(point[1:3]))
        half = np.array([[lines, 0, SHARED * lines, 0], [0, passing, 0, SHARED * passing]])
        covariance = np.vstack([half, half[:, [2, 3, 0, 1]]]) + (1e-4 + 1e-6 * np.exp(point[3]) + 1e-10) * np.eye(4)
        mean = np.tile(SLOPES * point[0], 2)
        expected = multivariate_normal(mean, covariance).logpdf([0.9, -0.4, 1.1, -0.6]) + 2 * np.log(2 * np.pi)
        middle = np.log([MEDIANS["lines"], MEDIANS["passing"]])
        expected += (norm(middle, SPREAD).logpdf(point[1:3]) + np.log(SPREAD * np.sqrt(2 * np.pi))).sum()
        expected += loggamma(DEGREES / 2, loc=np.log(2 / DEGREES)).logpdf(-point[3]) + CONSTANT
        assert posterior.density(np.array([point]))[0] == pytest.approx(expected, rel=1e-9)
    assert posterior.density(np.array([[1.01, -3, -2, 0], [-0.01, -3, -2, 0]])).tolist() == [-np.inf, -np.inf]


def test_draws_have_the_quantiles_of_the_density():
    """Against sums over a grid of the unknown and the two sizes; the factor on so small errors changes nothing."""
    posterior = Posterior(records([1.0, -0.5], 1), linear(1), 1)
    axes = [np.linspace(0, 1, 201), *(np.linspace(middle - 5, middle + 5, 81) for middle in posterior.prior_middle)]
    grid = np.stack(np.meshgrid(*axes, [0.0], indexing="ij"), axis=-1).reshape(-1, 4)
    density = np.concatenate([posterior.density(cells) for cells in np.array_split(grid, 200)])
    weight = np.exp(density - density.max()).reshape([len(axis) for axis in axes]).sum(axis=(1, 2))
    cumulative = (np.cumsum(weight) - weight / 2) / weight.sum()  # at the middle of each cell
    points = sample(posterior, 1500, seed=1).points[:, 0]
    for level in (0.05, 0.5, 0.95):
        # quantiles of some thousand draws with an autocorrelation of tens of steps: a tenth of the standard deviation
        assert np.quantile(points, level) == pytest.approx(
            np.interp(level, cumulative, axes[0]), abs=0.1 * points.std() + 0.005
        )


def test_more_speeds_do_not_average_a_shared_discrepancy_away():
    """With sizes fixed, the variance of the unknown from many records tends to that of the shared discrepancy alone."""
    size, widths = np.log(0.2), []
    for count in (1, 16):
        posterior = Posterior(records([1.0, -0.5] * count, count), linear(count), 1)
        grid = np.column_stack([np.linspace(0, 1, 400), np.full((400, 2), size), np.zeros(400)])
        weight = np.exp((log_density := posterior.density(grid)) - log_density.max())
        mean = (grid[:, 0] * weight).sum() / weight.sum()
        widths.append(np.sqrt(((grid[:, 0] - mean) ** 2 * weight).sum() / weight.sum()))
    expected = np.sqrt((SHARED + (1 - SHARED) / 16) / 1)
    assert widths[1] / widths[0] == pytest.approx(expected, rel=0.02)

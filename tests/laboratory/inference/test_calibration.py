"""Calibration finds intervals that are right to be right, and ones that are too narrow to be too narrow."""

import numpy as np
import pytest

from laboratory.inference.identification.calibration import (
    LEVELS,
    CalibrationConfig,
    calibrate,
    rank_band,
    simulate_all,
)
from laboratory.inference.identification.emulation import FeatureEmulator, Prediction
from laboratory.inference.unknowns import Unknown
from tests.conftest import RIG
from trackdyn.errors import InputError

pytestmark = pytest.mark.slow


@pytest.fixture
def config():
    ranges = {"bushing.stiffness": (180.0, 2500.0), "tension.pre_tension": (1500.0, 15000.0)}
    unknowns = [Unknown(names=[name], low=low, high=high, scale="log") for name, (low, high) in ranges.items()]
    return CalibrationConfig(
        rig=str(RIG), unknowns=unknowns, ring_radius_m=0.308, speeds_rpm=[210], simulations=64, truths=32,
        plain=12, turns=4, noise_g=0.005, steps=150, seed=1,
    )  # fmt: skip


def test_calibrated_intervals_hold_the_truth_as_often_as_they_say(config, closed_form, tmp_path):
    """32 truths: an exact procedure covers 90 % of them with a standard error of 5.3 %; four of them are allowed."""
    calibration = calibrate(config, tmp_path, progress=False)
    prior = calibration.summary[calibration.summary["discrepancy"] == "prior"].set_index("parameter")
    assert prior.loc["all unknowns", "low_90"] < prior.loc["all unknowns", "covered_90"] > 0.9 - 4 * 0.0375
    prior = prior.drop("all unknowns")
    assert {"bushing.stiffness", "tension.pre_tension", "discrepancy.lines"} <= set(prior.index)
    assert (prior["covered_90"] > 0.9 - 4 * 0.053).all()
    assert (prior["p_uniform"] > 1e-4).all()
    assert (prior.loc[["bushing.stiffness", "tension.pre_tension"], "identified"] > 20).all()
    assert (prior["bins_outside"] <= 1).all()
    assert list(calibration.covered) == ["truth", "parameter", "level", "covered"]
    assert len(calibration.covered) == 32 * 2 * len(LEVELS)
    # without any discrepancy the intervals are too wide, not too narrow
    none = calibration.summary[calibration.summary["discrepancy"] == "none"].set_index("parameter")
    assert (none["covered_90"] >= 0.9).all()


def test_an_emulator_that_promises_too_much_is_found_out(config, closed_form, tmp_path, monkeypatch):
    """Errors of simulations that the covariance leaves out: intervals no longer hold the truth."""

    def displaced(self, points):
        mean, covariance = whole(self, points)
        return Prediction(mean + 0.8, covariance)

    whole = FeatureEmulator.__call__
    monkeypatch.setattr(FeatureEmulator, "__call__", displaced)
    summary = calibrate(
        config.model_copy(update={"simulations": 32, "truths": 16, "plain": 0}), tmp_path, progress=False
    ).summary.set_index("parameter")
    assert summary.loc["bushing.stiffness", "covered_90"] < 0.8 or summary.loc["bushing.stiffness", "p_uniform"] < 1e-3


@pytest.mark.parametrize(("count", "bins"), [(200, 20), (64, 12)])
def test_an_even_histogram_lies_within_its_band_as_often_as_it_says(count, bins):
    """95 %, or a little more because counts are whole; a band of each bin by itself would hold a third of them."""
    low, high = rank_band(count, bins)
    drawn = np.random.default_rng(7).multinomial(count, np.full(bins, 1 / bins), size=4000)
    within = ((drawn >= low) & (drawn <= high)).all(axis=1).mean()
    assert 0.94 < within < 0.99 and low < count / bins < high


def test_a_rig_without_the_field_is_refused(config, closed_form):
    wrong = config.model_copy(update={"unknowns": [Unknown(names=["bushing.colour"], low=0, high=1)]})
    with pytest.raises(InputError, match=r"'bushing.colour' is not a parameter of the rig"):
        simulate_all(wrong, None, progress=False)

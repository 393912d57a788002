"""Calibration finds intervals that are right to be right, and ones that are too narrow to be too narrow."""

import numpy as np
import pandas as pd
import pytest

from laboratory.inference.identification import calibration, experiment
from laboratory.inference.identification.calibration import (
    LEVELS,
    CalibrationConfig,
    calibrate,
    held,
    rank_band,
    repeated,
    summarised,
)
from laboratory.inference.identification.emulation import FeatureEmulator, Prediction
from laboratory.inference.unknowns import Unknown

pytestmark = pytest.mark.slow


@pytest.fixture
def config(rig_path):
    unknowns = [Unknown(names=[name], scale="log") for name in ("bushing.stiffness", "tension.pre_tension")]
    return CalibrationConfig(
        rig=str(rig_path),
        unknowns=unknowns,
        ring_radius_m=0.308,
        speeds_rpm=[210],
        simulations=64,
        truths=64,
        plain=12,
        repeats=20,
        places=3,
        turns=4,
        noise_g=0.005,
        steps=150,
        seed=1,
    )


def test_calibrated_intervals_hold_the_truth_as_often_as_they_say(config, closed_form, tmp_path):
    """64 truths: an exact procedure covers 90 % of them with a standard error of 3.75 %; four of them are allowed."""
    found = calibrate(config, tmp_path, progress=False)
    prior = found.summary[found.summary["discrepancy"] == "prior"].set_index("parameter")
    assert prior.loc["all unknowns", "low_90"] < prior.loc["all unknowns", "covered_90"] > 0.85
    prior = prior.drop("all unknowns")
    assert {"bushing.stiffness", "tension.pre_tension", "discrepancy.lines"} <= set(prior.index)
    assert (prior["covered_90"] > 0.9 - 4 * 0.0375).all()
    assert (prior["p_uniform"] > 1e-4).all()
    assert (prior.loc[["bushing.stiffness", "tension.pre_tension"], "identified"] > 20).all()
    assert (prior["bins_outside"] <= 1).all()
    assert list(found.covered) == ["truth", "parameter", "level", "covered"]
    assert len(found.covered) == 64 * 2 * len(LEVELS)
    # without any discrepancy the intervals are too wide, not too narrow
    none = found.summary[found.summary["discrepancy"] == "none"].set_index("parameter")
    assert (none["covered_90"] >= 0.9).all()


def test_an_emulator_that_promises_too_much_is_found_out(config, closed_form, tmp_path, monkeypatch):
    """Errors of simulations that the covariance leaves out: intervals no longer hold the truth."""

    def off(self, points):
        mean, covariance = whole(self, points)
        return Prediction(mean + 0.8, covariance)

    whole = FeatureEmulator.__call__
    monkeypatch.setattr(FeatureEmulator, "__call__", off)
    found = calibrate(
        config.model_copy(update={"simulations": 32, "truths": 32, "plain": 0}), tmp_path, progress=False
    ).summary.set_index("parameter")
    assert found.loc["bushing.stiffness", "covered_90"] < 0.8 or found.loc["bushing.stiffness", "p_uniform"] < 1e-3


@pytest.mark.parametrize(
    ("rank", "level", "inside"), [(0, 0.95, False), (49, 0.5, True), (99, 0.9, False), (5, 0.9, True), (4, 0.9, False)]
)
def test_a_rank_is_within_the_central_interval(rank, level, inside):
    assert held(rank, 99, level) is inside


def test_summary_of_constructed_ranks():
    uniform = pd.DataFrame(
        {
            "truth": range(100),
            "discrepancy": "prior",
            "parameter": "a",
            "rank": range(100),
            "of": 99,
            "verdict": "identified",
        }
    )
    piled = uniform.assign(parameter="b", rank=0, verdict="not identified")
    found = summarised(pd.concat([uniform, piled])).set_index("parameter")
    assert found.loc["a", "covered_90"] == 0.9 and found.loc["a", "covered_90_identified"] == 0.9
    assert found.loc["a", "p_uniform"] == pytest.approx(1) and found.loc["b", "p_uniform"] < 1e-10
    assert found.loc["a", "low_90"] == pytest.approx(0.8238, abs=1e-4)  # Clopper and Pearson, 90 of 100
    assert found.loc["b", "covered_90"] == 0 and found.loc["b", "identified"] == 0
    assert found.loc["a", "bins_outside"] == 0 and found.loc["b", "bins_outside"] == 1  # a bin may be empty


@pytest.mark.parametrize(("count", "bins"), [(200, 20), (64, 12)])
def test_an_even_histogram_lies_within_its_band_as_often_as_it_says(count, bins):
    """95 %, or a little more because counts are whole; a band of each bin by itself would hold a third of them."""
    low, high = rank_band(count, bins)
    drawn = np.random.default_rng(7).multinomial(count, np.full(bins, 1 / bins), size=4000)
    within = ((drawn >= low) & (drawn <= high)).all(axis=1).mean()
    assert 0.94 < within < 0.99 and low < count / bins < high


def test_records_with_other_noise_scatter_as_the_bootstrap_of_each_says(config, closed_form, tmp_path, monkeypatch):
    """Noise alone; then a bootstrap that promises a quarter of the variance."""
    monkeypatch.setattr(experiment, "simulated_ay", lambda *given: closed_form(*given[:4]))
    again = config.model_copy(update={"seed": config.seed + 1})
    found = pd.concat([repeated(one, tmp_path / str(one.seed), progress=False) for one in (config, again)])
    holds = (found["low"] < 1) & (found["high"] > 1)
    # 95 % intervals of 19 features of the same records, which are off together: of two sets
    assert holds.mean() > 0.8 and 0.8 < found["ratio"].median() < 1.25
    assert found["inside_90"].median() > 0.9  # widened for few turns
    whole = calibration.covariance
    monkeypatch.setattr(calibration, "covariance", lambda *given: whole(*given) / 4)
    narrow = repeated(config, tmp_path, progress=False)
    assert narrow["ratio"].median() > 3 and ((narrow["low"] < 1) & (narrow["high"] > 1)).mean() < 0.2

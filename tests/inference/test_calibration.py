"""Calibration finds intervals that are right to be right, and ones that are too narrow to be too narrow."""

import numpy as np
import pandas as pd
import pytest

from trackdyn.errors import InputError
from trackdyn.inference.identification.calibration import (
    LEVELS,
    CalibrationConfig,
    calibrate,
    held,
    simulate_all,
    summarised,
)
from trackdyn.inference.identification.emulation import FeatureEmulator, Prediction
from trackdyn.inference.unknowns import Unknown
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml

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
        plain=12,
        records=6,
        turns=4,
        noise_g=0.005,
        steps=150,
        seed=1,
    )


def test_calibrated_intervals_hold_the_truth_as_often_as_they_say(config, closed_form, tmp_path):
    """64 truths: an exact procedure covers 90 % of them with a standard error of 3.75 %; four of them are allowed."""
    found = calibrate(config, tmp_path, progress=False)
    prior = found.summary[found.summary["discrepancy"] == "prior"].set_index("parameter")
    assert {"bushing.stiffness", "tension.pre_tension", "discrepancy.lines"} <= set(prior.index)
    assert (prior["covered_90"] > 0.9 - 4 * 0.0375).all()
    assert (prior["p_uniform"] > 1e-4).all()
    assert (prior.loc[["bushing.stiffness", "tension.pre_tension"], "identified"] > 20).all()
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
        config.model_copy(update={"simulations": 32, "plain": 0}), tmp_path, progress=False
    ).summary.set_index("parameter")
    assert found.loc["bushing.stiffness", "covered_90"] < 0.8 or found.loc["bushing.stiffness", "p_uniform"] < 1e-3


def test_simulations_do_not_depend_on_what_is_kept(config, closed_form, tmp_path):
    one = simulate_all(config, tmp_path / "store", progress=False)
    again = simulate_all(config, tmp_path / "store", progress=False)
    anew = simulate_all(config, None, progress=False)
    for other in (again, anew):
        assert (one.points == other.points).all() and (one.simulated == other.simulated).all()
        assert all((a == b).all() for a, b in zip(one.scatter, other.scatter, strict=True))
    assert np.ptp(one.simulated, axis=0).max() > 0.5


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


def test_the_shipped_calibration_is_read():
    config = validated(CalibrationConfig, read_yaml("config/calibration.yaml"), "config/calibration.yaml")
    assert config.simulations >= 100


def test_a_rig_without_the_field_is_refused(config, closed_form):
    wrong = config.model_copy(update={"unknowns": [Unknown(names=["bushing.colour"], low=0, high=1)]})
    with pytest.raises(InputError, match=r"'bushing.colour' is not a parameter of the rig"):
        simulate_all(wrong, None, progress=False)

"""The row of a run: what depends on where a record begins and ends, and what may not have been recorded."""

import copy

import numpy as np
import pytest

from trackdyn.measure.columns import table_schema
from trackdyn.measure.metrics import run_metrics
from trackdyn.measure.sensor import sensor_metrics, whole_revolutions
from trackdyn.simulation.simulate import simulate


def test_whole_revolutions():
    assert whole_revolutions(10_000, 1000.0, 0.3) == round(3 / 0.3 * 1000)
    assert whole_revolutions(10_000, 1000.0, 0.37) == round(3 / 0.37 * 1000)
    assert whole_revolutions(1000, 1000.0, 0.3) == 1000


def test_statistics_of_whole_revolutions_do_not_depend_on_what_is_left_over():
    """A sine and a half: its RMS is 1/sqrt(2) over whole periods, its mean zero."""
    time = np.arange(25_000) / 1000
    row = sensor_metrics(np.sin(2 * np.pi * 0.1 * time) + 1.0, 1000.0, 0.1)
    assert row["rms_whole_g"] == pytest.approx(1.5**0.5, abs=1e-6)
    assert row["sd_whole_g"] == pytest.approx(0.5**0.5, abs=1e-6)
    assert abs(row["rms_g"] - 1.5**0.5) > 0.01


def test_the_cut_is_measured_where_it_was_recorded(make_scene):
    recording = simulate(make_scene())
    for cut, expected in ((np.zeros((0, 2)), (np.nan, np.nan)), (np.array([[1e-9, 2e-5], [3e-9, 1e-5]]), (3e-9, 2e-5))):
        known = copy.copy(recording)
        object.__setattr__(known, "cut", cut)  # a frozen recording, which may not have this array
        row = run_metrics("some", known)
        gaps = row["gap_before_projection_m"], row["velocity_gap_m_s"]
        np.testing.assert_equal(gaps, expected)
        assert [field["name"] for field in table_schema(row)["fields"]] == list(row)

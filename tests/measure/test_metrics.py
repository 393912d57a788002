"""The row of a run: what depends on where a record begins and ends, and what may not have been recorded."""

import copy

import numpy as np
import pytest

from trackdyn.measure.columns import table_schema
from trackdyn.measure.metrics import lines_by_start, run_metrics
from trackdyn.measure.sensor import sense, sensor_metrics, whole_revolutions
from trackdyn.scene.scene import Scene
from trackdyn.sensor.signals import main_line
from trackdyn.simulation.simulate import simulate

SECONDS = 20.0  # at 115 rpm two turns of the loop and a half, half way between two bins


@pytest.fixture(scope="module")
def belt(rig):
    """Function that runs the chain as a belt, whose turns repeat exactly."""

    def run(seconds):
        scene = Scene(rig, 115.0, chain="belt", ring_radius=None, pitches=(), spells=False, duration=seconds)
        return simulate(scene)

    return run


def test_later_starts_are_windows_of_a_longer_record(belt):
    short, long = belt(SECONDS), sense(belt(1.5 * SECONDS)).ay
    table = lines_by_start(short, starts=6)
    turn = 1 / short.periods.loop_hz
    assert table["start_s"].to_numpy() == pytest.approx(np.arange(6) / 6 * turn, abs=1e-3)
    for row in table.itertuples():
        first = round(row.start_s * short.rate)
        expected = main_line(long[first : first + len(short.time)], short.rate, 1 / turn)
        assert (row.line_hz, row.line_g) == pytest.approx(expected, abs=1e-4)
    assert np.ptp(table["line_g"]) > 0.01  # the start decides the height of a line between two bins


def test_a_record_too_short_for_a_line_has_no_starts(belt):
    assert lines_by_start(belt(5.0)).empty


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

"""Evidence: the line of a record that begins anywhere in a turn of the loop."""

import numpy as np
import pytest

from trackdyn.measure.sensor import sense
from trackdyn.measure.spectra import main_line
from trackdyn.scene.scene import Scene
from trackdyn.simulation.simulate import simulate
from trackdyn_replication.paper.evidence import lines_by_start

SECONDS = 20.0  # at 115 rpm two turns of the loop and a half, half way between two bins


@pytest.fixture(scope="module")
def belt(rig):
    """Function that runs the chain as a belt, whose turns repeat exactly."""

    def run(seconds):
        scene = Scene(rig, 115.0, chain="belt", ring_radius=None, pitches=(), contact_log=False, duration=seconds)
        return simulate(scene)

    return run


def test_later_starts_are_windows_of_a_longer_record(belt):
    short, long = belt(SECONDS), sense(belt(1.5 * SECONDS)).ay
    table = lines_by_start(short, starts=6)
    period = 1 / short.periods.loop_hz
    assert table["start_s"].to_numpy() == pytest.approx(np.arange(6) / 6 * period, abs=1e-3)
    for row in table.itertuples():
        first = round(row.start_s * short.rate)
        expected = main_line(long[first : first + len(short.time)], short.rate, 1 / period)
        assert (row.line_hz, row.line_g) == pytest.approx(expected, abs=1e-4)
    assert np.ptp(table["line_g"]) > 0.01  # the start decides the height of a line between two bins


def test_a_record_too_short_for_a_line_has_no_starts(belt):
    assert lines_by_start(belt(5.0)).empty

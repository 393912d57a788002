"""Evidence: the line of a record that begins anywhere in a turn of the loop."""

import numpy as np
import pytest

from tests.conftest import BELT
from trackdyn.measure.sensor import sense
from trackdyn.measure.spectra import main_line
from trackdyn.scene.scene import Scene
from trackdyn.simulation.belt import belt_recording
from trackdyn_replication.paper.evidence import lines_by_start


def test_later_starts_are_windows_of_a_longer_record_and_one_too_short_for_a_line_has_none(rig):
    """Of the chain as a belt, whose turns repeat exactly."""
    # 20 s at 115 rpm are two turns of the loop and a half, half way between two bins
    scenes = (Scene(rig, 115.0, **BELT, duration=seconds) for seconds in (20.0, 30.0, 5.0))
    short, longer, lineless = map(belt_recording, scenes)
    table, long, period = lines_by_start(short, starts=6), sense(longer).ay, 1 / short.periods.loop_hz
    assert lines_by_start(lineless).empty
    assert table["start_s"].to_numpy() == pytest.approx(np.arange(6) / 6 * period, abs=1e-3)
    for row in table.itertuples():
        first = round(row.start_s * short.rate)
        expected = main_line(long[first : first + len(short.time)], short.rate, 1 / period)
        assert (row.line_hz, row.line_g) == pytest.approx(expected, abs=1e-4)
    assert np.ptp(table["line_g"]) > 0.01  # the start decides the height of a line between two bins

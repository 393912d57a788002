"""What studies compare: the peak of a passage is whole."""

from dataclasses import replace

import numpy as np

from replication.study.accuracy.statistics import statistics_of
from trackdyn.measure.contacts import meshing_summary
from trackdyn.simulation.simulate import simulate


def test_a_contact_that_the_record_cuts_does_not_count_for_the_peak(make_scene):
    recording = simulate(make_scene(210.0, duration=9.0, lead_in=1.0))
    peak = statistics_of(recording)["left_peak"]
    assert peak == meshing_summary(recording)["left_peak_n"] > 0
    cut = recording.spells[recording.spells["side"] == 0][:1].copy()
    cut["start_s"], cut["end_s"], cut["peak_n"] = recording.begin, recording.begin + 0.1, 1.0
    assert statistics_of(replace(recording, spells=np.concatenate([cut, recording.spells])))["left_peak"] == peak

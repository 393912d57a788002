"""Every link as a sensor: the walk along the pins, the stitched revolution, means with their errors."""

import numpy as np
import pytest

from tests.conftest import BELT, contact_table, made_recording, refused
from trackdyn.measure.whole_loop import every_ay, stitch, whole_loop
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.simulate import simulate

RIG = load_rig("paper").changed(sensor__pitch=1)
RATE, LINKS, TEETH = 1000.0, 35, 13
PERIOD = 5.57 * 60 / 115.0 * LINKS / TEETH  # of the loop at 115 rpm, s


def test_recording_every_link_changes_nothing_else(driven_loop):
    first, all_links = driven_loop().record(0.1), driven_loop().record(0.1, every_link=True)
    assert first.mean.shape == (100, 1, 3) and all_links.mean.shape == (100, 1 + LINKS, 3)
    for column in (0, 1):  # the rig's own sensor, and that of its pitch
        np.testing.assert_array_equal(first.mean[:, 0], all_links.mean[:, column])
    np.testing.assert_array_equal(first.energy, all_links.energy)
    assert all_links.force.shape == (100, LINKS, 3)


def made_up(signal, seconds=1.0):
    """A recording in which link k feels ``signal(t + k T)``, links level, in m/s2 less gravity; four links touch."""
    time = np.arange(1, round(seconds * RATE) + 1) / RATE
    mean, force = np.zeros((len(time), 1 + LINKS, 3)), np.zeros((len(time), LINKS, 3))
    mean[:, 1:, 1] = (signal(time[:, None] + np.arange(LINKS) * PERIOD / LINKS) - 1.0) * 9.81
    force[:, :4, 0] = 1.0
    rates = np.full((len(time), 1), -2 * np.pi / PERIOD * LINKS / TEETH)
    return made_recording(Scene(RIG, 115.0, every_link=True), time=time, mean=mean, force=force, wheel_rate=rates)


def test_a_signal_that_repeats_is_stitched_to_its_whole_period():
    rate = 2 * np.pi / PERIOD

    def signal(t):
        return 1.2 * np.sin(rate * t + 0.4) + 0.1 * np.sin(12 * rate * t)

    ay = stitch(fake := made_up(signal), 5)
    # half a sample of the steepest slope, which the nearest sample of a passage can be off
    assert np.abs(ay - signal(np.arange(len(ay)) / RATE + 0.006)).max() <= 0.5 / RATE * rate * (1.2 + 1.2)
    measures = whole_loop(fake)
    assert measures["line"].value == pytest.approx(1.2, rel=1e-3)
    assert measures["rms"].value == pytest.approx(np.sqrt((1.2**2 + 0.1**2) / 2), rel=1e-3)
    assert measures["left_share"][:2] == (pytest.approx(100 * 4 / TEETH), 0.0)


def test_one_passage_has_a_value_and_no_error():
    fake = made_up(np.sin, seconds=0.3)
    assert fake.periods.passage == pytest.approx(PERIOD / LINKS)
    measures = whole_loop(fake)
    assert np.isfinite(measures["rms"].value) and np.isnan(measures["rms"].error)


def test_what_cannot_be_measured_is_refused(make_scene):
    refused(whole_loop, made_up(np.zeros_like, seconds=0.1), words=["shorter than a passage"])
    refused(every_ay, simulate(make_scene(duration=0.01, lead_in=0.0)), words=["every_link=True"])
    refused(make_scene, **BELT, every_link=True, words=["every_link = True:"])
    refused(Loop, make_scene(**BELT), words=["no state to step"])


def test_the_content_above_a_corner_and_the_peaks_of_each_side(make_scene):
    fake = made_up(lambda t: 2.0 * np.sin(2 * np.pi * 3.0 * t) + 0.5 * np.sin(2 * np.pi * 50.0 * t), seconds=3.0)
    # whole periods in the record: no line of 3 Hz leaks above 20 Hz
    assert whole_loop(fake)["high_frequency"].value == pytest.approx(0.5 / np.sqrt(2), rel=1e-3)
    loop = Loop(make_scene(motor_rpm=210.0, ring_radius=None, step=5e-5))
    loop.advance(loop.scene.ramp)
    recording = loop.record(3.0, contact_log=True, every_link=True)
    measures, table = whole_loop(recording), contact_table(recording)
    for side in ("left", "right"):
        peaks = table.loc[table["side"] == side, "peak_n"]
        assert peaks.min() < measures[f"{side}_peak"].value < peaks.max()
    assert measures["left_peak"].value != measures["right_peak"].value

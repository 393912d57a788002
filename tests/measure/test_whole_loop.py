"""Every link as a sensor: the walk along the pins, the stitched revolution, means with their errors."""

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import contact_table, made_recording
from trackdyn.inputs.errors import InputError
from trackdyn.measure.whole_loop import every_ay, stitch, whole_loop
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.simulate import simulate

RIG = load_rig("paper").changed(sensor__pitch=1)
RATE, LINKS, TEETH = 1000.0, 35, 13


def test_recording_every_link_changes_nothing_else(driven_loop):
    first, all_links = driven_loop().record(0.1), driven_loop().record(0.1, every_link=True)
    assert first.mean.shape == (100, 1, 3) and all_links.mean.shape == (100, 1 + LINKS, 3)
    for column in (0, 1):  # the rig's own sensor, and that of its pitch
        np.testing.assert_array_equal(first.mean[:, 0], all_links.mean[:, column])
    np.testing.assert_array_equal(first.energy, all_links.energy)
    assert all_links.force.shape == (100, LINKS, 3)


def made_up(signal, seconds=1.0, rpm=115.0, teeth_touching=4):
    """A recording in which link k feels ``signal(t + k T)``, links level, in m/s2 less gravity."""
    ratio, gravity = 5.57, 9.81
    period = ratio * 60 / rpm * LINKS / TEETH
    time = np.arange(1, round(seconds * RATE) + 1) / RATE
    felt = np.stack([signal(time + k * period / LINKS) for k in range(LINKS)], axis=1)
    mean = np.zeros((len(time), 1 + LINKS, 3))
    mean[:, 1:, 1] = (felt - 1.0) * gravity
    force = np.zeros((len(time), LINKS, 3))
    force[:, :teeth_touching, 0] = 1.0
    rates = np.full((len(time), 1), -2 * np.pi * rpm / ratio / 60)
    scene = Scene(RIG, rpm, every_link=True)
    return made_recording(scene, time=time, mean=mean, force=force, wheel_rate=rates), period


def test_a_signal_that_repeats_is_stitched_to_its_whole_period():
    fake, period = made_up(lambda t: t)
    rate = 2 * np.pi / period
    fake, _ = made_up(lambda t: 1.2 * np.sin(rate * t + 0.4) + 0.1 * np.sin(12 * rate * t))
    ay = stitch(fake, 5)
    time = np.arange(len(ay)) / RATE + 0.006
    expected = 1.2 * np.sin(rate * time + 0.4) + 0.1 * np.sin(12 * rate * time)
    # half a sample of the steepest slope, which the nearest sample of a passage can be off
    slope = rate * (1.2 + 1.2)
    assert np.abs(ay - expected).max() <= 0.5 / RATE * slope
    measures = whole_loop(fake)
    assert measures["line"].value == pytest.approx(1.2, rel=1e-3)
    assert measures["rms"].value == pytest.approx(np.sqrt((1.2**2 + 0.1**2) / 2), rel=1e-3)
    assert measures["left_share"].value == pytest.approx(100 * 4 / TEETH)
    assert measures["left_share"].error == 0.0


def test_one_passage_has_a_value_and_no_error():
    fake, period = made_up(lambda t: np.sin(t), seconds=0.3)
    assert fake.periods.passage == pytest.approx(period / LINKS)
    measures = whole_loop(fake)
    assert np.isfinite(measures["rms"].value)
    assert np.isnan(measures["rms"].error)


def test_what_cannot_be_measured_is_refused(make_scene):
    fake, _ = made_up(lambda t: 0 * t, seconds=0.1)
    with pytest.raises(InputError, match="shorter than a passage"):
        whole_loop(fake)
    with pytest.raises(InputError, match="every_link=True"):
        every_ay(replace(simulate(make_scene(duration=0.01, lead_in=0.0))))
    with pytest.raises(InputError, match="every_link = True:"):
        make_scene(chain="belt", contact_log=False, ring_radius=None, every_link=True)
    with pytest.raises(InputError, match="no state to step"):
        Loop(make_scene(chain="belt", contact_log=False, ring_radius=None))


def test_the_content_above_a_corner_and_the_peaks_of_each_side(make_scene):
    fake, _ = made_up(lambda t: 2.0 * np.sin(2 * np.pi * 3.0 * t) + 0.5 * np.sin(2 * np.pi * 50.0 * t), seconds=3.0)
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

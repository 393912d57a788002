"""The sensor of Eq. (40): +1 g at rest, 0 g in free fall, the centripetal term of a turning body."""

from dataclasses import replace

import numpy as np
import pytest

from tests import reference
from tests.kinematics import next_samples, set_model
from trackdyn.integrate.run import refresh
from trackdyn.measure.sensor import sense
from trackdyn.model.constants import Sensors
from trackdyn.simulation.simulate import simulate


def filled(loop, samples, stride):
    """Record of samples of ``stride`` steps each."""
    set_model(loop, stride=stride)
    return next_samples(loop, samples)


@pytest.mark.parametrize("pitch", [1, 7, 35])
def test_reading_in_a_run_is_the_acceleration_of_the_point(driven_loop, pitch):
    """Pin, angular and centripetal terms, against the other formulation of the chain."""
    loop = driven_loop(0.308, 210.0)
    bodies, x, y = np.array([2 * (pitch - 1), 2 * pitch - 1]), np.array([0.031, 0.012]), np.array([0.017, -0.02])
    set_model(loop, sensors=Sensors(bodies, x, y))
    model, state, work, _ = loop.arrays
    refresh(model, state, work)
    angle, rate = state.angle.copy(), state.rate.copy()
    expected = reference.reference_accelerations(
        model.chain, angle, rate, work.force_x, work.force_y, work.moment, implicit_step=0.5 * model.step
    )
    record = filled(loop, 1, 1)
    scale = np.abs(expected.alpha).max() * 0.1
    for k, body in enumerate(bodies):
        c, s = np.cos(angle[body]), np.sin(angle[body])
        turn = np.array([[c, -s], [s, c]])
        arm = turn @ (x[k], y[k])
        point = expected.pins[body] + expected.alpha[body] * np.array([-arm[1], arm[0]]) - rate[body] ** 2 * arm
        # rounding of the sweep against that of the reference
        np.testing.assert_allclose(record.raw[0, k, :2], turn.T @ point, rtol=0, atol=1e-9 * scale)


def test_mean_of_a_sample_is_the_mean_over_its_steps(driven_loop):
    coarse, fine = filled(driven_loop(), 1, 10), filled(driven_loop(), 10, 1)
    # equal steps, but for cosines made anew in every sample: 1e-16 in the depths of contacts
    scale = np.abs(fine.raw).max()
    np.testing.assert_allclose(coarse.mean[0], fine.raw.mean(axis=0), rtol=0, atol=1e-7 * scale)
    np.testing.assert_allclose(coarse.raw[0], fine.raw[-1], rtol=0, atol=1e-7 * scale)


def test_reading_is_in_g_and_cut_at_both_ends_of_the_range(make_scene):
    recording = simulate(make_scene(duration=0.05))
    mean = np.zeros_like(recording.mean)
    mean[[3, 5, 7], 0, [1, 0, 1]] = 25 * 9.81, -1e6, 18.5 * 9.81
    signal = sense(replace(recording, mean=mean))
    assert (signal.clipped, signal.ay[3], signal.ax[5], signal.ay[0]) == (2, 20.0, -20.0, 1.0)
    assert signal.ay[7] == pytest.approx(19.5, rel=1e-15)
    weightless = dict(recording.meta, rig=dict(recording.meta["rig"], gravity=0.0))
    # without gravity the unit is still 9.81 m/s2
    assert sense(replace(recording, mean=mean, raw=mean, meta=weightless)).ay[7] == pytest.approx(18.5, rel=1e-15)

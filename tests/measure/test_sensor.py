"""The sensor of Eq. (40): +1 g at rest, 0 g in free fall, the centripetal term of a turning body."""

import numpy as np
import pytest

from trackdyn.chain.kinematics import bushing_torques, orient, place
from trackdyn.chain.riccati import accelerations, make_work
from trackdyn.measure.sensor import sense, specific_force
from trackdyn.model import make_buffers
from trackdyn.simulate import settle, simulate


def turn(angle, vector):
    """Components in the frame of a link at ``angle`` of a vector given in the inertial frame."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * vector[0] + s * vector[1], -s * vector[0] + c * vector[1]])


@pytest.mark.parametrize("angle", [0.0, 0.7, -2.5, np.pi])
def test_a_link_at_rest_feels_gravity_upwards_alone(angle):
    np.testing.assert_allclose(specific_force([0.0, 0.0], angle), turn(angle, (0.0, 9.81)), atol=1e-14)


def test_a_level_link_at_rest_reads_plus_one_g():
    assert specific_force([0.0, 0.0], 0.0)[1] / 9.81 == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("angle", [0.0, 0.7, -2.5])
def test_free_fall_reads_nothing(angle):
    np.testing.assert_allclose(specific_force(turn(angle, (0.0, -9.81)), angle), 0.0, atol=1e-14)


def test_the_settled_loop_reads_the_projection_of_gravity(make_scene):
    """Through the solver: motor at rest, so the record is gravity in the link's frame."""
    recording = simulate(make_scene(motor_rpm=0.0))
    signal = sense(recording)
    # what is left of the settling: some rad/s2 at most on the sensor's arm of 0.05 m
    np.testing.assert_allclose(signal.ay, np.cos(recording.mean[:, 2]), atol=0.02)
    np.testing.assert_allclose(signal.ax, np.sin(recording.mean[:, 2]), atol=0.02)


def test_a_loop_that_falls_freely_accelerates_with_gravity(make_scene):
    """No contact, bushings without torque: every pin falls with g and nothing turns."""
    model, state, _, _ = settle(make_scene())
    chain = model.chain._replace(stiffness=0.0, damping=0.0)
    n = len(state.angle)
    work, none = make_buffers(n, 3), np.zeros(n)
    state.rate[:] = 0.0
    orient(state.angle, work.cos, work.sin)
    place(chain, state, work)
    bushing_torques(chain, state, work)
    sweep = make_work(n)
    accelerations(chain, work.cos, work.sin, state.rate, none, none, none, work.torque, 0.0, 7, sweep)
    # 70 bodies in double precision
    np.testing.assert_allclose(sweep.response @ sweep.load, 0.0, atol=1e-9)
    np.testing.assert_allclose(sweep.probe @ sweep.load, [0.0, -chain.gravity], atol=1e-9)


def test_clipped_samples_are_counted(make_scene):
    recording = simulate(make_scene(duration=0.05))
    recording.mean[7, 1] = 500.0
    signal = sense(recording)
    assert signal.clipped == 1
    assert signal.ay[7] == 20.0

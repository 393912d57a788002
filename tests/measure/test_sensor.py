"""The sensor of Eq. (40): +1 g at rest, 0 g in free fall, the centripetal term of a turning body."""

from dataclasses import replace

import numpy as np
import pytest

from replication.study.extremes import reference
from trackdyn.chain.kinematics import bushing_torques, orient
from trackdyn.chain.riccati import accelerations
from trackdyn.integrate.run import refresh
from trackdyn.measure.sensor import sense, specific_force
from trackdyn.model.constants import Chain, Sensor
from trackdyn.model.work import make_work
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.simulate import simulate


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
    recording = simulate(make_scene(motor_rpm=0.0, lead_in=3.0))
    signal = sense(recording)
    # what is left of the settling after 3 s is below 1e-3 g; the median leaves out a late slip
    assert np.median(np.abs(signal.ay - np.cos(recording.mean[:, 2]))) < 0.002
    assert np.median(np.abs(signal.ax - np.sin(recording.mean[:, 2]))) < 0.002


def test_a_loop_that_falls_freely_accelerates_with_gravity(make_scene):
    """No contact, bushings without torque: every pin falls with g and nothing turns."""
    loop = Loop(make_scene())
    chain, state = loop._parts.model.chain._replace(stiffness=0.0, damping=0.0), loop._parts.state
    work = make_work(70, 35, 3)
    state.rate[:] = 0.0
    orient(state.angle, work.cos, work.sin)
    bushing_torques(chain, state, work)
    accelerations(chain, state, work, 0.0, 7)
    sweep = work.sweep
    # 70 bodies in double precision
    np.testing.assert_allclose(sweep.response @ sweep.load, 0.0, atol=1e-9)
    np.testing.assert_allclose(sweep.probe @ sweep.load, [0.0, -chain.gravity], atol=1e-9)


def test_clipped_samples_are_counted(make_scene):
    recording = simulate(make_scene(duration=0.05))
    recording.mean[7, 1] = 500.0
    signal = sense(recording)
    assert signal.clipped == 1
    assert signal.ay[7] == 20.0


# --- through the time loop


def filled(loop, samples, stride):
    """Record of samples of ``stride`` steps each."""
    loop._parts = loop._parts._replace(model=loop._parts.model._replace(stride=stride))
    record = loop.room(samples)
    loop.fill(record)
    return record


@pytest.fixture
def polygon(rig):
    """Function that gives a regular clockwise ring without wheels, bushings relaxed, and its apothem."""
    n, side = 14, 0.1
    small = rig.changed(chain__pitches=n // 2, sensor__pitch=1)
    start = Loop(Scene(small, 0.0, ring_radius=None, spells=False, loop="free", step=1e-5))

    def make(rate, gravity, sensor, turn=0.2):
        chain = Chain(
            np.full(n, side), np.tile([10.0, 2.5], n // 2), np.tile([0.012, 0.003], n // 2),
            np.full(n, side / 2), np.zeros(n), 130.0, 10.0, -2 * np.pi / n, gravity,
        )  # fmt: skip
        apothem = side / (2 * np.tan(np.pi / n))
        # input pin of body 0 seen from the centre, which lies on the right of every body
        c, s = np.cos(turn), np.sin(turn)
        arm = apothem * np.array([-s, c]) - side / 2 * np.array([c, s])
        loop = start.copy()
        loop._parts = loop._parts._replace(model=loop._parts.model._replace(chain=chain, sensor=sensor))
        loop._parts.state.pin[:] = *arm, -rate * arm[1], rate * arm[0]
        loop._parts.state.angle[:], loop._parts.state.rate[:] = turn - 2 * np.pi * np.arange(n) / n, rate
        return loop, apothem

    return make


@pytest.mark.parametrize("body", [0, 4, 8])
def test_point_on_a_steadily_turning_ring_reads_the_centripetal_acceleration(polygon, body):
    rate, sensor = -6.0, Sensor(body, 0.03, 0.02)
    loop, apothem = polygon(rate, 0.0, sensor)
    record = filled(loop, 1, 1)
    # seen in the frame of its side, the centre is at (l / 2, -apothem)
    expected = -(rate**2) * np.array([sensor.x - 0.05, sensor.y + apothem])
    # 14 bodies in double precision
    np.testing.assert_allclose(record.raw[0, :2], expected, rtol=0, atol=1e-11 * np.abs(expected).max())


def test_falling_ring_reads_nothing_while_time_runs(polygon):
    loop, _ = polygon(0.0, 9.81, Sensor(2, 0.05, 0.02))
    record = filled(loop, 3, 20)
    reading = specific_force(record.raw[:, :2], record.raw[:, 2])
    # a joint angle is rounded to 1e-15 rad; damping of 10 N m s/rad on 0.003 kg m2 in steps of 1e-5 s makes
    # of it rates of 1e-10 rad/s at most, and accelerations of 1e-7 m/s2 if nothing damped them
    np.testing.assert_allclose(reading, 0.0, atol=1e-8)


@pytest.mark.parametrize("pitch", [1, 7, 35])
def test_reading_in_a_run_is_the_acceleration_of_the_point(driven_loop, pitch):
    """Pin, angular and centripetal terms, against the other formulation of the chain."""
    loop = driven_loop(0.308, 210.0)
    sensor = Sensor(2 * (pitch - 1), 0.031, 0.017)
    loop._parts = loop._parts._replace(model=loop._parts.model._replace(sensor=sensor))
    model, state, work = loop._parts
    refresh(model, state, work)
    angle, rate = state.angle.copy(), state.rate.copy()
    expected = reference.reference_accelerations(
        model.chain, angle, rate, work.force_x, work.force_y, work.moment, implicit_step=0.5 * model.step
    )
    point = np.array([expected.pin_ax, expected.pin_ay])
    arms = [(model.chain.length[i], 0.0) for i in range(sensor.body)] + [(sensor.x, sensor.y)]
    for i, (x, y) in enumerate(arms):
        c, s = np.cos(angle[i]), np.sin(angle[i])
        arm = np.array([c * x - s * y, s * x + c * y])
        point += expected.alpha[i] * np.array([-arm[1], arm[0]]) - rate[i] ** 2 * arm
    record = filled(loop, 1, 1)
    scale = np.abs(expected.alpha).max() * 0.1
    # of the sweep against the reference
    np.testing.assert_allclose(record.raw[0, :2], turn(angle[sensor.body], point), rtol=0, atol=1e-9 * scale)


def test_mean_of_a_sample_is_the_mean_over_its_steps(driven_loop):
    coarse, fine = filled(driven_loop(), 1, 10), filled(driven_loop(), 10, 1)
    # the same steps, but for cosines made anew in every sample: 1e-16 in the depths of contacts
    scale = np.abs(fine.raw).max()
    np.testing.assert_allclose(coarse.mean[0], fine.raw.mean(axis=0), rtol=0, atol=1e-7 * scale)
    np.testing.assert_allclose(coarse.raw[0], fine.raw[-1], rtol=0, atol=1e-7 * scale)


def test_reading_is_in_g_and_cut_at_both_ends_of_the_range(make_scene):
    recording = simulate(make_scene(duration=0.05))
    mean = np.zeros_like(recording.mean)
    mean[3, 1], mean[5, 0], mean[7, 1] = 25 * 9.81, -1e6, 18.5 * 9.81
    signal = sense(replace(recording, mean=mean, raw=mean))
    assert signal.clipped == 2
    assert signal.ay[3] == signal.raw_ay[3] == 20.0
    assert signal.ax[5] == signal.raw_ax[5] == -20.0
    assert signal.ay[7] == pytest.approx(19.5, rel=1e-15)
    assert signal.ay[0] == 1.0
    weightless = dict(recording.meta, rig=dict(recording.meta["rig"], gravity=0.0))
    # without gravity the unit is still 9.81 m/s2
    assert sense(replace(recording, mean=mean, raw=mean, meta=weightless)).ay[7] == pytest.approx(18.5, rel=1e-15)

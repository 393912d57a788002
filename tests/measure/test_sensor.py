"""The sensor of Eq. (40): +1 g at rest, 0 g in free fall, the centripetal term of a turning body."""

from dataclasses import replace

import numpy as np
import pytest
from trackdyn.chain.model import Chain

from trackdyn.chain.kinematics import bushing_torques, orient, place
from trackdyn.chain.riccati import accelerations, make_work
from trackdyn.integrate.run import run
from trackdyn.measure.sensor import sense, specific_force
from trackdyn.model import Drive, Model, Sensor, State, Wheels, make_buffers
from trackdyn.scene import build_model, build_shoes
from trackdyn.settling import empty_record, settle
from trackdyn.simulate import simulate
from trackdyn.study.extremes import reference


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


# --- through the time loop


@pytest.fixture
def polygon(make_scene):
    """Function that gives a regular clockwise ring without wheels, bushings relaxed, and its apothem."""
    n, side = 14, 0.1
    scene = make_scene()
    tooth = build_model(scene).tooth._replace(present=0)
    nothing = np.zeros(3)
    wheels = Wheels(
        np.zeros(3, np.int64), nothing, nothing, np.ones(3), np.ones(3), nothing, 0.02, tooth.law, tooth.law
    )

    def make(rate, gravity, sensor, turn=0.2):
        chain = Chain(
            np.full(n, side), np.tile([10.0, 2.5], n // 2), np.tile([0.012, 0.003], n // 2),
            np.full(n, side / 2), np.zeros(n), 130.0, 10.0, -2 * np.pi / n, gravity,
        )  # fmt: skip
        apothem = side / (2 * np.tan(np.pi / n))
        # input pin of body 0 seen from the centre, which lies on the right of every body
        c, s = np.cos(turn), np.sin(turn)
        arm = apothem * np.array([-s, c]) - side / 2 * np.array([c, s])
        state = State(
            np.zeros(1, np.int64), np.array([*arm, -rate * arm[1], rate * arm[0]]),
            turn - 2 * np.pi * np.arange(n) / n, np.full(n, rate),
            np.zeros(3), np.zeros(3), np.zeros(n), np.zeros((n // 2, 3)), np.zeros(7),
        )  # fmt: skip
        shoes = build_shoes(scene.rig.changed(chain__pitches=n // 2))
        model = Model(chain, shoes, tooth, wheels, Drive(0.0, 1.0), sensor, 1e-5)
        return model, state, make_buffers(n, 3), apothem

    return make


@pytest.mark.parametrize("body", [0, 4, 8])
def test_point_on_a_steadily_turning_ring_reads_the_centripetal_acceleration(polygon, body):
    rate, sensor = -6.0, Sensor(body, 0.03, 0.02)
    model, state, work, apothem = polygon(rate, 0.0, sensor)
    record = empty_record(1, len(state.angle), 3)
    assert run(model, state, work, record, 0, 1, 1) == -1
    # seen in the frame of its side, the centre is at (l / 2, -apothem)
    expected = -(rate**2) * np.array([sensor.x - 0.05, sensor.y + apothem])
    # 14 bodies in double precision
    np.testing.assert_allclose(record.raw[0, :2], expected, rtol=0, atol=1e-11 * np.abs(expected).max())


def test_falling_ring_reads_nothing_while_time_runs(polygon):
    model, state, work, _ = polygon(0.0, 9.81, Sensor(2, 0.05, 0.02))
    record = empty_record(3, len(state.angle), 3)
    assert run(model, state, work, record, 0, 3, 20) == -1
    reading = specific_force(record.raw[:, :2], record.raw[:, 2])
    # a joint angle is rounded to 1e-15 rad; damping of 10 N m s/rad on 0.003 kg m2 in steps of 1e-5 s makes
    # of it rates of 1e-10 rad/s at most, and accelerations of 1e-7 m/s2 if nothing damped them
    np.testing.assert_allclose(reading, 0.0, atol=1e-8)


@pytest.mark.parametrize("pitch", [1, 7, 35])
def test_reading_in_a_run_is_the_acceleration_of_the_point(driven_loop, place_loads, pitch):
    """Pin, angular and centripetal part, against the other formulation of the chain."""
    model, state, work = driven_loop(0.308, 210.0)
    sensor = Sensor(2 * (pitch - 1), 0.031, 0.017)
    model = model._replace(sensor=sensor)
    place_loads(model, state, work)
    angle, rate = state.angle.copy(), state.rate.copy()
    expected = reference.accelerations(
        model.chain, angle, rate, work.force_x, work.force_y, work.moment, implicit_step=model.step
    )
    point = np.array([expected.pin_ax, expected.pin_ay])
    arms = [(model.chain.length[i], 0.0) for i in range(sensor.body)] + [(sensor.x, sensor.y)]
    for i, (x, y) in enumerate(arms):
        c, s = np.cos(angle[i]), np.sin(angle[i])
        arm = np.array([c * x - s * y, s * x + c * y])
        point += expected.alpha[i] * np.array([-arm[1], arm[0]]) - rate[i] ** 2 * arm
    record = empty_record(1, len(angle), 3)
    assert run(model, state, work, record, 0, 1, 1) == -1
    scale = np.abs(expected.alpha).max() * 0.1
    # of the sweep against the multipliers
    np.testing.assert_allclose(record.raw[0, :2], turn(angle[sensor.body], point), rtol=0, atol=1e-9 * scale)


def test_mean_of_a_sample_is_the_mean_over_its_steps(driven_loop):
    coarse, fine = empty_record(1, 70, 3), empty_record(10, 70, 3)
    for record, samples, stride in ((coarse, 1, 10), (fine, 10, 1)):
        model, state, work = driven_loop(0.308)
        assert run(model, state, work, record, 0, samples, stride) == -1
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
    assert sense(replace(recording, mean=mean, raw=mean, meta=weightless)).ay[7] == pytest.approx(
        18.5, rel=1e-15
    )

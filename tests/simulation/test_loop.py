"""A loop that is stepped, looked at, recorded, steered, copied and pickled."""

import gc
import pickle
import weakref

import numba
import numpy as np
import pytest

from tests import reference
from tests.conftest import LAWS, assert_same_arrays, refused
from tests.kinematics import closed_rates, next_samples, set_model, spinning_loop
from trackdyn import Loop, Scene, simulate
from trackdyn.model.arrays import SAMPLED
from trackdyn.rig.layout import belt_around
from trackdyn.simulation import recorder
from trackdyn.simulation.initial_tension import TensionedLoop
from trackdyn.simulation.loop_arrays import flatten


def assert_same(loop, expected):
    np.testing.assert_equal(flatten(loop.state), flatten(expected.state))


@pytest.fixture
def loop(driven_loop):
    return driven_loop()


def test_steps_and_advance_are_the_same_motion(loop):
    advanced, again, cut, ticks = loop.copy(), loop.copy(), loop.copy(), []
    advanced.advance(0.5123, ticks.append)
    assert ticks == pytest.approx([0.25, 0.25, 0.0123], abs=1e-12)
    for count in (2500, 2500, 123):
        again.step(count)
    for _ in range(47):
        cut.step(109)
    assert advanced.time == again.time == cut.time == pytest.approx(loop.time + 0.5123, abs=1e-12)
    assert_same(advanced, again)
    # a call begins with exact cosines, which a series carries on: rounding of 1e-16 in angles, grown by stiff contacts
    for name in ("angle", "rate", "wheel_rate"):
        np.testing.assert_allclose(getattr(cut.state, name), getattr(advanced.state, name), rtol=0, atol=1e-9)
    assert np.abs(advanced.state.angle - loop.state.angle).max() > 0.05  # it does move


def test_a_copy_goes_its_own_way_and_looking_changes_nothing(loop):
    silent, steered = loop.copy(), loop.copy()
    steered.shift_tensioner(loop.layout.tensioner_shift_m + 1e-4)
    steered.drive(210.0)
    steered.advance(0.02)
    assert loop.time == 1.0 and loop.model.drive.rate == pytest.approx(-115 / 5.57 * np.pi / 30)
    assert loop.layout.tensioner_shift_m == steered.layout.tensioner_shift_m - 1e-4
    for _ in range(20):
        for name in ("pins", "mass_centres", "momentum", "tension", "joint_forces", "energy", "gap", "time"):
            getattr(loop, name)
        loop.advance(1e-3)
        silent.advance(1e-3)
    assert_same(loop, silent)
    assert np.abs(loop.state.angle - steered.state.angle).max() > 1e-6
    pins = loop.pins
    assert np.hypot(*(pins[-1] - pins[0])) == pytest.approx(loop.gap, abs=1e-14) and loop.gap < 1.1e-10
    np.testing.assert_allclose(np.hypot(*np.diff(pins, axis=0).T), loop.model.chain.length, rtol=1e-12)
    np.testing.assert_allclose(loop.mass_centres, 0.5 * (pins[1:] + pins[:-1]), rtol=0, atol=1e-12)


def test_joint_forces_are_those_of_the_multipliers(rig):
    """Accelerations belong to the start of the last step, places to its end: an error of first order, none of sign."""
    small = rig.changed(chain__pitches=5, sensor__pitch=1, gravity=0.0, bushing__stiffness=20.0, bushing__damping=0.05)
    errors, loads = [], np.zeros((3, 10))
    for step in (1e-6, 1e-7):
        loop = spinning_loop(Scene(small, 300.0, ring_radius=None, step=1e-4))
        state, chain = loop.arrays.state, loop.model.chain
        state.rate[:] += closed_rates(chain.length, state.angle, np.random.default_rng(1).normal(0.0, 3.0, 10))
        state.pin[2:] += 0.3, 0.8
        set_model(loop, step=step)
        motion = state.angle.copy(), state.rate.copy()
        expected = reference.reference_accelerations(chain, *motion, *loads, implicit_step=0.5 * step).pin_force
        loop.step()
        errors.append(np.abs(loop.joint_forces - expected).max() / np.abs(expected).max())
        np.testing.assert_allclose(np.hypot(*expected[-1]), loop.tension, rtol=1e-8)
    assert errors[1] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.02)


def test_a_recording_is_that_of_the_time_loop(loop):
    other = loop.copy()
    recording = loop.record(0.1, pitches=(3, 7), frame_interval=0.02)
    record = next_samples(other, 100, (3, 7), frame_stride=20, log_rows=1000)
    assert_same(loop, other)
    for name in (*SAMPLED, "frame"):
        np.testing.assert_array_equal(getattr(recording, name), getattr(record, name))
    np.testing.assert_array_equal(recording.contact_log, record.contact_log.rows[: record.contact_log.count[0]])
    assert recording.begin == 1.0 and list(recording.pitches) == [3, 7]


def test_a_record_goes_with_its_last_reference(loop):
    """The collector of cycles counts objects, not bytes: in a cycle, records of many runs would pile up."""
    gc.collect()
    gc.disable()
    try:
        record = recorder.Recorder(loop, loop.scene.with_(duration=0.05, every_link=True))
        while not record.finished:
            record.chunk()
        reference = weakref.ref(record)
        del record
        assert reference() is None
    finally:
        gc.enable()


def test_simulate_is_a_loop_that_waits_and_records(make_scene):
    scene = make_scene(150.0, frame_interval=0.1)
    expected = simulate(scene)
    loop = Loop(scene)
    loop.lead_in()
    recording = loop.record(scene.duration, frame_interval=0.1)
    assert_same_arrays(recording, expected)
    # a run shorter than a turn of the loop is tried with a finer step, a piece of a run is not
    assert recording.resolution.share == expected.resolution.share
    assert recording.meta | {"resolved": None} == expected.meta | {"resolved": None}


def test_the_sprocket_follows_its_ramps_exactly(loop):
    per_rpm = -np.pi / 30 / loop.scene.rig.sprocket.transmission_ratio
    for start, end, ramp in ((115.0, 210.0, 0.05), (210.0, 90.0, 0.02), (90.0, 0.0, 0.03)):
        begin = loop.time
        loop.drive(end, ramp)
        assert loop.scene.motor_rpm == end
        while loop.time < begin + 1.4 * ramp:
            loop.step(7)
            x = min((loop.time - begin) / ramp, 1.0)
            expected = per_rpm * (start + x * x * (3 - 2 * x) * (end - start))
            assert loop.state.wheel_rate[0] == pytest.approx(expected, rel=1e-12, abs=1e-14)
    assert loop.state.wheel_rate[0] == 0.0


def test_a_longer_way_around_the_wheels_tightens_the_chain(make_scene, rig):
    start, tensions = Loop(make_scene(0.0)), []
    shifts = start.layout.tensioner_shift_m + np.array([-1e-3, 0.0, 1e-3])
    for shift in sorted(shifts, key=lambda shift: belt_around(rig, shift)[0].length):
        loop = start.copy()
        loop.shift_tensioner(shift)
        loop.advance(0.5)
        tensions.append(loop.tension)
    assert (np.diff(tensions) > 50.0).all()
    assert tensions[1] == pytest.approx(rig.tension.pre_tension, rel=0.05)


def test_a_tensioner_on_its_spring_is_not_shifted_and_stays_where_it_hangs(make_scene):
    """Also when the loop goes on with something changed: the spring keeps its preload."""
    loop = Loop(make_scene(0.0, tension="sprung"))
    refused(loop.shift_tensioner, 0.0, words=["the tensioner slides on its spring; use tension='locked'"])
    finer = loop.changed(step=5e-5)
    for each in (loop, finer):
        before = np.array(each.model.wheels[1:3])
        each.advance(0.05)
        np.testing.assert_allclose(each.model.wheels[1:3], before, rtol=0, atol=1e-5)
    assert finer.tension == pytest.approx(loop.tension, rel=1e-3)


def test_scenes_of_one_method_share_their_kernels(make_scene, rig):
    """Other types would compile the whole time loop once more: for a law, a tensioner, or the settling."""
    soft = rig.wheel_contact.model_dump() | {"youngs_modulus": 2e7}
    changed = {"rig": rig.changed(surfaces={"soft": soft}, idler__surface="soft")}
    kinds = set()
    for fields in ({}, {"ring_radius": None}, {"drag": "coulomb"}, LAWS, {"tension": "sprung"}, changed):
        scene = make_scene(0.0, **fields)
        for made in (TensionedLoop(scene), Loop(scene).arrays):
            kinds.add(tuple(numba.typeof(leaf) for leaf in (made.model, made.state, made.work)))
    assert len(kinds) == 1


def test_a_changed_loop_goes_on_in_the_same_state_and_ramp(loop):
    loop.drive(180.0, 0.05)
    loop.advance(0.02)
    finer = loop.changed(step=5e-5)
    assert finer.time == loop.time and finer.scene.step == 5e-5 and finer.model.stride == 20
    np.testing.assert_equal(flatten(finer.state) | {"steps": 0}, flatten(loop.state) | {"steps": 0})
    finer.advance(0.02)
    loop.advance(0.02)
    # two paths of order 1, a fiftieth of a second long
    assert 0 < np.abs(finer.state.angle - loop.state.angle).max() < 1e-4
    assert finer.state.wheel_rate[0] == pytest.approx(loop.state.wheel_rate[0], rel=1e-9)
    assert_same(loop.changed(), loop)
    loop.advance(0.02)
    faster = loop.changed(motor_rpm=210.0, ramp=0.05)
    faster.step()
    assert faster.state.wheel_rate[0] == pytest.approx(loop.state.wheel_rate[0], rel=1e-4)  # from the present speed on
    faster.advance(0.06)
    assert faster.state.wheel_rate[0] == pytest.approx(-210 * np.pi / 30 / loop.scene.rig.sprocket.transmission_ratio)


def test_a_change_that_a_state_does_not_fit_is_refused(loop):
    refused(loop.changed, words=["ring_radius = 0.303: cannot change in a loop"], ring_radius=0.303)
    refused(loop.changed, words=["chain = 'single_pin': cannot change in a loop"], chain="single_pin")
    for fields in ({"space": "spatial"}, {"tension": "sprung"}):
        refused(loop.changed, words=["a loop keeps bodies and joints"], **fields)
    refused(loop.changed, words=["step = 3e-05:"], step=3e-5)


@pytest.mark.parametrize(
    "fields", [{}, {"space": "spatial", **LAWS}, {"chain": "single_pin"}, {"tension": "sprung"}], ids=str
)
def test_a_pickled_loop_goes_on_bit_for_bit(make_scene, fields):
    loop = Loop(make_scene(**fields))
    loop.drive(150.0, 0.1)
    if not fields:
        loop.shift_tensioner(loop.layout.tensioner_shift_m + 1e-4)
    loop.advance(0.03)
    loaded, same = pickle.loads(pickle.dumps(loop)), loop.changed()
    np.testing.assert_equal(flatten(same.model), flatten(loop.model))  # with the position of a tensioner's wheel
    assert loaded.scene == loop.scene and loaded.layout.known() == loop.layout.known() and loaded.time == loop.time
    recording, expected = (each.record(0.1, frame_interval=0.05) for each in (loaded, loop))
    assert_same_arrays(recording, expected)
    assert recording.meta == expected.meta
    assert_same(loaded, loop)

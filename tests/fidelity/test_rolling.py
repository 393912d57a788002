"""Rolling resistance in proportion to the load of a wheel: closed forms, and the energy balance of every method."""

import numpy as np
import pytest

from tests.conftest import LAWS, RIG, refused, written
from tests.rigs.conftest import SPROCKET_RPM, scene_of
from trackdyn import Loop, Scene, load_rig
from trackdyn.chain.kinematics import SLOW, bearing_drag
from trackdyn.integrate.semi_implicit import advance
from trackdyn.model.arrays import BEARING
from trackdyn.model.constants import SPROCKET

ARM, IDLER = 0.01, 1


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """Sprocket and idler without weight; on a ring that grips, other losses change with the tension by some percent."""
    text = f"""
like: {RIG}
chain: {{source: tests, pitches: 26}}
wheels:
  source: tests
  idler: {{x: -1.05 m, y: 0.0 m, radius: 0.28 m, inertia: 3.0 kg m2, rolling_arm: {ARM} m}}
tension: {{source: tests, wheel: idler, direction: 180.0 deg, travel: 0.1 m, pre_tension: 5000.0 N}}
"""
    path = written(tmp_path_factory.mktemp("rolling") / "bench.yaml", text)
    return load_rig(path).changed(gravity=0.0, bushing__stiffness=1.0)


def test_drag_of_a_load_is_odd_bounded_and_steepest_at_rest(bench):
    wheels, carried = Loop(scene_of(bench, **LAWS)).model.wheels, np.array([0.0, 5000.0])
    rates = np.linspace(-3.0, 3.0, 301)
    torque = np.array([rate * bearing_drag(wheels, IDLER, rate, carried) for rate in rates])
    np.testing.assert_allclose(torque, -torque[::-1], rtol=0, atol=1e-12 * torque.max())
    np.testing.assert_allclose(torque, ARM * carried[IDLER] * np.tanh(rates / SLOW), rtol=1e-9, atol=1e-9)
    assert bearing_drag(wheels, IDLER, 0.0, carried) == pytest.approx(ARM * carried[IDLER] / SLOW)
    assert bearing_drag(wheels, SPROCKET, 1.0, carried) == 0.0


def test_a_wheel_rolled_by_hand_slows_down_as_its_closed_form(bench):
    """``J w' = -a N tanh(w / s)``: ``sinh(w / s)`` decays exponentially, far from rest w falls by ``a N t / J``."""
    model, state, work, _ = Loop(scene_of(bench, **LAWS)).arrays
    for array in (*work.sweep, state.rate, work.wheel_torque):
        array[...] = 0.0
    load, inertia, first = 6000.0, model.wheels.inertia[IDLER], 2.0
    work.carried[IDLER], state.wheel_rate[IDLER] = load, first
    slowing, rates = ARM * load / inertia, []
    count = round((first + 16 * SLOW) / slowing / model.step)  # to exp(-16) of the rate below which it dies away
    for _ in range(count):
        advance(model, state, work, None)
        rates.append(state.wheel_rate[IDLER])
    time, rates = model.step * np.arange(1, count + 1), np.array(rates)
    expected = SLOW * np.arcsinh(np.sinh(first / SLOW) * np.exp(-slowing / SLOW * time))
    # the secant at a rate w misses d^2 / w of the change d of a step, which adds up to d ln(w_0 / w) until tanh fades
    np.testing.assert_allclose(rates, expected, rtol=0, atol=slowing * model.step * np.log(first / SLOW))
    early = time < 0.8 * first / slowing
    np.testing.assert_allclose(rates[early], first - slowing * time[early], rtol=0, atol=2e-3 * first)
    assert 0.0 <= rates[-1] < 1e-3 * SLOW
    # the work of the bearing is the energy that the wheel loses
    assert state.work_done[BEARING] == pytest.approx(0.5 * inertia * (first**2 - rates[-1] ** 2), rel=1e-9)


def tensions(rig, **fields):
    """Return mean tensions of both strands (N), load (N) and rate (rad/s) of the idler over six pitches."""
    loop, rows = Loop(scene_of(rig, **LAWS, **fields)), []
    loop.advance(1.5)
    for _ in range(round(6 * loop.scene.periods.passage / loop.model.step / 5)):
        loop.step(5)
        force, ends = np.hypot(*loop.joint_forces.T), loop.pins[1:]
        middle = np.abs(ends[:, 0] - loop.model.wheels.x[IDLER] / 2) < 0.12
        upper, lower = (force[middle & side].mean() for side in (ends[:, 1] > 0, ends[:, 1] < 0))
        rows.append((upper, lower, loop.work.carried[IDLER], abs(loop.state.wheel_rate[IDLER])))
    return np.mean(rows, axis=0)


def test_a_belt_over_a_wheel_pulls_harder_by_the_arm_times_the_load_over_the_radius(bench):
    """At constant speed ``(T_1 - T_2) v = a N w``: the lever arm adds this to the difference by friction."""
    upper, lower, load, rate = tensions(bench)
    without = tensions(bench.changed(idler__rolling_arm=1e-9))
    added = (upper - lower) - (without[0] - without[1])
    assert added > 400.0
    # strands swing by some newtons between the pitches of the mean, and other losses change with T
    speed = SPROCKET_RPM / 60 * bench.sprocket.teeth * bench.pitch
    assert added == pytest.approx(ARM * load * rate / speed, rel=0.01)
    # the radius of the middle of the links, of a polygon around the wheel
    radius = bench.wheels["idler"].radius + bench.chain.link_thickness / 2
    assert added == pytest.approx(ARM * load / radius, rel=0.02)


def test_a_wheel_with_a_bearing_drag_alone_is_not_left_without_any(rig):
    bare = rig.changed(idler__rolling_arm=0.0, idler__seal_drag=0.0, idler__bearing_drag=10.0)
    refused(Scene, bare, 30.0, drag="rolling", match=r"drag = 'rolling': wheel idler .*rolling_arm.*'viscous'")
    assert Scene(bare, 30.0, drag="viscous").model.wheels.drag[IDLER] == 10.0
    lossless = bare.changed(idler__bearing_drag=0.0, idler__bearing_torque=0.0)
    assert not Scene(lossless, 30.0, drag="rolling").model.wheels.rolling[IDLER]
    refused(rig.changed, idler__rolling_arm=-0.001, match=r"idler\.rolling_arm")

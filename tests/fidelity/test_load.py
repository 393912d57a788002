"""A load, the pull of the chain on a braked wheel, and rolling resistance in proportion to the load of a wheel."""

from math import pi

import numpy as np
import pytest

from tests.conftest import BELT, LAWS, RIG, SHORT, refused, written
from tests.rigs.conftest import SPROCKET_RPM, scene_of
from trackdyn import Loop, Scene, load_recording, load_rig, simulate
from trackdyn.chain.kinematics import SLOW, bearing_drag
from trackdyn.integrate.semi_implicit import advance
from trackdyn.model.arrays import BEARING
from trackdyn.model.constants import SPROCKET
from trackdyn.rig.layout import body_lengths, braked_wheel, wheel_names
from trackdyn.rig.rig_file import shipped_rigs
from trackdyn.simulation.brake import slip
from trackdyn.simulation.energy_balance import energy_residual
from trackdyn.simulation.loop_arrays import flatten

IDLER, LOAD, ARM = 1, 2000.0, 0.01


@pytest.fixture(scope="module")
def bench():
    """Sprocket and idler without weight, whose bearings and bushings take next to nothing."""
    return load_rig("bench").changed(gravity=0.0, bushing__stiffness=1.0, idler__rolling_arm=1e-9, idler__seal_drag=0.0)


@pytest.fixture(scope="module")
def rolling(tmp_path_factory):
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


@pytest.mark.parametrize("chain", ["double_pin", "single_pin"])
def test_the_lever_is_that_of_a_polygon_of_pins(bench, chain):
    """By definition as many pitches as teeth fill a turn of a wheel of the equal-pitch radius."""
    even = bench.changed(idler__radius=bench.sprocket.equal_pitch_radius, chain__pitches=26, idler__x=-1.05)
    pitch = body_lengths(even, chain).sum() / even.chain.pitches
    wheel, lever = braked_wheel(even, chain)
    assert (wheel, lever) == (IDLER, pytest.approx(even.sprocket.teeth * pitch / (2 * pi), rel=1e-9))


def test_the_wheel_that_the_chain_wraps_most_is_braked():
    """In clockwise order the paper's chain comes from its road wheel, half around it, to the idler, by 33 degrees."""
    for name in shipped_rigs():
        braked = wheel_names(load_rig(name))[braked_wheel(load_rig(name))[0]]
        assert braked == ("road_wheel" if name in ("paper", "parts") else "idler"), name


@pytest.mark.parametrize("kept", ["locked", "sprung"])
def test_the_tensions_on_both_sides_differ_by_the_load(bench, kept):
    """Within 1 %: strands swing by some newtons, links are up to 0.3 % of the lever deep in the rubber."""
    upper, lower = np.subtract(*(tensions(bench.changed(tension__kept=kept), load=load)[:2] for load in (LOAD, 0.0)))
    if kept == "locked":
        assert upper - lower == pytest.approx(LOAD, rel=0.01)
    else:  # a spring keeps their sum, but for some tenths of a millimetre
        assert (upper, lower) == pytest.approx((LOAD / 2, -LOAD / 2), abs=0.03 * LOAD)


def test_the_motor_gives_the_load_times_the_speed_of_the_chain(bench):
    """Load times speed within 3 %, for slip and the rubber of the ring; the energy balance closes to a thousandth."""
    powers = []
    for load in (0.0, LOAD):
        recording = simulate(Scene(bench, 115.0, load=load, duration=3.0, lead_in=1.0))
        assert abs(energy_residual(recording)) < 1e-3 or not load
        change, seconds = recording.energy[-1] - recording.energy[0], recording.time[-1] - recording.time[0]
        powers.append(change / seconds)
    scene = recording.scene
    added, speed = powers[1] - powers[0], bench.pitch / scene.periods.passage
    # the brake, by the rate of its wheel: samples show the rate at their ends
    braked = LOAD * scene.braked_wheel[1] * np.abs(recording.wheel_rate[:, IDLER]).mean()
    slips = slip(scene, recording.wheel_rate)
    assert added[BEARING] == pytest.approx(braked, rel=2e-3)
    assert braked == pytest.approx(LOAD * speed * (1.0 - slips), rel=1e-9) and abs(slips) < 0.02
    assert added[0] == pytest.approx(LOAD * speed, rel=0.03)
    assert added[0] == pytest.approx(braked + added[1:].sum() - added[BEARING], rel=2e-3)
    assert added[0] > braked  # friction and rubber take more under load


@pytest.mark.parametrize("method", [
    {"integrator": "linearly_implicit"}, {"integrator": "rk4"}, {"space": "spatial"}, {"tension": "sprung"},
], ids=str)  # fmt: skip
def test_every_method_brakes(bench, method):
    """The brake takes its torque times the turn of its wheel, but for a tenth of a radian in which it comes up."""
    loop = Loop(scene_of(bench, load=LOAD, **LAWS | method))
    torque, before, angle = LOAD * loop.scene.braked_wheel[1], [*loop.energy.values()], loop.state.wheel_angle[IDLER]
    loop.advance(loop.scene.ramp + 1.0)
    change = np.subtract([*loop.energy.values()], before)
    turned = abs(loop.state.wheel_angle[IDLER] - angle)
    assert turned > 2.0 and 0.0 < torque * turned - change[BEARING] < 0.1 * torque
    assert change[0] == pytest.approx(change[1:].sum(), rel=3e-3)


def test_no_load_changes_no_byte(bench):
    """A load of 0 is none, also where the rig has one; the loop settles before the load acts."""
    cases = (bench, {}), (bench, {"load": 0.0}), (bench.changed(load=LOAD), {"load": 0.0}), (bench, {"load": LOAD})
    loops = [Loop(scene_of(of_rig, **LAWS, **fields)) for of_rig, fields in cases]

    def states():
        return [[leaf.tobytes() for leaf in flatten(loop.state).values()] for loop in loops]

    first, *others = states()
    assert others == [first] * 3  # at rest
    for loop in loops:
        loop.advance(0.4)
    first, second, third, loaded = states()
    assert first == second == third != loaded
    # a loop that runs may be given a load, and be freed of it
    changed = loops[0].changed(load=LOAD)
    for loop in (loops[3], changed):
        assert loop.model.wheels.torque[IDLER] == LOAD * loop.scene.braked_wheel[1]
    assert changed.changed(load=0.0).model.wheels.torque[IDLER] == 0.0


@pytest.mark.parametrize(("text", "expected"), {
    "1500 N": 1500.0, "1.5 kN": 1500.0, "1.5kN": 1500.0, "1.5e3N": 1500.0, "5 km": "unit 'km'", "-1 kN": "-1000",
    "1500": "has no unit", "much": "a number in N",
}.items())  # fmt: skip
def test_a_load_may_be_text_in_a_rig_file(tmp_path, text, expected):
    path = written(tmp_path / "pulling.yaml", f"like: bench\nload: {text}\n")
    if isinstance(expected, str):
        refused(load_rig, path, words=[str(path), "load", expected])
    else:
        assert load_rig(path).load == expected


def test_a_rig_has_a_load_that_a_scene_takes_and_a_recording_keeps(tmp_path):
    pulling = load_rig("bench").changed(load=1500.0)
    scene = Scene(pulling, 115.0, **SHORT)
    assert (pulling.load, pulling.value("load"), scene.load) == (1500.0, 1500.0, 1500.0)
    assert (scene.with_(load=0.0).load, scene.with_(motor_rpm=60.0).load) == (0.0, 1500.0)
    assert "load of 1500 N" in scene.summary and "load" not in scene.with_(load=0.0).summary
    simulate(scene).save(tmp_path / "run.npz")
    loaded = load_recording(tmp_path / "run.npz")
    assert loaded.scene.load == 1500.0 and "load of 1500 N" in loaded.origin


def test_a_load_where_nothing_brakes_or_that_friction_does_not_carry_is_refused(bench):
    refused(Scene, bench, 5.0, load=LOAD, start="scene: load = 2000.0: its brake fades", words=["idler", "rev/min"])
    assert Scene(bench, 0.0, load=LOAD).load == LOAD  # at rest, to be driven later
    refused(Scene, bench, 115.0, load=LOAD, **BELT, start="scene: load = 2000.0: a belt is a path without forces")
    # belt friction of 0.5 half around carries 2 T tanh(0.5 pi / 2), 6.6 kN at T = 5 kN, which may rise by half
    bench = load_rig("bench")
    held, sliding = (Scene(bench, 115.0, load=load, lead_in=0.5, duration=0.5) for load in (5e3, 1.2e4))
    words = ["friction holds", "the chain slides over the idler", "tension.pre_tension", "wheel_contact"]
    refused(simulate, sliding, start="scene: load = 12000 N: ", words=words)
    assert simulate(held).scene.load == 5e3


def test_drag_of_a_load_is_odd_bounded_and_steepest_at_rest(rolling):
    wheels, carried = Loop(scene_of(rolling, **LAWS)).model.wheels, np.array([0.0, 5000.0])
    rates = np.linspace(-3.0, 3.0, 301)
    torque = np.array([rate * bearing_drag(wheels, IDLER, rate, carried) for rate in rates])
    np.testing.assert_allclose(torque, -torque[::-1], rtol=0, atol=1e-12 * torque.max())
    np.testing.assert_allclose(torque, ARM * carried[IDLER] * np.tanh(rates / SLOW), rtol=1e-9, atol=1e-9)
    assert bearing_drag(wheels, IDLER, 0.0, carried) == pytest.approx(ARM * carried[IDLER] / SLOW)
    assert bearing_drag(wheels, SPROCKET, 1.0, carried) == 0.0


def test_a_wheel_rolled_by_hand_slows_down_as_its_closed_form(rolling):
    """``J w' = -a N tanh(w / s)``: ``sinh(w / s)`` decays exponentially, far from rest w falls by ``a N t / J``."""
    model, state, work, _ = Loop(scene_of(rolling, **LAWS)).arrays
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


def test_a_belt_over_a_wheel_pulls_harder_by_the_arm_times_the_load_over_the_radius(rolling):
    """At constant speed ``(T_1 - T_2) v = a N w``: the lever arm adds this to the difference by friction."""
    upper, lower, load, rate = tensions(rolling)
    without = tensions(rolling.changed(idler__rolling_arm=1e-9))
    added = (upper - lower) - (without[0] - without[1])
    assert added > 400.0
    # strands swing by some newtons between the pitches of the mean, and other losses change with T
    speed = SPROCKET_RPM / 60 * rolling.sprocket.teeth * rolling.pitch
    assert added == pytest.approx(ARM * load * rate / speed, rel=0.01)
    # the radius of the middle of the links, of a polygon around the wheel
    radius = rolling.wheels["idler"].radius + rolling.chain.link_thickness / 2
    assert added == pytest.approx(ARM * load / radius, rel=0.02)


def test_a_wheel_with_a_bearing_drag_alone_is_not_left_without_any(rig):
    bare = rig.changed(idler__rolling_arm=0.0, idler__seal_drag=0.0, idler__bearing_drag=10.0)
    refused(Scene, bare, 30.0, drag="rolling", match=r"drag = 'rolling': wheel idler .*rolling_arm.*'viscous'")
    assert Scene(bare, 30.0, drag="viscous").model.wheels.drag[IDLER] == 10.0
    lossless = bare.changed(idler__bearing_drag=0.0, idler__bearing_torque=0.0)
    assert not Scene(lossless, 30.0, drag="rolling").model.wheels.rolling[IDLER]
    refused(rig.changed, idler__rolling_arm=-0.001, match=r"idler\.rolling_arm")

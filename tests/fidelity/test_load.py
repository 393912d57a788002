"""A load, the pull of the chain on a braked wheel: tensions, balance of power, refusals."""

from math import pi

import numpy as np
import pytest

from tests.conftest import BELT, LAWS, SHORT, refused, written
from tests.fidelity.test_rolling import tensions
from tests.rigs.conftest import scene_of
from trackdyn import Loop, Scene, load_recording, load_rig, simulate
from trackdyn.model.arrays import BEARING
from trackdyn.rig.layout import body_lengths, braked_wheel, wheel_names
from trackdyn.rig.rig_file import shipped_rigs
from trackdyn.simulation.brake import slip
from trackdyn.simulation.energy_balance import energy_residual
from trackdyn.simulation.loop_arrays import flatten

IDLER, LOAD = 1, 2000.0


@pytest.fixture(scope="module")
def bench():
    """Sprocket and idler without weight, whose bearings and bushings take next to nothing."""
    return load_rig("bench").changed(gravity=0.0, bushing__stiffness=1.0, idler__rolling_arm=1e-9, idler__seal_drag=0.0)


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

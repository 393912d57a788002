"""Motors, release, and wheels on springs: closed forms of each, and one run with all of them."""

from math import pi

import numpy as np
import pytest

from tests.rigs.conftest import scene_of
from trackdyn.errors import InputError
from trackdyn.integrate.carriers import advance_carriers
from trackdyn.integrate.run import common_arrays
from trackdyn.integrate.semi_implicit import driven_rate
from trackdyn.model.arrays import SPROCKET_WORK
from trackdyn.model.constants import NO_MOTOR, SPROCKET, Drive, Motor
from trackdyn.rig.rig import load_rig
from trackdyn.simulation.energy_balance import open_share
from trackdyn.simulation.loop import Loop

STEP = 1e-4


def turned(drive, torque, seconds):
    rate = 0.0
    rates = []
    for k in range(round(seconds / STEP)):
        rate = driven_rate(drive, rate, torque, (k + 1) * STEP, STEP, drive.motor)
        rates.append(rate)
    return np.array(rates)


def test_a_motor_runs_up_along_its_line():
    """``J w' = k (w_0 - w) + M``: an exponential to ``w_0 + M / k``."""
    inertia, slope, load, no_load_rate = 2.0, 8.0, 4.0, -10.0
    drive = Drive(no_load_rate, 1e-9, motor=Motor(inertia, slope, 1e9, np.inf, 0))
    speed, time = turned(drive, load, 1.0), STEP * np.arange(1, 10001)
    expected = (no_load_rate + load / slope) * (1 - np.exp(-slope / inertia * time))
    # a method of order 1: half a step of the steepest slope
    assert np.abs(speed - expected).max() < STEP * abs(no_load_rate) * slope / inertia


def test_a_motor_gives_no_more_than_its_torque():
    drive = Drive(-10.0, 1e-9, motor=Motor(2.0, 8.0, 5.0, np.inf, 0))
    assert turned(drive, 0.0, 0.5)[-1] == pytest.approx(-5.0 / 2.0 * 0.5, rel=1e-9)
    assert turned(drive, 5.0, 0.5)[-1] == pytest.approx(0.0, abs=1e-9)


def test_a_released_sprocket_is_on_its_own():
    drive = Drive(-10.0, 1e-9, motor=Motor(2.0, 0.0, 0.0, 0.2, 1))
    rates = turned(drive, 6.0, 0.5)
    assert (rates[: round(0.2 / STEP) - 1] == -10.0).all()
    assert rates[-1] == pytest.approx(-10.0 + 6.0 / 2.0 * 0.3, rel=1e-3)


def test_a_wheel_on_an_arm_swings_as_its_spring_says(settled):
    """Without contacts: ``I q'' = -k q``, its weight held by the preload at rest."""
    loop = settled("m113")
    model, state, work = common_arrays(*loop.arrays)
    work.count[0] = 0
    carriers, k = model.carriers, 2
    arm = loop.scene.rig.wheels["road_3"].arm
    dx, dy = np.array([loop.scene.rig.wheels["road_3"].x - arm.x, loop.scene.rig.wheels["road_3"].y - arm.y])
    weight = arm.mass * loop.scene.rig.gravity
    carriers = carriers._replace(damping=0 * carriers.damping, preload=carriers.weight * carriers.along_y)
    state.slide[:] = 0.0
    state.slide["q"][k] = 1e-3
    crossings, before = [], 1e-3
    for step in range(20_000):
        advance_carriers(model, state, work, carriers)
        if before < 0 <= state.slide["q"][k]:
            crossings.append(step)
        before = state.slide["q"][k]
    period = np.diff(crossings).mean() * model.step
    # the weight's lever arm changes with the turn: a stiffness of its own, -W y of the arm
    stiffness = arm.stiffness - weight * dy
    expected = 2 * pi * np.sqrt(arm.mass * (dx**2 + dy**2) / stiffness)
    assert period == pytest.approx(expected, rel=1e-3)
    assert abs(weight * dy / arm.stiffness) > 2e-3, "else the test says nothing of the weight"
    assert state.slide["rate"][k] != 0.0


def test_all_of_them_in_one_loop_keep_the_account():
    """A sprocket that runs down, a tensioner on a spring, a wheel with a surface of its own, arms."""
    rig = load_rig("robot")
    soft = rig.wheel_contact.model_dump() | {"youngs_modulus": 2e7}
    free = {"kind": "free", "inertia": 0.05, "release": 0.5}
    changed = rig.changed(surfaces={"soft": soft}, front__surface="soft", drive=free, tension__kept="sprung")
    loop = Loop(scene_of(changed, 60.0))
    assert len(set(loop.model.wheels.law.tolist())) == 3 and loop.model.drive.motor != NO_MOTOR
    loop.advance(0.5)
    before, work = loop.wheel_rates[SPROCKET], loop.state.work_done[SPROCKET_WORK]
    recording = loop.record(0.4, contact_log=False)
    after = loop.wheel_rates[SPROCKET]
    released = 0.5 * free["inertia"] * (before**2 - after**2)
    # the chain gets the energy that the sprocket loses; both by quadratures of order 1
    assert loop.state.work_done[SPROCKET_WORK] - work == pytest.approx(released, rel=0.02)
    assert abs(after) < 0.99 * abs(before)
    assert recording.gap.max() < 1.1e-10
    assert abs(open_share(recording.energy, loop.model, 0.4)[0]) < 2e-2


def test_what_springs_and_motors_cannot_be_moved_by_is_refused():
    robot, bench = load_rig("robot"), load_rig("bench")
    with pytest.raises(InputError, match=r"integrator = 'rk4'.*wheel front stands on a spring"):
        scene_of(robot, integrator="rk4", step=1e-5)
    driven = bench.changed(drive={"kind": "motor", "inertia": 5.0, "slope": 500.0, "torque": 2000.0})
    with pytest.raises(InputError, match=r"integrator = 'rk4'.*the rig's drive"):
        scene_of(driven, integrator="rk4", step=1e-5)

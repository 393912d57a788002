"""Wheels on springs: a closed form, and one run with all of them."""

from math import pi

import numpy as np
import pytest

from tests.conftest import refused
from tests.rigs.conftest import scene_of
from trackdyn import Loop, load_rig
from trackdyn.integrate.suspensions import advance_suspensions
from trackdyn.model.arrays import components
from trackdyn.simulation.energy_balance import open_share


def test_a_wheel_on_an_arm_swings_with_the_period_of_its_spring(settled):
    """Without contacts: ``I q'' = -k q``, its weight held by the preload at rest."""
    loop = settled("m113")
    model, state, work, _ = loop.arrays
    work.count[0] = 0
    suspensions, k = model.suspensions, 2
    wheel = loop.scene.rig.wheels["road_3"]
    arm, dx, dy = wheel.arm, wheel.x - wheel.arm.x, wheel.y - wheel.arm.y
    weight, balanced = arm.mass * loop.scene.rig.gravity, suspensions.weight * suspensions.along_y
    suspensions = suspensions._replace(damping=0 * suspensions.damping, preload=balanced)
    state.suspension[:] = 0.0
    state.suspension["q"][k] = 1e-3
    positions = np.empty(20_000)
    for step in range(len(positions)):
        advance_suspensions(model, state, work, suspensions)
        positions[step] = state.suspension["q"][k]
    crossings = np.flatnonzero((positions[:-1] < 0) & (positions[1:] >= 0))
    period = np.diff(crossings).mean() * model.step
    # the weight's lever arm changes with the turn: a stiffness of its own, -W y of the arm
    stiffness = arm.stiffness - weight * dy
    expected = 2 * pi * np.sqrt(arm.mass * (dx**2 + dy**2) / stiffness)
    assert period == pytest.approx(expected, rel=1e-3)
    assert abs(weight * dy / arm.stiffness) > 2e-3, "the weight matters"
    assert state.suspension["rate"][k] != 0.0


@pytest.mark.parametrize("preload", [0.0, 2000.0])
def test_a_slider_settles_where_its_spring_bears_chain_and_wheel(preload):
    slider = {"direction": 90.0, "mass": 20.0, "stiffness": 2e5, "damping": 500.0, "travel": 0.05, "preload": preload}
    loop = Loop(scene_of(load_rig("paper").changed(idler__slider=slider), 0.0))
    contacts = loop.work.contact[: loop.work.count[0]]
    on_links = components(contacts[contacts["wheel"] == 1], "normal").sum(axis=0)[1]
    weight = slider["mass"] * loop.scene.rig.gravity
    spring = preload - slider["stiffness"] * loop.state.suspension["q"][0]
    assert on_links > weight and spring == pytest.approx(on_links + weight, rel=0.01)  # tension is set to so much


def test_all_of_them_in_one_loop_have_a_closed_energy_balance():
    rig, words = load_rig("robot"), ["integrator = 'rk4'", "wheel front is on a spring"]
    refused(scene_of, rig, integrator="rk4", step=1e-5, words=words)
    soft = rig.wheel_contact.model_dump() | {"youngs_modulus": 2e7}
    changed = rig.changed(surfaces={"soft": soft}, front__surface="soft", tension__kept="sprung")
    loop = Loop(scene_of(changed, 60.0))
    assert len(set(loop.model.wheels.law.tolist())) == 3
    loop.advance(0.5)
    recording = loop.record(0.4, contact_log=False)
    assert recording.gap.max() < 1.1e-10
    assert abs(open_share(recording.energy, loop.model, 0.4)[0]) < 2e-2

"""Wheels on springs, and chains that are nearly belts: closed forms, and one run with all suspensions."""

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
    period = np.diff(np.flatnonzero((positions[:-1] < 0) & (positions[1:] >= 0))).mean() * model.step
    # the weight's lever arm changes with the turn: a stiffness of its own, -W y of the arm
    stiffness = arm.stiffness - weight * dy
    assert period == pytest.approx(2 * pi * np.sqrt(arm.mass * (dx**2 + dy**2) / stiffness), rel=1e-3)
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


def test_a_running_loop_has_the_tension_of_a_belt():
    """The spring of the idler holds ``T - m v^2`` of both strands; motion across, a short record leave a twentieth."""
    changes = {"gravity": 0.0, "bushing__stiffness": 0.0, "tension__pre_tension": 8000.0, "tension__kept": "sprung"}
    rig = load_rig("bench").changed(**changes)
    missing = {}
    for rpm in (4.0, 150.0):
        loop = Loop(scene_of(rig, rpm, step=4e-5))
        loop.advance(1.0)
        suspensions, rows = loop.model.suspensions, []
        for _ in range(1000):
            loop.advance(1e-3)
            middle, force = loop.mass_centres, loop.joint_forces
            free = (middle[:, 0] > -0.75) & (middle[:, 0] < -0.3)
            upper, lower = (np.abs(force[free & side, 0]).mean() for side in (middle[:, 1] > 0, middle[:, 1] < 0))
            spring = suspensions.preload[0] - suspensions.stiffness[0] * loop.state.suspension["q"][0]
            rows.append(upper + lower - spring)
        missing[rpm] = np.mean(rows)
    length = loop.model.chain.length.sum()
    speed = 150.0 / 60 * rig.sprocket.teeth * length / rig.chain.pitches
    expected = 2 * loop.model.chain.mass.sum() / length * speed**2
    assert expected > 4000.0
    assert missing[150.0] == pytest.approx(expected, rel=0.05) and abs(missing[4.0]) < 0.02 * expected


def test_a_thousand_pitches_are_laid_settled_and_run():
    rig = load_rig("bench").changed(gravity=0.05, chain__pitches=1000, tension__travel=0.5)
    rig = rig.changed(idler__x=rig.wheels["idler"].x - (1000 - 26) * rig.pitch / 2)
    loop = Loop(scene_of(rig, 20.0))
    loop.advance(0.4)
    assert loop.gap < 1e-9  # rounding of a sum of 157 m
    assert loop.layout.tension_n == pytest.approx(rig.tension.pre_tension, rel=0.1)
    assert abs(loop.state.wheel_rate[0]) > 2.0

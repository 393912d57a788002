"""Limits in which a chain is a belt: the tension of a running one, the sag of one at rest, and a very long one."""

import numpy as np
import pytest

from tests.rigs.conftest import scene_of
from trackdyn import Loop, load_rig


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
    chain = loop.model.chain
    speed = 150.0 / 60 * rig.sprocket.teeth * chain.length.sum() / rig.chain.pitches
    expected = 2 * chain.mass.sum() / chain.length.sum() * speed**2
    assert expected > 4000.0
    assert missing[150.0] == pytest.approx(expected, rel=0.05)
    assert abs(missing[4.0]) < 0.02 * expected


def test_a_thousand_pitches_are_laid_settled_and_run():
    rig = load_rig("bench").changed(gravity=0.05, chain__pitches=1000, tension__travel=0.5)
    pitch = rig.chain.link_length + rig.connector_length
    rig = rig.changed(idler__x=rig.wheels["idler"].x - (1000 - 26) * pitch / 2)
    loop = Loop(scene_of(rig, 20.0))
    loop.advance(0.4)
    assert loop.gap < 1e-9  # rounding of a sum of 157 m
    assert loop.layout.tension_n == pytest.approx(rig.tension.pre_tension, rel=0.1)
    assert abs(loop.state.wheel_rate[0]) > 2.0

"""Limits in which a chain is a belt: the tension of a running one, the sag of one at rest, and a very long one."""

import numpy as np
import pytest

from tests.rigs.conftest import scene_of
from trackdyn.parameters.rig import load_rig
from trackdyn.simulation.loop import Loop


def test_a_running_loop_has_the_tension_of_a_belt():
    """``T - m v^2`` is what a strand bears with: the idler's spring holds that of both, at any speed.

    The flow of momentum through a line around the idler: two strands enter and leave it at ``v``. Tensions are those of
    the joints, ``m v^2`` comes from masses and the sprocket's speed, the force from the spring. A slow motion of the
    strands across and a record of some thirty pitches are left: a twentieth of ``m v^2``.
    """
    rig = load_rig("bench").changed(
        gravity=0.0, bushing__stiffness=0.0, tension__pre_tension=8000.0, tension__kept="sprung"
    )
    missing = {}
    for rpm in (4.0, 150.0):
        loop = Loop(scene_of(rig, rpm, step=4e-5))
        loop.advance(1.0)
        carriers, rows = loop.model.carriers, []
        for _ in range(1000):
            loop.advance(1e-3)
            middle, force = loop.mass_centres, loop.joint_forces
            free = (middle[:, 0] > -0.75) & (middle[:, 0] < -0.3)
            upper, lower = (np.abs(force[free & side, 0]).mean() for side in (middle[:, 1] > 0, middle[:, 1] < 0))
            rows.append(upper + lower - (carriers.preload[0] - carriers.stiffness[0] * loop.state.slide["q"][0]))
        missing[rpm] = np.mean(rows)
    chain = loop.model.chain
    speed = 150.0 / 60 * rig.sprocket.teeth * float(chain.length.sum()) / rig.chain.pitches
    expected = 2 * float(chain.mass.sum() / chain.length.sum()) * speed**2
    assert expected > 4000.0
    assert missing[150.0] == pytest.approx(expected, rel=0.05)
    assert abs(missing[4.0]) < 0.02 * expected


def test_a_strand_at_rest_hangs_as_a_catenary():
    """The longest free strand against ``y = c cosh((x - x0) / c)`` with c the horizontal force over the weight a metre.

    The force is taken from the joints, the shape from the pins: the curve through both ends and the lowest slope. Links
    and connectors differ in weight a metre, which makes the strand's slope step by some weight of a body over the
    force.
    """
    rig = load_rig("bench").changed(
        bushing__stiffness=0.0, tension__pre_tension=2500.0, chain__pitches=34, idler__x=-1.70
    )
    loop = Loop(scene_of(rig, 0.0, duration=0.5))
    loop.step(1)
    loop.energy  # noqa: B018
    work, chain = loop.work, loop.model.chain
    touched = np.unique(work.contact["body"][: work.count[0]])
    pins = loop.pins
    middles = 0.5 * (pins[:-1] + pins[1:])
    free = [
        i for i in range(len(chain.length)) if i not in touched and -1.5 < middles[i, 0] < -0.2 and middles[i, 1] < 0.0
    ]
    low = list(range(free[0], free[-1] + 1))
    assert low == free and len(low) > 10
    strand = slice(low[0] + 1, low[-1] + 1)  # joints within it
    horizontal = loop.joint_forces[low[0] : low[-1], 0]
    pull = abs(horizontal.mean())
    assert np.abs(horizontal - horizontal.mean()).max() < 0.01 * pull, "nothing but weight acts on the strand"
    c = pull / (chain.gravity * chain.mass.sum() / chain.length.sum())
    x, y = pins[strand].T
    # both ends given and c known: one number, where the lowest point is
    from scipy.optimize import brentq

    def rise(x0):
        return c * (np.cosh((x[-1] - x0) / c) - np.cosh((x[0] - x0) / c)) - (y[-1] - y[0])

    x0 = brentq(rise, -3.0, 1.0)
    curve = c * np.cosh((x - x0) / c)
    sag = np.ptp(y)
    assert np.abs(curve - curve[0] - (y - y[0])).max() < 0.02 * sag
    assert sag > 0.02


def test_a_thousand_pitches_are_laid_settled_and_run():
    """The paper's chain on two wheels 78 m apart."""
    rig = load_rig("bench").changed(gravity=0.05, chain__pitches=1000, tension__travel=0.5)
    pitch = rig.chain.link_length + rig.connector_length
    rig = rig.changed(idler__x=rig.idler.x - (1000 - 26) * pitch / 2)
    loop = Loop(scene_of(rig, 20.0))
    loop.advance(0.4)
    assert loop.gap < 1e-9  # rounding of a sum of 157 m
    assert loop.layout["tension_n"] == pytest.approx(rig.tension.pre_tension, rel=0.1)
    assert abs(loop.wheel_rates[0]) > 2.0

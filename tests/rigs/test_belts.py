"""Limits in which a chain is a belt: the tension of a running one, the sag of one at rest, and a very long one."""

import numpy as np
import pytest

from tests.rigs.conftest import scene_of
from trackdyn.loop import Loop
from trackdyn.parameters.rig import load_rig


def mean_tension(loop, seconds):
    found = []
    for _ in range(round(seconds * 1000)):
        loop.advance(1e-3)
        found.append(loop.tension)
    return np.mean(found)


def test_a_running_loop_has_the_tension_of_a_belt():
    """On fixed wheels a belt that does not stretch keeps pressing them alike: ``T - m v^2`` stays what it was.

    Bushings, weight and drag are taken away. The polygon of the chain spreads ``m v^2`` by some ``(pitch / diameter)^2``,
    6 %, and the contacts yield a little: a tenth is allowed.
    """
    rig = load_rig("bench").changed(gravity=0.0, bushing__stiffness=0.0, idler__bearing_drag=0.0, tension__pre_tension=8000.0)
    tension = {}
    for rpm in (4.0, 150.0):
        loop = Loop(scene_of(rig, rpm, step=4e-5))
        loop.advance(1.0)
        tension[rpm] = mean_tension(loop, 1.0)
    chain, teeth = loop.model.chain, rig.sprocket.teeth
    speed = 150.0 / 60 * teeth * float(chain.length.sum()) / rig.chain.pitches
    expected = float(chain.mass.sum() / chain.length.sum()) * speed**2
    assert expected > 1000.0
    assert tension[150.0] - tension[4.0] == pytest.approx(expected, rel=0.1)


def test_a_strand_at_rest_hangs_as_a_catenary():
    """The longest free strand against ``y = c cosh((x - x0) / c)`` with c the horizontal force over the weight a metre.

    The force is taken from the joints, the shape from the pins: the curve through both ends and the lowest slope. Links
    and connectors differ in weight a metre, which makes the strand's slope step by some weight of a body over the force.
    """
    rig = load_rig("bench").changed(bushing__stiffness=0.0, tension__pre_tension=2500.0, chain__pitches=34, idler__x=-1.70)
    loop = Loop(scene_of(rig, 0.0, duration=0.5))
    loop.step(1)
    loop.energy  # noqa: B018
    work, chain = loop.work, loop.model.chain
    touched = np.unique(work.contact_body[: work.count[0], 0])
    pins = loop.pins
    middles = 0.5 * (pins[:-1] + pins[1:])
    low = [i for i in range(len(chain.length)) if i not in touched and middles[i, 1] < -0.2]
    assert low == list(range(low[0], low[-1] + 1)) and len(low) > 10
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

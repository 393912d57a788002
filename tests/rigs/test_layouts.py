"""Random layouts: drawn again from their numbers, laid exactly, settled."""

from itertools import combinations
from math import hypot

import numpy as np
import pytest

from tests.conftest import refused
from tests.layouts import random_rig
from trackdyn.rig.layout import assemble, body_lengths, wheel_circles
from trackdyn.scene.scene import Scene
from trackdyn.scene.step import largest_step
from trackdyn.simulation.settling import settle


@pytest.mark.parametrize("number", range(25))
def test_a_drawn_layout_is_laid_exactly(number):
    """All wheels touch, none overlap, the chain is clockwise, closed, on the path, with a groove under a connector."""
    rig = random_rig(number)
    assert rig == random_rig(number) != random_rig(number + 1)
    lengths = body_lengths(rig, rig.chain.kind)
    laid = assemble(rig, lengths)
    path = laid.path
    assert set(laid.order) == set(range(1 + len(rig.wheels))) and path.wrap.sum() == pytest.approx(2 * np.pi)
    ends = np.vstack([laid.pins, laid.pins[:1]])
    np.testing.assert_allclose(np.hypot(*np.diff(ends, axis=0).T), lengths, rtol=0, atol=1e-10)
    np.testing.assert_allclose(np.array([np.cos(laid.angle), np.sin(laid.angle)]) @ lengths, 0.0, atol=1e-10)
    turns = np.diff(np.append(laid.angle, laid.angle[0] - 2 * np.pi))
    # convex: a straight strand turns by rounding only
    assert turns.sum() == pytest.approx(-2 * np.pi, abs=1e-10) and (turns < 1e-7).all()
    points = path.along(np.linspace(0, path.length, 20001))[0]
    # as fine as the sampling of the path
    assert max(np.hypot(*(points - pin).T).min() for pin in laid.pins) < path.length / 20001
    circles = wheel_circles(rig, laid.shift, surface=True)
    assert np.abs(circles - wheel_circles(rig, surface=True)).max() <= abs(laid.shift) <= rig.tension.travel
    pairs = combinations(circles, 2)
    assert min(hypot(*(one[:2] - other[:2])) - one[2] - other[2] for one, other in pairs) > 0
    if rig.chain.kind != "single_pin":
        middle = 0.5 * (ends[:-1] + ends[1:])[1::2] - circles[0, :2]
        near, pitch = np.hypot(*middle.T) < wheel_circles(rig)[0, 2], 2 * np.pi / rig.sprocket.teeth
        # grooves are half a pitch from the tooth that x_S points to
        offset = np.arctan2(middle[near, 1], middle[near, 0]) - laid.sprocket_angle - pitch / 2
        assert np.abs((offset + pitch / 2) % pitch - pitch / 2).min() < 1e-10


def at_an_allowed_step(rig, fraction=0.75) -> Scene:
    scene = Scene(rig, 100.0, step=1e-6, contact_log=False)
    limit = largest_step(scene.model, 1.3 * rig.tension.pre_tension)
    return scene.with_(step=1.0 / rig.rate / np.ceil(1.0 / rig.rate / (fraction * min(limit, 1.25e-4))))


@pytest.mark.parametrize("number", [137, 710])
def test_slow_and_slack_strands_are_tensioned(number):
    """A strand that evens out in seconds, and a slack one whose compliance once threw the wheel metres away."""
    rig = random_rig(number)
    layout = settle(at_an_allowed_step(rig)).layout
    assert layout.settled_tension_n == pytest.approx(rig.tension.pre_tension, rel=0.01)
    assert abs(layout.tensioner_shift_m) < rig.tension.travel


def test_a_tension_that_the_hanging_chain_exceeds_is_refused():
    scene = at_an_allowed_step(random_rig(122).changed(tension__pre_tension=1100.0), 0.4)
    refused(settle, scene, match=r"pre_tension = 1100 N: must exceed .*; 4\d{3} N of chain hang below")

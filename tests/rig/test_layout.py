"""The belt path around the wheels and the chain laid along it."""

from math import acos, asin, pi, sqrt

import numpy as np
import pytest

from tests.conftest import refused
from trackdyn.rig.layout import _lay, assemble, belt_around, belt_path, wheel_circles

TRIANGLE = [(0, 0, 0.3), (2 * 0.5, sqrt(3), 0.3), (2, 0, 0.3)]  # clockwise, sides 2
UNEQUAL = [(0.0, 0.0, 0.31), (1.1, 0.15, 0.25), (1.7, -0.4, 0.28)]


def test_two_unequal_circles():
    big, small, distance = 0.4, 0.1, 1.5
    path = belt_path([(0, 0, big), (distance, 0, small)])
    phi = acos((big - small) / distance)
    # the smaller circle is wrapped by 2 phi, the larger one by the rest
    length = 2 * sqrt(distance**2 - (big - small) ** 2) + 2 * phi * small + (2 * pi - 2 * phi) * big
    assert path.length == pytest.approx(length, abs=1e-14)


@pytest.mark.parametrize("circles", [TRIANGLE, UNEQUAL, "rig"])
def test_wraps_are_one_turn_and_the_path_is_smooth_and_touches_each_circle(rig, circles):
    circles = wheel_circles(rig)[belt_around(rig)[1]] if circles == "rig" else circles
    path = belt_path(circles)
    assert path.wrap.sum() == pytest.approx(2 * pi, abs=1e-12)
    points = path.along(np.linspace(0, path.length, 2001))[0]
    for x, y, r in circles:
        assert np.hypot(points[:, 0] - x, points[:, 1] - y).min() == pytest.approx(r, abs=1e-12)
    step = 1e-7
    s = np.concatenate([path.start[:-1], np.linspace(0.01, path.length, 37)])
    before, (_, heading, curvature), after = (path.along(s + shift) for shift in (-step, 0.0, step))
    bend, step_vector = (after[1] - before[1] + pi) % (2 * pi) - pi, after[0] - before[0]
    # position and heading change by the step only, also where arcs end
    np.testing.assert_allclose(np.hypot(*step_vector.T), 2 * step, rtol=1e-6)
    assert (np.abs(bend) <= 2 * step / 0.25 + 1e-12).all()
    # differences of positions of 1 m over 2e-7 m carry 1e-9
    assert np.abs((np.arctan2(step_vector[:, 1], step_vector[:, 0]) - heading + pi) % (2 * pi) - pi).max() < 1e-6
    inside = np.abs(s[:, None] - path.start).min(axis=1) > 2 * step
    np.testing.assert_allclose(-bend[inside] / (2 * step), curvature[inside], rtol=0, atol=1e-6)


def test_wheels_that_no_belt_runs_around_are_refused():
    names, words = ["sprocket", "idler", "road_wheel"], ["sprocket and idler are 0.15 m apart"]
    refused(belt_path, [(0, 0, 0.3), (0.15, 0, 0.1), (2, -1, 0.3)], names, words=words)
    # counter-clockwise order: the belt would have to bend the other way
    refused(belt_path, TRIANGLE[::-1], words=["clockwise order"])


def test_links_on_the_sprocket_circle_touch_its_ring_at_their_middle(rig):
    """wheel_circles gives the circle of pins; the middle of a link is then at radius + D/2."""
    circles, surface = wheel_circles(rig), wheel_circles(rig, surface=True)
    half_link = rig.chain.link_length / 2
    middle = np.sqrt(circles[:, 2] ** 2 - half_link**2)
    np.testing.assert_allclose(middle, surface[:, 2] + rig.chain.link_thickness / 2, atol=1e-15)
    assert asin(half_link / circles[0, 2]) < pi / rig.sprocket.teeth


@pytest.mark.parametrize("body", [pi + 4.0, 2 * (pi + 4.0)])
def test_a_body_that_lies_straight_across_or_closes_on_itself_is_refused(body):
    """The derivatives by which a chain is laid vanish there, or there are none."""
    path = belt_path([[0.0, 0.0, 1.0], [-4.0, 0.0, 1.0]])
    refused(_lay, path, np.full(4, body), match="cannot be laid around these wheels")


@pytest.mark.parametrize(("pitches", "state"), [(32, "short"), (37, "long")])
def test_loop_of_the_wrong_length_is_refused(rig, pitches, state):
    words = [f"loop of {pitches} pitches ", f" m too {state} ", f"tension.travel = {rig.tension.travel:g} m"]
    words.append(f"one pitch is {1e3 * rig.pitch:.4g} mm, unless chain.pitch states another")
    refused(assemble, rig.changed(chain__pitches=pitches), words=words)

"""Random layouts, drawn around the sprocket of a rig: again from their numbers, laid exactly, settled."""

from itertools import combinations
from math import degrees, hypot, pi

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.conftest import RIG, refused
from trackdyn import InputError, Rig, Scene, load_rig
from trackdyn.rig.layout import assemble, belt_path, body_lengths, run_order, wheel_circles
from trackdyn.scene.step import largest_step
from trackdyn.simulation.settling import settle

SEED = 20261122
CHAINS = (str(RIG.with_name("stiff.yaml")), "m113", "robot")  # none moves with the default rig
WHEELS, PITCHES = (2, 9), (20, 120)
ATTEMPTS = 400  # draws of wheels for one layout; most sets of nine do not fit into a short loop
GAP = 1.05  # of two wheels, in sums of their radii


def pin_radius(base: Rig, radius) -> np.ndarray:
    body = base.pitch if base.chain.kind == "single_pin" else base.chain.link_length
    return np.hypot(np.asarray(radius) + base.chain.link_thickness / 2, body / 2)


def drawn_wheels(rng: np.random.Generator, base: Rig, pitches: int, count: int) -> np.ndarray | None:
    """Places and radii (count, 3) of wheels around which a number of pitches fits, m; None if these do not."""
    size = base.sprocket.ring_radius
    radius = np.append(size, rng.uniform(0.45, 1.0, count - 1) * size)
    turn = 2 * pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
    flat, tilt = rng.uniform(0.15, 1.0), rng.uniform(0, 2 * pi)
    shape = (np.cos(turn) + 1j * flat * np.sin(turn)) * np.exp(1j * tilt)
    shape = np.column_stack([shape.real, shape.imag]) - [shape[0].real, shape[0].imag]
    pins = pin_radius(base, radius)

    def excess(scale):
        laid = np.column_stack([scale * shape, pins])
        return belt_path(laid[run_order(laid)]).length - pitches * base.pitch

    least = max(
        GAP * (radius[i] + radius[k] + (0.1 * size if i == 0 else 0.0)) / hypot(*(shape[i] - shape[k]))
        for i, k in combinations(range(count), 2)
    )
    try:
        if excess(least) >= 0:
            return None
        scale = brentq(excess, least, least + pitches * base.pitch / np.ptp(shape, axis=0).max(), xtol=1e-9)
    except (InputError, ValueError):
        return None
    order = run_order(np.column_stack([scale * shape, pins]))
    complete = order[0] == 0 and set(order) == set(range(count))
    return np.column_stack([scale * shape, radius]) if complete else None


def random_rig(number: int) -> Rig:
    rng = np.random.default_rng([SEED, number])
    base = load_rig(str(rng.choice(CHAINS)))
    pitches = int(round(np.exp(rng.uniform(*np.log(PITCHES)))))
    drawn = (drawn_wheels(rng, base, pitches, rng.integers(*WHEELS, endpoint=True)) for _ in range(ATTEMPTS))
    placed = next(wheels for wheels in drawn if wheels is not None)  # of two wheels some always fit
    circles = np.column_stack([placed[:, :2], pin_radius(base, placed[:, 2])])
    order = run_order(circles)
    path, c = belt_path(circles[order]), base.chain
    weight = base.gravity * (c.link_mass + c.connector_mass) / base.pitch
    span = np.diff(path.start)[1::2].max()
    # the weight below the tensioned strand, and more, so that the lowest one is taut
    low = (circles[:, 1] - circles[:, 2]).min()
    hanging = weight * (path.along([0.5 * (path.start[-2] + path.length)])[0][0, 1] - low)
    tension = max(base.tension.pre_tension * rng.uniform(0.5, 1.5), hanging + weight * span * rng.uniform(1.0, 3.0))
    # the wheel that takes up most, along the middle of its wrap
    k = max((k for k in range(len(order)) if order[k] != 0), key=lambda k: path.wrap[k])
    direction = degrees(path.heading[k] + path.wrap[k] / 2 + pi / 2)
    drag = {name: getattr(base.wheels["idler"], name) for name in ("bearing_drag", "rolling_arm")}
    wheels = {
        f"wheel_{i}": {"x": x, "y": y, "radius": radius, "inertia": 0.5 * 4 * c.link_mass * radius**2} | drag
        for i, (x, y, radius) in enumerate(placed.tolist()[1:], 1)
    }
    return base.changed(
        wheels=wheels, chain__pitches=pitches, tension__wheel=f"wheel_{order[k]}", tension__direction=direction,
        tension__travel=0.7 * base.pitch, tension__pre_tension=tension, tension__kept="locked",
    )  # fmt: skip


@pytest.mark.parametrize("number", range(25))
def test_a_drawn_layout_is_laid_exactly(number):
    """All wheels touch, none overlap, the chain is clockwise, closed, on the path, with a groove under a connector."""
    rig = random_rig(number)
    assert rig == random_rig(number) != random_rig(number + 1)
    laid = assemble(rig, lengths := body_lengths(rig, rig.chain.kind))
    path = laid.path
    assert set(laid.order) == set(range(1 + len(rig.wheels))) and path.wrap.sum() == pytest.approx(2 * np.pi)
    ends = np.vstack([laid.pins, laid.pins[:1]])
    np.testing.assert_allclose(np.hypot(*np.diff(ends, axis=0).T), lengths, rtol=0, atol=1e-10)
    np.testing.assert_allclose(np.array([np.cos(laid.angle), np.sin(laid.angle)]) @ lengths, 0.0, atol=1e-10)
    turns = np.diff(np.append(laid.angle, laid.angle[0] - 2 * np.pi))
    # convex: a straight strand turns by rounding only
    assert turns.sum() == pytest.approx(-2 * np.pi, abs=1e-10) and (turns < 1e-7).all()
    points = path.along(np.linspace(0, path.length, 20001))[0]
    assert max(np.hypot(*(points - pin).T).min() for pin in laid.pins) < path.length / 20001  # its sampling
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

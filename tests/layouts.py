"""Random layouts: wheels and chains of any number, drawn around the sprocket of a shipped rig.

A layout is drawn from a seed and its number, so that any of them can be made again (`random_rig`). Chains and
sprockets are those of shipped rigs; everything around the sprocket is drawn.
"""

from itertools import combinations
from math import degrees, hypot, pi
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from trackdyn import InputError, Rig, load_rig
from trackdyn.rig.layout import belt_path, run_order

SEED = 20261122
CHAINS = (str(Path(__file__).with_name("stiff.yaml")), "m113", "robot")  # none moves with the default rig
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
    for _ in range(ATTEMPTS):
        placed = drawn_wheels(rng, base, pitches, int(rng.integers(WHEELS[0], WHEELS[1] + 1)))
        if placed is not None:
            break
    else:
        raise AssertionError(f"layout {number}: no wheels fit into {pitches} pitches")  # of two wheels some always do
    circles = np.column_stack([placed[:, :2], pin_radius(base, placed[:, 2])])
    order = run_order(circles)
    path = belt_path(circles[order])
    c = base.chain
    weight = base.gravity * (c.link_mass + c.connector_mass) / base.pitch
    span = float(np.diff(path.start)[1::2].max())
    # the weight below the tensioned strand, and more, so that the lowest one is taut
    low = float((circles[:, 1] - circles[:, 2]).min())
    hanging = weight * (float(path.along([0.5 * (path.start[-2] + path.length)])[0][0, 1]) - low)
    tension = max(base.tension.pre_tension * rng.uniform(0.5, 1.5), hanging + weight * span * rng.uniform(1.0, 3.0))
    # the wheel that takes up most, along the middle of its wrap
    k = max((k for k in range(len(order)) if order[k] != 0), key=lambda k: float(path.wrap[k]))
    direction = degrees(float(path.heading[k]) + float(path.wrap[k]) / 2 + pi / 2)
    drag = {name: getattr(base.wheels["idler"], name) for name in ("bearing_drag", "rolling_arm")}
    wheels = {
        f"wheel_{i}": {"x": x, "y": y, "radius": radius, "inertia": 0.5 * 4 * c.link_mass * radius**2} | drag
        for i, (x, y, radius) in enumerate(placed.tolist()[1:], 1)
    }
    return base.changed(
        wheels=wheels, chain__pitches=pitches, tension__wheel=f"wheel_{order[k]}", tension__direction=direction,
        tension__travel=0.7 * base.pitch, tension__pre_tension=tension, tension__kept="locked",
    )  # fmt: skip

"""Random layouts: wheels, arms and chains of any number, each assembled, settled and run for a second, or refused.

A layout is drawn from a seed and its number alone, so that any of them can be made again (`random_rig`). Chains and
sprockets are those of shipped rigs; everything around the sprocket is drawn.
"""

import re
from math import cos, degrees, hypot, pi, sin, sqrt

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from replication.study.extremes.judge import COMPLETED, DEFECT, OUTCOMES, REFUSED, attempted, below, invariants
from trackdyn.errors import InputError
from trackdyn.parameters.layout import belt_path, run_order
from trackdyn.parameters.rig import Rig, load_rig
from trackdyn.scene.limits import largest_step
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.settling import explained_depth
from trackdyn.simulation.tensioning import arc_depths

FAMILY = "layouts"
SEED = 20261122
CHAINS = ("first_fit", "m113", "robot")
WHEELS, PITCHES = (2, 9), (20, 120)
# The bound, set before the first run: of layouts that are drawn, this fraction is completed within the invariants of
# `extremes.judge` and starts with no arc deeper in a tooth than its load explains; the rest is refused for a reason.
LEAST_COMPLETED = 0.99
ATTEMPTS = 400  # draws of wheels for one layout; most sets of nine do not fit into a short loop
OF_A_LAYOUT = ("chain", "teeth", "wheels")
GAP = 1.05  # of two wheels, in sums of their radii
# Steps tried, as parts of the limit at the pre-tension: a run that asks for a smaller one gets it.
STEPS = (0.8, 0.4, 0.2)


class Drawn:
    """What a layout is drawn from: a generator of its own, and the chain of a shipped rig."""

    def __init__(self, number: int, seed: int = SEED):
        self.rng = np.random.default_rng([seed, number])
        self.base = load_rig(str(self.rng.choice(CHAINS)))
        c = self.base.chain
        single = c.kind == "single_pin"
        self.body = self.base.single_pin_pitch if single else c.link_length
        self.pitch = self.base.single_pin_pitch if single else c.link_length + self.base.connector_length

    def pins(self, radius):
        """Radius of the pins of links on a wheel, m."""
        return np.hypot(np.asarray(radius) + self.base.chain.link_thickness / 2, self.body / 2)

    def wheels(self, pitches: int, count: int) -> np.ndarray | None:
        """Places and radii (count, 3) of wheels around which so many pitches fit, m; None if these ones do not."""
        rng = self.rng
        size = self.base.sprocket.ring_radius
        radius = np.append(size, rng.uniform(0.45, 1.0, count - 1) * size)
        turn = 2 * pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
        flat, tilt = rng.uniform(0.15, 1.0), rng.uniform(0, 2 * pi)
        x, y = np.cos(turn), flat * np.sin(turn)
        shape = np.column_stack([cos(tilt) * x - sin(tilt) * y, sin(tilt) * x + cos(tilt) * y])
        shape -= shape[0]

        def circles(scale):
            return np.column_stack([scale * shape, self.pins(radius)])

        def excess(scale):
            laid = circles(scale)
            return belt_path(laid[run_order(laid)], overlap=True).length - pitches * self.pitch

        least = max(
            GAP * (radius[i] + radius[k] + (0.1 * size if i == 0 else 0.0)) / hypot(*(shape[i] - shape[k]))
            for i in range(count)
            for k in range(i + 1, count)
        )
        try:
            if excess(least) >= 0:
                return None
            scale = brentq(excess, least, least + pitches * self.pitch / np.ptp(shape, axis=0).max(), xtol=1e-9)
        except (InputError, ValueError):
            return None
        order = run_order(circles(scale))
        if order[0] != 0 or set(order) != set(range(count)):
            return None
        return np.column_stack([scale * shape, radius])


def random_rig(number: int, seed: int = SEED) -> tuple[Rig, dict]:
    """A layout and what it is, in a few words."""
    drawn = Drawn(number, seed)
    rng, base = drawn.rng, drawn.base
    pitches = int(round(np.exp(rng.uniform(*np.log(PITCHES)))))
    for _ in range(ATTEMPTS):
        placed = drawn.wheels(pitches, int(rng.integers(WHEELS[0], WHEELS[1] + 1)))
        if placed is not None:
            break
    else:
        raise AssertionError(f"layout {number}: no wheels fit into {pitches} pitches")  # of two wheels some always do
    circles = np.column_stack([placed[:, :2], drawn.pins(placed[:, 2])])
    order = run_order(circles)
    path = belt_path(circles[order], overlap=True)
    c = base.chain
    weight = base.gravity * (c.link_mass + c.connector_mass) / drawn.pitch
    span = float(np.diff(path.start)[1::2].max())
    # what hangs below the strand that is tensioned, and more, so that the lowest one is taut
    low = float((circles[:, 1] - circles[:, 2]).min())
    hanging = weight * (float(path.at(0.5 * (path.start[-2] + path.length))[0][1]) - low)
    tension = max(base.tension.pre_tension * rng.uniform(0.5, 1.5), hanging + weight * span * rng.uniform(1.0, 3.0))
    # the wheel that takes up most, along the middle of its wrap
    k = max((k for k in range(len(order)) if order[k] != 0), key=lambda k: float(path.wrap[k]))
    direction = degrees(float(path.heading[k]) + float(path.wrap[k]) / 2 + pi / 2)
    names = [f"wheel_{i}" for i in range(1, len(placed))]
    wheels, carried = {}, 0
    for i, name in enumerate(names, 1):
        x, y, radius = (float(coordinate) for coordinate in placed[i])
        wheels[name] = {
            "x": x, "y": y, "radius": radius, "inertia": 0.5 * 4 * c.link_mass * radius**2, "axial_offset": 0.0,
            "toe": 0.0, "camber": 0.0, "bearing_drag": float(base.rollers["idler"].bearing_drag), "bearing_torque": 0.0,
            "rolling_arm": float(base.rollers["idler"].rolling_arm),
        }  # fmt: skip
        if i != order[k] and rng.random() < 0.15:
            wheels[name]["arm"] = _arm(rng, x, y, radius, 4 * c.link_mass, tension)
            carried += 1
    mode = str(rng.choice(["locked", "locked", "locked", "sprung"]))
    mass = 4 * c.link_mass
    stiffness = tension / (0.1 * placed[order[k], 2])
    changes = {
        "wheels": wheels, "idler": None, "road_wheel": None, "chain__pitches": pitches,
        "tension__wheel": names[order[k] - 1], "tension__direction": direction, "tension__travel": 0.7 * drawn.pitch,
        "tension__pre_tension": tension, "tension__kept": mode, "tension__mass": mass, "tension__stiffness": stiffness,
        "tension__damping": 0.2 * sqrt(stiffness * mass),
    }  # fmt: skip
    rig = base.changed(**changes)
    words = {
        "number": number, "chain": c.kind, "teeth": base.sprocket.teeth, "pitches": pitches, "wheels": len(placed),
        "arms": carried, "kept": mode,
    }  # fmt: skip
    return rig, words


def _arm(rng, x: float, y: float, radius: float, mass: float, tension: float) -> dict:
    """A trailing arm as long as its wheel's radius, which a tenth of its turn's load moves little."""
    turn = rng.uniform(0, 2 * pi)
    stiffness = 10.0 * tension * radius
    return {
        "x": x + radius * cos(turn), "y": y + radius * sin(turn), "mass": mass, "stiffness": stiffness,
        "damping": 0.2 * radius * sqrt(stiffness * mass), "travel": 25.0, "preload": None,
    }  # fmt: skip


def run_layout(number: int, seconds: float = 1.0, seed: int = SEED) -> dict:
    """Row of a layout with the longest of `STEPS` that resolves its contacts: ``value`` is the depth (m) of the deepest
    arc in a tooth at the start, ``at`` the step (s).
    """
    rig, words = random_rig(number, seed)
    rpm = float(np.random.default_rng([seed, number, 1]).uniform(10, 60)) * rig.sprocket.transmission_ratio

    def attempt(fraction):
        probe = Scene(rig, rpm, step=1e-6, spells=False)
        limit = largest_step(probe.model, 1.3 * rig.tension.pre_tension)
        sample = 1.0 / rig.sensor.rate
        step = float(sample / np.ceil(sample / (fraction * min(limit, 1.25e-4))))
        scene = Scene(rig, rpm, duration=seconds, lead_in=0.0, ramp=0.3, step=step, spells=False, frame_interval=sample)
        loop = Loop(scene)
        depth = float(arc_depths(scene, *loop._parts, float(loop.state.wheel_angle[0])).max())
        allowed = explained_depth(loop.model, rig.tension.pre_tension)
        start = below(max(depth, 0.0), allowed, "depth of an arc at the start in m", at=step)
        loop.advance(scene.ramp)
        values = invariants(scene, loop.record(seconds, frame_interval=sample, spells=False))
        return start | values | {"reason": start["reason"] or values["reason"]}

    case = f"{number}: {words['pitches']} pitches, {words['arms']} arms, {words['kept']}, {rpm:.4g} rev/min"
    for fraction in STEPS:
        row = attempted(FAMILY, case, attempt, fraction)
        if row["outcome"] != REFUSED or not re.search(r"step.*must be at most|use a (smaller )?step", row["reason"]):
            break
    return row | {"group": ", ".join(f"{words[name]}" for name in OF_A_LAYOUT)}


def by_layout(rows: pd.DataFrame) -> pd.DataFrame:
    """Layouts, and their outcomes, by chain and number of wheels."""
    rows = rows[rows["family"] == FAMILY]
    kinds = rows["group"].str.split(", ", expand=True).reindex(columns=range(len(OF_A_LAYOUT)))
    table = rows.assign(**dict(zip(OF_A_LAYOUT, kinds.to_numpy().T, strict=True))).astype({"teeth": int, "wheels": int})
    counts = table.groupby(list(OF_A_LAYOUT))["outcome"].value_counts().unstack(fill_value=0)
    counts = counts.reindex(columns=list(OUTCOMES), fill_value=0)
    counts.insert(0, "layouts", counts.sum(axis=1))
    return counts.reset_index()


def layouts_verdict(table: pd.DataFrame) -> str:
    """What a table of layouts (`by_layout`) comes to, in a sentence."""
    count, completed, defects, refused = (int(table[name].sum()) for name in ("layouts", COMPLETED, DEFECT, REFUSED))
    verdict = "kept" if completed >= LEAST_COMPLETED * count and not defects else "missed"
    return (
        f"{count} layouts of {table['wheels'].min()} to {table['wheels'].max()} wheels: "
        f"{100 * completed / count:.4g} % completed, {refused} refused, {defects} defects; the bound of "
        f"{100 * LEAST_COMPLETED:g} % is {verdict}."
    )

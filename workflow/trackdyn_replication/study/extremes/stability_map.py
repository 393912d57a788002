"""Steps at which the explicit integrator diverges, in runs forced beyond the scene's limit."""

from collections.abc import Callable, Iterable, Iterator
from functools import cache, partial

import numpy as np
import pandas as pd

from trackdyn.inputs.errors import DivergenceError, InputError
from trackdyn.model.arrays import ENERGY_NAMES, make_record
from trackdyn.rig.rig import Rig
from trackdyn.scene.scene import Scene
from trackdyn.scene.step import step_limits
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.settling import SettledLoops
from trackdyn_replication.study.extremes.judge import COMPLETED, FAST, REFUSED, attempted

STEEL_AND_TOOTH = ("steel__youngs_modulus", "tooth_contact__youngs_modulus")
SECONDS = 0.2
MOST_STEPS = 200_000
# A forced run is stable if its kinetic energy never exceeds this many times that of the finest run. Motion
# with only the chain explains a few per cent; contact that feeds on the step doubles it in milliseconds.
EXCESS = 2.0
QUANTITIES = {
    "stiffness": "Young's modulus of the teeth (Pa)",
    "speed": "motor speed (rpm)",
    "ring": "radius of the ring (m)",
    "tension": "pre-tension (N)",
}


def forced_run(start: Loop, step: float) -> float:
    """Return the largest kinetic energy of a run at a step of any size, J; inf if it left the physical range."""
    loop = start.copy()
    steps = min(round(SECONDS / step), MOST_STEPS)
    stride = max(round(1e-3 / step), 1)
    loop.arrays = loop.arrays._replace(model=loop.arrays.model._replace(step=step, stride=stride))
    record = make_record(steps // stride, loop.state, len(loop.model.sensors.body))
    try:
        loop.fill(record, 0, steps // stride)
    except DivergenceError:
        return np.inf
    most = record.samples.energy[:, ENERGY_NAMES.index("kinetic")].max(initial=0.0)
    return float(most) if np.isfinite(most) else np.inf


def stability_map(rig: Rig, quantity: str, values: Iterable[float], steps_per_ms: Iterable[float]) -> Iterator[dict]:
    """Yield runs over a quantity and step, without friction and loss: contact stiffness limits the step."""
    steps, starts = [1e-3 / count for count in steps_per_ms], SettledLoops()
    # with their loss, damped at the instant of the force, teeth stay stable at a few times the limit
    bare = {"motor_rpm": 210.0, "ring_radius": None, "friction": "none", "normal_law": "elastic", "ramp": 0.05}
    for value in values:
        of_rig = {"stiffness": dict.fromkeys(STEEL_AND_TOOTH, value), "tension": {"tension__pre_tension": value}}
        of_scene = {"speed": {"motor_rpm": value}, "ring": {"ring_radius": value}}
        changed = rig.changed(**of_rig.get(quantity, {}))
        scene = Scene(changed, step=1e-5, **(FAST | bare | of_scene.get(quantity, {})))
        try:
            start = Loop(scene, starts)
        except InputError:  # without friction and loss it may not come to rest
            yield attempted(f"step and {quantity}", f"{QUANTITIES[quantity]} {value:g}", Loop, scene, starts)
            continue
        limits = step_limits(start.model, start.layout.settled_tension_n)
        limit = min(step for name, step in limits.items() if "contact stiffness" in name)
        forced = cache(partial(forced_run, start))  # the finest run is mostly one of the map, too
        finest = forced(max(min(steps), 1e-5))
        for step in steps:
            case = f"{QUANTITIES[quantity]} {value:g}, step {step:.4g} s"
            marks = {"expected": limit, "group": f"{value:g}", "at": step}
            yield attempted(f"step and {quantity}", case, _forced, forced, scene, step, finest, marks)


def _forced(forced: Callable[[float], float], scene: Scene, step: float, finest: float, marks: dict) -> dict:
    """Return columns of a forced run, and whether a scene with its step would be refused."""
    excess = forced(step) / finest
    row = marks | {"measure": "kinetic energy over that of the finest step", "value": excess, "bound": EXCESS}
    try:
        scene.with_(step=step)
    except InputError as refusal:
        return row | {"outcome": REFUSED, "reason": str(refusal)}
    if np.isinf(excess):
        return row | {"outcome": REFUSED, "reason": "the kernel reports a body beyond the physical range"}
    return row | ({"outcome": COMPLETED} if excess <= EXCESS else {"reason": f"{excess:.3g} times the kinetic energy"})


def map_rows(rows: pd.DataFrame, quantity: str) -> pd.DataFrame:
    """Return forced runs of a quantity as numbers, without values at which no loop came to rest."""
    table = rows[(rows["family"] == f"step and {quantity}") & pd.to_numeric(rows["group"], "coerce").notna()]
    return table.astype(dict.fromkeys(("group", "at", "value", "expected", "bound"), float))


def stable_steps(rows: pd.DataFrame) -> pd.DataFrame:
    """Return predicted limit and largest stable step tried, s, of each value of a quantity."""
    parts = []
    for name in QUANTITIES:
        table = map_rows(rows, name)
        stable = table["value"] <= table["bound"]
        steps = {"limit": table.groupby("group")["expected"].first()}
        steps["stable"] = table[stable].groupby("group")["at"].max()
        parts.append(pd.DataFrame(steps).rename_axis("value").reset_index().assign(quantity=name))
    return pd.concat(parts, ignore_index=True)

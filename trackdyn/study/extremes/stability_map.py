"""Forced past the scene's refusal: at which steps does the explicit integrator diverge?"""

import copy
from collections.abc import Iterator

import numpy as np

from trackdyn.errors import InputError
from trackdyn.integrate.limits import step_limits
from trackdyn.integrate.run import run
from trackdyn.model import ENERGY_NAMES
from trackdyn.parameters.rig import Rig
from trackdyn.scene import Scene
from trackdyn.settling import empty_record, settle
from trackdyn.study.extremes.judge import COMPLETED, FAST, REFUSED, judged

MODULI = (1e8, 1e9, 1e10, 5e10, 2.1e11, 5e11, 1e12, 2e12)
STEPS = tuple(
    1e-3 / k for k in (10000, 2000, 1000, 500, 200, 100, 50, 40, 30, 25, 20, 16, 14, 12, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1)
) + (2e-3, 5e-3, 1e-2)  # fmt: skip
SECONDS = 0.2
MOST_STEPS = 200_000
# A forced run is stable if its kinetic energy never exceeds this many times that of the finest run. Motion
# with the chain alone explains a few per cent; contact that feeds on the step doubles it in milliseconds.
EXCESS = 2.0


def forced_run(model, state, work, step: float) -> float:
    """Largest kinetic energy of a run at a step of any size, J; inf if it left the physical range."""
    model, state, work = model._replace(step=step), copy.deepcopy(state), copy.deepcopy(work)
    steps = min(round(SECONDS / step), MOST_STEPS)
    stride = max(round(1e-3 / step), 1)
    record = empty_record(1, len(state.angle), len(model.wheels.x), loop=len(state.wheel_impact))
    most = 0.0
    for _ in range(steps // stride):
        if run(model, state, work, record, 0, 1, stride) >= 0 or not np.isfinite(record.energy).all():
            return np.inf
        most = max(most, float(record.energy[0, ENERGY_NAMES.index("kinetic")]))
    return most


def stability_map(rig: Rig, moduli=MODULI, steps=STEPS) -> Iterator[dict]:
    """Stiffness of the teeth against step, without ring and friction: only contact limits the step.

    The finest step of the reference is 1e-6 s; shorter ones run for as many steps.
    """
    fields = FAST | {"ring_radius": None, "friction": "none", "ramp": 0.05}
    for modulus in moduli:
        changes = {"steel__youngs_modulus": modulus, "tooth_contact__youngs_modulus": modulus}
        changed = rig.changed(**changes)
        scene = Scene(changed, 210.0, step=2e-5, **fields)
        model, state, work, _ = settle(scene)
        limits = step_limits(model, rig.tension.pre_tension)
        limit = min(value for name, value in limits.items() if "stiffness" in name)
        finest = forced_run(model, state, work, max(min(steps), 1e-5))
        for step in steps:

            def attempt(
                step=step, modulus=modulus, changed=changed, limit=limit, finest=finest, start=(model, state, work)
            ):
                excess = forced_run(*start, step) / finest
                stable = excess <= EXCESS
                row = {
                    "measure": "kinetic energy over that of the finest step", "value": excess, "expected": limit,
                    "bound": EXCESS, "group": f"{modulus:g}", "at": step,
                }  # fmt: skip
                try:
                    Scene(changed, 210.0, step=step, **fields)
                except InputError as refusal:
                    return row | {"outcome": REFUSED, "reason": str(refusal)}
                if np.isinf(excess):
                    return row | {"outcome": REFUSED, "reason": "the kernel reports a body beyond the physical range"}
                return row | (
                    {"outcome": COMPLETED} if stable else {"reason": f"{excess:.3g} times the kinetic energy"}
                )

            yield judged("step and stiffness", f"E = {modulus:g} Pa, step {step:.4g} s", attempt)

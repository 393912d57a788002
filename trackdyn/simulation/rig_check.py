"""Check of a rig before a run: its loop, its step limits, and its unusual values."""

from dataclasses import dataclass, replace
from itertools import combinations
from math import degrees, gcd, hypot, nan
from pathlib import Path

import numpy as np

from trackdyn.inputs.errors import DivergenceError
from trackdyn.inputs.validation import typed
from trackdyn.rig.layout import assemble, body_lengths, longest_strand, wheel_circles, wheel_names
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.scene.scene import Scene
from trackdyn.scene.step import halved_steps, largest_step, turn_limit
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recorder import Recorder
from trackdyn.simulation.settling import Layout
from trackdyn.simulation.step_check import NO, RECOMMENDED

SMALL_WRAP = 90.0  # deg of the sprocket below which few teeth share the load
DEEP_SAG = 0.1  # share of a span
SHORT_STEP = 2e-5  # s
TRIAL_S, RAMP_S = 1.0, 0.3  # s at speed, and of the ramp
MOST_STEPS = 1_000_000  # of all trials of a check: takes some seconds
COARSEST_STEP_S = 1e-4


@dataclass(frozen=True)
class RigReport:
    """Loop, step limits and unusual values of a rig (`check`); NaN, None or empty if no loop was settled."""

    rig: Rig
    rpm: float  # rev/min of the steps
    length_m: float  # of the chain
    wrap_deg: dict[str, float]  # by the name of a wheel that the taut chain lies on
    wheels: np.ndarray  # (w, 3) centres and radii of the wheels' surfaces of the loop, m
    frame: np.ndarray  # (n + 3,) configuration as a row of ``Recording.frame``
    tensioner_shift_m: float  # of the loop
    largest_step_s: float  # bound of stability
    step_s: float  # the largest step for which RMS and mean peak differ from those of half of it by `RECOMMENDED`
    tried_steps_s: list[float]
    layout: Layout | None  # of the settled loop, with its tension
    unusual: list[str]  # sentences


@typed
def check(rig: Rig | Path | str, rpm: float = 115.0, settle: bool = True) -> RigReport:
    """Check a rig: lay its loop and, with ``settle``, tension it and try steps at ``rpm`` (rev/min).

    ``rig`` is a rig, its file or its name. Raises `InputError`: the loop cannot be laid.
    """
    rig = rig if isinstance(rig, Rig) else load_rig(rig)
    lengths, names = body_lengths(rig, rig.chain.kind), wheel_names(rig)
    laid = assemble(rig, lengths)
    wraps = {names[wheel]: degrees(float(laid.path.wrap[k])) for k, wheel in enumerate(laid.order)}
    step = largest_step(Scene(rig, rpm).model, rig.tension.pre_tension)
    report = RigReport(
        rig, rpm, float(lengths.sum()), wraps,
        wheels=wheel_circles(rig, laid.shift, surface=True),
        frame=np.concatenate([laid.pins[0], laid.angle, [laid.sprocket_angle]]),
        tensioner_shift_m=laid.shift, largest_step_s=step, step_s=nan, tried_steps_s=[], layout=None,
        unusual=_unusual(rig, laid.path, wraps, step, names),
    )  # fmt: skip
    if not settle:
        return report
    loop = Loop(Scene(rig, 0.0))
    model, state = loop.model, loop.state
    report.wheels[:, 0], report.wheels[:, 1] = model.wheels.x, model.wheels.y
    load = loop.work.wheel_force.sum(axis=0)
    if idle := [names[k] for k in range(1, len(names)) if load[k] == 0.0]:
        report.unusual.append(f"at rest the chain has no contact with {', '.join(idle)}")
    step_s, tried = try_steps(loop, rpm)
    return replace(
        report,
        frame=np.concatenate([state.pin[:2], state.angle, state.wheel_angle[:1]]),
        tensioner_shift_m=loop.layout.tensioner_shift_m,
        largest_step_s=min(step, largest_step(model, loop.layout.settled_tension_n)),
        step_s=nan if step_s is None else step_s, tried_steps_s=tried, layout=loop.layout,
    )  # fmt: skip


def try_steps(settled: Loop, rpm: float) -> tuple[float | None, list[float]]:
    """Return the largest step (s; or None) from which half of it differs by at most `RECOMMENDED`, and all tried.

    The runs at ``rpm`` (rev/min) take at most `MOST_STEPS` together.
    """
    scene = {"motor_rpm": rpm, "ramp": RAMP_S, "every_link": True, "duration": TRIAL_S}
    # limits of a scene are those at the pre-tension, limits of a loop those at the tension at which it settles
    tensions = settled.layout.settled_tension_n, settled.scene.rig.tension.pre_tension
    rate_limits = turn_limit(settled.scene.with_(motor_rpm=rpm).sprocket_rate).values()
    coarsest = min(COARSEST_STEP_S, largest_step(settled.model, *tensions), *rate_limits)
    before: Recorder | None = None
    tried, steps = list[float](), 0.0
    for step in halved_steps(coarsest, 1.0 / settled.scene.rig.rate):
        steps += (RAMP_S + TRIAL_S) / step
        if steps > MOST_STEPS:
            break
        try:
            loop = settled.changed(step=step, **scene)
            loop.advance(RAMP_S)
            run = Recorder(loop, checked=False).finish()
        except DivergenceError:
            before = None
            continue
        tried.append(step)
        if before is not None:
            difference = before.statistics().difference(run.statistics())
            if difference.within(RECOMMENDED, RECOMMENDED) and before.resolution().state != NO:
                return tried[-2], tried
        before = run
    return None, tried


def _unusual(rig: Rig, path, wraps: dict[str, float], step: float, names: tuple[str, ...]) -> list[str]:
    remarks = []
    if wraps["sprocket"] < SMALL_WRAP:
        remarks.append(f"the sprocket is wrapped by {wraps['sprocket']:.3g} deg only: few teeth share the load")
    passed = [name for name in names if name not in wraps]
    remarks += [f"the taut chain passes {name} by: only a sagging strand can lie on it" for name in passed]
    wheels = list(zip(names, wheel_circles(rig, surface=True), strict=True))[1:]
    for (one, a), (other, b) in combinations(wheels, 2):
        if hypot(*(a[:2] - b[:2])) < a[2] + b[2]:
            remarks.append(f"{one} and {other} overlap in the side view: they must have different axial positions")
    if (common := gcd(rig.chain.pitches, rig.sprocket.teeth)) > 1:
        remarks.append(f"pitches and teeth have the factor {common} in common: a tooth always meets the same pitches")
    weight, span = longest_strand(rig, path)
    if rig.gravity and weight * span > DEEP_SAG * (flat := 8 * rig.tension.pre_tension):
        sag = f"{weight * span / flat:.0%}" if weight * span < 0.5 * flat else "half or more"  # beyond a parabola
        remarks.append(f"the longest strand, {span:.3g} m, sags by {sag} of its span")
    if step < SHORT_STEP:
        remarks.append(f"the step must be {step:.2g} s or less: stiff surfaces, light bodies or much tension")
    return remarks

"""Short runs against a step four times smaller: is what completes right, and is only what is wrong refused?

A scene is drawn from a seed and its number alone: shipped rigs, random layouts, the scenes of the accuracy study, and
rigs with odd stiffnesses, weights and tensions, each at a speed, a length of 0.3 to 2 s and a part of the largest step
that its settled loop allows.
"""

from collections.abc import Iterator

import numpy as np

from trackdyn.errors import DivergenceError, InputError
from trackdyn.model.constants import Model
from trackdyn.parameters.rig import Rig, load_rig
from trackdyn.parameters.rig_file import shipped_rigs
from trackdyn.scene.limits import step_limits
from trackdyn.scene.scene import OF_THE_RIG, Scene
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.resolution import PEAKS, RMS, YES
from trackdyn.simulation.trial import short_run
from trackdyn.simulation.watch import FINER
from trackdyn.study.extremes.judge import COMPLETED, DEFECT, REFUSED, row
from trackdyn.study.layouts import random_rig

FAMILY = "short runs"
SEED = 20261201
# Of good runs at most this part may be refused; what completes is within `resolution.RMS` and `resolution.PEAKS`.
REFUSED_GOOD = 0.03
SECONDS, PARTS, RAMP = (0.3, 2.0), (0.2, 1.0), 0.3  # lengths, and parts of the largest step, both drawn by logarithm
# scenes of the accuracy study: motor speed (rev/min) and radius of the ring (m)
TRADE = ((115, 0.308), (210, 0.308), (150, 0.304), (180, 0.312), (115, None), (150, None), (210, None))
KINDS = ("shipped", "layout", "trade", "odd", "shipped", "layout")


def drawn(number: int, seed: int = SEED) -> tuple[str, Rig, dict]:
    """What a scene is called, its rig, and motor speed, ring, seconds and part of the largest step."""
    rng = np.random.default_rng([seed, number])
    kind, ring = KINDS[number % len(KINDS)], OF_THE_RIG

    def between(low, high):
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    if kind == "shipped":
        case = str(rng.choice(sorted(shipped_rigs())))
        rig = load_rig(case)
    elif kind == "layout":
        of = int(rng.integers(10**6))
        rig, case = random_rig(of, seed)[0], f"layout {of}"
    else:
        case, rig = "paper", load_rig("paper")
    rpm = float(rng.uniform(10, 60)) * rig.sprocket.transmission_ratio
    if kind == "trade":
        rpm, ring = TRADE[int(rng.integers(len(TRADE)))]
        case = f"{rpm} rev/min, ring {ring}"
    if kind == "odd":
        case = str(rng.choice(["paper", "paper", "m113", "robot"]))
        base = load_rig(case)
        name, low, high = [
            ("bushing__stiffness", 0.3, 300.0), ("bushing__damping", 0.1, 30.0),
            ("tooth_contact__youngs_modulus", 0.1, 30.0), ("wheel_contact__youngs_modulus", 0.1, 10.0),
            ("tension__pre_tension", 0.4, 2.0), ("chain__link_mass", 0.3, 3.0),
        ][int(rng.integers(6))]  # fmt: skip
        section, field = name.split("__")
        times = between(low, high)
        rig = base.changed(**{name: getattr(getattr(base, section), field) * times})
        rpm = float(rng.uniform(10, 60)) * rig.sprocket.transmission_ratio
        case += f", {section}.{field} times {times:.3g}"
    seconds, part = round(between(*SECONDS), 2), between(*PARTS)
    laws = {
        "drag": str(rng.choice(["viscous", "rolling"]))
        if any(w.rolling_arm for w in rig.rollers.values())
        else "viscous",
        "bushing_law": str(rng.choice(["viscous", "hysteretic"])) if rig.bushing.loss_factor else "viscous",
    }
    case += "".join(f", {law}" for law in laws.values() if law != "viscous")
    return f"{kind}: {case}", rig, {"rpm": rpm, "ring_radius": ring, "seconds": seconds, "part": part, "laws": laws}


def largest_step(model: Model, tension: float) -> float:
    """Largest step that a loop of this tension (N) allows, s; at most 0.2 ms."""
    return min(*step_limits(model, tension).values(), 2e-4)


def run_drawn(number: int, seed: int = SEED) -> dict:
    """Row of a scene: ``value`` is the error of the RMS of all links, ``expected`` that of the mean peak, ``group`` the
    state of its resolution, ``at`` the step over the largest.

    Refused: ``reason`` begins with ``good`` where the run would have been within the bounds.
    """
    name, rig, of = drawn(number, seed)
    name = f"{number}: {name}, {of['rpm']:.4g} rev/min, {of['seconds']:g} s"
    sample = 1.0 / rig.sensor.rate
    fields = {"duration": of["seconds"], "lead_in": 0.0, "ramp": RAMP, "ring_radius": of["ring_radius"]} | of["laws"]
    try:
        probe = Scene(rig, of["rpm"], step=sample / 1000, every_link=True, **fields)
        limit = largest_step(probe.model, rig.tension.pre_tension)
        loop = Loop(probe.with_(step=float(sample / np.ceil(sample / (0.5 * limit)))))
        limit = min(limit, largest_step(loop.model, loop.layout["settled_tension_n"]))
        step = float(sample / np.ceil(sample / (of["part"] * limit)))
        fine, _ = _run(loop, step / FINER, of["seconds"], False)
    except (InputError, DivergenceError) as error:
        return row(FAMILY, name, REFUSED, str(error), measure="no loop, or no limit")
    more = {"measure": "error of RMS, of mean peak", "bound": RMS, "at": step / limit}
    try:
        found, told = _run(loop, step, of["seconds"], True)
    except DivergenceError as error:
        try:
            found, _ = _run(loop, step, of["seconds"], False)
        except DivergenceError:
            return row(FAMILY, name, REFUSED, str(error), group="diverged", **more)
        off = found.differs(fine)
        good = "good: " if off[0] <= RMS and off[1] <= PEAKS else ""
        return row(FAMILY, name, REFUSED, good + str(error), group="refused", value=off[0], expected=off[1], **more)
    off = found.differs(fine)
    missed = off[0] > RMS or off[1] > PEAKS
    reason = f"RMS is {100 * off[0]:.2g} % off, the mean peak {100 * off[1]:.2g} %" if missed else ""
    return row(
        FAMILY, name, DEFECT if missed else COMPLETED, reason, group=told.state, value=off[0], expected=off[1], **more
    )


def _run(loop: Loop, step: float, seconds: float, watched: bool):
    origin = loop.changed(step=step)
    own = origin.copy()
    own.advance(RAMP)
    found, writer = short_run(own, seconds, watched, origin)
    return found, writer.watch.resolution()


def short_runs(count: int, seed: int = SEED, part: int = 0, parts: int = 1) -> Iterator[dict]:
    """Rows of every ``parts``-th of ``count`` scenes, from ``part`` on."""
    for number in range(part, count, parts):
        yield run_drawn(number, seed)


def verdict(rows: list[dict]) -> str:
    """What came out of short runs, in a sentence."""
    ran = [r for r in rows if np.isfinite(r["value"])]
    done = [r for r in ran if r["outcome"] != REFUSED]
    silent = [r for r in done if r["group"] == YES]
    good = [r for r in ran if r["value"] <= RMS and r["expected"] <= PEAKS]
    lost = sum(r["outcome"] == REFUSED for r in good)
    return (
        f"{len(rows)} scenes, {len(done)} completed, {len(silent)} of them resolved: at most "
        f"{100 * max((r['value'] for r in silent), default=0):.2g} % off in RMS and "
        f"{100 * max((r['expected'] for r in silent), default=0):.2g} % in mean peak; "
        f"{sum(r['outcome'] == DEFECT for r in rows)} beyond the bounds; {lost} of {len(good)} good ones refused."
    )

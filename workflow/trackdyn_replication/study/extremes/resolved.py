"""Short runs against a step four times smaller: errors of completed runs, and good runs that are refused."""

import numpy as np
import pandas as pd

from trackdyn.inputs.errors import DivergenceError, InputError
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.scene.scene import Scene
from trackdyn.scene.step import largest_step, round_step
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recorder import Recorder
from trackdyn.simulation.step_check import DOUBTFUL_STEP_DIVISOR, NO, OPEN, PEAKS, RMS, YES
from trackdyn_replication.study.extremes.judge import COMPLETED, DEFECT, MARKED, REFUSED, row

FAMILY = "short runs"
SEED = 20261215
REFUSED_GOOD = 0.03  # of the good runs may be refused; one that completes is within `step_check.RMS` and `PEAKS`
SECONDS, PARTS, RAMP = (0.3, 2.0), (0.2, 1.0), 0.3  # lengths, and parts of the largest step, both drawn by logarithm
LARGEST = 2e-4  # s, where the loop would allow more
# parameters of odd rigs, each times a factor from two decades
ODD = (
    "chain__link_mass", "chain__link_inertia", "chain__connector_mass", "chain__connector_inertia",
    "bushing__stiffness", "idler__inertia", "idler__bearing_drag", "tension__pre_tension", "impact__speed_floor",
    *(f"{name}_contact__{field}" for name in ("tooth", "ring", "wheel") for field in (
        "youngs_modulus", "transition_velocity", "contact_length"
    )),
)  # fmt: skip
DECADES = (0.1, 10.0)
BASES = ("paper", "parts", "m113", "robot")


def drawn(number: int, seed: int = SEED) -> tuple[str, Rig, dict]:
    """Draw a scene; return its name, its rig, and motor speed, seconds, fraction of the largest step and laws."""
    rng = np.random.default_rng([seed, number])

    def between(low, high):
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    case = str(rng.choice(BASES))
    base, changes = load_rig(case), {}
    for name in rng.choice(ODD, int(rng.integers(1, len(ODD) + 1)), replace=False):
        changes[str(name)] = base.value(name.replace("__", ".")) * between(*DECADES)
    rig = base.changed(**changes)
    case += "".join(f", {name.replace('__', '.')} {value:.3g}" for name, value in changes.items())
    rpm = float(rng.uniform(10, 60)) * rig.sprocket.transmission_ratio
    seconds, fraction = round(between(*SECONDS), 2), between(*PARTS)
    laws = {
        name: str(rng.choice(["viscous", other])) if possible else "viscous"
        for name, other, possible in (
            ("drag", "rolling", any(wheel.rolling_arm for wheel in rig.wheels.values())),
            ("bushing_law", "hysteretic", rig.bushing.loss_factor),
        )
    }
    case += "".join(f", {law}" for law in laws.values() if law != "viscous")
    return case, rig, {"rpm": rpm, "seconds": seconds, "share": fraction, "laws": laws}


def run_short(number: int, seed: int = SEED) -> dict:
    """Return the row of a scene; the ``reason`` of a refused one begins with ``good`` if it was within the bounds.

    ``value`` is the larger error of the RMS of the sensor and of all links, ``expected`` that of the mean peak,
    ``group`` the state of its resolution, ``at`` the step over the largest.
    """
    name, rig, settings = drawn(number, seed)
    name = f"{number}: {name}, {settings['rpm']:.4g} rev/min, {settings['seconds']:g} s"
    fields = {"duration": settings["seconds"], "lead_in": 0.0, "ramp": RAMP} | settings["laws"]
    try:
        probe = Scene(rig, settings["rpm"], every_link=True, **fields)
        loop = Loop(probe)
        limit = min(LARGEST, largest_step(loop.model, rig.tension.pre_tension, loop.layout.settled_tension_n))
        step = round_step(settings["share"] * limit, 1.0 / rig.rate)
        loop = Loop(probe.with_(step=step))
        fine, _ = _run(Loop(probe.with_(step=step / DOUBTFUL_STEP_DIVISOR)), settings["seconds"], False)
    except (InputError, DivergenceError) as error:
        return row(FAMILY, name, REFUSED, str(error), measure="no loop, or no limit")
    more = {"measure": "error of RMS, of mean peak", "bound": RMS, "at": step / limit}
    try:
        statistics, resolution = _run(loop, settings["seconds"], True)
    except DivergenceError as error:
        try:
            statistics, _ = _run(loop, settings["seconds"], False)
        except DivergenceError:
            return row(FAMILY, name, REFUSED, str(error), group="diverged", **more)
        bias = statistics.difference(fine)
        good = "good: " if bias.within() else ""
        more |= {"group": "refused", "value": bias.rms, "expected": bias.peaks}
        return row(FAMILY, name, REFUSED, good + str(error), **more)
    bias = statistics.difference(fine)
    reason, outcome = "", MARKED if resolution.state == NO else COMPLETED
    if not bias.within():
        reason = f"RMS is {100 * bias.rms:.2g} % off, the mean peak {100 * bias.peaks:.2g} %"
        outcome = DEFECT if resolution.state == YES else MARKED
    return row(FAMILY, name, outcome, reason, group=resolution.state, value=bias.rms, expected=bias.peaks, **more)


def _run(loop: Loop, seconds: float, checked: bool):
    loop_copy = loop.copy()
    loop_copy.advance(RAMP)
    writer = Recorder(loop_copy, loop.scene.with_(duration=seconds, every_link=True), checked, loop).finish()
    return writer.statistics(), writer.resolution()


def short_runs_summary(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the outcome of short runs, one row; ``beyond`` are completed ones that are not within the bounds."""
    rows = rows[rows["family"] == FAMILY]
    tried = rows[rows["value"].notna()]
    good, refused = (tried["value"] <= RMS) & (tried["expected"] <= PEAKS), tried["outcome"] == REFUSED
    resolved, unjudged, unresolved = (tried[~refused & (tried["group"] == state)] for state in (YES, OPEN, NO))
    beyond = tried[~refused & ~good]
    numbers = beyond["case"].str.split(":").str[0]
    return pd.DataFrame([{
        "scenes": len(rows), "no_loop": len(rows) - len(tried), "resolved": len(resolved), "not_judged": len(unjudged),
        "not_resolved": len(unresolved), "rms_off_pct": 100 * resolved["value"].max(),
        "peak_off_pct": 100 * resolved["expected"].max(), "refused": int(refused.sum()),
        "refused_good": int((refused & good).sum()), "good": int(good.sum()),
        "beyond": ", ".join(f"{n} ({state})" for n, state in zip(numbers, beyond["group"], strict=True)),
    }])  # fmt: skip


def short_runs_verdict(table: pd.DataFrame) -> str:
    """Return a sentence on a table of short runs (`short_runs_summary`)."""
    last = table.iloc[-1]
    silent = str(last["beyond"] or "").count(f"({YES})") if pd.notna(last["beyond"]) else 0
    met = not silent and last["refused_good"] <= REFUSED_GOOD * last["good"]
    return (
        f"Of {last['scenes']} short runs {last['resolved']} completed as resolved, with errors of at most "
        f"{last['rms_off_pct']:.2g} % of the RMS and {last['peak_off_pct']:.2g} % of the mean peak (bounds: "
        f"{100 * RMS:g} and {100 * PEAKS:g} %). {last['refused_good']} of {last['good']} good ones were refused "
        f"(bound: {100 * REFUSED_GOOD:g} %). The bounds {'hold' if met else 'do not hold'}."
    )

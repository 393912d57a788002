"""Short runs against a step four times smaller: is what completes right, and is only what is wrong refused?

A scene is drawn from a seed and its number alone: shipped rigs, random layouts, the scenes of the accuracy study, and
rigs with odd stiffnesses, weights, frictions and tensions (`ODD`), each at a speed, a length of 0.3 to 2 s and a
fraction of the largest step that its settled loop allows.
"""

import numpy as np
import pandas as pd

from replication.study.extremes.judge import COMPLETED, DEFECT, MARKED, REFUSED, row
from replication.study.layouts import random_rig
from trackdyn.errors import DivergenceError, InputError
from trackdyn.parameters.rig import Rig, load_rig
from trackdyn.parameters.rig_file import shipped_rigs
from trackdyn.scene.limits import largest_step
from trackdyn.scene.scene import FROM_THE_RIG, Scene
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recorder import Recorder
from trackdyn.simulation.resolution import FINER, NO, OPEN, PEAKS, RMS, YES

FAMILY = "short runs"
SEED = 20261215
# Of good runs at most this fraction may be refused; what completes is within `resolution.RMS` and `resolution.PEAKS`.
REFUSED_GOOD = 0.03
SECONDS, PARTS, RAMP = (0.3, 2.0), (0.2, 1.0), 0.3  # lengths, and parts of the largest step, both drawn by logarithm
LARGEST = 2e-4  # s, where the loop would allow more
# scenes of the accuracy study: motor speed (rev/min) and radius of the ring (m)
TRADE = ((115, 0.308), (210, 0.308), (150, 0.304), (180, 0.312), (115, None), (150, None), (210, None))
# parameters of odd rigs, each times what two decades give
ODD = (
    "chain__link_mass", "chain__link_inertia", "chain__connector_mass", "chain__connector_inertia",
    "bushing__stiffness", "idler__inertia", "idler__bearing_drag", "tension__pre_tension", "impact__speed_floor",
    *(f"{name}_contact__{field}" for name in ("tooth", "ring", "wheel") for field in (
        "youngs_modulus", "transition_velocity", "contact_length"
    )),
)  # fmt: skip
DECADES = (0.1, 10.0)
KINDS = ("shipped", "layout", "trade", "odd", "shipped", "layout")


def drawn(number: int, seed: int = SEED) -> tuple[str, Rig, dict]:
    """What a scene is called, its rig, and motor speed, ring, seconds and fraction of the largest step."""
    rng = np.random.default_rng([seed, number])
    kind, ring = KINDS[number % len(KINDS)], FROM_THE_RIG

    def between(low, high):
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    if kind == "shipped":
        case = str(rng.choice(sorted(shipped_rigs())))
        rig = load_rig(case)
    elif kind == "layout":
        of = int(rng.integers(10**6))
        rig, case = random_rig(of, seed)[0], f"layout {of}"
    else:
        case, rig = "first_fit", load_rig("first_fit")
    rpm = float(rng.uniform(10, 60)) * rig.sprocket.transmission_ratio
    if kind == "trade":
        rpm, ring = TRADE[int(rng.integers(len(TRADE)))]
        case = f"{rpm} rev/min, ring {ring}"
    if kind == "odd":
        case = str(rng.choice(["paper", "first_fit", "m113", "robot"]))
        base = load_rig(case)
        changes = {}
        for name in rng.choice(ODD, int(rng.integers(1, len(ODD) + 1)), replace=False):
            section, field = name.split("__")
            changes[str(name)] = getattr(getattr(base, section), field) * between(*DECADES)
        rig = base.changed(**changes)
        rpm = float(rng.uniform(10, 60)) * rig.sprocket.transmission_ratio
        case += "".join(f", {name.replace('__', '.')} {value:.3g}" for name, value in changes.items())
    seconds, fraction = round(between(*SECONDS), 2), between(*PARTS)
    laws = {
        name: str(rng.choice(["viscous", other])) if possible else "viscous"
        for name, other, possible in (
            ("drag", "rolling", any(wheel.rolling_arm for wheel in rig.rollers.values())),
            ("bushing_law", "hysteretic", rig.bushing.loss_factor),
        )
    }
    case += "".join(f", {law}" for law in laws.values() if law != "viscous")
    return (
        f"{kind}: {case}",
        rig,
        {"rpm": rpm, "ring_radius": ring, "seconds": seconds, "share": fraction, "laws": laws},
    )


def run_short(number: int, seed: int = SEED) -> dict:
    """Row of a scene: ``value`` is the larger error of the RMS of the sensor and of all links, ``expected`` that of the
    mean peak, ``group`` the state of its resolution, ``at`` the step over the largest.

    Refused: ``reason`` begins with ``good`` where the run would have been within the bounds.
    """
    name, rig, of = drawn(number, seed)
    name = f"{number}: {name}, {of['rpm']:.4g} rev/min, {of['seconds']:g} s"
    sample = 1.0 / rig.sensor.rate
    fields = {"duration": of["seconds"], "lead_in": 0.0, "ramp": RAMP, "ring_radius": of["ring_radius"]} | of["laws"]
    try:
        probe = Scene(rig, of["rpm"], step=sample / 1000, every_link=True, **fields)
        limit = min(largest_step(probe.model, rig.tension.pre_tension), LARGEST)
        loop = Loop(probe.with_(step=float(sample / np.ceil(sample / (0.5 * limit)))))
        limit = min(limit, largest_step(loop.model, loop.layout["settled_tension_n"]))
        step = float(sample / np.ceil(sample / (of["share"] * limit)))
        loop = Loop(probe.with_(step=step))
        fine, _ = _run(Loop(probe.with_(step=step / FINER)), of["seconds"], False)
    except (InputError, DivergenceError) as error:
        return row(FAMILY, name, REFUSED, str(error), measure="no loop, or no limit")
    more = {"measure": "error of RMS, of mean peak", "bound": RMS, "at": step / limit}
    try:
        statistics, resolution = _run(loop, of["seconds"], True)
    except DivergenceError as error:
        try:
            statistics, _ = _run(loop, of["seconds"], False)
        except DivergenceError:
            return row(FAMILY, name, REFUSED, str(error), group="diverged", **more)
        off = statistics.differs(fine)
        good = "good: " if off[0] <= RMS and off[1] <= PEAKS else ""
        return row(FAMILY, name, REFUSED, good + str(error), group="refused", value=off[0], expected=off[1], **more)
    off = statistics.differs(fine)
    missed = off[0] > RMS or off[1] > PEAKS
    reason = f"RMS is {100 * off[0]:.2g} % off, the mean peak {100 * off[1]:.2g} %" if missed else ""
    wrong = MARKED if resolution.state != YES else DEFECT
    outcome = MARKED if resolution.state == NO else wrong if missed else COMPLETED
    return row(FAMILY, name, outcome, reason, group=resolution.state, value=off[0], expected=off[1], **more)


def _run(loop: Loop, seconds: float, watched: bool):
    loop_copy = loop.copy()
    loop_copy.advance(RAMP)
    writer = Recorder(loop_copy, loop.scene.with_(duration=seconds, every_link=True), watched, loop).finish()
    return writer.answer(), writer.watch.resolution()


def by_kind(rows: pd.DataFrame) -> pd.DataFrame:
    """What became of short runs, a line a kind of scene and one for all.

    Returns
    -------
    DataFrame
        ``kind``; ``scenes``; ``no_loop``, of which no run was tried; ``resolved``, ``not_judged`` and ``not_resolved``,
        completed runs by what they say of themselves; ``rms_off_pct`` and ``peak_off_pct``, the largest errors of the
        resolved ones; ``refused``, and ``refused_good`` of ``good``, runs within the bounds; ``beyond``, completed ones
        that are not, by number and what they say.
    """
    rows = rows[rows["family"] == FAMILY]
    number, kind = rows["case"].str.extract(r"^(\d+): (\w+)").to_numpy().T if len(rows) else ([], [])
    rows = rows.assign(
        number=number, kind=kind, good=(rows["value"] <= RMS) & (rows["expected"] <= PEAKS),
        refused=rows["outcome"] == REFUSED, tried=rows["value"].notna(),
    )  # fmt: skip
    lines = []
    for name, group in [*rows.groupby("kind"), ("all", rows)]:
        of = group[group["tried"]]
        done = of[~of["refused"]]
        message = [done[done["group"] == state] for state in (YES, OPEN, NO)]
        beyond = done[~done["good"]]
        lines.append({
            "kind": name, "scenes": len(group), "no_loop": int((~group["tried"]).sum()),
            **dict(zip(("resolved", "not_judged", "not_resolved"), map(len, message), strict=True)),
            "rms_off_pct": 100 * message[0]["value"].max(), "peak_off_pct": 100 * message[0]["expected"].max(),
            "refused": int(of["refused"].sum()), "refused_good": int((of["refused"] & of["good"]).sum()),
            "good": int(of["good"].sum()),
            "beyond": ", ".join(f"{n} ({state})" for n, state in zip(beyond["number"], beyond["group"], strict=True)),
        })  # fmt: skip
    return pd.DataFrame(lines)


def short_runs_verdict(table: pd.DataFrame) -> str:
    """What a table of short runs (`by_kind`) comes to, in a sentence."""
    last = table.iloc[-1]
    silent = str(last["beyond"] or "").count(f"({YES})") if pd.notna(last["beyond"]) else 0
    met = not silent and last["refused_good"] <= REFUSED_GOOD * last["good"]
    return (
        f"Of {last['scenes']} short runs {last['resolved']} completed as resolved: at most {last['rms_off_pct']:.2g} % "
        f"off in RMS and {last['peak_off_pct']:.2g} % in mean peak, of {100 * RMS:g} and {100 * PEAKS:g} %; "
        f"{last['refused_good']} of {last['good']} good ones were refused, of {100 * REFUSED_GOOD:g} %. "
        f"The bounds {'hold' if met else 'do not hold'}."
    )

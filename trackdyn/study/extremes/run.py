"""Every family of the extremes in order, as far as a form asks for it."""

import json
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from typing import NamedTuple

import pandas as pd

from trackdyn.parameters.rig import Rig
from trackdyn.study.extremes import cases, solvers
from trackdyn.study.extremes.judge import DEFECT, as_table
from trackdyn.study.extremes.long_run import long_run, run_long
from trackdyn.study.extremes.random_scenes import SEED, random_scenes, smallest
from trackdyn.study.extremes.stability_map import stability_map
from trackdyn.study.settings import ExtremesForm


class Extremes(NamedTuple):
    """All rows, the chunks of the long run, and what the random scenes were drawn with."""

    rows: pd.DataFrame
    chunks: pd.DataFrame
    seeds: dict


def run_extremes(rig: Rig, form: ExtremesForm, say: Callable[[str], None] = print) -> Extremes:
    """Run every family of a form; ``say`` hears of every family and every defect."""
    rows = []
    # first, while this process is still small: growth of the memory is the long run's own
    chunks = run_long(rig, form.long_run_s, form.long_run_turns)
    families = {
        "long run": (long_run(chunks),),
        "length of the chain": (solvers.digits(rig, form.bodies), solvers.growth_rates(rig)),
        "mass ratio": (solvers.light_connectors(rig), cases.mass_ratio(rig, form.mass_ratios)),
        "stiffness": (cases.stiffness(rig, form.moduli_pa),),
        "restitution": (cases.restitution(rig),),
        "friction": (cases.friction(rig, form.friction_coefficients, form.transition_velocities_m_s),),
        "bushing": (cases.bushing(rig, form.bushing_dampings_nms, form.bushing_integrators),),
        "speed": (cases.speed(rig, form.speeds_rpm),),
        "loop": (cases.loop(rig, form.ring_radii_m),),
        "start": (cases.starts(rig, form.start_radii_m, form.equal_pitch_radii_m),),
        "initial state": (cases.states(rig, form.depths_m), cases.laws(rig), cases.momentum(rig)),
        "step and stiffness": (stability_map(rig, form.map_moduli_pa, form.map_steps_per_ms),),
        "random scenes": (random_scenes(rig, form.random_scenes),),
    }
    for name, parts in families.items():  # generators: nothing has run so far
        for part in parts:
            for row in part:
                rows.append(row)
                if row["outcome"] == DEFECT:
                    say(f"defect: {row['family']}: {row['case']}: {row['reason']}")
        say(f"{name}: {len(rows)} rows so far")
    table = as_table(rows)
    failed = table[(table["family"] == "random scenes") & (table["outcome"] == DEFECT)]["case"]
    seeds = {
        "seed": SEED,
        "scenes": form.random_scenes,
        "hypothesis": _version("hypothesis"),
        "failures": [smallest(rig, json.loads(case)) for case in failed],
    }
    return Extremes(table, chunks, seeds)


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""

"""The short and the full form of the extremes: which cases, in which order."""

import json
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from typing import NamedTuple

import pandas as pd

from trackdyn.parameters.rig import Rig
from trackdyn.study.extremes import cases, random_scenes, solvers
from trackdyn.study.extremes.judge import DEFECT, as_table
from trackdyn.study.extremes.long_run import long_run, run_long
from trackdyn.study.extremes.stability_map import stability_map


class Form(NamedTuple):
    """How much of every family runs; an empty dictionary means all of it."""

    scenes: int  # random ones
    seconds: float  # of the long run
    turns: int  # of the loop in a chunk of it
    digits: dict
    mass_ratio: dict
    stiffness: dict
    friction: dict
    bushing: dict
    speed: dict
    loop: dict
    states: dict
    stability_map: dict


FULL = Form(1000, 3600.0, 2, {}, {}, {}, {}, {}, {}, {}, {}, {})
SHORT = Form(
    60,
    60.0,
    1,
    {"bodies": (6, 8, 10, 14, 18, 24, 36, 70, 200, 1000, 10000)},
    {"ratios": (1, 1e3, 1e6)},
    {"moduli": (1e6, 2.1e11, 2e12)},
    {"coefficients": (0.0, 0.5, 2.0), "velocities": (1e-4, 1e-2, 1.0)},
    {"dampings": (0.0, 12.4, 1e4, 1e9), "others": ()},
    {"speeds": (0.0, 115.0, 2000.0, 10000.0)},
    {"radii": (0.25, 0.29, 0.308, 0.325, 0.34, 0.35)},
    {"depths": (1e-3, 1e-2)},
    {
        "moduli": (1e9, 2.1e11, 2e12),
        "steps": tuple(1e-3 / k for k in (100, 20, 12, 9, 7, 6, 5, 4, 3, 2, 1)) + (2e-3, 1e-2),
    },
)


class Extremes(NamedTuple):
    """All rows, the chunks of the long run, and what the random scenes were drawn with."""

    rows: pd.DataFrame
    chunks: pd.DataFrame
    seeds: dict


def run_extremes(rig: Rig, form: Form, say: Callable[[str], None] = print) -> Extremes:
    """Run every family of a form; ``say`` hears of every family and every defect."""
    rows = []
    families = (
        ("length of the chain", lambda: (*solvers.digits(rig, **form.digits), *solvers.growth_rates(rig))),
        ("mass ratio", lambda: (*solvers.light_connectors(rig), *cases.mass_ratio(rig, **form.mass_ratio))),
        ("stiffness", lambda: cases.stiffness(rig, **form.stiffness)),
        ("restitution", lambda: cases.restitution(rig)),
        ("friction", lambda: cases.friction(rig, **form.friction)),
        ("bushing", lambda: cases.bushing(rig, **form.bushing)),
        ("speed", lambda: cases.speed(rig, **form.speed)),
        ("loop", lambda: cases.loop(rig, **form.loop)),
        ("initial state", lambda: cases.states(rig, **form.states)),
        ("step and stiffness", lambda: stability_map(rig, **form.stability_map)),
        ("random scenes", lambda: random_scenes.random_scenes(rig, form.scenes)),
    )

    def take(name, found):
        for row in found:
            rows.append(row)
            if row["outcome"] == DEFECT:
                say(f"defect: {row['family']}: {row['case']}: {row['reason']}")
        say(f"{name}: {len(rows)} rows so far")

    # first, while this process is still small: growth of the memory is the long run's own
    chunks = run_long(rig, form.seconds, form.turns)
    take("long run", long_run(chunks))
    for name, found in families:
        take(name, found())
    table = as_table(rows)
    failed = table[(table["family"] == "random scenes") & (table["outcome"] == DEFECT)]["case"]
    seeds = {
        "seed": random_scenes.SEED,
        "scenes": form.scenes,
        "hypothesis": _version("hypothesis"),
        "failures": [random_scenes.smallest(rig, json.loads(case)) for case in failed],
    }
    return Extremes(table, chunks, seeds)


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""

"""Is the short answer right? Runs that stop when the answer is known, beside records of many revolutions."""

from itertools import product

import pandas as pd

from trackdyn.measure.stopping import run_until
from trackdyn.measure.whole_loop import RELATIVE, SHARES, whole_loop
from trackdyn.parameters.rig import Rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.settled_loops import SettledLoops
from trackdyn.simulation.simulate import simulate
from replication.study.accuracy.statistics import scene_name
from replication.study.settings import Allowed, WholeLoopForm, allowed_step

COLUMNS = [
    "scene",
    "measure",
    "tolerance",
    "known",
    "short",
    "short_half_width",
    "short_s",
    "long",
    "long_half_width",
    "long_s",
    "difference",
    "within",
]


def compare_answers(rig: Rig, form: WholeLoopForm, steps: Allowed) -> pd.DataFrame:
    """Short and long answer of every measure in every scene.

    Returns
    -------
    DataFrame
        A row a scene and measure: both values with half of their 95 % intervals, seconds simulated at constant speed,
        and ``within``: do the values differ by no more than both intervals allow (root of the sum of squares)?
    """
    tolerances = dict.fromkeys(RELATIVE, form.relative_tolerance) | dict.fromkeys(SHARES, form.share_tolerance)
    rows, starts = [], SettledLoops()
    for rpm, radius in product(form.speeds_rpm, form.radii_m):
        scene = Scene(rig, rpm, radius, step=allowed_step(steps, radius), lead_in=form.lead_in_s)
        answer = run_until(scene, tolerances, form.longest_s, starts=starts)
        seconds = round(form.loop_turns / scene.loop_frequency, 1)
        truth = whole_loop(simulate(scene.with_(duration=seconds, every_link=True), starts=starts))
        used = len(answer.recording.time) / answer.recording.rate
        for name, tolerance in tolerances.items():
            if name in answer.measures and name in truth:
                short, long = answer.measures[name], truth[name]
                off = short.value - long.value
                within = abs(off) <= (short.half_width**2 + long.half_width**2) ** 0.5
                rows.append(
                    [
                        scene_name(rpm, radius),
                        name,
                        tolerance,
                        answer.reached[name],
                        short.value,
                        short.half_width,
                        used,
                        long.value,
                        long.half_width,
                        seconds + form.lead_in_s,
                        off,
                        within,
                    ]
                )
        print(rows[-1][0], flush=True)
    return pd.DataFrame(rows, columns=COLUMNS)

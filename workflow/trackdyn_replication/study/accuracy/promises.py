"""Test of the planner's promises: plans for scenes, run to their end, against limits over steps."""

from trackdyn.sweeps.snakemake_job import run_job

from collections.abc import Sequence

import numpy as np
import pandas as pd

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.files import write_csv
from trackdyn.measure.catalogue import TOLERATED, scale_of
from trackdyn.measure.planner import plan
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.scene.scene import Scene
from trackdyn_replication.study.accuracy.record_statistics import study_scene
from trackdyn_replication.study.accuracy.shared_loop import SharedLoop
from trackdyn_replication.study.accuracy.trade import limits_of, run_answer
from trackdyn_replication.study.settings import TradeStudy, promised_scenes, scene_name

LONGEST_RECORD = 60.0  # s of a record
PROMISES = [
    "scene", "measure", "tolerance", "achieved_error", "limit_error", "met", "setting", "step_s", "expected_error",
    "duration_s", "expected_cpu_s", "cpu_s", "trial_cpu_s", "reason",
]  # fmt: skip


def judge_promises(
    rig: Rig, rpm: float, ring: float | None, turns: int, steps: Sequence[float], tolerances: Sequence[float]
) -> pd.DataFrame:
    """Return the planner's promises for every measure of a scene, and the results, empty for one that it refuses."""
    base, rows = study_scene(rig, rpm, ring, turns, every_link=True), []
    limits = limits_of({step: run_answer(base.with_(step=step)).series for step in steps})
    for measure in (m for m in TOLERATED if m in limits and limits[m].value):
        limit = limits[measure]
        for tolerance in tolerances:
            row = {"scene": scene_name(rpm, ring), "measure": measure, "tolerance": tolerance}
            row["limit_error"] = limit.error / scale_of(measure, limit.value)
            try:
                chosen = plan(Scene(rig, rpm, ring), {measure: tolerance}, LONGEST_RECORD, loops=SharedLoop)
                begin = SharedLoop.clock()
                answer = chosen.run()
                value, seconds = answer.measures[measure].value, len(answer.recording.time) / rig.rate
                error = abs(value - limit.value) / scale_of(measure, limit.value)
                row |= {"cpu_s": SharedLoop.clock() - begin, "duration_s": seconds, "achieved_error": error}
                row |= {"met": bool(np.isfinite(error) and error <= tolerance), "step_s": chosen.scene.step}
                row |= {"setting": chosen.chosen.name, "expected_error": chosen.chosen.error[measure].bias}
                row |= {"expected_cpu_s": chosen.cpu_s, "trial_cpu_s": chosen.trial_cpu_s}
            except InputError as error:
                row["reason"] = str(error)
            rows.append(row)
    return pd.DataFrame(rows, columns=PROMISES)


@run_job
def main(job) -> None:
    """Rule `trade_promises`."""
    study = TradeStudy(**job.params.study)
    scene = promised_scenes(study)[job.wildcards.scenes]
    turns = study.statistics.loop_turns
    table = judge_promises(load_rig(job.input.rig), *scene, turns, study.limit_steps_s, study.promised)
    write_csv(job.output[0], table)

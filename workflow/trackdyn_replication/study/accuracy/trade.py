"""Accuracy against CPU time: work-precision data of the statistics of all links over fidelity, method and step."""

from trackdyn.sweeps.snakemake_job import run_job

from collections.abc import Mapping
from time import process_time
from typing import NamedTuple

import numpy as np
import pandas as pd

from trackdyn.inputs.errors import InputError, TrackdynError
from trackdyn.inputs.files import write_csv
from trackdyn.measure.catalogue import ABSOLUTE, SENSED, scale_of
from trackdyn.measure.sensor import whole_samples
from trackdyn.measure.uncertainty import Limit, Series, error_against, limit_of
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.scene.scene import Periods, Scene
from trackdyn.simulation.simulate import simulate
from trackdyn_replication.study.accuracy import record_statistics
from trackdyn_replication.study.accuracy.record_statistics import answers_of, statistics_of, study_scene
from trackdyn_replication.study.settings import StatisticErrors, TradeStudy, measured_scenes, scene_name
from trackdyn_replication.study.timed_run import timed_run
from trackdyn_replication.study.variants import PHYSICS

# error: against the limit; uncertainty: its standard error; scatter: standard error that one passage would leave, all
# three relative, in turns of the sprocket for shares; unused: passages of the record that give no value
COLUMNS = [
    "scene", "fidelity", "integrator", "step_s", "start_cpu_s", "cpu_s_per_s", "record_s", "passage_s", "measure",
    "value", "value_error", "error", "uncertainty", "scatter", "unused", "failed",
]  # fmt: skip
FULL_PHYSICS = next(iter(PHYSICS))  # that errors of the others are taken against
EXTRAPOLATED = "semi_implicit"  # over whose steps limits are extrapolated


class AnswerCost(NamedTuple):
    """Measures of a record of every link (`answers_of`), CPU seconds to settle its loop, and per simulated second."""

    series: dict[str, Series]
    start_cpu_s: float
    cpu_s_per_s: float


def run_answer(scene: Scene) -> AnswerCost:
    """Run a scene and measure all of its links; those of a belt are alike."""
    if scene.chain == "belt":
        begin = process_time()
        turns = record_statistics.BELT_TURNS
        scene = scene.with_(duration=whole_samples(scene.rig.rate, turns / scene.periods.loop_hz))
        statistics = statistics_of(simulate(scene))
        series = {name: Series(np.array([statistics[name]]), np.array([0])) for name in SENSED}
        return AnswerCost(series, process_time() - begin, 0.0)
    run = timed_run(scene)
    return AnswerCost(answers_of(run.recording), run.start_cpu_s, run.cpu_s_per_s)


def limits_of(runs: Mapping[float, Mapping[str, Series]]) -> dict[str, Limit]:
    """Return the limit of every measure from runs of the full physics, by step."""
    finest = dict(sorted(runs.items())[:3])
    first, *others = finest.values()
    names = [name for name in first if all(name in run and len(run[name].values) for run in (first, *others))]
    return {name: limit_of({step: run[name] for step, run in finest.items()}) for name in names}


def statistic_trade(rig: Rig, requested: StatisticErrors) -> pd.DataFrame:
    """Return errors of the measures of a record of every scene against their limits, and its cost (``COLUMNS``)."""
    rows, compiled, cases = [], set(), []
    for fidelity, physics in PHYSICS.items():
        steps = requested.steps_s if fidelity == FULL_PHYSICS else requested.coarse_steps_s
        methods = [{"integrator": method, "step": step} for method in steps for step in steps[method]]
        if fidelity in ("belt", "spatial"):  # a belt has none; explicit friction along the axes allows no larger step
            methods = [{"integrator": "semi_implicit", "step": 5e-5} if fidelity == "spatial" else {}]
        cases += [(fidelity, physics | method) for method in methods]
    for rpm, ring in requested.scenes:
        name = scene_name(rpm, ring)
        turns = requested.loop_turns_without_ring if ring is None else requested.loop_turns
        base = study_scene(rig, rpm, ring, turns, every_link=True, **record_statistics.TENSION)
        runs: dict[tuple, AnswerCost | None] = {}
        for fidelity, case in cases:
            point = (fidelity, case.get("integrator", "none"), case.get("step", np.nan))
            try:
                kind = (*point[:2], ring is None)
                if kind not in compiled:  # kernels are compiled before anything is timed
                    simulate(base.with_(**case, duration=0.01, lead_in=0.0, ramp=0.01))
                    compiled.add(kind)
                runs[point] = run_answer(base.with_(**case))
            except TrackdynError:
                runs[point] = None
            print(f"{name}, {', '.join(map(str, point))} s", flush=True)
        extrapolated = FULL_PHYSICS, EXTRAPOLATED
        fine = {point[2]: run.series for point, run in runs.items() if point[:2] == extrapolated and run}
        if len(fine) < 2:
            few = f"fewer than two steps of {EXTRAPOLATED} ran in this scene"
            raise InputError(f"trade: {name}: {few}; add finer steps")
        known = limits_of(fine)
        for point, run in runs.items():
            rows += _rows_of([name, *point], run, known, base.duration, Periods.at(rig, rpm).passage)
    return pd.DataFrame(rows, columns=COLUMNS)


def _rows_of(point: list, run: AnswerCost | None, limits: dict[str, Limit], seconds: float, span: float) -> list[list]:
    """Return rows of a setting: one per measure that has an error, or one for a failed run."""
    if run is None:
        return [[*point, *[np.nan] * 4, "all", *[np.nan] * 6, True]]
    rows = []
    for measure, measured in run.series.items():
        scale = scale_of(measure, limits[measure].value) if measure in limits else np.nan
        if not len(measured.values) or not np.isfinite(scale):
            continue
        value, error, _ = measured.estimate()
        bias, noise = error_against(measured, limits[measure])
        if measure in ABSOLUTE:  # a value of this record, without a limit
            about = [value, 0.0, abs(value), 0.0, 0.0, 0]
        else:
            unused = int(seconds / span + 1e-6) - len(measured.values)
            scatter = error * len(measured.values) ** 0.5
            about = [value, error, abs(bias) / scale, noise / scale, scatter / scale, unused]
        rows.append([*point, run.start_cpu_s, run.cpu_s_per_s, seconds, span, measure, *about, False])
    return rows


@run_job
def main(job) -> None:
    """Rule `trade_scene`."""
    requested = measured_scenes(TradeStudy(**job.params.study))[job.wildcards.scenes]
    write_csv(job.output[0], statistic_trade(load_rig(job.input.rig), requested))

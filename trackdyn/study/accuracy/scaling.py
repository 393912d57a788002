"""How a sweep of equal runs scales over processes: the one thing that is measured by the clock on the wall."""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from time import perf_counter

import numpy as np
import pandas as pd

from trackdyn.parameters.rig import Rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.simulate import simulate

PROCESSES, REPEATS = (1, 2), 3


def _job(arguments) -> float:
    rig, seconds = arguments
    begin = perf_counter()
    simulate(Scene(rig, motor_rpm=150.0, duration=seconds, lead_in=0.0))
    return perf_counter() - begin


def scaling(rig: Rig, runs: list[int], seconds: float) -> pd.DataFrame:
    """Wall time of equal runs on one and more processes, with the time a process takes to start.

    Columns ``jobs, processes, wall_s, job_s, start_s, model_s``: wall time and the median of a job's are the least of
    three repetitions, which what else the machine does disturbs least. The model is ``ceil(jobs / processes) * job``
    with the job's time on one process.
    """
    rows = []
    single = None
    for count in PROCESSES:
        begin = perf_counter()
        with ProcessPoolExecutor(count, mp_context=get_context("spawn")) as pool:
            list(pool.map(_job, [(rig, 0.01)] * count))
            start = perf_counter() - begin
            for number in runs:
                walls, jobs = [], []
                for _ in range(REPEATS):
                    begin = perf_counter()
                    jobs.append(float(np.median(list(pool.map(_job, [(rig, seconds)] * number)))))
                    walls.append(perf_counter() - begin)
                single = single or min(jobs)
                rows.append([number, count, min(walls), min(jobs), start, -(-number // count) * single])
    return pd.DataFrame(rows, columns=["jobs", "processes", "wall_s", "job_s", "start_s", "model_s"])

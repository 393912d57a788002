"""Accuracy against cost: work-precision data over fidelity, integrator and step.

Two kinds of error: the state after a short window, started from one and the same state, and the
statistics of a record. Each is taken against a reference of its own that a second method confirms.
What is refused or diverges is a point too.
"""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from time import perf_counter, process_time

import numpy as np
import pandas as pd

from trackdyn.errors import TrackdynError
from trackdyn.fidelity import PRESETS
from trackdyn.loop import Loop
from trackdyn.parameters.rig import Rig
from trackdyn.scene import Scene
from trackdyn.simulate import simulate
from trackdyn.study.accuracy.statistics import MEASURES, error_of, scene_name, statistics_of, study_scene
from trackdyn.study.settings import StateErrors, StatisticErrors, Steps

COLUMNS = ["scene", "fidelity", "integrator", "step_s", "wall_s_per_s", "cpu_s_per_s", "measure", "error", "failed"]
AGREEMENT = ["scene", "measure", "difference"]
# fidelity -> fields; the first is the physics that errors of the others are taken against
FIDELITIES = {
    "ten_arcs": {},
    "three_surfaces": {"tooth_contact": "three_surfaces"},
    "single_pin": {"chain": "single_pin"},
    "elastic_cut": {"closure": "elastic_damping"},
}
FULL_PHYSICS = next(iter(FIDELITIES))
# references: finest steps; confirmed by a second method
STATISTIC_REFERENCE = {"integrator": "semi_implicit", "step": 1e-5}
STATISTIC_CHECK = {"integrator": "rk4", "step": 2e-5}
STATE_REFERENCE = {"integrator": "adaptive", "step": 1e-3, "tolerance": 1e-9}
STATE_CHECK = {"integrator": "rk4", "step": 1e-6}
WINDOW = 0.1
# the cost is the median of so many bursts of so many seconds
BURSTS, BURST_SECONDS = 5, 0.1
PROCESSES, REPEATS = (1, 2), 3  # of the scaling
# motor speed and ring radius of the windows in steady motion
STEADY = {"ring 115 rpm": (115.0, 0.308), "ring 210 rpm": (210.0, 0.308), "no ring 115 rpm": (115.0, None)}


def cost(scene: Scene) -> tuple[float, float]:
    """Wall and CPU seconds per simulated second, medians over bursts on one thread, compilation apart."""
    loop = Loop(scene)
    record = loop.room(round(BURST_SECONDS * scene.rig.sensor.rate), pitches=(1,), spells=40000)
    spent = []
    for _ in range(BURSTS + 2):
        record.spells.count[0] = 0
        begin = np.array([perf_counter(), process_time()])
        loop.fill(record)
        spent.append(np.array([perf_counter(), process_time()]) - begin)
    wall, cpu = np.median(spent[2:], axis=0) / BURST_SECONDS  # the first two compile and leave the ramp
    return float(wall), float(cpu)


def window_start(rig: Rig, name: str) -> Loop:
    """The loop that a state error starts from, its scene that of the window."""
    short = {"duration": WINDOW, "spells": False}
    if name == "one impact":  # the motor jerks a resting loop without ring: its teeth strike the connectors
        scene = Scene(rig, motor_rpm=115.0, ring_radius=None, ramp=0.01, lead_in=0.0, **short)
        return Loop(scene)
    if name == "settling under gravity":  # a loop settled without weight feels it from one moment to the next
        scene = Scene(rig.changed(gravity=0.0), motor_rpm=0.0, ring_radius=0.308, lead_in=0.0, **short)
        return Loop(scene).changed(rig=rig)
    rpm, ring = STEADY[name]
    scene = Scene(rig, motor_rpm=rpm, ring_radius=ring, lead_in=1.0, **short)
    # driven with the finest explicit step of the pipeline
    driven = Loop(scene.with_(**PRESETS["paper"]))
    driven.fill(driven.room(round((scene.ramp + scene.lead_in) * rig.sensor.rate)))
    return driven.changed(step=scene.step)


def _window(start: Loop, fields: dict) -> tuple[Loop, float]:
    """The loop after the window, and the mean step taken (s)."""
    loop = start.changed(**fields)
    loop.fill(loop.room(round(WINDOW * loop.scene.rig.sensor.rate)))
    stages = loop.work.stages
    taken = round(WINDOW / loop.scene.step) if stages is None else int(stages.counts[0])
    return loop, WINDOW / max(taken, 1)


def _each_step(steps: Steps) -> list[dict]:
    return [{"integrator": method, "step": step} for method in steps for step in steps[method]]


def state_trade(rig: Rig, asked: StateErrors) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Largest error of any mass centre after the window (m), and how well two references agree.

    Returns
    -------
    rows : DataFrame
        ``COLUMNS``; measure ``state_m``. The adaptive integrator's ``step_s`` is its mean step.
    agreement : DataFrame
        scene, measure, difference of the two references.
    """
    rows, agreement = [], []
    cases = [(fields["integrator"], fields) for fields in _each_step(asked.steps_s)]
    cases += [(f"adaptive {t:g}", STATE_REFERENCE | {"tolerance": t}) for t in asked.tolerances]
    for name in asked.scenes:
        start = window_start(rig, name)
        reference, check = (_window(start, f)[0].mass_centres for f in (STATE_REFERENCE, STATE_CHECK))
        agreement.append([name, "state_m", float(np.abs(reference - check).max())])
        for label, fields in cases:
            try:
                loop, step = _window(start, fields)
                error = float(np.hypot(*(loop.mass_centres - reference).T).max())
                rows.append([name, FULL_PHYSICS, label, step, *cost(loop.scene), "state_m", error, False])
            except TrackdynError:
                rows.append([name, FULL_PHYSICS, label, fields["step"], np.nan, np.nan, "state_m", np.nan, True])
        print(f"state error: {name}", flush=True)
    return pd.DataFrame(rows, columns=COLUMNS), pd.DataFrame(agreement, columns=AGREEMENT)


def statistic_trade(rig: Rig, asked: StatisticErrors) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Error of the statistics of a record of every scene, as `state_trade` gives them."""
    rows, agreement = [], []
    cases = [
        (fidelity, physics | fields)
        for fidelity, physics in FIDELITIES.items()
        for fields in _each_step(asked.steps_s if fidelity == FULL_PHYSICS else asked.coarse_steps_s)
    ]
    for rpm, ring in asked.scenes:
        name = scene_name(rpm, ring)
        base = study_scene(rig, rpm, ring, asked.loop_turns)
        reference = statistics_of(simulate(base.with_(**STATISTIC_REFERENCE)))
        known = [measure for measure in MEASURES if np.isfinite(reference[measure])]
        if asked.second_reference:
            second = statistics_of(simulate(base.with_(**STATISTIC_CHECK)))
            agreement += [[name, measure, error_of(measure, second[measure], reference[measure])] for measure in known]
        for fidelity, fields in cases:
            point = [name, fidelity, fields["integrator"], fields["step"]]
            try:
                scene = base.with_(**fields)
                spent = cost(scene)
                found = statistics_of(simulate(scene))
                errors = {measure: error_of(measure, found[measure], reference[measure]) for measure in MEASURES}
                rows += [[*point, *spent, measure, e, False] for measure, e in errors.items() if np.isfinite(e)]
            except TrackdynError:
                rows.append([*point, np.nan, np.nan, "all", np.nan, True])
            print(f"{', '.join(map(str, point))} s", flush=True)
    return pd.DataFrame(rows, columns=COLUMNS), pd.DataFrame(agreement, columns=AGREEMENT)


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


def pareto(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows that no other row beats in both cost and error (one scene and one measure)."""
    ordered = rows.loc[~rows["failed"]].sort_values(["wall_s_per_s", "error"])
    return ordered[ordered["error"] < ordered["error"].cummin().shift(fill_value=np.inf)]

"""Accuracy against cost: work-precision data over fidelity, integrator and step.

Two kinds of error: the state after a short window, started from one and the same state, against a run of many digits,
and the statistics of a record, against their limit over steps; a second method confirms both. Statistics are taken
over all links and have standard errors, so that what the step adds can be told from scatter. What is refused or
diverges is a point too. Cost is the CPU time of the process: other jobs may run beside.
"""

from time import process_time
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from replication.study.accuracy.limit import LIMITS, Limit, difference, limit_of
from replication.study.accuracy.statistics import ABSOLUTE, TENSION, answers_of, scale_of, study_scene
from replication.study.settings import StateErrors, StatisticErrors, Steps, scene_name
from trackdyn.errors import InputError, TrackdynError
from trackdyn.measure.whole_loop import Series
from trackdyn.parameters.rig import Rig
from trackdyn.scene.fidelity import PRESETS
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.settled_loops import SettledLoops
from trackdyn.simulation.simulate import simulate

# error: against the limit; uncertainty: its standard error; scatter: standard error that one passage would leave, all
# three relative, in turns of the sprocket for shares; unused: passages of the record that give no value
COLUMNS = [
    "scene",
    "fidelity",
    "integrator",
    "step_s",
    "start_cpu_s",
    "cpu_s_per_s",
    "record_s",
    "passage_s",
    "measure",
    "value",
    "value_error",
    "error",
    "uncertainty",
    "scatter",
    "unused",
    "failed",
]
AGREEMENT = ["scene", "measure", "difference", "uncertainty"]
# fidelity -> fields; the first is the physics that errors of the others are taken against
FIDELITIES = {
    "ten_arcs": {},
    "three_surfaces": {"tooth_contact": "three_surfaces"},
    "single_pin": {"chain": "single_pin"},
    "elastic_cut": {"closure": "elastic_damping"},
}
FULL_PHYSICS = next(iter(FIDELITIES))
# limits of statistics: over the steps of the first method, confirmed by the second's finest
EXTRAPOLATED, SECOND = "semi_implicit", "rk4"
# references of the state, of different method
STATE_REFERENCE = {"integrator": "adaptive", "step": 1e-3, "tolerance": 1e-9}
STATE_CHECK = {"integrator": "rk4", "step": 1e-6}
WINDOW = 0.1
# the cost is the median of so many bursts of so many seconds
BURSTS, BURST_SECONDS = 5, 0.1
# motor speed and ring radius of the windows in steady motion
STEADY = {"ring 115 rpm": (115.0, 0.308), "ring 210 rpm": (210.0, 0.308), "no ring 115 rpm": (115.0, None)}


class AnswerCost(NamedTuple):
    """What a record of every link gave (`answers_of`), the CPU seconds to settle its loop, and those of a
    simulated one.
    """

    found: dict[str, Series]
    start_cpu_s: float
    cpu_s_per_s: float


def step_cost(scene: Scene, starts: SettledLoops | None = None) -> float:
    """CPU seconds per simulated second, median over bursts on one thread, compilation apart."""
    loop = Loop(scene, starts)
    record = loop.room(round(BURST_SECONDS * scene.rig.sensor.rate), pitches=(1,), spells=40000)
    spent = []
    for _ in range(BURSTS + 2):
        record.spells.count[0] = 0
        begin = process_time()
        loop.fill(record)
        spent.append(process_time() - begin)
    return float(np.median(spent[2:])) / BURST_SECONDS  # the first two compile and leave the ramp


def window_start(rig: Rig, name: str) -> Loop:
    """The loop that a state error starts from, its scene that of the window."""
    short = {"duration": WINDOW, "spells": False} | TENSION
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
        starts = SettledLoops()
        start = window_start(rig, name)
        reference, check = (_window(start, f)[0].mass_centres for f in (STATE_REFERENCE, STATE_CHECK))
        agreement.append([name, "state_m", float(np.abs(reference - check).max()), 0.0])
        for label, fields in cases:
            try:
                loop, step = _window(start, fields)
                error = float(np.hypot(*(loop.mass_centres - reference).T).max())
                known = {"step_s": step, "cpu_s_per_s": step_cost(loop.scene, starts), "error": error, "failed": False}
            except TrackdynError:
                known = {"step_s": fields["step"], "failed": True}
            rows.append({"scene": name, "fidelity": FULL_PHYSICS, "integrator": label, "measure": "state_m"} | known)
        print(f"state error: {name}", flush=True)
    return pd.DataFrame(rows, columns=COLUMNS), pd.DataFrame(agreement, columns=AGREEMENT)


def timed_run(scene: Scene) -> tuple[Recording, float, float]:
    """A recording of every link, and the CPU seconds to settle its loop and of a simulated one."""
    begin = process_time()
    loop = Loop(scene)
    started = process_time()
    loop.advance(scene.ramp + scene.lead_in)
    recording = loop.record(scene.duration, spells=scene.spells, every_link=True)
    seconds = scene.ramp + scene.lead_in + scene.duration
    return recording, started - begin, (process_time() - started) / seconds


def run_answer(scene: Scene) -> AnswerCost:
    """Run a scene and measure all of its links."""
    recording, *spent = timed_run(scene)
    return AnswerCost(answers_of(recording), *spent)


def limits_of(runs: dict[float, AnswerCost]) -> dict[str, Limit]:
    """Limit of every measure from runs of the full physics, by step."""
    finest = dict(sorted(runs.items())[:3])
    found = [run.found for run in finest.values()]
    names = [name for name in found[0] if all(name in one and len(one[name].values) for one in found)]
    return {name: limit_of({step: run.found[name] for step, run in finest.items()}) for name in names}


def statistic_trade(rig: Rig, asked: StatisticErrors, **fields: Any) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Error of the measures of a record of every scene against their limits, and what the record took.

    ``fields`` are those of every scene.

    Returns
    -------
    rows : DataFrame
        ``COLUMNS``.
    agreement : DataFrame
        scene, measure, difference of the limit from the finest run of a method of another order.
    limits : DataFrame
        ``limit.LIMITS``.
    """
    rows, agreement, limits, compiled = [], [], [], set()
    cases = [
        (fidelity, physics | method)
        for fidelity, physics in FIDELITIES.items()
        for method in _each_step(asked.steps_s if fidelity == FULL_PHYSICS else asked.coarse_steps_s)
    ]
    for rpm, ring in asked.scenes:
        name = scene_name(rpm, ring)
        turns = asked.loop_turns_without_ring if ring is None else asked.loop_turns
        base = study_scene(rig, rpm, ring, turns, every_link=True, **(TENSION | fields))
        runs: dict[tuple, AnswerCost | None] = {}
        for fidelity, case in cases:
            point = (fidelity, case["integrator"], case["step"])
            try:
                if (
                    kind := (*point[:2], ring is None)
                ) not in compiled:  # kernels are compiled before anything is timed
                    simulate(base.with_(**case, duration=0.01, lead_in=0.0, ramp=0.01))
                    compiled.add(kind)
                runs[point] = run_answer(base.with_(**case))
            except TrackdynError:
                runs[point] = None
            print(f"{name}, {', '.join(map(str, point))} s", flush=True)
        fine, second = (
            {
                step: run
                for (physics, method, step), run in runs.items()
                if (physics, method) == (FULL_PHYSICS, which) and run
            }
            for which in (EXTRAPOLATED, SECOND)
        )
        if len(fine) < 2:
            raise InputError(
                f"trade: {name}: fewer than two steps of {EXTRAPOLATED} ran in this scene; add finer steps"
            )
        known = limits_of(fine)
        for point, run in runs.items():
            rows += _rows_of([name, *point], run, known, base.duration, rig.loop_period(rpm) / rig.chain.pitches)
        for measure, limit in known.items():
            if measure not in ABSOLUTE:
                finest = fine[min(fine)].found[measure].estimate()
                limits.append([name, measure, limit.value, limit.error, *finest[:2], min(fine)])
                if asked.second_reference and second and measure in second[min(second)].found:
                    off, noise = difference(second[min(second)].found[measure], limit)
                    scale = scale_of(measure, limit.value)
                    agreement.append([name, measure, abs(off) / scale, noise / scale])
    return (
        pd.DataFrame(rows, columns=COLUMNS),
        pd.DataFrame(agreement, columns=AGREEMENT),
        pd.DataFrame(limits, columns=LIMITS),
    )


def _rows_of(point: list, run: AnswerCost | None, limits: dict[str, Limit], seconds: float, span: float) -> list[list]:
    """Rows of a setting: one a measure that has an error, or one that says that it failed."""
    if run is None:
        return [[*point, *[np.nan] * 4, "all", *[np.nan] * 6, True]]
    rows = []
    for measure, found in run.found.items():
        if (
            measure not in limits
            or not len(found.values)
            or not np.isfinite(scale := scale_of(measure, limits[measure].value))
        ):
            continue
        value, error, _ = found.estimate()
        off, noise = difference(found, limits[measure])
        if measure in ABSOLUTE:  # of the very record, and compared with nothing
            about = [value, 0.0, abs(value), 0.0, 0.0, 0]
        else:
            unused = int(seconds / span + 1e-6) - len(found.values)
            about = [value, error, abs(off) / scale, noise / scale, error * len(found.values) ** 0.5 / scale, unused]
        rows.append([*point, run.start_cpu_s, run.cpu_s_per_s, seconds, span, measure, *about, False])
    return rows


def pareto(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows that no other row beats in both cost and error (one scene and one measure)."""
    ordered = rows.loc[~rows["failed"]].sort_values(["cpu_s_per_s", "error"])
    return ordered[ordered["error"] < ordered["error"].cummin().shift(fill_value=np.inf)]

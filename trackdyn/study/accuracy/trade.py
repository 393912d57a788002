"""Accuracy against cost: work-precision data over fidelity, integrator and step.

Two kinds of error: the state after a short window, started from one and the same state, and the
statistics of a record. Each is taken against a reference of its own that a second method confirms.
What is refused or diverges is a point too.
"""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from time import perf_counter

import numpy as np
import pandas as pd

from trackdyn.errors import TrackdynError
from trackdyn.fidelity import PRESETS
from trackdyn.integrate.run import run
from trackdyn.model import make_buffers
from trackdyn.scene import Scene, build_model
from trackdyn.settling import empty_record, settle
from trackdyn.simulate import run_options, simulate
from trackdyn.study.accuracy.statistics import MEASURES, cost, error_of, mass_centres, statistics_of, study_scene

COLUMNS = ["scene", "fidelity", "integrator", "step_s", "wall_s_per_s", "cpu_s_per_s", "measure", "error", "failed"]
# fidelity -> fields; the first is the physics that errors of the others are taken against
FIDELITIES = {
    "ten_arcs": {},
    "three_surfaces": {"tooth_contact": "three_surfaces"},
    "single_pin": {"chain": "single_pin"},
    "elastic_cut": {"closure": "elastic_damping"},
}
FULL_PHYSICS = next(iter(FIDELITIES))
STATISTIC_STEPS = {
    "semi_implicit": (2e-5, 5e-5, 1e-4, 1.25e-4, 2e-4, 5e-4),
    "linearly_implicit": (1e-4, 2e-4, 2.5e-4, 5e-4, 1e-3),
    "rk4": (5e-5, 1e-4, 2e-4),
}
STATE_STEPS = {
    "semi_implicit": (1e-6, 2e-6, 5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4),
    "linearly_implicit": (5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4),
    "rk4": (5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4),
}
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
# references: finest steps; confirmed by a second method
STATISTIC_REFERENCE = {"integrator": "semi_implicit", "step": 1e-5}
STATISTIC_CHECK = {"integrator": "rk4", "step": 2e-5}
STATE_REFERENCE = {"integrator": "adaptive", "step": 1e-3, "tolerance": 1e-9}
STATE_CHECK = {"integrator": "rk4", "step": 1e-6}
WINDOW = 0.1


def _driven(scene: Scene):
    """A loop in steady motion: settled and driven with the finest explicit step of the pipeline."""
    start = scene.with_(**PRESETS["paper"])
    model, state, work, layout = settle(start)
    samples = round((start.ramp + start.lead_in) * start.rig.sensor.rate)
    record = empty_record(samples, len(state.angle), 3)
    run(model, state, work, record, 0, samples, start.stride)
    return state, layout["tensioner_shift_m"]


def window_starts(rig) -> dict:
    """Scenes of the state error with the state each starts from: name -> (scene, state, tensioner shift)."""
    short = {"duration": WINDOW, "spells": False}
    found = {}
    for name, rpm, ring in (
        ("ring 115 rpm", 115.0, 0.308),
        ("ring 210 rpm", 210.0, 0.308),
        ("no ring 115 rpm", 115.0, None),
    ):
        scene = Scene(rig, motor_rpm=rpm, ring_radius=ring, lead_in=1.0, **short)
        found[name] = (scene, *_driven(scene))
    # the motor jerks a resting loop without ring: its teeth strike the connectors
    impact = Scene(rig, motor_rpm=115.0, ring_radius=None, ramp=0.01, lead_in=0.0, **short)
    _, state, _, layout = settle(impact)
    found["one impact"] = (impact, state, layout["tensioner_shift_m"])
    # a loop settled without weight feels gravity from one moment to the next
    weightless = Scene(rig.changed(gravity=0.0), motor_rpm=0.0, ring_radius=0.308, lead_in=0.0, **short)
    _, state, _, layout = settle(weightless)
    found["settling under gravity"] = (weightless.with_(rig=rig), state, layout["tensioner_shift_m"])
    return found


def _window(scene: Scene, start, shift: float, fields: dict):
    """Mass centres after the window, and the mean step taken (s)."""
    scene = scene.with_(**fields)
    model = build_model(scene, shift)
    state = type(start)(*(array.copy() for array in start))
    # the clock of the ramp goes on: steps are counted in the step of this run
    state.steps[0] = round(start.steps[0] * PRESETS["paper"]["step"] / scene.step)
    options = run_options(scene, model, state)
    work = make_buffers(len(state.angle), len(model.wheels.x), scene.rig.chain.pitches)
    samples = round(WINDOW * scene.rig.sensor.rate)
    bad = run(model, state, work, empty_record(samples, len(state.angle), 3), 0, samples, scene.stride, **options)
    if bad >= 0:
        raise TrackdynError("left the physical range")
    taken = options["stages"].counts[0] if scene.integrator == "adaptive" else round(WINDOW / scene.step)
    return mass_centres(model, state, work), WINDOW / max(int(taken), 1)


def state_trade(rig, steps=STATE_STEPS, tolerances=TOLERANCES, names=None) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Largest error of any mass centre after the window (m), and how well two references agree.

    Returns
    -------
    rows : DataFrame
        ``COLUMNS``; measure ``state_m``. The adaptive integrator's ``step_s`` is its mean step.
    agreement : DataFrame
        scene, measure, difference of the two references.
    """
    rows, agreement = [], []
    for name, (scene, start, shift) in window_starts(rig).items():
        if names is not None and name not in names:
            continue
        reference, _ = _window(scene, start, shift, STATE_REFERENCE)
        check, _ = _window(scene, start, shift, STATE_CHECK)
        agreement.append([name, "state_m", float(np.abs(reference - check).max())])
        cases = [(method, {"integrator": method, "step": step}) for method in steps for step in steps[method]]
        cases += [
            (f"adaptive {tolerance:g}", {"integrator": "adaptive", "step": 1e-3, "tolerance": tolerance})
            for tolerance in tolerances
        ]
        for label, fields in cases:
            try:
                centres, step = _window(scene, start, shift, fields)
                wall, cpu = cost(scene.with_(**fields))
                error = float(np.hypot(*(centres - reference).T).max())
                rows.append([name, "ten_arcs", label, step, wall, cpu, "state_m", error, False])
            except TrackdynError:
                rows.append([name, "ten_arcs", label, fields["step"], np.nan, np.nan, "state_m", np.nan, True])
        print(f"state error: {name}", flush=True)
    return pd.DataFrame(rows, columns=COLUMNS), pd.DataFrame(agreement, columns=["scene", "measure", "difference"])


# steps at which the coarser physics are run
COARSE_STEPS = {"semi_implicit": (1e-4,), "linearly_implicit": (2.5e-4, 5e-4)}


def statistic_cases(steps=STATISTIC_STEPS, coarse=COARSE_STEPS) -> list[tuple[str, dict]]:
    """Fidelity and fields of every point: ``steps`` for the full physics, ``coarse`` for the rest."""
    cases = [("ten_arcs", {"integrator": method, "step": step}) for method in steps for step in steps[method]]
    for name, fields in list(FIDELITIES.items())[1:]:
        cases += [(name, fields | {"integrator": method, "step": step}) for method in coarse for step in coarse[method]]
    return cases


def scene_name(rpm: float, ring: float | None) -> str:
    """``no ring 115 rpm`` or ``ring 0.308 m 115 rpm``."""
    return f"{'no ring' if ring is None else f'ring {ring:g} m'} {rpm:g} rpm"


def statistic_trade(
    rig, scenes: list[tuple[float, float | None]], turns: int, steps=STATISTIC_STEPS, coarse=COARSE_STEPS, check=True
):
    """Error of the statistics of a record at each (rpm, ring radius) of ``scenes``.

    Returns
    -------
    rows, agreement : DataFrames
        As in `state_trade`.
    """
    rows, agreement = [], []
    for rpm, ring in scenes:
        name = scene_name(rpm, ring)
        base = study_scene(rig, rpm, ring, turns)
        reference = statistics_of(simulate(base.with_(**STATISTIC_REFERENCE)))
        if check:
            second = statistics_of(simulate(base.with_(**STATISTIC_CHECK)))
            agreement += [
                [name, m, error_of(m, second[m], reference[m])] for m in MEASURES if np.isfinite(reference[m])
            ]
        for fidelity, fields in statistic_cases(steps, coarse):
            label, step = fields["integrator"], fields["step"]
            try:
                scene = base.with_(**fields)
                wall, cpu = cost(scene)
                found = statistics_of(simulate(scene))
                for measure in MEASURES:
                    error = error_of(measure, found[measure], reference[measure])
                    if np.isfinite(error):
                        rows.append([name, fidelity, label, step, wall, cpu, measure, error, False])
            except TrackdynError:
                rows.append([name, fidelity, label, step, np.nan, np.nan, "all", np.nan, True])
            print(f"{name}: {fidelity}, {label}, {step:g} s", flush=True)
    return pd.DataFrame(rows, columns=COLUMNS), pd.DataFrame(agreement, columns=["scene", "measure", "difference"])


def _job(arguments) -> float:
    rig, seconds = arguments
    begin = perf_counter()
    simulate(Scene(rig, motor_rpm=150.0, duration=seconds, lead_in=0.0))
    return perf_counter() - begin


def scaling(rig, jobs=(1, 2, 4, 8), processes=(1, 2), seconds=20.0) -> pd.DataFrame:
    """Wall time of equal runs on one and more processes, with the time a process takes to start.

    Columns ``jobs, processes, wall_s, job_s, start_s, model_s``: the model is
    ``start + ceil(jobs / processes) * job`` with the job's time on one process.
    """
    rows = []
    single = None
    for count in processes:
        begin = perf_counter()
        with ProcessPoolExecutor(count, mp_context=get_context("spawn")) as pool:
            list(pool.map(_job, [(rig, 0.01)] * count))
            start = perf_counter() - begin
            for number in jobs:
                begin = perf_counter()
                times = list(pool.map(_job, [(rig, seconds)] * number))
                wall = perf_counter() - begin
                single = single or float(np.median(times))
                model = -(-number // count) * single
                rows.append([number, count, wall, float(np.median(times)), start, model])
    return pd.DataFrame(rows, columns=["jobs", "processes", "wall_s", "job_s", "start_s", "model_s"])


def pareto(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows that no other row beats in both cost and error (one scene and one measure)."""
    ordered = rows.loc[~rows["failed"]].sort_values(["wall_s_per_s", "error"])
    return ordered[ordered["error"] < ordered["error"].cummin().shift(fill_value=np.inf)]

"""What an answer of equal error costs in both codes: one scene, one measure, each code against its own limit.

The measure is the RMS of the acceleration of all links' mass centres, from positions a sample apart: what both codes
give alike. Both start from the same settled loop, leave the same time out and are measured over the same passages; the
loop is driven on one thread. The record that a tolerance needs follows from error and scatter of each setting, as the
planner's does.
"""

from trackdyn.sweeps.snakemake_job import run_job

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from itertools import pairwise
from time import process_time

import numpy as np
import pandas as pd

from replication.peers import OURS, PEER
from replication.peers.comparison import run_peer
from replication.peers.exudyn_loop import require_exudyn
from replication.study.accuracy.limit import difference, limit_of
from replication.study.settings import PEER_LAWS, PeerAnswers
from trackdyn.errors import DivergenceError, InputError
from trackdyn.files import write_csv
from trackdyn.measure.convergence import LEAST, SURE, Series, student
from trackdyn.measure.sensor import whole_samples
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.scene.scene import Periods, Scene
from trackdyn.simulation.loop import Loop

COLUMNS = [
    "code", "method", "step_s", "rms_m_s2", "difference_pct", "uncertainty_pct", "scatter_pct", "cpu_s_per_s",
    "passages", "cpu_s", "chosen", "note",
]  # fmt: skip
METHOD = "generalized alpha"  # of Exudyn
# of the methods over whose steps limits are extrapolated (`integrate.methods`; Chung and Hulbert, J. Appl. Mech. 60,
# 1993)
ORDERS = {"semi_implicit": 1, METHOD: 2}
MOST = 3000  # passages


def measured_accelerations(centre: np.ndarray, rate: float, span: float) -> Series:
    """Mean square acceleration of all links, passage by passage.

    ``centre``, (s, p, 2), are mass centres of the links, m, at ``rate`` (Hz); a passage takes ``span`` (s).
    """
    square = ((np.diff(centre, 2, axis=0) * rate**2) ** 2).sum(axis=2).mean(axis=1)
    count = int(len(square) / rate / span + 1e-6)
    edges = np.rint(np.arange(count + 1) * span * rate).astype(int)
    return Series(np.array([square[a:b].mean() for a, b in pairwise(edges)]), np.arange(count), root=True)


def ours(scene: Scene) -> tuple[np.ndarray, float, float]:
    """Mass centres of the links at every sample of a record (s, p, 2), m; CPU s to settle and of a simulated second."""
    begin = process_time()
    loop = Loop(scene)
    settled = process_time()
    loop.advance(scene.ramp + scene.lead_in)
    frames = loop.record(scene.duration, frame_interval=1 / scene.rig.sensor.rate, contact_log=False).frame
    spent = process_time() - settled
    chain, angle = loop.model.chain, frames[:, 2:-1]
    cos, sin = np.cos(angle), np.sin(angle)
    steps = np.stack([chain.length * cos, chain.length * sin], axis=2)
    pins = frames[:, None, :2] + np.cumsum(steps, axis=1) - steps
    arm = np.stack([chain.com_x * cos - chain.com_y * sin, chain.com_x * sin + chain.com_y * cos], axis=2)
    return (pins + arm)[:, ::2], settled - begin, spent / (scene.ramp + scene.lead_in + scene.duration)


def theirs(scene: Scene, step: float) -> tuple[np.ndarray, float, float]:
    """The same of Exudyn; to settle the loop with this simulator and to assemble the system count as settling."""
    begin = process_time()
    run, _ = run_peer(scene.with_(duration=scene.lead_in + scene.duration, lead_in=0.0), step)
    seconds = scene.ramp + scene.lead_in + scene.duration
    first = round((scene.ramp + scene.lead_in) * scene.rig.sensor.rate) + 1
    return run.centre[first:, ::2], process_time() - begin - run.cpu, run.cpu / seconds


def compare_answers(rig: Rig, requested: PeerAnswers) -> pd.DataFrame:
    """CPU seconds that every setting of both codes takes for one tolerance.

    Returns
    -------
    DataFrame
        ``COLUMNS``. The error of a setting is that against the limit over steps of its own code, ``uncertainty_pct``
        its standard error, ``scatter_pct`` that of a single passage; ``passages`` are those that the tolerance needs
        and ``cpu_s`` is what the whole answer takes then, both empty where the setting is too coarse. The cheapest of
        a code is ``chosen``.
    """
    span = Periods.at(rig, requested.speed_rpm).passage
    seconds = whole_samples(rig.sensor.rate, requested.passages * span + 0.01)
    about = {"duration": seconds, "lead_in": requested.lead_in_s}
    about |= PEER_LAWS | {"tension": "locked", "contact_log": False}
    scene = Scene(rig, requested.speed_rpm, requested.ring_radius_m, ramp=requested.ramp_s, **about)
    brief = scene.with_(lead_in=0.0, duration=whole_samples(rig.sensor.rate, 0.01))

    def rows(code: str, steps: dict[str, list[float]], extrapolated: str, run: Callable) -> list[dict]:
        for method, sizes in steps.items():  # what is compiled at the first run is there before anything is timed
            with suppress(DivergenceError, InputError):
                run(brief, method, max(sizes))
        settings = [(method, step) for method, sizes in steps.items() for step in sizes]
        return _answers(code, settings, extrapolated, requested, span, rig.sensor.rate, partial(run, scene))

    def trackdyn(scene: Scene, method: str, step: float):
        return ours(scene.with_(integrator=method, step=step))

    table = rows(OURS, requested.steps_s, "semi_implicit", trackdyn)
    try:
        require_exudyn()
    except InputError as error:
        table.append({"code": PEER, "note": f"not run: {error}"})
    else:
        table += rows(PEER, {METHOD: requested.exudyn_steps_s}, METHOD, lambda scene, _, step: theirs(scene, step))
    return pd.DataFrame(table, columns=COLUMNS)


def _answers(
    code: str, settings: list[tuple[str, float]], extrapolated: str, requested: PeerAnswers, span: float,
    rate: float, run: Callable,
) -> list[dict]:  # fmt: skip
    """Rows of a code."""
    measured, spent, rows = {}, {}, []
    for setting in settings:
        try:
            centre, *spent[setting] = run(*setting)
            measured[setting] = measured_accelerations(centre, rate, span)
        except (DivergenceError, InputError) as error:
            rows.append({"code": code, "method": setting[0], "step_s": setting[1], "note": str(error)})
        print(f"{code}, {setting[0]}, {setting[1]:g} s", flush=True)
    fine = {step: series for (method, step), series in measured.items() if method == extrapolated}
    if len(fine) < 2:
        raise InputError(f"peer_answers: fewer than two steps of {code} ran; add finer steps")
    limit = limit_of(fine, ORDERS[extrapolated])
    passages = np.arange(LEAST, MOST)
    for (method, step), series in measured.items():
        estimate = series.estimate()
        off, noise = (value / limit.value for value in difference(series, limit))
        scatter = estimate.error / limit.value * len(series.values) ** 0.5
        start, per_second = spent[method, step]
        row = {"code": code, "method": method, "step_s": step, "rms_m_s2": estimate.value, "difference_pct": 100 * off}
        row |= {"uncertainty_pct": 100 * noise, "scatter_pct": 100 * scatter, "cpu_s_per_s": per_second}
        # half of the 95 % interval of a mean of so many passages, by batch means (`convergence.batch_error`)
        batches = passages // np.sqrt(passages).astype(int)
        enough = (
            abs(off) + SURE * noise + np.vectorize(student)(batches) * scatter / np.sqrt(passages)
            <= requested.tolerance
        )
        if enough.any():
            count = int(passages[np.argmax(enough)])
            seconds = requested.ramp_s + requested.lead_in_s + count * span
            row |= {"passages": count, "cpu_s": start + per_second * seconds}
        rows.append(row)
    reached = [row for row in rows if "cpu_s" in row]
    if reached:
        min(reached, key=lambda row: row["cpu_s"])["chosen"] = "yes"
    return rows


def main(job) -> None:
    """Rule `peer_answers_runs`."""
    write_csv(job.output[0], compare_answers(load_rig(job.input.rig), PeerAnswers(**job.params.requested)))


if __name__ == "__main__":
    run_job(main)

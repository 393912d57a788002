"""Figure 14 and Table 2: the selected link in both codes, and their costs at equal accuracy."""

from trackdyn.sweeps.snakemake_job import run_job

import json
from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.files import write_csv, write_text
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.loop_arrays import allocate
from trackdyn.simulation.simulate import simulate
from trackdyn_replication.peers.contact import make_contacts
from trackdyn_replication.peers.exudyn_loop import PeerRun, free_wheels, require_exudyn, run_exudyn_loop
from trackdyn_replication.study.settings import peer_scene
from trackdyn_replication.study.timed_run import timed_run

OURS, PEER = "trackdyn", "exudyn"  # names of the codes, as tables have them


def percent_of_range(difference, reference) -> float:
    """Return the largest difference in percent of the range of the reference."""
    reference = np.asarray(reference)
    return float(100 * np.abs(difference).max() / (reference.max() - reference.min()))


def first_sample(scene: Scene) -> int:
    """Return the index of the other code's sample that is the recording's first."""
    return round(scene.ramp * scene.rig.rate) + 1


def run_peer(scene: Scene, step: float, watch: Callable | None = None) -> tuple[PeerRun, np.ndarray]:
    """Run the other code from the same settled start; return it with the vertical displacement at the samples, m."""
    loop = Loop(scene)
    times = scene.ramp + scene.duration, step, 1.0 / scene.rig.rate
    contacts, wheels = make_contacts(scene, loop.layout.tensioner_shift_m), free_wheels(scene, loop.model)
    run = run_exudyn_loop(loop.model, loop.state, *times, contacts, wheels, watch)
    return run, run.centre[first_sample(scene) :, 2 * (scene.rig.first_sensor.pitch - 1), 1]


def compare_codes(
    rig: Rig, speed_rpm: float, readings: Sequence[str], duration_s: float, steps_s: Sequence[float],
    exudyn_steps_s: Sequence[float], accuracy_pct: float,
) -> tuple[dict[str, pd.DataFrame], dict]:  # fmt: skip
    """Run both codes; without Exudyn, or if it has no such loop, only ours.

    ``readings`` are interpretations of the printed speed. Table 2 is made with the first one, recorded for
    ``duration_s`` after the ramp; another one takes a turn of the loop, in Exudyn with the largest step that turns the
    sprocket no further than that of the first. The smallest step of a code is its reference; the largest step whose
    error is below ``accuracy_pct`` of the range is chosen, the smallest without any.

    Tables are ``curves`` of the selected link by reading, that of a belt among them, which shows the sensitivity of the
    comparison; ``costs``: Table 2; ``summary`` by reading. For Figure 13: a ``frame`` of the other code where it ran,
    the ``shift`` of the tensioning wheel (m), and why the other code is ``missing``, else empty.
    """
    missing = ""
    first = peer_scene(rig, readings[0], speed_rpm, duration_s, steps_s[0])
    try:
        require_exudyn()
        free_wheels(first, allocate(first, first.time_step)[0])
    except InputError as error:
        missing = f"not run: {error}"
    simulate(first.with_(ramp=0.01, duration=0.01, frame_interval=0.0))  # compile before the clock runs

    ours = {step: timed_run(first.with_(step=step)) for step in steps_s}
    costs = {h: (run.recording.link_position[:, 1], run.wall_s_per_s, run.cpu_s_per_s) for h, run in ours.items()}
    table, step = _ladder(OURS, costs, accuracy_pct)
    if missing:
        table.append({"code": f"{PEER}, {missing}"})
    else:
        seconds = first.ramp + first.duration
        run_peer(first.with_(ramp=0.01, duration=0.01, frame_interval=0.0), exudyn_steps_s[0])
        peers = {h: run_peer(first.with_(step=step), h) for h in exudyn_steps_s}
        costs = {h: (y, run.wall / seconds, run.cpu / seconds) for h, (run, y) in peers.items()}
        rows, chosen = _ladder(PEER, costs, accuracy_pct)
        table += rows

    curves, summary, frames = [], [], []
    for reading in readings:
        scene = peer_scene(rig, reading, speed_rpm, duration_s, step)
        if reading != readings[0]:
            samples = round(rig.rate / scene.periods.loop_hz)
            scene = peer_scene(rig, reading, speed_rpm, samples / rig.rate, step)
        recording = ours[step].recording if reading == readings[0] else simulate(scene)
        frames.append(recording.frame[0])
        y = recording.link_position[:, 1]
        belt = scene.with_(chain="belt", ring_radius=None, pitches=(), contact_log=False, frame_interval=0.0)
        on_belt = simulate(belt).link_position[:, 1]
        curve = {"reading": reading, "time_s": recording.begin + recording.time, "trackdyn_m": y, "belt_m": on_belt}
        row = {"reading": reading, "speed_rpm": speed_rpm, "range_m": float(np.ptp(y)), "trackdyn_step_s": step}
        row["difference_belt_pct"] = percent_of_range(on_belt - y, y)
        if not missing:
            longest = chosen * first.motor_rpm / scene.motor_rpm * (1 + 1e-9)
            peer_step = max((h for h in exudyn_steps_s if h <= longest), default=min(exudyn_steps_s))
            run, other = peers[peer_step] if reading == readings[0] else run_peer(scene, peer_step)
            curve |= {"exudyn_m": other}
            row |= {"exudyn_step_s": peer_step, "difference_pct": percent_of_range(other - y, y)}
            row |= {"gap_m": float(run.gap.max())}
            angle, centre = run.angle[first_sample(scene)], run.centre[first_sample(scene), 0]
            pin = centre - 0.5 * rig.chain.link_length * np.array([np.cos(angle[0]), np.sin(angle[0])])
            frames[-1] = np.concatenate([pin, angle, recording.frame[0][-1:]])
        curves.append(pd.DataFrame(curve))
        summary.append(row)
    shift = ours[step].recording.layout.tensioner_shift_m
    model = {"frame": frames[0].tolist(), "shift": shift, "missing": missing}
    return {"curves": pd.concat(curves), "costs": pd.DataFrame(table), "summary": pd.DataFrame(summary)}, model


def _ladder(code: str, runs: dict, accuracy_pct: float) -> tuple[list[dict], float]:
    """Return rows of Table 2 of a code from ``{step: (displacement, wall, cpu)}``, and the chosen step."""
    finest = min(runs)
    reference = runs[finest][0]
    rows = []
    for step, (y, wall, cpu) in runs.items():
        error = percent_of_range(y - reference, reference) if step != finest else float("nan")
        rows.append({"code": code, "step_s": step, "error_pct": error, "wall_s_per_s": wall, "cpu_s_per_s": cpu})
    good = [row["step_s"] for row in rows if row["error_pct"] < accuracy_pct]
    chosen = max(good, default=finest)
    for row in rows:
        row["chosen"] = "yes" if good and row["step_s"] == chosen else ""  # the finest run has no known error
        row["printed_in_the_paper"] = "lost"
    return rows, chosen


@run_job
def main(job) -> None:
    """Rule `peer_runs`."""
    tables, model = compare_codes(load_rig(job.input.rig), **job.params.options)
    for name, table in tables.items():
        write_csv(job.output[name], table)
    write_text(job.output.model, json.dumps(model))

"""Figure 14 and Table 2: the selected link in both codes, and what each costs at equal accuracy."""

from trackdyn.sweeps.snakemake_job import run_job

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from replication.peers import OURS, PEER
from replication.peers.contact import make_contacts
from replication.peers.exudyn_loop import PeerRun, free_wheels, require_exudyn, run_exudyn_loop
from replication.study.settings import peer_scene
from replication.study.timed_run import timed_run
from trackdyn.errors import InputError
from trackdyn.files import write_csv, write_text
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.loop_arrays import allocate
from trackdyn.simulation.simulate import simulate


@dataclass(frozen=True)
class Result:
    """Tables and pictures' data of the comparison of both codes."""

    # ``reading, time_s, trackdyn_m, belt_m, exudyn_m``: vertical displacement of the selected link, since the start of
    # the sprocket, after its ramp. The belt knows no forces: what it reaches says how much the comparison can tell.
    curves: pd.DataFrame
    costs: pd.DataFrame  # rows of Table 2
    # ``reading, speed_rpm, range_m, trackdyn_step_s, difference_belt_pct, exudyn_step_s, difference_pct, gap_m``
    summary: pd.DataFrame
    missing: str  # why the other code was not run, or nothing
    # configuration for Figure 13 (``Recording.frame``), of the other code where it ran
    frame: np.ndarray = field(repr=False)
    shift: float = 0.0  # shift of the tensioning wheel, m


def belt_of(scene: Scene) -> Scene:
    """A scene with the chain as a kinematic belt on its wheels, at its speed: no contact, no forces."""
    return scene.with_(chain="belt", ring_radius=None, pitches=(), contact_log=False, frame_interval=0.0)


def percent_of_range(difference, reference) -> float:
    """Largest difference in percent of the range of the reference."""
    reference = np.asarray(reference)
    return float(100 * np.abs(difference).max() / (reference.max() - reference.min()))


def run_peer(scene: Scene, step: float, watch: Callable | None = None) -> tuple[PeerRun, np.ndarray]:
    """The other code from the same settled start, and the vertical displacement at the recording's samples, m.

    ``watch`` as in `exudyn_loop.run_exudyn_loop`.
    """
    loop = Loop(scene)
    times = scene.ramp + scene.duration, step, 1.0 / scene.rig.rate
    contacts, wheels = make_contacts(scene, loop.layout["tensioner_shift_m"]), free_wheels(scene, loop.model)
    run = run_exudyn_loop(loop.model, loop.state, *times, contacts, wheels, watch)
    first = round(scene.ramp * scene.rig.rate) + 1
    return run, run.centre[first:, 2 * (scene.rig.first_sensor.pitch - 1), 1]


def compare_codes(
    rig: Rig,
    speed_rpm: float,
    readings: Sequence[str],
    duration_s: float,
    steps_s: Sequence[float],
    exudyn_steps_s: Sequence[float],
    accuracy_pct: float,
) -> Result:
    """Run both codes.

    Table 2 is made with the first reading, which is recorded for ``duration_s`` after the ramp; another one takes a
    turn of the loop. The smallest step of a code is its reference; one is good enough whose error is below
    ``accuracy_pct`` of the range.
    """
    missing = ""
    first = peer_scene(rig, readings[0], speed_rpm, duration_s, steps_s[0])
    try:
        require_exudyn()
        free_wheels(first, allocate(first, first.time_step)[0])
    except InputError as error:  # it is not installed, or has no such loop
        missing = f"not run: {error}"
    simulate(first.with_(duration=0.01, frame_interval=0.0))  # compile before the clock runs

    ours = {step: timed_run(first.with_(step=step)) for step in steps_s}
    costs = {h: (run.recording.link_position[:, 1], run.wall_s_per_s, run.cpu_s_per_s) for h, run in ours.items()}
    table, step = _ladder(OURS, costs, accuracy_pct)
    peer_step = float("nan")
    if not missing:
        seconds = first.ramp + first.duration
        run_peer(first.with_(duration=0.01, frame_interval=0.0), exudyn_steps_s[0])
        peers = {h: run_peer(first.with_(step=step), h) for h in exudyn_steps_s}
        costs = {h: (y, run.wall / seconds, run.cpu / seconds) for h, (run, y) in peers.items()}
        rows, peer_step = _ladder(PEER, costs, accuracy_pct)
        table += rows
    else:
        table.append({"code": f"{PEER}, {missing}"})

    curves, summary, frame, shift = [], [], None, 0.0
    for reading in readings:
        scene = peer_scene(rig, reading, speed_rpm, duration_s, step)
        if reading != readings[0]:
            samples = round(rig.rate / scene.periods.loop_hz)
            scene = peer_scene(rig, reading, speed_rpm, samples / rig.rate, step)
        recording = ours[step].recording if reading == readings[0] else simulate(scene)
        if frame is None:
            frame, shift = recording.frame[0], float(recording.meta["layout"]["tensioner_shift_m"])
        y = recording.link_position[:, 1]
        belt = simulate(belt_of(scene)).link_position[:, 1]
        curve = {"reading": reading, "time_s": recording.begin + recording.time, "trackdyn_m": y, "belt_m": belt}
        row = {"reading": reading, "speed_rpm": speed_rpm, "range_m": float(np.ptp(y)), "trackdyn_step_s": step}
        row["difference_belt_pct"] = percent_of_range(belt - y, y)
        if not missing:
            run, other = peers[peer_step] if reading == readings[0] else run_peer(scene, peer_step)
            curve |= {"exudyn_m": other}
            row |= {"exudyn_step_s": peer_step, "difference_pct": percent_of_range(other - y, y)}
            row |= {"gap_m": float(run.gap.max())}
            if reading == readings[0]:
                frame = _frame(scene, run, recording.frame[0][-1])
        curves.append(pd.DataFrame(curve))
        summary.append(row)
    return Result(pd.concat(curves), pd.DataFrame(table), pd.DataFrame(summary), missing, frame, shift)


def _ladder(code: str, runs: dict, accuracy_pct: float) -> tuple[list[dict], float]:
    """Rows of Table 2 of a code from ``{step: (displacement, wall, cpu)}``, and the step that is good enough."""
    finest = min(runs)
    reference = runs[finest][0]
    rows = []
    for step, (y, wall, cpu) in runs.items():
        error = percent_of_range(y - reference, reference) if step != finest else float("nan")
        rows.append({"code": code, "step_s": step, "error_pct": error, "wall_s_per_s": wall, "cpu_s_per_s": cpu})
    good = [row["step_s"] for row in rows if row["error_pct"] < accuracy_pct]
    chosen = max(good, default=finest)
    for row in rows:
        row["chosen"] = "yes" if row["step_s"] == chosen else ""
        row["printed_in_the_paper"] = "lost"
    return rows, chosen


def _frame(scene: Scene, run: PeerRun, sprocket_angle: float) -> np.ndarray:
    """Configuration of the other code at the first recorded sample, as the pictures want it."""
    k = round(scene.ramp * scene.rig.rate) + 1
    angle = run.angle[k]
    arm = 0.5 * scene.rig.chain.link_length
    pin = run.centre[k, 0] - arm * np.array([np.cos(angle[0]), np.sin(angle[0])])
    return np.concatenate([pin, angle, [sprocket_angle]])


@run_job
def main(job) -> None:
    """Rule `peer_runs`."""
    out, result = job.output, compare_codes(load_rig(job.input.rig), **job.params.options)
    for path, table in ((out.curves, result.curves), (out.summary, result.summary), (out.costs, result.costs)):
        write_csv(path, table)
    model = {"frame": result.frame.tolist(), "shift": result.shift, "missing": result.missing}
    write_text(out.model, json.dumps(model))
    print(result.summary.to_string(index=False))

"""Runs that end when their answer has converged, judged from time to time.

Judges are the measures that every link gives as a sensor (`measure.planner`), and the contacts with the sprocket, of
which every pitch is a sample (`run_steady`).
"""

from collections.abc import Callable
from dataclasses import replace
from math import inf
from typing import TypeVar

from trackdyn.inputs.errors import InputError
from trackdyn.measure.contacts import LONGEST_CONTACT, PASSAGE, TOUCHING, passages
from trackdyn.measure.uncertainty import Series, judge_series
from trackdyn.model.arrays import SAMPLED, SIDES
from trackdyn.scene.scene import Scene, StopRule
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recorder import Recorder
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.settling import SettledLoops

GROWTH = 1.1  # times that a record is longer from one judgement to the next
Judged = TypeVar("Judged")


def record_until(
    writer: Recorder,
    first: float,
    judge: Callable[[Recording], tuple[Judged, bool]],
    growth: float = GROWTH,
    last: float = inf,
) -> tuple[Judged, bool]:
    """Go on with a record until ``judge`` says that its answer has converged, for ``last`` seconds, or to its end.

    The first judgement is after ``first`` seconds of the record, the next one when it is ``growth`` times as long.
    Returns what the last one said.
    """
    rate = writer.loop.scene.rig.rate
    judged = first * rate
    while True:
        if not writer.finished and writer.done < judged:
            writer.chunk()
            continue
        answer, converged = judge(writer.recording())
        if converged or writer.finished or writer.done >= last * rate:
            return answer, converged
        judged = growth * writer.done


def later(recording: Recording, seconds: float) -> Recording:
    """The recording as if begun ``seconds`` later, without configurations; contacts that last then are not logged."""
    first = int(seconds * recording.rate)
    if not first:
        return recording
    begin, count = recording.begin + first / recording.rate, len(recording.time) - first
    lead_in = recording.scene.lead_in + first / recording.rate
    scene = {"duration": count / recording.rate, "lead_in": lead_in, "frame_interval": 0.0}
    return replace(
        recording,
        time=recording.time[:count],
        contact_log=recording.contact_log[recording.contact_log["start_s"] > begin],
        begin=begin,
        frame=recording.frame[:0],
        frame_time=recording.frame_time[:0],
        meta=recording.meta | {"scene": recording.meta["scene"] | scene},
        **{name: getattr(recording, name)[first:] for name in SAMPLED},
    )


def run_steady(scene: Scene, rule: StopRule, starts: SettledLoops | None = None) -> tuple[Recording, bool]:
    """Run a scene until its contacts have converged (then True), or for its duration; ``starts`` are as in `simulate`.

    What the rule asks for is judged by `judge_series`. The recording begins two thirds of a turn of the sprocket before
    the first passage that counts.
    """

    def judge(recording: Recording) -> tuple[Recording, bool]:
        begin, converged = steady_from(recording, rule)
        return later(recording, begin), converged

    loop = Loop(scene, starts)
    turns = 2 * LONGEST_CONTACT + PASSAGE + rule.visits(scene.rig) / scene.rig.sprocket.teeth
    first = turns * scene.periods.turn
    loop.advance(scene.ramp + scene.lead_in)
    return record_until(Recorder(loop, scene.with_(contact_log=True), room=first), first, judge)


def steady_from(recording: Recording, rule: StopRule) -> tuple[float, bool]:
    """Seconds at the beginning of a record that are left out, and whether the contacts of the rest have converged."""
    table = passages(recording)
    if table.empty:  # nothing has touched the sprocket so far
        return 0.0, False
    # shares (%) and RMS forces (N) passage by passage: over the time in which a passage is on its way the RMS scales
    # with that over the whole run
    measures, tolerances = {}, {}
    for side in SIDES:
        rows = table[table["side"] == side]
        number = rows["passage"].to_numpy()
        measures[f"{side}_share"] = share = Series(rows["share_pct"].to_numpy(), number, scale=100.0)
        measures[f"{side}_force"] = Series(rows["square_n2s"].to_numpy(), number, root=True)
        tolerances[f"{side}_share"] = rule.share_pct / 100
        if share.estimate().value >= TOUCHING:  # a force that hardly touches is not judged
            tolerances[f"{side}_force"] = rule.force
    first, _, reached = judge_series(measures, tolerances, rule.visits(recording.scene.rig))
    converged = all(reached.values())
    if not first:
        return 0.0, converged
    begins = table.loc[table["passage"] == first, "start_s"].min()
    return float(begins) - LONGEST_CONTACT * recording.periods.turn, converged


def check_driven(scene: Scene) -> None:
    """Refuse (`InputError`) a scene that has no chain driven on its wheels, and so no passages of pitches."""
    if scene.motor_rpm == 0:
        raise InputError("scene: motor_rpm = 0: passages need a loop that turns; give a speed above 0 rev/min")
    if scene.chain == "belt":
        raise InputError("scene: passages of pitches need a chain that is driven on its wheels; use chain='double_pin'")

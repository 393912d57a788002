"""Stopping criteria: end a run when measures of every link (`measure.planner`) or contacts of every pitch converged."""

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

GROWTH = 1.1  # factor by which a record grows between two judgements
Judged = TypeVar("Judged")
Judge = Callable[[Recording], tuple[Judged, bool]]  # returns a judgement, and True if measures have converged


def record_until(
    recorder: Recorder, first: float, judge: Judge[Judged], growth: float = GROWTH, last: float = inf
) -> tuple[Judged, bool]:
    """Record until ``judge`` returns convergence, for ``last`` seconds, or to the end; return its last judgement.

    The first judgement is after ``first`` seconds of the record, the next one when it is ``growth`` times as long.
    """
    rate = recorder.loop.scene.rig.rate
    judged = first * rate
    while True:
        while not recorder.finished and recorder.done < judged:
            recorder.chunk()
        answer, converged = judge(recorder.recording())
        if converged or recorder.finished or recorder.done >= last * rate:
            return answer, converged
        judged = growth * recorder.done


def without_beginning(recording: Recording, seconds: float) -> Recording:
    """Return a recording without its first ``seconds``, its configurations, and contacts that began before."""
    first = int(seconds * recording.rate)
    if not first:
        return recording
    begin, count = recording.begin + first / recording.rate, len(recording.time) - first
    lead_in = recording.scene.lead_in + first / recording.rate
    scene = {"duration": count / recording.rate, "lead_in": lead_in, "frame_interval": 0.0}
    meta = recording.meta | {"scene": recording.meta["scene"] | scene}
    arrays = {name: getattr(recording, name)[first:] for name in SAMPLED}
    arrays |= {name: getattr(recording, name)[:0] for name in ("frame", "frame_time")}
    arrays["contact_log"] = recording.contact_log[recording.contact_log["start_s"] > begin]
    return replace(recording, time=recording.time[:count], begin=begin, meta=meta, **arrays)


def run_steady(scene: Scene, rule: StopRule, starts: SettledLoops | None = None) -> tuple[Recording, bool]:
    """Run a scene until its contacts have converged, or for its duration; return the recording, and True if they have.

    The recording begins two thirds of a turn of the sprocket before the first passage that counts.
    """

    def judge(recording: Recording) -> tuple[Recording, bool]:
        begin, converged = steady_from(recording, rule)
        return without_beginning(recording, begin), converged

    loop = Loop(scene, starts)
    first = (2 * LONGEST_CONTACT + PASSAGE + rule.visits(scene.rig) / scene.rig.sprocket.teeth) * scene.periods.turn
    loop.lead_in()
    return record_until(Recorder(loop, scene.with_(contact_log=True), capacity=first), first, judge)


def steady_from(recording: Recording, rule: StopRule) -> tuple[float, bool]:
    """Return the seconds to cut at the beginning of a record, and whether the contacts of the rest have converged."""
    table = passages(recording)
    if table.empty:  # no contact with the sprocket so far
        return 0.0, False
    # shares (%) and RMS forces (N) by passage: the RMS over the time of a passage is in proportion to that over the run
    measures, tolerances = {}, {}
    for side in SIDES:
        rows = table[table["side"] == side]
        number = rows["passage"].to_numpy()
        measures[f"{side}_share"] = share = Series(rows["share_pct"].to_numpy(), number, scale=100.0)
        measures[f"{side}_force"] = Series(rows["square_n2s"].to_numpy(), number, root=True)
        tolerances[f"{side}_share"] = rule.share_pct / 100
        if share.estimate().value >= TOUCHING:  # forces of short contacts are not judged
            tolerances[f"{side}_force"] = rule.force
    first, _, reached = judge_series(measures, tolerances, rule.visits(recording.scene.rig))
    start = table.loc[table["passage"] == first, "start_s"].min() - LONGEST_CONTACT * recording.periods.turn
    return float(start) if first else 0.0, all(reached.values())


def check_driven(scene: Scene) -> None:
    """Refuse (`InputError`) a scene without a driven chain, which has no passages of pitches."""
    if scene.motor_rpm == 0:
        raise InputError("scene: motor_rpm = 0: passages need a loop that turns; give a speed above 0 rev/min")
    if scene.chain == "belt":
        raise InputError("scene: passages of pitches need a chain on wheels; use chain='double_pin'")

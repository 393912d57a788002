"""Runs that end when their answer has converged.

A run is recorded in chunks and judged from time to time. Two judges say when it has converged: the measures that every
link gives as a sensor (`run_until`), and the contacts with the sprocket, of which every pitch is a sample
(`run_steady`). Where motion repeats from pitch to pitch the passages of one turn of the sprocket, each groove visited
once, say as much as a long record does; where it scatters, their batch means say how well the mean is determined
(`measure.whole_loop`).
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from numbers import Real
from typing import TypeVar

import pandas as pd

from trackdyn.errors import InputError
from trackdyn.measure.contact_log import LONGEST_CONTACT, PASSAGE, SIDES
from trackdyn.measure.contacts import TOUCHING, passages
from trackdyn.measure.convergence import LEAST, RELATIVE, SHARES, Estimate, Series, settled
from trackdyn.measure.sensor import whole_samples
from trackdyn.measure.whole_loop import series
from trackdyn.scene.scene import LONGEST_RUN, Scene
from trackdyn.scene.stop_rule import StopRule
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recorder import SAMPLED, Recorder
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.settling import SettledLoops

# of a record from one judgement to the next
GROWTH = 1.1
# Turns of the loop at constant speed before a record. In 17 scenes of six rigs the RMS of the first quarter of a turn
# was up to 1.3 % off; after half a turn nothing was left beyond the scatter.
WAIT = 0.5
Judged = TypeVar("Judged")


def record_until(
    writer: Recorder,
    first: float,
    judge: Callable[[Recording], tuple[Judged, bool]],
    tick: Callable[[float], object] = lambda seconds: None,
    growth: float = GROWTH,
) -> tuple[Judged, bool]:
    """Go on with a record until ``judge`` says that its answer has converged, or to its end.

    The first judgement is after ``first`` seconds of the record, the next one when it is ``growth`` times as long.
    Returns what the last one said.
    """
    judged = first * writer.loop.scene.rig.sensor.rate
    while True:
        if not writer.finished and writer.done < judged:
            tick(writer.chunk())
            continue
        answer, converged = judge(writer.recording())
        if converged or writer.finished:
            return answer, converged
        judged = growth * writer.done


def _started(loop: Loop, first: float, tick: Callable[[float], object] = lambda seconds: None) -> Recorder:
    """The record of a scene that may end after ``first`` seconds, its loop brought to where it begins."""
    scene = loop.scene
    loop.advance(scene.ramp + scene.lead_in, tick)
    return Recorder(loop, scene.duration, scene.pitches, scene.frame_interval, True, scene.every_link, room=first)


def contact_series(table: pd.DataFrame) -> dict[str, Series]:
    """Shares (%) and RMS forces (N) of the three sides passage by passage, of a table of `contacts.passages`.

    The RMS is that over the time in which a passage is on its way, which scales with that over the whole run.
    """
    found = {}
    for side in SIDES:
        rows = table[table["side"] == side]
        number = rows["passage"].to_numpy()
        found[f"{side}_share"] = Series(rows["share_pct"].to_numpy(), number)
        found[f"{side}_force"] = Series(rows["square_n2s"].to_numpy(), number, root=True)
    return found


def later(recording: Recording, seconds: float) -> Recording:
    """The recording as if begun ``seconds`` later; contacts that last then are not logged.

    Where configurations are recorded it begins with the next one of them, or has none if it is too short for that.
    """
    first, between = int(seconds * recording.rate), round(recording.scene.frame_interval * recording.rate)
    if not first:
        return recording
    frames, interval = -(-first // between) if between else 0, recording.scene.frame_interval
    if len(recording.time) - frames * between >= between:
        first = max(first, frames * between)
    else:
        frames, interval = len(recording.frame), 0.0
    begin, count = recording.begin + first / recording.rate, len(recording.time) - first
    lead_in = recording.scene.lead_in + first / recording.rate
    scene = {"duration": count / recording.rate, "lead_in": lead_in, "frame_interval": interval}
    rows = (*SAMPLED, "plane", "wheel_offset", "axial_force")  # the latter of a run in space
    cut = {name: getattr(recording, name)[first:] for name in rows if len(getattr(recording, name))}
    return replace(
        recording,
        time=recording.time[:count],
        spells=recording.spells[recording.spells["start_s"] > begin],
        begin=begin,
        frame=recording.frame[frames:],
        frame_time=recording.frame_time[frames:] - first / recording.rate,
        meta=recording.meta | {"scene": recording.meta["scene"] | scene},
        **cut,
    )


def run_steady(loop: Loop, rule: StopRule) -> tuple[Recording, bool]:
    """Start a loop and record it until its contacts have converged (then True), or for the duration of its scene.

    Passages that are alike within the tolerances need no cut: all of them count. Else the longest transient of all
    measures is left out by the marginal standard error rule (`Series.transient`). The run ends when the passages that
    count are enough and half of their 95 % intervals, by batch means, small enough. The recording begins two thirds of
    a turn of the sprocket before the first passage that counts.
    """

    def judge(recording: Recording) -> tuple[Recording, bool]:
        begin, converged = steady_from(recording, rule)
        return later(recording, begin), converged

    turns = 2 * LONGEST_CONTACT + PASSAGE + rule.passages / loop.scene.rig.sprocket.teeth
    first = turns * loop.scene.periods.turn
    return record_until(_started(loop, first), first, judge)


def steady_from(recording: Recording, rule: StopRule) -> tuple[float, bool]:
    """Seconds at the beginning of a record that are left out, and whether the contacts of the rest have converged."""
    table = passages(recording)
    if table.empty:  # nothing has touched the sprocket so far
        return 0.0, False
    found = contact_series(table)
    tolerances = {name: rule.force if name.endswith("_force") else rule.share_pct / 100 for name in found}
    for side in SIDES:  # a force that hardly touches is not judged
        if found[f"{side}_share"].estimate().value < TOUCHING:
            del tolerances[f"{side}_force"]
    first, _, kept = settled(found, tolerances, rule.passages)
    converged = all(kept.values())
    if not first:
        return 0.0, converged
    begins = table.loc[table["passage"] == first, "start_s"].min()
    return float(begins) - LONGEST_CONTACT * recording.periods.turn, converged


@dataclass(frozen=True)
class Answer:
    """What a run gives at its end."""

    measures: dict[str, Estimate]  # measures with their errors (`measure.whole_loop.series`)
    reached: dict[str, bool]  # for each measure that was asked for: is its 95 % interval within the tolerance?
    transient: float  # time at constant speed that was left out, s
    recording: Recording  # all that was recorded, with every link

    @property
    def converged(self) -> bool:
        """Every tolerance was reached."""
        return all(self.reached.values())


def answer_scene(scene: Scene, longest: float) -> Scene:
    """Scene that records every link for ``longest`` s once the loop has run for `WAIT`."""
    rate = scene.rig.sensor.rate
    return scene.with_(
        duration=whole_samples(rate, longest), lead_in=whole_samples(rate, WAIT * scene.periods.loop), pitches=(),
        frame_interval=0.0, spells=True, every_link=True,
    )  # fmt: skip


def run_until(
    scene: Scene,
    tolerances: Mapping[str, float],
    longest: float = 60.0,
    tick: Callable[[float], object] = lambda seconds: None,
    starts: SettledLoops | None = None,
) -> Answer:
    """Start the sprocket, wait for half a turn of the loop, and record every link until all tolerances are reached.

    The run ends when half of the 95 % interval of each asked measure, by batch means, is within its tolerance, or after
    ``longest`` seconds. Where all passages do not agree so far, the longest transient of the asked measures is left out
    (`measure.convergence.Series.transient`), and at least nine passages count.

    Parameters
    ----------
    scene : Scene
        Duration and lead-in are not used.
    tolerances : mapping of str to float
        Measure and tolerance: relative for ``rms, sd, line, high_frequency, left_peak, right_peak``; a share of a
        sprocket turn (0.01 is one point) for ``left_share, right_share, ring_share``.
    longest : float
        s at constant speed of the longest record.
    tick : function
        Called with the seconds that every chunk adds.
    starts : SettledLoops or None
        Loops that were settled before, for a series of scenes.

    Raises
    ------
    InputError
        As `refuse_until`.
    DivergenceError
        As in `simulate`.
    """
    refuse_until(scene, tolerances, longest)
    first = _least(scene)
    writer = _started(Loop(answer_scene(scene, longest), starts), first, tick)
    return record_until(writer, first, lambda recording: judged(recording, tolerances), tick)[0]


def _least(scene: Scene) -> float:
    """Seconds of the passages that an answer takes, the first one being cut."""
    return (LEAST + 1) * scene.periods.passage


def judged(
    recording: Recording, tolerances: Mapping[str, float], names: Collection[str] = RELATIVE + SHARES
) -> tuple[Answer, bool]:
    """The measures ``names`` of a record so far, and whether the intervals of those of ``tolerances`` are within."""
    found = series(recording, names)
    first, means, reached = settled(found, tolerances)
    left_out = recording.scene.lead_in + first * recording.periods.passage
    answer = Answer(means, reached, left_out, recording)
    return answer, answer.converged


def refuse_undriven(scene: Scene) -> None:
    """Refuse (`InputError`) a scene that has no chain driven on its wheels, and so no passages of pitches."""
    if scene.motor_rpm == 0:
        raise InputError("scene: motor_rpm = 0: a tolerance needs a loop that turns; give a speed above 0 rev/min")
    if scene.chain == "belt" or scene.loop == "free":
        raise InputError("scene: a tolerance needs a chain that is driven on its wheels; use chain='double_pin'")


def _is_number(value: object) -> bool:
    """Whether a value can be compared with a bound: a caller in Python may pass text."""
    return isinstance(value, Real)


def refuse_until(scene: Scene, tolerances: Mapping[str, float], longest: float) -> None:
    """Refuse what `run_until` cannot be asked for.

    Raises `InputError`: a measure or tolerance is invalid, or ``longest`` holds too few passages or is beyond ten
    hours.
    """
    if not isinstance(tolerances, Mapping) or not tolerances:
        raise InputError(f"tolerances = {tolerances!r}: name measures with a tolerance each, such as {{'rms': 0.01}}")
    for name, value in tolerances.items():
        if name not in RELATIVE + SHARES:
            raise InputError(f"measure = {name!r}: choose {', '.join(RELATIVE + SHARES)}")
        if not (_is_number(value) and 0.0 < value < 1.0):
            raise InputError(f"tolerance = {value!r} of {name}: must be between 0 and 1, such as 0.01")
    refuse_undriven(scene)
    least = _least(scene)
    if not (_is_number(longest) and least < longest <= LONGEST_RUN):
        raise InputError(
            f"longest = {longest!r} s: must be between {least:.3g} s (ten passages of a pitch) and 36000 s"
        )

"""The planner: the cheapest method and step that keep a tolerance, found while the answer is recorded.

1. The loop comes to speed in coarse steps. Turns in the first semi-implicit setting follow, for coarse steps hold down
   what these let vibrate, until two of them agree. The last one begins the record of that setting.
2. Other settings are tried from cheap to dear. All start where that record does and record the same passages, so that
   two of them differ by their errors alone. Records grow while scatter hides that difference.
3. The two finest ones give the limit that all are compared with. A linearly implicit step is judged by a semi-implicit
   one, since two of its own may agree and be wrong alike; a semi-implicit step is judged by half of it.
4. Of the settings whose errors and intervals can fit within the tolerances the cheapest is recorded until they do. As a
   rule the trial was long enough for it.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any, NamedTuple

import numpy as np

from trackdyn.inputs.errors import InputError, TrackdynError
from trackdyn.inputs.validation import typed, within
from trackdyn.measure.catalogue import TOLERATED, scale_of
from trackdyn.measure.sensor import whole_samples
from trackdyn.measure.stopping import check_driven, record_until
from trackdyn.measure.uncertainty import (
    DRIFT,
    LEAST,
    Estimate,
    Series,
    WholeError,
    drifts,
    extrapolated,
    judge_series,
    weight_of_finer,
    whole_error,
)
from trackdyn.measure.whole_loop import series
from trackdyn.scene.scene import LONGEST_RUN, Periods, Scene
from trackdyn.scene.step import first_that_runs, halved_steps, round_step, turn_limit
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recorder import Recorder
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.step_check import OPEN

SETTING_SHARE = 0.8  # share of the tolerance for the error of a setting, of which the rest is left for its record
IMPLICIT_STEP, LARGEST_STEP = 5e-4, 1e-4  # s
# Cost of a step over that of a semi-implicit one. Plans go by steps and not by the clock, which compilation and other
# processes hold up: the same question has the same answer.
WORK = {"linearly_implicit": 2.0}
WARM_UP = 2  # passages in which a setting follows its own way before it is recorded
GROWTH = 1.5  # times as long a trial is judged again
JUDGED = 1.3  # times as long the record of the answer is
# Turns of the loop at constant speed in linearly implicit steps, which cost less, and in others, before turns are
# compared. Of those there are at most so many: on tight rings a start took seven to die away.
WAIT, DEAR_WAIT = 2.0, 0.5
MOST_TURNS = 10
LEAST_TURNS = 1.0  # turns of the loop that a record has at least before it may be known
GROWN = 2.0  # times its forecast that a record has before another setting is weighed
LEAST_TOLERANCE = 1e-9  # share of a value: rounding
PEAK_TURNS = 3  # turns of the sprocket: until then an arc has had its peaks, or has none


@dataclass(frozen=True)
class StopResult:
    """Measures of a run that ended when they were known, and its recording."""

    measures: dict[str, Estimate]  # measures with their errors (`measure.whole_loop.series`)
    reached: dict[str, bool]  # for each measure that was asked for: is its 95 % interval within the tolerance?
    transient: float  # time at constant speed that was left out, s
    recording: Recording  # all that was recorded, with every link

    @property
    def converged(self) -> bool:
        """Every tolerance was reached."""
        return all(self.reached.values())


@dataclass(eq=False)
class Trial:
    """A setting, the record that it makes, and what is known of it."""

    name: str  # method and step in words
    fields: dict[str, Any]  # method and step as fields of a `Scene`
    refused: str = ""  # why it does not run, or nothing
    writer: Recorder = field(init=False)  # the record so far; unset where the setting was refused at once
    skipped: int = 0  # passages between the common start and the record
    cpu_s: float = 0.0  # CPU seconds of the record so far
    measures: dict[str, Series] = field(default_factory=dict, repr=False)
    error: dict[str, WholeError] = field(default_factory=dict)  # by measure; empty until a finer setting ran

    @property
    def seconds(self) -> float:
        """Length of the record, s."""
        return self.writer.done / self.writer.loop.scene.rig.rate

    @property
    def passages(self) -> int:
        """Whole passages from the common start to the end of the record."""
        return self.skipped + int(self.seconds / self.writer.loop.scene.periods.passage + 1e-6)

    def until(self, name: str, last: int) -> Series:
        """A measure until so many passages after the common start."""
        return self.measures[name].until(last - self.skipped)

    @property
    def work(self) -> float:
        """Cost of a simulated second, in semi-implicit steps."""
        return WORK.get(self.writer.loop.scene.integrator, 1.0) / self.writer.loop.model.step

    def growth(self, tolerances: Mapping[str, float]) -> float:
        """Times that the record must be as long for all tolerances, above 1 if it must; infinite if its setting errs.

        An interval falls as one over the root of the length.
        """
        times = [0.0] if self.error else [inf]
        for name, error in self.error.items():
            room = error.room(tolerances[name])
            if not error.bias + error.doubt <= SETTING_SHARE * tolerances[name]:  # also of a measure that is 0
                times.append(inf)
            elif error.half_width <= room:
                times.append((error.half_width / room) ** 2)
            else:  # few batches widen an interval, which more of them do not
                times.append(max((error.scatter / room) ** 2, JUDGED))
        return max(times)

    def room(self, tolerances: Mapping[str, float]) -> dict[str, float]:
        """What the error of the setting leaves of tolerances for half of an interval, by measure."""
        return {name: self.error[name].room(tolerance) for name, tolerance in tolerances.items()}

    def needed(self, tolerances: Mapping[str, float], longest: float) -> float:
        """Length of the record for all tolerances, s: a turn of the loop at least, if ``longest`` (s) has one."""
        return max(self.growth(tolerances) * self.seconds, least_record(self.writer.loop.scene, longest))


def least_record(scene: Scene, longest: float) -> float:
    """Length that a record has at least before it may be known, s."""
    return min(LEAST_TURNS * scene.periods.loop, longest)


class Plan(NamedTuple):
    """The setting to run for tolerances, and how far its record has come."""

    chosen: Trial
    tolerances: dict[str, float]  # by measure
    duration: float  # s at constant speed that the record is expected to take
    cpu_s: float  # CPU seconds that are expected beyond those of the trials
    trial_cpu_s: float  # CPU seconds that settling and trials took
    tried: tuple[Trial, ...]  # all settings that were tried, from cheap to dear

    @property
    def scene(self) -> Scene:
        """The scene with the setting; its duration is the longest one."""
        return self.chosen.writer.loop.scene

    @property
    def left(self) -> dict[str, float]:
        """Tolerances of the record by measure: those of the question less the setting's error."""
        return self.chosen.room(self.tolerances)

    def run(self) -> StopResult:
        """Go on with the record until its intervals are within ``left``.

        Half widths of the answer's measures, the asked ones alone, hold the error of the setting, too. The record has a
        turn of the loop at least, and its halves agree; until they do its first half is left out. One that has grown to
        `GROWN` times its forecast gives way to a finer setting that was tried, if that takes less work.
        """
        trial, duration = self.chosen, self.duration
        while True:
            # scatter may fall faster than it is expected to, where passages make up for each other
            least = least_record(trial.writer.loop.scene, trial.writer.loop.scene.duration)
            first = max(min(duration, GROWTH * trial.seconds), least)
            last = GROWN * max(duration, least)
            (recording, cut, means, reached), converged = record_until(
                trial.writer, first, _judge_record(trial.room(self.tolerances), least), JUDGED, last
            )
            if converged or trial.writer.finished:
                break
            trial, duration = self._cheaper(trial, means)
        measures = {}
        for name, mean in means.items():
            scale = scale_of(name, mean.value)
            error = trial.error[name]._replace(half_width=mean.half_width / scale).total
            measures[name] = mean._replace(half_width=error * scale)
        reason = f"the step was chosen for {', '.join(self.left)}; other measures may be less accurate"
        resolved = recording.resolution._replace(state=OPEN, reason=reason)._asdict()
        left_out = recording.scene.lead_in + cut * recording.periods.passage
        recording = replace(recording, meta=recording.meta | {"resolved": resolved})
        return StopResult(measures, reached, left_out, recording)

    def _cheaper(self, trial: Trial, means: Mapping[str, Estimate]) -> tuple[Trial, float]:
        """The setting with the least work to the end, of a record that grew and of finer ones, and its length, s.

        An interval falls as one over the root of the length.
        """
        plans = []
        for other in self.tried[self.tried.index(trial) :]:
            if other.refused or not other.error:
                continue
            room = other.room(self.tolerances)
            if min(room.values()) > 0:
                wide = [mean.half_width / scale_of(name, mean.value) / room[name] for name, mean in means.items()]
                grown = max(wide) ** 2 if np.isfinite(wide).all() else inf
                length = max(trial.seconds * grown, JUDGED * other.seconds)
                plans.append((other.work * (length - other.seconds), other, length))
        _, other, length = min(plans, key=lambda plan: plan[0])
        return other, length


def _judge_record(left: Mapping[str, float], least: float) -> Callable[[Recording], tuple[tuple, bool]]:
    """Judge of a record: its measures, the passages left out at its beginning, and whether all that is known.

    ``least`` is the length of what is left, s.
    """

    def judge(recording: Recording):
        measures, passage, skipped = series(recording, left), recording.periods.passage, 0
        while drifts(rest := {name: measure.since(skipped) for name, measure in measures.items()}, left):
            skipped += max((int(recording.seconds / passage) - skipped) // 2, 1)
        cut, means, reached = judge_series(rest, left)
        cut = max(cut, skipped)
        turn = recording.seconds - cut * passage >= (1 - 1e-6) * least
        reached = {name: value and turn for name, value in reached.items()}
        return (recording, cut, means, reached), all(reached.values())

    return judge


def settings(scene: Scene, step: float, method: bool) -> list[Trial]:
    """Settings of a scene that takes a step (s), from cheap to dear; where they are not open, that and half of it."""
    sample = 1.0 / scene.rig.rate
    if not method:
        return [Trial("as the scene asks", {}), Trial("half its step", {"step": round_step(step / 2, sample)})]
    coarsest = min(IMPLICIT_STEP, *turn_limit(scene.sprocket_rate).values())
    steps = [("linearly_implicit", round_step(coarsest, sample))]
    # one step coarser than the usual one, where that is small
    steps += [("semi_implicit", finer) for finer in halved_steps(min(LARGEST_STEP, 2 * step), sample, 3)]
    return [Trial(f"{name}, {step:.3g} s", {"integrator": name, "step": step}) for name, step in steps]


@typed
def plan(scene: Scene, tolerances: Mapping[str, float], longest: float = 60.0, method: bool = True) -> Plan:
    """The cheapest setting that keeps tolerances on a scene.

    Parameters
    ----------
    scene : Scene
        Duration and lead-in are not used.
    tolerances : mapping of str to float
        Measure (`catalogue.TOLERATED`) and tolerance: relative, or for shares of contact a share of a sprocket turn.
    longest : float
        s at constant speed of the longest record.
    method : bool
        Whether method and step may be chosen in place of the scene's own.

    Raises
    ------
    InputError
        As `check_tolerances`, or no setting keeps the tolerances: what stands in the way.
    """
    check_tolerances(scene, tolerances, longest)
    begin = time.process_time()
    rate, wait = scene.rig.rate, (WAIT if method else DEAR_WAIT) * scene.periods.loop
    record = {"duration": whole_samples(rate, longest), "lead_in": whole_samples(rate, wait), "every_link": True}
    at_rest = Loop(scene.with_(**record, pitches=(), frame_interval=0.0, contact_log=True))
    choices = settings(at_rest.scene, at_rest.model.step, method)
    start, steady = _settled(_at_speed(at_rest, choices), choices, tolerances, longest)
    # an implicit step, which damps contacts, tells nothing of peaks
    peaks = any(name.endswith("_peak") for name in tolerances)
    choices = [trial for trial in choices if not trial.refused and not (peaks and _implicit(trial))]
    passages, tried = float(LEAST + 1), list[Trial]()
    for trial in choices:
        tried.append(trial if trial is steady else _start(start, trial))
        passages = _compare(tried, tolerances, passages, scene.periods, longest)
        if chosen := _cheapest(tried, tolerances, longest):
            break
    else:
        chosen = _cheapest(tried, tolerances, inf)
    if chosen is None:
        raise InputError(_refusal(tried, tolerances, longest))
    duration = min(max(chosen.needed(tolerances, longest), chosen.seconds), longest)
    cpu_s = chosen.cpu_s * (duration / chosen.seconds - 1.0)
    return Plan(chosen, dict(tolerances), duration, cpu_s, time.process_time() - begin, tuple(tried))


def _compare(
    tried: list[Trial], tolerances: Mapping[str, float], passages: float, periods: Periods, longest: float
) -> float:
    """Record settings for so many passages, and more while scatter hides their errors; returns how many there are.

    Raises `InputError`: a measure has too few values in records in which every arc has had its peaks.
    """
    span = periods.passage
    while True:
        running = [trial for trial in tried if not trial.refused]
        # the two finest judge; the others go on while they may be chosen
        running = [trial for trial in running if trial in running[-2:] or trial.growth(tolerances) < inf]
        for trial in running:
            _record(trial, tolerances, passages * span)
        running = [trial for trial in running if not trial.refused]
        if lacking := [name for name in tolerances for trial in running if name not in trial.measures]:
            if passages * span >= LEAST * span + PEAK_TURNS * periods.turn:
                raise InputError(f"tolerance: {lacking[0]} has fewer than {LEAST} values in {passages:.0f} passages")
        elif len(running) < 2:
            return passages
        else:
            _judge(running, tolerances)
            hides = all(running[-1].error[name].bias <= SETTING_SHARE * tolerances[name] for name in tolerances)
            chosen = _cheapest(running, tolerances, longest)
            if not hides or passages * span >= longest or (chosen and not _undecided(running, chosen, tolerances)):
                return passages
        passages *= GROWTH


def _undecided(running: list[Trial], chosen: Trial, tolerances: Mapping[str, float]) -> bool:
    """Whether the record that the chosen setting needs may still show that a coarser one is good enough."""
    scene = chosen.writer.loop.scene
    if chosen is not running[-1] or chosen.seconds >= least_record(scene, scene.duration):
        return False
    return any(
        all(trial.error[name].bias <= SETTING_SHARE * tolerance for name, tolerance in tolerances.items())
        for trial in running[:-1]
    )


def _cheapest(tried: list[Trial], tolerances: Mapping[str, float], longest: float) -> Trial | None:
    """The setting whose record keeps the tolerances for the least work within ``longest`` (s): the finest of equals."""
    lengths = {trial: trial.needed(tolerances, longest) for trial in reversed(tried) if not trial.refused}
    fitting = [trial for trial, length in lengths.items() if length < inf and length <= longest]
    return min(fitting, key=lambda trial: trial.work * max(lengths[trial] - trial.seconds, 0.0), default=None)


def _implicit(trial: Trial) -> bool:
    """Whether the setting is a linearly implicit one among others."""
    return trial.fields.get("integrator") == "linearly_implicit"


def _at_speed(at_rest: Loop, choices: list[Trial]) -> Loop:
    """The loop at constant speed, by the cheapest setting that comes there."""
    scene = at_rest.scene

    def run(trial: Trial) -> Loop:
        loop = at_rest.changed(**trial.fields)
        loop.advance(scene.ramp + scene.lead_in)
        return loop

    try:
        return first_that_runs(choices, run)
    except TrackdynError as error:
        raise InputError(f"tolerance: {error}") from None


def _settled(base: Loop, choices: list[Trial], tolerances: Mapping[str, float], longest: float) -> tuple[Loop, Trial]:
    """The loop once turns agree, and the first setting that runs, the implicit one aside, with the turn from there on.

    Raises `InputError`: no setting runs.
    """
    turn, pitches = least_record(base.scene, longest), base.scene.rig.chain.pitches
    for trial in choices:
        if _implicit(trial):
            continue
        try:
            loop, turns = base.changed(**trial.fields), list[dict[str, float]]()
        except TrackdynError as error:
            trial.refused = str(error)
        while not trial.refused:
            start = loop.copy()
            trial.writer, trial.cpu_s = _recorder(loop), 0.0
            _record(trial, tolerances, turn)
            turns.append({name: values.until(pitches).estimate().value for name, values in trial.measures.items()})
            if not trial.refused and (steady(turns, tolerances) or len(turns) == MOST_TURNS):
                return start, trial
    raise InputError(_refusal(choices, tolerances, longest))


def steady(turns: Sequence[Mapping[str, float]], tolerances: Mapping[str, float]) -> bool:
    """Whether measures of successive turns have stopped to drift, each as far as its tolerance asks.

    The last two differ by at most `DRIFT` of it, or the last change went the other way than the one before: turns
    scatter by more, which is not for a wait to mend.
    """
    for name, tolerance in tolerances.items():
        values = [turn[name] for turn in turns[-3:] if name in turn]
        changes = np.diff(values)
        if not len(changes):
            if values or len(turns) < 2:
                return False
            continue  # what never touches does not drift
        turned = len(changes) > 1 and changes[0] * changes[1] < 0
        if abs(changes[-1]) > DRIFT * tolerance * (scale_of(name, values[-1]) or 0.0) and not turned:
            return False
    return True


def _recorder(loop: Loop) -> Recorder:
    """Recorder of a trial, which says how long the loop has been at speed."""
    scene = loop.scene
    lead_in = whole_samples(scene.rig.rate, max(loop.time - scene.ramp, 0.0))
    return Recorder(loop, scene.with_(lead_in=lead_in), checked=False, room=PEAK_TURNS * scene.periods.turn)


def _start(start: Loop, trial: Trial) -> Trial:
    """Begin the record of a setting."""
    try:
        loop = start.changed(**trial.fields)
        loop.advance(WARM_UP * loop.scene.periods.passage)
        trial.writer, trial.skipped = _recorder(loop), WARM_UP
    except TrackdynError as error:
        trial.refused = str(error)
    return trial


def _record(trial: Trial, tolerances: Mapping[str, float], seconds: float) -> None:
    """Go on with the record of a setting to a length, and take its measures."""
    begin = time.process_time()
    try:
        recording, _ = record_until(trial.writer, seconds, lambda record: (record, True))
        measures = series(recording, tolerances)
    except TrackdynError as error:
        trial.refused = str(error)
        return
    trial.cpu_s += time.process_time() - begin
    sides = [name.removesuffix("_peak") for name in tolerances if name.endswith("_peak")]
    if sides and any(map(trial.writer.statistics().doubtful, sides)):
        trial.refused = "peaks stand for one step: the true ones may be twice as large"
    trial.measures = {name: measure for name, measure in measures.items() if len(measure.values) >= LEAST}


def _judge(running: list[Trial], tolerances: Mapping[str, float]) -> None:
    """Errors of settings against the limit that the two finest ones give.

    What a step further would change is as much as the last one did, less by the ratio of the steps where the method, of
    order 1, is the same.
    """
    coarser, finest = running[-2:]
    same_method = coarser.fields.get("integrator") == finest.fields.get("integrator")
    weight = weight_of_finer(finest.writer.loop.model.step, coarser.writer.loop.model.step) if same_method else 1.0
    last = min(trial.passages for trial in running)
    for name in tolerances:
        measure = finest.until(name, last)
        limit, scale = (
            extrapolated(measure, coarser.until(name, last), weight),
            scale_of(name, measure.estimate().value),
        )
        for trial in running:
            trial.error[name] = whole_error(trial.measures[name], trial.until(name, last), limit, scale)


def _refusal(tried: list[Trial], tolerances: Mapping[str, float], longest: float) -> str:
    """Why no setting keeps the tolerances."""
    known = [trial.error for trial in tried if trial.error]
    if not known:
        reason = next((trial.refused for trial in reversed(tried) if trial.refused), "no setting runs")
        return f"tolerance: {reason}"
    least = {name: min(error[name].bias for error in known) for name in tolerances}
    name = max(tolerances, key=lambda name: least[name] / tolerances[name])
    reason = f"records of {longest:g} s scatter by more than that; use a larger one, or `longest: {2 * longest:g}`"
    if least[name] > SETTING_SHARE * tolerances[name]:
        reason = f"what was tried leaves an error of {least[name]:.2g}; use at least {least[name] / SETTING_SHARE:.2g}"
    return f"tolerance = {tolerances[name]:g} of {name}: {reason}"


def check_tolerances(scene: Scene, tolerances: Mapping[str, float], longest: float) -> None:
    """Refuse what `measure.planner.plan` cannot be asked for.

    Raises `InputError`: a measure or tolerance is invalid, or ``longest`` holds too few passages or is beyond ten
    hours.
    """
    if not isinstance(tolerances, Mapping) or not tolerances:
        raise InputError(f"tolerances = {tolerances!r}: name measures with a tolerance each, such as {{'rms': 0.01}}")
    for name, value in tolerances.items():
        if name not in TOLERATED:
            raise InputError(f"measure = {name!r}: choose {', '.join(TOLERATED)}")
        within(f"tolerance of {name}", value, LEAST_TOLERANCE, 1.0, ", such as 0.01")
    check_driven(scene)
    least = (LEAST + 1) * scene.periods.passage  # the first one is cut
    within("longest", longest, least, LONGEST_RUN, " s, of which the first is ten passages of a pitch")

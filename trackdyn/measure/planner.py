"""Planner: choose the cheapest method and step for given tolerances while recording the answer.

1. The loop is brought to speed in coarse steps. Turns with the first semi-implicit setting follow, since coarse steps
   suppress vibrations, until two of them agree. The last one begins the record of that setting.
2. Other settings are tried from cheap to expensive. All start from the same state and record the same passages, so that
   two of them differ only by their errors. Records grow until scatter is smaller than that difference.
3. The two finest settings give the limit for all comparisons. A linearly implicit step is compared with a semi-implicit
   one, since two of its own may agree and have the same error; a semi-implicit step is compared with half of it.
4. Of the settings whose errors and intervals fit within the tolerances the cheapest is recorded until they do. Usually
   its trial was long enough.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import hypot, inf
from typing import Any, NamedTuple

import numpy as np

from trackdyn.inputs.errors import InputError, TrackdynError
from trackdyn.inputs.validation import typed, within
from trackdyn.measure import uncertainty
from trackdyn.measure.catalogue import TOLERATED, scale_of
from trackdyn.measure.sensor import whole_samples
from trackdyn.measure.stopping import check_driven, record_until
from trackdyn.measure.uncertainty import COVERAGE, LEAST_PASSAGES, Estimate, Series, TotalError
from trackdyn.measure.whole_loop import series
from trackdyn.scene.scene import LONGEST_RUN, Periods, Scene
from trackdyn.scene.step import first_that_runs, halved_steps, round_step, turn_limit
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recorder import Recorder
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.step_check import OPEN

SETTING_SHARE = 0.8  # share of the tolerance for the error of a setting; the rest is for the interval of its record
IMPLICIT_STEP, LARGEST_STEP = 5e-4, 1e-4  # s
# Cost of a step over that of a semi-implicit one. Plans count steps instead of CPU time, which depends on compilation
# and other processes, so that they are reproducible.
WORK = {"linearly_implicit": 2.0}
WARM_UP = 2  # passages of a setting before its record
TRIAL_GROWTH = 1.5  # factor by which the record of a trial grows
ANSWER_GROWTH = 1.3  # factor by which the record of the answer grows
# Turns of the loop at constant speed before turns are compared, in linearly implicit steps, which are cheaper, and in
# others. At most `MOST_TURNS` are compared: on tight rings a transient took seven to decay.
CHEAP_LEAD, EXPENSIVE_LEAD = 2.0, 0.5
MOST_TURNS = 10
LEAST_TURNS = 1.0  # turns of the loop in a record before it may have converged
MOST_GROWN = 2.0  # length of a record over its forecast at which other settings are reconsidered
LEAST_TOLERANCE = 1e-9  # share of a value: rounding
HOPELESS = 2.0  # longest records that scatter alone would need, beyond which no setting is tried
PEAK_TURNS = 3  # turns of the sprocket after which an arc has had its peaks, or has none


@dataclass(frozen=True)
class StopResult:
    """Measures of a run that ended when they converged, and its recording."""

    measures: dict[str, Estimate]  # measures with their errors (`measure.whole_loop.series`)
    reached: dict[str, bool]  # by measure with a tolerance: true if its 95 % interval is within it
    transient: float  # time at constant speed that was left out, s
    recording: Recording  # of every link

    @property
    def converged(self) -> bool:
        """True if every tolerance was reached."""
        return all(self.reached.values())


@dataclass(eq=False)
class Trial:
    """A setting, its record, and the errors of its measures."""

    name: str  # method and step
    fields: dict[str, Any]  # method and step as fields of a `Scene`
    refused: str = ""  # reason of a refusal, or empty
    recorder: Recorder = field(init=False)  # of the record so far; unset if the setting was refused at once
    skipped: int = 0  # passages between the common start and the record
    cpu_s: float = 0.0  # CPU seconds of the record so far
    measures: dict[str, Series] = field(default_factory=dict, repr=False)
    error: dict[str, TotalError] = field(default_factory=dict)  # by measure; empty until a finer setting ran

    @property
    def seconds(self) -> float:
        """Length of the record, s."""
        return self.recorder.done / self.recorder.loop.scene.rig.rate

    @property
    def implicit(self) -> bool:
        """True if the planner chose the linearly implicit method."""
        return self.fields.get("integrator") == "linearly_implicit"

    @property
    def work(self) -> float:
        """Cost of a simulated second, in semi-implicit steps."""
        return WORK.get(self.recorder.loop.scene.integrator, 1.0) / self.recorder.loop.model.step

    def growth(self, tolerances: Mapping[str, float]) -> float:
        """Return the factor by which the record must grow for all tolerances, below 1 if they are met.

        It is infinite if the error of the setting is too large. An interval falls as one over the root of the length.
        """
        factors = [0.0] if self.error else [inf]
        for name, error in self.error.items():
            margin = error.margin(tolerances[name])
            if not error.bias + error.bias_error <= SETTING_SHARE * tolerances[name]:  # also of a measure that is 0
                factors.append(inf)
            elif error.half_width <= margin:
                factors.append((error.half_width / margin) ** 2)
            else:  # the interval is wide if there are few batches
                factors.append(max((error.scatter / margin) ** 2, ANSWER_GROWTH))
        return max(factors)

    def margins(self, tolerances: Mapping[str, float]) -> dict[str, float]:
        """Return the tolerances of half of an interval by measure: the margins beyond the error of the setting."""
        return {name: self.error[name].margin(tolerance) for name, tolerance in tolerances.items()}

    def needed(self, tolerances: Mapping[str, float], longest: float) -> float:
        """Return the length of the record for all tolerances, s, at least `_least_record`."""
        return max(self.growth(tolerances) * self.seconds, _least_record(self.recorder.loop.scene, longest))


def _least_record(scene: Scene, longest: float) -> float:
    """Return the least length of a record that may have converged, s; at most ``longest`` (s)."""
    return min(LEAST_TURNS * scene.periods.loop, longest)


class Plan(NamedTuple):
    """Setting for given tolerances, with the record so far."""

    chosen: Trial
    tolerances: dict[str, float]  # by measure
    duration: float  # expected length of the record, s at constant speed
    cpu_s: float  # expected CPU seconds beyond those of the trials
    trial_cpu_s: float  # CPU seconds of settling and trials
    tried: tuple[Trial, ...]  # settings that were tried, from cheap to expensive

    @property
    def scene(self) -> Scene:
        """Scene with the setting; its duration is the longest one."""
        return self.chosen.recorder.loop.scene

    def run(self) -> StopResult:
        """Continue the record until its intervals are within `Trial.margins`.

        Half widths of the measures include the error of the setting. The record has a turn of the loop at least, and
        its halves agree; until they do its first half is left out. A record that has grown to `MOST_GROWN` times its
        forecast is replaced by that of a finer setting that was tried, if that takes less work.
        """
        trial, duration = self.chosen, self.duration
        while True:
            # scatter may fall faster than expected, if deviations of passages compensate each other
            least = _least_record(trial.recorder.loop.scene, trial.recorder.loop.scene.duration)
            first = max(min(duration, TRIAL_GROWTH * trial.seconds), least)
            last = MOST_GROWN * max(duration, least)
            judge = partial(_judge_record, trial.margins(self.tolerances), least)
            judged, converged = record_until(trial.recorder, first, judge, ANSWER_GROWTH, last)
            recording, cut, means, reached = judged
            if converged or trial.recorder.finished:
                break
            trial, duration = self._cheaper(trial, means)
        measures = {}
        for name, mean in means.items():
            scale, error = scale_of(name, mean.value), trial.error[name]
            scatter = hypot(error.bias_error, mean.half_width / scale)  # of bias and record
            measures[name] = mean._replace(half_width=(error.bias + scatter) * scale)
        reason = f"the step was chosen for {', '.join(self.tolerances)}; other measures may be less accurate"
        resolved = recording.resolution._replace(state=OPEN, reason=reason)._asdict()
        transient = recording.scene.lead_in + cut * recording.periods.passage
        recording = replace(recording, meta=recording.meta | {"resolved": resolved})
        return StopResult(measures, reached, transient, recording)

    def _cheaper(self, trial: Trial, means: Mapping[str, Estimate]) -> tuple[Trial, float]:
        """Return the setting of least work, of ``trial`` and finer ones, and the expected length of its record, s."""
        plans = []
        for other in self.tried[self.tried.index(trial) :]:
            margins = other.margins(self.tolerances) if other.error and not other.refused else {}
            if min(margins.values(), default=0.0) > 0:
                ratios = [mean.half_width / scale_of(name, mean.value) / margins[name] for name, mean in means.items()]
                # an interval falls as one over the root of the length
                growth = max(ratios) ** 2 if np.isfinite(ratios).all() else inf
                length = max(trial.seconds * growth, ANSWER_GROWTH * other.seconds)
                plans.append((other.work * (length - other.seconds), other, length))
        return min(plans, key=lambda plan: plan[0])[1:]


def _judge_record(margins: Mapping[str, float], least: float, recording: Recording) -> tuple[tuple, bool]:
    """Judge a record by its measures, without a drift at its beginning; at least ``least`` seconds must remain."""
    measures, passage, skipped = series(recording, margins), recording.periods.passage, 0
    while uncertainty.drifts(rest := {name: measure.between(skipped) for name, measure in measures.items()}, margins):
        skipped += max((int(recording.seconds / passage) - skipped) // 2, 1)
    cut, means, reached = uncertainty.judge_series(rest, margins)
    cut = max(cut, skipped)
    long_enough = recording.seconds - cut * passage >= (1 - 1e-6) * least
    reached = {name: value and long_enough for name, value in reached.items()}
    return (recording, cut, means, reached), all(reached.values())


def settings(scene: Scene, step: float, method: bool) -> list[Trial]:
    """Return the settings to try, from cheap to expensive; unless ``method``, the scene's step (s) and half of it."""
    sample = 1.0 / scene.rig.rate
    if not method:
        return [Trial("as the scene asks", {}), Trial("half its step", {"step": round_step(step / 2, sample)})]
    coarsest = min(IMPLICIT_STEP, *turn_limit(scene.sprocket_rate).values())
    steps = [("linearly_implicit", round_step(coarsest, sample))]
    # a step coarser than the usual one, if that is small
    steps += [("semi_implicit", finer) for finer in halved_steps(min(LARGEST_STEP, 2 * step), sample, 3)]
    return [Trial(f"{name}, {step:.3g} s", {"integrator": name, "step": step}) for name, step in steps]


@typed
def plan(
    scene: Scene, tolerances: Mapping[str, float], longest: float = 60.0, method: bool = True, loops: type[Loop] = Loop
) -> Plan:
    """Choose the cheapest setting that keeps tolerances on a scene.

    Parameters
    ----------
    scene : Scene
        Scene to run; its duration and lead-in are not used.
    tolerances : mapping of str to float
        Measure (`catalogue.TOLERATED`) and tolerance: relative, or for shares of contact a share of a sprocket turn.
    longest : float
        Longest record, s at constant speed.
    method : bool
        If true, method and step may differ from the scene's.
    loops : type of Loop
        Class of the loops that are run; its ``clock`` counts their cost.

    Raises
    ------
    InputError
        As `check_tolerances`, or no setting keeps the tolerances; the message has the reason.
    """
    check_tolerances(scene, tolerances, longest)
    begin = loops.clock()
    rate, lead = scene.rig.rate, (CHEAP_LEAD if method else EXPENSIVE_LEAD) * scene.periods.loop
    record = {"duration": whole_samples(rate, longest), "lead_in": whole_samples(rate, lead), "every_link": True}
    at_rest = loops(scene.with_(**record, pitches=(), frame_interval=0.0, contact_log=True))
    choices = settings(at_rest.scene, at_rest.model.step, method)
    start, steady = _settled(at_rest, choices, tolerances, longest)
    bound = longest if _scatter_needs(steady, tolerances, longest) <= longest else inf  # finer settings scatter alike
    peaks = any(name.endswith("_peak") for name in tolerances)  # implicit steps damp contacts and give none
    choices = [trial for trial in choices if not trial.refused and not (peaks and trial.implicit)]
    passages, tried = float(LEAST_PASSAGES + 1), list[Trial]()
    for trial in choices:
        if trial is not steady:
            try:  # to begin the record of the setting
                loop = start.changed(**trial.fields)
                loop.advance(WARM_UP * loop.scene.periods.passage)
                trial.recorder, trial.skipped = _recorder(loop), WARM_UP
            except TrackdynError as error:
                trial.refused = str(error)
        tried.append(trial)
        passages = _compare(tried, tolerances, passages, scene.periods, longest, bound)
        if chosen := _cheapest(tried, tolerances, bound):
            break
    else:
        chosen = _cheapest(tried, tolerances, inf)
    if chosen is None:
        raise InputError(_refusal(tried, tolerances, longest))
    duration = min(max(chosen.needed(tolerances, longest), chosen.seconds), longest)
    cpu_s = chosen.cpu_s * (duration / chosen.seconds - 1.0)
    return Plan(chosen, dict(tolerances), duration, cpu_s, loops.clock() - begin, tuple(tried))


def _compare(
    tried: list[Trial], tolerances: Mapping[str, float], passages: float, periods: Periods, longest: float, bound: float
) -> float:
    """Record settings for ``passages``, and more until errors exceed scatter; return the number of passages.

    One that keeps the tolerances within ``bound`` (s) may be chosen. Raises `InputError`: a measure has too few values.
    """
    span, shared = periods.passage, dict[Trial, dict[str, TotalError]]()
    while True:
        running = [trial for trial in tried if not trial.refused]
        # the two finest give the limit; the others continue while they may be chosen
        running = [trial for trial in running if trial in running[-2:] or trial.growth(tolerances) < inf]
        for trial in running:
            _record(trial, tolerances, passages * span)
        running = [trial for trial in running if not trial.refused]
        if lacking := [name for name in tolerances for trial in running if name not in trial.measures]:
            if passages * span >= LEAST_PASSAGES * span + PEAK_TURNS * periods.turn:  # every arc has had its peaks
                few = f"has fewer than {LEAST_PASSAGES} values in {passages:.0f} passages"
                raise InputError(f"tolerance: {lacking[0]} {few}")
        elif len(running) < 2:
            return passages
        else:
            _judge(running, tolerances)
            keeps = all(running[-1].error[name].bias <= SETTING_SHARE * tolerances[name] for name in tolerances)
            chosen = _cheapest(running, tolerances, bound)
            if chosen:
                shared = {trial: dict(trial.error) for trial in running}
            elif shared:  # vibrations of settings have parted: their differences are scatter from now on
                for trial, errors in shared.items():
                    for name, error in errors.items():
                        trial.error[name] = trial.error[name]._replace(bias=error.bias, bias_error=error.bias_error)
                return passages
            if not keeps or passages * span >= longest or (chosen and not _undecided(running, chosen, tolerances)):
                return passages
        passages *= TRIAL_GROWTH


def _undecided(running: list[Trial], chosen: Trial, tolerances: Mapping[str, float]) -> bool:
    """Return whether a coarser setting than the chosen one may prove sufficient during the least record."""
    scene = chosen.recorder.loop.scene
    if chosen is not running[-1] or chosen.seconds >= _least_record(scene, scene.duration):
        return False
    return any(
        all(trial.error[name].bias <= SETTING_SHARE * tolerance for name, tolerance in tolerances.items())
        for trial in running[:-1]
    )


def _cheapest(tried: list[Trial], tolerances: Mapping[str, float], longest: float) -> Trial | None:
    """Return the setting that keeps the tolerances for the least work within ``longest`` (s): the finest of equals."""
    lengths = {trial: trial.needed(tolerances, longest) for trial in reversed(tried) if not trial.refused}
    fitting = [trial for trial, length in lengths.items() if length < inf and length <= longest]
    return min(fitting, key=lambda trial: trial.work * max(lengths[trial] - trial.seconds, 0.0), default=None)


def _settled(rest: Loop, choices: list[Trial], tolerances: Mapping[str, float], longest: float) -> tuple[Loop, Trial]:
    """Return the loop after its transient, and the first explicit setting that runs, with the record of a turn."""

    def at_speed(trial: Trial) -> Loop:
        loop = rest.changed(**trial.fields)
        loop.lead_in()
        return loop

    try:
        base = first_that_runs(choices, at_speed)
    except TrackdynError as error:
        raise InputError(f"tolerance: {error}") from None
    turn, pitches = _least_record(base.scene, longest), base.scene.rig.chain.pitches
    for trial in choices:
        if trial.implicit:
            continue
        try:
            loop, turns = base.changed(**trial.fields), list[dict[str, float]]()
        except TrackdynError as error:
            trial.refused = str(error)
        while not trial.refused:
            start = loop.copy()
            trial.recorder, trial.cpu_s = _recorder(loop), 0.0
            _record(trial, tolerances, turn)
            turns.append({name: values.between(0, pitches).estimate().value for name, values in trial.measures.items()})
            if not trial.refused and (steady(turns, tolerances) or len(turns) == MOST_TURNS):
                return start, trial
    raise InputError(_refusal(choices, tolerances, longest))


def steady(turns: Sequence[Mapping[str, float]], tolerances: Mapping[str, float]) -> bool:
    """Return whether the last two turns agree to `uncertainty.DRIFT` of tolerances, or changes alternate in sign."""
    for name, tolerance in tolerances.items():
        values = [turn[name] for turn in turns[-3:] if name in turn]
        changes = np.diff(values)
        if not len(changes):
            if values or len(turns) < 2:
                return False
            continue  # a side without contact does not drift
        reversed_sign = len(changes) > 1 and changes[0] * changes[1] < 0  # scatter, which no longer lead-in reduces
        if abs(changes[-1]) > uncertainty.DRIFT * tolerance * (scale_of(name, values[-1]) or 0.0) and not reversed_sign:
            return False
    return True


def _scatter_needs(trial: Trial, tolerances: Mapping[str, float], longest: float) -> float:
    """Return the length of a record (s) that scatters by less than the tolerances; `InputError`: it is `HOPELESS`."""
    lengths = {}
    for name, measure in trial.measures.items():
        value, error, _ = measure.estimate()
        lengths[name] = trial.seconds * (COVERAGE * error / (scale_of(name, value) * tolerances[name])) ** 2
        if lengths[name] > HOPELESS * longest:
            raise InputError(f"tolerance = {tolerances[name]:g} of {name}: {_scattered(longest, lengths[name])}")
    return max(lengths.values(), default=0.0)


def _scattered(longest: float, needed: float) -> str:
    """Return the reason of a refusal for records of ``longest`` seconds where ``needed`` would do."""
    return f"records of {longest:g} s scatter by more than that; use a larger one, or `longest: {needed:.0f}`"


def _recorder(loop: Loop) -> Recorder:
    """Return the recorder of a trial, whose lead-in is the time of the loop at speed."""
    scene = loop.scene
    lead_in = whole_samples(scene.rig.rate, max(loop.time - scene.ramp, 0.0))
    return Recorder(loop, scene.with_(lead_in=lead_in), checked=False, capacity=PEAK_TURNS * scene.periods.turn)


def _record(trial: Trial, tolerances: Mapping[str, float], seconds: float) -> None:
    """Continue the record of a setting to a length (s), and estimate its measures."""
    clock = trial.recorder.loop.clock
    begin = clock()
    try:
        measures, _ = record_until(trial.recorder, seconds, lambda record: (series(record, tolerances), True))
    except TrackdynError as error:
        trial.refused = str(error)
        return
    trial.cpu_s += clock() - begin
    sides = [name.removesuffix("_peak") for name in tolerances if name.endswith("_peak")]
    if sides and any(map(trial.recorder.statistics().doubtful, sides)):
        trial.refused = "peaks last one step: the true ones may be twice as large"
    trial.measures = {name: measure for name, measure in measures.items() if len(measure.values) >= LEAST_PASSAGES}


def _judge(running: list[Trial], tolerances: Mapping[str, float]) -> None:
    """Set the errors of settings from the limit that the two finest ones give.

    The limit is beyond the finest setting by its difference from the coarser one; with the same method by the share of
    it that a method of order 1 leaves.
    """
    coarser, finest = running[-2:]
    fine, coarse = (trial.recorder.loop.model.step for trial in (finest, coarser))
    weight = fine / (coarse - fine) if coarser.implicit == finest.implicit else 1.0
    passage = finest.recorder.loop.scene.periods.passage
    last = min(trial.skipped + int(trial.seconds / passage + 1e-6) for trial in running)  # passages since their start
    for name in tolerances:
        common = {trial: trial.measures[name].between(0, last - trial.skipped) for trial in running}
        limit = uncertainty.extrapolated(common[finest], common[coarser], weight)
        scale = scale_of(name, common[finest].estimate().value)
        for trial, run in common.items():
            bias, bias_error = uncertainty.difference(run, limit)
            _, error, half_width = trial.measures[name].estimate()
            errors = abs(bias), COVERAGE * bias_error, half_width, COVERAGE * error
            trial.error[name] = TotalError(*(value / scale for value in errors))


def _refusal(tried: list[Trial], tolerances: Mapping[str, float], longest: float) -> str:
    """Return the reason why no setting keeps the tolerances."""
    if not (known := [trial.error for trial in tried if trial.error]):
        reason = next((trial.refused for trial in reversed(tried) if trial.refused), "no setting runs")
        return f"tolerance: {reason}"
    least = {name: min(error[name].bias for error in known) for name in tolerances}
    name = max(tolerances, key=lambda name: least[name] / tolerances[name])
    reason = _scattered(longest, 2 * longest)
    if least[name] > SETTING_SHARE * tolerances[name]:
        reason = f"the best setting has an error of {least[name]:.2g}; use at least {least[name] / SETTING_SHARE:.2g}"
    return f"tolerance = {tolerances[name]:g} of {name}: {reason}"


def check_tolerances(scene: Scene, tolerances: Mapping[str, float], longest: float) -> None:
    """Refuse (`InputError`) invalid measures and tolerances, and a ``longest`` (s) record that is out of range."""
    if not isinstance(tolerances, Mapping) or not tolerances:
        raise InputError(f"tolerances = {tolerances!r}: name measures with a tolerance each, such as {{'rms': 0.01}}")
    for name, value in tolerances.items():
        if name not in TOLERATED:
            raise InputError(f"measure = {name!r}: choose {', '.join(TOLERATED)}")
        within(f"tolerance of {name}", value, LEAST_TOLERANCE, 1.0, ", such as 0.01")
    check_driven(scene)
    least = (LEAST_PASSAGES + 1) * scene.periods.passage  # the first one is cut
    within("longest", longest, least, LONGEST_RUN, " s, of which the first is ten passages of a pitch")

"""The planner: the cheapest physics, method and step that keep a tolerance, found by short runs of the scene itself.

Settings are tried from cheap to dear. All start from one state of the loop at speed and run over the same passages, so
that two of them differ by their errors alone. A setting is accepted if its error takes at most `OF_SETTING` of the
tolerance. The rest is left to the scatter of the record, which ends when its 95 % interval keeps it
(`stopping.run_until`).
"""

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any, NamedTuple

import numpy as np

from trackdyn.errors import InputError, TrackdynError
from trackdyn.measure.sensor import sense, whole_revolutions, whole_samples
from trackdyn.measure.stopping import LEAST, refuse_until
from trackdyn.measure.uncertainty import batch_error
from trackdyn.measure.whole_loop import SHARES, Series, series
from trackdyn.scene.limits import round_step
from trackdyn.scene.scene import Scene
from trackdyn.sensor.signals import main_line_binfree
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.simulate import simulate

OF_SETTING = 0.8  # of the tolerance: what the setting may take, so that something is left for the record
SURE = 2.0  # standard errors of a difference
# A tolerance from which on coarser physics is tried: it misses the RMS by some percent.
COARSE = 0.03
IMPLICIT_STEPS, STEPS = (5e-4, 2.5e-4), (1e-4, 5e-5, 2.5e-5, 1.25e-5)  # s
# passages of a trial after those at speed that no setting is judged by; peaks need arcs that have come round
SETTLED, PASSAGES, PEAK_PASSAGES, GROWTH = 9, 12, 28, 4
WORTH = 2.0  # longer trials that a planned run must cost before one is made
BELT_TURNS = 2.1  # of the loop in the record of a belt


class Setting(NamedTuple):
    """What may be run: its name in words, the fields of a `Scene` that it sets, and the physics that it neglects."""

    name: str
    fields: dict[str, Any]
    left_out: str = ""


@dataclass
class Tried:
    """A setting and what came of it."""

    setting: Setting  # what was tried
    scene: Scene | None = None  # the scene with it; None if it was refused
    # largest error of each measure that is its own, as tolerances are given; empty as long as no finer one ran
    error: dict[str, float] = field(default_factory=dict)
    # half of the 95 % interval of each measure over the trial, as tolerances are given
    half_width: dict[str, float] = field(default_factory=dict)
    rate: float = 0.0  # CPU seconds of a simulated one
    refused: str = ""  # why it did not run, or nothing
    found: dict[str, Series] = field(default_factory=dict, repr=False)


class Plan(NamedTuple):
    """What to run for tolerances."""

    chosen: Tried  # the setting
    left: dict[str, float]  # tolerances of the record: what the setting leaves of those that were asked for
    duration: float  # s at constant speed that its record is expected to take
    cpu_s: float  # CPU seconds that the run is expected to take
    trial_cpu_s: float  # CPU seconds that the trials took
    tried: tuple[Tried, ...]  # all settings that were tried, from cheap to dear

    @property
    def scene(self) -> Scene:
        """What runs: by `stopping.run_until` with ``left`` and, at least, ``duration``; a belt by `simulate`."""
        assert self.chosen.scene is not None
        return self.chosen.scene


def settings(scene: Scene, tolerances: Mapping[str, float], physics: bool, method: bool) -> Iterator[Setting]:
    """Settings of a scene from cheap to dear, as in `plan`; where nothing is open, its own and half its step."""
    sample = 1.0 / scene.rig.sensor.rate
    if not method:
        yield Setting("as the scene asks", {})
        yield Setting("half its step", {"step": round_step(scene.step / 2, sample)})
        return
    if physics and set(tolerances) == {"line"}:
        yield Setting("belt", {"chain": "belt", "ring_radius": None}, "contacts, forces and inertia")
    if physics and min(tolerances.values()) >= COARSE:
        one = {"chain": "single_pin", "integrator": "linearly_implicit", "step": round_step(2.5e-4, sample)}
        yield Setting("one body a pitch", one, "the second pin of a pitch")
    explicit = STEPS if scene.step >= STEPS[-1] else (scene.step, scene.step / 2)
    for integrator, steps in (("linearly_implicit", IMPLICIT_STEPS), ("semi_implicit", explicit)):
        for step in dict.fromkeys(round_step(step, sample) for step in steps):
            yield Setting(f"{integrator}, {step:.3g} s", {"integrator": integrator, "step": step})


def plan(
    scene: Scene, tolerances: Mapping[str, float], longest: float = 60.0, physics: bool = True, method: bool = True
) -> Plan:
    """The cheapest setting that keeps tolerances on a scene.

    Parameters
    ----------
    scene : Scene
        Duration and lead-in are not used.
    tolerances : mapping of str to float
        As in `stopping.run_until`.
    longest : float
        s at constant speed of the longest record.
    physics, method : bool
        Whether coarser physics, and method and step, may be chosen in place of the scene's own.

    Raises
    ------
    InputError
        As `stopping.refuse_until`, or no setting keeps the tolerances: what stands in the way.
    """
    refuse_until(scene, tolerances, longest)
    begin = time.process_time()
    span = scene.periods.passage
    plain = {"lead_in": 0.0, "pitches": (), "frame_interval": 0.0, "spells": True, "every_link": True}
    scene = scene.with_(duration=whole_samples(scene.rig.sensor.rate, LEAST * span), **plain)
    base = Loop(scene)
    settled = time.process_time() - begin
    base.advance(scene.ramp + whole_samples(scene.rig.sensor.rate, SETTLED * span))
    passages = PEAK_PASSAGES if any(name.endswith("_peak") for name in tolerances) else PASSAGES
    kept = list(settings(scene, tolerances, physics, method))
    tried: list[Tried] = []
    best: Plan | None = None
    for count in (passages, GROWTH * passages):
        tried, full = [], []
        for setting in kept:
            one = _try(base, setting, tolerances, count, span)
            tried.append(one)
            if one.refused or one.setting.left_out:
                continue
            full.append(one)
            if len(full) > 1:
                _judge([other for other in tried if not other.refused], full[-2], full[-1], tolerances)
                plans = [_planned(other, tolerances, count, span, settled) for other in tried if other.error]
                if keeping := [one._replace(tried=tuple(tried)) for one in plans if one and one.duration <= longest]:
                    best = min([best, *keeping] if best else keeping, key=lambda found: found.cpu_s)
                    break
        longer = GROWTH * count * span * sum(one.rate for one in full[-3:])
        if best and (count > passages or best.cpu_s <= WORTH * longer):
            return best._replace(trial_cpu_s=time.process_time() - begin)
        # what scatters more than it errs is told apart by longer trials, of the finer settings
        kept = [one.setting for one in full[-3:]]
    raise InputError(_refusal(tried, tolerances, longest))


def _try(base: Loop, setting: Setting, tolerances: Mapping[str, float], passages: int, span: float) -> Tried:
    """Run a setting from the state of a loop at speed, or a coarser chain from its own start."""
    seconds = whole_samples(base.scene.rig.sensor.rate, (passages + 1) * span)
    try:
        if setting.fields.get("chain") == "belt":
            scene = base.scene.with_(spells=False, every_link=False, **setting.fields)
            scene = scene.with_(duration=whole_samples(scene.rig.sensor.rate, BELT_TURNS / scene.periods.loop_hz))
            recording = simulate(scene)
            ay, hz = sense(recording).ay, recording.periods.loop_hz
            ay = ay[: whole_revolutions(len(ay), recording.rate, hz)]
            line = main_line_binfree(ay, recording.rate, expected_hz=hz)[1]
            return Tried(
                setting, scene, found={"line": Series(np.array([line]), np.array([0]))}, half_width={"line": 0.0}
            )
        if "chain" in setting.fields:
            loop = Loop(base.scene.with_(**setting.fields))
            loop.advance(base.time)
        else:
            loop = base.changed(**setting.fields)
        begin = time.process_time()
        recording = loop.record(seconds, every_link=True)
        rate = (time.process_time() - begin) / seconds
        found = series(recording)
    except TrackdynError as error:
        return Tried(setting, refused=str(error))
    if missing := [name for name in tolerances if name not in found or len(found[name].values) < LEAST]:
        return Tried(setting, refused=f"{missing[0]} has fewer than {LEAST} values in {passages} passages")
    width = {name: found[name].estimate().half_width / _scale(name, found[name]) for name in tolerances}
    return Tried(setting, loop.scene, half_width=width, rate=rate, found=found)


def _scale(name: str, found: Series) -> float:
    """What a tolerance is a part of: a turn of the sprocket, in percent, or the value."""
    return 100.0 if name in SHARES else abs(found.estimate().value) or inf


def _judge(tried: list[Tried], coarser: Tried, finest: Tried, tolerances: Mapping[str, float]) -> None:
    """Errors of all settings from the two finest ones.

    That of the finest is what a step further would change: as much as the last one did, less by the ratio of the steps
    where the method, of order 1, is the same. Those of the others are their differences from it beyond that.
    """
    steps = [one.scene.step for one in (coarser, finest) if one.scene]
    same = len({one.setting.fields.get("integrator") for one in (coarser, finest)}) == 1
    ratio = steps[1] / (steps[0] - steps[1]) if same else 1.0
    for name in tolerances:
        scale = _scale(name, finest.found[name])
        rest = ratio * _apart(coarser.found[name], finest.found[name]) / scale
        for one in tried:
            own = 0.0 if one is finest else _apart(one.found[name], finest.found[name]) / scale
            one.error[name] = own + rest


def _apart(one: Series, other: Series) -> float:
    """Difference of two means over the same passages, two standard errors larger than it is found."""
    if len(one.values) == 1:  # a belt does not scatter
        return abs(one.estimate().value - other.estimate().value) + SURE * other.estimate().error
    count = min(len(one.values), len(other.values))
    pairs = one.linear()[-count:] - other.linear()[-count:]
    return float(abs(pairs.mean()) + SURE * batch_error(pairs)[0])


def _planned(one: Tried, tolerances: Mapping[str, float], passages: int, span: float, settled: float) -> Plan | None:
    """What a setting promises, and what its record is expected to take; None if it takes too much of a tolerance."""
    if any(one.error[name] > OF_SETTING * tolerance for name, tolerance in tolerances.items()):
        return None
    left = {name: tolerance - one.error[name] for name, tolerance in tolerances.items()}
    # an interval falls as one over the root of the passages
    growth = max((one.half_width[name] / rest) ** 2 for name, rest in left.items())
    duration = 0.0 if one.scene and one.scene.chain == "belt" else (SETTLED + max(LEAST + 1, passages * growth)) * span
    ramp = one.scene.ramp if one.scene else 0.0
    return Plan(one, left, duration, settled + one.rate * (ramp + duration), 0.0, ())


def _refusal(tried: list[Tried], tolerances: Mapping[str, float], longest: float) -> str:
    """Why no setting keeps the tolerances."""
    judged = [one for one in tried if one.error]
    if not judged:
        reason = next((one.refused for one in reversed(tried) if one.refused), "no setting runs")
        return f"tolerance: {reason}"
    name = max(tolerances, key=lambda name: min(one.error[name] for one in judged) / tolerances[name])
    least = min(one.error[name] for one in judged)
    if least > OF_SETTING * tolerances[name]:
        return (
            f"tolerance = {tolerances[name]:g} of {name}: what was tried leaves an error of {least:.2g}; "
            f"use at least {least / OF_SETTING:.2g}"
        )
    return (
        f"tolerance = {tolerances[name]:g} of {name}: records of {longest:g} s scatter by more than that; use a larger "
        "one, or --longest"
    )

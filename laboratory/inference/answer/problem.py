"""The scorecard as residuals: a rig's row at every speed and radius that a question asks for, judged claim by claim."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from laboratory.inference.answer.revolution import summary
from laboratory.inference.answer.settings import AnswerConfig
from laboratory.inference.search import bent
from laboratory.inference.unknowns import Unknown, Unknowns, file_ranges
from replication.paper.claims import JUDGED, NOT_SHOWN, ONE_SIDED, SHOWN, Claim, Value, judge
from replication.paper.evidence import Evidence
from trackdyn.errors import InputError
from trackdyn.measure.contacts import LEAST_SHARE
from trackdyn.measure.sensor import whole_samples
from trackdyn.measure.whole_loop import stitch
from trackdyn.parameters.layout import can_close
from trackdyn.parameters.rig import Rig
from trackdyn.scene.scene import Periods, Scene
from trackdyn.sensor.signals import high_frequency_rms
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.settling import SettledLoops
from trackdyn.simulation.simulate import simulate
from trackdyn.sources import module_hash
from trackdyn.sweeps.row import first_that_runs

# residual, in tolerances, of a number that does not exist: a contact that never occurs, a ratio to zero
MISSING = 6.0
LEAST = 1e-6  # a value of zero, in a logarithm
TREND = 0.05  # a trend that falls by so much more than it may is a tolerance further off
# Smooth forms (`revolution.summary`) of claims whose own measure is text or jumps, instead of its residuals or
# `BESIDE` them: with a ring or without, column, value that is wanted, tolerance
FORMS: dict[str, tuple[tuple[bool, str, float, float], ...]] = {
    "C15": ((False, "left_outside_2_pct", 0.0, LEAST_SHARE), (False, "right_outside_7_pct", 0.0, LEAST_SHARE)),
    "C16b": ((False, "left_at_printed", 1.0, 0.1),),
    "C16c": ((False, "right_at_printed", 1.0, 0.1),),
    "C17a": ((True, "left_early_pct", 0.0, 0.5),),
    "C18": ((True, "left_outside_2_pct", 0.0, LEAST_SHARE), (True, "right_share_pct", 0.0, 0.5)),
}
BESIDE = ("C17a",)
# A residual below MET tolerances counts by this fraction, and grows faster beyond: a search gives up no statement for
# others that are well within their tolerances.
MET, LEAN, STEEP = 0.7, 0.25, 1.5
FAR = 0.6  # residual for each factor of e by which a typed value lies outside its range


def rows_of_answer(memory: float) -> Callable[..., dict]:
    """What computes all scenes of a rig as a row."""
    return _row


def _row(rig: dict, scenes: list[list], fields: dict, row: dict) -> dict:
    made = Rig.model_validate(rig)
    return first_that_runs(row["steps_s"], lambda step: _scenes(made, scenes, fields | {"step": step}, row))


def _scenes(rig: Rig, scenes: list[list], fields: dict, row: dict) -> dict:
    starts = SettledLoops(kept=len(scenes))
    least = Scene.ring_range(rig)[0]
    settings: dict = {"rig": rig.model_dump()}
    for rpm, ring, sensed in scenes:
        same = name_of(rpm, None)
        if ring is not None and ring < least and same in settings:  # it touches nothing: no ring
            settings[name_of(rpm, ring)] = settings[same]
            continue
        span = row["passages"] * Periods.at(rig, rpm).passage
        scene = Scene(
            rig, motor_rpm=rpm, ring_radius=ring, ramp=row["ramp_s"], lead_in=row["lead_in_s"], contact_log=False,
            duration=whole_samples(rig.sensor.rate, span) + 2 / rig.sensor.rate, integrator="linearly_implicit",
            pitches=list(range(1, rig.chain.pitches + 1)), every_link=sensed, **fields,
        )  # fmt: skip
        recording = simulate(scene, starts=starts)
        values, times = summary(recording)
        values |= {f"event {name}": seconds for name, seconds in times.items()}
        settings[name_of(rpm, ring)] = values | (_sensed(recording) if sensed else {})
    return settings


def name_of(rpm: float, ring: float | None) -> str:
    """``115 none``, ``115 0.308``."""
    return f"{rpm:g} {'none' if ring is None else format(ring, 'g')}"


def _sensed(recording: Recording) -> dict[str, float]:
    """RMS, SD, content from 20 Hz on and amplitude of the loop's line, of a revolution of one link, g."""
    ay = stitch(recording)
    line = 2 * abs(np.fft.rfft(ay)[1]) / len(ay)
    measures = {"rms_g": np.sqrt(np.mean(ay**2)), "sd_g": ay.std(), "line_g": line}
    measures["high_frequency_g"] = high_frequency_rms(ay, recording.rate)
    return {name: float(value) for name, value in measures.items()}


class AnswerProblem:
    """A question as a problem of `inference.search`."""

    def __init__(self, config: AnswerConfig, question: str, unknowns: Unknowns, claims: Sequence[Claim]):
        self.config, self.question, self.unknowns = config, config.questions[question], unknowns
        self.claims = list(claims)
        self.rows, self.sources = rows_of_answer, module_hash(__name__)
        possible = [unknown for unknown in config.unknowns if unknown.label not in self.question.fixed]
        self.possible = Unknowns(possible, unknowns.rig, file_ranges(self.question.rig))

    def scenes(self) -> list[list]:
        """Speed, ring radius and whether sensors are read, of every scene of a row."""
        c = self.config
        speeds = self.question.speeds_rpm
        return [[rpm, ring, ring == c.ring_radius_m] for rpm in speeds for ring in (None, *c.radii_m)]

    def task(self, x: np.ndarray) -> dict:
        """Arguments of the row of a point."""
        return self.task_of(self.unknowns.near(self.unknowns.values(x), np.ones(len(self.unknowns))))

    def task_of(self, rig: Rig) -> dict:
        """Arguments of the row of a rig; an `InputError` if its loop does not close."""
        if not can_close(rig):
            raise InputError("the loop does not close within the travel of the tensioner")
        return {
            "rig": rig.model_dump(), "scenes": self.scenes(), "fields": self.question.scene,
            "row": self.config.row.model_dump(),
        }  # fmt: skip

    def evidence(self, values: dict, rig: Rig) -> Evidence:
        """A row as what claims are judged by."""
        c = self.config
        metrics, events = [], []
        for rpm, ring, sensed in self.scenes():
            row = values[name_of(rpm, ring)]
            of = {"rpm": rpm, "ring_radius_m": np.nan if ring is None else ring, **row}
            runs = [f"ring/{rpm:g}rpm_{ring}"] + [f"{rpm:g}rpm"] * sensed
            if rpm == c.speed_rpm and ring in (None, c.ring_radius_m):
                name = f"meshing/{'no_ring' if ring is None else 'ring'}"
                runs.append(name)
                times = {key.removeprefix("event "): time for key, time in row.items() if key.startswith("event ")}
                events += [
                    {"run": name, "event": event, "median_s": time, "sd_s": np.nan, "area": row.get(f"area {event}")}
                    for event, time in times.items()
                ]
            metrics += [{"run": run, **of} for run in runs]
        return Evidence(pd.DataFrame(metrics), pd.DataFrame(events), rig, c.speed_rpm, c.ring_radius_m)

    def judged(self, values: dict) -> dict[str, tuple[str, np.ndarray]]:
        """Verdict and signed residuals, in tolerances, of every claim for the rig of a row."""
        e = self.evidence(values, Rig.model_validate(values["rig"]))
        judged = {}
        for claim in self.claims:
            judgement = judge(claim, e)
            if judgement.verdict not in JUDGED:
                # where no force acts nothing is shown: as many numbers as of any rig, and far off
                forces = {name: 1.0 for name in e.metrics if name.endswith("_n")}
                judgement = judge(claim, replace(e, metrics=e.metrics.assign(**forces)))
                if judgement.verdict not in JUDGED:
                    raise InputError(f"{claim.name} cannot be judged: {judgement.measured}")
                numbers = tuple(number._replace(value=np.nan, distance=np.inf) for number in judgement.values)
                judgement = judgement._replace(verdict=NOT_SHOWN, values=numbers)
            off = np.array([self._form(values, *form) for form in FORMS.get(claim.name, ())])
            if claim.name not in FORMS or claim.name in BESIDE:
                pairs = zip(judgement.values, [None, *judgement.values], strict=False)
                off = np.append(off, [residual(claim, number, before) for number, before in pairs])
            judged[claim.name] = (judgement.verdict, np.nan_to_num(off, nan=MISSING, posinf=MISSING, neginf=-MISSING))
        return judged

    def _form(self, values: dict, ring: bool, column: str, wanted: float, tolerance: float) -> float:
        value = values[name_of(self.config.speed_rpm, self.config.ring_radius_m if ring else None)][column]
        return float("nan") if value is None else (value - wanted) / tolerance

    def _implausible(self, rig: Rig) -> np.ndarray:
        """``FAR`` times the logarithm of the factor by which each value lies outside its range."""
        values = self.possible.of_rig(rig)
        off = []
        for unknown in self.possible.unknowns:
            low, high = min(a for a, _ in unknown.intervals), max(b for _, b in unknown.intervals)
            value = max(values[unknown.label], LEAST)
            off.append(FAR * np.log(value / np.clip(value, max(low, LEAST), high)))
        return np.array(off)

    def residuals(self, values: dict) -> np.ndarray:
        """Of all claims for the rig of a row, `hinged`, large ones bent, and of implausible values (`_implausible`)."""
        claims = bent(hinged(np.concatenate([off for _, off in self.judged(values).values()])))
        if self.question.ranges == "possible":
            return claims
        return np.append(claims, self._implausible(Rig.model_validate(values["rig"])))


def hinged(off: np.ndarray) -> np.ndarray:
    """Signed residuals (tolerances) that are small below `MET` and grow faster beyond."""
    size = np.abs(off)
    return np.sign(off) * np.where(size < MET, LEAN * size, LEAN * MET + STEEP * (size - MET))


def neighbours(count: int, share: float, unknowns: int) -> np.ndarray:
    """(1 + count, unknowns) factors of a rig's values: ones, then those of its neighbours, each up to a share off."""
    moved = np.random.default_rng(0).uniform(-share, share, (count, unknowns))
    return 1 + np.vstack([np.zeros(unknowns), moved])


def residual(claim: Claim, value: Value, before: Value | None) -> float:
    """Signed distance of a number in tolerances: a claim is met where none is beyond 1.

    One-sided claims have the distance of the scorecard (`paper.claims.distance`): 1 on the bound and 0 a `Claim.scale`
    within it, so that a search does not end on the bound.
    """
    if claim.rule == "rising":
        if before is None or not before.value:
            return 0.0
        return max(0.0, 1 + ((1 - claim.within) - value.value / before.value) / TREND)
    if claim.rule in ONE_SIDED:
        return value.distance
    return (value.value - value.printed) / claim.tolerance


def shown(judged: dict[str, tuple[str, np.ndarray]]) -> int:
    """Claims that are reproduced."""
    return sum(verdict == SHOWN for verdict, _ in judged.values())


def answer_problem(config: dict, question: str, unknowns: list, rig: dict, claims: list) -> AnswerProblem:
    """A problem from plain data."""
    made = Unknowns([Unknown.model_validate(unknown) for unknown in unknowns], Rig.model_validate(rig))
    return AnswerProblem(
        AnswerConfig.model_validate(config), question, made, [Claim.model_validate(claim) for claim in claims]
    )

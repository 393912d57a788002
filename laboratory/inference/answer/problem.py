"""The scorecard as residuals: a rig's row at every speed and radius that a question asks for, judged claim by claim."""

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from laboratory.inference.answer.revolution import summary
from laboratory.inference.answer.settings import AnswerConfig
from laboratory.inference.search import bent
from laboratory.inference.unknowns import Unknown, Unknowns
from replication.paper.claims import JUDGED, ONE_SIDED, REPRODUCED, Claim, Value, examine
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
TREND = 0.05  # a trend that falls by so much more than it may is a tolerance further off
# Claims whose printed value is text, areas of contact: contact outside them, or before they are reached
AREAS = {"C15": ("left_late_2_pct", "right_late_7_pct"), "C18": ("left_outside_2_pct", "right_share_pct")}
SHARE_OF = {"right_share_pct": 0.5}  # % of a turn that count as a tolerance, else `LEAST_SHARE`


def rows_of_answer(memory: float) -> Callable[..., dict]:
    """What computes all scenes of a rig and of its neighbours as a row."""
    return _row


def _row(rigs: list[dict], scenes: list[list], fields: dict, row: dict) -> dict:
    def found(rig: Rig) -> dict:
        return first_that_runs(row["steps_s"], lambda step: _scenes(rig, scenes, fields | {"step": step}, row))

    return {"rigs": [found(Rig.model_validate(rig)) for rig in rigs]}


def _scenes(rig: Rig, scenes: list[list], fields: dict, row: dict) -> dict:
    starts = SettledLoops(kept=len(scenes))
    least = Scene.ring_range(rig)[0]
    found: dict = {"rig": rig.model_dump()}
    for rpm, ring, sensed in scenes:
        same = name_of(rpm, None)
        if ring is not None and ring < least and same in found:  # it touches nothing: no ring
            found[name_of(rpm, ring)] = found[same]
            continue
        span = row["passages"] * Periods.at(rig, rpm).passage
        scene = Scene(
            rig, motor_rpm=rpm, ring_radius=ring, ramp=row["ramp_s"], lead_in=row["lead_in_s"], spells=False,
            duration=whole_samples(rig.sensor.rate, span) + 2 / rig.sensor.rate, integrator="linearly_implicit",
            pitches=list(range(1, rig.chain.pitches + 1)), every_link=sensed, **fields,
        )  # fmt: skip
        recording = simulate(scene, starts=starts)
        values, times = summary(recording)
        values |= {f"event {name}": seconds for name, seconds in times.items()}
        found[name_of(rpm, ring)] = values | (_sensed(recording) if sensed else {})
    return found


def name_of(rpm: float, ring: float | None) -> str:
    """``115 none``, ``115 0.308``."""
    return f"{rpm:g} {'none' if ring is None else format(ring, 'g')}"


def _sensed(recording: Recording) -> dict[str, float]:
    """RMS, SD, content from 20 Hz on and amplitude of the loop's line, of a revolution of one link, g."""
    ay = stitch(recording).ay
    line = 2 * abs(np.fft.rfft(ay)[1]) / len(ay)
    found = {"rms_g": np.sqrt(np.mean(ay**2)), "sd_g": ay.std(), "line_g": line}
    found["high_frequency_g"] = high_frequency_rms(ay, recording.rate)
    return {name: float(value) for name, value in found.items()}


class AnswerProblem:
    """A question as a problem of `inference.search`."""

    def __init__(self, config: AnswerConfig, question: str, unknowns: Unknowns, claims: Sequence[Claim]):
        self.config, self.question, self.unknowns = config, config.questions[question], unknowns
        self.claims = list(claims)
        self.rows, self.sources = rows_of_answer, module_hash(__name__)
        self.factors = neighbours(self.question.neighbours, config.robustness.share, len(unknowns))

    def scenes(self) -> list[list]:
        """Speed, ring radius and whether sensors are read, of every scene of a row."""
        c = self.config
        speeds = self.question.speeds_rpm
        return [[rpm, ring, ring == c.ring_radius_m] for rpm in speeds for ring in (None, *c.radii_m)]

    def task(self, x: np.ndarray) -> dict:
        """Arguments of the row of a point."""
        values = self.unknowns.values(x)
        return self.task_of(*(self.unknowns.near(values, one) for one in self.factors))

    def task_of(self, *rigs: Rig) -> dict:
        """Arguments of the row of a rig and its neighbours; an `InputError` if a loop does not close."""
        if not all(can_close(rig) for rig in rigs):
            raise InputError("the loop does not close within the travel of the tensioner")
        plain, row = [rig.model_dump() for rig in rigs], self.config.row.model_dump()
        return {"rigs": plain, "scenes": self.scenes(), "fields": self.question.scene, "row": row}

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
                events += [
                    {"run": name, "event": key.removeprefix("event "), "mean_s": time}
                    for key, time in row.items() if key.startswith("event ")
                ]  # fmt: skip
            metrics += [{"run": run, **of} for run in runs]
        return Evidence(pd.DataFrame(metrics), pd.DataFrame(events), rig, c.speed_rpm, c.ring_radius_m)

    def judged(self, row: dict) -> dict[str, tuple[str, np.ndarray]]:
        """Verdict and signed residuals, in tolerances, of every claim for the rig of a row."""
        return self._judged(row["rigs"][0])

    def _judged(self, values: dict) -> dict[str, tuple[str, np.ndarray]]:
        e = self.evidence(values, Rig.model_validate(values["rig"]))
        found = {}
        for claim in self.claims:
            judgement, numbers = examine(claim, e)
            if claim.name in AREAS:
                off = np.array([self._area(values, claim.name, name) for name in AREAS[claim.name]])
            elif judgement.verdict in JUDGED:
                off = np.array(
                    [residual(claim, one, before) for one, before in zip(numbers, [None, *numbers], strict=False)]
                )
            else:
                raise InputError(f"{claim.name} cannot be judged: {judgement.measured}")
            if claim.rule == "either_at_most":
                off = off[np.abs(off).argmin()][None]
            found[claim.name] = (judgement.verdict, np.nan_to_num(off, nan=MISSING, posinf=MISSING, neginf=-MISSING))
        return found

    def _area(self, values: dict, claim: str, name: str) -> float:
        ring = None if claim == "C15" else self.config.ring_radius_m
        value = values[name_of(self.config.speed_rpm, ring)][name]
        return float("nan") if value is None else value / SHARE_OF.get(name, LEAST_SHARE)

    def residuals(self, values: dict) -> np.ndarray:
        """Of all claims for the rig of a row and its neighbours, which count as much as it; large ones bent."""
        every = [off for found in values["rigs"] for _, off in self._judged(found).values()]
        return bent(np.concatenate(every)) / np.sqrt(len(values["rigs"]))


def neighbours(count: int, share: float, unknowns: int, searched: int = 0) -> np.ndarray:
    """(1 + count, unknowns) factors of a rig's values: ones, then those of its neighbours, each up to a share off;
    without the first ones, with which the rig was searched.
    """
    moved = np.random.default_rng(0).uniform(-share, share, (searched + count, unknowns))
    return 1 + np.vstack([np.zeros(unknowns), moved[searched:]])


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
    return sum(verdict == REPRODUCED for verdict, _ in judged.values())


def answer_problem(config: dict, question: str, unknowns: list, rig: dict, claims: list) -> AnswerProblem:
    """A problem from plain data."""
    made = Unknowns([Unknown.model_validate(one) for one in unknowns], Rig.model_validate(rig))
    return AnswerProblem(
        AnswerConfig.model_validate(config), question, made, [Claim.model_validate(one) for one in claims]
    )

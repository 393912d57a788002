"""Features of simulated records: a rig in, the features of every speed out, many rigs on the cores of a machine.

What is computed is kept on disk at once, and known again by rig, scenes and sources.
"""

from collections.abc import Sequence
from math import ceil
from pathlib import Path
from typing import NamedTuple

import numpy as np

from laboratory.inference.identification.features import features, turn_statistics
from trackdyn.errors import DivergenceError, InputError
from trackdyn.integrate.methods import METHODS
from trackdyn.measure.sensor import sense
from trackdyn.rig.rig import Rig
from trackdyn.scene.choices import preset
from trackdyn.scene.scene import Periods, Scene
from trackdyn.scene.step import first_that_runs, halved_steps, largest_step, round_step
from trackdyn.simulation.settling import SettledLoops
from trackdyn.simulation.simulate import simulate
from trackdyn.sources import module_hash
from trackdyn.sweeps.engine import DONE, check_completed, key_of, results

# s at constant speed: after 3 s, strands of little damping still move from the start, by up to a factor of four between
# 3 and 6 Hz at 210 rpm; a turn after 12 s differs from one after 24 s as single turns do
LEAD_IN = 12.0
MARGIN = 0.5  # share of the step limit, a limit of stability: hard rings on tight loops ring beyond what it resolves
# Halvings of the step, where a run finds that its contacts are not resolved; where motion repeats, resolved runs agree
# to 1 % in all features.
HALVINGS = 2


class MeasuredSpeed(NamedTuple):
    """The simulation beside a record."""

    rpm: float  # motor speed, rev/min
    ring_radius: float | None  # radius of the sprocket's ring, m; None: no ring
    rate: int  # samples a second of the simulation, Hz
    every: int = 1  # samples of the simulation that make one of the sensor
    preset: str = "standard"  # bundle of choices of fidelity
    choices: tuple[tuple[str, str], ...] = ()  # choices instead of the preset's, such as ``("drag", "rolling")``

    @property
    def record_rate(self) -> float:
        """Samples a second of the sensor's record, Hz."""
        return self.rate / self.every


def scene_of_speed(rig: Rig, speed: MeasuredSpeed, seconds: float) -> Scene:
    """The scene of a speed whose record holds ``seconds``, with the largest step up to the preset's that the rig
    allows.
    """
    fields = preset(speed.preset, speed.ring_radius is not None) | dict(speed.choices)
    rig = rig.sampled(speed.rate)
    made = {"duration": ceil(seconds * speed.rate + 1) / speed.rate, "lead_in": LEAD_IN, "contact_log": False}
    scene = Scene(rig, speed.rpm, speed.ring_radius, **fields | made | {"step": None})
    largest = largest_step(scene.model, rig.tension.pre_tension, method=METHODS[scene.integrator])
    return scene.with_(step=round_step(min(fields["step"], MARGIN * largest), 1.0 / speed.rate))


def simulated_ay(rig: Rig, speed: MeasuredSpeed, turns: int, starts: SettledLoops | None = None) -> np.ndarray:
    """(samples,) y acceleration that a sensor reports over so many turns of the loop, g."""
    scene = scene_of_speed(rig, speed, turns * Periods.at(rig, speed.rpm).loop)
    steps = halved_steps(scene.time_step, 1.0 / speed.rate, HALVINGS)
    recording = first_that_runs(steps, lambda step: simulate(scene.with_(step=step), starts=starts), (DivergenceError,))
    return sense(recording, speed.every).ay


class Experiment(NamedTuple):
    """The runs of every rig."""

    rig: Rig  # all that is not changed
    speeds: tuple[MeasuredSpeed, ...]  # at which records are simulated
    turns: int = 1  # recorded turns of the loop; where motion repeats, one suffices
    noise: float = 0.0  # white noise that is added to the records, g: for records that play a sensor's


def run_rig(rig: dict, changes: dict, speeds: list, turns: int, noise: float, seed: int) -> dict:
    """Simulate a rig: `turn_statistics` of every speed, the values of a row of the sweep engine."""
    changed, starts, rng = Rig.model_validate(rig).changed(**changes), SettledLoops(), np.random.default_rng(seed)
    values = {}
    for k, speed in enumerate(MeasuredSpeed(*fields) for fields in speeds):
        ay = simulated_ay(changed, speed, turns, starts)
        ay = ay + noise * rng.standard_normal(ay.shape)
        period = Periods.at(changed, speed.rpm).loop
        values[str(k)] = turn_statistics(ay, speed.record_rate, period, changed.chain.pitches).tolist()
    return values


class Simulated(NamedTuple):
    """Results of a list of rigs."""

    ran: np.ndarray  # which of them ran
    statistics: list[list[np.ndarray]]  # of every rig that ran, `turn_statistics` of every speed
    features: np.ndarray  # (rigs that ran, features of all speeds)
    reasons: list[str]  # why the others did not run


def run_experiment(
    experiment: Experiment,
    changes: Sequence[dict],
    store: Path | str | None,
    jobs: int = 1,
    progress: str = "",
    most_failed: float = 1.0,
) -> Simulated:
    """Simulate rigs (fields by dotted name), those that the store does not know.

    ``progress`` is what the bar is called, none if empty; ``most_failed`` the share of rigs that need not run.

    Raises
    ------
    InputError
        More rigs cannot run.
    """
    content = experiment._asdict() | {"rig": experiment.rig.model_dump()}
    tasks = [content | {"changes": change} for change in changes]
    keys = [key_of(task, module_hash(__name__)) for task in tasks]
    seeded = {key: task | {"seed": int(key_of(task), 16)} for key, task in zip(keys, tasks, strict=True)}
    rows_by_key = results(run_rig, seeded, jobs, store, progress, "rig")
    check_completed(rows_by_key.values(), "--resume goes on from there")
    rows = [rows_by_key[key] for key in keys]
    ran = np.array([row["state"] == DONE for row in rows])
    reasons = [row["reason"] for row in rows if row["state"] != DONE]
    if len(reasons) > most_failed * len(rows):
        raise InputError(
            f"{len(reasons)} of {len(rows)} rigs within the ranges cannot run; the reason of the first one: "
            f"{reasons[0]}; use narrower ranges (--unknown NAME=LOW:HIGH)"
        )
    rates = [speed.record_rate for speed in experiment.speeds]
    done = [row["values"] for row in rows if row["state"] == DONE]
    statistics = [[np.array(values[str(k)]) for k in range(len(rates))] for values in done]
    of_rigs = [np.concatenate(list(map(features, values, rates))) for values in statistics]
    return Simulated(ran, statistics, np.array(of_rigs), reasons)

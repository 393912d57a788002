"""Features of simulated records: a rig in, the features of every speed out, many rigs on the cores of a machine.

What is computed is kept on disk at once, and known again by rig, scenes and sources.
"""

import hashlib
import json
import multiprocessing
import signal
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import ceil
from pathlib import Path
from typing import NamedTuple

import numpy as np
from tqdm import tqdm

from trackdyn.errors import DivergenceError, InputError, TrackdynError
from trackdyn.inference.identification.features import features, features_of, turn_statistics
from trackdyn.integrate.methods import METHODS
from trackdyn.jit import KERNEL_SOURCES, source_hash
from trackdyn.measure.sensor import sense
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.validation import shown
from trackdyn.scene.fidelity import preset
from trackdyn.scene.limits import step_limits
from trackdyn.scene.scene import Scene
from trackdyn.simulation.settled_loops import Starts
from trackdyn.simulation.simulate import simulate
from trackdyn.sweeps.row import DIVERGED, DONE, FAILED, REFUSED, SOURCES
from trackdyn.sweeps.store import Store

LEAD_IN = (
    3.0  # s at constant speed: turns of the shipped rig then differ from later ones no more than those from each other
)
MARGIN = 0.5  # of the step limit, which is one of stability: hard rings on tight loops ring beyond what it resolves
# of the step, where a run finds that its contacts are not resolved; where motion repeats, resolved runs agree to 1 % in
# all features
HALVINGS = 2


class Speed(NamedTuple):
    """What is simulated beside a record.

    Attributes
    ----------
    rpm : float
        Motor speed, rev/min.
    ring_radius : float or None
        Radius of the sprocket's ring, m; None: no ring.
    rate : int
        Samples a second of the simulation, Hz.
    every : int
        Samples of the simulation that make one of the sensor.
    preset : str
        Bundle of choices of fidelity.
    """

    rpm: float
    ring_radius: float | None
    rate: int
    every: int = 1
    preset: str = "standard"


def scene_of(rig: Rig, speed: Speed, seconds: float) -> Scene:
    """The scene of a speed whose record holds ``seconds``, with the largest step up to the preset's that the rig
    allows.
    """
    fields = preset(speed.preset)
    rig = rig.changed(sensor__rate=speed.rate)
    duration = ceil(seconds * speed.rate + 1) / speed.rate
    made = {"duration": duration, "lead_in": LEAD_IN, "spells": False}
    fine = Scene(rig, speed.rpm, speed.ring_radius, **fields | made | {"step": 1.0 / speed.rate / 1000})
    limits = step_limits(fine.model, rig.tension.pre_tension, METHODS[fine.integrator])
    step = min([fields["step"], *(MARGIN * limit for limit in limits.values())])
    return fine.with_(step=1.0 / speed.rate / ceil(1.0 / speed.rate / step - 1e-6))


def simulated_ay(rig: Rig, speed: Speed, turns: int, starts: Starts | None = None) -> np.ndarray:
    """(samples,) y acceleration that a sensor reports over so many turns of the loop, g.

    Raises
    ------
    InputError, DivergenceError
        The rig cannot run so.
    """
    scene = scene_of(rig, speed, turns * rig.loop_period(speed.rpm))
    for _ in range(HALVINGS):
        try:
            return sense(simulate(scene, starts=starts), speed.every).ay
        except DivergenceError:
            scene = scene.with_(step=scene.step / 2)
    return sense(simulate(scene, starts=starts), speed.every).ay


class Experiment(NamedTuple):
    """What every rig is asked.

    Attributes
    ----------
    rig : Rig
        All that is not changed.
    speeds : tuple of Speed
        At which records are simulated.
    turns : int
        Of the loop in each; where motion repeats, one says it all.
    noise : float
        White noise that is added to the records, g: for records that play a sensor's.
    """

    rig: Rig
    speeds: tuple[Speed, ...]
    turns: int = 1
    noise: float = 0.0

    @property
    def counts(self) -> list[int]:
        """Numbers of features of the speeds."""
        return [len(features_of(speed.rate / speed.every)) for speed in self.speeds]

    def key(self, changes: dict) -> str:
        """Hash of all that the features depend on."""
        sources = source_hash(
            (
                *KERNEL_SOURCES,
                *SOURCES,
                "inference/identification/features.py",
                "inference/identification/experiment.py",
            )
        )
        content = [self.rig.model_dump(), changes, self.speeds, self.turns, self.noise, sources]
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:24]

    def compute(self, changes: dict) -> dict:
        """A row for the store: state, reason, and the statistics of turns of every speed (``section__field``
        changes).
        """
        state, reason, values = DONE, "", {}
        key, starts, began = self.key(changes), Starts(), time.process_time()
        rng = np.random.default_rng(int(key, 16))
        try:
            rig = self.rig.changed(**changes)
            for k, speed in enumerate(self.speeds):
                ay = simulated_ay(rig, speed, self.turns, starts)
                ay = ay + self.noise * rng.standard_normal(ay.shape)
                rate = speed.rate / speed.every
                found = turn_statistics(ay, rate, rig.loop_period(speed.rpm), rig.chain.pitches)
                values[str(k)] = found.tolist()
        except InputError as error:
            state, reason, values = REFUSED, str(error), {}
        except DivergenceError as error:
            state, reason, values = DIVERGED, str(error), {}
        except (MemoryError, TrackdynError) as error:
            state, reason = FAILED, shown(str(error)) or "the memory that is free does not suffice"
        cost = {"cpu_s": time.process_time() - began}
        return {"key": key, "state": state, "reason": reason, "values": values, "cost": cost}


class Simulated(NamedTuple):
    """What came of a list of rigs.

    Attributes
    ----------
    statistics : list
        For every rig that ran, `turn_statistics` of every speed; None for one that could not run.
    reasons : list of str
        Why; empty for one that ran.
    """

    statistics: list[list[np.ndarray] | None]
    reasons: list[str]

    @property
    def ran(self) -> np.ndarray:
        """Which rigs ran."""
        return np.array([found is not None for found in self.statistics])

    def features(self, experiment: Experiment) -> np.ndarray:
        """(rigs that ran, features of all speeds)."""
        rates = [speed.rate / speed.every for speed in experiment.speeds]
        return np.array(
            [
                np.concatenate([features(one, rate) for one, rate in zip(found, rates, strict=True)])
                for found in self.statistics
                if found is not None
            ]
        )


def run(
    experiment: Experiment, changes: Sequence[dict], store: Path | str | None, jobs: int = 1, progress: str = ""
) -> Simulated:
    """Simulate rigs, those that the store does not know; ``progress`` is what the bar is called, none if empty."""
    kept = Store(store) if store else None
    keys = [experiment.key(change) for change in changes]
    found = kept.read(set(keys)) if kept else {}
    due = [change for change, key in zip(changes, keys, strict=True) if key not in found]
    with tqdm(total=len(due), disable=not progress, unit="rig", desc=progress, smoothing=0.05) as bar:
        for row in _computed(experiment, due, jobs):
            if kept:
                kept.keep(row)
            found[row["key"]] = row
            bar.update()
    rows = [found[key] for key in keys]
    for row in rows:
        if row["state"] == FAILED:
            raise TrackdynError(
                f"a simulation failed for a reason that may pass ({row['reason']}); --resume goes on from there"
            )
    statistics = [
        [np.array(row["values"][str(k)]) for k in range(len(experiment.speeds))] if row["state"] == DONE else None
        for row in rows
    ]
    return Simulated(statistics, [row["reason"] for row in rows])


def _computed(experiment: Experiment, due: list[dict], jobs: int) -> Iterator[dict]:
    if jobs == 1 or len(due) < 2:
        yield from map(experiment.compute, due)
        return
    yield experiment.compute(due[0])  # compiles what the processes would compile side by side
    with _pool(jobs) as pool:
        yield from pool.imap_unordered(experiment.compute, due[1:])


@contextmanager
def _pool(jobs: int):
    """Processes that leave an interruption to the one that started them."""
    pool = multiprocessing.Pool(jobs, initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN))
    try:
        yield pool
    finally:
        pool.terminate()
        pool.join()

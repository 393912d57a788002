"""Recorder: record a loop in chunks, check step and energy balance meanwhile, and estimate the memory."""

import time
from typing import Any, NamedTuple

import numpy as np

from trackdyn.inputs.errors import DivergenceError, InputError, OutOfMemoryError
from trackdyn.inputs.memory import free_memory
from trackdyn.model.arrays import CONTACT_INTERVAL, Plane, make_record, make_state
from trackdyn.model.constants import SPROCKET
from trackdyn.scene.build import build_sensors
from trackdyn.simulation import step_check
from trackdyn.simulation.brake import check_load
from trackdyn.simulation.energy_balance import check_energy_balance, passed_pitches
from trackdyn.simulation.recording import Recording, provenance
from trackdyn.simulation.signals import mean_square
from trackdyn.simulation.step_check import DOUBTFUL_STEP_DIVISOR, Alternation, Resolution, RunStatistics

COPIES = 2  # peak memory over that of the record: measures and the file need a copy
BELT_FLOATS = 160  # per sample while a belt is recorded


def file_bytes(scene) -> float:
    """Return the approximate size of the recording of a scene in its file, bytes."""
    state = make_state(scene.bodies, 1, 1 + len(scene.rig.wheels))
    if scene.fidelity["space"].setting == "spatial":
        state = state._replace(plane=Plane(np.zeros(4), np.zeros(4)))
    row = make_record(1, state, len(scene.sensors), scene.recorded_pitches).samples
    frames = scene.duration / scene.frame_interval * (scene.bodies + 4) * 8 if scene.frame_interval else 0.0
    return scene.duration * scene.rig.rate * (sum(array.nbytes for array in row) + 8) + frames


def check_memory(scene, seconds: float | None = None) -> None:
    """Refuse (`OutOfMemoryError`) a scene whose recording, or ``seconds`` of it, does not fit into the free memory."""
    seconds = scene.duration if seconds is None else seconds
    memory, free = COPIES * file_bytes(scene) * seconds / scene.duration, free_memory()
    if scene.chain == "belt":
        memory += 8 * BELT_FLOATS * seconds * scene.rig.rate
    if memory > free:
        raise OutOfMemoryError(
            f"scene: duration = {seconds:g} s: its recording needs about "
            f"{memory / 1e6:.0f} MB of memory and {free / 1e6:.0f} MB are free; use at most "
            f"{0.9 * seconds * free / memory:.3g} s, fewer pitches or a longer frame_interval"
        )


CHUNK = 0.25  # length of a chunk, s
INTERVALS_A_CHUNK = 40000  # largest number of contacts that end within it
GROWTH = 2  # factor by which the capacity of a record grows
BALANCE_PERIOD = 10.0  # s of a record between two checks of its energy balance


class Piece(NamedTuple):
    """Beginning of a piece of a record that is repeated to check its step."""

    loop: Any  # at the beginning; None once the piece is checked
    # loop from which the piece is repeated with a much smaller step, so that errors before its beginning count
    origin: Any
    first_of_run: bool
    done: int  # samples, ended contacts and alternating sums of the record at the beginning
    ended: int
    alternating: np.ndarray
    log: tuple[np.ndarray, np.ndarray]  # open contacts and their last forces (`model.arrays.ContactLog`)


class Recorder:
    """Record a loop with the recording options of ``scene`` (default: the loop's own).

    Without ``checked`` an unresolved record continues. ``origin`` is the loop before the lead-in, which the step check
    then repeats, too. A record that may end early begins with memory for ``capacity`` (s), and grows.
    """

    def __init__(self, loop, scene=None, checked: bool = True, origin=None, capacity: float | None = None):
        self.loop, self.scene = loop, scene or loop.scene
        scene, rate = self.scene, self.scene.rig.rate
        self.samples = round(scene.duration * rate)
        capacity = scene.duration if capacity is None else min(capacity + CHUNK, scene.duration)
        check_memory(scene, capacity)
        self.done, self.begin, self.wall, self.checked = 0, loop.time, 0.0, checked
        self.ended, self.alternating = list[np.ndarray](), np.zeros(2)
        loop.arrays.work.alternating[:] = 0.0
        stride = round(scene.frame_interval * rate)
        frames = -(-self.samples // stride) if stride else 0
        self.sensors = build_sensors(loop.model.shoes, scene.sensors.values())
        sizes = len(scene.sensors), scene.recorded_pitches, frames, stride, scene.contact_log * INTERVALS_A_CHUNK
        self.record = make_record(round(capacity * rate), loop.state, *sizes)
        self.step_check = step_check.StepCheck(scene, loop.model.step)
        if checked:
            self._begin_piece(origin)

    @property
    def finished(self) -> bool:
        """True if every sample is recorded."""
        return self.done >= self.samples

    def _grow(self, least: int) -> None:
        """Enlarge the record to ``least`` samples or by `GROWTH`, up to the duration of the scene."""
        count = min(max(GROWTH * len(self.record.samples.gap), least), self.samples)
        check_memory(self.scene, count / self.scene.rig.rate)

        def grown(array: np.ndarray) -> np.ndarray:
            larger = np.zeros((count if len(array) else 0, *array.shape[1:]), array.dtype)  # empty in planar scenes
            larger[: len(array)] = array
            return larger

        self.record = self.record._replace(samples=self.record.samples._make(map(grown, self.record.samples)))

    def chunk(self) -> float:
        """Record the next chunk and return its length, s; `DivergenceError` if contacts chatter or a check fails."""
        loop, rate = self.loop, self.scene.rig.rate
        last = min(self.done + max(round(CHUNK * rate), 1), self.samples)
        if last > len(self.record.samples.gap):
            self._grow(last)
        start = time.perf_counter()
        loop.fill(self.record, self.done, last, sensors=self.sensors)
        self.wall += time.perf_counter() - start
        contact_log = self.record.contact_log
        count, most = int(contact_log.count[0]), len(contact_log.rows)
        if count > most:
            raise DivergenceError(
                f"{count} contacts ended within {CHUNK} s, more than {most}: contacts chatter from step to step; use a "
                "smaller step"
            )
        self.ended.append(contact_log.rows[:count].copy())
        contact_log.count[0] = 0
        self.alternating += loop.work.alternating
        loop.arrays.work.alternating[:] = 0.0
        first, self.done = self.done, last
        if last // (BALANCE_PERIOD * rate) > first // (BALANCE_PERIOD * rate):  # not only after hours
            self._check_energy_balance()
        if self.checked:
            self._check_step()
        return (last - first) / rate

    def _begin_piece(self, origin=None) -> None:
        loop, log = self.loop.copy(), self.record.contact_log
        near = origin is not None and self.begin - origin.time <= step_check.LONGEST_LEAD
        self._piece = Piece(
            loop, origin if near else loop, origin is not None,
            self.done, len(self.ended), self.alternating.copy(), (log.open.copy(), log.last.copy()),
        )  # fmt: skip

    def _check_step(self) -> None:
        """Check a piece when it is over; raises as `check_load`, then as `StepCheck.judge`."""
        piece = self._piece
        seconds = (self.done - piece.done) / self.scene.rig.rate
        if piece.loop is not None and (seconds >= step_check.PIECE or self.finished):
            # over a stopped wheel the chain slides, and no step resolves that
            check_load(self.scene, self.record.samples.wheel_rate[: self.done])
            alternating = self.alternation(piece.done, piece.alternating)
            coarse = self.statistics(piece.done, piece.ended)
            self.step_check.judge(seconds, alternating, coarse, self._rerun, piece.first_of_run)
            self._piece = piece._replace(loop=None, origin=None)
        if seconds >= step_check.PIECE_PERIOD and not self.finished:
            self._begin_piece()

    def _rerun(self, divisor: int) -> RunStatistics:
        """Repeat the piece with its step divided by ``divisor``; return its statistics. See `StepCheck.judge`."""
        piece, scene = self._piece, self.scene
        loop = piece.origin if divisor == DOUBTFUL_STEP_DIVISOR else piece.loop
        if self.loop.model.drive != loop.model.drive:
            raise InputError("the drive of the loop changed: the motion cannot be repeated")
        fields = step_check.explicit_fields(scene) if divisor == 1 else {"step": loop.model.step / divisor}
        settled_anew = piece.first_of_run and loop.time == 0.0 and divisor == DOUBTFUL_STEP_DIVISOR
        finer = type(loop)(loop.scene.with_(**fields)) if settled_anew else loop.changed(**fields)
        finer.advance(piece.loop.time - loop.time)
        fields |= {"duration": (self.done - piece.done) / scene.rig.rate, "pitches": (), "frame_interval": 0.0}
        rerun = Recorder(finer, scene.with_(**fields), checked=False)
        rerun.record.contact_log.open[:], rerun.record.contact_log.last[:] = piece.log
        return rerun.finish().statistics()

    def alternation(self, first: int = 0, before=0.0) -> Alternation:
        """Return the chatter from sample ``first`` on; ``before`` are the sums (`model.arrays.Work`) until then."""
        model, (squares, count) = self.loop.model, self.alternating - before
        share = np.nan
        if count and first < self.done:
            signal = mean_square(self.record.samples.mean[first : self.done, 0], model.chain.gravity)
            # without gravity and motion the signal is rounding
            share = float(squares / count / model.step**2 / max(signal, 1e-6))
        return Alternation(share, int(count), passed_pitches(model, self.driven(first)))

    def resolution(self) -> Resolution:
        """Return whether the step resolves the record so far."""
        return self.step_check.resolution(self.alternation())

    def driven(self, first: int = 0) -> float:
        """Return the time (s) in which the sprocket, at nominal speed, turns by its rotation since ``first``."""
        rate, drive_rate = self.scene.rig.rate, abs(self.loop.model.drive.rate)
        rates = np.abs(self.record.samples.wheel_rate[first : self.done, SPROCKET])
        return round(float(rates.sum() / drive_rate if drive_rate else len(rates)) / rate, 9)

    def _check_energy_balance(self) -> None:
        check_energy_balance(self.record.samples.energy[: self.done], self.loop.model, self.driven())

    def finish(self) -> "Recorder":
        """Record to the end."""
        while not self.finished:
            self.chunk()
        return self

    def statistics(self, first: int = 0, ended: int = 0) -> RunStatistics:
        """Return the statistics of samples from ``first`` on and of contacts from the chunk ``ended`` on."""
        rows, model = slice(first, self.done), self.loop.model
        return step_check.run_statistics(self.record, rows, self.ended[ended:], model, self.begin)

    def recording(self) -> Recording:
        """Return the recording so far; raises as `check_energy_balance`, `check_load` and `Recording.checked`."""
        self._check_energy_balance()
        check_load(self.scene, self.record.samples.wheel_rate[: self.done])
        record, scene = self.record, self.scene.with_(step=self.loop.model.step)
        rate, stride = scene.rig.rate, record.frame_stride
        if self.done < self.samples:
            frames = -(-self.done // stride) if 0 < stride <= self.done else 0
            rows = record.samples._make(array[: self.done] for array in record.samples)
            record = record._replace(samples=rows, frame=record.frame[:frames])
            scene = scene.with_(duration=self.done / rate, frame_interval=scene.frame_interval if frames else 0.0)
        meta = provenance(scene, self.loop.layout) | {"resolved": self.resolution()._asdict()}
        others = {"contact_log": np.concatenate([np.zeros(0, CONTACT_INTERVAL), *self.ended]), "wall": self.wall}
        recording = Recording.of_record(record, rate, begin=self.begin, meta=meta, **others)
        vars(recording)["scene"] = scene  # not built anew from its description
        return recording

"""A recording that grows chunk by chunk, so that it can be watched and may end sooner; what it needs."""

import time
from typing import Any, NamedTuple

import numpy as np

from trackdyn.inputs.errors import DivergenceError, InputError, OutOfMemoryError
from trackdyn.inputs.memory import free_memory
from trackdyn.model.arrays import CONTACT_INTERVAL, Plane, make_record, make_state
from trackdyn.model.constants import SPROCKET
from trackdyn.scene.build import build_sensors
from trackdyn.simulation.brake import check_load
from trackdyn.simulation.energy_balance import check_account, passed_pitches
from trackdyn.simulation.loop_arrays import flat
from trackdyn.simulation.recording import Recording, provenance
from trackdyn.simulation.step_check import (
    BETWEEN,
    FINER,
    LEAD,
    PIECE,
    Alternation,
    Resolution,
    RunStatistics,
    StepCheck,
    explicit,
    mean_square,
    run_statistics,
)

# measures and the file take as much again as the record
COPIES = 2
# floats that a belt keeps of a sample while it is laid
BELT_FLOATS = 160


def file_bytes(scene) -> float:
    """Bytes that the recording of a scene takes in its file, roughly."""
    state = make_state(scene.bodies, 1, 1 + len(scene.rig.wheels))
    if scene.fidelity["space"].setting == "spatial":
        state = state._replace(plane=Plane(np.zeros(4), np.zeros(4)))
    rooms = (make_record(count, state, len(scene.sensors), scene.recorded_pitches) for count in (1, 2))
    first, both = (sum(array.nbytes for array in flat(room).values()) for room in rooms)
    frames = scene.duration / scene.frame_interval * (scene.bodies + 4) * 8 if scene.frame_interval else 0.0
    return scene.duration * scene.rig.rate * (both - first + 8) + frames


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


# Length of a chunk, s, and contacts that may end within it.
CHUNK = 0.25
INTERVALS_A_CHUNK = 40000
GROWTH = 2  # times the room for a record
JUDGED = 10.0  # s of a record between two judgements of its energy balance


class Piece(NamedTuple):
    """Where a piece of a record begins that may be run again to judge its step."""

    loop: Any  # as it was then; None once the piece is judged
    origin: Any  # the loop from which it is run again with a much smaller step: what a step spoils before counts, too
    first_of_run: bool
    done: int  # samples, ended contacts and alternating sums of the record until then
    ended: int
    alternating: np.ndarray
    log: tuple[np.ndarray, np.ndarray]  # contacts that last, and their last forces (`model.arrays.ContactLog`)


class Recorder:
    """Records a loop as a ``scene``, its own by default, has it.

    Not ``checked`` it goes on unresolved. ``origin`` is the loop before it came to where the record begins, so that the
    way there is run again, too. A record that may end sooner takes ``room`` (s) of memory at first, and grows.
    """

    def __init__(self, loop, scene=None, checked: bool = True, origin=None, room: float | None = None):
        self.loop, self.scene = loop, scene or loop.scene
        scene, rate = self.scene, self.scene.rig.rate
        self.samples = round(scene.duration * rate)
        room = scene.duration if room is None else min(room + CHUNK, scene.duration)
        check_memory(scene, room)
        self.done = 0
        self.begin = loop.time
        self.wall = 0.0
        self.ended: list[np.ndarray] = []
        self.checked = checked
        self.alternating = np.zeros(2)
        loop.arrays.work.alternating[:] = 0.0
        stride = round(scene.frame_interval * rate)
        frames = -(-self.samples // stride) if stride else 0
        self.sensors = build_sensors(loop.model.shoes, scene.sensors.values())
        self.record = make_record(
            round(room * rate),
            loop.state,
            len(scene.sensors),
            scene.recorded_pitches,
            frames,
            stride,
            INTERVALS_A_CHUNK if scene.contact_log else 0,
        )
        self.step_check = StepCheck(scene, loop.model.step)
        if checked:
            self._begin_piece(origin)

    @property
    def finished(self) -> bool:
        """Whether every sample is recorded."""
        return self.done >= self.samples

    def _grow(self, least: int) -> None:
        """Make room for so many samples: twice as many as there are, but not more than are asked for."""
        count = min(max(GROWTH * len(self.record.samples.gap), least), self.samples)
        check_memory(self.scene, count / self.scene.rig.rate)

        def grown(array: np.ndarray) -> np.ndarray:
            larger = np.zeros((count if len(array) else 0, *array.shape[1:]), array.dtype)  # empty: in space alone
            larger[: len(array)] = array
            return larger

        self.record = self.record._replace(samples=self.record.samples._make(map(grown, self.record.samples)))

    def chunk(self) -> float:
        """Record the next chunk; returns its length, s.

        Raises `DivergenceError`: contacts chatter, the energy balance is open, or the step check fails.
        """
        loop, rate = self.loop, self.scene.rig.rate
        last = min(self.done + max(round(CHUNK * rate), 1), self.samples)
        if last > len(self.record.samples.gap):
            self._grow(last)
        start = time.perf_counter()
        loop.fill(self.record, self.done, last, sensors=self.sensors)
        self.wall += time.perf_counter() - start
        contact_log = self.record.contact_log
        count, room = int(contact_log.count[0]), len(contact_log.rows)
        if count > room:
            raise DivergenceError(
                f"{count} contacts ended within one chunk of {CHUNK} s, more than {room}: the contact chatters from "
                "step to step; use a smaller step"
            )
        self.ended.append(contact_log.rows[:count].copy())
        contact_log.count[0] = 0
        self.alternating += loop.work.alternating
        loop.arrays.work.alternating[:] = 0.0
        first, self.done = self.done, last
        if last // (JUDGED * rate) > first // (JUDGED * rate):  # not only after hours
            self._check_account()
        if self.checked:
            self._check_step()
        return (last - first) / rate

    def _begin_piece(self, origin=None) -> None:
        loop, log = self.loop.copy(), self.record.contact_log
        near = origin is not None and self.begin - origin.time <= LEAD
        self._piece = Piece(
            loop, origin if near else loop, origin is not None,
            self.done, len(self.ended), self.alternating.copy(), (log.open.copy(), log.last.copy()),
        )  # fmt: skip

    def _check_step(self) -> None:
        """Judge a piece when it is over; raises `DivergenceError` as `StepCheck.judge`."""
        piece = self._piece
        seconds = (self.done - piece.done) / self.scene.rig.rate
        if piece.loop is not None and (seconds >= PIECE or self.finished):
            alternating = self.alternation(piece.done, piece.alternating)
            coarse = self.statistics(piece.done, piece.ended)
            self.step_check.judge(seconds, alternating, coarse, self._rerun, piece.first_of_run)
            self._piece = piece._replace(loop=None, origin=None)
        if seconds >= BETWEEN and not self.finished:
            self._begin_piece()

    def _rerun(self, times: int) -> RunStatistics:
        """Statistics of the piece with a step so many times smaller; the loop of a doubtful run is settled anew."""
        piece, scene = self._piece, self.scene
        loop = piece.origin if times == FINER else piece.loop
        if self.loop.model.drive != loop.model.drive:
            raise InputError("the loop was steered: another run would be another motion")
        fields = explicit(scene) if times == 1 else {"step": loop.model.step / times}
        settled = piece.first_of_run and loop.time == 0.0 and times == FINER
        finer = type(loop)(loop.scene.with_(**fields)) if settled else loop.changed(**fields)
        finer.advance(piece.loop.time - loop.time)
        fields |= {"duration": (self.done - piece.done) / scene.rig.rate, "pitches": (), "frame_interval": 0.0}
        rerun = Recorder(finer, scene.with_(**fields), checked=False)
        rerun.record.contact_log.open[:], rerun.record.contact_log.last[:] = piece.log
        return rerun.finish().statistics()

    def alternation(self, first: int = 0, before=0.0) -> Alternation:
        """Alternation from a sample on, until which its sums (`model.arrays.Work`) were those ``before``."""
        model, (squares, looks) = self.loop.model, self.alternating - before
        share = np.nan
        if looks and first < self.done:
            read = mean_square(self.record.samples.mean[first : self.done, 0], model.chain.gravity)
            # without gravity and motion there is rounding alone
            share = float(squares / looks / model.step**2 / max(read, 1e-6))
        return Alternation(share, int(looks), passed_pitches(model, self.driven(first)))

    def resolution(self) -> Resolution:
        """Whether the step resolves the record so far."""
        return self.step_check.resolution(self.alternation())

    def driven(self, first: int = 0) -> float:
        """Seconds in which the speed that is asked for turns the sprocket as far as it turned since a sample."""
        rate, drive_rate = self.scene.rig.rate, abs(self.loop.model.drive.rate)
        rates = np.abs(self.record.samples.wheel_rate[first : self.done, SPROCKET])
        return round(float(rates.sum() / drive_rate if drive_rate else len(rates)) / rate, 9)

    def _check_account(self) -> None:
        check_account(self.record.samples.energy[: self.done], self.loop.model, self.driven())

    def finish(self) -> "Recorder":
        """Record to the end."""
        while not self.finished:
            self.chunk()
        return self

    def statistics(self, first: int = 0, ended: int = 0) -> RunStatistics:
        """Statistics of samples from ``first`` on and of contacts from the chunk ``ended`` on."""
        return run_statistics(self.record, slice(first, self.done), self.ended[ended:], self.loop.model, self.begin)

    def recording(self) -> Recording:
        """The recording so far.

        Raises `DivergenceError`: a number is not finite, or the energy balance is open (`check_account`);
        `InputError` as `check_load`.
        """
        self._check_account()
        check_load(self.scene, self.record.samples.wheel_rate[: self.done])
        record, scene = self.record, self.scene.with_(step=self.loop.model.step)
        rate, stride = scene.rig.rate, record.frame_stride
        if self.done < self.samples:
            frames = -(-self.done // stride) if 0 < stride <= self.done else 0
            rows = record.samples._make(array[: self.done] for array in record.samples)
            record = record._replace(samples=rows, frame=record.frame[:frames])
            scene = scene.with_(duration=self.done / rate, frame_interval=scene.frame_interval if frames else 0.0)
        recording = Recording.of_record(
            record,
            rate,
            contact_log=np.concatenate(self.ended or [np.zeros(0, CONTACT_INTERVAL)]),
            begin=float(self.begin),
            meta=provenance(scene, self.loop.layout) | {"resolved": self.resolution()._asdict()},
            wall=self.wall,
        )
        vars(recording)["scene"] = scene  # not built from its description again
        return recording

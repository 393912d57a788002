"""A recording that grows chunk by chunk, so that it can be watched, checkpointed and resumed."""

import time
from typing import NamedTuple

import numpy as np

from trackdyn.errors import DivergenceError
from trackdyn.model.record import SPELL_COLUMNS, Record, Spells, make_record
from trackdyn.simulation.account import refuse_open_account
from trackdyn.simulation.checkpoint import filled, refuse_other_places
from trackdyn.simulation.cost import refuse_too_large
from trackdyn.simulation.recording import Recording, provenance
from trackdyn.simulation.resolution import refuse_unresolved, resolution
from trackdyn.simulation.stepping import march

# Length of a chunk, s, and spells that may end within it.
CHUNK = 0.25
SPELLS_A_CHUNK = 40000
JUDGED = 10.0  # s of a record between two judgements of its account of work
# arrays with a row a sample
SAMPLED = (
    "raw",
    "mean",
    "gap",
    "cut",
    "change",
    "place",
    "wheel_rate",
    "energy",
    "force",
    "area",
    "groove",
    "link_raw",
    "link_mean",
    "sliding",
)


class Writer:
    """Records a loop; parameters as in `Loop.record`. One that is not ``watched`` goes on with unresolved contacts."""

    def __init__(
        self, loop, seconds: float, pitches: tuple[int, ...], frame_interval: float, spells: bool, every_link: bool,
        watched: bool = True,
    ):  # fmt: skip
        rate = loop.scene.rig.sensor.rate
        refuse_too_large(loop.scene, seconds, pitches, frame_interval, every_link)
        self.loop = loop
        self.samples = round(seconds * rate)
        self.done = 0
        self.begin = loop.time
        self.wall = 0.0
        self.ended: list[np.ndarray] = []
        self.watched = watched
        self.alternating = np.zeros(2)
        loop.work.alternating[:] = 0.0
        stride = round(frame_interval * rate)
        frames = -(-self.samples // stride) if stride else 0
        on_wheels = loop.scene.loop == "on_wheels"
        count = loop.scene.rig.chain.pitches
        self.record: Record = make_record(
            self.samples,
            loop.state,
            pitches or (range(1, count + 1) if every_link else (loop.scene.rig.sensor.pitch,)),
            frames,
            stride,
            SPELLS_A_CHUNK if spells and on_wheels else 0,
            count if every_link else 0,
            0 if loop.work.sliding is None else len(loop.work.sliding),
        )

    @property
    def finished(self) -> bool:
        return self.done >= self.samples

    def chunk(self) -> float:
        """Record the next chunk; returns its length, s."""
        loop, rate = self.loop, self.loop.scene.rig.sensor.rate
        last = min(self.done + max(round(CHUNK * rate), 1), self.samples)
        start = time.perf_counter()
        march(loop.model, loop.state, loop.work, self.record, self.done, last)
        self.wall += time.perf_counter() - start
        self.ended.append(_take(self.record.spells))
        self.alternating += loop.work.alternating
        loop.work.alternating[:] = 0.0
        first, self.done = self.done, last
        if last // (JUDGED * rate) > first // (JUDGED * rate):  # not only after hours
            refuse_open_account(self.record.energy[:last], loop.model, last / rate)
        if self.watched:
            refuse_unresolved(self.alternating, loop.model, self.record.mean[:last], last / rate)
        return (last - first) / rate

    def describe(self) -> dict:
        """What a checkpoint holds of it, the loop included."""
        progress = {"done": self.done, "begin": self.begin, "wall": self.wall, "alternating": self.alternating.tolist()}
        parts = {"progress": progress, "record": self.record, "ended": Ended(np.vstack(self.ended))}
        return self.loop.describe() | parts

    def restore(self, data: dict) -> None:
        """Go on from a checkpoint's data, the loop being its loop."""
        refuse_other_places(self.record._replace(area=None, groove=None, spells=None), data["record"])
        self.record = filled(self.record, data["record"])
        self.ended = [data["ended"]["rows"]]
        self.done, self.begin, self.wall = (data["progress"][name] for name in ("done", "begin", "wall"))
        self.alternating = np.array(data["progress"]["alternating"], float).reshape(2)
        if not (isinstance(self.done, int) and 0 <= self.done <= self.samples):
            raise ValueError(f"done = {self.done}")

    def recording(self) -> Recording:
        """What was recorded so far, if it is finite and its account of work closed
        (`measure.energy.refuse_open_account`).
        """
        loop, record, scene = self.loop, self.record, self.loop.scene
        rate, stride = scene.rig.sensor.rate, record.frame_stride
        if self.done < self.samples:
            record, scene = _rows(record, self.done), scene.with_(duration=self.done / rate)
        refuse_open_account(record.energy, loop.model, self.done / rate)
        plane = record.plane
        space = (
            {} if plane is None else {"plane": plane.motion, "wheel_offset": plane.offset, "axial_force": plane.axial}
        )
        same = (*SAMPLED, "frame")
        found = resolution(self.alternating, loop.model, record.mean, self.done / rate)
        share = None if np.isnan(found.share) else found.share
        return Recording(
            time=np.arange(1, self.done + 1) / rate,
            pitches=record.pitches + 1,
            spells=np.vstack(self.ended) if self.ended else np.zeros((0, len(SPELL_COLUMNS))),
            begin=float(self.begin),
            frame_time=(np.arange(len(record.frame)) * stride + 1) / rate,
            meta=provenance(scene, loop.layout) | {"resolved": found._asdict() | {"share": share}},
            wall=self.wall,
            **{name: getattr(record, name) for name in same},
            **space,
        ).checked()


def _rows(record: Record, count: int) -> Record:
    """The first ``count`` samples of a record without frames."""
    plane = record.plane and record.plane._make(array[:count] for array in record.plane)
    return record._replace(**{name: getattr(record, name)[:count] for name in SAMPLED}, plane=plane)


class Ended(NamedTuple):
    """Spells that ended so far."""

    rows: np.ndarray


def _take(spells: Spells) -> np.ndarray:
    """Rows that ended in the last chunk; the log is empty afterwards."""
    count = int(spells.count[0])
    if count > len(spells.rows):
        raise DivergenceError(
            f"{count} contacts ended within one chunk of {CHUNK} s, more than {len(spells.rows)}: the "
            "contact chatters from "
            "step to step; a smaller step would do"
        )
    spells.count[0] = 0
    return spells.rows[:count].copy()

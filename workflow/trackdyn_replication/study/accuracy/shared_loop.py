"""Loops that share their motion: plans of one scene begin alike, and a finer one goes on where another ended."""

from hashlib import blake2b
from time import process_time
from typing import Any, ClassVar, NamedTuple

import numpy as np

from trackdyn.model.arrays import Record
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.loop_arrays import flatten


class Stretch(NamedTuple):
    """Result of a call of a kernel: arrays as it left them, rows that it filled, and the CPU seconds that it took."""

    arrays: list[np.ndarray]
    rows: list[np.ndarray]
    ended: np.ndarray
    cpu_s: float


class SharedLoop(Loop):
    """Loop that takes a stretch of motion from memory if one of this process had it, from the same bytes.

    Results are those of a `Loop`, and `clock` counts the seconds of a stretch each time.
    """

    _stretches: ClassVar[dict[bytes, Stretch]] = {}
    _spared = 0.0  # CPU seconds

    @staticmethod
    def clock() -> float:
        """Return the CPU seconds of this process, with those of the stretches that it took from memory."""
        return process_time() + SharedLoop._spared

    def fill(self, record: Record, first: int, last: int, **changes: Any) -> None:
        """Fill rows as `Loop.fill`; those of a record with frames are computed each time."""
        if len(record.frame):
            return super().fill(record, first, last, **changes)
        log = record.contact_log
        model = self.arrays.model._replace(**changes)
        arrays = flatten(self.arrays._replace(model=model)) | flatten(log._replace(rows=None), "log")
        rows = [array[first:last] for array in record.samples]
        read = blake2b(repr((len(log.rows), record.pitches.tolist(), [row.shape for row in rows])).encode())
        for name, array in arrays.items():
            read.update(f"{name} {array.shape}".encode() + array.tobytes())  # each name has its own type
        if stretch := self._stretches.get(read.digest()):
            for array, result in zip((*arrays.values(), *rows), (*stretch.arrays, *stretch.rows), strict=True):
                array[...] = result
            log.rows[: len(stretch.ended)] = stretch.ended
            SharedLoop._spared += stretch.cpu_s
            return
        begin = process_time()
        super().fill(record, first, last, **changes)
        seconds = process_time() - begin
        copies = [[array.copy() for array in group] for group in (arrays.values(), rows)]
        self._stretches[read.digest()] = Stretch(*copies, log.rows[: int(log.count[0])].copy(), seconds)

"""Rows over the cores of one machine: a process a core, each asked for one row at a time.

A pool of a library gives up when one of its processes is killed. Here only the row that it had in hand is lost, and
the row says so.
"""

import contextlib
import json
import os
import selectors
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Iterator, Sequence
from pathlib import Path

from trackdyn.errors import TrackdynError
from trackdyn.integrate.run import _run as time_loop
from trackdyn.sweeps.row import FAILED, Rows
from trackdyn.sweeps.worker import READY

# Pieces that a process takes one by one: long enough to share what settling gives, short enough to end together.
PIECES = 8


def compute(rows: Sequence[dict], jobs: int, memory: float) -> Iterator[dict]:
    """Results of rows as they come, in any order.

    Parameters
    ----------
    rows : sequence of dict
        Parameters of `Rows.compute`, neighbours alike.
    jobs : int
        Processes; with 1 the rows are computed in this one.
    memory : float
        Bytes that all rows in hand may take together.
    """
    if jobs == 1 or len(rows) < 2:
        here = Rows(memory)
        yield from (here.compute(**row) for row in rows)
        return
    rows = list(rows)
    if not _compiled():  # or every process would compile the same kernels
        yield from _Workers(rows[:1], 1, memory).results()
        rows = rows[1:]
    yield from _Workers(rows, min(jobs, len(rows)), memory).results()


def _compiled() -> bool:
    """Whether the time loop was compiled before, here and for this processor."""
    stats = getattr(getattr(time_loop, "dispatcher", None), "stats", None)
    return bool(stats and stats.cache_path) and any(Path(stats.cache_path).glob("run._run-*.nbc"))


class _Worker:
    """A process, the rows that it is to compute, and the one in hand."""

    def __init__(self, memory: float):
        self.waiting: deque[dict] = deque()
        self.row: dict | None = None
        self.ready = False
        root = str(Path(__file__).parents[2])
        path = os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH"))))
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "trackdyn.sweeps.worker", repr(memory)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            env=os.environ | {"PYTHONPATH": path},
            process_group=0,  # a Ctrl-C is for the one who started it
        )

    def ask(self) -> None:
        """Hand over the next row.

        There is one at a time, and none before it has come up: two lines that came at once would be read at once, and
        nobody be told of the second.
        """
        self.row = self.waiting.popleft() if self.waiting else None
        if self.row is not None:
            with contextlib.suppress(BrokenPipeError):  # its end is seen where its answer is awaited
                print(json.dumps(self.row), file=self.process.stdin, flush=True)

    def answer(self) -> dict | None:
        """The result of the row in hand; None: it has only come up."""
        line = self.process.stdout.readline()
        if not self.ready:
            self.ready = line.strip() == READY
            if not self.ready:
                raise TrackdynError(f"a process that is to compute rows ended at its start {self._how()}")
            return None
        try:
            return json.loads(line)
        except ValueError:  # it is dead, perhaps amid its answer
            return {
                "key": self.row["key"],
                "state": FAILED,
                "reason": f"the process that computed it ended {self._how()}",
                "values": {},
                "cost": {},
            }

    def _how(self) -> str:
        code = self.process.wait()
        if code >= 0:
            return f"with exit code {code}; what it printed, if anything, stands above"
        return f"({signal.Signals(-code).name}), perhaps for want of memory; fewer jobs or more memory would do"

    @property
    def alive(self) -> bool:
        return self.process.poll() is None

    def end(self) -> None:
        """Kill it; it writes nothing."""
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.close()


class _Workers:
    """Rows handed out piece by piece; who has none left takes half of what another still has."""

    def __init__(self, rows: list[dict], jobs: int, memory: float):
        size = max(len(rows) // (PIECES * jobs), 1)
        self.pieces = deque(rows[k : k + size] for k in range(0, len(rows), size))
        self.jobs, self.memory = jobs, memory / jobs
        self.workers: list[_Worker] = []

    def results(self) -> Iterator[dict]:
        with selectors.DefaultSelector() as selector:
            try:
                for _ in range(self.jobs):
                    self._start(selector, deque())
                while self.workers:
                    for key, _ in selector.select():
                        worker: _Worker = key.data
                        result = worker.answer()
                        if alive := worker.alive:
                            self._feed(worker)
                        if not alive or worker.row is None:
                            selector.unregister(worker.process.stdout)
                            self.workers.remove(worker)
                            worker.end()
                        if not alive:
                            self._start(selector, worker.waiting)
                        if result is not None:
                            yield result
            finally:
                for worker in self.workers:
                    worker.end()

    def _start(self, selector: selectors.BaseSelector, waiting: deque[dict]) -> None:
        worker = _Worker(self.memory)
        worker.waiting = waiting
        self.workers.append(worker)
        selector.register(worker.process.stdout, selectors.EVENT_READ, worker)

    def _feed(self, worker: _Worker) -> None:
        if not worker.waiting:
            if self.pieces:
                worker.waiting.extend(self.pieces.popleft())
            else:
                richest = max(self.workers, key=lambda other: len(other.waiting))
                for _ in range(len(richest.waiting) // 2):
                    worker.waiting.appendleft(richest.waiting.pop())
        worker.ask()

"""The engine of rows: what is asked for by key is computed over the cores of one machine, and kept as it comes.

Sweeps, identification and the fit hand their rows to it. A process a core is asked for one row at a time. A pool of a
library gives up when one of its processes is killed. Here only the row that it had in hand is lost, and the row says
so.
"""

import contextlib
import json
import os
import selectors
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path

from psutil import virtual_memory
from tqdm import tqdm

from trackdyn.errors import DivergenceError, InputError, TrackdynError
from trackdyn.parameters.validation import shown
from trackdyn.simulation.cost import compiled
from trackdyn.sweeps.store import DIVERGED, DONE, FAILED, REFUSED, Store, without_values

# Pieces that a process takes one by one: long enough to share what settling gives, short enough to end together.
PIECES = 8
READY = "ready"
# Makes the function that computes rows, of the bytes of memory that a row may take. It is looked up by its name in
# other processes; what goes in by name and comes out is plain data.
Maker = Callable[[float], Callable[..., dict]]


def results(
    maker: Maker,
    tasks: Mapping[str, dict],
    jobs: int = 1,
    store: Path | str | None = None,
    progress: str = "",
    unit: str = "row",
    alone: bool = False,
    valid: Callable[[dict], bool] = lambda values: True,
) -> dict[str, dict]:
    """Rows by their keys, those that the store does not have computed.

    Parameters
    ----------
    maker : function
        Makes what computes the values of a row.
    tasks : mapping of str to dict
        Arguments by key (`sweeps.store.key_of`), neighbours alike.
    jobs : int
        Processes; with 1 the rows are computed in this one.
    store : path or None
        Folder in which rows are kept as they come.
    progress, unit : str
        What the bar is called and counts; none if empty.
    alone : bool
        The store is for these rows alone: standard error says so where it has others and none of these, as after a
        change of the program, whose sources are part of every key.
    valid : function
        As of `sweeps.store.Store`.

    Returns
    -------
    dict of str to dict
        ``key``, ``state``, ``reason``, ``values`` by name, ``cost``.
    """
    kept = Store(store, valid) if store else None
    found = {key: _shared(row) for key, row in kept.read(tasks.keys()).items()} if kept else {}
    if alone and kept and kept.others and not found:
        print(
            f"trackdyn: {kept.folder}: none of its {kept.others} rows is of this design by this version of the "
            "program; they stay there, and all rows are computed",
            file=sys.stderr,
        )
    due = [(key, task) for key, task in tasks.items() if key not in found]
    with tqdm(total=len(due), disable=not progress, unit=unit, desc=progress, smoothing=0.05) as bar:
        for row in _computed(maker, due, jobs, free_memory()):
            if kept:
                kept.keep(row)
            found[row["key"]] = _shared(row)
            bar.update()
    return found


def _shared(row: dict) -> dict:
    """A row whose names are those of all rows: half of its memory."""
    return row | {"values": {sys.intern(name): value for name, value in row["values"].items()}}


def refuse_failed(rows: Iterable[dict], advice: str) -> None:
    """Stop where a row failed for a reason that may pass. Raises `TrackdynError`: the first reason, and ``advice``."""
    for row in rows:
        if row["state"] == FAILED:
            raise TrackdynError(f"a simulation failed for a reason that may pass ({row['reason']}); {advice}")


def outcome(compute: Callable[..., dict], key: str, task: dict) -> dict:
    """The row of one key: its values, or why there are none."""
    wall, cpu = time.perf_counter(), time.process_time()
    state, reason, values = DONE, "", {}
    try:
        values = compute(**task)
    except InputError as error:
        state, reason = REFUSED, str(error)
    except DivergenceError as error:
        state, reason = DIVERGED, str(error)
    except MemoryError as error:
        state, reason = FAILED, str(error) or "the memory that is free does not suffice"
    except Exception as error:  # a row never stops the others
        state, reason = FAILED, f"{type(error).__name__}: {shown(str(error))}"
    cost = {"wall_s": time.perf_counter() - wall, "cpu_s": time.process_time() - cpu}
    row = {"key": key, "state": state, "reason": reason, "values": values, "cost": cost}
    return json.loads(json.dumps(row, default=lambda number: number.item()))  # numpy's numbers become Python's


def free_memory() -> float:
    """Bytes that rows may take: what is free, or half of what SLURM gave the job, since the program is there, too."""
    given = os.environ.get("SLURM_MEM_PER_NODE", "")
    free = virtual_memory().available
    return min(free, float(given) * 2**20 / 2) if given.isdecimal() and int(given) else float(free)


def _computed(maker: Maker, due: list[tuple[str, dict]], jobs: int, memory: float) -> Iterator[dict]:
    """Rows as they come, in any order."""
    if jobs == 1 or len(due) < 2:
        compute = maker(memory)
        yield from (outcome(compute, key, task) for key, task in due)
        return
    if not compiled():  # or every process would compile the same kernels
        yield from _Workers(maker, due[:1], 1, memory).results()
        due = due[1:]
    yield from _Workers(maker, due, min(jobs, len(due)), memory).results()


class _Worker:
    """A process, the rows that it is to compute, and the one in hand."""

    def __init__(self, maker: Maker, memory: float):
        self.waiting: deque[tuple[str, dict]] = deque()
        self.row: tuple[str, dict] | None = None
        self.ready = False
        root = str(Path(__file__).parents[2])
        path = os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH"))))
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "trackdyn.sweeps.worker", maker.__module__, maker.__qualname__, repr(memory)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            env=os.environ | {"PYTHONPATH": path},
            process_group=0,  # a Ctrl-C is for the one who started it
        )
        assert self.process.stdin is not None and self.process.stdout is not None  # both are pipes
        self.rows, self.answers = self.process.stdin, self.process.stdout

    def ask(self) -> None:
        """Hand over the next row.

        There is one at a time, and none before it has come up: two lines that came at once would be read at once, and
        nobody be told of the second.
        """
        self.row = self.waiting.popleft() if self.waiting else None
        if self.row is not None:
            with contextlib.suppress(BrokenPipeError):  # its end is seen where its answer is awaited
                print(json.dumps(self.row), file=self.rows, flush=True)

    def answer(self) -> dict | None:
        """The result of the row in hand; None: it has only come up."""
        line = self.answers.readline()
        if not self.ready:
            self.ready = line.strip() == READY
            if not self.ready:
                raise TrackdynError(f"a process that is to compute rows ended at its start {self._how()}")
            return None
        try:
            return json.loads(line)
        except ValueError:  # it is dead, perhaps amid its answer
            assert self.row is not None, "who has no row in hand is not listened to"
            return without_values(self.row[0], FAILED, f"the process that computed it ended {self._how()}")

    def _how(self) -> str:
        code = self.process.wait()
        if code >= 0:
            return f"with exit code {code}; what it printed, if anything, stands above"
        return f"({signal.Signals(-code).name}), perhaps out of memory; use fewer jobs or more memory"

    @property
    def alive(self) -> bool:
        return self.process.poll() is None

    def end(self) -> None:
        """Kill it; it writes nothing."""
        self.process.kill()
        self.process.wait()
        self.answers.close()
        with contextlib.suppress(BrokenPipeError):
            self.rows.close()


class _Workers:
    """Rows handed out piece by piece; who has none left takes half of what another still has."""

    def __init__(self, maker: Maker, rows: list[tuple[str, dict]], jobs: int, memory: float):
        size = max(len(rows) // (PIECES * jobs), 1)
        self.pieces = deque(rows[k : k + size] for k in range(0, len(rows), size))
        self.maker, self.jobs, self.memory = maker, jobs, memory / jobs
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
                            selector.unregister(worker.answers)
                            self.workers.remove(worker)
                            worker.end()
                        if not alive:
                            self._start(selector, worker.waiting)
                        if result is not None:
                            yield result
            finally:
                for worker in self.workers:
                    worker.end()

    def _start(self, selector: selectors.BaseSelector, waiting: deque[tuple[str, dict]]) -> None:
        worker = _Worker(self.maker, self.memory)
        worker.waiting = waiting
        self.workers.append(worker)
        selector.register(worker.answers, selectors.EVENT_READ, worker)

    def _feed(self, worker: _Worker) -> None:
        if not worker.waiting:
            if self.pieces:
                worker.waiting.extend(self.pieces.popleft())
            else:
                richest = max(self.workers, key=lambda other: len(other.waiting))
                for _ in range(len(richest.waiting) // 2):
                    worker.waiting.appendleft(richest.waiting.pop())
        worker.ask()

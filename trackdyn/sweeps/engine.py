"""The engine of rows: what is asked for by key is computed over the cores of one machine, and kept as it comes.

Sweeps, identification and the fit hand their rows to it. Its pool is joblib's (loky).

The store has a file a row, so that sweeps beside each other need no lock: the SHA-256 of the row in its first line and
the row as JSON in its second. What has no such checksum, or another one, is not read as a row.
"""

import hashlib
import json
import os
import re
import signal
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import nullcontext
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Thread
from typing import Any

from joblib.externals.loky import ProcessPoolExecutor, as_completed
from joblib.externals.loky.process_executor import TerminatedWorkerError
from psutil import virtual_memory
from tqdm import tqdm

from trackdyn.errors import DivergenceError, InputError, TrackdynError
from trackdyn.files import broken_off, read_bytes, remove_abandoned, replacing
from trackdyn.rig.validation import shown
from trackdyn.simulation.recorder import compiled

# States of a row: its numbers came; its input is refused; its run left the physical range; nothing came, for a reason
# that may pass.
DONE, REFUSED, DIVERGED, FAILED = "done", "refused", "diverged", "failed"
LARGEST = 100_000_000  # bytes; a row of a sweep takes 4,000


def key_of(*content: Any) -> str:
    """Key of a row: a hash of all that it depends on, plain data."""
    return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()[:24]


def without_values(key: str, state: str, reason: str) -> dict:
    """A row that was not computed: its ``state``, and the ``reason``."""
    return {"key": key, "state": state, "reason": reason, "values": {}}


def plain(row: dict) -> dict:
    """A row as it comes back from its file: numpy's numbers become Python's."""
    return json.loads(json.dumps(row, default=lambda number: number.item()))


class Store:
    """Results by key in a folder, which is made if it is not there; `InputError`: it cannot be made or written."""

    def __init__(self, folder: Path | str):
        self.folder = Path(folder)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            reason = error.strerror or error
            raise InputError(f"{folder}: cannot be written ({reason}); choose another folder") from None

    def read(self, keys: Iterable[str], say: bool = True) -> dict[str, dict]:
        """Results of these keys; damaged files are left out, and counted on standard error if ``say``."""
        rows, damaged = {}, 0
        for key in keys:
            path = self.folder / f"{key}.json"
            if not path.exists():
                continue
            row = _row(path)
            if row is None or row.get("key") != key:
                damaged += 1
            else:
                rows[key] = row
        if damaged and say:
            what = "1 damaged row was" if damaged == 1 else f"{damaged} damaged rows were"
            print(f"trackdyn: {self.folder}: {what} ignored; they are computed again", file=sys.stderr)
        return rows

    def keep(self, row: dict) -> None:
        """Write a result (or `InputError`: a full disk); what failed for a passing reason is not kept."""
        if row["state"] == FAILED:
            return
        content = json.dumps(row).encode()
        with replacing(self.folder / f"{row['key']}.json") as temporary:
            temporary.write_bytes(_checksum(content) + b"\n" + content + b"\n")


def _checksum(content: bytes) -> bytes:
    return hashlib.sha256(content).hexdigest().encode()


def _row(path: Path) -> dict[str, Any] | None:
    """The row of a file; None: it is damaged."""
    try:
        checksum, _, content = read_bytes(path, "row", LARGEST).partition(b"\n")
    except InputError:
        return None
    if not content.endswith(b"\n") or checksum != _checksum(content[:-1]):
        return None
    row = json.loads(content)  # by this program, or forged
    sound = isinstance(row, dict) and isinstance(row.get("values"), dict)
    return row if sound and all(isinstance(row.get(name), str) for name in ("key", "state", "reason")) else None


# Rows that a process takes at once: some, to share what settling gives, and few, so that all processes end together.
PIECES, LONGEST_PIECE = 8, 8
# Makes the function that computes rows, of the bytes of memory that a row may take. It is looked up by its name in
# other processes; what goes in by name and comes out is plain data.
Maker = Callable[[float], Callable[..., dict]]
Tasks = dict[str, dict]


def results(
    maker: Maker,
    tasks: Mapping[str, dict],
    jobs: int = 1,
    store: Path | str | None = None,
    progress: str = "",
    unit: str = "row",
) -> dict[str, dict]:
    """Rows by their keys (`key_of`), those that the store does not have computed: ``key, state, reason, values``.

    ``maker`` makes what computes the values of a row from the arguments in ``tasks``, neighbours alike, on ``jobs``
    processes (1: in this one). ``store`` is a folder in which rows are stored as they come; a bar called ``progress``
    counts rows in ``unit``, none if empty.
    """
    with TemporaryDirectory() if store is None else nullcontext(store) as folder:
        rows_store = Store(folder)
        rows = rows_store.read(tasks)
        due = {key: task for key, task in tasks.items() if key not in rows}
        with tqdm(total=len(due), disable=not progress, unit=unit, desc=progress, smoothing=0.05) as bar:
            for row in _computed(maker, due, jobs, free_memory(), rows_store):
                rows[row["key"]] = row
                bar.update()
    return rows


def check_completed(rows: Iterable[dict], advice: str) -> None:
    """Stop where a row failed for a reason that may pass. Raises `TrackdynError`: the first reason, and ``advice``."""
    for row in rows:
        if row["state"] == FAILED:
            raise TrackdynError(f"a simulation failed for a reason that may pass ({row['reason']}); {advice}")


def outcome(compute: Callable[..., dict], key: str, task: dict) -> dict:
    """The row of ``key``: the values that ``compute`` makes of ``task``, or why there are none."""
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
    return plain({"key": key, "state": state, "reason": reason, "values": values})


def free_memory() -> float:
    """Bytes that rows may take: what is free, or half of what SLURM gave the job, since the program is there, too."""
    limit = os.environ.get("SLURM_MEM_PER_NODE", "")
    free = virtual_memory().available
    return min(free, float(limit) * 2**20 / 2) if limit.isdecimal() and int(limit) else float(free)


def _computed(maker: Maker, due: Tasks, jobs: int, memory: float, store: Store) -> Iterator[dict]:
    """Rows as they come, in any order."""
    if jobs == 1 or len(due) < 2:
        compute = maker(memory)
        for key, task in due.items():
            store.keep(row := outcome(compute, key, task))
            yield row
        return
    waiting, share = dict(due), memory / jobs
    if not compiled():  # or every process would compile the same kernels
        first = next(iter(waiting))
        yield from _by_processes(maker, {first: waiting.pop(first)}, 1, 1, share, store)
    size = min(max(len(waiting) // (PIECES * jobs), 1), LONGEST_PIECE)
    yield from _by_processes(maker, waiting, jobs, size, share, store)


def _by_processes(maker: Maker, waiting: Tasks, jobs: int, size: int, memory: float, store: Store) -> Iterator[dict]:
    """Rows by processes that take the next ``size`` of them at once; every row that comes leaves ``waiting``.

    All processes end with the first one that is killed. Rows that they had in hand are then run one at a time, which
    tells the row that ends its process: it fails. Raises `TrackdynError`: all of those failed.
    """
    while waiting:
        try:
            for row in _pooled(maker, waiting, min(jobs, len(waiting)), size, memory, store.folder):
                del waiting[row["key"]]
                yield row
        except TerminatedWorkerError as error:
            ended = f"its process was ended ({_signal(error)}), perhaps out of memory; use fewer jobs or more memory"
            remove_abandoned(store.folder)
            for key, row in store.read(list(waiting), say=False).items():  # stored before the processes ended
                del waiting[key]
                yield row
            in_hand = {key: waiting.pop(key) for key in list(waiting)[: jobs * size]}
            if jobs * size == 1:
                yield from (without_values(key, FAILED, ended) for key in in_hand)
                continue
            rows = list(_by_processes(maker, in_hand, 1, 1, memory, store))
            if len(rows) > 1 and all(row["state"] == FAILED for row in rows):
                raise TrackdynError(f"all {len(rows)} rows failed: {ended}") from None
            yield from rows


def _signal(error: Exception) -> str:
    return ", ".join(re.findall(r"(?:SIG|EXIT)\w*\(-?\d+\)", str(error))) or "without a word"


def _pooled(maker: Maker, tasks: Tasks, jobs: int, size: int, memory: float, folder: Path) -> Iterator[dict]:
    """Rows by a pool of processes. Raises `TerminatedWorkerError`: one of them was killed."""
    keys = list(tasks)
    pieces = [{key: tasks[key] for key in keys[k : k + size]} for k in range(0, len(keys), size)]
    # trackers remove what a killed sweep leaves, each with a warning
    os.environ.setdefault("PYTHONWARNINGS", "ignore:resource_tracker:UserWarning")
    # A Ctrl-C is for the one who started them: processes and threads begin with the signals that their maker blocks.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        pool = ProcessPoolExecutor(jobs, timeout=None, initializer=_begin, initargs=(os.getpid(),))
        rows = [pool.submit(_piece, maker, memory, piece, folder) for piece in pieces]
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    try:
        for piece in as_completed(rows):
            yield from piece.result()
    finally:
        pool.shutdown(wait=True, kill_workers=True)


def _begin(parent: int) -> None:
    """Make this process one of the pool, which ends with the one that started it."""
    os.dup2(2, 1)  # standard output is that of the one who started it

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.2)
        broken_off()
        os._exit(1)

    Thread(target=watch, daemon=True).start()


@lru_cache(maxsize=1)
def _computer(maker: Maker, memory: float) -> Callable[..., dict]:
    """The function that computes rows in this process: settled loops are shared from piece to piece."""
    return maker(memory)


def _piece(maker: Maker, memory: float, tasks: Tasks, folder: Path) -> list[dict]:
    """Some rows, each kept at once."""
    store, rows = Store(folder), []
    for key, task in tasks.items():
        store.keep(row := outcome(_computer(maker, memory), key, task))
        rows.append(row)
    return rows

"""The engine of rows: computes rows by key on the cores of one machine, and stores each as it comes.

Sweeps and studies hand their rows to it. Its pool is joblib's (loky).

The store has a file a row, so that sweeps beside each other need no lock: the SHA-256 of the row in its first line and
the row as JSON in its second. A file without such a checksum, or with another one, is not read. A row that is being
computed has a mark there, so that one that kills its process, for instance by the memory it takes, is known.
"""

import hashlib
import json
import os
import re
import signal
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from functools import partial
from multiprocessing import resource_tracker
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Thread
from typing import Any

from joblib.externals.loky import ProcessPoolExecutor, as_completed
from joblib.externals.loky.process_executor import TerminatedWorkerError
from tqdm import tqdm

from trackdyn.inputs.errors import DivergenceError, InputError, OutOfMemoryError, TrackdynError
from trackdyn.inputs.files import MACHINE, broken_off, is_gone, marked, read_bytes, remove_abandoned, replacing
from trackdyn.inputs.validation import shown
from trackdyn.jit import COMPILER
from trackdyn.sources import edited, module_files, module_hash

# States of a row: its numbers came; its input is refused; its run left the physical range; nothing came, for a reason
# that may pass.
DONE, REFUSED, DIVERGED, FAILED = "done", "refused", "diverged", "failed"
MAX_ROW_BYTES = 100_000_000  # bytes; a row of a sweep takes 4,000
# Rows that a process takes at once: some, to share what settling gives, and few, so that all processes end together.
PIECES, LONGEST_PIECE = 8, 8
DEATHS = 2  # of its process, after which a row has failed
MARK = re.compile(rf"\.(.+)\.{MACHINE}-(\d{{1,9}})\.trackdyn-row")
Compute = Callable[..., dict]  # computes the values of a row; other processes look it up by its name
Tasks = Mapping[str, dict]  # arguments of rows by their keys, plain data


def key_of(*content: Any) -> str:
    """Key of a row: a hash of all that it depends on, plain data, and of what compiles the kernels."""
    content = (*content, COMPILER) if COMPILER else content
    return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()[:24]


def without_values(key: str, state: str, reason: str) -> dict:
    """A row that was not computed: its ``state``, and the ``reason``."""
    return {"key": key, "state": state, "reason": reason, "values": {}}


class Store:
    """Rows by key in a folder, which is made if it is not there; `InputError`: it cannot be made or written."""

    def __init__(self, folder: Path | str):
        self.folder = Path(folder)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            reason = error.strerror or error
            raise InputError(f"{folder}: cannot be written ({reason}); choose another folder") from None

    def read(self, keys: Iterable[str]) -> dict[str, dict]:
        """Rows of these keys; damaged files are left out, and counted on standard error."""
        paths = {key: path for key in keys if (path := self.folder / f"{key}.json").exists()}
        rows = {key: row for key, path in paths.items() if (row := self._row(path, key))}
        if damaged := len(paths) - len(rows):
            words = "1 damaged row was" if damaged == 1 else f"{damaged} damaged rows were"
            print(f"trackdyn: {self.folder}: {words} ignored; they are computed again", file=sys.stderr)
        return rows

    def _row(self, path: Path, key: str) -> dict[str, Any] | None:
        """The row of a file; None: it is damaged, or another row's."""
        try:
            checksum, _, content = read_bytes(path, "row", MAX_ROW_BYTES).partition(b"\n")
            row = json.loads(content) if checksum == _checksum(content[:-1]) else None
        except (InputError, ValueError):
            return None
        return row if row and row["key"] == key else None

    @contextmanager
    def under_way(self, key: str) -> Iterator[None]:
        """Mark a row as being computed by this process; the mark stays if the process is killed."""
        with marked(self.folder / f".{key}.{MACHINE}-{os.getpid()}.trackdyn-row"):
            yield

    def abandoned(self) -> set[str]:
        """Remove the marks of rows that processes of this machine left when they were killed; return their keys."""
        keys = set()
        for mark in self.folder.glob(".*.trackdyn-row"):
            match = MARK.fullmatch(mark.name)
            if match and is_gone(int(match[2])):
                mark.unlink(missing_ok=True)
                keys.add(match[1])
        return keys

    def keep(self, row: dict) -> None:
        """Write a row, unless it failed for a reason that may pass. Raises `InputError`: the disk is full."""
        if row["state"] == FAILED:
            return
        content = json.dumps(row).encode()
        with replacing(self.folder / f"{row['key']}.json") as temporary:
            temporary.write_bytes(_checksum(content) + b"\n" + content + b"\n")


def _checksum(content: bytes) -> bytes:
    return hashlib.sha256(content).hexdigest().encode()


def results(
    compute: Compute,
    tasks: Tasks,
    jobs: int = 1,
    store: Path | str | None = None,
    progress: str = "",
    unit: str = "row",
) -> dict[str, dict]:
    """Rows by their keys (`key_of`), each with ``key, state, reason, values``; a stored row is not computed again.

    ``compute`` makes the values of a row from its arguments in ``tasks``, neighbours alike, on ``jobs`` processes (1,
    and no store: in this one). ``store`` is a folder in which rows are stored as they come. A bar called ``progress``
    counts rows in ``unit``, none if empty. Rows fail once the sources of ``compute`` are not those that this process
    began with: they would be stored under a key of others. Rows whose process is killed are computed again after all
    others, with no process beside theirs, and fail if it is killed once more. Raises `TrackdynError`: a process was
    killed that computed no row.
    """
    checked = partial(_values, compute, module_hash(compute.__module__))
    with TemporaryDirectory() if store is None else nullcontext(store) as folder:
        rows_store = Store(folder)
        rows = rows_store.read(tasks)
        due = {key: task for key, task in tasks.items() if key not in rows}
        with tqdm(total=len(due), disable=not progress, unit=unit, desc=progress, smoothing=0.05) as bar:
            computed = _computed if store is not None or jobs > 1 < len(due) else _computed_here
            for row in computed(checked, due, jobs, rows_store):
                rows[row["key"]] = row
                bar.update()
    return rows


def _values(compute: Compute, sources: str, /, **task) -> dict:
    """What ``compute`` makes of a row, in this process or another, as long as its ``sources`` mean what they meant."""
    module = compute.__module__

    def check() -> None:
        if module_hash(module) != sources or edited(module_files(module)):
            raise TrackdynError("the program was edited while it ran; start it again: rows that are stored stay")

    check()
    try:
        return compute(**task)
    finally:
        check()  # the first row imports some of them


def check_completed(rows: Iterable[dict], advice: str) -> None:
    """Stop where a row failed for a reason that may pass. Raises `TrackdynError`: the first reason, and ``advice``."""
    for row in rows:
        if row["state"] == FAILED:
            raise TrackdynError(f"a simulation failed for a reason that may pass ({row['reason']}); {advice}")


def _computed_here(compute: Compute, due: Tasks, _: int, store: Store) -> Iterator[dict]:
    """Rows as they come, computed by this process."""
    return (outcome(compute, store, key, task) for key, task in due.items())


def _computed(compute: Compute, due: Tasks, jobs: int, store: Store) -> Iterator[dict]:
    """Rows as they come, in any order, computed by other processes.

    Raises `TrackdynError`: a process was killed that computed no row. What is stored stays.
    """
    deaths = dict.fromkeys(store.abandoned() & due.keys(), 0)  # of rows that are computed alone, after all others
    waiting = {key: task for key, task in due.items() if key not in deaths}
    try:
        while waiting or deaths:
            tasks = waiting or {key: due[key] for key in deaths}
            left = dict(tasks)
            try:
                for row in _pooled(compute, tasks, min(jobs, len(tasks)) if waiting else 1, store):
                    del left[row["key"]]
                    yield row
            except TerminatedWorkerError as error:
                how = ", ".join(re.findall(r"(?:SIG|EXIT)\w*\(-?\d+\)", str(error))) or "without a word"
                remove_abandoned(store.folder)
                for row in store.read(left).values():  # they were not handed over when the process was killed
                    del left[row["key"]]
                    yield row
                killed = store.abandoned() & left.keys()
                if not killed:
                    raise TrackdynError(
                        f"a process was ended ({how}), perhaps out of memory; rows that are stored stay, and the same "
                        "command goes on from them: use fewer jobs or more memory"
                    ) from None
                for key in killed:
                    deaths[key] = deaths.get(key, 0) + 1
                    if deaths[key] == DEATHS:
                        del left[key]
                        reason = f"its process was ended {DEATHS} times ({how}), perhaps out of memory; use more memory"
                        yield without_values(key, FAILED, reason)
                jobs = max(jobs - 1, 1)  # perhaps their memory together was too much
            if waiting:
                waiting = {key: task for key, task in left.items() if key not in deaths}
            else:
                deaths = {key: count for key, count in deaths.items() if key in left}
    finally:
        store.abandoned()  # rows of processes that were ended with this sweep are not to blame


def _pooled(compute: Compute, tasks: Tasks, jobs: int, store: Store) -> Iterator[dict]:
    """Rows by a pool of processes.

    Raises `TerminatedWorkerError`: one of them was killed.
    """
    size = 1 if jobs == 1 else min(max(len(tasks) // (PIECES * jobs), 1), LONGEST_PIECE)
    # trackers remove what a killed sweep leaves, each with a warning
    os.environ.setdefault("PYTHONWARNINGS", "ignore:resource_tracker:UserWarning")
    # A Ctrl-C is for the one who started them: processes and threads begin with the signals that their maker blocks.
    # The tracker runs before, since its start unblocks them.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        pool = ProcessPoolExecutor(jobs, timeout=None, initializer=_begin, initargs=(os.getpid(),))
        items = list(tasks.items())
        pieces = (items[k : k + size] for k in range(0, len(items), size))
        rows = [pool.submit(_piece, compute, store, piece) for piece in pieces]
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    try:
        for piece in as_completed(rows):  # a long row holds back no others, which the bar counts
            yield from piece.result()
    finally:
        pool.shutdown(wait=True, kill_workers=True)


def _piece(compute: Compute, store: Store, items: list[tuple[str, dict]]) -> list[dict]:
    """Rows that a process takes at once."""
    return [outcome(compute, store, key, task) for key, task in items]


def _begin(parent: int) -> None:
    """Make this process one of the pool, which ends with the one that started it."""
    os.dup2(2, 1)  # standard output is that of the one who started it

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.2)
        broken_off()
        os._exit(1)

    Thread(target=watch, daemon=True).start()


def outcome(compute: Compute, store: Store, key: str, task: dict) -> dict:
    """Compute the row of ``key`` and store it: the values that ``compute`` makes of ``task``, or why there are none."""
    row = without_values(key, DONE, "")
    try:
        with store.under_way(key):
            row["values"] = compute(**task)
    except (OutOfMemoryError, MemoryError) as error:
        row |= {"state": FAILED, "reason": str(error) or "the memory that is free does not suffice"}
    except InputError as error:
        row |= {"state": REFUSED, "reason": str(error)}
    except DivergenceError as error:
        row |= {"state": DIVERGED, "reason": str(error)}
    except TrackdynError as error:
        row |= {"state": FAILED, "reason": str(error)}
    except Exception as error:  # a row never stops the others
        row |= {"state": FAILED, "reason": f"{type(error).__name__}: {shown(str(error))}"}
    row = json.loads(json.dumps(row, default=lambda number: number.item()))  # as it comes back from its file
    store.keep(row)
    return row

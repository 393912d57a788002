"""Engine of sweeps and studies: compute rows by key on the cores of one machine, and store each when it is done.

The store has one file per row, so that parallel sweeps need no lock: the SHA-256 of the row in the first line and the
row as JSON in the second. Files with a wrong checksum are ignored. A row that is being computed has a mark in the
store, which identifies rows that kill their process, for instance by the memory they need.
"""

import hashlib
import json
import os
import re
import signal
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import nullcontext, suppress
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

# States of a row: computed; its input is refused; its run left the physical range; failed for a reason that may pass.
DONE, REFUSED, DIVERGED, FAILED = "done", "refused", "diverged", "failed"
MAX_ROW_BYTES = 100_000_000  # bytes; a row of a sweep takes 4,000
# Rows are handed to processes in batches: long enough to share settled loops, short enough that all processes end
# together. Batches per process at least, rows per batch at most.
LEAST_BATCHES, LONGEST_BATCH = 8, 8
MOST_KILLED = 2  # processes of a row that were killed, after which the row has failed
MARK = re.compile(rf"\.(.+)\.{MACHINE}-(\d{{1,9}})\.trackdyn-row")
Compute = Callable[..., dict]  # computes the values of a row; other processes import it by its name
Tasks = Mapping[str, dict]  # arguments of rows by their keys, plain data


def key_of(*content: Any) -> str:
    """Return the key of a row: a hash of the plain data that it depends on, and of the compiler."""
    content = (*content, COMPILER) if COMPILER else content
    return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()[:24]


def without_values(key: str, state: str, reason: str) -> dict:
    """Return a row that has no values, with its ``state`` and the ``reason``."""
    return {"key": key, "state": state, "reason": reason, "values": {}}


class Store:
    """Store of rows by key in a folder, which is created if needed; `InputError`: it cannot be written."""

    def __init__(self, folder: Path | str):
        self.folder = Path(folder)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            reason = error.strerror or error
            raise InputError(f"{folder}: cannot be written ({reason}); choose another folder") from None

    def read(self, keys: Iterable[str]) -> dict[str, dict]:
        """Return the stored rows of ``keys``; report the number of damaged files on standard error."""
        rows, damaged = dict[str, dict](), 0
        for key in keys:
            if (path := self.folder / f"{key}.json").exists():
                with suppress(InputError, ValueError):
                    checksum, _, content = read_bytes(path, "row", MAX_ROW_BYTES).partition(b"\n")
                    if checksum == _checksum(content[:-1]) and (row := json.loads(content)) and row["key"] == key:
                        rows[key] = row
                damaged += key not in rows
        if damaged:
            words = "1 damaged row was" if damaged == 1 else f"{damaged} damaged rows were"
            print(f"trackdyn: {self.folder}: {words} ignored; they are computed again", file=sys.stderr)
        return rows

    def abandoned(self) -> set[str]:
        """Remove the marks of killed processes of this machine; return the keys of their rows."""
        keys = set()
        for mark in self.folder.glob(".*.trackdyn-row"):
            match = MARK.fullmatch(mark.name)
            if match and is_gone(int(match[2])):
                mark.unlink(missing_ok=True)
                keys.add(match[1])
        return keys

    def write(self, row: dict) -> None:
        """Write a row, unless it failed for a reason that may pass. Raises `InputError`: the disk is full."""
        if row["state"] == FAILED:
            return
        content = json.dumps(row).encode()
        with replacing(self.folder / f"{row['key']}.json") as temporary:
            temporary.write_bytes(_checksum(content) + b"\n" + content + b"\n")


def _checksum(content: bytes) -> bytes:
    return hashlib.sha256(content).hexdigest().encode()


def results(
    compute: Compute, tasks: Tasks, jobs: int = 1, store: Path | str | None = None, progress: str = ""
) -> dict[str, dict]:
    """Return rows by their keys (`key_of`), each with ``key, state, reason, values``; stored rows are not computed.

    ``compute`` returns the values of a row from its arguments in ``tasks``, in which neighbours share settled loops. It
    runs in ``jobs`` processes; with one, and no ``store`` (folder of rows), in this process. A bar entitled
    ``progress`` counts rows; no bar if it is empty. A row whose process is killed is computed again after all others,
    in the only process, and fails if this one is killed, too. Raises `TrackdynError`: a process was killed that
    computed no row.
    """
    checked = partial(_values, compute, module_hash(compute.__module__))
    with TemporaryDirectory() if store is None else nullcontext(store) as folder:
        rows_store = Store(folder)
        rows = rows_store.read(tasks)
        due = {key: task for key, task in tasks.items() if key not in rows}
        with tqdm(total=len(due), disable=not progress, unit="row", desc=progress, smoothing=0.05) as bar:
            if store is not None or jobs > 1 < len(due):
                computed = _run_in_pools(checked, due, jobs, rows_store)
            else:
                computed = (outcome(checked, rows_store, key, task) for key, task in due.items())
            for row in computed:
                rows[row["key"]] = row
                bar.update()
    return rows


def _values(compute: Compute, sources: str, /, **task) -> dict:
    """Compute a row; raise `TrackdynError` if its ``sources`` changed: its key would be that of other sources."""
    module = compute.__module__

    def check() -> None:
        if module_hash(module) != sources or edited(module_files(module)):
            raise TrackdynError("the program was edited while it ran; start it again: stored rows are reused")

    check()
    try:
        return compute(**task)
    finally:
        check()  # the first row imports some of them


def check_completed(rows: Iterable[dict], advice: str) -> None:
    """Raise `TrackdynError`, with ``advice``, if a row failed for a reason that may pass."""
    for row in rows:
        if row["state"] == FAILED:
            raise TrackdynError(f"a simulation failed for a reason that may pass ({row['reason']}); {advice}")


def _run_in_pools(compute: Compute, due: Tasks, jobs: int, store: Store) -> Iterator[dict]:
    """Yield rows in any order, computed by other processes; `TrackdynError`: one was killed that computed no row."""
    kills = dict.fromkeys(store.abandoned() & due.keys(), 0)  # of rows that are computed one by one, after all others
    waiting = {key: task for key, task in due.items() if key not in kills}
    try:
        while waiting or kills:
            tasks = waiting or {key: due[key] for key in kills}
            remaining = dict(tasks)
            try:
                for row in _run_in_pool(compute, tasks, min(jobs, len(tasks)) if waiting else 1, store):
                    del remaining[row["key"]]
                    yield row
            except TerminatedWorkerError as error:
                signals = ", ".join(re.findall(r"(?:SIG|EXIT)\w*\(-?\d+\)", str(error))) or "no signal"
                remove_abandoned(store.folder)
                for row in store.read(remaining).values():  # stored, but not returned when the process was killed
                    del remaining[row["key"]]
                    yield row
                killed = store.abandoned() & remaining.keys()
                if not killed:
                    raise TrackdynError(
                        f"a process was ended ({signals}), perhaps out of memory; stored rows remain, and the same "
                        "command continues from them: use fewer jobs or more memory"
                    ) from None
                for key in killed:
                    kills[key] = kills.get(key, 0) + 1
                    if kills[key] == MOST_KILLED:
                        del remaining[key]
                        reason = f"{MOST_KILLED} of its processes were ended ({signals}), perhaps out of memory"
                        yield without_values(key, FAILED, f"{reason}; use more memory")
                jobs = max(jobs - 1, 1)  # perhaps their memory together was too much
            if waiting:
                waiting = {key: task for key, task in remaining.items() if key not in kills}
            else:
                kills = {key: count for key, count in kills.items() if key in remaining}
    finally:
        store.abandoned()  # rows of processes that were ended with this sweep did not kill them


def _run_in_pool(compute: Compute, tasks: Tasks, jobs: int, store: Store) -> Iterator[dict]:
    """Yield rows computed by one pool of processes; `TerminatedWorkerError`: one of them was killed."""
    size = 1 if jobs == 1 else min(max(len(tasks) // (LEAST_BATCHES * jobs), 1), LONGEST_BATCH)
    # trackers remove the resources of a killed sweep, each with a warning
    os.environ.setdefault("PYTHONWARNINGS", "ignore:resource_tracker:UserWarning")
    # Ctrl-C is for the parent process: children and threads inherit the signals that their parent blocks. The tracker
    # runs before, since its start unblocks them.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        pool = ProcessPoolExecutor(jobs, timeout=None, initializer=_begin, initargs=(os.getpid(),))
        items = list(tasks.items())
        batches = (items[k : k + size] for k in range(0, len(items), size))
        rows = [pool.submit(_batch, compute, store, batch) for batch in batches]
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    try:
        for batch in as_completed(rows):  # a long row does not delay others, which the bar counts
            yield from batch.result()
    finally:
        pool.shutdown(wait=True, kill_workers=True)


def _batch(compute: Compute, store: Store, items: list[tuple[str, dict]]) -> list[dict]:
    """Compute a batch of rows in this process."""
    return [outcome(compute, store, key, task) for key, task in items]


def _begin(parent: int) -> None:
    """Initialize a process of a pool, which ends with its ``parent``."""
    os.dup2(2, 1)  # standard output is the parent's

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.2)
        broken_off()
        os._exit(1)

    Thread(target=watch, daemon=True).start()


def outcome(compute: Compute, store: Store, key: str, task: dict) -> dict:
    """Compute and store the row of ``key``: the values that ``compute`` returns for ``task``, or a state and reason."""
    row = without_values(key, DONE, "")
    try:
        with marked(store.folder / f".{key}.{MACHINE}-{os.getpid()}.trackdyn-row"):  # which remains if it is killed
            row["values"] = compute(**task)
    except (OutOfMemoryError, MemoryError) as error:
        row |= {"state": FAILED, "reason": str(error) or "the free memory does not suffice"}
    except InputError as error:
        row |= {"state": REFUSED, "reason": str(error)}
    except DivergenceError as error:
        row |= {"state": DIVERGED, "reason": str(error)}
    except TrackdynError as error:
        row |= {"state": FAILED, "reason": str(error)}
    except Exception as error:  # a row never stops the others
        row |= {"state": FAILED, "reason": f"{type(error).__name__}: {shown(str(error))}"}
    row = json.loads(json.dumps(row, default=lambda number: number.item()))  # as it is read from its file
    store.write(row)
    return row

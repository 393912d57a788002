"""Jobs of the workflow: output goes to the rule's log, errors end in one sentence, interruptions leave no partial file.

An interrupted job ends at once and without a traceback, also during its imports: scripts import this module first, and
it imports only modules that load at once.
"""

import fcntl
import gc
import os
import resource
import shutil
import signal
import sys
from contextlib import redirect_stdout, suppress
from hashlib import sha256
from pathlib import Path
from time import process_time
from zlib import crc32


def run_job(task):
    """Decorate the task of a rule, the last function of a script, and run it if the script is run by Snakemake.

    Standard output goes to the log, which ends with the kernels that the job compiled and its CPU time, as does the
    screen, which begins with that of the last time. A `TrackdynError` is one sentence in both.
    """
    if task.__module__ != "__main__":
        return task
    from trackdyn.inputs.errors import TrackdynError
    from trackdyn.inputs.files import end_process

    job = sys.modules["__main__"].snakemake
    _join(job.log[0])
    with suppress(OSError):  # the first run in this folder has no costs
        lines = (line.partition(" ") for line in LAST_COSTS.read_text(encoding="utf-8").splitlines())
        if before := {name: seconds for seconds, _, name in lines}.get(job.log[0]):
            print(f"{job.log[0]}: {before} CPU s the last time", file=sys.stderr, flush=True)
    with open(job.log[0], "w", encoding="utf-8") as log, redirect_stdout(log):
        compiled = _compiled()
        try:
            task(job)
        except TrackdynError as error:
            print(error)
            print(f"{job.rule}: {error}", file=sys.stderr)
            sys.exit(1)
        finally:
            seconds = sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
            print(*compiled, f"{seconds:.1f} CPU s", sep="\n")
            print(f"{job.log[0]}: {seconds:.1f} CPU s", file=sys.stderr, flush=True)
            with suppress(OSError), open(LAST_COSTS, "a", encoding="utf-8") as file:
                file.write(f"{seconds:.1f} {job.log[0]}\n")
            if costs := os.environ.get(COSTS):
                with suppress(OSError), open(costs, "a", encoding="utf-8") as file:  # one write: jobs run in parallel
                    file.write("".join(f"{line}\n" for line in (*compiled, f"{seconds:.1f} {job.log[0]}")))
    end_process()
    return task


def _compiled() -> list[str]:
    """Return a list to which each kernel adds a line when this process has compiled it, for a call from Python."""
    from trackdyn.jit import announce

    compiled: list[str] = []

    def listen(_: str) -> None:
        from numba.core import event

        begun: list[float] = []

        class Listener(event.Listener):
            def on_start(self, event) -> None:
                begun.append(process_time())

            def on_end(self, event) -> None:
                seconds = process_time() - begun.pop()
                if not begun:  # the kernels that it calls are parts of it
                    kernel, types = event.data["dispatcher"].py_func, str(event.data["args"])
                    of_types = sha256(types.encode()).hexdigest()[:8]
                    compiled.append(f"{seconds:.1f} {COMPILED}{kernel.__module__}.{kernel.__qualname__}, {of_types}")

        event.register("numba:compile", Listener())

    announce(listen)
    return compiled


# file per folder in which every process locks a byte; the system releases it however the process ends
PROCESSES = Path(".snakemake", "processes")
LAST_COSTS = PROCESSES.with_name("costs")  # CPU time and log of every job that ended
DRIVER = "TRACKDYN_DRIVER"  # process of the run to which a job belongs
COSTS = "TRACKDYN_COSTS"  # file to which jobs append their CPU times, and those of the kernels that they compiled
COMPILED = "CPU s to compile "  # a kernel and the hash of its arguments' types


def drive(workflow):
    """Lock byte 0 for a Snakemake of this folder; a Snakefile calls it before Snakemake takes its own lock.

    A killed Snakemake leaves its lock, which looks like that of a running one. If no other process holds the byte, all
    processes that made locks are gone, and the locks are removed; none can start meanwhile. A dry run removes none.
    """
    os.environ[DRIVER] = str(os.getpid())
    if not workflow.is_main_process:  # a job on another node
        return
    with suppress(OSError):  # a file system without locks
        PROCESSES.parent.mkdir(exist_ok=True)
        file = os.open(PROCESSES, os.O_RDWR | os.O_CREAT, 0o666)
        if not workflow.output_settings.dryrun:
            with suppress(BlockingIOError, PermissionError):  # another Snakemake runs
                fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, 0)
                shutil.rmtree(PROCESSES.with_name("locks"), ignore_errors=True)
        fcntl.lockf(file, fcntl.LOCK_SH, 1, 0)


def _join(log):
    """Wait for another process that writes the results of this log, such as the job of a run that was killed."""
    with suppress(FileNotFoundError):  # no folder of a run
        file = os.open(PROCESSES, os.O_RDWR)
        byte = 1 + crc32(str(log).encode())
        try:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, byte)
        except (BlockingIOError, PermissionError):
            print(f"{log}: another process writes these results; waiting until it ends", file=sys.stderr, flush=True)
            fcntl.lockf(file, fcntl.LOCK_EX, 1, byte)
        except OSError:  # a file system without locks
            pass
    if driver := os.environ.get(DRIVER):  # jobs of a killed run continue, but must not replace results of a later one
        try:
            os.kill(int(driver), 0)
        except ProcessLookupError:
            sys.exit("the run that began this job was killed")


def _leave(number, _):
    """End at once with the exit code of the signal, and remove files that are being written."""
    # the module is imported completely, or not at all
    getattr(sys.modules.get("trackdyn.inputs.files"), "broken_off", lambda: None)()
    os._exit(128 + number)


if hasattr(sys.modules["__main__"], "snakemake"):  # a script of the workflow: the rest of its imports takes a second
    for stop in (signal.SIGINT, signal.SIGTERM):
        signal.signal(stop, _leave)
    gc.set_threshold(10_000)  # as for the command

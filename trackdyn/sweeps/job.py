"""What every script shares: its output goes to the rule's log, a mistake ends in one sentence, a stop leaves no half
file. A job that is stopped ends at once and without a traceback, while it imports as while it runs: this module comes
first in a script, and imports nothing that takes time.
"""

import fcntl
import os
import resource
import signal
import sys
import time
from contextlib import contextmanager, redirect_stdout, suppress
from pathlib import Path

# when this process began: loading what stands above took no longer than its processor time
BEGAN = time.perf_counter() - time.process_time()


@contextmanager
def logged(snakemake):
    """Send standard output to the log; end with one sentence there and on the screen."""
    from trackdyn.errors import TrackdynError

    leave_when_stopped()
    _join()
    with open(snakemake.log[0], "w", encoding="utf-8") as log, redirect_stdout(log):
        try:
            yield
        except TrackdynError as error:
            print(error)
            print(f"{snakemake.rule}: {error}", file=sys.stderr)
            sys.exit(1)
    _spent(Path(snakemake.log[0]))


def _spent(log):
    """Write what the job took, `benchmarks/page.tsv` for `logs/page.log`: s of the clock and of a core, memory in MB.

    Snakemake's own benchmarks sample: they miss up to half a minute of a core's time, and take some of it themselves.
    """
    from trackdyn.files import write_text

    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    seconds = time.perf_counter() - BEGAN
    memory = sum(one.ru_maxrss for one in used) / (2**20 if sys.platform == "darwin" else 2**10)
    cpu = sum(one.ru_utime + one.ru_stime for one in used)
    before, _, after = str(log.with_suffix(".tsv")).rpartition("logs/")
    write_text(f"{before}benchmarks/{after}", f"s\tmax_rss\tcpu_time\n{seconds:.2f}\t{memory:.1f}\t{cpu:.2f}\n")


def _join():
    """Be seen by the next run (`workflow/run.py`) until this process ends, however that comes about.

    A job outlives a run of which only the driver was killed, and could write over what a later run has made.
    """
    with suppress(OSError):  # a file system without locks
        fcntl.flock(os.open(".snakemake/jobs", os.O_RDWR | os.O_CREAT), fcntl.LOCK_SH)
    token = os.environ.get("TRACKDYN_RUN")
    # where there is no such file, as on a node that does not share the folder, nobody can write over anything
    with suppress(FileNotFoundError), open(".snakemake/running", encoding="ascii") as file:
        if token and file.read() != token:
            sys.exit("the run that began this job was killed, and another one goes on")


def _leave(number, _):
    """End at once, as Snakemake asks; what is being written is removed."""
    broken_off = getattr(sys.modules.get("trackdyn.files"), "broken_off", None)  # imported as a whole, or not yet
    if broken_off:
        broken_off()
    os._exit(128 + number)


def leave_when_stopped():
    """From here on."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _leave)


if hasattr(sys.modules["__main__"], "snakemake"):  # a script of the workflow: the rest of its imports takes a second
    leave_when_stopped()

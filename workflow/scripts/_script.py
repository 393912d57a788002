"""What every script shares: its output goes to the rule's log, a mistake ends in one sentence, a stop leaves no half file."""

import fcntl
import os
import signal
import sys
from contextlib import contextmanager, redirect_stdout, suppress

from trackdyn.errors import TrackdynError
from trackdyn.replacing import broken_off


@contextmanager
def logged(snakemake):
    """Send standard output to the log; end with one sentence there and on the screen."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _leave)
    _join()
    with open(snakemake.log[0], "w", encoding="utf-8") as log, redirect_stdout(log):
        try:
            yield
        except TrackdynError as error:
            print(error)
            print(f"{snakemake.rule}: {error}", file=sys.stderr)
            sys.exit(1)


def _leave(number, _):
    """End at once, as Snakemake asks; what is being written is removed."""
    broken_off()
    os._exit(128 + number)


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

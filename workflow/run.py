"""Snakemake in this folder, also after a run that was killed: its arguments are Snakemake's.

A killed Snakemake leaves its lock behind and every later run ends at it. Here a lock of the operating system, which
dies with its holder, says whether somebody still runs; if nobody does, Snakemake's own is removed. Configurations
are read here first: Snakemake's loader ends in tracebacks where they are no UTF-8, and may run what stands in them.
"""

import fcntl
import os
import subprocess
import sys
import time
from pathlib import Path

from trackdyn.errors import TrackdynError
from trackdyn.pipeline.config import read_layer

ROOT = Path(__file__).parents[1]


def configurations(arguments: list[str]) -> list[str]:
    """Files behind ``--configfile``, up to the next option."""
    found, taking = [], False
    for argument in arguments:
        if argument.startswith("-"):
            option, _, value = argument.partition("=")
            taking = option in ("--configfile", "--configfiles") and not value
            found += [value] if value and option in ("--configfile", "--configfiles") else []
        elif taking:
            found.append(argument)
    return found


def wait_for_jobs() -> None:
    """Wait for jobs that a killed run left behind; what has not begun yet ends by itself
    (`workflow/scripts/_script.py`).
    """
    jobs = os.open(ROOT / ".snakemake" / "jobs", os.O_RDWR | os.O_CREAT)
    try:
        fcntl.flock(jobs, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        print("jobs of another run still go on; waiting for their end", file=sys.stderr, flush=True)
        fcntl.flock(jobs, fcntl.LOCK_EX)
    os.close(jobs)


def main(arguments: list[str]) -> None:
    """Read the configurations, take the lock, become Snakemake."""
    for file in configurations(arguments):
        read_layer(file)
    os.chdir(ROOT)
    (ROOT / ".snakemake").mkdir(exist_ok=True)
    lock = os.open(ROOT / ".snakemake" / "running", os.O_RDWR | os.O_CREAT)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        sys.exit("another run is going on in this folder; wait for its end")
    os.ftruncate(lock, 0)
    os.write(lock, (token := f"{os.getpid()} {time.time()}").encode())
    os.environ["TRACKDYN_RUN"] = token
    wait_for_jobs()
    snakemake = [sys.executable, "-m", "snakemake"]
    if any((ROOT / ".snakemake" / "locks").glob("*")):
        files = [part for file in configurations(arguments) for part in ("--configfile", file)]
        subprocess.run([*snakemake, "--unlock", "--quiet", "all", *files], check=True)
    os.set_inheritable(lock, True)
    os.execv(sys.executable, [*snakemake, *arguments])


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except TrackdynError as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit(130)

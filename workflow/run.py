"""Snakemake in this folder, also after a run that was killed: its arguments are Snakemake's.

A killed Snakemake leaves its lock behind, and cannot tell it from that of one that runs. Here a lock of the operating
system, which dies with its holder, says whether somebody still runs; if nobody does, Snakemake's own is removed.
Configurations are read here first: Snakemake's loader ends in tracebacks where they are no UTF-8, and may run what
stands in them.
"""

import fcntl
import os
import shutil
import sys
import time
from argparse import ArgumentParser
from pathlib import Path

ROOT = Path(__file__).parents[1]
# its own `__main__`, and no traceback of what it imports when it is stopped there
SNAKEMAKE = """
try:
    from snakemake.cli import main
except KeyboardInterrupt:
    raise SystemExit("interrupted; nothing had begun") from None
main()
"""


def configurations(arguments: list[str]) -> list[str]:
    """Files behind ``--configfile``, up to the next option."""
    parser = ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--configfile", "--configfiles", nargs="+", action="extend", default=[])
    return parser.parse_known_args(arguments)[0].configfile


def wait_for_jobs() -> None:
    """Wait for jobs that a killed run left behind; what has not begun yet ends by itself
    (`trackdyn.sweeps.job`).
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
    from replication.pipeline.config import read_layer

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
    shutil.rmtree(ROOT / ".snakemake" / "locks", ignore_errors=True)
    os.set_inheritable(lock, True)
    os.execv(sys.executable, [sys.executable, "-c", SNAKEMAKE, *arguments])


if __name__ == "__main__":
    try:
        from trackdyn.errors import TrackdynError

        try:
            main(sys.argv[1:])
        except TrackdynError as error:
            sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit("interrupted; nothing had begun")

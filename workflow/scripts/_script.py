"""What every script shares: its output goes to the rule's log, a mistake ends in one sentence."""

import sys
from contextlib import contextmanager, redirect_stdout

from trackdyn.errors import TrackdynError


@contextmanager
def logged(snakemake):
    """Send standard output to the log; end with one sentence there and on the screen."""
    with open(snakemake.log[0], "w", encoding="utf-8") as log, redirect_stdout(log):
        try:
            yield
        except TrackdynError as error:
            print(error)
            print(f"{snakemake.rule}: {error}", file=sys.stderr)
            sys.exit(1)

"""A job that is stopped ends at once and without a traceback, while it imports as while it runs."""

import os
import signal
import sys


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

"""The ``trackdyn`` command from its first instant on: an interruption is one line, also amid imports and compilation.

It stands beside the package because importing any part of that imports the compiler, which an exception in its midst
can bring down.
"""

import os
import signal
import sys


def leave(*_) -> None:
    """End at once; what is being written is removed."""
    if replacing := sys.modules.get("trackdyn.replacing"):
        getattr(replacing, "discard_parts", int)()
    os.write(2, b"\n" * sys.stderr.isatty() + b"trackdyn: interrupted; no file is left half-written\n")
    os._exit(130)


def main() -> None:
    """Entry point."""
    signal.signal(signal.SIGINT, leave)
    from trackdyn.cli import main as run

    run()

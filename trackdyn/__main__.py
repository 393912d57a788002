"""The ``trackdyn`` command from its first instant on: an interruption is one line, also amid imports and compilation.

Signals are handled before anything of the package is imported: an exception amid the compiler's imports can bring it
down.
"""

import os
import signal
import sys


def leave(number: int, _) -> None:
    """End at once, and remove what is being written. The exit code is the signal's, as in a shell."""
    # before that module is there nothing is written
    end = getattr(sys.modules.get("trackdyn.inputs.files"), "broken_off", lambda: "no file is left half-written")
    said = f"trackdyn: {'stopped' if number == signal.SIGTERM else 'interrupted'}; {end()}\n"
    os.write(2, b"\n" * (sys.stderr.isatty() or "tqdm" in sys.modules) + said.encode())  # a bar may stand on the line
    os._exit(128 + number)


def main() -> None:
    """Entry point."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, leave)
    from trackdyn.commands.cli import main as run

    run()


if __name__ == "__main__":
    main()

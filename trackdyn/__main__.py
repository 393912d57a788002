"""Start of the ``trackdyn`` command: an interruption prints one line, also during imports and compilation.

Signals are handled before the package is imported, since an exception during the compiler's imports can crash it.
"""

import gc
import os
import signal
import sys


def leave(number: int, _) -> None:
    """End at once with the exit code of the signal, as in a shell, and remove files that are being written."""
    # no file is written before that module is imported
    end = getattr(sys.modules.get("trackdyn.inputs.files"), "broken_off", lambda: "no file is left half-written")
    message = f"trackdyn: {'stopped' if number == signal.SIGTERM else 'interrupted'}; {end()}\n"
    os.write(2, b"\n" * (sys.stderr.isatty() or "tqdm" in sys.modules) + message.encode())  # the line may have a bar
    os._exit(128 + number)


def main() -> None:
    """Handle signals, then run the command."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, leave)
    gc.set_threshold(10_000)  # imports create half a million objects; by default garbage is collected after every 700
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # it would read about every installed package
    from trackdyn.commands.cli import main as run

    run()


def command() -> None:
    """Run the command as a process of its own, which ends with it."""
    main()
    sys.modules["trackdyn.inputs.files"].end_process()


if __name__ == "__main__":
    command()

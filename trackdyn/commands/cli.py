"""The ``trackdyn`` command: its subcommands, and the messages of their errors."""

import os
import sys
import warnings
from collections.abc import Callable, Iterable
from errno import ENOENT
from importlib.metadata import entry_points
from inspect import unwrap
from typing import Annotated, Any

import typer

from trackdyn.commands import options
from trackdyn.commands.field_tests import compare
from trackdyn.commands.recordings import export, show, simulate
from trackdyn.commands.rig_files import check, new, rigs
from trackdyn.commands.studies import ring, sweep
from trackdyn.inputs.errors import TrackdynError, missing
from trackdyn.version import __version__

COMMANDS = (simulate, show, export, check, new, rigs, ring, sweep, compare)


class _Command(typer.core.TyperCommand):
    """A command whose usage names its arguments as its help does."""

    def collect_usage_pieces(self, ctx: typer.Context) -> list[str]:
        return [piece.strip("{}") for piece in super().collect_usage_pieces(ctx)]


class _Completed(_Command):
    """A command whose options are created at first use, since that takes a second."""

    completed = False

    def get_params(self, ctx: typer.Context) -> list[Any]:
        if not self.completed:
            single = typer.Typer(add_completion=False)
            single.command()(unwrap(self.callback, stop=lambda function: hasattr(function, "complete")).complete())
            full = typer.main.get_command(single)
            self.params, self.callback, self.completed = full.params, full.callback, True
        return super().get_params(ctx)


class _Commands(typer.core.TyperGroup):
    """Commands of the simulator, then those of packages that build on it, which are for developers."""

    def format_commands(self, ctx: typer.Context, formatter: Any) -> None:
        own = {command.__name__ for command in COMMANDS}
        for title, names in (("Commands", own), ("Commands for developers", self.commands.keys() - own)):
            if rows := [(key, each.get_short_help_str(100)) for key, each in self.commands.items() if key in names]:
                with formatter.section(title):
                    formatter.write_dl(rows)


# rich would triple the time to load the help
app = typer.Typer(
    cls=_Commands, rich_markup_mode=None, pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 120},
)  # fmt: skip


def _add(commands: Iterable[Callable[..., None]]) -> None:
    for command in commands:
        app.command(cls=_Completed if hasattr(command, "complete") else _Command)(command)


_add(COMMANDS)
for others in entry_points(group="trackdyn.commands"):  # commands of packages that build on this one
    try:
        _add(others.load())
    except Exception as error:  # a broken package may raise anything: its commands are missing, all others work
        print(f"trackdyn: warning: commands of {others.value} cannot be loaded ({error!r})", file=sys.stderr)


def _print_version(requested: bool) -> None:
    if requested:
        typer.echo(f"trackdyn {__version__}")
        raise typer.Exit


_VERSION = typer.Option("--version", help="Print the version and exit.", callback=_print_version, is_eager=True)


@app.callback()
def trackdyn(version: Annotated[bool, _VERSION] = False) -> None:
    """Simulate a track drive, compare it with a sensor, choose its rubber ring."""


def _sentence(error) -> str:
    """Return typer's message on a command line, with the command whose help has more."""
    context = getattr(error, "ctx", None)
    # typer prints the help of a group without a command, and has no message
    words = "Missing command" if type(error).__name__ == "NoArgsIsHelpError" else error.format_message()
    command = "trackdyn" if context is None else context.command_path
    return f"{' '.join(words.split()).rstrip('.')}; see {command} --help"


def main() -> None:
    """Run the command; an error of the user ends in one sentence and exit code 1."""
    warnings.showwarning = lambda message, *_: print(f"trackdyn: warning: {message}", file=sys.stderr)
    try:
        app(standalone_mode=False, prog_name="trackdyn")
        if sys.stdout:  # None if it was closed from the start
            sys.stdout.flush()
        return
    except TrackdynError as error:
        sentence = options.as_options(str(error))
    except ModuleNotFoundError as error:
        sentence = str(missing(error))
    except UnicodeEncodeError as error:
        sentence = f"{error.object[:100]!a}: cannot be written as {error.encoding}; rename the file"
    except MemoryError:
        sentence = "out of memory; use a shorter duration or fewer pitches"
    except OSError as error:
        if error.filename is None:  # standard output is closed or full
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        sentence = f"{error.filename or 'standard output'}: {error.strerror}; give a path that can be written"
        if error.filename is None and error.errno == ENOENT:
            sentence = "the present folder does not exist any more; change to another one"
    except Exception as error:
        threads = os.environ.get("NUMBA_NUM_THREADS", "1")
        if hasattr(error, "format_message"):  # of typer, whichever module defines it
            sentence = _sentence(error)
        elif isinstance(error, ValueError) and not threads.strip("0").isdecimal():  # of numba, at its import
            sentence = f"NUMBA_NUM_THREADS = {threads!r}: must be a whole number above 0; set it so, or unset it"
        else:
            raise
    print(f"trackdyn: {sentence}", file=sys.stderr)
    sys.exit(1)

"""Errors with which a run can end, each with a message of one sentence."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from types import ModuleType
from typing import Any

LONGEST_SHOWN = 120  # characters of a value in a sentence
LONGEST_SENTENCE = 640  # characters of a sentence: whatever a name or a value holds, problem and remedy can be read

# extra -> modules that it installs; of several extras with a module, the smallest
EXTRAS = {
    "report": ("jinja2", "matplotlib", "PIL", "plotly", "tabulate"), "pipeline": ("snakemake",), "peers": ("exudyn",),
}  # fmt: skip


class TrackdynError(Exception):
    """Base class of errors; the message is one sentence for the user on one line, cut in the middle if too long."""

    def __str__(self) -> str:
        text = " ".join(super().__str__().splitlines())
        half = LONGEST_SENTENCE // 2
        return text if len(text) <= LONGEST_SENTENCE else f"{text[:half]} ... {text[-half:]}"


class InputError(TrackdynError):
    """Invalid input; the message names file, field, value and remedy."""


class OutOfMemoryError(InputError):
    """Too little free memory for a recording, which may be temporary."""


class DivergenceError(TrackdynError):
    """Integration beyond the physical range; the message names the time and the body."""


@contextmanager
def naming(name: Any) -> Iterator[None]:
    """Prefix the message of an `InputError` with the name of a file, unless it begins with it."""
    try:
        yield
    except InputError as error:
        text = str(error)
        named = text.startswith((f"{name}:", f"{name} "))
        raise (error if named else InputError(f"{name}: {text}")) from None


def required(name: str) -> ModuleType:
    """Import and return a module of an optional package; `InputError` names the extra that installs it."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise missing(error) from None


def missing(error: ModuleNotFoundError) -> InputError:
    """Return the error for a module that is not installed; re-raise an error within trackdyn itself."""
    module = (error.name or "").partition(".")[0]
    if module in ("", "trackdyn"):
        raise error
    extra = next((extra for extra, modules in EXTRAS.items() if module in modules), None)
    # from the clone, since no index has trackdyn
    remedy = f"in the clone: pip install -e '.[{extra}]'" if extra else f"pip install {module}"
    return InputError(f"{module} is not installed; {remedy}")


def shown(value: Any) -> str:
    """Return the text of a value for a message: on one line and not too long."""
    try:
        text = repr(value)
    except ValueError:  # an integer of thousands of digits
        return "an integer of thousands of digits"
    text = " ".join(text.split())
    return text if len(text) <= LONGEST_SHOWN else f"{text[:LONGEST_SHOWN]}..."

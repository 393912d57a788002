"""Errors with which a run can end, each with a message of one sentence."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

LONGEST_SHOWN = 120  # characters of a value in a sentence
LONGEST_SENTENCE = 640  # characters of a sentence: whatever a name or a value holds, problem and remedy can be read


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


def shown(value: Any) -> str:
    """Return the text of a value for a message: on one line and not too long."""
    try:
        text = repr(value)
    except ValueError:  # an integer of thousands of digits
        return "an integer of thousands of digits"
    text = " ".join(text.split())
    return text if len(text) <= LONGEST_SHOWN else f"{text[:LONGEST_SHOWN]}..."

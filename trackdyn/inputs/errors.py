"""The ways a run can end without a result, each said in one sentence."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

LONGEST_SHOWN = 120  # characters of a value in a sentence
LONGEST_SENTENCE = 640  # characters of a sentence: whatever a name or a value holds, problem and remedy can be read


class TrackdynError(Exception):
    """Base class: its text is one sentence meant for the user, on one line, the middle of a longer one left out."""

    def __str__(self) -> str:
        text = " ".join(super().__str__().splitlines())
        half = LONGEST_SENTENCE // 2
        return text if len(text) <= LONGEST_SENTENCE else f"{text[:half]} ... {text[-half:]}"


class InputError(TrackdynError):
    """Something the user gave cannot be used: the sentence names file, field, value and remedy."""


class OutOfMemoryError(InputError):
    """A recording does not fit into the memory that is free, which may pass."""


class DivergenceError(TrackdynError):
    """The integration left the physical range: the sentence names the time and the body."""


@contextmanager
def naming(name: Any) -> Iterator[None]:
    """Put the name of a file before the sentence of an `InputError`, unless it begins with it."""
    try:
        yield
    except InputError as error:
        text = str(error)
        named = text.startswith((f"{name}:", f"{name} "))
        raise (error if named else InputError(f"{name}: {text}")) from None


def shown(value: Any) -> str:
    """A value as it may stand in a sentence: on one line and not too long."""
    try:
        text = repr(value)
    except ValueError:  # an integer of thousands of digits
        return "an integer of thousands of digits"
    text = " ".join(text.split())
    return text if len(text) <= LONGEST_SHOWN else f"{text[:LONGEST_SHOWN]}..."

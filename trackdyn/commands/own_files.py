"""Files that a command may replace: those that it wrote from the same inputs, unless they were edited since.

Every file written has a note in the cache folder, named by the file's resolved path. The note is written just before
the file gets its name, and has the hashes of the old and the new content, so that an interrupted command may replace
either. An input is the same if its resolved path or its content is: a file may be edited and used again, or moved.
"""

import hashlib
import json
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.files import before_replacing, write_text

# a file; equivalent values of a setting; None
Input = Path | str | tuple | None


def is_own(path: Path, inputs: Iterable[Input]) -> bool:
    """Return whether a file is unchanged since it was written from these inputs."""
    present = [_identities(item) for item in inputs]
    with suppress(OSError, ValueError, KeyError, TypeError):  # no note, another number of inputs, or a damaged note
        note = json.loads(_note_of(path).read_text(encoding="utf-8"))
        same = all(set(old) & set(new) for old, new in zip(note["inputs"], present, strict=True))
        return same and _hash(path) in note["contents"]
    return False


@contextmanager
def noting(inputs: Iterable[Input], *paths: Path) -> Iterator[None]:
    """Note that files which are written in this context are made from ``inputs``."""
    identities = [_identities(item) for item in inputs]
    targets = {os.path.realpath(path) for path in paths}

    def note(complete: Path, target: Path) -> None:
        if str(target) in targets:
            contents = [_hash(file) for file in (complete, target) if file.is_file()]
            # without a cache the user must ask for the replacement next time
            with suppress(InputError):
                write_text(_note_of(target), json.dumps({"contents": contents, "inputs": identities}))

    with before_replacing(note):
        yield


def _identities(item: Input) -> list[str]:
    """Return the identities of an input: values of a setting; path and hash of a file."""
    if not isinstance(item, Path | str):
        return [repr(value) for value in item or ("none",)]
    path, identities = Path(item), [os.path.realpath(item)]
    with suppress(OSError):  # reported when it is read
        if path.is_file():
            identities.append(_hash(path))
    return identities


def _note_of(path: Path) -> Path:
    from trackdyn.sources import cache_base

    return cache_base() / "written" / hashlib.sha256(os.fsencode(os.path.realpath(path))).hexdigest()


def _hash(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()

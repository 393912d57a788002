"""Which files a command may replace: those that it wrote itself from the same inputs, and that nobody edited since.

Each file that is written has a note in the cache folder, named by the file's path behind all links. The note is written
just before the file takes its name, and knows the content before and after: a command that is stopped in between may
replace either. An input is the same if its path, behind all links, or its content is: a file may be edited and used
again, or moved.
"""

import hashlib
import json
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.files import before_replacing, write_text

# a file; a setting that counts, one value or several that mean the same; nothing
Input = Path | str | tuple | None


def is_own(path: Path, inputs: Iterable[Input]) -> bool:
    """Return whether a file is as it was written, from these inputs."""
    present = [_identities(item) for item in inputs]
    with suppress(OSError, ValueError, KeyError, TypeError):  # no note, other inputs in number, or a damaged note
        note = json.loads(_note_of(path).read_text(encoding="utf-8"))
        same = all(set(old) & set(new) for old, new in zip(note["inputs"], present, strict=True))
        return same and _hash(path) in note["contents"]
    return False


@contextmanager
def noting(inputs: Iterable[Input], *paths: Path) -> Iterator[None]:
    """Note these files, as they are written inside, as made from ``inputs``."""
    identities = [_identities(item) for item in inputs]
    targets = {os.path.realpath(path) for path in paths}

    def note(complete: Path, target: Path) -> None:
        if str(target) in targets:
            contents = [_hash(file) for file in (complete, target) if file.is_file()]
            # a cache that cannot be written: the next time the user is asked
            with suppress(InputError):
                write_text(_note_of(target), json.dumps({"contents": contents, "inputs": identities}))

    with before_replacing(note):
        yield


def _identities(item: Input) -> list[str]:
    """Return what an input may be known by."""
    if not isinstance(item, Path | str):
        return [repr(value) for value in item or ("none",)]
    path, identities = Path(item), [os.path.realpath(item)]
    with suppress(OSError):  # whoever reads it says why it cannot be read
        if path.is_file():
            identities.append(_hash(path))
    return identities


def _note_of(path: Path) -> Path:
    from trackdyn.sources import cache_base

    name = os.fsencode(os.path.realpath(path))
    return cache_base() / "written" / hashlib.sha256(name).hexdigest()


def _hash(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()

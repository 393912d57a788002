"""Files that are whole or not there: written under another name in the same folder, then renamed."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from errno import EISDIR
from pathlib import Path
from shutil import disk_usage
from tempfile import TemporaryFile

from trackdyn.errors import InputError

_OPEN: set[Path] = set()  # what a process that is stopped must take along
_KEPT: set[Path] = set()  # what it leaves, to go on from


@contextmanager
def replacing(path: Path | str) -> Iterator[Path]:
    """Another name to write to, which becomes ``path`` at the end, or is gone if the writing breaks off.

    Raises
    ------
    InputError
        The file cannot be written; what stood there before is whole.
    """
    path = Path(path)
    part = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _OPEN.add(part)
        yield part
        with part.open("rb+") as file:
            os.fsync(file.fileno())  # or a power cut could leave the name without what it names
        os.replace(part, path)
    except OSError as error:
        reason = error.strerror or error
        raise InputError(f"{path}: cannot be written ({reason}); free space or another place would do") from None
    finally:
        with suppress(OSError):  # a place where nothing could be made holds nothing to remove
            part.unlink(missing_ok=True)
        _OPEN.discard(part)


def write_text(path: Path | str, text: str) -> None:
    """Write a text as UTF-8, its newlines as they are, whole or not at all.

    Raises
    ------
    InputError
        As `replacing`.
    """
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8", newline="")


def write_csv(path: Path | str, table, **options) -> None:
    """Write a table as CSV without its index, whole or not at all; options as those of ``DataFrame.to_csv``.

    Raises
    ------
    InputError
        As `replacing`.
    """
    write_text(path, table.to_csv(index=False, lineterminator="\n", **options))


def keep(path: Path | str) -> None:
    """Name a file that a process which is stopped leaves, and from which the same command goes on."""
    _KEPT.add(Path(path))


def broken_off() -> str:
    """Remove what is being written, for a process that is about to end, and say what is kept."""
    for part in _OPEN:
        with suppress(OSError):
            part.unlink(missing_ok=True)
    kept = [f"{path} is kept, and the same command goes on from it" for path in sorted(_KEPT) if path.exists()]
    return "; ".join(["no file is left half-written", *kept])


def refuse_unwritable(path: Path | str, size: float = 0.0) -> None:
    """Refuse a name that cannot be written, or a disk with less than ``size`` bytes free, before the work is done.

    Raises
    ------
    InputError
        As `replacing` would.
    """
    path = Path(path)
    made = next((folder for folder in path.parents if folder.exists()), path.parent)
    try:
        if path.is_dir():
            raise OSError(EISDIR, os.strerror(EISDIR))
        path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}").exists()  # a name too long
        TemporaryFile(dir=made).close()
        free = disk_usage(made).free
    except OSError as error:
        reason = error.strerror or error
        raise InputError(f"{path}: cannot be written ({reason}); another place would do") from None
    if free < size:
        raise InputError(
            f"{path}: needs about {size / 1e6:.0f} MB and {free / 1e6:.0f} MB are free; free space or another place would do"
        )

"""Files: read up to a limit of size, and written completely or not at all. No content that is read is executed."""

import atexit
import hashlib
import json
import os
import platform
import re
import stat
import sys
import threading
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from errno import EISDIR
from pathlib import Path
from shutil import disk_usage
from tempfile import TemporaryFile
from typing import TYPE_CHECKING
from zlib import crc32

from trackdyn.inputs.errors import InputError, shown

if TYPE_CHECKING:
    import numpy as np

LARGEST_META = 10_000_000  # bytes; a recording's description takes 70,000
MACHINE = f"{crc32(platform.node().encode()):08x}"  # machines may share a folder
# name of a file that is being written here, with process and thread
_PART_FILE = re.compile(rf"\..*\.{MACHINE}-(\d{{1,9}})-\d+\.trackdyn-part(\.\w+)?")
_OPEN: set[Path] = set()  # files being written, removed when the process is stopped
# called with a file that is complete and the one that it will replace
_BEFORE_REPLACING: ContextVar[Callable[[Path, Path], None] | None] = ContextVar("before_replacing", default=None)


def _target(path: Path | str) -> tuple[Path, int | None]:
    """Return the file behind all links of ``path``, and its mode if it exists; `InputError` for a device."""
    path = Path(path)
    try:
        target = Path(os.path.realpath(path))
        mode = os.stat(target).st_mode
    except FileNotFoundError:
        return target, None
    except ValueError:  # a byte that no name has
        raise InputError(f"path = {shown(str(path))}: must be the name of a file") from None
    if stat.S_ISDIR(mode):
        raise OSError(EISDIR, os.strerror(EISDIR))
    if not stat.S_ISREG(mode):
        raise InputError(f"{path}: is a pipe or a device, not a file; give the name of a file")
    return target, stat.S_IMODE(mode)


def _part(target: Path) -> Path:
    """Return the temporary name under which a file is written: one per process and thread."""
    name = f".{target.stem}.{MACHINE}-{os.getpid()}-{threading.get_native_id()}.trackdyn-part{target.suffix}"
    return target.with_name(name)


def is_gone(process: int) -> bool:
    """Return whether a process of this machine has ended, zombies included."""
    from psutil import STATUS_ZOMBIE, NoSuchProcess, Process

    try:
        return Process(process).status() == STATUS_ZOMBIE
    except NoSuchProcess:
        return True


def remove_abandoned(folder: Path | str) -> None:
    """Remove temporary files of `replacing` below a folder whose processes on this machine have ended."""
    for path in Path(folder).rglob(".*.trackdyn-part*"):
        if (match := _PART_FILE.fullmatch(path.name)) and is_gone(int(match[1])):
            with suppress(OSError):
                path.unlink()


@contextmanager
def replacing(path: Path | str) -> Iterator[Path]:
    """Yield a temporary name that replaces ``path``, or its target; on failure it is unchanged (`InputError`)."""
    temporary = None
    try:
        target, mode = _target(path)
        temporary = _part(target)
        target.parent.mkdir(parents=True, exist_ok=True)
        _OPEN.add(temporary)
        yield temporary
        with temporary.open("rb+") as file:
            os.fsync(file.fileno())  # or a power cut could leave the name without its content
        if mode is not None:
            temporary.chmod(mode)
        if note := _BEFORE_REPLACING.get():
            note(temporary, target)
        os.replace(temporary, target)
    except OSError as error:
        remedy = "free disk space or choose another folder"
        raise InputError(f"{path}: cannot be written ({error.strerror or error}); {remedy}") from None
    finally:
        if temporary is not None:
            with suppress(OSError):  # there may be no file to remove
                temporary.unlink(missing_ok=True)
            _OPEN.discard(temporary)


@contextmanager
def marked(path: Path) -> Iterator[None]:
    """Keep an empty file while the context is open; it remains only if the process is killed."""
    with suppress(OSError):  # a full disk
        path.touch()
    _OPEN.add(path)
    try:
        yield
    finally:
        with suppress(OSError):
            path.unlink(missing_ok=True)
        _OPEN.discard(path)


@contextmanager
def before_replacing(note: Callable[[Path, Path], None]) -> Iterator[None]:
    """Call ``note`` with the complete file and the one that it replaces, for each file written in the context."""
    token = _BEFORE_REPLACING.set(note)
    try:
        yield
    finally:
        _BEFORE_REPLACING.reset(token)


def write_text(path: Path | str, text: str) -> None:
    """Write a text as UTF-8, newlines unchanged, completely or not at all. Raises `InputError`: as `replacing`."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="")


def write_csv(path: Path | str, table, **options) -> None:
    """Write a table as CSV without its index, as `replacing` does; options as those of ``DataFrame.to_csv``."""
    write_text(path, table.to_csv(index=False, lineterminator="\n", **options))


def broken_off() -> str:
    """Remove the files being written by a process that is about to end, and return a sentence on it."""
    for temporary in list(_OPEN):
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
    return "no file is left half-written"


def end_process() -> None:
    """End a process that has succeeded, after its exit handlers, without Python's own end.

    That collects garbage among half a million objects and unloads all modules, a seventh of a short command. It is left
    to Python if a thread must be waited for, such as that of a pool of processes, or a profiler is to report.
    """
    threads = (thread for thread in threading.enumerate() if thread is not threading.main_thread())
    if all(thread.daemon for thread in threads) and sys.getprofile() is sys.gettrace() is None:
        atexit._run_exitfuncs()
        for stream in filter(None, (sys.stdout, sys.stderr)):  # None if it was closed from the start
            stream.flush()
        os._exit(0)


def check_writable(path: Path | str, size: float = 0.0) -> None:
    """Raise `InputError` for a name that cannot be written, or a disk with less than ``size`` bytes free."""
    try:
        target, _ = _target(path)
        existing = next((folder for folder in target.parents if folder.exists()), target.parent)
        _part(target).exists()  # a name too long
        TemporaryFile(dir=existing).close()
        free = disk_usage(existing).free
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error}); choose another folder") from None
    if free < size:
        needed = f"needs about {size / 1e6:.0f} MB and {free / 1e6:.0f} MB are free"
        raise InputError(f"{path}: {needed}; free disk space or choose another folder")


def read_bytes(path: Path | str, label: str, limit: int) -> bytes:
    """Return the contents of a plain file of at most ``limit`` bytes, or `InputError`; ``label`` names its type."""
    path = plain_file(path, label)
    try:
        with open(path, "rb") as file:
            data = file.read(limit + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give a {label} that you may read") from None
    if len(data) > limit:
        largest = f"{limit / 1e6:g} MB, the most that a {label} may have"
        raise InputError(f"{path}: is larger than {largest}; give a shorter one")
    return data


def read_text(path: Path | str, label: str, limit: int) -> str:
    """Return the contents of a file (`read_bytes`) as UTF-8 text, without byte order mark and with plain newlines."""
    data = read_bytes(path, label, limit)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        byte = f"byte 0x{data[error.start]:02x} in line {line}"
        raise InputError(f"{path}: cannot be read as UTF-8 text, {byte} is none; save it as UTF-8") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _checksum(meta: str, arrays: "dict[str, np.ndarray]") -> str:
    """Return the SHA-256 of a description and of arrays: names, types, shapes, bytes."""
    digest = hashlib.sha256(meta.encode())
    for name in sorted(arrays):
        digest.update(f"{name} {arrays[name].dtype.descr} {arrays[name].shape}".encode())
        digest.update(arrays[name].tobytes())
    return digest.hexdigest()


def write_npz(path: Path | str, meta: dict, arrays: "dict[str, np.ndarray]", compress: bool = False) -> None:
    """Write a description and arrays with their checksum, to a temporary file and rename."""
    import numpy as np

    text, write = json.dumps(meta, sort_keys=True), np.savez_compressed if compress else np.savez
    arrays = {name: np.asarray(array) for name, array in arrays.items()}
    with replacing(path) as temporary, temporary.open("wb") as file:
        write(file, meta=np.array(text), checksum=np.array(_checksum(text, arrays)), **arrays)


def read_npz(path: Path | str, label: str, limit: float, arrays: bool = True) -> "tuple[dict, dict[str, np.ndarray]]":
    """Return the description (``meta``, JSON) and the arrays of an npz file, or `InputError`; nothing is unpickled.

    The arrays, which are not read without ``arrays``, may take ``limit`` bytes, the description `LARGEST_META`.
    """
    import numpy as np  # not needed by commands that read text only

    path = plain_file(path, label)
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
            if archive.getinfo("meta.npy").file_size > LARGEST_META:
                raise ValueError
        if size <= limit:
            with np.load(path, allow_pickle=False) as data:
                meta, loaded = json.loads(text := str(data["meta"])), {}
                if arrays:
                    loaded = {name: data[name] for name in data.files if name not in ("meta", "checksum")}
                if not isinstance(meta, dict) or (arrays and str(data["checksum"]) != _checksum(text, loaded)):
                    raise ValueError
                return meta, loaded
    except Exception:  # any error of zip, JSON or the header of an array in a damaged file
        raise InputError(f"{path}: not a {label}, or damaged; give the path of a whole one") from None
    excess = f"takes {size / 1e6:.0f} MB of memory, more than the {limit / 1e6:.0f} MB available"
    raise InputError(f"{path}: {excess} for a {label}; use a shorter one")


def plain_file(path: Path | str, label: str) -> Path:
    """Return the path of a plain file; `InputError` if it is missing, a folder, a pipe or a device."""
    try:
        path = Path(path)
        mode = os.stat(path).st_mode
    except (TypeError, ValueError):  # no name at all; a name with a byte that no name has
        raise InputError(f"path = {path!r}: must be the name of a {label}") from None
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; give the path of an existing {label}") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give a {label} that you may read") from None
    if not stat.S_ISREG(mode):
        kind = "a folder" if stat.S_ISDIR(mode) else "a pipe or a device, not a file"
        raise InputError(f"{path}: is {kind}; give the path of a {label}")
    return path

"""Files of the user: read whole within a stated bound, or refused in one sentence. Nothing read is ever run."""

import json
import os
import stat
import zipfile
from pathlib import Path

import numpy as np

from trackdyn.errors import InputError

LARGEST_META = 10_000_000  # bytes; a recording's description takes 70,000


def read_bytes(path: Path | str, what: str, limit: int) -> bytes:
    """Contents of a plain file of at most ``limit`` bytes.

    Parameters
    ----------
    path : path-like
        File.
    what : str
        What a refusal asks for, such as "YAML file".
    limit : int
        Most bytes that are read, whatever the file system says of the size.

    Raises
    ------
    InputError
        There is no such file, it is a folder or a device, cannot be read, or is larger.
    """
    path = plain_file(path, what)
    try:
        with open(path, "rb") as file:
            data = file.read(limit + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give a {what} that you may read") from None
    if len(data) > limit:
        raise InputError(f"{path}: is larger than {limit / 1e6:g} MB, the most that a {what} may have; give a shorter one")
    return data


def read_text(path: Path | str, what: str, limit: int) -> str:
    """The same as text in UTF-8, with or without a byte order mark, its newlines plain.

    Raises
    ------
    InputError
        Also for the first byte that is no UTF-8.
    """
    data = read_bytes(path, what, limit)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise InputError(
            f"{path}: cannot be read as UTF-8 text, byte 0x{data[error.start]:02x} in line {line} is none; save it as UTF-8"
        ) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_npz(path: Path | str, what: str, limit: float, arrays: bool = True) -> tuple[dict, dict[str, np.ndarray]]:
    """Description (``meta``, JSON) and arrays of an npz file, whatever they are packed into; nothing is unpickled.

    Parameters
    ----------
    limit : float
        Most bytes that the arrays may take in memory; the description may take `LARGEST_META`.
    arrays : bool
        Read the arrays, too.

    Raises
    ------
    InputError
        The file is missing, larger, or holds anything but a description and arrays of numbers and text.
    """
    path = plain_file(path, what)
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
            if archive.getinfo("meta.npy").file_size > LARGEST_META:
                raise ValueError
        if size <= limit:
            with np.load(path, allow_pickle=False) as data:
                meta = json.loads(str(data["meta"]))
                if not isinstance(meta, dict):
                    raise ValueError
                return meta, {name: data[name] for name in data.files if arrays and name != "meta"}
    except Exception:  # whatever a damaged file makes of zip, of JSON, of the header of an array or its size
        raise InputError(f"{path}: is not a {what}, or is damaged; make it again") from None
    raise InputError(
        f"{path}: takes {size / 1e6:.0f} MB of memory, more than the {limit / 1e6:.0f} MB that a {what} may take here; a "
        "shorter one would do"
    )


def plain_file(path: Path | str, what: str) -> Path:
    """The path, if a plain file is there.

    Raises
    ------
    InputError
        Nothing is there, or a folder, a pipe or a device, which may never end.
    """
    try:
        path = Path(path)
        mode = os.stat(path).st_mode
    except (TypeError, ValueError):  # no name at all; a name with a byte that no name has
        raise InputError(f"path = {path!r} is not accepted: the name of a {what} would do") from None
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; give the path of an existing {what}") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give a {what} that you may read") from None
    if not stat.S_ISREG(mode):
        kind = "a folder" if stat.S_ISDIR(mode) else "no plain file but a pipe or a device"
        raise InputError(f"{path}: is {kind}; give the path of a {what}")
    return path

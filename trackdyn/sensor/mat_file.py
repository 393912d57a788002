"""MATLAB files, read in a process of their own: one wrong bit can end the process in which SciPy reads them."""

import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Literal

import numpy as np
import scipy  # its parts are loaded where they are used

_HEADER, _TAG = 128, 8  # bytes before the first variable, and before each
_PACKED = 15  # type of a variable that is packed by zlib


def unpacked_bytes(path: Path) -> int:
    """Bytes that the variables of a MAT 5 file take unpacked, by their tags; the size of a file of another kind."""
    total = size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_HEADER)
        order: Literal["big", "little"] = "big" if head[126:] == b"MI" else "little"
        if not head.startswith(b"MATLAB 5"):
            return size
        while len(tag := file.read(_TAG)) == _TAG:
            kind, count = (int.from_bytes(tag[k : k + 4], order) for k in (0, 4))
            begin = file.tell()
            if kind == _PACKED:
                inner = zlib.decompressobj().decompress(file.read(min(count, 100)), _TAG)
                total += int.from_bytes(inner[4:], order)
            if begin + count > size:
                break
            file.seek(begin + count)
    return total


def read_mat(path: Path) -> tuple[dict[str, np.ndarray], list[str]]:
    """Arrays of numbers of a MAT file by name, those of structures as ``structure.field``, and names of other content.

    Raises whatever SciPy raises, or `ValueError`: the process that reads the file was ended.
    """
    from joblib.externals.loky import ProcessPoolExecutor
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    # as set, no traceback of a fault stands on the screen
    pool = ProcessPoolExecutor(1, env={"PYTHONFAULTHANDLER": ""})
    try:
        return pool.submit(_arrays, path).result()
    except TerminatedWorkerError:
        raise ValueError("a wrong bit in it") from None
    finally:
        pool.shutdown(kill_workers=True)


def _arrays(path: Path) -> tuple[dict[str, np.ndarray], list[str]]:
    items = dict(_nested(scipy.io.loadmat(path, simplify_cells=True)))
    arrays = {name: np.asarray(item) for name, item in items.items() if not isinstance(item, list)}  # lists: of cells
    numbers = {name: values for name, values in arrays.items() if values.dtype.kind in "iuf"}
    return numbers, [name for name in items if name not in numbers]


def _nested(content: Mapping, above: str = "") -> Iterator[tuple[str, object]]:
    for name, item in content.items():
        if isinstance(item, Mapping):
            yield from _nested(item, f"{above}{name}.")
        elif above or not name.startswith("__"):
            yield f"{above}{name}", item

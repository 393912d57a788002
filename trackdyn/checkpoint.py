"""Nested tuples of arrays as a flat npz file and back: what a run needs to go on bit for bit."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from trackdyn.errors import InputError
from trackdyn.jit import source_hash


def flat(value: Any, name: str = "") -> dict[str, np.ndarray]:
    """Arrays and numbers of nested named tuples by dotted name; None has no entry."""
    if isinstance(value, tuple):
        found = {}
        for field in value._fields:
            found |= flat(getattr(value, field), f"{name}.{field}" if name else field)
        return found
    return {} if value is None else {name: np.asarray(value)}


def filled(room: Any, data: dict[str, np.ndarray], name: str = "") -> Any:
    """``room`` with the arrays written in place and the numbers replaced by those of ``data``; see `flat`."""
    if isinstance(room, tuple):
        fields = {field: filled(getattr(room, field), data, f"{name}.{field}" if name else field) for field in room._fields}
        return room._replace(**fields)
    if isinstance(room, np.ndarray):
        room[...] = data[name]
        return room
    return None if room is None else type(room)(data[name])


def write_checkpoint(path: Path | str, parts: dict[str, Any]) -> None:
    """Write named parts, tuples of arrays and plain data, beside the place and rename."""
    path = Path(path)
    plain = {name: part for name, part in parts.items() if not isinstance(part, tuple)}
    arrays = {}
    for name, part in parts.items():
        if isinstance(part, tuple):
            arrays |= flat(part, name)
    part = path.with_name(path.name + ".part")
    try:
        with part.open("wb") as file:
            np.savez(file, meta=np.array(json.dumps({"sources": source_hash(), "parts": plain})), **arrays)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def read_checkpoint(path: Path | str) -> dict[str, Any]:
    """Parts of a checkpoint: plain data as it was, tuples as what `filled` reads.

    Raises
    ------
    InputError
        There is no such checkpoint, it cannot be read, or other sources wrote it.
    """
    try:
        with np.load(path, allow_pickle=False) as data:
            meta = json.loads(str(data["meta"]))
            parts, sources = meta["parts"], meta["sources"]
            for key in data.files:
                if key != "meta":
                    part, _, name = key.partition(".")
                    parts.setdefault(part, {})[name] = data[key]
    except FileNotFoundError:
        raise InputError(f"{path}: no such checkpoint; start without it") from None
    except Exception:
        raise InputError(f"{path}: is not a checkpoint; remove it to start anew") from None
    if sources != source_hash():
        raise InputError(
            f"{path}: was written by sources {sources}, these are {source_hash()}, and would not go on as it began; remove it "
            "to start anew"
        )
    return parts

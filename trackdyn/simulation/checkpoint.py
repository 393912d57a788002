"""Nested tuples of arrays as a flat npz file and back: what a run needs to go on bit for bit."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from psutil import virtual_memory

from trackdyn.errors import InputError
from trackdyn.files import read_npz, write_npz
from trackdyn.parameters.validation import shown
from trackdyn.sources import source_hash


def flat(value: Any, name: str = "") -> dict[str, np.ndarray]:
    """Arrays and numbers of nested named tuples by dotted name; None has no entry."""
    leaves: dict[str, np.ndarray] = {}
    mapped(lambda name, leaf: leaves.update({name: np.asarray(leaf)}), value, name)
    return leaves


def filled(room: Any, data: dict[str, np.ndarray]) -> Any:
    """``room`` with the arrays written in place and the numbers replaced by those of ``data``; see `flat`."""

    def fill(name: str, leaf: Any) -> Any:
        if not isinstance(leaf, np.ndarray):
            return type(leaf)(data[name])
        if (leaf.shape, leaf.dtype) != (data[name].shape, data[name].dtype):
            raise ValueError(f"{name} has {data[name].dtype} of the shape {data[name].shape}, not {leaf.shape}")
        leaf[...] = data[name]
        return leaf

    return mapped(fill, room)


def mapped(function: Callable[[str, Any], Any], value: Any, name: str = "") -> Any:
    """Nested named tuples with ``function(name, leaf)`` instead of every array and number; see `flat`."""
    if hasattr(value, "_fields"):
        prefix = f"{name}." if name else ""
        return value._make(mapped(function, getattr(value, field), prefix + field) for field in value._fields)
    return None if value is None else function(name, value)


def write_checkpoint(path: Path | str, parts: dict[str, Any]) -> None:
    """Write named parts, arrays, tuples of arrays and plain data, to a temporary file and rename."""
    arrays: dict[str, Any] = {}
    plain = {name: content for name, content in parts.items() if not isinstance(content, (tuple, np.ndarray))}
    for name in parts.keys() - plain.keys():
        arrays |= flat(parts[name], name)
    write_npz(path, {"sources": source_hash(), "parts": plain}, arrays)


def read_checkpoint(path: Path | str) -> dict[str, Any]:
    """Parts of a checkpoint of these sources (else `InputError`): as they were, but tuples as `filled` reads them."""
    meta, arrays = read_npz(path, "checkpoint", virtual_memory().available / 2)
    if "format" in meta:  # not to be removed
        raise InputError(f"{path}: is a recording, not a checkpoint; name another file")
    sources, parts = meta.get("sources"), meta.get("parts", {})
    if sources != source_hash():
        raise InputError(
            f"{path}: was written by another version (sources {shown(sources)}, now {source_hash()}); "
            "remove it to start again"
        )
    for key, array in arrays.items():
        section, inside, name = key.partition(".")
        if inside:
            parts.setdefault(section, {})[name] = array
        else:
            parts[section] = array
    return parts

"""Nested tuples of arrays as a flat npz file and back: what a run needs to go on bit for bit."""

import json
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from psutil import virtual_memory

from trackdyn.errors import InputError
from trackdyn.files import read_npz, replacing
from trackdyn.parameters.validation import shown
from trackdyn.sources import source_hash


def flat(value: Any, name: str = "") -> dict[str, np.ndarray]:
    """Arrays and numbers of nested named tuples by dotted name; None has no entry."""
    found: dict[str, np.ndarray] = {}
    mapped(lambda name, leaf: found.update({name: np.asarray(leaf)}), value, name)
    return found


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
    """Nested named tuples with ``function(name, leaf)`` in the place of every array and number; see `flat`."""
    if hasattr(value, "_fields"):
        prefix = f"{name}." if name else ""
        return value._make(mapped(function, getattr(value, field), prefix + field) for field in value._fields)
    return None if value is None else function(name, value)


# what a model has of its own once it was steered, and once its wheels move on springs
STEERED = re.compile(r"drive\..*|carriers\.force")
CARRIED = re.compile(STEERED.pattern + r"|space\.centre|wheels\.[xy]|carriers\.(x|y|preload|low|high|weight)")
SAME = 1e-9  # of a number that a scene gives, here and on another machine


def refuse_other_model(room: Any, data: dict[str, np.ndarray]) -> None:
    """Raise `ValueError` if a model is not ``room``, that of its scene, but for what it has of its own."""
    own = CARRIED if len(room.carriers.wheel) else STEERED
    for name, array in flat(room).items():
        found = data[name]
        if found.shape != array.shape:
            raise ValueError(f"{name} has the shape {found.shape}, not {array.shape}")
        same = np.isclose(found, array, SAME, SAME**2)
        if not (same | np.isfinite(found) if own.fullmatch(name) else same).all():
            raise ValueError(f"{name} is not that of the scene")


def refuse_other_places(room: Any, data: dict[str, np.ndarray], but: tuple[str, ...] = ()) -> None:
    """Raise `ValueError` if integers differ from those of ``room``: kernels look up places by them, unchecked.

    Fields named in ``but`` are not asked.
    """
    for name, array in flat(room).items():
        if name.partition(".")[0] not in but and array.dtype.kind in "iub" and not np.array_equal(array, data[name]):
            raise ValueError(f"{name} is not that of the scene")


@contextmanager
def refusing_damage(path: Path | str) -> Iterator[None]:
    """What goes wrong within, while a checkpoint's data are put in place, ends in one sentence (`InputError`)."""
    try:
        yield
    except (KeyError, TypeError, ValueError, AttributeError, InputError):
        raise InputError(f"{path}: not a checkpoint, or damaged; remove it to start again") from None


def write_checkpoint(path: Path | str, parts: dict[str, Any]) -> None:
    """Write named parts, tuples of arrays and plain data, beside the place and rename."""
    plain = {name: part for name, part in parts.items() if not isinstance(part, tuple)}
    arrays: dict[str, Any] = {}
    for name, part in parts.items():
        if isinstance(part, tuple):
            arrays |= flat(part, name)
    meta = np.array(json.dumps({"sources": source_hash(), "parts": plain}))
    with replacing(path) as part, part.open("wb") as file:
        np.savez(file, meta=meta, **arrays)


def read_checkpoint(path: Path | str) -> dict[str, Any]:
    """Parts of a checkpoint of these sources (else `InputError`): plain data as it was, tuples as `filled` reads."""
    meta, arrays = read_npz(path, "checkpoint", virtual_memory().available / 2)
    parts: Any = meta.get("parts")
    if "format" in meta:  # not to be removed
        raise InputError(f"{path}: is a recording, not a checkpoint; name another file")
    sources = meta.get("sources")
    if sources != source_hash():
        raise InputError(
            f"{path}: was written by another version (sources {shown(sources)}, now {source_hash()}); "
            "remove it to start again"
        )
    with refusing_damage(path):
        for key, array in arrays.items():
            part, _, name = key.partition(".")
            parts.setdefault(part, {})[name] = array
    return parts

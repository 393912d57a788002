"""May kernels have these arrays? They look up places unchecked, so a wrong shape would read or write elsewhere."""

from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from trackdyn.errors import InputError
from trackdyn.integrate.methods import METHODS, equip
from trackdyn.model.constants import Model
from trackdyn.model.record import Record, make_record
from trackdyn.model.state import State
from trackdyn.model.work import Work
from trackdyn.parameters.validation import shown
from trackdyn.scene.limits import LEAST_STEP
from trackdyn.scene.scene import LONGEST_RUN, MOST_STEPS
from trackdyn.simulation.checkpoint import flat, mapped

# Largest value of a state in SI units, and how far from the origin a chain may be (m) or how fast (m/s): further out
# rounding is no longer small beside the depth of a contact.
LARGEST, FARTHEST = 1e12, 1e6
# parts that may be replaced while a loop runs, with checks of their own; integers that look up nothing, or have bounds
REPLACED = ("stages", "implicit")
CHOICES = ("stride", "present", "compliant", "prescribed", "body")


class Parts(NamedTuple):
    """What kernels read and write."""

    model: Model
    state: State
    work: Work


def fault_of_form(given: Any, own: Any, name: str) -> str | None:
    """Where nested tuples have other types, shapes or kinds of numbers than ``own``, as a sentence; or None."""
    if own is None:
        return None if given is None else f"{name}: must be None"
    if isinstance(own, (int, float, np.integer)):
        kinds = (int, np.integer, float) if isinstance(own, float) else (int, np.integer)
        return None if isinstance(given, kinds) and _number(given) else f"{name} = {shown(given)}: must be a number"
    if type(given) is not type(own):
        what = "an array" if isinstance(own, np.ndarray) else f"a {type(own).__name__}"
        return f"{name} = {shown(given)}: must be {what}"
    if isinstance(own, np.ndarray):
        if given.shape == own.shape and given.dtype == own.dtype and given.flags.carray:
            return None
        found = "" if given.flags.carray else " that is read-only or not contiguous"
        return (
            f"{name} has {given.dtype} of the shape {shown(given.shape)}{found}; it must be "
            f"{own.dtype} of the shape {own.shape}, changed in place"
        )
    for field, part, inner in zip(own._fields, given, own, strict=True):
        if field not in REPLACED and (fault := fault_of_form(part, inner, f"{name}.{field}")):
            return fault
    return None


def _number(value: Any) -> bool:
    """Whether a kernel can take it as a number that is one."""
    if isinstance(value, (int, np.integer)):
        return not isinstance(value, bool) and bool(-(2**63) < value < 2**63)
    return bool(-1e308 < value < 1e308 or value == np.inf)


def _fault_of_method(state: State, work: Work) -> str | None:
    """Arrays of another integrator may take the place of the scene's."""
    for name in METHODS:
        other = equip(work, name, len(state.wheel_impact), branches=len(state.branch))
        if not (fault_of_form(work.stages, other.stages, "") or fault_of_form(work.implicit, other.implicit, "")):
            return None
    return "loop.work.stages: must be what integrate.methods.equip makes for an integrator"


def numbers(array: np.ndarray) -> np.ndarray:
    """The numbers of an array, of one with fields, too."""
    return array.view(float) if array.dtype.names else array


def limits_of(parts: Parts) -> dict[str, tuple]:
    """Least and largest value by dotted name: of numbers of the state, and of integers by which kernels look up places,
    which in a model must be what they are.
    """
    model, found = parts.model, {}
    for name, array in flat(parts).items():
        field = name.rpartition(".")[2]
        if name.startswith("state."):
            most = np.full(numbers(array).shape, FARTHEST if field == "pin" else LARGEST)
            found[name] = -most, most
        elif name.startswith("model.") and array.dtype.kind in "iu" and field not in CHOICES:
            found[name] = array.copy(), array.copy()
    ranges = {
        "state.steps": (0, int(LARGEST)), "work.near.groove": (0, model.tooth.teeth),
        "work.tooth_area": (0, len(model.tooth.radius)), "model.sensor.body": (0, len(model.chain.length) - 1),
        "model.step": (LEAST_STEP, LONGEST_RUN), "model.stride": (1, MOST_STEPS),
    }  # fmt: skip
    for name, bounds in ranges.items():
        array = np.asarray(attrgetter(name)(parts))
        low, high = bounds
        found[name] = np.full_like(array, low), np.full_like(array, high)
    return found


def fault_of_range(parts: Parts, limits: dict[str, tuple]) -> str | None:
    """Which number is none or out of its `limits_of`, as a sentence; None if all are in range."""
    for name, (low, high) in limits.items():
        value = numbers(np.asarray(attrgetter(name)(parts)))
        wrong = ~((low <= value) & (value <= high))
        if wrong.any():
            fixed, found = (low == high).all(), f"loop.{name} {'holds' if value.ndim else '='} {value[wrong][0]:g}"
            what = "what the scene made of it" if fixed else f"between {low.flat[0]:g} and {high.flat[0]:g}"
            return f"{found}: must be {what}"
    return None


def refuse_other(given: Parts, own: Parts, limits: dict[str, tuple]) -> None:
    """Refuse (`InputError`) parts that kernels cannot take in the place of ``own``."""
    fault = fault_of_form(given, own, "loop") or _fault_of_method(*given[1:])
    if fault := fault or fault_of_range(given, limits):
        raise InputError(fault)


def copied(parts: Parts, limits: dict[str, tuple]) -> tuple[Parts, tuple[np.ndarray, ...]]:
    """Copies of parts, and what `integrate.run.in_range` takes to see whether they are still within their limits.

    Of the numbers that have limits, and of the integers, all are views of one array.
    """
    arrays, joined = {name: np.array(array) for name, array in flat(parts).items()}, []
    for kind in "fi":
        names = [name for name in limits if arrays[name].ndim and numbers(arrays[name]).dtype.kind == kind]
        columns = [numbers(arrays[name]) for name in names], *([limits[name][k] for name in names] for k in range(2))
        joined += [np.concatenate([array.ravel() for array in column]) for column in columns]
        ends = np.cumsum([array.size for array in columns[0]])[:-1]
        for name, part in zip(names, np.split(joined[-3], ends), strict=True):
            arrays[name] = part.view(arrays[name].dtype).reshape(arrays[name].shape)

    def own(name: str, leaf: Any) -> Any:
        if name.startswith("model.drive.") and name != "model.drive.motor.prescribed":
            return float(leaf)  # of one kind, however the drive is steered
        return arrays[name] if isinstance(leaf, np.ndarray) else leaf

    return mapped(own, parts), tuple(joined)


def refuse_other_record(record: Record, state: State, work: Work, first: int, last: int) -> None:
    """Refuse (`InputError`) a record that is not one of this loop's, or rows that it does not have."""
    fault = _fault_of_record(record, state, work)
    if fault is None and not 0 <= first <= last <= len(record.gap):
        fault = f"rows {first} to {last}: must be rising and between 0 and {len(record.gap)}"
    if fault is None and record.frame_stride and -(-last // record.frame_stride) > len(record.frame):
        fault = f"frame has {len(record.frame)} rows: must have one every {record.frame_stride} samples"
    if fault:
        raise InputError(f"record: {fault}")


def _fault_of_record(record: Any, state: State, work: Work) -> str | None:
    if not isinstance(record, Record) or not isinstance(record.pitches, np.ndarray) or record.pitches.dtype != np.int64:
        return "must be one that `room` makes"
    loop = len(state.wheel_impact)
    if record.pitches.ndim != 1 or not ((record.pitches >= 0) & (record.pitches < loop)).all():
        return f"pitches: must be between 0 and {loop - 1}"
    try:
        links, sliding = record.link_mean.shape[1], record.sliding.shape[1]
        sizes = len(record.gap), len(record.frame), len(record.spells.rows)
    except (AttributeError, TypeError, IndexError):
        return "must be one that `room` makes"
    if links not in (0, loop) or sliding not in (0, 0 if work.sliding is None else len(work.sliding)):
        return "links or sliding are not those of the loop; must be one that `room` makes"
    empty = make_record(0, state, record.pitches + 1, 0, int(record.frame_stride), 0, links, sliding)

    def rows(name: str, leaf: Any) -> Any:
        """An array with the rows of the record, which take no memory."""
        if name == "pitches" or not isinstance(leaf, np.ndarray) or leaf.shape[0]:
            return leaf
        size = sizes[1] if name == "frame" else sizes[2] if name == "spells.rows" else sizes[0]
        return np.broadcast_to(np.zeros((), leaf.dtype), (size, *leaf.shape[1:]))

    return fault_of_form(record, mapped(rows, empty), "record")

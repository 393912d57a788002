"""May kernels have these arrays? They look up places unchecked, so a wrong shape would read or write elsewhere."""

from collections.abc import Iterator
from operator import attrgetter
from typing import Any

import numpy as np

from trackdyn.errors import DivergenceError, InputError
from trackdyn.integrate.methods import METHODS, equip
from trackdyn.model.constants import Drive, Model, Motor, Ripple
from trackdyn.model.record import Record, make_record
from trackdyn.model.state import State
from trackdyn.model.work import Work
from trackdyn.parameters.validation import shown
from trackdyn.scene.limits import LEAST_STEP
from trackdyn.scene.scene import LONGEST, MOST_STEPS

# Largest value of a state in SI units, and how far from the origin a chain may be (m) or how fast (m/s): further out
# rounding is no longer small beside the depth of a contact.
LARGEST, FARTHEST = 1e12, 1e6
# parts of a model that may be steered while a loop runs: numbers, or nothing where there was something
STEERED = ("drive",)
COUNTS = ("stride", "present", "compliant")  # integers that choose and look up nothing


def form(value: Any) -> Any:
    """What must stay of nested tuples of arrays: their types, shapes, kinds of numbers and layouts in memory."""
    if isinstance(value, tuple):
        return type(value), tuple(form(part) for part in value)
    if isinstance(value, np.ndarray):
        return type(value), value.shape, value.dtype, value.flags.carray
    return None if value is None else int if isinstance(value, (int, np.integer)) else float


def _parts(value: Any) -> tuple:
    return tuple(zip(value._fields, value, strict=True))


def fault_of_form(value: Any, wanted: Any, name: str) -> str | None:
    """Where ``value`` is not of a `form`, as a sentence; None if it is."""
    if wanted is None:
        return None if value is None else f"{name}: must be None"
    if wanted in (int, float):
        kinds = (int, np.integer) if wanted is int else float
        return None if _number(value) and isinstance(value, kinds) else f"{name} = {shown(value)}: must be a number"
    if type(value) is not wanted[0]:
        what = "an array" if wanted[0] is np.ndarray else f"a {wanted[0].__name__}"
        return f"{name} = {shown(value)}: must be {what}"
    if wanted[0] is np.ndarray:
        _, shape, dtype, plain = wanted
        if value.shape == shape and value.dtype == dtype and value.flags.carray >= plain:
            return None
        found = "" if value.flags.carray else " that is read-only or not contiguous"
        return (
            f"{name} has {value.dtype} of the shape {shown(value.shape)}{found}; it must be "
            f"{dtype} of the shape {shape}, changed in place"
        )
    for (field, part), inner in zip(_parts(value), wanted[1], strict=True):
        if field not in STEERED and (fault := fault_of_form(part, inner, f"{name}.{field}")):
            return fault
    return None


def _number(value: Any) -> bool:
    """Whether a kernel can take it as a number that is one."""
    if isinstance(value, (int, np.integer)):
        return not isinstance(value, bool) and bool(-(2**63) < value < 2**63)
    return isinstance(value, (float, np.float64)) and bool(-1e308 < value < 1e308 or value == np.inf)


def _looked_up(value: Any, name: str = "") -> list[str]:
    """Dotted names of the integers of a model by which kernels look up places."""
    found = []
    for field, part in _parts(value):
        if isinstance(part, tuple):
            found += _looked_up(part, f"{name}{field}.")
        elif field not in COUNTS and (
            isinstance(part, int) or (isinstance(part, np.ndarray) and part.dtype.kind in "iu")
        ):
            found.append(name + field)
    return found


def _leaves(value: tuple) -> Iterator[np.ndarray]:
    for part in value:
        if isinstance(part, tuple):
            yield from _leaves(part)
        elif isinstance(part, np.ndarray):
            yield part


def _look(array: np.ndarray) -> tuple:
    return array.shape, array.dtype, array.flags.carray


def _content(value: Any) -> Any:
    return value.tobytes() if isinstance(value, np.ndarray) else value


class Door:
    """What model, state and work of a loop were when it was made, to be compared before kernels see them."""

    def __init__(self, model: Model, state: State, work: Work):
        self.plain = work._replace(stages=None, implicit=None)
        self.forms = form((model, state, self.plain))[1]
        self.pitches, self.method = len(state.tooth_impact) // 2, form((work.stages, work.implicit))
        self.branches = 0 if state.branch is None else len(state.branch)
        self.names = [name for name in _looked_up(model) if name != "sensor.body"]  # a sensor may be put elsewhere
        self.places = [_content(attrgetter(name)(model)) for name in self.names]
        self._passed: tuple[Model, State, Work] | None = None
        self._arrays: list[np.ndarray] = []
        self._looks: list[tuple] = []

    def refuse(self, model: Model, state: State, work: Work) -> None:
        """Refuse what kernels cannot take.

        Raises
        ------
        InputError
            Which array or number, and what it must be.
        """
        fault = self._fault_of_forms(model, state, work) or self._fault_of_places(model, work) or fault_of_state(state)
        if fault:
            raise InputError(f"loop.{fault}")

    def _fault_of_forms(self, model: Model, state: State, work: Work) -> str | None:
        parts = model, state, work
        # the tuples of the last call hold the same arrays as then; only these may have been changed in place
        same = self._passed is not None and all(one is other for one, other in zip(parts, self._passed, strict=True))
        if same and [_look(array) for array in self._arrays] == self._looks:
            return None
        # arrays of another integrator may have taken the place of the scene's
        plain = work._replace(stages=None, implicit=None) if type(work) is Work else work
        for name, part, one in zip(("model", "state", "work"), (model, state, plain), self.forms, strict=True):
            if fault := fault_of_form(part, one, name):
                return fault
        if fault := self._fault_of_method(work):
            return fault
        if fault := _fault_of_drive(model):
            return fault
        self._passed, self._arrays = parts, list(_leaves(parts))
        self._looks = [_look(array) for array in self._arrays]
        return None

    def _fault_of_method(self, work: Work) -> str | None:
        given = form((work.stages, work.implicit))
        if given == self.method:
            return None
        for name in METHODS:
            other = equip(self.plain, name, self.pitches, branches=self.branches)
            if given == form((other.stages, other.implicit)):
                return None
        return "work.stages: must be what integrate.methods.equip makes for an integrator"

    def _fault_of_places(self, model: Model, work: Work) -> str | None:
        for name, place in zip(self.names, self.places, strict=True):
            if _content(attrgetter(name)(model)) != place:
                return f"model.{name}: must be what the scene made of it"
        bodies = len(model.chain.length)
        if not 0 <= model.sensor.body < bodies:
            return f"model.sensor.body = {model.sensor.body!r}: must be a body, 0 to {bodies - 1}"
        if not LEAST_STEP <= model.step <= LONGEST:
            return f"model.step = {model.step!r} s: must be between {LEAST_STEP:g} and {LONGEST:g}"
        if not (isinstance(model.stride, (int, np.integer)) and 1 <= model.stride <= MOST_STEPS):
            return f"model.stride = {model.stride!r}: must be a whole number between 1 and {MOST_STEPS:g}"
        for name, array, most in (
            ("near.groove", work.near.groove, model.tooth.teeth),
            ("tooth_area", work.tooth_area, len(model.tooth.radius)),
        ):
            if not 0 <= array.min() <= array.max() <= most:
                return f"work.{name}: must be between 0 and {most}"
        return None


def _fault_of_drive(model: Model) -> str | None:
    """What is no number in a drive, which may be steered: ripple and motor may be there or not."""
    drive = model.drive
    for name, part, kind in (
        ("drive", drive, Drive),
        ("drive.ripple", getattr(drive, "ripple", None), Ripple),
        ("drive.motor", getattr(drive, "motor", None), Motor),
    ):
        if part is None and kind is not Drive:
            continue
        if type(part) is not kind:
            return f"model.{name} = {shown(part)}: must be a {kind.__name__}"
        for field, value in _parts(part):
            if field not in ("ripple", "motor") and not _number(value):
                return f"model.{name}.{field} = {shown(value)}: must be a number"
    return None


def fault_of_state(state: State) -> str | None:
    """Which number of a state is none, or larger than any that a track has; None if all are in range."""
    if not 0 <= state.steps[0] < LARGEST:
        return f"state.steps = {state.steps[0]}: must be at least 0"
    with np.errstate(over="ignore", invalid="ignore"):
        for name, array in (*_parts(state), *(_parts(state.plane) if state.plane is not None else ())):
            if isinstance(array, np.ndarray):
                most = FARTHEST if name == "pin" else LARGEST
                every = array.reshape(-1)
                if not every.dot(every) <= most * most:  # all of them in one call
                    worst = np.abs(every).max()
                    return f"state.{name} holds {worst:g}: must be a number of at most {most:g}"
    return None


def refuse_diverged(state: State, step: float) -> None:
    """Refuse the result of a call.

    Raises
    ------
    DivergenceError
        A number of the state is none, or out of any range.
    """
    if fault := fault_of_state(state):
        raise DivergenceError(
            f"the run left the physical range before t = {state.steps[0] * step:.6g} s: "
            f"{fault.partition(':')[0]}; use a smaller step or a milder rig"
        )


def refuse_other_record(record: Record, state: State, work: Work, first: int, last: int) -> None:
    """Refuse a record that is not one of this loop's, or rows that it does not have.

    Raises
    ------
    InputError
        Which array, and what it must be.
    """
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
    return fault_of_form(record, _with_rows(form(empty), sizes), "record")


def _with_rows(empty: Any, sizes: tuple[int, int, int]) -> Any:
    """The form of a record with ``sizes`` rows of samples, frames and spells, from that of one without."""

    def rows(part, name=""):
        if isinstance(part, tuple) and isinstance(part[1], tuple) and part[0] is not np.ndarray:
            return part[0], tuple(rows(inner, field) for field, inner in zip(part[0]._fields, part[1], strict=True))
        if isinstance(part, tuple) and part[1][:1] == (0,) and name != "pitches":
            size = sizes[1] if name == "frame" else sizes[2] if name == "rows" else sizes[0]
            return part[0], (size, *part[1][1:]), part[2], part[3]
        return part

    return rows(empty)

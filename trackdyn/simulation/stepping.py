"""What kernels read and write, what a user may set of it, and the forces in the joints."""

from typing import Any, NamedTuple

import numpy as np

from trackdyn.errors import DivergenceError, InputError
from trackdyn.model.constants import Model
from trackdyn.model.record import make_record
from trackdyn.model.state import State
from trackdyn.model.work import Work
from trackdyn.parameters.validation import shown
from trackdyn.simulation.checkpoint import flat, mapped

# Largest value of a state in SI units, and how far from the origin a chain may be (m) or how fast (m/s): further out
# rounding is no longer small beside the depth of a contact.
LARGEST, FARTHEST = 1e12, 1e6


class Parts(NamedTuple):
    """What kernels read and write."""

    model: Model
    state: State
    work: Work


def refuse_divergence(body: int, model: Model, state: State, phase: str = "the run") -> None:
    """Refuse (`DivergenceError`) a run that ended at a body (-1: none): when, in which phase, which body."""
    if body >= 0:
        single_pin = len(state.angle) == len(state.wheel_impact)
        name = f"pitch {body + 1}" if single_pin else f"{'connector' if body % 2 else 'link'} {body // 2 + 1}"
        raise DivergenceError(
            f"the run left the physical range at t = {state.steps[0] * model.step:.6g} s of {phase}, first at "
            f"{name}; "
            f"use a step smaller than {model.step:g} s, or check the rig"
        )


def copied(parts: Parts) -> Parts:
    """The same with copies of all arrays."""
    return mapped(lambda _, leaf: leaf.copy() if isinstance(leaf, np.ndarray) else leaf, parts)


def read_only(parts: Parts) -> Parts:
    """The same with read-only views of all arrays."""

    def view(_: str, leaf: Any) -> Any:
        if isinstance(leaf, np.ndarray):
            leaf = leaf.view()
            leaf.flags.writeable = False
        return leaf

    return mapped(view, parts)


def set_arrays(state: State, values: dict[str, Any]) -> None:
    """Write values into arrays of a state by their dotted names; all, or none if one of them is refused (`InputError`).

    A value must be finite, at most ``LARGEST``, and ``FARTHEST`` for the position and velocity of the pin.
    """
    arrays, checked = flat(state), {}
    for name, value in values.items():
        if name not in arrays:
            raise InputError(f"state: {shown(name)} is none of its arrays, {', '.join(arrays)}")
        array, most = arrays[name], FARTHEST if name == "pin" else LARGEST
        try:
            wanted = np.asarray(value).astype(array.dtype, casting="same_kind")
        except (TypeError, ValueError):
            wanted = np.asarray(None)
        if wanted.shape != array.shape or wanted.dtype != array.dtype:
            raise InputError(f"state.{name} = {shown(value)}: must be {array.dtype} of the shape {array.shape}")
        numbers = wanted.view(float) if array.dtype.names else wanted
        low = 0 if name == "steps" else -most
        if (wrong := ~((low <= numbers) & (numbers <= most))).any():
            raise InputError(f"state.{name} holds {numbers[wrong][0]:g}: must be between {low:g} and {most:g}")
        checked[name] = wanted
    for name, wanted in checked.items():
        arrays[name][...] = wanted


def check_record(record: Any, state: State, work: Work, first: int, last: int) -> None:
    """Refuse (`InputError`) a record that is not one of this loop's, or rows that it does not have."""
    loop, sliding = len(state.wheel_impact), 0 if work.sliding is None else len(work.sliding)

    def form(_: str, leaf: Any) -> tuple:
        array = np.asarray(leaf)
        return type(leaf), array.shape, array.dtype, array.flags.carray

    try:
        pitches, links, entries = record.pitches, record.link_mean.shape[1], record.sliding.shape[1]
        rows, frames, stride = len(record.gap), len(record.frame), int(record.frame_stride)
        like = make_record(rows, state, pitches + 1, frames, stride, len(record.spells.rows), links, entries)
        same_form = mapped(form, record) == mapped(form, like) and links in (0, loop) and entries in (0, sliding)
        same_form = same_form and bool(((pitches >= 0) & (pitches < loop)).all())
    except (AttributeError, IndexError, TypeError, ValueError):
        same_form = False
    if not same_form:
        raise InputError("record: must be one that `room` of this loop makes")
    if not 0 <= first <= last <= rows:
        raise InputError(f"record: rows {first} to {last}: must be rising and between 0 and {rows}")
    if stride and -(-last // stride) > frames:
        raise InputError(f"record: frame has {frames} rows: must have one every {stride} samples")


def joint_forces(model: Model, state: State, work: Work) -> np.ndarray:
    """(n, 2) force of body i on body i + 1 through the joint between them at the last step, N (`Loop.joint_forces`)."""
    chain, sweep = model.chain, work.sweep
    alpha, acceleration = sweep.response @ sweep.load, sweep.base @ sweep.load
    rate2 = state.rate**2
    arm = np.column_stack(
        [chain.com_x * work.cos - chain.com_y * work.sin, chain.com_x * work.sin + chain.com_y * work.cos]
    )
    across = chain.length[:, None] * np.column_stack([work.cos, work.sin])

    def relative(r: np.ndarray) -> np.ndarray:
        return alpha[:, None] * np.column_stack([-r[:, 1], r[:, 0]]) - rate2[:, None] * r

    pins = acceleration + np.vstack([np.zeros(2), np.cumsum(relative(across), axis=0)[:-1]])
    outer = np.column_stack([work.force_x, work.force_y - chain.mass * chain.gravity])
    passed = outer - chain.mass[:, None] * (pins + relative(arm))
    return np.asarray(sweep.load[:2]) + np.cumsum(passed, axis=0)

"""Nested tuples of arrays that kernels read and write: made for a scene, viewed, set by users."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from trackdyn.integrate.methods import METHODS
from trackdyn.model.arrays import OptionalWork, Plane, State, Work, make_arrays
from trackdyn.model.constants import Model
from trackdyn.rig.layout import tensioner, wheel_circles
from trackdyn.rig.rig import Rig
from trackdyn.scene.build import make_carriers, wheel_centres
from trackdyn.scene.scene import Scene


def flat(value: Any, name: str = "") -> dict[str, np.ndarray]:
    """Arrays and numbers of nested named tuples by dotted name; None has no entry."""
    leaves: dict[str, np.ndarray] = {}
    mapped(lambda name, leaf: leaves.update({name: np.asarray(leaf)}), value, name)
    return leaves


def mapped(function: Callable[[str, Any], Any], value: Any, name: str = "") -> Any:
    """Nested named tuples with ``function(name, leaf)`` instead of every array and number; see `flat`."""
    if hasattr(value, "_fields"):
        prefix = f"{name}." if name else ""
        return value._make(mapped(function, getattr(value, field), prefix + field) for field in value._fields)
    return None if value is None else function(name, value)


class LoopArrays(NamedTuple):
    """Arguments of a kernel: constants, motion, and everything computed from them."""

    model: Model
    state: State
    work: Work
    optional: OptionalWork = OptionalWork()


def read_only(arrays: LoopArrays) -> LoopArrays:
    """Read-only views of a loop's arrays."""

    def view(_: str, leaf: Any) -> Any:
        if isinstance(leaf, np.ndarray):
            leaf = leaf.view()
            leaf.flags.writeable = False
        return leaf

    return mapped(view, arrays)


def allocate(scene: Scene, step: float) -> LoopArrays:
    """Arrays of a scene with a step (s), every one of the state and the work 0."""
    model = copy_wheels(scene.model_of_step(step))
    model = model._replace(carriers=make_carriers(scene.rig, model, scene.tension, 0.0))
    state, work, optional = make_arrays(model, METHODS[scene.integrator])
    if model.space is not None:
        state = state._replace(plane=Plane(np.zeros(4), np.zeros(4)))
    return LoopArrays(model, state, work, optional)


def shift_tensioner(model: Model, rig: Rig, shift: float) -> None:
    """Put the tensioning wheel of a model at ``shift`` (m) along its line, in place."""
    wheel = tensioner(rig)
    model.wheels.x[wheel], model.wheels.y[wheel] = wheel_circles(rig, shift)[wheel, :2]
    if model.space is not None:
        move_wheels(model, wheel_centres(rig, model.wheels))


def move_wheels(model: Model, centres: np.ndarray) -> None:
    """Put the wheels of a model at their (w, 3) centres, m, in place."""
    model.wheels.x[:], model.wheels.y[:] = centres[:, 0], centres[:, 1]
    if model.space is not None:
        model.space.centre[:] = np.einsum("wji,wj->wi", model.space.frame, centres)


def copy_wheels(model: Model) -> Model:
    """The model with wheels that may be moved and a ring that may grow: copies of what a scene keeps."""
    wheels = model.wheels
    wheels = wheels._replace(**{name: getattr(wheels, name).copy() for name in ("present", "x", "y", "radius")})
    space = model.space
    return model._replace(wheels=wheels, space=space and space._replace(centre=space.centre.copy()))

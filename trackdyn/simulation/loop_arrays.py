"""Nested tuples of arrays that kernels read and write: allocation, views, and the positions of wheels."""

from typing import Any, NamedTuple

import numpy as np

from trackdyn.integrate.methods import METHODS
from trackdyn.model.arrays import OptionalWork, Plane, State, Work, make_arrays
from trackdyn.model.constants import Model
from trackdyn.rig.layout import tensioner, wheel_circles
from trackdyn.rig.rig import Rig
from trackdyn.scene.build import make_suspensions, wheel_centres
from trackdyn.scene.scene import Scene


def flatten(tree: Any, name: str = "") -> dict[str, np.ndarray]:
    """Return the leaves of nested named tuples, arrays and numbers, by dotted name; None is no leaf."""
    if hasattr(tree, "_fields"):
        branches = (flatten(branch, f"{name}.{field}".lstrip(".")) for field, branch in tree._asdict().items())
        return {key: leaf for branch in branches for key, leaf in branch.items()}
    return {} if tree is None else {name: np.asarray(tree)}


class LoopArrays(NamedTuple):
    """Arguments of a kernel: constants, motion, and the arrays computed from both."""

    model: Model
    state: State
    work: Work
    optional: OptionalWork = OptionalWork()


def read_only(tree: Any) -> Any:
    """Return nested named tuples with read-only views of their arrays."""
    if hasattr(tree, "_fields"):
        return tree._make(map(read_only, tree))
    if isinstance(tree, np.ndarray):
        tree = tree.view()
        tree.setflags(write=False)
    return tree


def allocate(scene: Scene, step: float) -> LoopArrays:
    """Allocate the arrays of a scene with a step (s), state and work filled with zeros."""
    model = copy_wheels(scene.model_of_step(step))
    model = model._replace(suspensions=make_suspensions(scene.rig, model, scene.tension, 0.0))
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
    """Return a model whose wheels and ring can change: copies of the arrays that scenes share."""
    wheels, space = model.wheels, model.space
    wheels = wheels._replace(**{name: getattr(wheels, name).copy() for name in ("present", "x", "y", "radius")})
    return model._replace(wheels=wheels, space=space and space._replace(centre=space.centre.copy()))

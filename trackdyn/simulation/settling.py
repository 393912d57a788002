"""Where a run begins: the loop laid on its wheels, tensioned and at rest, or a free loop that spins."""

import copy
import json
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from trackdyn.errors import DivergenceError, InputError
from trackdyn.integrate.methods import equip
from trackdyn.model.arrays import Plane, State, Work, make_space_work, make_state, make_work
from trackdyn.model.constants import SPROCKET, Model
from trackdyn.parameters.layout import check_overlap, free_loop
from trackdyn.scene.build import CARRIED, check_stops, make_carriers, shift_wheel, start_plane
from trackdyn.scene.limits import elastic_depth
from trackdyn.scene.scene import RECORD_FIELDS, Scene
from trackdyn.simulation.tensioning import (
    LEAST_STEP,
    SLACK,
    TAUT,
    Restless,
    Settling,
    arc_depths,
    own_wheels,
    refuse_tension,
    settling_step,
    start_state,
)

# A loop that does not come to rest is settled anew with half the step, so many times.
HALVINGS = 2
# The weight of the chain and so many times the tension on a single arc: more than any load at rest.
MOST_LOAD = 4.0
# What a scene asks for that a loop at rest does not know yet.
LATER = ("motor_rpm", *RECORD_FIELDS)


class Start(NamedTuple):
    """A loop that is ready to run: the sprocket at rest, the energy balance at zero."""

    scene: Scene  # with the step that the tension of the loop allows
    model: Model
    state: State
    work: Work
    # shift of the tensioning wheel (m), tension as it was set and as the loop stands (N); of a free loop nothing
    layout: dict[str, float]


def settle(scene: Scene, loops: "SettledLoops | None" = None) -> Start:
    """Lay, tension and settle the loop of a scene.

    The tension is set to 1 % at rest with the rig's own ring (or without one, if the rig has none), and the wheel then
    locked. Every other ring starts from there, as the paper's wheels stay where they are.

    Parameters
    ----------
    scene : Scene
    loops : SettledLoops or None
        Loops that were settled before: the same bytes, sooner.

    Returns
    -------
    Start

    Raises
    ------
    InputError
        The tension cannot be set, the loop does not come to rest, or the step is too large for its tension.
    """
    if scene.loop == "free":
        return _spinning_loop(scene)
    return _start(scene, loops.at_rest(scene) if loops else _rested(scene, lambda finer: _tensioned(scene, finer)))


def tension_words(scene: Scene, layout: dict[str, float]) -> str:
    """Say at which tension (N) a loop stands, which was wanted, and what lies between: a ring, or a carrier."""
    wanted, settled = scene.rig.tension.pre_tension, layout["settled_tension_n"]
    words = f"{settled:.4g} N in the strand onto the sprocket, pre_tension {wanted:.4g} N"
    if abs(settled - wanted) > 0.01 * wanted:
        radius = scene.rig.ring_radius
        ring = "without a ring" if radius is None else f"with the ring of {radius:.4g} m"
        words += f": set to {layout['tension_n']:.4g} N {ring}, changed by "
        words += "another ring" if scene.ring_radius != radius else f"the tensioner, which is {scene.tension}"
    return words


class SettledLoops:
    """The last ``kept`` settled loops, for a series of scenes; every scene gets the bytes that it would get alone.

    Settling takes most of the time of a short scene. The speed and all that concerns the record matter only
    afterwards, and the ring only in the last quarter of it.
    """

    def __init__(self, kept: int = 8):
        self.kept = kept
        self._tensioned: dict[str, Settling] = {}
        self._settled: dict[str, Settling] = {}

    def at_rest(self, scene: Scene) -> "Settling":
        """The loop of a scene at rest; it may be used up."""
        # the step of the settling heeds the step limits, and they the speed and the ring
        known = {name: value for name, value in scene.describe().items() if name not in LATER}
        known["settling_step"] = settling_step(scene, scene.rig.tension.pre_tension)
        ring = known.pop("ring_radius")
        common = json.dumps(known, sort_keys=True)

        def tensioned(finer: int) -> Settling:
            return self._copy(self._tensioned, f"{finer} {common}", lambda: _tensioned(scene, finer))

        return self._copy(self._settled, f"{ring!r} {common}", lambda: _rested(scene, tensioned))

    def _copy(self, stored: dict[str, "Settling"], key: str, make: "Callable[[], Settling]") -> "Settling":
        settling = stored.pop(key) if key in stored else make()
        stored[key] = settling  # the last one used is the last to go
        if len(stored) > self.kept:
            del stored[next(iter(stored))]
        return copy.deepcopy(settling)


def allocate(scene: Scene) -> tuple[Model, State, Work]:
    """Model, state and work of a scene, every array of the state and the work 0."""
    model, pitches = own_wheels(scene.model), scene.rig.chain.pitches
    n, wheels = scene.bodies, len(model.wheels.x)
    if scene.loop == "on_wheels":
        model = model._replace(carriers=make_carriers(scene.rig, model, scene.tension, 0.0))
    state = make_state(n, pitches, wheels, len(model.carriers.wheel), len(model.branches.time))
    work = equipped(scene, make_work(n, pitches, wheels))
    if model.space is not None:
        state = state._replace(plane=Plane(np.zeros(4), np.zeros(4)))
        work = work._replace(space=make_space_work(n, wheels))
    return model, state, with_sliding(scene, model, work)


def equipped(scene: Scene, work: Work) -> Work:
    """Work with the arrays of the scene's integrator."""
    return equip(work, scene.integrator, scene.rig.chain.pitches, len(scene.model.branches.time))


def with_sliding(scene: Scene, model: Model, work: Work) -> Work:
    """Work with room for the account of sliding where the scene asks for it."""
    entries = len(model.tooth.radius) + len(model.wheels.x)
    return work._replace(sliding=np.zeros(entries)) if scene.sliding else work


def _tensioned(scene: Scene, finer: int) -> Settling:
    """First stage of settling: the loop tensioned on the rig's ring, whatever that of the scene."""
    settling = Settling(scene, finer)
    if settling.target > SLACK * settling.hanging:
        try:
            settling.tauten()
            if settling.trim():
                return settling
            if settling.reached < settling.target:
                refuse_tension(settling)
        except (DivergenceError, Restless):
            if settling.target > TAUT * settling.hanging:
                raise
    settling = Settling(scene, finer, taut=True)
    settling.let_out()
    if not settling.trim():
        refuse_tension(settling)
    return settling


def _rested(scene: Scene, tensioned: Callable[[int], Settling]) -> Settling:
    """The loop at rest with the scene's ring; with half the step, or less, if it does not come to rest."""
    step = settling_step(scene, scene.rig.tension.pre_tension, scene.step)
    for halving in range(HALVINGS + 1):
        try:
            settling = tensioned(2**halving)
            settling.scene = scene
            if scene.tension in CARRIED:
                settling.release()
            if scene.ring_radius != settling.reference:
                settling.change_ring(scene.ring_radius)
                if scene.tension != "retensioned":
                    settling.rest(0.2)
                elif not settling.trim():
                    refuse_tension(settling)
            settling.come_to_rest()
            return settling
        except (DivergenceError, Restless):
            if halving == HALVINGS or step / 2 ** (halving + 1) < LEAST_STEP:
                raise
    raise AssertionError


def _start(scene: Scene, settling: Settling) -> Start:
    """A settled loop as the scene runs it."""
    rig, tension = scene.rig, settling.tension()
    layout = {
        "tensioner_shift_m": float(settling.shift), "tension_n": settling.reached, "settled_tension_n": tension,
    }  # fmt: skip
    scene = scene.at_tension(tension)
    model = own_wheels(scene.model)
    shift_wheel(model, rig, settling.wheel, settling.shift)
    for name in ("x", "y"):
        getattr(model.wheels, name)[:] = getattr(settling.model.wheels, name)
    carriers = settling.model.carriers
    if len(carriers.force):
        carriers = carriers._replace(force=np.array(rig.tension.force, dtype=float))
    model = model._replace(carriers=carriers)
    state = settling.state
    if len(state.slide):
        check_stops(rig, carriers, state.slide)
        if scene.tension in CARRIED:
            layout |= {"tensioner_slide_m": float(state.slide["q"][carriers.tensioner])}
        for name in ("rate", "rate_before", "along_x", "along_y"):
            state.slide[name] = 0.0
    check_overlap(rig, np.column_stack([model.wheels.x, model.wheels.y]))
    state.steps[0] = 0
    settling.scale_rates(0.0)
    state.work_done[:] = 0.0
    check_meshing(scene, model, state, settling.work)
    work = equipped(scene, settling.work)
    if model.space is not None:
        state = state._replace(plane=start_plane(rig, model, state))
        work = work._replace(space=make_space_work(len(state.angle), len(model.wheels.x)))
    return Start(scene, model, state, work, layout)


def _spinning_loop(scene: Scene) -> Start:
    """An oblong loop without wheels that spins with the rate of the sprocket and is otherwise at rest."""
    model = scene.model
    assembly = free_loop(model.chain.length)
    state = start_state(assembly, model)
    spin = scene.sprocket_rate
    state.rate[:] = spin
    state.pin[2:] = [-spin * state.pin[1], spin * state.pin[0]]
    work = make_work(len(state.angle), scene.rig.chain.pitches, len(model.wheels.x))
    return Start(scene, model, state, equipped(scene, work), {})


def explained_depth(model: Model, tension: float) -> float:
    """Depth that elastic contact of a tooth can have at rest, m: that of ``MOST_LOAD`` times the tension on one arc."""
    tooth = model.tooth
    load = MOST_LOAD * (tension + model.chain.gravity * float(model.chain.mass.sum()))
    widest = float(tooth.radius.max()) + tooth.arc_radius
    return elastic_depth(tooth.law, load, widest)


def check_meshing(scene: Scene, model: Model, state: State, work: Work) -> None:
    """Refuse (`InputError`) a loop that would start with an arc deeper in a tooth than its load explains."""
    if not model.tooth.present:
        return
    depth = float(arc_depths(scene, model, state, work, float(state.wheel_angle[SPROCKET])).max())
    if depth > explained_depth(model, scene.rig.tension.pre_tension):
        raise InputError(
            f"the chain does not mesh with the sprocket of this rig: at rest an arc lies {1e3 * depth:.3g} mm inside a "
            "tooth; bring sprocket.equal_pitch_radius, groove.seat_depth and ring_radius nearer to each other"
        )

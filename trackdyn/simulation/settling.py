"""Settling: lay the loop on its wheels, tension it and bring it to rest.

The chain is tensioned at rest with the rig's own ring (`initial_tension`). A sprung tensioner is released, and the ring
changes to that of the scene; the tension is set again if the scene requires it. If the loop does not come to rest,
settling is repeated with half the step.
"""

import copy
import hashlib
import json
import pickle
import zlib
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from importlib.metadata import version
from math import nan
from typing import NamedTuple

import numpy as np

from trackdyn.inputs.errors import DivergenceError
from trackdyn.integrate.methods import METHODS
from trackdyn.jit import keep_current, kept_folder
from trackdyn.model.arrays import Plane, State, make_optional
from trackdyn.model.constants import SPROCKET
from trackdyn.rig.layout import check_overlap, tensioner
from trackdyn.scene.build import check_stops, wheel_centres
from trackdyn.scene.scene import RECORD_FIELDS, Scene
from trackdyn.scene.step import LEAST_SETTLING_STEP, allowed_step, first_that_runs, settling_step
from trackdyn.simulation.initial_tension import NotSettledError, TensionedLoop, tensioned
from trackdyn.simulation.loop_arrays import LoopArrays, copy_wheels, flatten, move_wheels
from trackdyn.sources import edited, kept, module_files, module_hash

HALVINGS = 2  # of the step of a loop that does not come to rest
MOST_STORED = 500  # settled loops that later processes reuse, the last ones, of 30 kB each
IRRELEVANT = ("motor_rpm", "load", *RECORD_FIELDS)  # fields of a scene on which a loop at rest does not depend


class Layout(NamedTuple):
    """Layout of a settled loop; NaN where a quantity does not apply."""

    tensioner_shift_m: float = nan  # of the tensioning wheel along its line, m
    tension_n: float = nan  # as it was set with the rig's own ring, N
    settled_tension_n: float = nan  # as the loop settled, N
    tensioner_slide_m: float = nan  # of a sprung tensioner from there, m
    path_m: float = nan  # length of a belt, m

    def known(self) -> dict[str, float]:
        """Return the numbers that apply, by name."""
        return {name: value for name, value in self._asdict().items() if value == value}


class Start(NamedTuple):
    """Arrays and layout of a settled loop: the sprocket at rest, the energy balance at zero."""

    arrays: LoopArrays  # the model with the step that the tension of the loop allows
    layout: Layout


def settle(scene: Scene, loops: "SettledLoops | None" = None) -> Start:
    """Lay, tension and settle the loop of a scene, or copy it from ``loops``, which is faster and gives the same bytes.

    The tension is set to 1 % at rest with the rig's own ring, if any, and the wheel then locked. Other rings keep this
    position, as the paper's wheels do. Raises `InputError`: the tension cannot be set, the loop does not come to rest
    or mesh, or the step is too large for its tension.
    """
    # a brake would hold the strands' tensions apart; it acts where wheels turn
    settled = (loops or SettledLoops(capacity=0)).at_rest(scene.with_(load=0.0) if scene.load else scene)
    rig, tension = scene.rig, settled.tension()
    step = allowed_step(scene, scene.time_step, tension)
    suspensions, state, slide = settled.model.suspensions, settled.state, nan
    check_stops(rig, suspensions, state.suspension)
    if scene.tension == "sprung":
        slide = float(state.suspension["q"][suspensions.of_wheel[tensioner(rig)]])
    state.suspension[["rate", "rate_before", "along_x", "along_y"]] = 0.0
    layout = Layout(float(settled.shift), settled.reached, tension, slide)
    centres = wheel_centres(rig, settled.model.wheels)
    check_overlap(rig, centres[:, :2])
    settled.scale_rates(0.0)
    state.steps[0] = 0
    state.work_done[:] = 0.0
    if scene.model.space is not None:
        state = state._replace(plane=start_plane(centres, state))
    model = copy_wheels(scene.model_of_step(step))._replace(suspensions=suspensions)
    move_wheels(model, centres)
    return Start(LoopArrays(model, state, settled.work, make_optional(model, METHODS[scene.integrator])), layout)


def tension_summary(scene: Scene, layout: Layout) -> str:
    """Return the tension of a loop (N) as text, and that with the rig's own ring if the two differ."""
    target, settled = scene.rig.tension.pre_tension, layout.settled_tension_n
    own = f": set to {layout.tension_n:.4g} N with the rig's own ring" if abs(settled - target) > 0.01 * target else ""
    return f"{settled:.4g} N in the strand onto the sprocket, pre_tension {target:.4g} N{own}"


class SettledLoops:
    """Cache of the last ``capacity`` settled loops, for a series of scenes; results are the same bytes as without.

    Settling does not depend on the speed and the recording options, and on the ring only in its last quarter.
    """

    def __init__(self, capacity: int = 8):
        self.capacity = capacity
        self._tensioned, self._settled = dict[str, TensionedLoop](), dict[str, TensionedLoop]()

    def at_rest(self, scene: Scene) -> TensionedLoop:
        """Return the loop of a scene at rest, which the caller may change; see `HALVINGS` and, for errors, `settle`."""
        # the step of the settling depends on the step limits, and these on the speed and the ring
        settings = {name: value for name, value in scene.describe().items() if name not in IRRELEVANT}
        settings |= {"step": scene.time_step, "settling_step": settling_step(scene, scene.rig.tension.pre_tension)}
        ring = settings.pop("ring_radius")
        common = json.dumps(settings, sort_keys=True)

        def rested(divisor: float) -> TensionedLoop:
            loop = self._copy(self._tensioned, f"{divisor} {common}", lambda: tensioned(scene, divisor))
            loop.scene = scene
            if scene.tension == "sprung":
                loop.release_suspensions()
            if scene.ring_radius != loop.reference:
                loop.change_ring(scene.ring_radius)
                if scene.tension != "retensioned":
                    loop.rest(0.2)
                elif not loop.set_tension():
                    raise loop.refusal()
            loop.come_to_rest()
            loop.check_meshing()
            return loop

        step = settling_step(scene, scene.rig.tension.pre_tension, scene.time_step)
        divisors = [1.0, *(2.0**k for k in range(1, HALVINGS + 1) if step / 2**k >= LEAST_SETTLING_STEP)]
        run, key = partial(first_that_runs, divisors, rested, (DivergenceError, NotSettledError)), f"{ring!r} {common}"
        loop = self._copy(self._settled, key, lambda: _stored(scene, key, run))
        loop.scene = scene
        return loop

    def _copy(self, stored: dict[str, TensionedLoop], key: str, make: Callable[[], TensionedLoop]) -> TensionedLoop:
        loop = stored.pop(key) if key in stored else make()
        if not self.capacity:
            return loop
        stored[key] = loop  # the least recently used one is removed first
        if len(stored) > self.capacity:
            del stored[next(iter(stored))]
        return copy.deepcopy(loop)


def _stored(scene: Scene, key: str, make: Callable[[], TensionedLoop]) -> TensionedLoop:
    """Return the settled loop of a key from the folder of compiled kernels, or make and store it there."""
    folder = kept_folder()
    if folder is None or edited(module_files(__name__)):
        return make()
    # the numbers of the model, too: a registered name may have another meaning in another process
    numbers = flatten(scene.model).items()
    content = [value.tobytes() for name, value in numbers if not name.startswith(("drive.", "sensors."))]
    content += [repr(METHODS[scene.integrator]).encode(), module_hash(__name__).encode(), key.encode()]
    content += [version(name).encode() for name in ("numpy", "scipy")]
    file = folder / "settled" / f"{hashlib.sha256(b'|'.join(content)).hexdigest()[:24]}.loop"
    with suppress(Exception):  # unpickling may raise anything; a missing file is an EOFError
        return pickle.loads(zlib.decompress(kept(file) or b""))
    loop = make()
    keep_current(file, zlib.compress(pickle.dumps(loop), 1))
    with suppress(OSError):  # another process removes them, too
        for old in sorted(file.parent.glob("*.loop"), key=lambda file: file.stat().st_mtime)[:-MOST_STORED]:
            old.unlink()
    return loop


def start_plane(centres: np.ndarray, state: State) -> Plane:
    """Return the plane through the (w, 3) centres of the wheels (m), at rest, and move the loop of ``state`` into it.

    Without axial offsets it is exactly the plane of the planar model. Otherwise the smallest rotation turns that plane
    into this one, and the loop is shifted in it so that it keeps its position on the sprocket.
    """
    motion, attitude = np.zeros(4), np.array([1.0, 0.0, 0.0, 0.0])
    if not centres[:, 2].any():
        return Plane(motion, attitude)
    sides = np.column_stack([np.ones(len(centres)), centres[:, :2]])
    z0, slope_x, slope_y = np.linalg.lstsq(sides, centres[:, 2], rcond=None)[0]
    normal = np.array([-slope_x, -slope_y, 1.0]) / np.sqrt(1.0 + slope_x**2 + slope_y**2)
    # from e_z to the normal: Euler parameters (1 + e_z . n, e_z x n), normalised
    attitude[:] = np.array([1.0 + normal[2], -normal[1], normal[0], 0.0]) / np.sqrt(2.0 * (1.0 + normal[2]))
    motion[0] = z0 * normal[2]
    # A_P^T R of the sprocket's centre; rows of A_P^T for a turn about an axis in the plane
    h, k = normal, 1.0 / (1.0 + normal[2])
    x_axis = np.array([1.0 - k * h[0] ** 2, -k * h[0] * h[1], -h[0]])
    y_axis = np.array([-k * h[0] * h[1], 1.0 - k * h[1] ** 2, -h[1]])
    state.pin[:2] += [x_axis @ centres[SPROCKET], y_axis @ centres[SPROCKET]] - centres[SPROCKET, :2]
    return Plane(motion, attitude)

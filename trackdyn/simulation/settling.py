"""Where a run begins: the loop laid on its wheels, tensioned and at rest.

1. The chain is laid on its wheels and tensioned at rest, with the rig's own ring (`initial_tension`).
2. Wheels on carriers are released, and the ring changes to that of the scene; the tension is set again where the scene
   asks for it.
3. The loop comes to rest (`rest_state`). If it does not, all begins anew with half the step.
4. The scene's own model gets the wheels and carriers where they stand, every rate and the energy balance become zero.
"""

import copy
import hashlib
import json
import pickle
import zlib
from collections.abc import Callable
from contextlib import suppress
from importlib.metadata import version
from math import nan
from pathlib import Path
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
from trackdyn.simulation.initial_tension import TensionedLoop, tensioned
from trackdyn.simulation.loop_arrays import LoopArrays, copy_wheels, flat, move_wheels
from trackdyn.simulation.rest_state import Restless
from trackdyn.sources import edited, kept, module_files, module_hash

# A loop that does not come to rest is settled anew with half the step, so many times.
HALVINGS = 2
# Settled loops that are kept from process to process, the last ones, of 30 kB each.
MOST_KEPT = 500
# Fields of a scene on which a loop at rest does not depend.
LATER = ("motor_rpm", "load", *RECORD_FIELDS)


class Layout(NamedTuple):
    """How a loop is laid; NaN is what its chain or its tensioner does not have."""

    tensioner_shift_m: float = nan  # of the tensioning wheel along its line, m
    tension_n: float = nan  # as it was set with the rig's own ring, N
    settled_tension_n: float = nan  # as the loop settled, N
    tensioner_slide_m: float = nan  # of a sprung tensioner from there, m
    path_m: float = nan  # length of a belt, m

    def known(self) -> dict[str, float]:
        """Those of its numbers that there are, by name."""
        return {name: value for name, value in self._asdict().items() if value == value}


class Start(NamedTuple):
    """A loop that is ready to run: the sprocket at rest, the energy balance at zero."""

    arrays: LoopArrays  # the model with the step that the tension of the loop allows
    layout: Layout


def settle(scene: Scene, loops: "SettledLoops | None" = None) -> Start:
    """Lay, tension and settle the loop of a scene; or copy it from ``loops``: the same bytes, sooner.

    The tension is set to 1 % at rest with the rig's own ring (or without one, if the rig has none), and the wheel then
    locked. Every other ring starts from there, as the paper's wheels stay where they are. Raises `InputError`: the
    tension cannot be set, the loop does not come to rest, or the step is too large for its tension.
    """
    # a brake would hold the strands' tensions apart; it acts where wheels turn
    settled = (loops or SettledLoops(capacity=0)).at_rest(scene.with_(load=0.0) if scene.load else scene)
    rig, tension = scene.rig, settled.tension()
    step = allowed_step(scene, scene.time_step, tension)
    layout = Layout(float(settled.shift), settled.reached, tension)
    carriers, state = settled.model.carriers, settled.state
    if len(state.slide):
        check_stops(rig, carriers, state.slide)
        if scene.tension == "sprung":
            layout = layout._replace(tensioner_slide_m=float(state.slide["q"][carriers.of_wheel[tensioner(rig)]]))
        for name in ("rate", "rate_before", "along_x", "along_y"):
            state.slide[name] = 0.0
    centres = wheel_centres(rig, settled.model.wheels)
    check_overlap(rig, centres[:, :2])
    settled.scale_rates(0.0)
    state.steps[0] = 0
    state.work_done[:] = 0.0
    if scene.model.space is not None:
        state = state._replace(plane=start_plane(centres, state))
    model = copy_wheels(scene.model_of_step(step))._replace(carriers=carriers)
    move_wheels(model, centres)
    return Start(LoopArrays(model, state, settled.work, make_optional(model, METHODS[scene.integrator])), layout)


def tension_words(scene: Scene, layout: Layout) -> str:
    """Say at which tension (N) a loop stands, and with the rig's own ring, where another one or a spring changed it."""
    target, settled = scene.rig.tension.pre_tension, layout.settled_tension_n
    own = f": set to {layout.tension_n:.4g} N with the rig's own ring" if abs(settled - target) > 0.01 * target else ""
    return f"{settled:.4g} N in the strand onto the sprocket, pre_tension {target:.4g} N{own}"


class SettledLoops:
    """The last ``capacity`` settled loops, for a series of scenes; every scene gets the bytes that it would get alone.

    Settling takes most of the time of a short scene. The speed and all that concerns the record matter only
    afterwards, and the ring only in the last quarter of it.
    """

    def __init__(self, capacity: int = 8):
        self.capacity = capacity
        self._tensioned: dict[str, TensionedLoop] = {}
        self._settled: dict[str, TensionedLoop] = {}

    def at_rest(self, scene: Scene) -> TensionedLoop:
        """The loop of a scene at rest, with half the step, or less, if it does not come to rest; it may be used up.

        Raises `InputError`: the tension cannot be set, or the loop does not come to rest or mesh.
        """
        # the step of the settling heeds the step limits, and they the speed and the ring
        settings = {name: value for name, value in scene.describe().items() if name not in LATER}
        settings |= {"step": scene.time_step, "settling_step": settling_step(scene, scene.rig.tension.pre_tension)}
        ring = settings.pop("ring_radius")
        common = json.dumps(settings, sort_keys=True)

        def rested(divisor: float) -> TensionedLoop:
            loop = self._copy(self._tensioned, f"{divisor} {common}", lambda: tensioned(scene, divisor))
            loop.scene = scene
            if scene.tension == "sprung":
                loop.release_carriers()
            if scene.ring_radius != loop.reference:
                loop.change_ring(scene.ring_radius)
                if scene.tension != "retensioned":
                    loop.rest(0.2)
                elif not loop.set_tension():
                    raise loop.refusal()
            loop.come_to_rest()
            loop.check_meshing()
            return loop

        def first_rested() -> TensionedLoop:
            step = settling_step(scene, scene.rig.tension.pre_tension, scene.time_step)
            finer = [2.0**k for k in range(1, HALVINGS + 1) if step / 2**k >= LEAST_SETTLING_STEP]
            return first_that_runs([1.0, *finer], rested, (DivergenceError, Restless))

        key = f"{ring!r} {common}"
        loop = self._copy(self._settled, key, lambda: _kept(scene, key, first_rested))
        loop.scene = scene
        return loop

    def _copy(self, stored: dict[str, TensionedLoop], key: str, make: Callable[[], TensionedLoop]) -> TensionedLoop:
        loop = stored.pop(key) if key in stored else make()
        if not self.capacity:
            return loop
        stored[key] = loop  # the last one used is the last to go
        if len(stored) > self.capacity:
            del stored[next(iter(stored))]
        return copy.deepcopy(loop)


def _kept(scene: Scene, key: str, make: Callable[[], TensionedLoop]) -> TensionedLoop:
    """The settled loop of a key as an earlier process left it beside the compiled kernels, or made, and left there."""
    folder = kept_folder()
    if folder is None or edited(module_files(__name__)):
        return make()
    # beside the settings the numbers of the model: what a name of a registry stands for may come from outside
    numbers = flat(scene.model).items()
    content = [value.tobytes() for name, value in numbers if not name.startswith(("drive.", "sensors."))]
    content += [repr(METHODS[scene.integrator]).encode(), module_hash(__name__).encode(), key.encode()]
    content += [version(name).encode() for name in ("numpy", "scipy")]
    file = folder / "settled" / f"{hashlib.sha256(b'|'.join(content)).hexdigest()[:24]}.loop"
    with suppress(Exception):  # whatever unpickling makes of it; no file is an EOFError
        return pickle.loads(zlib.decompress(kept(file) or b""))
    loop = make()
    keep_current(file, zlib.compress(pickle.dumps(loop), 1))
    _remove_oldest(file.parent)
    return loop


def _remove_oldest(folder: Path) -> None:
    """Leave the last `MOST_KEPT` files of a folder."""
    with suppress(OSError):  # another process removes them, too
        for file in sorted(folder.glob("*.loop"), key=lambda file: file.stat().st_mtime)[:-MOST_KEPT]:
            file.unlink()


def start_plane(centres: np.ndarray, state: State) -> Plane:
    """The plane through the (w, 3) centres of the wheels (m), at rest; the loop is laid into it in ``state``.

    Without axial offsets that is the plane of the planar model, exactly. The least turn takes one
    plane to the other, and the loop is shifted in it so that it stays where it was on the sprocket.
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
    state.pin[0] += x_axis @ centres[SPROCKET] - centres[SPROCKET, 0]
    state.pin[1] += y_axis @ centres[SPROCKET] - centres[SPROCKET, 1]
    return Plane(motion, attitude)

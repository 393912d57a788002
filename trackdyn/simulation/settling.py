"""Where a run begins: the loop laid on its wheels, tensioned and at rest, or a free loop that spins.

A laid loop comes to rest in damped chunks, its tensioning wheel moved until the strand onto the sprocket has the wanted
tension.
"""

import copy
import json
from collections.abc import Callable
from math import inf, pi
from typing import NamedTuple

import numpy as np

from trackdyn.errors import DivergenceError, InputError
from trackdyn.integrate.methods import METHODS
from trackdyn.integrate.run import check_range, run
from trackdyn.model.arrays import (
    SLIDE,
    Plane,
    State,
    Work,
    equip,
    make_arrays,
    make_record,
    make_space_work,
)
from trackdyn.model.constants import SPROCKET, Drive, Model
from trackdyn.rig.groove import depths_on_sprocket
from trackdyn.rig.layout import (
    Assembly,
    assemble,
    belt_around,
    check_overlap,
    free_loop,
    tensioner,
    travel_range,
    wheel_circles,
)
from trackdyn.rig.rig import Rig
from trackdyn.scene.build import CARRIED, check_stops, make_carriers, preloads, start_plane, wheel_centres
from trackdyn.scene.limits import elastic_depth, largest_step
from trackdyn.scene.scene import RECORD_FIELDS, Scene
from trackdyn.scene.step import allowed_step, round_step

# Settling: a chunk of this many seconds, then every velocity is multiplied by the factor.
CHUNK = 1e-3
# Step of the settling: that of the scene if it is shorter.
SETTLING_STEP = 1e-4
LEAST_STEP = 2e-6
DAMPING = 0.985
# The tensioner closes the gap to the wanted tension with this time constant, s: slower than the strands swing out.
TENSIONER_TIME = 0.15
# Of the wanted tension, by how much it may be missed at rest (1 % is promised), and secant steps to come there.
REACHED, ROUNDS = 0.0075, 12
# At rest, the mean tension of two periods (s) of `EVENED` differs by at most the share `EVEN`; the longest rest, s.
EVENED, EVEN, LONGEST_REST = 0.1, 0.0025, 4.0
# Longest wait for bodies that still swing when the strands have evened out, s.
LONGEST_SWING = 2.0
# A body at rest turns by at most so much, rad/s (shipped rigs: 0.03), and is accelerated from one step to the next by
# at most this share of the tension (shipped rigs: 0.0005; a loop that chatters: 1).
SLOW, BALANCED = 0.1, 0.02
# Compliance of the contacts of one loop on its wheels, m/N: bounds the stiffness of a taut loop.
CONTACT_COMPLIANCE = 1e-6
# Taut, a strand has this many times the weight that hangs below it; with less than the second number it is let out.
TAUT, SLACK = 10.0, 1.5
# A taut chain is let out until the tension has fallen by this share, at most an eighth of the travel at once.
FALL = 0.15
# A loop that does not come to rest is settled anew with half the step, so many times.
HALVINGS = 2
# The weight of the chain and so many times the tension on a single arc: more than any load at rest.
MOST_LOAD = 4.0
# What a scene asks for that a loop at rest does not know yet.
LATER = ("motor_rpm", *RECORD_FIELDS)


class Start(NamedTuple):
    """A loop that is ready to run: the sprocket at rest, the energy balance at zero."""

    model: Model  # with the step that the tension of the loop allows
    state: State
    work: Work
    # shift of the tensioning wheel (m), tension as it was set and as the loop stands (N); of a free loop nothing
    layout: dict[str, float]


def settle(scene: Scene, loops: "SettledLoops | None" = None) -> Start:
    """Lay, tension and settle the loop of a scene; or copy it from ``loops``: the same bytes, sooner.

    The tension is set to 1 % at rest with the rig's own ring (or without one, if the rig has none), and the wheel then
    locked. Every other ring starts from there, as the paper's wheels stay where they are. Raises `InputError`: the
    tension cannot be set, the loop does not come to rest, or the step is too large for its tension.
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
        settings = {name: value for name, value in scene.describe().items() if name not in LATER}
        settings |= {"step": scene.time_step, "settling_step": settling_step(scene, scene.rig.tension.pre_tension)}
        ring = settings.pop("ring_radius")
        common = json.dumps(settings, sort_keys=True)

        def tensioned(finer: int) -> Settling:
            return self._copy(self._tensioned, f"{finer} {common}", lambda: _tensioned(scene, finer))

        return self._copy(self._settled, f"{ring!r} {common}", lambda: _rested(scene, tensioned))

    def _copy(self, stored: dict[str, "Settling"], key: str, make: "Callable[[], Settling]") -> "Settling":
        settling = stored.pop(key) if key in stored else make()
        stored[key] = settling  # the last one used is the last to go
        if len(stored) > self.kept:
            del stored[next(iter(stored))]
        return copy.deepcopy(settling)


def _tensioned(scene: Scene, finer: int) -> "Settling":
    """First stage of settling: the loop tensioned on the rig's ring, whatever that of the scene."""
    settling = Settling(scene, finer)
    if settling.target > SLACK * settling.hanging:
        try:
            settling.tauten()
            if settling.trim():
                return settling
            if settling.reached < settling.target:
                raise tension_refusal(settling)
        except (DivergenceError, Restless):
            if settling.target > TAUT * settling.hanging:
                raise
    settling = Settling(scene, finer, taut=True)
    settling.let_out()
    if not settling.trim():
        raise tension_refusal(settling)
    return settling


def _rested(scene: Scene, tensioned: "Callable[[int], Settling]") -> "Settling":
    """The loop at rest with the scene's ring; with half the step, or less, if it does not come to rest."""
    step = settling_step(scene, scene.rig.tension.pre_tension, scene.time_step)
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
                    raise tension_refusal(settling)
            settling.come_to_rest()
            return settling
        except (DivergenceError, Restless):
            if halving == HALVINGS or step / 2 ** (halving + 1) < LEAST_STEP:
                raise
    raise AssertionError


def _start(scene: Scene, settling: "Settling") -> Start:
    """A settled loop as the scene runs it."""
    rig, tension = scene.rig, settling.tension()
    layout = {
        "tensioner_shift_m": float(settling.shift), "tension_n": settling.reached, "settled_tension_n": tension,
    }  # fmt: skip
    model = copy_wheels(scene.model_of_step(allowed_step(scene, scene.time_step, tension)))
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
    check_meshing(scene, model, settling.work, float(state.wheel_angle[SPROCKET]))
    if model.space is not None:
        state = state._replace(plane=start_plane(rig, model, state))
    return Start(model, state, equipped(scene, model, settling.work), layout)


def _spinning_loop(scene: Scene) -> Start:
    """An oblong loop without wheels that spins with the rate of the sprocket and is otherwise at rest."""
    model, spin = scene.model, scene.sprocket_rate
    assembly = free_loop(model.chain.length)
    state, work = make_arrays(model)
    lay_state(state, assembly)
    state.rate[:] = spin
    state.pin[2:] = [-spin * state.pin[1], spin * state.pin[0]]
    return Start(model, state, equipped(scene, model, work), {})


class Settling:
    """Brings the assembled loop to rest at the wanted tension and ring radius, in chunks.

    ``taut``: it is first tensioned by much more than the weight that hangs below the strand, whatever is wanted.
    """

    def __init__(self, scene: Scene, finer: int = 1, taut: bool = False):
        self.scene = scene
        rig = scene.rig
        length = scene.model.chain.length
        assembly = assemble(rig, length)
        self.shift, self.lever = assembly.shift, assembly.lever
        self.low, self.high = travel_range(rig, self.shift)
        self.wheel = tensioner(rig)
        # the ring with which the tension is set, m; without teeth a chain needs one
        self.reference = rig.ring_radius if scene.model.tooth.present else rig.sprocket.ring_radius
        # tension at rest (N), what the wheel moves for it over `_way` (shipped rigs), largest rate (rad/s)
        self.reached, self.yields, self.swing = 0.0, 1.6, 0.0
        # of a slack strand the compliance says too much: no shift of a chunk is longer than a tenth of a body
        self.most = 0.1 * float(length.max())
        path, _ = belt_around(rig, self.shift, float(length[0]))
        chain = scene.model.chain
        weight = chain.gravity * chain.mass.sum() / chain.length.sum()
        # what the strand with the cut joint carries at least: from its middle down to the lowest point of the loop
        self.hanging = weight * float(assembly.pins[0, 1] - assembly.pins[:, 1].min())
        self.target = TAUT * self.hanging if taut else rig.tension.pre_tension
        # a strand of span l and weight w a metre shortens its chord by w^2 l^3 / (24 T^2)
        spans = np.diff(path.start)[1::2]
        self.sag = weight**2 * float((spans**3).sum()) / 24
        # at rest in the plane, with the reference ring and the step of the settling
        step = settling_step(scene, self.target, inf if taut else scene.time_step) / finer
        model = copy_wheels(scene.model)
        model.wheels.present[SPROCKET] = 1
        model.wheels.radius[SPROCKET] = rig.sprocket.ring_radius
        # at rest rolling resistance would keep the strands' tensions apart for seconds
        model = model._replace(wheels=model.wheels._replace(rolling=np.zeros_like(model.wheels.rolling)))
        self.model = model._replace(
            drive=Drive(0.0, scene.ramp), step=step, stride=max(round(CHUNK / step), 1), space=None,
            tooth=model.tooth._replace(present=0),
        )  # fmt: skip
        shift_wheel(self.model, rig, self.wheel, self.shift)
        self.state, work = make_arrays(self.model)
        linearly = METHODS[scene.integrator].linearly_implicit
        self.work = equip(work, METHODS["linearly_implicit" if linearly else "semi_implicit"])
        lay_state(self.state, assembly)
        self.record = make_record(1, self.state)
        # a ring that touches no link, m
        self.bare = Scene.ring_range(rig)[0] - rig.chain.link_thickness

    def tension(self) -> float:
        """Tension of the chain at the cut joint, in the middle of the last strand, N."""
        return float(np.hypot(*self.work.sweep.load[:2]))

    def chunk(self) -> None:
        """March one chunk, and damp the rates at its end."""
        self._integrate(self.model)
        self.scale_rates(DAMPING)

    def _integrate(self, model: Model) -> None:
        check_range(run(model, self.state, self.work, self.record, 0, 1), model, self.state, "settling")

    def scale_rates(self, by: float) -> None:
        """Multiply every rate by a factor."""
        state = self.state
        state.rate[:] *= by
        state.pin[2:] *= by
        state.wheel_rate[:] *= by
        for name in ("rate", "rate_before"):
            state.slide[name] *= by

    def release(self) -> None:
        """Let wheels on carriers go, on springs that hold the chain as it lies unless the rig says how hard."""
        rig = self.scene.rig
        carriers = make_carriers(rig, self.model, self.scene.tension, self.shift)
        rest = np.zeros(len(carriers.wheel))
        carriers = carriers._replace(force=carriers.force[:1].copy())  # as when the run starts, however long this takes
        self.model = self.model._replace(carriers=carriers._replace(preload=preloads(rig, carriers, self.work, rest)))
        self.state = self.state._replace(slide=np.zeros(len(rest), SLIDE))
        self.rest(0.4)

    def _way(self, tension: float) -> float:
        """Shift of the wheel (m) that makes a tension (N), but for a constant."""
        tension = max(tension, 0.1 * self.target, 0.1 * self.hanging, 1e-6)
        return (CONTACT_COMPLIANCE * tension - self.sag / tension**2) / self.lever

    def tighten(self, seconds: float) -> None:
        """Move the tensioning wheel towards the wanted tension."""
        mean = self.tension() or self.target
        for _ in range(round(seconds / CHUNK)):
            mean += 0.1 * (self.tension() - mean)
            tension = max(mean, 0.1 * self.target, 50.0)
            compliance = 2 * self.sag / tension**3 + CONTACT_COMPLIANCE
            self._move((self.target - mean) * compliance / self.lever * CHUNK / TENSIONER_TIME)

    def _move(self, by: float) -> float:
        """Shift the tensioning wheel within its travel (m), take a chunk, and return by how much it moved."""
        before = self.shift
        self.shift = min(max(before + min(max(by, -self.most), self.most), self.low), self.high)
        shift_wheel(self.model, self.scene.rig, self.wheel, self.shift)
        self.chunk()
        return self.shift - before

    def moved(self, by: float) -> float:
        """Shift the tensioning wheel in small steps, m; by how much it went."""
        chunks = round(0.5 * EVENED / CHUNK)
        return sum(self._move(by / chunks) for _ in range(chunks))

    def evened(self) -> float:
        """Mean tension of strands that have evened out, N. Raises as `come_to_rest`: they do not."""
        mean = inf
        for _ in range(round(LONGEST_REST / EVENED)):
            loads = []
            for _ in range(round(EVENED / CHUNK)):
                self.chunk()
                loads.append(self.tension())
            before, mean = mean, float(np.mean(loads))
            if abs(mean - before) <= EVEN * mean:
                break
        else:
            self.come_to_rest()
        return mean

    def approach(self, tension: float, longest: float) -> bool:
        """Secant step (at most ``longest`` m) towards a tension at rest (N); whether the wheel could move."""
        way = self.yields * (self._way(tension) - self._way(self.reached))
        by = self.moved(min(max(way, -longest), longest))
        before, self.reached = self.reached, self.evened()
        made = self._way(self.reached) - self._way(before)
        self.yields *= min(max(by / made / self.yields, 0.25), 4.0) if by * made > 0 else 2.0
        return by != 0.0

    def trim(self) -> bool:
        """Move the wheel until the strand has the wanted tension at rest; whether it has. Raises as `come_to_rest`."""
        self.reached = self.evened()
        for _ in range(ROUNDS):
            if abs(self.reached - self.target) <= REACHED * self.target:
                if self.come_to_rest():
                    return True
                self.reached = self.evened()
            elif not self.approach(self.target, self.most):
                break
        self.come_to_rest()
        return False

    def engage(self, seconds: float) -> None:
        """Turn the sprocket where no arc is deep in its teeth, then stiffen them slowly."""
        tooth = self.model.tooth._replace(present=1)
        start = self.state.wheel_angle[SPROCKET]
        # from the angle with a groove under the middle connector outward, both ways in turn
        candidates = start + 2 * pi / tooth.teeth * np.linspace(-0.5, 0.5, 121)
        candidates = candidates[np.argsort(np.abs(candidates - start), kind="stable")]
        cost = [max(arc_depths(self.scene, self.model, self.work, angle).max(), 0.0) for angle in candidates]
        self.state.wheel_angle[SPROCKET] = candidates[int(np.argmin(cost))]
        self.state.tooth_impact[:] = 0.0
        full = tooth.law.stiffness
        chunks = round(seconds / CHUNK)
        for i in range(chunks):
            law = tooth.law._replace(stiffness=full * 10 ** (-4 * (1 - (i + 1) / chunks)))
            self.model = self.model._replace(tooth=tooth._replace(law=law))
            self.chunk()

    def change_ring(self, end: float | None) -> None:
        """Grow or shrink the ring to a radius (m); a ring that is not there shrinks away."""
        wheels = self.model.wheels
        start, end = float(wheels.radius[SPROCKET]), self.bare if end is None else end
        chunks = round(0.3 / CHUNK)
        for i in range(chunks):
            wheels.radius[SPROCKET] = start + (end - start) * (i + 1) / chunks
            self.chunk()

    def rest(self, seconds: float) -> None:
        """March for a time (s), damped."""
        for _ in range(round(seconds / CHUNK)):
            self.chunk()

    def tauten(self) -> None:
        """Come near the wanted tension, first without teeth, and with the ring and the carriers of the rig."""
        self.tighten(0.4)
        if self.scene.model.tooth.present:
            self.engage(0.2)
        self.tighten(0.6)
        if self.reference is None:
            self.change_ring(None)
        if self.scene.tension not in CARRIED and any(wheel.carrier for wheel in self.scene.rig.rollers.values()):
            self.release()

    def let_out(self) -> None:
        """Let a taut chain out until the strand is below the rig's pre-tension; `InputError`: it never is."""
        self.tauten()
        self.reached, self.target = self.evened(), self.scene.rig.tension.pre_tension
        least, further, moves = (inf, self.shift), 0, True
        while self.reached > self.target:
            further = 0 if self.reached < least[0] else further + 1
            least = min(least, (self.reached, self.shift))
            if not moves or further == 3:  # at the end of its travel, or what hangs deeper weighs more
                self.come_to_rest()
                raise tension_refusal(self, least)
            moves = self.approach((1 - FALL) * self.reached, (self.high - self.low) / 8)

    def balanced(self) -> bool:
        """Whether the loop rests: what turns it from one step to the next is small beside its tension."""
        chain, rate = self.model.chain, self.state.rate.copy()
        self._integrate(self.model._replace(stride=1))
        force = chain.mass * chain.length * np.abs(self.state.rate - rate) / self.model.step
        self.swing = float(np.abs(rate).max())
        return self.swing <= SLOW and float(force.max()) <= BALANCED * max(self.tension(), self.hanging)

    def come_to_rest(self) -> bool:
        """Wait until the loop rests; whether it did so at once. Raises `Restless`: it never does."""
        if self.balanced():
            return True
        for _ in range(round(LONGEST_SWING / EVENED)):
            self.rest(EVENED)
            if self.balanced():
                return False
        raise Restless(
            f"the loop does not come to rest: settled in steps of {self.model.step:.3g} s a body still turns at "
            f"{self.swing:.2g} rad/s or is thrown to and fro; use less tension, softer contacts or heavier bodies"
        )


class Restless(InputError):
    """A loop that does not come to rest."""


def tension_refusal(settling: Settling, least: tuple[float, float] | None = None) -> InputError:
    """Refusal of a tension above what the strand reaches, or below the ``least`` (N) at a shift (m)."""
    tension, travel = settling.scene.rig.tension, 1e3 * settling.scene.rig.tension.travel
    reached, shift = least or (settling.reached, settling.shift)
    low, high = 1e3 * settling.low, 1e3 * settling.high
    where = f"with the {tension.wheel} shifted by {1e3 * shift:.4g} mm of tension.travel = {travel:.4g} mm"
    if max(-low, high) < travel or min(-low, high) < travel:
        where += f" ({low:.4g} to {high:.4g} mm until it overlaps another wheel)"
    if least:
        return InputError(
            f"tension.pre_tension = {tension.pre_tension:g} N: must exceed {reached:.4g} N, the least that the "
            f"strand onto the sprocket holds, {where}; {settling.hanging:.4g} N of chain hang below it"
        )
    return InputError(
        f"tension.pre_tension = {tension.pre_tension:g} N: cannot be reached; the strand holds {reached:.4g} N "
        f"{where}; change the pre-tension, enlarge the travel or move the wheels"
    )


def allocate(scene: Scene, step: float) -> tuple[Model, State, Work]:
    """Model, state and work of a scene with a step (s), every array of the state and the work 0."""
    model = copy_wheels(scene.model_of_step(step))
    if scene.loop == "on_wheels":
        model = model._replace(carriers=make_carriers(scene.rig, model, scene.tension, 0.0))
    state, work = make_arrays(model)
    if model.space is not None:
        state = state._replace(plane=Plane(np.zeros(4), np.zeros(4)))
    return model, state, equipped(scene, model, work)


def equipped(scene: Scene, model: Model, work: Work) -> Work:
    """Work with the arrays of the scene's integrator and of motion in space."""
    n, wheels = len(work.cos), len(work.wheel_torque)
    space = None if model.space is None else make_space_work(n, wheels)
    return equip(work, METHODS[scene.integrator], len(model.branches.time))._replace(space=space)


def lay_state(state: State, assembly: Assembly) -> None:
    """Lay the bodies of a state that is 0 as they are assembled, at rest."""
    state.pin[:2] = assembly.pins[0]
    state.angle[:] = assembly.angle
    state.wheel_angle[SPROCKET] = assembly.sprocket_angle


def shift_wheel(model: Model, rig: Rig, wheel: int, shift: float) -> None:
    """Move a wheel of the model by ``shift`` (m) along the tensioner's line, in place."""
    model.wheels.x[wheel], model.wheels.y[wheel] = wheel_circles(rig, shift)[wheel, :2]
    if model.space is not None:
        model.space.centre[:] = np.einsum("wji,wj->wi", model.space.frame, wheel_centres(rig, model.wheels))


def copy_wheels(model: Model) -> Model:
    """The model with wheels that may be moved and a ring that may grow: copies of what a scene keeps."""
    wheels = model.wheels
    wheels = wheels._replace(**{name: getattr(wheels, name).copy() for name in ("present", "x", "y", "radius")})
    space = model.space
    return model._replace(wheels=wheels, space=space and space._replace(centre=space.centre.copy()))


def settling_step(scene: Scene, tension: float, longest: float = inf) -> float:
    """Step of the settling at a tension (N), s: a whole fraction of the sample interval, at most ``SETTLING_STEP``.

    What limits the scene's own step must not be refused under another name here, so the step limit of an explicit
    settling applies, too.
    """
    sample = 1.0 / scene.rig.sensor.rate
    step = min(longest, SETTLING_STEP)
    if not METHODS[scene.integrator].linearly_implicit:
        step = min(step, max(largest_step(scene.model, tension), LEAST_STEP))
    return round_step(step, sample)


def arc_depths(scene: Scene, model: Model, work: Work, angle: float) -> np.ndarray:
    """(2 p,) true depths of the arcs in the ten-arc groove, the sprocket at ``angle`` (rad); -inf out of its reach, m.

    Contact search (Eqs. 20 to 23) finds nothing deeper than r_C: an arc buried in a tooth would cost nothing.
    """
    body, along, wheels = model.shoes.arc_body, model.shoes.arc_x, model.wheels
    centres = np.column_stack([
        work.pin_x[body] + along * work.cos[body] - wheels.x[SPROCKET],
        work.pin_y[body] + along * work.sin[body] - wheels.y[SPROCKET],
    ])  # fmt: skip
    return depths_on_sprocket(scene.rig.groove_profile, scene.rig.chain.connector_radius, centres, angle)


def explained_depth(model: Model, tension: float) -> float:
    """Depth that elastic contact of a tooth can have at rest, m: that of ``MOST_LOAD`` times the tension on one arc."""
    tooth = model.tooth
    load = MOST_LOAD * (tension + model.chain.gravity * float(model.chain.mass.sum()))
    widest = float(tooth.radius.max()) + tooth.arc_radius
    return elastic_depth(tooth.law, load, widest)


def check_meshing(scene: Scene, model: Model, work: Work, angle: float) -> None:
    """Refuse (`InputError`) a loop that would start with an arc deeper in a tooth than its load explains."""
    if not model.tooth.present:
        return
    depth = float(arc_depths(scene, model, work, angle).max())
    if depth > explained_depth(model, scene.rig.tension.pre_tension):
        raise InputError(
            f"the chain does not mesh with the sprocket of this rig: at rest an arc lies {1e3 * depth:.3g} mm inside a "
            "tooth; bring sprocket.equal_pitch_radius, groove.seat_depth and ring_radius nearer to each other"
        )

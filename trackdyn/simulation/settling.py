"""Where a run begins: the loop laid on its wheels, settled and tensioned, or a free loop that spins."""

from math import ceil, cos, pi, sin

import numpy as np

from trackdyn.chain.kinematics import orient, place
from trackdyn.errors import InputError
from trackdyn.integrate.methods import METHODS, equip
from trackdyn.model.constants import SPROCKET, Drive, Model
from trackdyn.model.record import make_record
from trackdyn.model.state import ALONG_X, SLIDE, SLIDE_RATE, Plane, State, make_state
from trackdyn.model.work import Work, make_space_work, make_work
from trackdyn.parameters.layout import Assembly, assemble, belt_around, free_loop, tensioner
from trackdyn.scene.build import shift_wheel, start_plane
from trackdyn.scene.carriers import CARRIED, make_carriers, preloads, refuse_stops
from trackdyn.scene.limits import step_limits
from trackdyn.scene.scene import Scene
from trackdyn.simulation.start_checks import arc_depths, refuse_start_in_steel, refuse_step
from trackdyn.simulation.stepping import march

# Settling: a chunk of this many seconds, then every velocity is multiplied by the factor.
CHUNK = 1e-3
# Step of the settling: that of the scene if it is shorter.
SETTLING_STEP = 1e-4
LEAST_STEP = 2e-6
DAMPING = 0.985
# The tensioner closes the gap to the wanted tension with this time constant, s: slower than the strands swing out.
TENSIONER_TIME = 0.15
# Of the wanted tension, by how much the mean may miss it when the wheel is locked; and further tries until then.
REACHED, ROUNDS = 0.2, 12
# In them the strands even out for so long, in s, at most.
EVENED, LONGEST_REST = 0.2, 4.0
# Compliance of the contacts of one loop on its wheels, m/N: bounds the stiffness of a taut loop.
CONTACT_COMPLIANCE = 1e-6


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


def start_state(assembly: Assembly, model: Model) -> State:
    """An assembled loop at rest."""
    sizes = len(model.shoes.link_body), len(model.wheels.x), len(model.carriers.wheel), len(model.branches.time)
    state = make_state(len(assembly.angle), *sizes)
    state.pin[:2] = assembly.pins[0]
    state.angle[:] = assembly.angle
    state.wheel_angle[SPROCKET] = assembly.sprocket_angle
    return state


def own_wheels(model: Model) -> Model:
    """The model with wheels that may be moved and a ring that may grow: copies of what a scene keeps."""
    wheels = model.wheels
    wheels = wheels._replace(**{name: getattr(wheels, name).copy() for name in ("present", "x", "y", "radius")})
    space = model.space
    return model._replace(wheels=wheels, space=space and space._replace(centre=space.centre.copy()))


def settling_step(scene: Scene) -> float:
    """Step of the settling, s: a whole fraction of the sample interval, no longer than the scene's or
    ``SETTLING_STEP``.

    What limits the scene's own step must not be refused under another name here, so the step limit of an
    explicit settling is kept too.
    """
    sample = 1.0 / scene.rig.sensor.rate
    step = min(scene.step, SETTLING_STEP)
    if not METHODS[scene.integrator].linearly_implicit:
        limits = step_limits(scene.model, scene.rig.tension.pre_tension)
        step = min(step, max(min(limits.values(), default=step), LEAST_STEP))
    return sample / ceil(sample / step * (1 - 1e-9))


class Settling:
    """Brings the assembled loop to rest at the wanted tension and ring radius, in chunks."""

    def __init__(self, scene: Scene):
        self.scene = scene
        rig = scene.rig
        length = scene.model.chain.length
        assembly = assemble(rig, length)
        self.shift = assembly.shift
        self.wheel = tensioner(rig)
        self.target = self.reached = rig.tension.pre_tension
        # of a slack strand the compliance says too much: no shift of a chunk is longer than a tenth of a body
        self.most = 0.1 * float(length.max())
        # at rest in the plane, with the reference ring and the step of the settling
        step = settling_step(scene)
        model = own_wheels(scene.model)
        model.wheels.present[SPROCKET] = 1
        model.wheels.radius[SPROCKET] = rig.sprocket.ring_radius
        # at rest rolling resistance would keep the strands' tensions apart for seconds
        model = model._replace(wheels=model.wheels._replace(rolling=np.zeros_like(model.wheels.rolling)))
        self.model = model._replace(
            drive=Drive(0.0, scene.ramp), step=step, stride=max(round(CHUNK / step), 1), space=None
        )
        shift_wheel(self.model, rig, self.wheel, self.shift)
        self.state = start_state(assembly, self.model)
        work = make_work(len(length), rig.chain.pitches, len(model.wheels.x))
        linearly = METHODS[scene.integrator].linearly_implicit
        self.work = equip(work, "linearly_implicit" if linearly else "semi_implicit", rig.chain.pitches)
        self.record = make_record(1, self.state)
        # a strand of span l and weight w a metre shortens its chord by w^2 l^3 / (24 T^2)
        path, order = belt_around(rig, self.shift, float(length[0]))
        chain = self.model.chain
        weight = chain.gravity * chain.mass.sum() / chain.length.sum()
        orient(self.state.angle, self.work.cos, self.work.sin)
        place(chain, self.state, self.work)
        # what the strand with the cut joint carries at least: from its middle down to the lowest point of the loop
        self.hanging = weight * float(self.work.pin_y[0] - self.work.pin_y.min())
        spans = np.diff(path.start)[1::2]
        self.sag = weight**2 * float((spans**3).sum()) / 24
        # compliance of contacts and joints, m/N
        self.stretch = CONTACT_COMPLIANCE
        d = rig.tension.direction * pi / 180
        self.lever = 0.0
        for k, wheel in enumerate(order):
            if wheel == self.wheel:
                enter, leave = path.heading[k - 1], path.heading[k]
                self.lever += cos(d) * (cos(enter) - cos(leave)) + sin(d) * (sin(enter) - sin(leave))
        if abs(self.lever) < 0.05:
            raise InputError(
                f"tension.direction = {rig.tension.direction:g} deg moves the {rig.tension.wheel} "
                "along its chain and cannot tension it; choose a direction near the middle of its wrap"
            )

    def tension(self) -> float:
        """Tension of the chain at the cut joint, in the middle of the last strand, N."""
        return float(np.hypot(*self.work.sweep.load[:2]))

    def chunk(self, damping: float = DAMPING) -> None:
        """March one chunk, and scale the rates by ``damping`` at its end."""
        march(self.model, self.state, self.work, self.record, phase="settling")
        self.state.rate[:] *= damping
        self.state.pin[2:] *= damping
        self.state.wheel_rate[:] *= damping
        self.state.slide[:, SLIDE_RATE:ALONG_X] *= damping

    def release(self) -> None:
        """Let wheels on carriers go, on springs that hold the chain as it lies unless the rig says how hard."""
        rig = self.scene.rig
        carriers = make_carriers(rig, self.model, self.scene.tension, self.shift)
        rest = np.zeros(len(carriers.wheel))
        carriers = carriers._replace(force=carriers.force[:1].copy())  # as when the run starts, however long this takes
        self.model = self.model._replace(carriers=carriers._replace(preload=preloads(rig, carriers, self.work, rest)))
        self.state = self.state._replace(slide=np.zeros((len(rest), 5)))

    def tighten(self, seconds: float) -> float:
        """Move the tensioning wheel until the strand has the wanted tension; its late mean, N."""
        mean = self.tension() or self.target
        for _ in range(round(seconds / CHUNK)):
            mean += 0.1 * (self.tension() - mean)
            tension = max(mean, 0.1 * self.target, 50.0)
            compliance = 2 * self.sag / tension**3 + self.stretch
            by = (self.target - mean) * compliance / self.lever * CHUNK / TENSIONER_TIME
            self._move(min(max(by, -self.most), self.most))
        return mean

    def _move(self, by: float) -> None:
        """Shift the tensioning wheel and take a chunk, m."""
        self.shift += by
        shift_wheel(self.model, self.scene.rig, self.wheel, self.shift)
        self.chunk()

    def at_rest(self) -> float:
        """Tension of strands that have evened out: a mean over `EVENED`, the one before to a hundredth, N."""
        before, mean = np.inf, self.target
        for _ in range(round(LONGEST_REST / EVENED)):
            loads = []
            for _ in range(round(EVENED / CHUNK)):
                self.chunk()
                loads.append(self.tension())
            before, mean = mean, float(np.mean(loads))
            if abs(mean - before) < 0.01 * self.target:
                break
        return mean

    def tighten_on(self) -> float:
        """Tension at rest after secant steps of the wheel, for strands that are slow or yield more than contacts, N."""
        reached = self.at_rest()
        compliance = 2 * self.sag / max(reached, 0.1 * self.target) ** 3 + self.stretch
        for _ in range(ROUNDS):
            if abs(reached - self.target) <= REACHED * self.target:
                break
            chunks = round(TENSIONER_TIME / CHUNK)
            by = (self.target - reached) * compliance / self.lever / chunks
            by = min(max(by, -self.most / 10), self.most / 10)
            for _ in range(chunks):
                self._move(by)
            before, reached = reached, self.at_rest()
            change = (reached - before) / (self.lever * by * chunks)
            compliance = min(max(1 / change, compliance / 3), 3 * compliance) if change > 0 else 2 * compliance
        return reached

    def engage(self, seconds: float) -> None:
        """Turn the sprocket where no arc is deep in its teeth, then stiffen them slowly."""
        tooth = self.model.tooth._replace(present=1)
        start = self.state.wheel_angle[SPROCKET]
        # from the angle with a groove under the middle connector outward, both ways in turn
        candidates = start + 2 * pi / tooth.teeth * np.linspace(-0.5, 0.5, 121)
        candidates = candidates[np.argsort(np.abs(candidates - start), kind="stable")]
        loop = self.scene, self.model, self.state, self.work
        cost = [max(arc_depths(*loop, angle).max(), 0.0) for angle in candidates]
        self.state.wheel_angle[SPROCKET] = candidates[int(np.argmin(cost))]
        self.state.tooth_impact[:] = 0.0
        full = tooth.law.stiffness
        chunks = round(seconds / CHUNK)
        for i in range(chunks):
            law = tooth.law._replace(stiffness=full * 10 ** (-4 * (1 - (i + 1) / chunks)))
            self.model = self.model._replace(tooth=tooth._replace(law=law))
            self.chunk()

    def change_ring(self, seconds: float) -> None:
        """Grow or shrink the ring to the scene's radius; a ring that is not there shrinks away."""
        wheels = self.model.wheels
        start = float(wheels.radius[SPROCKET])
        end = self.scene.ring_radius
        if end is None:
            end = Scene.ring_range(self.scene.rig)[0] - self.scene.rig.chain.link_thickness
        chunks = round(seconds / CHUNK)
        for i in range(chunks):
            wheels.radius[SPROCKET] = start + (end - start) * (i + 1) / chunks
            self.chunk()

    def rest(self, seconds: float) -> None:
        """March for a time (s), damped."""
        for _ in range(round(seconds / CHUNK)):
            self.chunk()


def tensioned(scene: Scene) -> Settling:
    """The first part of `settle`: the loop tensioned (or refused) on the rig's ring; the scene's has no part."""
    settling = Settling(scene)
    tooth = settling.model.tooth
    settling.model = settling.model._replace(tooth=tooth._replace(present=0))
    settling.tighten(0.6)
    if tooth.present:
        settling.engage(0.2)
    reached = settling.tighten(0.6)
    if abs(reached - settling.target) > REACHED * settling.target:
        reached = settling.tighten_on()
    if abs(reached - settling.target) <= REACHED * settling.target:
        settling.reached = reached
        return settling
    if settling.target < settling.hanging <= reached:
        raise InputError(
            f"tension.pre_tension = {settling.target:g} N: must exceed {reached:.4g} N, which the strand that runs "
            f"onto the sprocket holds when the chain is let out ({settling.hanging:.4g} N of chain hang below it)"
        )
    raise InputError(
        f"tension.pre_tension = {settling.target:g} N: cannot be reached; the strand holds {reached:.3g} N with the "
        f"{scene.rig.tension.wheel} shifted by {settling.shift:.3g} m; change the pre-tension or move the wheels"
    )


def settle(scene: Scene, settling: Settling | None = None) -> tuple[Model, State, Work, dict]:
    """The loop at rest on its wheels, tensioned, with the scene's ring.

    The tension is set with the rig's own ring radius (``sprocket.ring_radius``) and the wheel then
    locked; every other ring starts from there, as the paper's wheels stay where they are.

    Parameters
    ----------
    scene : Scene
    settling : Settling or None
        What `tensioned` gave for this scene, or for one that differs in its ring; it is used up.

    Returns
    -------
    model, state, work
        Ready to run, the sprocket at rest and the energy balance at zero.
    layout : dict
        Derived values: the tensioning wheel's shift (m) and the tension (N) reached with the reference ring.
    """
    if scene.loop == "free":
        return _spinning_loop(scene)
    settling = settling or tensioned(scene)
    settling.scene = scene
    layout = {"tensioner_shift_m": float(settling.shift), "tension_n": settling.reached}
    if scene.tension in CARRIED or any(wheel.carrier for wheel in scene.rig.rollers.values()):
        settling.rest(0.2)
        settling.release()
        if scene.tension != "sprung" or len(settling.state.slide) > 1:
            settling.rest(0.4)
    if scene.ring_radius != scene.rig.sprocket.ring_radius:
        settling.change_ring(0.3)
        if scene.tension == "retensioned":
            settling.tighten(0.6)
            layout |= {"tensioner_shift_m": float(settling.shift)}
    settling.rest(0.2)
    layout |= {"settled_tension_n": settling.tension()}
    model = own_wheels(scene.model)
    shift_wheel(model, scene.rig, settling.wheel, settling.shift)
    carriers = settling.model.carriers
    if len(carriers.force):
        carriers = carriers._replace(force=np.array(scene.rig.tension.force, dtype=float))
    model = model._replace(carriers=carriers)
    state = settling.state
    if len(state.slide):
        refuse_stops(scene.rig, model.carriers, state.slide)
        for name in ("x", "y"):
            getattr(model.wheels, name)[:] = getattr(settling.model.wheels, name)
        state.slide[:, SLIDE_RATE:] = 0.0
        if scene.tension in CARRIED:
            layout |= {"tensioner_slide_m": float(state.slide[carriers.tensioner, SLIDE])}
    state.steps[0] = 0
    state.rate[:] = 0.0
    state.pin[2:] = 0.0
    state.wheel_rate[:] = 0.0
    state.work_done[:] = 0.0
    refuse_start_in_steel(scene, model, state, settling.work)
    refuse_step(scene, model, layout["settled_tension_n"])
    work = equipped(scene, settling.work)
    if model.space is not None:
        state = state._replace(plane=start_plane(scene.rig, model, state))
        work = work._replace(space=make_space_work(len(state.angle), len(model.wheels.x)))
    return model, state, work, layout


def _spinning_loop(scene: Scene) -> tuple[Model, State, Work, dict]:
    """An oblong loop without wheels that spins with the rate of the sprocket and is otherwise at rest."""
    model = scene.model
    assembly = free_loop(model.chain.length)
    state = start_state(assembly, model)
    spin = scene.sprocket_rate
    state.rate[:] = spin
    state.pin[2:] = [-spin * state.pin[1], spin * state.pin[0]]
    work = make_work(len(state.angle), scene.rig.chain.pitches, len(model.wheels.x))
    return model, state, equipped(scene, work), {}

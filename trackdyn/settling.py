"""Where a run begins: the loop laid on its wheels, settled and tensioned, or a free loop that spins."""

from math import ceil, cos, pi, sin

import numpy as np

from trackdyn.chain.implicit import make_implicit_work
from trackdyn.chain.kinematics import orient, place
from trackdyn.contact.loads import contact_loads
from trackdyn.errors import DivergenceError, InputError
from trackdyn.integrate.limits import step_limits
from trackdyn.integrate.run import run
from trackdyn.integrate.spells import SPELL_COLUMNS
from trackdyn.model import SPROCKET, Model, Record, Spells, State, Work, make_buffers
from trackdyn.parameters.layout import Assembly, assemble, belt_around, free_loop, tensioner, wheel_circles
from trackdyn.scene import Scene, build_chain, build_model

# Settling: a chunk of this many seconds, then every velocity is multiplied by the factor.
CHUNK = 1e-3
# Step of the settling: that of the scene if it is shorter.
SETTLING_STEP = 1e-4
LEAST_STEP = 2e-6
DAMPING = 0.985
# The tensioner closes the gap to the wanted tension with this time constant, s: slower than the
# strands swing out.
TENSIONER_TIME = 0.15
# Compliance of the contacts of one loop on its wheels, m/N: bounds the stiffness of a taut loop.
CONTACT_COMPLIANCE = 1e-6


def empty_record(
    samples: int,
    n: int,
    wheels: int,
    pitches: tuple[int, ...] = (),
    frames: int = 0,
    stride: int = 0,
    spells: int = 0,
    loop: int | None = None,
) -> Record:
    """Allocate the arrays of a record (see ``model.Record``), with room for ``spells`` rows a chunk.

    ``loop`` is the number of pitches of the chain, half of its ``n`` bodies by default.
    """
    p = len(pitches)
    loop = n // 2 if loop is None else loop
    return Record(
        np.zeros((samples, 3)),
        np.zeros((samples, 3)),
        np.zeros(samples),
        np.zeros((samples, 2)),
        np.zeros((samples, wheels)),
        np.zeros((samples, 10)),
        np.zeros((samples, p, 3)),
        np.zeros((samples, p, 2), np.int8),
        np.zeros((samples, p, 2), np.int8),
        np.array([i - 1 for i in pitches], np.int64),
        np.zeros((frames, n + 3)),
        stride,
        Spells(
            int(spells > 0),
            np.zeros((3 * loop, len(SPELL_COLUMNS))),
            np.zeros((spells, len(SPELL_COLUMNS))),
            np.zeros(1, np.int64),
        ),
    )


def body_name(body: int, single_pin: bool = False) -> str:
    """``link 3`` or ``connector 3``: the body as a reader would call it."""
    if single_pin:
        return f"pitch {body + 1}"
    return f"{'connector' if body % 2 else 'link'} {body // 2 + 1}"


def diverged(body: int, state: State, model: Model, phase: str) -> DivergenceError:
    """What is raised when a body leaves the physical range: when, in which phase, which body."""
    when = state.steps[0] * model.step
    return DivergenceError(
        f"the run left the physical range at t = {when:.6g} s of {phase}, first at "
        f"{body_name(body, len(state.angle) == len(state.wheel_impact))}; "
        f"a step smaller than {model.step:g} s would do if the rig is meant to be so"
    )


def start_state(assembly: Assembly, model: Model) -> State:
    """An assembled loop at rest."""
    n, wheels, pitches = len(assembly.angle), len(model.wheels.x), len(model.shoes.link_body)
    angle = np.zeros(wheels)
    angle[SPROCKET] = assembly.sprocket_angle
    return State(
        np.zeros(1, np.int64),
        np.array([*assembly.pins[0], 0.0, 0.0]),
        assembly.angle.copy(),
        np.zeros(n),
        angle,
        np.zeros(wheels),
        np.zeros(2 * pitches),
        np.zeros((pitches, wheels)),
        np.zeros(7),
    )


def settling_step(scene: Scene) -> float:
    """Step of the settling, s: a whole fraction of the sample interval, no longer than the scene's or ``SETTLING_STEP``.

    What limits the scene's own step must not be refused under another name here, so the step limit of an
    explicit settling is kept too.
    """
    sample = 1.0 / scene.rig.sensor.rate
    step = min(scene.step, SETTLING_STEP)
    if scene.integrator != "linearly_implicit":
        limits = step_limits(build_model(scene), scene.rig.tension.pre_tension)
        step = min(step, max(min(limits.values(), default=step), LEAST_STEP))
    return sample / ceil(sample / step * (1 - 1e-9))


class _Settling:
    """Brings the assembled loop to rest at the wanted tension and ring radius, in chunks."""

    def __init__(self, scene: Scene):
        self.scene = scene
        rig = scene.rig
        body = float(build_chain(rig, scene.chain).length[0])
        assembly = assemble(rig, build_chain(rig, scene.chain).length)
        self.shift = assembly.shift
        reference = scene.with_(
            ring_radius=rig.sprocket.ring_radius,
            motor_rpm=0.0,
            integrator="linearly_implicit" if scene.integrator == "linearly_implicit" else "semi_implicit",
            tolerance=None,
            solver="riccati",
            step=settling_step(scene),
        )
        self.model = build_model(reference, self.shift)
        self.state = start_state(assembly, self.model)
        n, pitches = len(assembly.angle), rig.chain.pitches
        self.work = make_buffers(n, 3, pitches)
        self.record = empty_record(1, n, 3, loop=pitches)
        self.terms = make_implicit_work(n, 3) if reference.integrator == "linearly_implicit" else None
        self.wheel = tensioner(rig)
        self.target = rig.tension.pre_tension
        # a strand of span l and weight w a metre shortens its chord by w^2 l^3 / (24 T^2)
        path, order = belt_around(rig, self.shift, body)
        chain = self.model.chain
        weight = chain.gravity * chain.mass.sum() / chain.length.sum()
        spans = np.diff(path.start)[1::2]
        self.sag = weight**2 * float((spans**3).sum()) / 24
        here = order.index(self.wheel)
        enter, leave = path.heading[here - 1], path.heading[here]
        d = rig.tension.direction * pi / 180
        self.lever = cos(d) * (cos(enter) - cos(leave)) + sin(d) * (sin(enter) - sin(leave))
        if abs(self.lever) < 0.05:
            raise InputError(
                f"tension.direction = {rig.tension.direction:g} deg moves the {rig.tension.wheel} along its chain and cannot "
                "tension it; a direction near the middle of its wrap would do"
            )

    def tension(self) -> float:
        """Tension of the chain at the cut joint, in the middle of the last strand, N."""
        return float(np.hypot(*self.work.sweep.load[:2]))

    def chunk(self, damping: float = DAMPING) -> None:
        steps = max(round(CHUNK / self.model.step), 1)
        bad = run(self.model, self.state, self.work, self.record, 0, 1, steps, terms=self.terms)
        if bad >= 0:
            raise diverged(bad, self.state, self.model, "settling")
        self.state.rate[:] *= damping
        self.state.pin[2:] *= damping
        self.state.wheel_rate[:] *= damping

    def tighten(self, seconds: float) -> None:
        """Move the tensioning wheel until the strand has the wanted tension."""
        mean = self.tension() or self.target
        for _ in range(round(seconds / CHUNK)):
            mean += 0.1 * (self.tension() - mean)
            tension = max(mean, 0.1 * self.target, 50.0)
            compliance = 2 * self.sag / tension**3 + CONTACT_COMPLIANCE
            self.shift += (self.target - mean) * compliance / self.lever * CHUNK / TENSIONER_TIME
            x, y = wheel_circles(self.scene.rig, self.shift)[self.wheel, :2]
            self.model.wheels.x[self.wheel], self.model.wheels.y[self.wheel] = x, y
            self.chunk()

    def without_teeth(self) -> None:
        self.model = self.model._replace(tooth=self.model.tooth._replace(present=0))

    def engage(self, seconds: float) -> None:
        """Turn the sprocket where its teeth penetrate least, then stiffen them slowly."""
        tooth = self.model.tooth._replace(present=1)
        probe = self.model._replace(tooth=tooth)
        start = self.state.wheel_angle[SPROCKET]
        # from the angle with a groove under the middle connector outward, both ways in turn
        candidates = start + 2 * pi / tooth.teeth * np.linspace(-0.5, 0.5, 121)
        candidates = candidates[np.argsort(np.abs(candidates - start), kind="stable")]
        cost = []
        for angle in candidates:
            self.state.wheel_angle[SPROCKET] = angle
            orient(self.state.angle, self.work.cos, self.work.sin)
            place(probe.chain, self.state, self.work)
            contact_loads(probe, self.state, self.work)
            cost.append(self.work.tooth_force.max())
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
        for _ in range(round(seconds / CHUNK)):
            self.chunk()


def settle(scene: Scene) -> tuple[Model, State, Work, dict]:
    """The loop at rest on its wheels, tensioned, with the scene's ring.

    The tension is set with the rig's own ring radius (``sprocket.ring_radius``) and the wheel then
    locked; every other ring starts from there, as the paper's wheels stay where they are.

    Returns
    -------
    model, state, work
        Ready to run, the sprocket at rest and the account of work at zero.
    layout : dict
        Derived values: the tensioning wheel's shift (m) and the tension (N) reached with the reference ring.
    """
    if scene.loop == "free":
        return _spinning_loop(scene)
    settling = _Settling(scene)
    teeth = settling.model.tooth.present
    settling.without_teeth()
    settling.tighten(0.6)
    if teeth:
        settling.engage(0.2)
    settling.tighten(0.6)
    layout = {"tensioner_shift_m": settling.shift, "tension_n": settling.tension()}
    if scene.ring_radius != scene.rig.sprocket.ring_radius:
        settling.change_ring(0.3)
    settling.rest(0.2)
    model = build_model(scene, settling.shift)
    state = settling.state
    state.steps[0] = 0
    state.rate[:] = 0.0
    state.pin[2:] = 0.0
    state.wheel_rate[:] = 0.0
    state.work_done[:] = 0.0
    return model, state, settling.work, layout


def _spinning_loop(scene: Scene) -> tuple[Model, State, Work, dict]:
    """An oblong loop without wheels that spins with the rate of the sprocket and is otherwise at rest."""
    model = build_model(scene)
    assembly = free_loop(model.chain.length)
    state = start_state(assembly, model)
    spin = scene.sprocket_rate
    state.rate[:] = spin
    state.pin[2:] = [-spin * state.pin[1], spin * state.pin[0]]
    return model, state, make_buffers(len(state.angle), 1, scene.rig.chain.pitches), {}

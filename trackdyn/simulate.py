"""The one door: a scene in, a recording out."""

import platform
import time
from importlib.metadata import version
from math import cos, pi, sin

import numpy as np
from tqdm import tqdm

from trackdyn.chain.belt import belt_motion
from trackdyn.chain.kinematics import orient, place
from trackdyn.chain.spatial import make_plane_record
from trackdyn.contact.loads import contact_loads
from trackdyn.errors import DivergenceError, InputError
from trackdyn.fidelity import decide
from trackdyn.integrate.methods import SOLVERS, make_method
from trackdyn.integrate.run import run
from trackdyn.integrate.spatial import run_spatial
from trackdyn.integrate.spells import SPELL_COLUMNS
from trackdyn.jit import source_hash
from trackdyn.model import SPROCKET, Model, Record, Spells, State, Work, make_buffers
from trackdyn.parameters.layout import Assembly, assemble, belt_around, free_loop, tensioner, wheel_circles
from trackdyn.recording import Recording
from trackdyn.scene import Scene, build_chain, build_model
from trackdyn.space import build_space

# Settling: a chunk of this many seconds, then every velocity is multiplied by the factor.
CHUNK = 1e-3
# Step of the settling: that of the scene if it is shorter.
SETTLING_STEP = 1e-4
DAMPING = 0.985
# The tensioner closes the gap to the wanted tension with this time constant, s: slower than the
# strands swing out.
TENSIONER_TIME = 0.15
SPELLS_A_CHUNK = 40000
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


def _diverged(body: int, state: State, model: Model, phase: str) -> DivergenceError:
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
            integrator="semi_implicit",
            tolerance=None,
            solver="riccati",
            step=min(scene.step, SETTLING_STEP),
        )
        self.model = build_model(reference, self.shift)
        self.state = start_state(assembly, self.model)
        n, pitches = len(assembly.angle), rig.chain.pitches
        self.work = make_buffers(n, 3, pitches)
        self.record = empty_record(1, n, 3, loop=pitches)
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
        bad = run(self.model, self.state, self.work, self.record, 0, 1, round(CHUNK / self.model.step))
        if bad >= 0:
            raise _diverged(bad, self.state, self.model, "settling")
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


def run_options(scene: Scene, model: Model, state: State) -> dict:
    """Arguments of ``integrate.run.run`` that the scene's integrator and solver need."""
    method = make_method(
        scene.integrator,
        len(state.angle),
        len(model.shoes.link_body),
        len(model.wheels.x),
        scene.tolerance or 0.0,
    )
    return {
        "terms": method if scene.integrator == "linearly_implicit" else None,
        "stages": method if scene.integrator in ("rk4", "adaptive") else None,
        "solver": SOLVERS.index(scene.solver) or None,
    }


def make_stepper(scene: Scene, model: Model, state: State, work: Work, samples: int):
    """Time loop of a scene with its space, integrator and solver bound.

    Returns
    -------
    go : function
        ``go(record, first, last, lead=False)`` integrates samples of a record and returns -1 or the body at
        which the run left the physical range; ``lead`` samples are not kept of the plane's motion.
    plane : chain.spatial.PlaneRecord or None
        What is kept of the motion of the chain's plane, None for a planar scene.
    """
    if scene.fidelity["space"].setting == "spatial":
        leading = build_space(scene, model, state)  # keeps one sample; plane and work are shared
        kept = leading._replace(record=make_plane_record(samples, len(model.wheels.x)))

        def go(record, first, last, lead=False):
            return run_spatial(model, state, work, record, first, last, scene.stride, leading if lead else kept)

        return go, kept.record
    options = run_options(scene, model, state)

    def go(record, first, last, lead=False):
        return run(model, state, work, record, first, last, scene.stride, **options)

    return go, None


def _take_spells(spells: Spells) -> np.ndarray:
    """Rows that ended in the last chunk; the log is empty afterwards."""
    count = int(spells.count[0])
    if count > len(spells.rows):
        raise DivergenceError(
            f"{count} contacts ended within one chunk of 0.25 s, more than {len(spells.rows)}: the contact chatters from "
            "step to step; a smaller step would do"
        )
    spells.count[0] = 0
    return spells.rows[:count].copy()


def _samples(seconds: float, rate: int) -> int:
    return round(seconds * rate)


def simulate(scene: Scene, progress: bool = False) -> Recording:
    """Settle the loop, start the sprocket, wait for steady running and record.

    Parameters
    ----------
    scene : Scene
        What to run.
    progress : bool
        Show a progress bar with simulated time, speed and remaining time.

    Returns
    -------
    Recording

    Raises
    ------
    DivergenceError
        If a body leaves the physical range; nothing is returned or written then.
    """
    if scene.chain == "belt":
        return _belt(scene)
    rig = scene.rig
    rate = rig.sensor.rate
    decisions = decide(scene)
    model, state, work, layout = settle(scene)
    n, loop, wheels = len(state.angle), rig.chain.pitches, len(model.wheels.x)
    pitches = scene.pitches or (rig.sensor.pitch,)
    samples = _samples(scene.duration, rate)
    lead = _samples(scene.ramp + scene.lead_in, rate)
    frame_stride = _samples(scene.frame_interval, rate)
    frames = -(-samples // frame_stride) if frame_stride else 0
    spell_rows = SPELLS_A_CHUNK if scene.spells and scene.loop == "on_wheels" else 0
    record = empty_record(samples, n, wheels, pitches, frames, frame_stride, spell_rows, loop)
    scratch = empty_record(1, n, wheels, loop=loop)
    go, space = make_stepper(scene, model, state, work, samples)

    bar = tqdm(
        total=scene.ramp + scene.lead_in + scene.duration,
        disable=not progress,
        unit="s",
        desc=f"{scene.motor_rpm:g} rpm",
        bar_format="{desc} |{bar}| {n:.1f} of {total:.1f} s simulated, {rate_noinv_fmt}, {remaining} left",
    )
    wall = 0.0
    with bar:
        for _ in range(lead):
            bad = go(scratch, 0, 1, lead=True)
            if bad >= 0:
                raise _diverged(bad, state, model, "the start")
            bar.update(1 / rate)
        begin_time = state.steps[0] * model.step
        chunk = max(rate // 4, 1)
        spells = []
        for first in range(0, samples, chunk):
            last = min(first + chunk, samples)
            begin = time.perf_counter()
            bad = go(record, first, last)
            wall += time.perf_counter() - begin
            if bad >= 0:
                raise _diverged(bad, state, model, "the run")
            spells.append(_take_spells(record.spells))
            bar.update((last - first) / rate)

    return Recording(
        time=np.arange(1, samples + 1) / rate,
        raw=record.raw,
        mean=record.mean,
        gap=record.gap,
        place=record.place,
        wheel_rate=record.wheel_rate,
        energy=record.energy,
        force=record.force,
        area=record.area,
        groove=record.groove,
        pitches=record.pitches + 1,
        spells=np.vstack(spells),
        begin=float(begin_time),
        frame=record.frame,
        frame_time=(np.arange(frames) * frame_stride + 1) / rate,
        plane=space.motion if space else np.zeros((samples, 0)),
        wheel_offset=space.offset if space else np.zeros((samples, 0)),
        axial_force=space.axial if space else np.zeros((samples, 0)),
        meta=_provenance(scene, decisions, layout),
        wall=wall,
    )


def _provenance(scene: Scene, decisions: dict, layout: dict) -> dict:
    """Scene, rig, decisions with their reasons, versions and sources."""
    return {
        "scene": {k: v for k, v in scene.describe().items() if k != "rig"},
        "rig": scene.rig.model_dump(),
        "layout": layout,
        "fidelity": {name: {"setting": d.setting, "reason": d.reason} for name, d in decisions.items()},
        "sources": source_hash(),
        "versions": {name: version(name) for name in ("numpy", "numba", "scipy")},
        "python": platform.python_version(),
    }


def _belt(scene: Scene) -> Recording:
    """A kinematic recording: the sensor on the path of the chain, nothing else."""
    rate = scene.rig.sensor.rate
    samples = _samples(scene.duration, rate)
    begin = time.perf_counter()
    raw, mean, at, length = belt_motion(scene, (scene.lead_in + scene.ramp / 2) * scene.loop_frequency, samples)
    wall = time.perf_counter() - begin
    scratch = empty_record(samples, 2 * scene.rig.chain.pitches, 3)
    scratch.wheel_rate[:, SPROCKET] = scene.sprocket_rate
    return Recording(
        time=np.arange(1, samples + 1) / rate,
        raw=raw,
        mean=mean,
        gap=scratch.gap,
        place=at,
        wheel_rate=scratch.wheel_rate,
        energy=scratch.energy,
        force=scratch.force,
        area=scratch.area,
        groove=scratch.groove,
        pitches=np.zeros(0, np.int64),
        spells=np.zeros((0, len(SPELL_COLUMNS))),
        begin=scene.lead_in + scene.ramp,
        frame=np.zeros((0, 2 * scene.rig.chain.pitches + 3)),
        frame_time=np.zeros(0),
        plane=np.zeros((samples, 0)),
        wheel_offset=np.zeros((samples, 0)),
        axial_force=np.zeros((samples, 0)),
        meta=_provenance(scene, decide(scene), {"path_m": length}),
        wall=wall,
    )

"""The one door: a scene in, a recording out."""

import platform
import time
from importlib.metadata import version
from math import cos, pi, sin

import numpy as np
from tqdm import tqdm

from trackdyn.chain.kinematics import orient, place
from trackdyn.contact.loads import contact_loads
from trackdyn.errors import DivergenceError, InputError
from trackdyn.integrate.semi_implicit import run
from trackdyn.integrate.spells import SPELL_COLUMNS
from trackdyn.jit import source_hash
from trackdyn.model import SPROCKET, Model, Record, Spells, State, Work, make_buffers
from trackdyn.parameters.layout import assemble, belt_around, tensioner, wheel_circles
from trackdyn.recording import Recording
from trackdyn.scene import Scene, build_model

# Settling: a chunk of this many seconds, then every velocity is multiplied by the factor.
CHUNK = 1e-3
DAMPING = 0.985
# The tensioner closes the gap to the wanted tension with this time constant, s: slower than the
# strands swing out.
TENSIONER_TIME = 0.15
SPELLS_A_CHUNK = 40000
# Compliance of the contacts of one loop on its wheels, m/N: bounds the stiffness of a taut loop.
CONTACT_COMPLIANCE = 1e-6


def empty_record(
    samples: int, n: int, wheels: int, pitches: tuple[int, ...] = (), frames: int = 0, stride: int = 0, spells: int = 0
) -> Record:
    """Allocate the arrays of a record (see ``model.Record``), with room for ``spells`` rows a chunk."""
    p = len(pitches)
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
            np.zeros((3 * n // 2, len(SPELL_COLUMNS))),
            np.zeros((spells, len(SPELL_COLUMNS))),
            np.zeros(1, np.int64),
        ),
    )


def body_name(body: int) -> str:
    """``link 3`` or ``connector 3``: the body as a reader would call it."""
    return f"{'connector' if body % 2 else 'link'} {body // 2 + 1}"


def _diverged(body: int, state: State, model: Model, phase: str) -> DivergenceError:
    when = state.steps[0] * model.step
    return DivergenceError(
        f"the run left the physical range at t = {when:.6g} s of {phase}, first at {body_name(body)}; "
        f"a step smaller than {model.step:g} s would do if the rig is meant to be so"
    )


class _Settling:
    """Brings the assembled loop to rest at the wanted tension and ring radius, in chunks."""

    def __init__(self, scene: Scene):
        self.scene = scene
        rig = scene.rig
        assembly = assemble(rig)
        n = len(assembly.angle)
        self.shift = assembly.shift
        self.state = State(
            np.zeros(1, np.int64),
            np.array([*assembly.pins[0], 0.0, 0.0]),
            assembly.angle.copy(),
            np.zeros(n),
            np.array([assembly.sprocket_angle, 0.0, 0.0]),
            np.zeros(3),
            np.zeros(n),
            np.zeros((n // 2, 3)),
            np.zeros(7),
        )
        reference = scene.with_(ring_radius=rig.sprocket.ring_radius, motor_rpm=0.0)
        self.model = build_model(reference, self.shift)
        self.work = make_buffers(n, 3)
        self.record = empty_record(1, n, 3)
        self.wheel = tensioner(rig)
        self.target = rig.tension.pre_tension
        # a strand of span l and weight w a metre shortens its chord by w^2 l^3 / (24 T^2)
        path, order = belt_around(rig, self.shift)
        chain = self.model.chain
        weight = chain.gravity * (chain.mass[0] + chain.mass[1]) / (chain.length[0] + chain.length[1])
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
    settling = _Settling(scene)
    settling.without_teeth()
    settling.tighten(0.6)
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
    rig = scene.rig
    rate = rig.sensor.rate
    model, state, work, layout = settle(scene)
    n = state.angle.shape[0]
    pitches = scene.pitches or (rig.sensor.pitch,)
    samples = _samples(scene.duration, rate)
    lead = _samples(scene.ramp + scene.lead_in, rate)
    frame_stride = _samples(scene.frame_interval, rate)
    frames = -(-samples // frame_stride) if frame_stride else 0
    record = empty_record(samples, n, 3, pitches, frames, frame_stride, SPELLS_A_CHUNK if scene.spells else 0)
    scratch = empty_record(1, n, 3)

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
            bad = run(model, state, work, scratch, 0, 1, scene.stride)
            if bad >= 0:
                raise _diverged(bad, state, model, "the start")
            bar.update(1 / rate)
        begin_time = state.steps[0] * model.step
        chunk = max(rate // 4, 1)
        spells = []
        for first in range(0, samples, chunk):
            last = min(first + chunk, samples)
            begin = time.perf_counter()
            bad = run(model, state, work, record, first, last, scene.stride)
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
        meta={
            "scene": {k: v for k, v in scene.describe().items() if k != "rig"},
            "rig": rig.model_dump(),
            "layout": layout,
            "fidelity": "planar",
            "sources": source_hash(),
            "versions": {name: version(name) for name in ("numpy", "numba", "scipy")},
            "python": platform.python_version(),
        },
        wall=wall,
    )

"""The one door: a scene in, a recording out."""

import platform
import time
from importlib.metadata import version
from math import cos, pi, sin

import numpy as np
from tqdm import tqdm

from trackdyn.errors import DivergenceError
from trackdyn.integrate.semi_implicit import SPROCKET, Model, Record, State, Work, loads, make_buffers, orient, place, run
from trackdyn.jit import source_hash
from trackdyn.parameters.layout import assemble, belt_path, wheel_circles
from trackdyn.recording import Recording
from trackdyn.scene import Scene, build_model

# Settling: a chunk of this many seconds, then every velocity is multiplied by the factor.
CHUNK = 1e-3
DAMPING = 0.97
# Speed of the tensioner for one newton of missing force, m/(N s): slow against the strands' motion.
TENSIONER_GAIN = 4e-5
IDLER = 1


def empty_record(samples: int, n: int, wheels: int, pitches: tuple[int, ...] = (), frames: int = 0, stride: int = 0) -> Record:
    """Allocate the arrays of a record (see ``integrate.state.Record``)."""
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
        self.direction = rig.tension.direction * pi / 180
        path = belt_path(wheel_circles(rig, self.shift))
        leave, enter = path.heading[IDLER], path.heading[IDLER - 1]
        lever = np.array([cos(enter) - cos(leave), sin(enter) - sin(leave)])
        self.target = rig.tension.pre_tension * float(lever @ [cos(self.direction), sin(self.direction)])

    def idler_force(self) -> float:
        """Push of the chain against the tensioner's direction, N."""
        w = self.work
        k = w.count[0]
        rows = w.contact[:k][w.contact_body[:k, 1] == IDLER]
        force = rows[:, 0:2].sum(axis=0) + rows[:, 2:4].sum(axis=0)
        return float(force @ [cos(self.direction), sin(self.direction)])

    def chunk(self, damping: float = DAMPING) -> None:
        bad = run(self.model, self.state, self.work, self.record, 0, 1, round(CHUNK / self.model.step))
        if bad >= 0:
            raise _diverged(bad, self.state, self.model, "settling")
        self.state.rate[:] *= damping
        self.state.pin[2:] *= damping
        self.state.wheel_rate[:] *= damping

    def tighten(self, seconds: float) -> None:
        """Move the idler until the chain pushes on it with the target force."""
        mean = self.target
        for _ in range(round(seconds / CHUNK)):
            mean += 0.1 * (self.idler_force() - mean)
            self.shift += TENSIONER_GAIN * CHUNK * (self.target - mean)
            x, y = wheel_circles(self.scene.rig, self.shift)[IDLER, :2]
            self.model.wheels.x[IDLER], self.model.wheels.y[IDLER] = x, y
            self.chunk()

    def without_teeth(self) -> None:
        self.model = self.model._replace(tooth=self.model.tooth._replace(present=0))

    def engage(self, seconds: float) -> None:
        """Turn the sprocket where its teeth penetrate least, then stiffen them slowly."""
        tooth = self.model.tooth._replace(present=1)
        probe = self.model._replace(tooth=tooth)
        start = self.state.wheel_angle[SPROCKET]
        candidates = start + np.linspace(0, 2 * pi / tooth.teeth, 120, endpoint=False)
        cost = []
        for angle in candidates:
            self.state.wheel_angle[SPROCKET] = angle
            orient(self.state.angle, self.work.cos, self.work.sin)
            place(probe.chain, self.state, self.work)
            loads(probe, self.state, self.work)
            cost.append(self.work.tooth_force.max())
        clear = np.array(cost) <= min(cost) * 1.0000001
        # the middle of the widest run of equally good angles
        best = np.flatnonzero(clear)
        self.state.wheel_angle[SPROCKET] = candidates[best[len(best) // 2]]
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

    The tension is set with the rig's own ring radius (``sprocket.ring_radius``) and the idler then
    locked; every other ring starts from there, as the paper's wheels stay where they are.

    Returns
    -------
    model, state, work
        Ready to run, the sprocket at rest and the account of work at zero.
    layout : dict
        Derived values: the idler's shift (m) and the force on it (N) with the reference ring.
    """
    settling = _Settling(scene)
    settling.without_teeth()
    settling.tighten(0.6)
    settling.engage(0.2)
    settling.tighten(0.6)
    layout = {"idler_shift_m": settling.shift, "idler_force_n": settling.idler_force(), "idler_target_n": settling.target}
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
    record = empty_record(samples, n, 3, pitches, frames, frame_stride)
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
        chunk = rate // 4
        for first in range(0, samples, chunk):
            last = min(first + chunk, samples)
            begin = time.perf_counter()
            bad = run(model, state, work, record, first, last, scene.stride)
            wall += time.perf_counter() - begin
            if bad >= 0:
                raise _diverged(bad, state, model, "the run")
            bar.update((last - first) / rate)

    return Recording(
        time=np.arange(samples) / rate,
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
        frame=record.frame,
        frame_time=np.arange(frames) * frame_stride / rate,
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

"""The one door: a scene in, a recording out."""

import platform
import time
from importlib.metadata import version

import numpy as np
from tqdm import tqdm

from trackdyn.chain.belt import belt_motion
from trackdyn.chain.spatial import make_plane_record
from trackdyn.errors import DivergenceError
from trackdyn.fidelity import decide
from trackdyn.integrate.limits import refuse_open_account
from trackdyn.integrate.methods import SOLVERS, make_method
from trackdyn.integrate.run import run
from trackdyn.integrate.spatial import run_spatial
from trackdyn.integrate.spells import SPELL_COLUMNS
from trackdyn.jit import source_hash
from trackdyn.model import SPROCKET, Model, Spells, State, Work
from trackdyn.recording import Recording
from trackdyn.scene import Scene
from trackdyn.settling import diverged, empty_record, settle
from trackdyn.space import build_space

# Spells that may end within a chunk of the run.
SPELLS_A_CHUNK = 40000


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
        total=scene.ramp + scene.lead_in + scene.duration + 1e-6,  # sums of parts may round beyond it
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
                raise diverged(bad, state, model, "the start")
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
                raise diverged(bad, state, model, "the run")
            spells.append(_take_spells(record.spells))
            bar.update((last - first) / rate)

    refuse_open_account(record.energy, model, scene.duration)
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
        meta=_provenance(scene, decisions, layout),
        wall=wall,
        **({"plane": space.motion, "wheel_offset": space.offset, "axial_force": space.axial} if space else {}),
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
        meta=_provenance(scene, decide(scene), {"path_m": length}),
        wall=wall,
    )

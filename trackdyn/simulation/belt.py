"""The kinematic path: links that run along the belt line at constant speed (no forces, no equations)."""

import time

import numpy as np

from trackdyn.model.constants import SPROCKET
from trackdyn.model.record import make_record
from trackdyn.model.state import make_state
from trackdyn.parameters.layout import belt_around
from trackdyn.simulation.recording import Recording, provenance

# parts of a sample interval over which the mean is taken
PARTS = 8


def belt_motion(scene, travel0: float, samples: int):
    """Acceleration that the sensor would have on a belt, where its link is, and the length of the path.

    Returned are ``raw``, ``mean`` and ``place`` of `Recording` and the length, m. Every pitch follows the path of the
    pins around the wheels, laid with the reference ring, at the speed that the sprocket's teeth give. The link's middle
    is on the path, its x axis along it. When the record of so many ``samples`` begins, the chain has gone the way
    ``travel0``, a share of the loop. Lengths are in m.
    """
    rig = scene.rig
    path, _ = belt_around(rig)
    speed = path.length * scene.periods.loop_hz
    dx, dy = rig.sensor.x - rig.chain.link_length / 2, rig.sensor.y
    # pitch 1 starts in the middle of the strand that runs onto the sprocket, as in the dynamic loop
    start = 0.5 * (path.start[-2] + path.start[-1]) + path.length * (
        travel0 + (rig.sensor.pitch - 0.5) / rig.chain.pitches
    )
    time = np.arange(1, samples * PARTS + 1) / (rig.sensor.rate * PARTS)
    point, heading, curvature = path.along(start + speed * time)
    turn = speed * curvature
    motion = np.column_stack([-(turn**2) * dx, -speed * turn - turn**2 * dy, heading])
    mean = motion.reshape(samples, PARTS, 3).mean(axis=1)
    mean[:, 2] = motion[PARTS // 2 - 1 :: PARTS, 2]
    return motion[PARTS - 1 :: PARTS], mean, point[PARTS - 1 :: PARTS], path.length


def belt_recording(scene) -> Recording:
    """A kinematic recording: the sensor on the path of the chain, nothing else."""
    rate, pitches = scene.rig.sensor.rate, scene.rig.chain.pitches
    samples = round(scene.duration * rate)
    begin = time.perf_counter()
    raw, mean, at, length = belt_motion(scene, (scene.lead_in + scene.ramp / 2) * scene.periods.loop_hz, samples)
    wall = time.perf_counter() - begin
    empty = make_record(samples, make_state(2 * pitches, pitches, 1 + len(scene.rig.rollers)))
    empty.wheel_rate[:, SPROCKET] = scene.sprocket_rate
    same = ("gap", "cut", "wheel_rate", "energy", "force", "area", "groove", "pitches", "frame")
    return Recording(
        time=np.arange(1, samples + 1) / rate,
        raw=raw,
        mean=mean,
        place=at,
        spells=empty.spells.rows,
        begin=scene.lead_in + scene.ramp,
        frame_time=np.zeros(0),
        meta=provenance(scene, {"path_m": length}),
        wall=wall,
        **{name: getattr(empty, name) for name in same},
    ).checked()

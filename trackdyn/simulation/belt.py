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


def belt_recording(scene) -> Recording:
    """A kinematic recording: the sensor on the path of the chain, nothing else.

    Every pitch follows the path of the pins around the wheels, laid with the reference ring, at the speed that the
    sprocket's teeth give. The link's middle is on the path, its x axis along it.
    """
    rig, loop_hz, begin = scene.rig, scene.periods.loop_hz, time.perf_counter()
    rate, pitches, samples = rig.sensor.rate, rig.chain.pitches, round(scene.duration * rig.sensor.rate)
    path, _ = belt_around(rig)
    speed = path.length * loop_hz
    dx, dy = rig.sensor.x - rig.chain.link_length / 2, rig.sensor.y
    # pitch 1 starts in the middle of the strand that runs onto the sprocket, as in the dynamic loop
    travelled = (scene.lead_in + scene.ramp / 2) * loop_hz
    start = 0.5 * (path.start[-2] + path.start[-1]) + path.length * (travelled + (rig.sensor.pitch - 0.5) / pitches)
    point, heading, curvature = path.along(start + speed * (np.arange(1, samples * PARTS + 1) / (rate * PARTS)))
    turn = speed * curvature
    motion = np.column_stack([-(turn**2) * dx, -speed * turn - turn**2 * dy, heading])
    mean = motion.reshape(samples, PARTS, 3).mean(axis=1)
    mean[:, 2] = motion[PARTS // 2 - 1 :: PARTS, 2]
    empty = make_record(samples, make_state(2 * pitches, pitches, 1 + len(rig.rollers)))
    empty.wheel_rate[:, SPROCKET] = scene.sprocket_rate
    same = ("gap", "cut", "wheel_rate", "energy", "force", "area", "groove", "pitches", "frame")
    return Recording(
        time=np.arange(1, samples + 1) / rate,
        raw=motion[PARTS - 1 :: PARTS],
        mean=mean,
        place=point[PARTS - 1 :: PARTS],
        spells=empty.spells.rows,
        begin=scene.lead_in + scene.ramp,
        frame_time=np.zeros(0),
        meta=provenance(scene, {"path_m": path.length}),
        wall=time.perf_counter() - begin,
        **{name: getattr(empty, name) for name in same},
    ).checked()

"""Recording of a belt: sensors that follow the path of the chain one pitch apart, without forces."""

import time

import numpy as np

from trackdyn.model.arrays import make_record, make_state
from trackdyn.model.constants import SPROCKET
from trackdyn.rig.layout import belt_around
from trackdyn.simulation.recording import Recording, provenance
from trackdyn.simulation.settling import Layout

SUBSAMPLES = 8  # of a sample interval, for its mean


def belt_recording(scene) -> Recording:
    """Return a kinematic recording: every pitch follows the path of the pins at the speed of the sprocket's teeth.

    The middles of links and connectors are on the path, half a pitch apart, their x axes along it.
    """
    rig, loop_hz, begin = scene.rig, scene.periods.loop_hz, time.perf_counter()
    rate, pitches, samples = rig.rate, rig.chain.pitches, round(scene.duration * rig.rate)
    path, _ = belt_around(rig)
    speed = path.length * loop_hz
    # pitch 1 starts in the middle of the strand that runs onto the sprocket, as in the dynamic loop
    travelled = (scene.lead_in + scene.ramp / 2) * loop_hz
    sensors, time_s = list(scene.sensors.values()), np.arange(1, samples * SUBSAMPLES + 1) / (rate * SUBSAMPLES)
    record = make_record(samples, make_state(2 * pitches, pitches, 1 + len(rig.wheels)), len(sensors))
    rows = record.samples
    for k, sensor in reversed(list(enumerate(sensors))):
        on_link = sensor.body == "link"
        around = travelled + (sensor.pitch - (0.5 if on_link else 0.0)) / pitches
        start = 0.5 * (path.start[-2] + path.start[-1]) + path.length * around
        point, heading, curvature = path.along(start + speed * time_s)
        dx, dy = sensor.x - (rig.chain.link_length if on_link else rig.connector_length) / 2, sensor.y
        rate_of_turn = speed * curvature
        motion = np.column_stack([-(rate_of_turn**2) * dx, -speed * rate_of_turn - rate_of_turn**2 * dy, heading])
        rows.raw[:, k] = motion[SUBSAMPLES - 1 :: SUBSAMPLES]
        rows.mean[:, k] = motion.reshape(samples, SUBSAMPLES, 3).mean(axis=1)
        rows.mean[:, k, 2] = motion[SUBSAMPLES // 2 - 1 :: SUBSAMPLES, 2]
    rows.link_position[:] = point[SUBSAMPLES - 1 :: SUBSAMPLES]  # the loop ends with the first sensor
    rows.wheel_rate[:, SPROCKET] = scene.sprocket_rate
    return Recording.of_record(
        record, rate, contact_log=record.contact_log.rows, begin=scene.lead_in + scene.ramp,
        meta=provenance(scene.with_(step=scene.time_step), Layout(path_m=path.length)),
        wall=time.perf_counter() - begin,
    )  # fmt: skip

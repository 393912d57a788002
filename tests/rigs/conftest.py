"""Shipped rigs settled, and after a second of running, made once."""

from functools import cache
from math import ceil

import pytest

from trackdyn import Loop, Scene, load_rig
from trackdyn.scene.step import largest_step

SPROCKET_RPM = 30.0


def scene_of(rig, sprocket_rpm=SPROCKET_RPM, **fields):
    rpm = sprocket_rpm * rig.sprocket.transmission_ratio
    limit = largest_step(Scene(rig, rpm, step=1e-6).model, 1.2 * rig.tension.pre_tension)
    sample = 1.0 / rig.rate
    step = sample / ceil(sample / min(0.3 * limit, 1e-4))  # beyond, contacts of the M113 and the robot flip
    return Scene(rig, rpm, **{"duration": 0.5, "lead_in": 0.2, "ramp": 0.3, "step": step} | fields)


@pytest.fixture(scope="session")
def settled():
    loops = cache(lambda name: Loop(scene_of(load_rig(name))))
    return lambda name: loops(name).copy()

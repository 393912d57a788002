"""The shipped rig and loops that run on it, made once for all tests."""

import copy
from pathlib import Path

import pytest

from trackdyn.chain.kinematics import orient, place
from trackdyn.contact.loads import contact_loads
from trackdyn.integrate.run import run
from trackdyn.parameters.rig import load_rig
from trackdyn.scene import Scene
from trackdyn.settling import empty_record, settle

RIG = Path(__file__).parents[1] / "config" / "rig.yaml"
# long enough for a steady drive of the sprocket, short enough for a test
SHORT = {"duration": 0.5, "lead_in": 0.2, "ramp": 0.4}


@pytest.fixture(scope="session")
def rig_path():
    """File of the shipped rig."""
    return RIG


@pytest.fixture(scope="session")
def rig():
    """The shipped rig."""
    return load_rig(RIG)


@pytest.fixture(scope="session")
def make_scene(rig):
    """Function that makes a short scene: ``make_scene(115, ring_radius=None)``."""

    def make(motor_rpm=115.0, rig=rig, **fields):
        return Scene(rig, motor_rpm, **{**SHORT, **fields})

    return make


@pytest.fixture(scope="session")
def place_loads():
    """Function that evaluates pins, velocities and all contacts of a state anew."""

    def evaluate(model, state, work):
        orient(state.angle, work.cos, work.sin)
        place(model.chain, state, work)
        contact_loads(model, state, work)

    return evaluate


@pytest.fixture(scope="session")
def _driven():
    return {}


@pytest.fixture
def driven_loop(_driven, make_scene):
    """Function that gives model, state and work of the loop some time after the start, as own copies.

    ``driven_loop(ring_radius=0.303)``; None is a sprocket without ring.
    """

    def make(ring_radius=0.308, motor_rpm=115.0, seconds=1.0):
        key = ring_radius, motor_rpm, seconds
        if key not in _driven:
            scene = make_scene(motor_rpm, ring_radius=ring_radius)
            model, state, work, _ = settle(scene)
            scratch = empty_record(1, len(state.angle), 3)
            for _ in range(round(seconds * scene.rig.sensor.rate)):
                assert run(model, state, work, scratch, 0, 1, scene.stride) < 0
            _driven[key] = model, state, work
        return copy.deepcopy(_driven[key])

    return make

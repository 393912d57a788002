"""The step of a scene: rounded to the sample interval, halved where it fails, and refused where it is too large."""

import pytest

from tests.conftest import refused
from trackdyn import Scene, load_rig
from trackdyn.rig.rig_file import shipped_rigs
from trackdyn.scene.step import halved_steps, round_step


@pytest.mark.parametrize("rate", [1000, 1600, 3200, 44100 // 21])
@pytest.mark.parametrize("limit", [1e-3, 3.3e-4, 1e-4, 7.7e-5, 1e-6])
def test_a_step_divides_the_sample_interval_and_is_within_its_limit(rate, limit):
    steps = halved_steps(limit, 1 / rate, 3)
    for k, step in enumerate(steps):
        assert step <= limit / 2**k * (1 + 1e-9) and (1 / rate) / step == pytest.approx(round(1 / rate / step))
    assert steps[0] == round_step(limit, 1 / rate)


@pytest.mark.parametrize("name", shipped_rigs())
@pytest.mark.parametrize("fields", [{}, {"ring_radius": None}])
def test_the_step_of_a_scene_is_the_one_that_its_model_has(name, fields):
    rig = load_rig(name)
    scene = Scene(rig, 115.0, **fields)
    assert scene.step is None and scene.model.step == scene.time_step
    assert scene.model.stride * scene.time_step == pytest.approx(1 / rig.rate)
    chosen = scene.with_(step=scene.time_step)
    assert chosen.step == chosen.time_step == scene.time_step and chosen.with_(step=None) == scene
    refused(scene.with_, step=1 / rig.rate, motor_rpm=3000.0, match="too large for the")

"""Runs that stop when the answer has converged."""

import numpy as np
import pytest

from trackdyn.errors import InputError
from trackdyn.measure.convergence import Series
from trackdyn.measure.stopping import run_until


def test_the_run_stops_when_every_asked_measure_has_converged(make_scene):
    # a record that may last ten hours takes the memory of what it lasts
    answer = run_until(make_scene(210.0), {"rms": 0.01, "left_share": 0.005}, longest=36000.0)
    assert answer.converged
    seconds = len(answer.recording.time) / answer.recording.rate
    assert seconds < 10.0
    scene = answer.recording.scene
    assert 0.5 * scene.periods.loop <= answer.transient <= scene.lead_in + seconds / 2
    assert answer.recording.scene.duration == pytest.approx(seconds)
    rms = answer.measures["rms"]
    assert rms.half_width <= 0.01 * rms.value
    longer = run_until(make_scene(210.0), {"rms": 1e-9}, longest=12.0)
    assert abs(longer.measures["rms"].value - rms.value) <= 0.01 * rms.value


def test_a_bound_that_is_hit_is_said(make_scene):
    answer = run_until(make_scene(210.0), {"rms": 1e-9, "left_peak": 0.5}, longest=2.0)
    assert not answer.converged
    assert answer.reached == {"rms": False, "left_peak": False}  # no arc passes whole within two seconds
    assert len(answer.recording.time) == 2000


def test_the_transient_is_where_the_rest_scatters_least():
    """A decay of known length in front of noise: the cut comes behind most of it and leaves most of the noise."""
    rng = np.random.default_rng(2)
    values = 1.0 + 0.01 * rng.standard_normal(200)
    values[:20] += np.exp(-np.arange(20) / 5.0)
    assert 10 <= Series(values, np.arange(200)).transient() <= 40
    steady = 1.0 + 0.01 * rng.standard_normal(200)
    assert Series(steady, np.arange(200)).transient() <= 100


def test_a_measure_that_a_scene_cannot_have_is_not_reached(make_scene):
    """Nothing touches a sprocket without teeth and ring, so that no arc has a largest force."""
    answer = run_until(make_scene(210.0, ring_radius=None, tooth_contact="none"), {"left_peak": 0.1}, longest=2.0)
    assert answer.reached == {"left_peak": False}


@pytest.mark.parametrize(
    ("tolerances", "longest", "words"),
    [
        ({}, 20.0, "tolerances = {}: name measures"), ({"speed": 0.1}, 20.0, "measure = 'speed':"),
        ({"rms": 0.0}, 20.0, "tolerance = 0.0 of rms:"), ({"rms": float("nan")}, 20.0, "tolerance = nan of rms"),
        ({"rms": 0.01}, 0.5, "longest = 0.5 s:"), ({"rms": 0.01}, float("nan"), "longest = nan s:"),
        ({"rms": "2%"}, 20.0, "tolerance = '2%' of rms:"), ({"rms": 0.01}, "x", "longest = 'x' s:"),
    ],
)  # fmt: skip
def test_what_has_no_answer_is_refused(make_scene, tolerances, longest, words):
    with pytest.raises(InputError, match=words):
        run_until(make_scene(), tolerances, longest)
    with pytest.raises(InputError, match="motor_rpm = 0: a tolerance needs a loop that turns"):
        run_until(make_scene(0.0), {"rms": 0.01}, 20.0)

"""Runs that stop when the answer has converged."""

import numpy as np
import pytest

from trackdyn.errors import InputError
from trackdyn.measure.convergence import Series
from trackdyn.measure.planner import check_tolerances


def test_the_transient_is_where_the_rest_scatters_least():
    """A decay of known length in front of noise: the cut comes behind most of it and leaves most of the noise."""
    rng = np.random.default_rng(2)
    values = 1.0 + 0.01 * rng.standard_normal(200)
    values[:20] += np.exp(-np.arange(20) / 5.0)
    assert 10 <= Series(values, np.arange(200)).transient() <= 40
    steady = 1.0 + 0.01 * rng.standard_normal(200)
    assert Series(steady, np.arange(200)).transient() <= 100


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
        check_tolerances(make_scene(), tolerances, longest)
    with pytest.raises(InputError, match="motor_rpm = 0: a tolerance needs a loop that turns"):
        check_tolerances(make_scene(0.0), {"rms": 0.01}, 20.0)

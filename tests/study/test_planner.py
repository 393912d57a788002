"""The planner reads measured data: made-up data with a known answer."""

import numpy as np
import pandas as pd
import pytest

from trackdyn.errors import InputError
from trackdyn.study.accuracy.planner import parse_tolerance, plan
from trackdyn.study.accuracy.trade import COLUMNS, pareto


@pytest.fixture
def trade():
    """Errors of two scenes: cheap and rough, dear and fine, one that fails, one that is lucky."""
    rows = []
    for scene, scale in (("ring 0.308 m 115 rpm", 1.0), ("ring 0.308 m 210 rpm", 2.0)):
        for integrator, step, wall, error in (
            ("semi_implicit", 1e-5, 1.0, 1e-5),
            ("semi_implicit", 1e-4, 0.1, 1e-3),
            ("linearly_implicit", 5e-4, 0.02, 8e-3),
            ("linearly_implicit", 1e-3, 0.01, 1e-6),  # passes through zero by chance
        ):
            rows.append([scene, "ten_arcs", integrator, step, wall, wall, "rms", error * scale, False])
    rows.append(["ring 0.308 m 210 rpm", "ten_arcs", "linearly_implicit", 1e-3, np.nan, np.nan, "all", np.nan, True])
    return pd.DataFrame(rows, columns=COLUMNS)


def test_cheapest_setting_that_keeps_the_tolerance_with_its_margin(trade):
    assert plan(trade, "4%", "rms", 150, 0.308).fields == {"integrator": "linearly_implicit", "step": 5e-4}
    # the worst scene has 1.6 %: with the margin of 2 it does not promise 3 %
    assert plan(trade, "3%", "rms", 150, 0.308).fields == {"integrator": "semi_implicit", "step": 1e-4}
    assert plan(trade, 1e-4, "rms", 150, 0.308).step == 1e-5


def test_a_lucky_error_promises_nothing(trade):
    kept = trade[~trade["failed"]]
    chosen = plan(kept, "1%", "rms", 150, 0.308)
    assert (chosen.integrator, chosen.step) == ("semi_implicit", 1e-4)


def test_coarser_physics_is_planned_only_where_it_was_measured(trade):
    coarse = trade[~trade["failed"] & (trade["integrator"] == "semi_implicit")].assign(
        fidelity="three_surfaces", wall_s_per_s=0.001, error=1e-6
    )
    both = pd.concat([trade, coarse])
    assert plan(both, "3%", "rms", 115, 0.308).fidelity == "three_surfaces"
    assert plan(both, "3%", "rms", 115, 0.306).fidelity == "ten_arcs"


def test_outside_the_data_is_said(trade):
    assert plan(trade, "3%", "rms", 150, 0.308).warnings == ()
    warnings = plan(trade, "3%", "rms", 300, 0.320).warnings
    assert warnings == (
        "300 rpm lies outside the measured 115 to 210 rpm",
        "a ring of 0.32 m lies outside the measured 0.308 to 0.308 m",
    )


@pytest.mark.parametrize("bad", ["0", "2", "-1%", "much", "nan", "100%"])
def test_tolerances_that_are_none(bad):
    with pytest.raises(InputError, match=r"tolerance = .* would do"):
        parse_tolerance(bad)


def test_what_cannot_be_promised_is_refused(trade):
    with pytest.raises(InputError, match=r"tolerance = 1e-07 is not accepted for rms \(ring\)"):
        plan(trade, 1e-7, "rms", 150, 0.308)
    with pytest.raises(InputError, match="measure = 'mood'"):
        plan(trade, "1%", "mood", 150, 0.308)


def test_front_holds_what_nothing_beats(trade):
    front = pareto(trade[trade["scene"] == "ring 0.308 m 115 rpm"])
    assert list(front["wall_s_per_s"]) == [0.01]
    front = pareto(trade[(trade["scene"] == "ring 0.308 m 115 rpm") & (trade["step_s"] < 1e-3)])
    assert list(front["wall_s_per_s"]) == [0.02, 0.1, 1.0]

"""The planner reads measured data: made-up data with a known answer."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import t as student

from replication.study.accuracy.limit import difference, limit_of
from replication.study.accuracy.planner import plan, record_error
from replication.study.accuracy.trade import COLUMNS, pareto
from trackdyn.errors import InputError
from trackdyn.measure.uncertainty import batch_error
from trackdyn.measure.whole_loop import Series
from trackdyn.parameters.validation import parse_tolerance

SPAN = 0.2  # s a passage at 115 rpm


def row(scene, integrator, step, cpu, error, **more):
    """A setting that was measured, without scatter."""
    span = SPAN * 115 / float(scene.split()[-2])
    known = {"scene": scene, "fidelity": "ten_arcs", "integrator": integrator, "step_s": step, "start_cpu_s": 0.3}
    known |= {
        "cpu_s_per_s": cpu, "record_s": 8.0, "passage_s": span, "measure": "rms", "value": 1.0, "value_error": 0.0,
    }  # fmt: skip
    return known | {"error": error, "uncertainty": 0.0, "scatter": 0.0, "unused": 0, "failed": False} | more


def table(rows):
    return pd.DataFrame(rows, columns=COLUMNS)


@pytest.fixture
def trade():
    """Errors of two scenes: cheap and rough, dear and fine, one that fails, one that is lucky."""
    rows = []
    for scene, scale in (("ring 0.308 m 115 rpm", 1.0), ("ring 0.308 m 210 rpm", 2.0)):
        for integrator, step, cpu, error in (
            ("semi_implicit", 1e-5, 1.0, 1e-5),
            ("semi_implicit", 1e-4, 0.1, 1e-3),
            ("linearly_implicit", 5e-4, 0.02, 8e-3),
            ("linearly_implicit", 1e-3, 0.01, 1e-6),  # passes through zero by chance
        ):
            rows.append(row(scene, integrator, step, cpu, error * scale))
    rows.append(row("ring 0.308 m 210 rpm", "linearly_implicit", 1e-3, np.nan, np.nan, measure="all", failed=True))
    return table(rows)


def test_cheapest_setting_that_keeps_the_tolerance_with_its_margin(trade):
    assert plan(trade, "4%", "rms", 150, 0.308).fields == {"integrator": "linearly_implicit", "step": 5e-4}
    # the worst scene has 1.6 %: with the margin of 2 it does not promise 3 %
    assert plan(trade, "3%", "rms", 150, 0.308).fields == {"integrator": "semi_implicit", "step": 1e-4}
    assert plan(trade, 1e-4, "rms", 150, 0.308).step == 1e-5
    # a scene that was itself measured needs no margin, and no other scene
    assert plan(trade, "3%", "rms", 210, 0.308).step == 5e-4
    assert plan(trade, "1%", "rms", 115, 0.308).step == 1e-3


def test_a_lucky_error_promises_nothing(trade):
    kept = trade[~trade["failed"]]
    chosen = plan(kept, "1%", "rms", 150, 0.308)
    assert (chosen.integrator, chosen.step) == ("semi_implicit", 1e-4)


def test_an_error_that_is_not_certain_is_taken_at_its_upper_end(trade):
    doubtful = trade.assign(uncertainty=trade["step_s"].eq(1e-4) * 5e-3)
    assert plan(trade, "3%", "rms", 150, 0.308).step == 1e-4
    # 2 (0.2 % + 2 x 0.5 %) = 2.4 %
    assert plan(doubtful, "3%", "rms", 150, 0.308).of_setting == pytest.approx(0.024)
    assert plan(doubtful, "2%", "rms", 150, 0.308).step == 1e-5


def test_scatter_asks_for_passages_and_the_rest_of_the_tolerance(trade):
    loose = trade.assign(scatter=0.03, unused=10)
    chosen = plan(loose, "3%", "rms", 150, 0.308)
    assert chosen.of_setting + chosen.of_record <= 0.03 < chosen.of_setting + record_error(0.06, chosen.passages - 1)
    assert chosen.duration == pytest.approx((chosen.passages + 10.5) * SPAN * 115 / 150, abs=1e-3)
    # a setting with twice the error leaves less for the record
    assert plan(loose, "2.4%", "rms", 150, 0.308).passages > chosen.passages


def test_half_widths_are_those_that_batches_of_a_record_show():
    """Independent passages of unit scatter: the mean of what `batch_error` finds, to a tenth."""
    rng = np.random.default_rng(2)
    for count in (9, 30, 100):
        found = [batch_error(rng.standard_normal(count))[1] for _ in range(2000)]
        assert np.sqrt(np.mean(np.square(found))) == pytest.approx(float(record_error(1.0, count)), rel=0.1)
    assert record_error(1.0, 9) == pytest.approx(student.ppf(0.975, 2) / 3)


def test_coarser_physics_is_planned_only_where_it_was_measured(trade):
    coarse = trade[~trade["failed"] & (trade["integrator"] == "semi_implicit")].assign(
        fidelity="three_surfaces", cpu_s_per_s=0.001, error=1e-6
    )
    both = pd.concat([trade, coarse], ignore_index=True)
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
    with pytest.raises(InputError, match=r"tolerance = .*: must be between 0 and 1"):
        parse_tolerance(bad)


def test_what_cannot_be_promised_is_refused_with_the_reason(trade):
    with pytest.raises(InputError, match=r"tolerance = 1e-07 for rms \(ring\): the finest setting .* leaves 4e-05"):
        plan(trade, 1e-7, "rms", 150, 0.308)
    with pytest.raises(InputError, match=r"600 s of record still scatter by 0\.0\d+; use a larger"):
        plan(trade.assign(scatter=1.0), 1e-2, "rms", 150, 0.308)
    with pytest.raises(InputError, match="no setting ran in every scene"):
        plan(trade, "1%", "left_peak", 150, 0.308)
    with pytest.raises(InputError, match="measure = 'mood'"):
        plan(trade, "1%", "mood", 150, 0.308)


def test_front_holds_what_nothing_beats(trade):
    front = pareto(trade[trade["scene"] == "ring 0.308 m 115 rpm"])
    assert list(front["cpu_s_per_s"]) == [0.01]
    front = pareto(trade[(trade["scene"] == "ring 0.308 m 115 rpm") & (trade["step_s"] < 1e-3)])
    assert list(front["cpu_s_per_s"]) == [0.02, 0.1, 1.0]


def measured(value, scatter=0.0, seed=1):
    """A measure over 36 passages."""
    noise = np.random.default_rng(seed).standard_normal(36)
    return Series(value + scatter * (noise - noise.mean()), np.arange(36))


def test_the_limit_of_a_straight_line_is_exact_and_scatter_is_carried_to_it():
    steps = (1e-5, 2e-5, 5e-5)
    limit = limit_of({h: measured(3090.0 - 8e5 * h) for h in steps})
    assert (limit.value, limit.error) == pytest.approx((3090.0, 0.0), abs=1e-9)
    # 2 a - b of runs that scatter apart; of runs that scatter alike a
    runs = {h: measured(3090.0, 3.0, seed) for seed, h in enumerate(steps)}
    apart = limit_of(runs)
    assert apart.error == pytest.approx(np.std([2 * runs[1e-5].values - runs[2e-5].values]) / 6, rel=0.6)
    alike = limit_of({h: measured(3090.0, 3.0) for h in steps})
    assert alike.error == pytest.approx(measured(0.0, 3.0).estimate().error) != pytest.approx(apart.error)
    # and what a coarser step adds is then known far better than either value
    off, error = difference(measured(3000.0, 3.0), alike)
    assert off == pytest.approx(-90.0) and error < 1e-9
    assert difference(measured(3000.0, 3.0, 9), alike)[1] > 0.1


def test_a_passage_that_one_run_lacks_does_not_stand_beside_its_neighbour():
    values = np.sin(np.arange(37.0))
    limit = limit_of({h: Series(values, np.arange(37)) for h in (1e-5, 2e-5)})
    assert difference(Series(values[1:], np.arange(1, 37)), limit)[1] < 1e-12


def test_the_root_of_a_mean_square_is_compared_as_a_root():
    squares = Series(np.linspace(0.9, 1.1, 36), np.arange(36), root=True)
    assert squares.linear().mean() == pytest.approx(squares.estimate().value) == pytest.approx(1.0)
    assert np.ptp(squares.linear()) == pytest.approx(0.1)


def test_a_curve_shows_in_the_error_of_its_limit():
    curved = {h: measured(1.0 - 100 * h + 2e6 * h**2) for h in (1e-5, 2e-5, 5e-5)}
    limit = limit_of(curved)
    assert 0 < abs(limit.value - 1.0) < limit.error < 2e-3
    two = limit_of({h: curved[h] for h in (1e-5, 2e-5)})
    assert two.error == pytest.approx(abs(two.value - curved[1e-5].values[0]))


def test_a_method_of_second_order_is_extrapolated_as_one():
    runs = {h: measured(7.0 - 3e6 * h**2) for h in (1e-4, 2e-4, 5e-4)}
    assert limit_of(runs, 2).value == pytest.approx(7.0) and limit_of(runs, 2).error < 1e-9
    assert limit_of(runs).error > 0.01

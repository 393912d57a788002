"""The planner: errors of settings from made-up series with a known order, promises kept on a real scene."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from tests.conftest import recorded, refused
from trackdyn import Scene
from trackdyn.measure import planner
from trackdyn.measure.planner import Trial, _cheapest, _judge, _undecided, plan, steady
from trackdyn.measure.uncertainty import Estimate, Series, TotalError, drifts, judge_series
from trackdyn.measure.whole_loop import whole_loop
from trackdyn.simulation.loop import Loop

RMS = {"rms": 0.01}


def tried(step, value, integrator="semi_implicit", scatter=0.0):
    """A setting whose measure has one value in all of twelve passages, or one that scatters."""
    trial = Trial("made up", {"integrator": integrator, "step": step})
    periods = SimpleNamespace(loop=0.5, passage=1 / 12)
    scene = SimpleNamespace(integrator=integrator, rig=SimpleNamespace(rate=1000.0), periods=periods)
    trial.recorder = SimpleNamespace(loop=SimpleNamespace(model=SimpleNamespace(step=step), scene=scene), done=1000)
    trial.measures["rms"] = Series(np.full(12, value) + scatter, np.arange(12))
    return trial


@pytest.mark.parametrize(("runs", "biases", "rel"), [
    ([(step, 2.0 + 3.0 * step) for step in (1e-2, 5e-3, 2.5e-3)], [0.015, 0.0075, 0.00375], 0.01),
    ([(2e-4, 2.2, "linearly_implicit"), (1e-4, 2.0)], [0.2, 0.1], 1e-6),
])  # fmt: skip
def test_steps_of_one_method_of_order_one_are_extrapolated_and_those_of_two_methods_are_not(runs, biases, rel):
    """The limit is 2 and a step h adds 3 h, relatively 1.5 h; between methods the whole difference is in doubt."""
    runs = [tried(*run) for run in runs]
    _judge(runs, {"rms": 0.1})
    assert [run.error["rms"].bias for run in runs] == pytest.approx(biases, rel=rel)


def test_scatter_that_runs_share_is_no_error_and_their_own_is():
    noise, most = np.random.default_rng(7).normal(size=(2, 12)), []
    for rows in (noise[[0, 0]], noise):
        runs = [tried(step, 2.0 + 3.0 * step, scatter=row) for step, row in zip((1e-2, 5e-3), rows, strict=True)]
        _judge(runs, {"rms": 0.1})
        most.append(runs[1].error["rms"].bias + runs[1].error["rms"].bias_error)
    shared, own = most
    assert shared == pytest.approx(0.0075, rel=0.3) and own > 10 * shared


def test_the_cheapest_setting_that_fits_is_recorded():
    """Of records that are long enough the finest, of others the one with the least work within the longest record."""
    for difference, half_width, longest, chosen in (
        (0.001, 0.005, 20.0, 1), (0.001, 0.02, 20.0, 0),  # its error of 0.2 % leaves enough
        (0.005, 0.02, 20.0, 1),  # the error of the other one is 1 %
        (0.02, 0.005, 20.0, None), (0.001, 0.05, 20.0, None), (0.001, 0.05, 100.0, 0),
    ):  # fmt: skip
        runs = [tried(2e-4, 1.0 + difference), tried(1e-4, 1.0)]
        _judge(runs, RMS)
        for run in runs:
            run.error["rms"] = run.error["rms"]._replace(half_width=half_width, scatter=half_width)
        trial = _cheapest(runs, RMS, longest)
        assert (trial and runs.index(trial)) == chosen


def test_a_start_that_dies_away_is_not_known():
    """Batches of neighbours do not see a decay of three turns, of which the record holds one: the halves do."""
    rng, passages = np.random.default_rng(4), np.arange(36)
    for drift, seen in ((0.0, False), (0.03, True)):
        values = (1.0 + drift * np.exp(-passages / 60)) ** 2 + 1e-3 * rng.standard_normal(36)
        measures = {"rms": Series(values, passages, True)}
        assert judge_series(measures, RMS)[2] == {"rms": True}
        assert drifts(measures, RMS) == seen and not drifts(measures, {"rms": 0.1})  # within a tolerance of 10 %
    assert not drifts({"rms": Series(values[:10], passages[:10], True)}, RMS)


@pytest.mark.parametrize(("share", "settled"), [(0.98, True), (1.02, False)])
def test_turns_and_halves_are_compared_to_a_quarter_of_the_tolerance(share, settled):
    """Both sides of 0.25 % of a tolerance of 1 %; shares of a turn refer to the turn, of 100 %."""
    turns = [{"rms": 1.5 * (1 - 0.0025 * share)}, {"rms": 1.5}]
    shares = [{"left_share": 8.0}, {"left_share": 8.0 + 0.25 * share}]
    assert steady(turns, RMS) == steady(shares, {"left_share": 0.01}) == settled
    assert steady([turn | {"left_share": 8.0} for turn in turns], RMS | {"left_share": 0.01}) == settled
    assert drifts({"rms": Series(np.repeat([1.0, 1.0 + 0.0025 * share], 10), np.arange(20))}, RMS) != settled


def test_a_wait_ends_where_turns_agree_or_scatter():
    """RMS of turns of `parts` at 225 rev/min with a ring of 0.308 m, whose start takes seven turns to die away."""
    turns = [{"rms": value} for value in (1.494, 1.529, 1.557, 1.568, 1.563, 1.577)]
    assert not any(steady(turns[:count], RMS) for count in range(5))
    assert steady(turns[:5], RMS)  # it turned round
    assert steady([{"rms": 0.0}] * 2, RMS) and not steady([{}], RMS)
    assert steady([{}, {}], {"right_peak": 0.01}) and not steady([{}, {"rms": 1.0}], RMS)


def test_the_record_of_a_finer_setting_may_still_show_that_a_coarser_one_is_good_enough():
    """One that is long enough has been paid for, and a coarser one that errs is out."""
    runs = [tried(1e-4, 1.001), tried(5e-5, 1.0)]
    for run in runs:
        run.recorder.loop.scene.duration = 20.0
        run.error["rms"] = TotalError(0.001, 0.02, 0.0, 0.0)
    assert not _undecided(runs, runs[1], RMS)  # it has more than a turn of 0.5 s
    runs[1].recorder.done = 400
    assert _undecided(runs, runs[1], RMS) and not _undecided(runs, runs[0], RMS)
    runs[0].error["rms"] = TotalError(0.0081, 0.0, 0.0, 0.0)
    assert not _undecided(runs, runs[1], RMS)


def test_scatter_that_no_record_outlasts_is_refused_before_settings_are_tried():
    """A record of a second whose two errors are 20 tolerances needs 400 s: twice a longest record of 200 s."""
    trial = tried(1e-4, 1.0, scatter=np.random.default_rng(3).normal(0.0, 0.1, 12))
    value, error, _ = trial.measures["rms"].estimate()
    shorter, longer = ({"rms": 2 * error / value / 20 / np.sqrt(share)} for share in (0.98, 1.02))
    assert planner._scatter_needs(trial, shorter, 200.0) == pytest.approx(392.0)
    words = ["of rms: records of 200 s scatter by more ", " `longest: 408`"]
    refused(planner._scatter_needs, trial, longer, 200.0, words=words)


def test_settings_that_vibrate_apart_keep_the_error_of_their_common_start(monkeypatch):
    """The second look would send the planner to finer settings, whose vibrations part as well."""
    runs, looks = [tried(1e-4, 1.0), tried(5e-5, 1.0)], iter([(0.001, 0.004), (0.002, 0.02)])

    def judge(running, tolerances):
        bias, bias_error = next(looks)
        for trial in running:
            trial.error["rms"] = TotalError(bias, bias_error, 0.005, 0.005)

    for name, function in (("_judge", judge), ("_record", lambda *_: None), ("_undecided", lambda *_: True)):
        monkeypatch.setattr(planner, name, function)
    assert planner._compare(runs, RMS, 10.0, SimpleNamespace(passage=0.1, turn=1.0, loop=0.5), 60.0, 60.0) == 15.0
    assert [run.error["rms"][:2] for run in runs] == [(0.001, 0.004)] * 2


def test_a_setting_that_begins_later_is_compared_over_the_same_passages():
    """Passage by passage they differ by 1 %; passages that one of them lacks would add 50 %."""
    longer, shorter, numbers = tried(1e-4, 1.0), tried(5e-5, 1.0), np.arange(12)
    longer.measures["rms"] = Series(1.01 * (1.0 + numbers / 6), numbers)
    shorter.skipped, shorter.recorder.done = 2, 667  # eight passages
    shorter.measures["rms"] = Series(1.0 + (numbers[:8] + 2) / 6, numbers[:8])
    _judge([longer, shorter], {"rms": 0.1})
    assert shorter.error["rms"].bias == pytest.approx(0.01, rel=0.02)


def test_a_record_that_grew_beyond_its_forecast_gives_way_to_a_finer_setting_with_more_room():
    """An error of 0.9 % leaves the interval 0.1 % of a tolerance of 1 %: a finer setting with ten times the room."""
    runs = [tried(2e-4, 1.009), tried(1e-4, 1.0)]
    runs[0].error["rms"], runs[1].error["rms"] = TotalError(0.009, 0.0, 0.01, 0.01), TotalError(0.0, 0.0, 0.01, 0.01)
    runs[0].recorder.done = 20_000
    planned, grown = planner.Plan(runs[0], RMS, 10.0, 0.0, 0.0, tuple(runs)), {"rms": Estimate(1.0, 0.0015, 0.003)}
    assert planned.chosen.margins(RMS)["rms"] == pytest.approx(0.001)
    other, length = planned._cheaper(runs[0], grown)
    assert other is runs[1] and length == pytest.approx(20 * 0.3**2)
    runs[1].refused = "it diverged"
    assert planned._cheaper(runs[0], grown)[0] is runs[0]


def test_what_is_stated_stays_and_no_two_implicit_steps_judge_each_other(rig):
    ladder = [tuple(trial.fields.values()) for trial in planner.settings(Scene(rig, 115), 1e-4, True)]
    assert ladder == [("linearly_implicit", 5e-4), *(("semi_implicit", pytest.approx(1e-4 / 2**k)) for k in range(4))]
    assert [trial.fields for trial in planner.settings(Scene(rig, 115), 1e-4, False)] == [{}, {"step": 5e-5}]


@pytest.fixture(scope="module")
def limit(rig):
    """Measures of the scene at a fine step."""
    fine = Scene(rig, 210, 0.308, step=2.5e-5, duration=2.0, lead_in=2.0, every_link=True)
    return whole_loop(recorded(fine, every_link=True))


@pytest.mark.parametrize(("measure", "tolerance"), [("rms", 0.01), ("left_peak", 0.05)])
def test_a_promise_is_kept(rig, limit, measure, tolerance):
    scene = Scene(rig, 210, 0.308)
    answer = plan(scene, {measure: tolerance}).run()
    promised = answer.measures[measure]
    assert answer.converged and list(answer.measures) == [measure]
    assert abs(promised.value - limit[measure].value) <= promised.half_width <= tolerance * promised.value
    assert answer.transient >= 0.5 * scene.periods.loop
    answer.recording.checked()
    assert answer.recording.resolution.reason.startswith(f"the step was chosen for {measure};")


@pytest.mark.parametrize(("rpm", "ring", "tight"), [(210, 0.308, 0.01), (195, 0.306, 0.02)])
def test_a_looser_tolerance_takes_no_more_steps(rig, rpm, ring, tight):
    """Work in semi-implicit steps of all records, the wait included; at 195 rev/min the loop vibrates."""

    def work(tolerance):
        planned = plan(Scene(rig, rpm, ring), {"rms": tolerance})
        answer = planned.run()
        records = sum(trial.work * trial.seconds for trial in planned.tried if not trial.refused)
        return records + answer.transient / planned.chosen.recorder.loop.model.step

    assert work(0.05) <= work(tight) * (1 + 1e-9)


def test_scatter_is_not_fought_with_a_smaller_step_and_the_clock_chooses_nothing(rig, monkeypatch):
    """Over a few passages this content scatters more than steps change it. Compilation takes CPU time, too."""
    scene, tolerances = Scene(rig, 200, 0.3065), {"high_frequency": 0.02}
    planned = plan(scene, tolerances)
    assert planned.scene.step > 2e-5
    clock = itertools.accumulate(itertools.cycle([0.0, 1000.0, 1.0, 0.01]))
    monkeypatch.setattr(Loop, "clock", staticmethod(lambda: next(clock)))
    again = plan(scene, tolerances)
    assert again.chosen.fields == planned.chosen.fields and again.duration == planned.duration


def test_a_tolerance_that_nothing_keeps_is_refused(rig):
    words = ["1e-06 of rms: records of 5 s scatter by more than that; use a larger one"]
    refused(plan, Scene(rig, 115, 0.308), {"rms": 1e-6}, words=words, longest=5.0, method=False)
    finest = tried(1e-4, 1.0)
    for bias, reason in ((0.0081, "the best setting has an error of 0.0081; use at least 0.01"), (0.0079, "scatter")):
        finest.error["rms"] = TotalError(bias, 0.0, 0.1, 0.1)
        assert reason in planner._refusal([finest], RMS, 5.0)


def test_the_transient_is_where_the_rest_scatters_least():
    """A decay of known length in front of noise: the cut comes behind most of it and leaves most of the noise."""
    still, number = 1.0 + 0.01 * np.random.default_rng(2).standard_normal((2, 200)), np.arange(200)
    assert 10 <= Series(still[0] + np.exp(-number / 5.0) * (number < 20), number).transient() <= 40
    assert Series(still[1], number).transient() <= 100


@pytest.mark.parametrize(("tolerances", "longest", "words"), [
    ({}, 20.0, "tolerances = {}: name measures"), ({"speed": 0.1}, 20.0, "measure = 'speed':"),
    ({"rms": 0.0}, 20.0, "tolerance of rms = 0: must be"), ({"rms": float("nan")}, 20.0, "tolerance of rms = nan"),
    (RMS, 0.5, "longest = 0.5: must be between"), (RMS, float("nan"), "longest = nan"),
    ({"rms": "2%"}, 20.0, "tolerance of rms = '2%': must"), (RMS, "x", "longest = 'x': must be"),
])  # fmt: skip
def test_what_has_no_answer_is_refused(make_scene, tolerances, longest, words):
    refused(planner.check_tolerances, make_scene(), tolerances, longest, words=[words])
    words = ["motor_rpm = 0: passages need a loop that turns"]
    refused(planner.check_tolerances, make_scene(0.0), RMS, 20.0, words=words)

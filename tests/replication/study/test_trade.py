"""The study of accuracy against cost on made-up runs whose limits, errors and scatter are known."""

from itertools import combinations, count

import numpy as np
import pandas as pd
import pytest
from matplotlib.text import Text

from tests.conftest import ROOT, refused
from trackdyn.inputs.errors import DivergenceError
from trackdyn.measure.uncertainty import STEP_ERRORS, Series
from trackdyn.model.arrays import SAMPLED
from trackdyn.scene.scene import Periods
from trackdyn.simulation.loop import Loop
from trackdyn_replication.report.figures.trade import answers, trade_figure
from trackdyn_replication.study.accuracy import default_step, shared_loop, trade
from trackdyn_replication.study.accuracy.shared_loop import SharedLoop
from trackdyn_replication.study.settings import StatisticErrors

REQUESTED = {
    "scenes": [[115.0, 0.308], [210.0, 0.308]], "loop_turns": 1, "loop_turns_without_ring": 1,
    "steps_s": {"semi_implicit": [1e-5, 2e-5, 5e-5, 1e-4], "linearly_implicit": [5e-4], "rk4": [5e-5]},
    "coarse_steps_s": {"semi_implicit": [1e-4]},
}  # fmt: skip
# error that a step adds, relative and a second of step
SLOPES = {"semi_implicit": -200.0, "linearly_implicit": 400.0, "rk4": 0.0}


def made_up(scene, count):
    """RMS 1 g and peaks of 1000 N at a step of zero, that scatter alike in every run; three surfaces add 3 %."""
    if scene.integrator == "linearly_implicit" and scene.motor_rpm > 200:
        raise DivergenceError("made to fail")
    factor = 1 + SLOPES[scene.integrator] * scene.time_step + 0.03 * (scene.tooth_contact == "three_surfaces")
    noise = np.random.default_rng(4).standard_normal(count)
    number = np.arange(count)
    return {
        "rms": Series(factor**2 * (1 + 0.002 * noise) ** 2, number, root=True),
        "left_peak": Series(1000 * factor * (1 + 0.01 * noise), number),
        "ring_share": Series(np.full(count, 48.0), number),
        "right_share": Series(np.zeros(count), number),
        "loop_gap": Series(np.array([1e-14]), np.array([0])),
    }


@pytest.fixture
def study(rig, monkeypatch):
    def answer(scene):
        span = Periods.at(rig, scene.motor_rpm).passage
        return trade.AnswerCost(made_up(scene, int(scene.duration / span + 1e-6)), 0.3, 6e-6 / scene.time_step)

    monkeypatch.setattr(trade, "simulate", lambda scene: made_up(scene, 1))
    monkeypatch.setattr(trade, "run_answer", answer)
    return trade.statistic_trade(rig, StatisticErrors(**REQUESTED))


def test_errors_are_those_of_the_step_though_runs_scatter_more(study):
    peaks = study[(study["measure"] == "left_peak") & (study["scene"] == "ring 0.308 m 115 rpm")]
    peaks = peaks.set_index(["fidelity", "integrator", "step_s"])
    # the limit over steps is that of another method, whose step adds nothing here
    for setting, error in {
        ("ten_arcs", "semi_implicit", 1e-4): 0.02, ("three_surfaces", "semi_implicit", 1e-4): 0.01,
        ("ten_arcs", "linearly_implicit", 5e-4): 0.2, ("ten_arcs", "rk4", 5e-5): 0.0,
    }.items():  # fmt: skip
        assert peaks.loc[setting, "error"] == pytest.approx(error, abs=1e-6)
    # one passage scatters by 1 %, 35 of them would hide the difference of two steps; paired they do not
    standard = peaks.loc[("ten_arcs", "semi_implicit", 1e-4)]
    assert 0.003 < standard["scatter"] < 0.03 and standard["uncertainty"] < 0.05 * standard["scatter"]
    assert study.loc[study["measure"] == "loop_gap", "error"].eq(1e-14).all()


def test_what_fails_is_a_row_and_a_scene_without_a_limit_is_refused(study, rig, monkeypatch):
    failed = study[study["failed"] & (study["fidelity"] == "ten_arcs")].drop_duplicates(["scene", "measure"])
    names = failed[["scene", "integrator", "measure"]].values.tolist()
    assert names == [["ring 0.308 m 210 rpm", "linearly_implicit", "all"]]
    trade_run = trade.run_answer

    def refuses(scene):
        if scene.time_step > 5e-5:
            raise DivergenceError("made to fail")
        return trade_run(scene)

    monkeypatch.setattr(trade, "run_answer", refuses)
    requested = StatisticErrors(**REQUESTED | {"steps_s": {"semi_implicit": [1e-4, 5e-5]}})
    refused(trade.statistic_trade, rig, requested, words=["fewer than two steps of semi_implicit ran"])


def test_the_default_step_of_an_included_rig_is_judged_by_its_halves_and_written_as_the_program_reads_it(monkeypatch):
    def measures(scene):
        """Errors grow with the ring."""
        values = made_up(scene, 20)
        times = 1 + 10 * ((scene.ring_radius or 0.29) - 0.29)
        peak = Series(1000 + times * (values["left_peak"].values - 1000), np.arange(20))
        return {"rms_g": values["rms"], "left_peak_n": peak, "ring_share_pct": values["ring_share"]}

    monkeypatch.setattr(default_step, "simulate", lambda scene: scene)
    monkeypatch.setattr(default_step, "measures_of", measures)
    speeds = {default_step.RING: (115.0,), default_step.NONE: (115.0,)}
    rows = default_step.default_step_errors(["bench", "m113"], speeds)
    radii = rows.groupby("rig")["ring_radius_m"]
    assert radii.nunique().to_dict() == {"bench": 4, "m113": 3}  # one has its own ring
    assert radii.apply(lambda of_rig: of_rig.isna().any()).all()
    bench = rows[(rows["rig"] == "bench") & (rows["ring_radius_m"] == 0.308)].set_index("measure").loc["rms_g"]
    assert bench["step_s"] == 1e-4 and bench["error"] == pytest.approx(-0.02, abs=1e-4)
    table = default_step.step_errors(rows).set_index("columns")
    assert list(table.index) == list(STEP_ERRORS)
    assert 0.0199 < table.loc["(rms|sd|mean)_g", "with_ring"] <= 0.021
    largest = rows[rows["measure"] == "left_peak_n"].set_index("ring_radius_m")["error"].abs().max() / 1000
    peaks = table.loc["(left|right|ring)_peak_n", "with_ring"]
    assert 0.02 < largest <= peaks <= 1.1 * largest  # rounded up, of the tightest ring
    assert (table.loc["(left|right|ring)_share_pct"] == 0).all()
    text = default_step.default_step_text(rows)
    assert "with a ring, at 115 rpm have errors (+- standard error) of at most: RMS 2 +- " in text


def test_loops_that_share_their_motion_give_the_same_bytes_and_count_their_cost_each_time(make_scene, monkeypatch):
    def record(kind):
        """Two records in turn, the second from a copy with half the step."""
        loop = kind(make_scene(step=1e-4, every_link=True))
        loop.advance(0.3)
        first = loop.record(0.5, every_link=True)
        second = loop.changed(step=5e-5).record(0.3, every_link=True)
        return [getattr(record, name) for record in (first, second) for name in (*SAMPLED, "contact_log")]

    own, fills = record(Loop), []
    compute = Loop.fill
    monkeypatch.setattr(Loop, "fill", lambda *arguments, **changes: (fills.append(1), compute(*arguments, **changes)))
    monkeypatch.setattr(shared_loop, "process_time", count().__next__)  # a second a call
    computed, begin = record(SharedLoop), SharedLoop.clock()
    monkeypatch.setattr(Loop, "fill", None)  # nothing is computed again
    shared, end = record(SharedLoop), SharedLoop.clock()
    assert end - begin == len(fills) + 1
    for expected, *others in zip(own, computed, shared, strict=True):
        assert all(other.tobytes() == expected.tobytes() for other in others)


def test_one_picture_has_one_scene_and_names_that_lie_on_no_other_and_within_their_panel():
    """A point of another scene, which the planner is judged on, is not drawn."""
    rows, promises = (pd.read_csv(ROOT / "docs" / "measured" / name) for name in ("trade.csv", "planner.csv"))
    scene, promised = "ring 0.308 m 115 rpm", "ring 0.306 m 195 rpm"
    assert set(promises["scene"]) == {promised} and rows["scene"].nunique() > 1
    figure = trade_figure(rows, promises)
    axis, below = figure.axes
    assert scene in axis.get_title("left") and promised in below.get_title("left")
    here = answers(rows[rows["scene"] == scene])["cpu_s"].tolist()
    assert {x for line in axis.lines for x in line.get_xdata()} <= set(here)
    figure.draw_without_rendering()
    for axis in figure.axes:
        panel = axis.get_window_extent()
        boxes = [Text.get_window_extent(text) for text in axis.texts if text.get_visible()]
        assert boxes and all(panel.x0 < box.x0 and box.x1 < panel.x1 for box in boxes)
        assert not any(first.overlaps(second) for first, second in combinations(boxes, 2))

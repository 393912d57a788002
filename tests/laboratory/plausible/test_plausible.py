"""Plausible tracks: what is drawn, how a row is judged beside a long run, shares, and values that separate."""

import numpy as np
import pandas as pd
import pytest

from laboratory.plausible.draws import EQUAL_PITCH, drawn_rigs, neighbours
from laboratory.plausible.revolution import summary
from laboratory.plausible.settings import load_plausible
from laboratory.plausible.shares import DEPENDS, FOLLOWS, NEVER, NOT_JUDGED, separating_values, shares, tooth_detail
from laboratory.plausible.study import judged_claims
from laboratory.plausible.verdicts import judge_rows
from trackdyn.measure.sensor import whole_samples
from trackdyn.scene.scene import Periods, Scene
from trackdyn.simulation.simulate import simulate
from trackdyn.sweeps.engine import without_values
from trackdyn.sweeps.sweep_row import run_values

CONFIG = load_plausible("config/plausible.yaml")
CLAIMS = "config/claims.yaml"


def test_a_point_is_one_track_in_every_scenario_within_the_ranges_of_real_parts():
    """But for the slipping ring; fewer draws are the first of more."""
    few, drawn = (list(drawn_rigs(CONFIG.model_copy(update={"draws": count}))) for count in (2, 4))
    assert [track.values for track in few] == [track.values for track in drawn[: len(few)]]
    assert [track.draw for track in drawn] == [k for k in range(4) for _ in CONFIG.scenarios]
    grips, slips, polygon = drawn[:3]
    assert {name for name in grips.values if grips.values[name] != slips.values[name]} == set(CONFIG.ring["slips"])
    assert {name for name in grips.values if grips.values[name] != polygon.values[name]} == {EQUAL_PITCH}
    for track in drawn:
        low, high = CONFIG.equal_pitch_m[track.scenario.equal_pitch]
        assert low <= track.values[EQUAL_PITCH] <= high
        assert (track.rig is None) == bool(track.reason)
        for unknown in CONFIG.drawn_unknowns().unknowns:
            if unknown.of is None and not (track.scenario.ring == "slips" and unknown.label in CONFIG.ring["slips"]):
                edge = 1e-9 * max(abs(unknown.low), abs(unknown.high))
                assert unknown.low - edge <= track.values[unknown.label] <= unknown.high + edge, unknown.label


def test_neighbours_move_every_fitted_value_wheels_and_equal_pitch_included():
    near = CONFIG.near.model_copy(update={"rigs": 2})
    rig, *others = neighbours(CONFIG.model_copy(update={"near": near}))
    for other in others:
        for name in (EQUAL_PITCH, "idler.x", "road_wheel.y", "groove.r2", "bushing.loss_factor"):
            assert 0 < abs(other.value(name) / rig.value(name) - 1) <= CONFIG.near.share, name


def judged(**columns) -> pd.DataFrame:
    """Twenty tracks a scenario with columns of verdicts."""
    rows = [scenario._asdict() for scenario in CONFIG.scenarios for _ in range(20)]
    return pd.DataFrame(rows).assign(
        **{name: np.tile(values, len(CONFIG.scenarios)) for name, values in columns.items()}
    )


@pytest.mark.parametrize(
    ("count", "kind", "low", "high"),
    [(20, FOLLOWS, 0.861, 1.0), (18, FOLLOWS, 0.717, 0.982), (17, DEPENDS, 0.656, 0.958), (0, NEVER, 0.0, 0.139)],
)
def test_a_share_has_its_interval_and_its_class(count, kind, low, high):
    """Bounds of Clopper and Pearson at 90 % as tables have them."""
    table = shares(CONFIG, judged(**{"1": np.arange(20) < count}), {"1": "a sentence", "2": "another"})
    first = table[table["name"] == "1"]
    assert (first["class"] == kind).all() and first["share"].tolist() == [count / 20] * len(CONFIG.scenarios)
    assert first["low"].iloc[0] == pytest.approx(low, abs=5e-4) and first["high"].iloc[0] == pytest.approx(
        high, abs=5e-4
    )
    assert (table[table["name"] == "2"]["class"] == NOT_JUDGED).all()


def test_one_scenario_that_shows_less_makes_a_sentence_depend():
    table = judged(**{"1": np.ones(20)})
    table.loc[table["ring"] == "slips", "1"] = 0.0
    assert set(shares(CONFIG, table, {"1": "a sentence"})["class"]) == {DEPENDS}


def test_the_value_that_decides_is_named_and_chance_is_not():
    random = np.random.default_rng(3)
    mass, noise = random.uniform(6, 20, 80), random.uniform(0, 1, 80)
    table = judged(**{"1": np.zeros(20)}).assign(**{"1": (mass > 13).astype(float), "mass": mass, "noise": noise})
    named = separating_values(table, ["1"], ["mass", "noise"])
    assert named["value"].tolist() == ["mass"]
    assert named["median_not"][0] < 13 < named["median_shown"][0] and named["correlation"][0] > 0.7


def test_tooth_detail_is_the_change_from_ten_arcs_to_three_surfaces():
    values = {"ten_arcs": {"115 none": {"rms_g": 2.0}}, "three_surfaces": {"115 none": {"rms_g": 2.1}}}
    table = tooth_detail([(4, values)], [115], [None])
    assert table["change_pct"].tolist() == pytest.approx([5.0]) and table["draw"].tolist() == [4]


def test_a_track_that_cannot_be_built_stands_in_the_table_with_its_reason():
    first = next(drawn_rigs(CONFIG))._replace(rig=None, reason="no loop")
    table = judge_rows(CONFIG, [first], [without_values("", "refused", "no loop")], judged_claims(CLAIMS), {})
    assert table["reason"].tolist() == ["no loop"] and "1" not in table


def test_eight_passages_of_all_connectors_say_what_a_long_run_says(rig):
    """Within three samples of a turn, and 1 % of forces or 1 N, of the passages of a record of 6.4 s."""
    fields = {"rig": rig, "motor_rpm": 115, "ring_radius": 0.308, "step": 1e-4, "integrator": "linearly_implicit"}
    fields["pitches"] = list(range(1, rig.chain.pitches + 1))
    wait = {"ramp": CONFIG.row.ramp_s, "lead_in": CONFIG.row.lead_in_s}
    duration = whole_samples(1000, CONFIG.row.passages * Periods.at(rig, 115).passage) + 0.002
    short, times = summary(simulate(Scene(**fields, **wait, duration=duration, contact_log=False)))
    known = run_values(simulate(Scene(**fields, **wait, duration=6.4)))
    for side in ("left", "right", "ring"):
        assert short[f"{side}_share_pct"] == pytest.approx(known[f"{side}_share_pct"], abs=0.1)
        assert short[f"{side}_rms_n"] == pytest.approx(known[f"{side}_rms_n"], rel=0.01, abs=1.0)
    assert known["left_share_pct"] > 1 and short["left_areas"] == known["left_areas"]
    for event in ("left touches", "ring left", "out"):
        assert times[event] == pytest.approx(known[f"event {event}"], abs=0.003)

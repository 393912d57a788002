"""Plausible tracks: draws, verdicts of rows, shares, maps, and values that separate."""

import numpy as np
import pandas as pd
import pytest

from laboratory.plausible import study
from laboratory.plausible.draws import EQUAL_PITCH, SEAT, TIP, drawn_rigs, neighbours, scenes
from laboratory.plausible.rows import run_rig
from laboratory.plausible.settings import load_plausible
from laboratory.plausible.study import CREEP, ENGAGED, NOT_JUDGED, mobilised_table, separating_values, shares
from laboratory.plausible.verdicts import JAMMED, Judge
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.simulate import simulate
from trackdyn.sweeps.engine import DONE, REFUSED, without_values
from trackdyn.sweeps.sweep_row import run_values

CONFIG = load_plausible("config/plausible.yaml")


def test_a_point_is_one_track_with_its_own_equal_pitch_and_ring_within_the_ranges():
    """Fewer draws are the first of more."""
    few, drawn = (list(drawn_rigs(CONFIG.model_copy(update={"draws": count}))) for count in (2, 8))
    assert [track.values for track in few] == [track.values for track in drawn[: len(few)]]
    assert len({track.values[EQUAL_PITCH] for track in drawn}) == len(drawn)
    assert len({track.values["ring_contact.transition_velocity"] for track in drawn}) == len(drawn)
    for track in drawn:
        assert (track.rig is None) == bool(track.reason)
        for unknown in CONFIG.drawn_unknowns().unknowns:
            if unknown.of is None:
                edge = 1e-9 * max(abs(unknown.low), abs(unknown.high))
                low = track.values[SEAT] if unknown.label == TIP else unknown.low
                assert low - edge <= track.values[unknown.label] <= unknown.high + edge, unknown.label


def test_neighbours_move_every_fitted_value_wheels_included_and_equal_pitch_by_its_rounding():
    near = CONFIG.near.model_copy(update={"rigs": 2})
    rig, *others = neighbours(CONFIG.model_copy(update={"near": near}))
    for other in others:
        for name in ("idler.x", "road_wheel.y", "groove.r2", "bushing.loss_factor"):
            assert 0 < abs(other.value(name) / rig.value(name) - 1) <= CONFIG.near.share, name
        assert 0 < abs(other.value(EQUAL_PITCH) - rig.value(EQUAL_PITCH)) <= CONFIG.near.equal_pitch_m


def judged(**columns) -> pd.DataFrame:
    """Twenty tracks that ran, of which the first ten are engaged, with columns of verdicts."""
    return pd.DataFrame({"state": DONE, "engaged": np.arange(20) < 10, **columns})


@pytest.mark.parametrize(("count", "kind", "low", "high"), [
    (20, study.FOLLOWS, 0.861, 1.0), (18, study.FOLLOWS, 0.717, 0.982), (17, study.DEPENDS, 0.656, 0.958),
    (0, study.NEVER, 0.0, 0.139),
])  # fmt: skip
def test_a_share_has_its_interval_and_its_class(count, kind, low, high):
    """Bounds of Clopper and Pearson at 90 % as tables have them."""
    table = shares(CONFIG, judged(**{"1": (np.arange(20) < count).astype(float)}), {"1": "a sentence", "2": "another"})
    row = table[table["name"] == "1"].iloc[0]
    assert row["class"] == kind and row["share"] == count / 20
    assert row[["low", "high"]].tolist() == pytest.approx([low, high], abs=5e-4)
    assert (table.loc[table["name"] == "2", "class"] == NOT_JUDGED).all()


def test_starts_that_differ_decide_nothing_and_engaged_tracks_are_counted_apart():
    verdicts = np.where(np.arange(20) < 5, np.nan, 0.0)
    verdicts[5:10] = 1.0
    table = shares(CONFIG, judged(**{"1": verdicts}), {"1": "a sentence"}).set_index("tracks")
    assert table.loc["all", ["decided", "undecided", "shown"]].tolist() == [15, 5, 5]
    assert table.loc[ENGAGED, ["decided", "undecided", "shown"]].tolist() == [5, 5, 5]
    # of the decided ones; bounds are of all, the undecided as no and as yes
    assert table.loc["all", ["share", "least", "most"]].tolist() == pytest.approx([1 / 3, 5 / 20, 10 / 20])
    assert table.loc[ENGAGED, ["share", "least", "most"]].tolist() == pytest.approx([1.0, 0.5, 1.0])
    refused = judged(**{"1": np.ones(20)}).assign(state=REFUSED)
    assert shares(CONFIG, refused, {"1": "a sentence"})["class"].eq(NOT_JUDGED).all()


def test_a_map_counts_every_track_once():
    random = np.random.default_rng(5)
    table = judged(**{"1": (np.arange(20) % 2).astype(float)})
    table = table.assign(**{EQUAL_PITCH: random.uniform(0.3015, 0.3085, 20), CREEP: random.uniform(0.2, 80, 20)})
    counted = study.share_map(table, ["1"])
    assert counted["decided"].sum() == 20 and counted["shown"].sum() == 10 and len(counted) == 16


def test_the_value_that_decides_is_named_and_chance_is_not():
    """Nor a value of the ring for a sentence without one."""
    random = np.random.default_rng(3)
    mass, creep = random.uniform(6, 20, 80), random.uniform(0.2, 80, 80)
    table = pd.DataFrame({"state": DONE, "1": mass > 13, "2": random.integers(0, 2, 80), "5": creep > 30})
    table = table.assign(mass=mass, **{CREEP: creep}).astype({"1": float, "5": float})
    sentences = {"1": "a sentence", "2": "chance", "5": "Ring: free"}
    named = separating_values(table, sentences, ["mass", CREEP], 1)
    assert named[["name", "value"]].values.tolist() == [["1", "mass"], ["5", CREEP]]
    assert named["median_not"][0] < 13 < named["median_shown"][0] and named["correlation"][0] > 0.7
    assert separating_values(table, {"5": "No ring: both arcs"}, [CREEP, "mass"], 1).empty


def test_a_row_is_judged_from_two_starts_unless_its_chain_jams():
    """A sentence that only one start shows is not decided; a track that cannot be built has a row with its reason."""
    small = CONFIG.model_copy(update={"radii_m": {115.0: [0.303, 0.304, 0.305, 0.308, 0.313]}})
    rig, judge = load_rig("parts"), Judge(small, "config/claims.yaml")
    values = run_rig(rig.model_dump(), scenes(small), small.scene, small.row.model_dump())
    assert len(values["starts"]) == len(small.row.starts) == 2
    one = {"state": DONE, "values": {"starts": values["starts"][:1]}}
    single = judge.rig(one, rig)
    for number in (7, 9, 10, 14):
        parts = [single[claim.name] for claim in judge.claims if claim.sentence == number]
        assert single[str(number)] == min(parts)
    free, caught, jammed = (
        {name: scene | changes for name, scene in values["starts"][0].items()}
        for changes in ({"right_share_pct": 0.0}, {"right_share_pct": 9.0}, {"ring_share_pct": 0.0})
    )
    both = judge.rig({"state": DONE, "values": {"starts": [free, caught]}}, rig)
    assert np.isnan(both["19"]) and both["10"] == single["10"]
    track = next(drawn_rigs(CONFIG))._replace(rig=rig)
    for of, row, known in (
        (track, {"state": DONE, "reason": "", "values": {"starts": [jammed]}}, {"state": JAMMED}),
        (track._replace(rig=None, reason="no loop"), without_values("", REFUSED, "no loop"), {"reason": "no loop"}),
    ):
        table = judge.tracks([of], [row])
        assert known.items() <= table.iloc[0].to_dict().items() and not {"1", "19"} & {*table}


def test_mobilised_friction_rises_with_the_creep_slope_up_to_the_static_friction():
    """Below creep it is in proportion to the slope, as Eq. 10 is at small slip: within a third for a factor of 2."""
    small = CONFIG.model_copy(update={"radii_m": {115.0: [0.308]}, "row": CONFIG.with_one_start.row})
    table = mobilised_table(small, load_rig("paper"), [0.1, 0.2, 20.0])
    low, double, grips = table["mobilised_friction"]
    assert table["transition_velocity"].tolist() == pytest.approx([3.0, 1.5, 0.015])
    assert double / low == pytest.approx(2.0, rel=0.33) and double < 0.1 < grips < 0.3


def test_a_ring_that_touches_nothing_runs_as_none(rig):
    """Also at a speed that has no run without a ring."""
    row = CONFIG.row.model_dump() | {"steps_s": [1e-4], "starts": [{"ramp_s": 0.3, "wait_s": 0.05}], "passages": 1}
    rings = (Scene.ring_range(rig)[0] - 0.001, None)
    small, none = (run_rig(rig.model_dump(), [[210, ring, False]], {}, row)["starts"][0] for ring in rings)
    assert [*small.values()] == [none["210 none"]]


def test_passages_of_all_connectors_agree_with_a_long_run(rig):
    """Within three samples of a turn, and 1 % of forces or 1 N, of the passages of a record of 6.4 s."""
    row = CONFIG.with_one_start.row.model_dump() | {"steps_s": [1e-4], "passages": 8}
    values = run_rig(rig.model_dump(), [[115, 0.308, True]], {}, row)["starts"][0]["115 0.308"]
    times = {"step": 1e-4, "ramp": 0.3, "lead_in": 5.0, "duration": 6.4}
    known = run_values(simulate(Scene(rig, 115, 0.308, **times, pitches=list(range(1, rig.chain.pitches + 1)))))
    for side in ("left", "right", "ring"):
        assert values[f"{side}_share_pct"] == pytest.approx(known[f"{side}_share_pct"], abs=0.1)
        assert values[f"{side}_rms_n"] == pytest.approx(known[f"{side}_rms_n"], rel=0.01, abs=1.0)
    assert known["left_share_pct"] > 1 and values["left_areas"] == known["left_areas"]
    for event in ("left touches", "ring left", "out"):
        assert values[f"event {event}"] == pytest.approx(known[f"event {event}"], abs=0.003)

"""The map from assumptions to claims: its file, refits within ranges, evidence of rows, verdicts by assumption."""

import json
from pathlib import Path

import numpy as np
import pytest

from trackdyn.errors import InputError, TrackdynError
from laboratory.inference import assumptions as rooms
from laboratory.inference.assumptions import BASE, FAILED, YARDSTICK, Alternative, AssumptionsConfig, Named, changed_rig, evidence, judge_assumption, load_assumptions, named, nearest, parameters_of, run_assumption, run_rows
from laboratory.inference.fit import FitConfig
from laboratory.inference.unknowns import Unknown, file_ranges
from replication.paper.claims import NOT_REPRODUCED, REPRODUCED, load_claims
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml
from laboratory.studies.departures import run_in_a_copy
from trackdyn.sweeps.store import DIVERGED, DONE

CONFIG = Path(__file__).parents[2] / "config"
RIG = load_rig(CONFIG / "rig.yaml")
SPEEDS, RADII = [115.0, 210.0], [0.304, 0.305, 0.308, 0.313]
BASE_OF_ALL = Named(BASE, "", "", Alternative())


@pytest.fixture(scope="module")
def config():
    return load_assumptions(CONFIG / "assumptions.yaml")


@pytest.fixture(scope="module")
def fit():
    return validated(FitConfig, read_yaml(CONFIG / "fit.yaml"), "fit.yaml")


@pytest.fixture(scope="module")
def claims():
    return load_claims(CONFIG / "claims.yaml")


def invented(**changes):
    """Rows by which the claims on shares and contacts come out; ``changes`` by case, such as ``at_115_0308``."""
    rows = []
    for rpm in SPEEDS:
        for ring in (None, *RADII):
            ringless = ring is None
            row = {"rpm": rpm, "ring_radius_m": ring, "state": DONE, "reason": "", "left_areas": "2",
                   "right_areas": "7" if ringless else "none", "left_share_pct": 45.0 if ringless else 9.0,
                   "right_share_pct": 44.0 if ringless else 3.0 if ring < 0.305 else 0.0, "ring_share_pct": 49.0,
                   "left_rms_n": 400.0 if ringless else 200.0, "left_sd_n": 300.0 if ringless else 150.0,
                   "right_sd_n": 300.0, "right_rms_n": 0.0, "left_rms_contact_n": 900.0 if ringless else 800.0,
                   "ring_rms_n": 500.0, "ring_sd_n": 250.0, "left_phase_start": 0.0, "right_phase_start": 0.01,
                   "left_phase_end": 0.45, "right_phase_end": 0.451, "event first left": 0.004 * 115 / rpm,
                   "event first right": 0.0}  # fmt: skip
            name = f"at_{rpm:g}_" + ("none" if ringless else f"{ring:g}".replace(".", ""))
            rows.append(row | changes.get(name, {}))
    return {"rig": RIG.model_dump(), "rows": rows}


def judged(found, config, claims, one=BASE_OF_ALL):
    return judge_assumption(one, found, claims, config).set_index(["claim", "rpm"])


def whole(table, claim):
    return table.loc[claim][np.isnan(table.loc[claim].index)].iloc[0]


def test_names_of_files_differ_and_lead_back(config):
    for form in ("full", "short"):
        slugs = [one.slug for one in config.assumptions(form)]
        assert len(set(slugs)) == len(slugs)
        assert slugs[0] == BASE
        assert all(named(config, form, slug).slug == slug for slug in slugs)
    assert YARDSTICK.replace(" ", "_") in [one.slug[: len(YARDSTICK)] for one in config.assumptions("full")]
    with pytest.raises(InputError, match="drag_law_rolling"):
        named(config, "full", "drag_law_rolling")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"groups": [{"name": BASE, "base": "a", "others": {"b": {}}}]}, "none is 'base'"),
        ({"groups": [{"name": "drag", "base": "a", "others": {"a": {}}}]}, "a is the base's"),
        ({"speed_rpm": 120}, "hold speed_rpm"),
    ],
)
def test_a_file_that_does_not_fit_together_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        validated(AssumptionsConfig, read_yaml(CONFIG / "assumptions.yaml") | change, "assumptions.yaml")


def test_what_an_alternative_sets_or_replaces_is_not_fitted(config, fit):
    every = {name for unknown in fit.parameters for name in unknown.names}
    for one in config.assumptions("full"):
        kept = [name for unknown in parameters_of(one.alternative, fit) for name in unknown.names]
        assert len(set(kept)) == len(kept)
        assert not {*one.alternative.rig} & {*kept}
        left = {name for u in fit.parameters if {*u.names} & {*one.alternative.without} for name in u.names}
        assert every - {*kept} <= {*one.alternative.rig} | left


def test_a_value_outside_its_range_says_so(config):
    """And no other stands in the map: what a group sets or lets vary is what the part can be."""
    ranges = file_ranges(CONFIG / "rig.yaml")
    for one in config.assumptions("full"):
        set_to = {name: (v, v) for name, v in one.alternative.rig.items() if not isinstance(v, list)}
        free = {u.names[0]: (u.low, u.high) for u in one.alternative.unknowns if u.of is None}
        beyond = [
            name
            for name, (low, high) in (set_to | free).items()
            if name != "sprocket.equal_pitch_radius" and not ranges[name][0] <= low <= high <= ranges[name][1]
        ]
        assert bool(beyond) == bool(one.alternative.outside), (one.slug, beyond)


def test_the_mirror_image_is_its_own_inverse(config):
    mirrored = named(config, "short", "run_direction_descending").alternative
    once = changed_rig(RIG, mirrored)
    assert once.idler.x == -RIG.idler.x
    again = changed_rig(once, mirrored)
    assert {name: field.value for name, field in again.fields.items()} == pytest.approx(
        {name: field.value for name, field in RIG.fields.items()}
    )


def test_a_reading_brings_the_rig_into_its_range(config):
    polygonal = named(config, "full", "equal_pitch_of_0.308_m_polygonal").alternative
    assert changed_rig(RIG, polygonal).sprocket.equal_pitch_radius == pytest.approx(0.3075)
    assert nearest(Unknown(names=["a.b"], ranges=[[1.0, 2.0], [5.0, 6.0]]), 4.5) == 5.0
    assert nearest(Unknown(names=["a.b"], ranges=[[1.0, 2.0], [5.0, 6.0]]), 1.5) == 1.5


def test_verdicts_and_distances_at_all_speeds(config, claims):
    table = judged(invented(at_210_0304={"right_share_pct": 0.0}), config, claims)
    assert whole(table, "C28b")["verdict"] == REPRODUCED
    assert whole(table, "C28b")["distance"] == pytest.approx(0.05)
    assert set(table.loc["C28b"].index.dropna()) == {115.0, 210.0}
    # the right arc lets go at 210 rpm alone: part c is judged at 115 rpm, part d at the others
    assert whole(table, "C23c")["verdict"] == REPRODUCED
    assert whole(table, "C23d")["verdict"] == NOT_REPRODUCED
    assert whole(table, "C23d")["distance"] == pytest.approx(2.0)
    assert 115.0 not in table.loc["C23d"].index
    # growth with speed has no verdict at one speed
    assert list(table.loc["C21a"].index.dropna()) == []
    assert "C08a" not in table.index.get_level_values("claim")


def test_times_at_another_speed_are_compared_at_the_same_angle(config, claims):
    """0.004 s at 115 rpm in every case: at 210 rpm less by the ratio of speeds."""
    table = judged(invented(), config, claims)
    assert table.loc[("C16a", 115.0), "distance"] == pytest.approx(0.4)
    assert table.loc[("C16a", 210.0), "distance"] == pytest.approx(0.4)
    times = evidence(invented(), config, 210.0).events.set_index(["run", "event"])["mean_s"]
    assert times["meshing/no_ring", "first left"] == pytest.approx(0.004)


def test_a_run_that_does_not_come_out_is_a_named_cell(config, claims):
    lost = {"state": DIVERGED, "reason": "the step is too large", "left_share_pct": None, "left_rms_n": None}
    table = judged(invented(at_210_0313=lost), config, claims)
    for claim in ("C21a", "C22a", "C24b", "C25b", "C26a"):
        row = whole(table, claim)
        assert row["verdict"] == FAILED, claim
        assert np.isnan(row["distance"])
        assert row["reason"] == "0.313 m, 210 rpm: diverged: the step is too large"
    # at 115 rpm everything ran, and the meshing process has no such ring
    assert whole(table, "C25a")["verdict"] == REPRODUCED
    assert whole(table, "C28b")["verdict"] == REPRODUCED
    gone = judged(invented(at_115_none=lost), config, claims)
    assert whole(gone, "C27")["verdict"] == FAILED
    assert whole(gone, "C25a")["verdict"] == REPRODUCED


def test_claims_that_mean_nothing_are_left_out(config, claims):
    silent = Named("groove", "three surfaces", "ten arcs", Alternative(silent=["C18"]))
    assert "C18" in judged(invented(), config, claims).index
    assert "C18" not in judged(invented(), config, claims, silent).index


def test_a_refused_row_and_a_lost_refit_are_kept_in_words(config, fit, monkeypatch):
    """A rig that cannot run ends in rows with a reason, not in an exception."""
    form = config.forms["short"].model_copy(update={"evaluations": 3})
    small = config.model_copy(update={"scene": {"integrator": "no such"}})
    rows = run_rows(RIG, small.scene, config, form)
    assert {row["state"] for row in rows} == {"refused"}
    assert all("no such" in row["reason"] for row in rows)

    def lost(*args):
        raise TrackdynError("no start of stage 1 runs")

    monkeypatch.setattr(rooms, "refit", lost)
    monkeypatch.setattr(rooms, "run_rows", lambda *args: [])
    one = Named("drag law", "coulomb", "rolling", Alternative(scene={"drag": "coulomb"}))
    found = run_assumption(RIG, one, config, fit, form)
    assert found["refit"] == "none: no start of stage 1 runs"
    assert found["scene"]["drag"] == "coulomb"
    json.dumps(found)


def test_a_refit_moves_only_what_is_free(config, fit, monkeypatch):
    """With the search replaced by one that takes every free parameter to the middle of its range."""
    seen = {}

    def middle(rig, asked, form, jobs, log, store, starts):
        seen["laws"], seen["targets"] = asked.laws, {target.claim for target in asked.targets}
        seen["start"] = starts[0]
        found, scene = asked.unknowns(rig).to_rig(np.full(len(asked.unknowns(rig)), 0.5))
        return found, scene, []

    monkeypatch.setattr(rooms, "fit_rig", middle)
    high = named(config, "full", "creep_slope_of_the_ring_90_s_m")
    rig = changed_rig(RIG, high.alternative)
    found = rooms.refit(rig, config.scene, high.alternative, config, fit, 5)
    assert (found.ring_contact.friction_static, found.ring_contact.transition_velocity) == (0.9, 0.01)
    assert found.bushing.stiffness != rig.bushing.stiffness
    assert seen["laws"]["drag"] == "rolling"
    assert "integrator" not in seen["laws"]
    assert all(0 <= x <= 1 for x in seen["start"].x)
    groove = named(config, "full", "groove_three_surfaces")
    rooms.refit(RIG, config.scene | groove.alternative.scene, groove.alternative, config, fit, 5)
    assert seen["laws"]["tooth_contact"] == "three_surfaces"
    assert {"C15", "C18"}.isdisjoint(seen["targets"])


def test_lines_of_the_map_have_their_place(config):
    """And a copy that does not run says why."""
    added = [one.alternative.lines for one in config.assumptions("full") if one.alternative.lines]
    assert added
    for lines in added:
        text = (Path(rooms.__file__).parents[1] / lines.file).read_text(encoding="utf-8")
        assert text.count(lines.behind) == 1
    with pytest.raises(TrackdynError, match="No module named"):
        run_in_a_copy(added[0], "trackdyn.no_such", [])

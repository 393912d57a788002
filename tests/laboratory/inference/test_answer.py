"""A row of the answer beside long runs, and residuals beside verdicts."""

import numpy as np
import pandas as pd
import pytest
import yaml

from laboratory.inference.answer.problem import (
    FORMS,
    MISSING,
    AnswerProblem,
    hinged,
    neighbours,
    residual,
    rows_of_answer,
)
from laboratory.inference.answer.revolution import summary
from laboratory.inference.answer.settings import Searches, load_answer, question_unknowns
from laboratory.inference.answer.study import answer, profiles, start
from replication.paper.claims import ONE_SIDED, SHOWN, _values, load_claims
from trackdyn.errors import InputError
from trackdyn.measure.sensor import whole_samples
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.yaml_file import read_yaml
from trackdyn.scene.scene import Periods, Scene
from trackdyn.simulation.simulate import simulate
from trackdyn.sweeps.row import run_values

CLAIMS = load_claims("config/claims.yaml")
ANSWER = load_answer("config/answer.yaml")
# the scenes of Figs. 19 and 21, without the ring study
MESHING = [name for name in ANSWER.questions["predicted"].claims if "C15" <= name < "C21"]
SMALL = ANSWER.with_question("predicted", claims=MESHING).model_copy(update={"radii_m": [0.308]})


@pytest.fixture(scope="module")
def problem():
    return AnswerProblem(
        SMALL, "predicted", question_unknowns(SMALL, "predicted"), SMALL.targets_of("predicted", CLAIMS)
    )


@pytest.fixture(scope="module")
def row(problem):
    x = np.array(start(problem.unknowns, 0, 0.0))
    return rows_of_answer(0.0)(**problem.task(x))


def test_two_passages_of_all_connectors_say_what_a_long_run_says(rig):
    """Within three samples of a turn, and 1 % of forces or 1 N, of the passages of a record of 6.4 s."""
    fields = {"rig": rig, "motor_rpm": 115, "ring_radius": 0.308, "step": 1e-4, "integrator": "linearly_implicit"}
    fields["pitches"] = list(range(1, rig.chain.pitches + 1))
    passage = Periods.at(rig, 115).passage
    wait = {"ramp": ANSWER.row.ramp_s, "lead_in": ANSWER.row.lead_in_s}
    duration = whole_samples(1000, ANSWER.row.passages * passage) + 0.002
    short, times = summary(simulate(Scene(**fields, **wait, duration=duration, contact_log=False)))
    known = run_values(simulate(Scene(**fields, **wait, duration=6.4)))
    for side in ("left", "right", "ring"):
        assert short[f"{side}_share_pct"] == pytest.approx(known[f"{side}_share_pct"], abs=0.1)
        assert short[f"{side}_rms_n"] == pytest.approx(known[f"{side}_rms_n"], rel=0.01, abs=1.0)
    assert known["left_share_pct"] > 1
    assert short["left_areas"] == known["left_areas"]
    for event in ("left touches", "ring left", "out"):
        assert times[event] == pytest.approx(known[f"event {event}"], abs=0.003)


def test_a_claim_is_shown_where_no_residual_is_beyond_one(problem, row):
    for name, (verdict, off) in problem.judged(row).items():
        if name in FORMS or not len(off):
            continue  # smooth forms
        assert (verdict == SHOWN) == bool((np.abs(off) <= 1 + 1e-9).all()), name


def test_neighbours_are_within_the_share_of_the_rig():
    at_rig, *others = neighbours(20, 0.01, 5)
    assert (at_rig == 1).all() and len(others) == 20
    assert all(0 < abs(factors - 1).max() <= 0.01 for factors in others)


def test_a_value_outside_its_part_costs_by_the_factor(problem, row):
    """0.6 for each factor of e, at the end of a search as elsewhere; none for a value within its range."""
    off = dict(zip(problem.possible.labels, problem._implausible(problem.unknowns.rig), strict=True))
    ranges = {unknown.label: unknown.intervals for unknown in problem.possible.unknowns}
    (low, high), value = (
        ranges["ring_contact.transition_velocity"][0],
        problem.unknowns.rig.ring_contact.transition_velocity,
    )
    assert off["ring_contact.transition_velocity"] == pytest.approx(0.6 * np.log(value / high)) and value > high > low
    assert off["chain.link_mass"] == 0.0


@pytest.mark.parametrize("claim", [c for c in CLAIMS if c.rule in ONE_SIDED and c.scale], ids=lambda c: c.name)
def test_a_bound_is_at_one_tolerance_and_calm_a_scale_within_it(claim):
    bad = -1 if claim.rule == "at_least" else 1
    leeway = claim.within * abs(claim.printed)

    def at(scales):
        (value,) = _values(claim, claim.printed + bad * (leeway + scales * claim.scale), [115.0])
        return residual(claim, value, None), value.met

    assert [at(s)[0] for s in (0, 1, -1, -5)] == pytest.approx([1, 2, 0, 0], abs=1e-9)
    assert (at(-1e-6)[1], at(1e-6)[1]) == (True, False)


def test_what_never_happens_is_far_off_and_not_lost(problem, row):
    lost = row | {"115 none": row["115 none"] | {"event right gone": float("nan")}}
    _, off = problem.judged(lost)["C16d"]
    assert off[0] == MISSING


def test_a_search_gains_more_by_a_lost_statement_than_by_one_that_is_met():
    off = np.linspace(-3.0, 3.0, 61)
    residuals = hinged(off)
    assert (np.diff(residuals) > 0).all() and residuals == pytest.approx(-residuals[::-1])
    assert np.diff(residuals)[[30, -1]] == pytest.approx([0.025, 0.15])


def test_starts_are_the_rig_itself_and_points_that_can_be_built(problem):
    at_rig, other = (start(problem.unknowns, seed, 0.05) for seed in (0, 1))
    assert problem.unknowns.values(at_rig) == pytest.approx(problem.unknowns.of_rig(problem.unknowns.rig))
    assert other != at_rig and other == start(problem.unknowns, 1, 0.05)


def test_a_profile_holds_a_value_or_a_law_and_names_what_is_lost(problem, tmp_path):
    less = {"evaluations": 1, "values": {"sprocket.equal_pitch_radius": [0.308, 0.33]}}
    less |= {"laws": ANSWER.profiles.laws[:1]}
    profiles_ = ANSWER.profiles.model_copy(update=less | {"question": "predicted"})
    config = SMALL.model_copy(update={"profiles": profiles_})
    end = pd.Series(
        problem.unknowns.of_rig(problem.unknowns.rig) | {"question": "predicted", "rig": "config/rigs/paper.yaml"}
    )
    table = profiles(config, CLAIMS, end, 1, tmp_path).set_index(["assumption", "value"])
    assert table.loc[("sprocket.equal_pitch_radius", 0.33), "ended"] == "cannot be built"
    other, law = table.loc[("sprocket.equal_pitch_radius", 0.308)], table.loc[("tension", "sprung")]
    assert other["cost"] > 5 and law["cost"] != other["cost"]
    for row in (other, law):
        assert row["shown"] + len(row["lost"].split(", ")) == row["of"] == len(problem.claims)


def test_searches_start_at_their_own_rig_and_the_best_one_is_judged(tmp_path):
    searches = [
        Searches(method="dfols", evaluations=1, radius=0.05, seeds=[0], rig=rig)
        for rig in ("config/rigs/parts.yaml", None)
    ]
    question = SMALL.questions["predicted"].model_copy(update={"searches": searches})
    config = SMALL.model_copy(update={"questions": {"predicted": question}})
    ends, costs, verdicts = answer(config, CLAIMS, "predicted", 1, tmp_path)
    assert ends["rig"].tolist() == ["config/rigs/paper.yaml", "config/rigs/parts.yaml"]
    best, worse = (load_rig(path).chain.link_mass for path in ends["rig"])
    assert ends["chain.link_mass"].tolist() == pytest.approx([best, worse])
    assert (ends["first_cost"] == ends["cost"]).all() and ends["cost"].is_monotonic_increasing
    assert (verdicts["verdict"] == SHOWN).sum() == ends["shown"].iloc[0]
    assert set(costs["rig"]) == set(ends["rig"])


@pytest.mark.parametrize("section", ["short", "profiles"])
def test_a_question_that_is_none_of_the_file_is_refused(tmp_path, section):
    data = read_yaml("config/answer.yaml")
    data[section]["question"] = "forecast"
    path = tmp_path / "answer.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    with pytest.raises(InputError, match=rf"{section}\.question .*forecast.*predicted"):
        load_answer(path)

"""A row of the answer beside long runs, and residuals beside verdicts."""

from itertools import product

import numpy as np
import pandas as pd
import pytest
import yaml

from laboratory.inference.answer.problem import MISSING, AnswerProblem, neighbours, residual, rows_of_answer
from laboratory.inference.answer.revolution import summary
from laboratory.inference.answer.settings import Held, Searches, load_answer, question_unknowns
from laboratory.inference.answer.study import answer, profiles, start
from laboratory.inference.unknowns import Unknowns
from replication.paper.claims import ONE_SIDED, REPRODUCED, _values, load_claims
from trackdyn.errors import InputError
from trackdyn.measure.sensor import whole_samples
from trackdyn.parameters.rig import Rig, load_rig
from trackdyn.parameters.yaml_file import read_yaml
from trackdyn.scene.scene import Periods, Scene
from trackdyn.simulation.simulate import simulate
from trackdyn.sweeps.row import run_values

CLAIMS = load_claims("config/claims.yaml")
ANSWER = load_answer("config/answer.yaml")


@pytest.fixture(scope="module")
def problem():
    return AnswerProblem(
        ANSWER, "predicted", question_unknowns(ANSWER, "predicted"), ANSWER.targets_of("predicted", CLAIMS)
    )


@pytest.fixture(scope="module")
def row(problem):
    x = np.array(start(problem.unknowns, 0, 0.0))
    return rows_of_answer(0.0)(**problem.task(x))


def test_two_passages_of_all_connectors_say_what_a_long_run_says(rig):
    """Within three samples of a turn, and 1 % of forces or 1 N, of the passages of a record of 6.4 s."""
    fields = {"rig": rig, "motor_rpm": 115, "ring_radius": 0.304, "step": 1e-4, "integrator": "linearly_implicit"}
    fields["pitches"] = list(range(1, rig.chain.pitches + 1))
    passage = Periods.at(rig, 115).passage
    wait = {"ramp": ANSWER.row.ramp_s, "lead_in": ANSWER.row.lead_in_s}
    duration = whole_samples(1000, ANSWER.row.passages * passage) + 0.002
    found, times = summary(simulate(Scene(**fields, **wait, duration=duration, spells=False)))
    known = run_values(simulate(Scene(**fields, **wait, duration=6.4)))
    for side in ("left", "right", "ring"):
        assert found[f"{side}_share_pct"] == pytest.approx(known[f"{side}_share_pct"], abs=0.1)
        assert found[f"{side}_rms_n"] == pytest.approx(known[f"{side}_rms_n"], rel=0.01, abs=1.0)
    assert known["left_share_pct"] > 1
    assert found["left_areas"] == known["left_areas"]
    for event in ("left touches", "ring left", "out"):
        assert times[event] == pytest.approx(known[f"event {event}"], abs=0.003)


def test_a_claim_is_reproduced_where_no_residual_is_beyond_one(problem, row):
    for name, (verdict, off) in problem.judged(row).items():
        assert (verdict == REPRODUCED) == bool((np.abs(off) <= 1 + 1e-9).all()), name


def test_neighbours_count_as_much_as_the_rig(problem, row):
    own = problem.residuals(row)
    assert problem.residuals({"rigs": row["rigs"] * 4}) @ np.ones(4 * len(own)) == pytest.approx(2 * own.sum())


def test_neighbours_are_within_the_share_and_the_ranges(problem):
    question = ANSWER.questions["predicted"].model_copy(update={"neighbours": 3})
    config = ANSWER.model_copy(update={"questions": {"predicted": question}})
    unknowns = problem.unknowns
    task = AnswerProblem(config, "predicted", unknowns, problem.claims).task(np.array(start(unknowns, 0, 0.0)))
    own, *others = (unknowns.of_rig(Rig.model_validate(rig)) for rig in task["rigs"])
    assert len(others) == 3
    for one, unknown in product(others, unknowns.unknowns):
        value, near = own[unknown.label], one[unknown.label]
        assert abs(near / value - 1) <= ANSWER.robustness.share + 1e-9
        assert np.isfinite(unknown.position(near))
    assert others[0]["groove.r3"] != others[1]["groove.r3"]
    assert others[0]["sprocket.equal_pitch_radius"] == own["sprocket.equal_pitch_radius"]  # printed


def test_neighbours_that_judge_a_rig_are_none_with_which_it_was_searched():
    searched, others = neighbours(6, 0.01, 5), neighbours(20, 0.01, 5, searched=6)
    assert (searched[0] == 1).all() and (others[0] == 1).all()
    assert not {*map(tuple, searched[1:])} & {*map(tuple, others[1:])} and len(others) == 21


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
    found = row["rigs"][0]
    lost = found | {"115 none": found["115 none"] | {"event left maximum, after the touch": float("nan")}}
    _, off = problem.judged({"rigs": [lost]})["C16b"]
    assert off[1] == MISSING


def test_starts_are_the_rig_itself_and_points_that_can_be_built(problem):
    own, other = (start(problem.unknowns, seed, 0.05) for seed in (0, 1))
    assert problem.unknowns.values(own) == pytest.approx(problem.unknowns.of_rig(problem.unknowns.rig))
    assert other != own and other == start(problem.unknowns, 1, 0.05)


def test_a_profile_holds_a_value_or_a_law_and_names_what_is_lost(problem, tmp_path):
    less = {"evaluations": 1, "values": {"sprocket.equal_pitch_radius": [0.308, 0.33]}}
    together = [
        Held(values={"chain.link_mass": 14.0}, evaluations=1),
        Held(values={"tension.pre_tension": 9000.0}, evaluations=1),
    ]
    less |= {"laws": ANSWER.profiles.laws[:1], "continued": together}
    profiles_ = ANSWER.profiles.model_copy(update=less)
    config = ANSWER.model_copy(update={"profiles": profiles_})
    end = pd.Series(problem.unknowns.of_rig(problem.unknowns.rig) | {"question": "predicted", "rig": "config/rig.yaml"})
    found = profiles(config, CLAIMS, end, 1, tmp_path).set_index(["assumption", "value"])
    assert found.loc[("sprocket.equal_pitch_radius", 0.33), "ended"] == "cannot be built"
    heavy = problem.unknowns.rig.changed(chain__link_mass=14.0, tension__pre_tension=9000.0)
    of_both = AnswerProblem(config, "predicted", Unknowns(problem.unknowns.unknowns, heavy), problem.claims)
    values = rows_of_answer(0)(**of_both.task(np.array(start(of_both.unknowns, 0, 0.0))))
    cost = 0.5 * float((of_both.residuals(values) ** 2).sum())
    assert found.loc[("tension.pre_tension", "9000.0"), "cost"] == pytest.approx(cost)  # the mass of the one before it
    other, law = found.loc[("sprocket.equal_pitch_radius", 0.308)], found.loc[("drag", "rolling")]
    assert other["cost"] > 5 and law["cost"] != other["cost"]
    for row in (other, law):
        assert row["shown"] + len(row["lost"].split(", ")) == row["of"] == len(problem.claims)


def test_searches_start_at_their_own_rig_and_the_best_one_is_judged(tmp_path):
    searches = [
        Searches(method="dfols", evaluations=1, radius=0.05, seeds=[0], rig=rig)
        for rig in ("config/rigs/first_fit.yaml", None)
    ]
    question = ANSWER.questions["predicted"].model_copy(update={"searches": searches})
    config = ANSWER.model_copy(update={"questions": {"predicted": question}})
    ends, costs, verdicts = answer(config, CLAIMS, "predicted", 1, tmp_path)
    assert ends["rig"].tolist() == ["config/rig.yaml", "config/rigs/first_fit.yaml"]
    best, worse = (load_rig(path).chain.link_mass for path in ends["rig"])
    assert ends["chain.link_mass"].tolist() == pytest.approx([best, worse])
    assert (ends["first_cost"] == ends["cost"]).all() and ends["cost"].is_monotonic_increasing
    assert (verdicts["verdict"] == REPRODUCED).sum() == ends["shown"].iloc[0]
    assert set(costs["rig"]) == set(ends["rig"])


@pytest.mark.parametrize("section", ["short", "profiles"])
def test_a_question_that_is_none_of_the_file_is_refused(tmp_path, section):
    data = read_yaml("config/answer.yaml")
    data[section]["question"] = "forecast"
    path = tmp_path / "answer.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    with pytest.raises(InputError, match=rf"{section}\.question .*forecast.*predicted"):
        load_answer(path)

"""History matching on numbers that are made by hand, and on a function whose answer is known."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import qmc

from laboratory.inference.ensemble import waves
from laboratory.inference.ensemble.history import (
    Search,
    all_columns,
    errors,
    implausibility,
    judged,
    outputs,
)
from laboratory.inference.ensemble.settings import EnsembleConfig, Fidelity, load_ensemble, targets_of, unknowns_of
from laboratory.inference.targets import Case, CaseTarget
from laboratory.inference.unknowns import Unknown, Unknowns, file_ranges
from replication.paper.claims import load_claims
from trackdyn.errors import InputError
from trackdyn.parameters.layout import assemble
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml

CONFIG = Path(__file__).parents[3] / "config"
SETTINGS = load_ensemble(CONFIG / "ensemble.yaml")
CLAIMS = load_claims(CONFIG / "claims.yaml")
RIG = load_rig(CONFIG / "rigs" / "first_fit.yaml")
NONE, RING = Case(115, None), Case(115, 0.308)
SHARE = CaseTarget(claim="C25a", output="left_share_pct", case=RING, printed=10.0, tolerance=2.0, rule="equal")
FREE = CaseTarget(claim="C23a", output="right_share_pct", case=RING, printed=0.5, tolerance=0.5, rule="at_most")
TOUCH = CaseTarget(claim="C17a", output="left touches", case=RING, printed=1.25, tolerance=0.15, rule="equal")


def known(targets, **sd):
    names = all_columns(targets)
    return pd.DataFrame(
        {"fidelity_sd": sd.get("fidelity", 0.0), "discrepancy_sd": sd.get("discrepancy", 0.0)}, index=names
    )


def test_a_tolerance_is_three_standard_deviations():
    """At the edge of the tolerance the implausibility is 3, beyond a one-sided bound only; other errors add in
    square.
    """
    values = np.array([[12.0, 0.0], [10.0, 1.0], [np.nan, 0.5]])
    found = implausibility([SHARE, FREE], values, known([SHARE, FREE]), cheap=False)
    np.testing.assert_allclose(found[0], [[3, 0], [0, 3], [np.inf, 0]])
    more = implausibility(
        [SHARE], values[:1, :1], known([SHARE], discrepancy=0.8, fidelity=0.6), variance=np.full((1, 1), 4 / 9)
    )
    assert more[0, 0, 0] == pytest.approx(2 / np.sqrt(4 / 9 + 0.8**2 + 0.6**2 + 4 / 9))
    # a full run has no error of a cheap one
    full = implausibility([SHARE], values[:1, :1], known([SHARE], fidelity=0.6), cheap=False)
    assert full[0, 0, 0] == pytest.approx(3)


def test_the_better_reading_of_the_neighbour_counts():
    """A pitch passes in 0.22 s: 1.47 s with the link ahead is 1.25 s with the one behind."""
    passage = RIG.loop_period(115) / RIG.chain.pitches
    rows = pd.DataFrame(
        [
            {
                "name": "7 115 0.308",
                "state": "done",
                "event ring touched": 0.0,
                "event left touches": 1.25 + passage,
                "left_share_pct": 10.0,
            },
            {
                "name": "8 115 0.308",
                "state": "done",
                "event ring touched": 0.0,
                "event left touches": 1.25,
                "left_share_pct": 10.0,
            },
            {"name": "9 115 0.308", "state": "refused"},
        ]
    )
    table = judged(
        SETTINGS, [SHARE, TOUCH], outputs(SETTINGS, one(), [SHARE, TOUCH], rows), known([SHARE, TOUCH]), cheap=True
    )
    assert table["reading"].to_dict() == {7: "behind", 8: "ahead"}
    assert table["excluded_by"].tolist() == [0, 0] and 9 not in table.index


def one():
    return Unknowns(
        [Unknown(names=["bushing.stiffness"], scale="log")], RIG, file_ranges(CONFIG / "rigs" / "first_fit.yaml")
    )


def test_errors_are_where_two_thirds_of_the_differences_lie():
    full = pd.DataFrame({"a": np.zeros(100)})
    cheap = pd.DataFrame({"a": np.linspace(-1, 1, 100)})
    found = errors(cheap, full, cheap, [cheap + 0.5, cheap - 0.5])
    assert found.loc["a", "fidelity_sd"] == pytest.approx(0.68, abs=0.02)
    assert found.loc["a", "discrepancy_sd"] == pytest.approx(0.5) and found.loc["a", "discrepancy_rigs"] == 200


@pytest.fixture(scope="module")
def unknowns():
    names = [
        ["bushing.stiffness"],
        ["tension.pre_tension"],
        ["idler.bearing_drag", "road_wheel.bearing_drag"],
        ["chain.link_mass"],
    ]
    return Unknowns(
        [Unknown(names=of, scale="log") for of in names], RIG, file_ranges(CONFIG / "rigs" / "first_fit.yaml")
    )


def test_the_search_goes_where_the_targets_are_met(unknowns):
    """Two linear outputs allow a strip of 1 in 60 of the cube; of the new points at least a third must lie in it."""
    targets = [
        SHARE,
        CaseTarget(claim="C28a", output="ring_share_pct", case=RING, printed=49.0, tolerance=2.0, rule="equal"),
    ]
    x = qmc.LatinHypercube(4, seed=1).random(60)

    def simulated(x):
        return np.column_stack([30 * x[:, 0], 30 + 40 * x[:, 1] + 2 * np.sin(6 * x[:, 2])])

    points = waves.points_table(unknowns, x, 0)
    values = pd.DataFrame(simulated(x), columns=all_columns(targets), index=pd.RangeIndex(60, name="rig"))
    search = Search(SETTINGS, unknowns, targets, points, values, known(targets))
    found = search.next_points(60, 80, seed=2)

    def allowed(x):
        return (implausibility(targets, simulated(x), known(targets)) <= 3).all(axis=(0, 2)).mean()

    assert allowed(qmc.LatinHypercube(4, seed=3).random(4000)) < 0.03
    assert allowed(found) > 1 / 3
    assert min(check.coverage_95 for check in search.check().values()) > 0.7


def test_every_case_of_every_rig_is_a_row_with_the_steps_to_try(unknowns):
    points = waves.points_table(unknowns, np.full((2, 4), 0.5), 0)
    ladder = Fidelity(integrator="linearly_implicit", steps_s=[2.5e-4, 1e-4])
    cases = [NONE, Case(150, None, belt=True)]
    found = waves.rows_of_kind(
        SETTINGS, unknowns, waves.members(unknowns, points), cases, "law 0", ladder, sliding=True
    )
    assert found["name"].tolist() == [
        "law 0: 0 115 none",
        f"law 0: 0 {cases[1].name}",
        "law 0: 1 115 none",
        f"law 0: 1 {cases[1].name}",
    ]
    assert found["step"].tolist() == ["0.00025 0.0001", "0.001"] * 2
    belts = found["chain"] == "belt"
    assert found.loc[belts, "tension"].eq("locked").all() and not found.loc[~belts, "pitches"].eq("").any()
    assert list(waves.unknown_kinds(found)) == ["law 0"] and list(waves.unknown_kinds(found)["law 0"]["name"])[2] == "1 115 none"


def test_points_are_rigs_whose_groove_can_be_cut_and_whose_loop_closes():
    every = unknowns_of(SETTINGS, CONFIG / "rigs" / "first_fit.yaml")
    points = waves.prior_points(every, 3, seed=4)
    assert points.shape == (3, len(every))
    for x in points:
        assemble(every.to_rig(x)[0])  # raises for a loop that does not close
    far = RIG.changed(idler__x=-1.6, road_wheel__x=-2.4)
    assert not waves.can_close(far)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"held_out": ["C25"]}, "targets: C25a is held out"),
        ({"targets": [{"claim": "C99", "output": "left_share_pct"}]}, "claim C99 is unknown"),
        (
            {"targets": [{"claim": "C15", "output": "left_share_pct"}]},
            "C15 left_share_pct has no number, tolerance or rule",
        ),
        (
            {"targets": [{"claim": "C15", "output": "left_share_pct", "printed": 1}]},
            "departs from the claim; give the reason",
        ),
        ({"cutoff": -1}, "cutoff = -1"),
        ({"waves": 3}, "waves is not a known parameter"),
    ],
)
def test_what_makes_no_ensemble_is_refused_in_a_sentence(change, said):
    data = read_yaml(CONFIG / "ensemble.yaml") | change
    with pytest.raises(InputError, match=said) as refusal:
        targets_of(validated(EnsembleConfig, data, "ensemble.yaml"), CLAIMS)
    assert "\n" not in str(refusal.value)

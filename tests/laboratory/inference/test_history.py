"""History matching on numbers that are made by hand, and on a function whose answer is known."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import qmc

from laboratory.inference.ensemble import waves
from laboratory.inference.ensemble.history import Search, all_columns, implausibility
from laboratory.inference.ensemble.settings import EnsembleConfig, load_ensemble, targets_of
from laboratory.inference.targets import Case, CaseTarget
from laboratory.inference.unknowns import Unknown, Unknowns, file_ranges
from replication.paper.claims import load_claims
from trackdyn.errors import InputError
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml

CONFIG = Path(__file__).parents[3] / "config"
SETTINGS = load_ensemble(CONFIG / "ensemble.yaml")
CLAIMS = load_claims(CONFIG / "claims.yaml")
RIG = load_rig(CONFIG / "rigs" / "first_fit.yaml")
NONE, RING = Case(115, None), Case(115, 0.308)
SHARE = CaseTarget(claim="C25a", output="left_share_pct", case=RING, printed=10.0, tolerance=2.0, rule="equal")


def known(targets, **sd):
    names = all_columns(targets)
    return pd.DataFrame(
        {"fidelity_sd": sd.get("fidelity", 0.0), "discrepancy_sd": sd.get("discrepancy", 0.0)}, index=names
    )


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

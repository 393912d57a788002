"""History matching on numbers that are made by hand, and on a function whose answer is known."""

from pathlib import Path

import pandas as pd
import pytest

from laboratory.inference.ensemble.history import (
    all_columns,
)
from laboratory.inference.ensemble.settings import EnsembleConfig, targets_of
from laboratory.inference.targets import Case
from laboratory.inference.unknowns import Unknown, Unknowns, file_ranges
from replication.paper.claims import load_claims
from trackdyn.errors import InputError
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml

CONFIG = Path(__file__).parents[3] / "config"
CLAIMS = load_claims(CONFIG / "claims.yaml")
RIG = load_rig(CONFIG / "rigs" / "first_fit.yaml")
NONE, RING = Case(115, None), Case(115, 0.308)


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

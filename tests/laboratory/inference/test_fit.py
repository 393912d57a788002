"""The fit: residuals on constructed results, ranges and starts, and a value found again."""

from pathlib import Path

import numpy as np
import pytest

import laboratory.inference.fit as fit
from laboratory.inference.search import Round
from trackdyn.errors import InputError
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml

FILE = Path(__file__).parents[3] / "config" / "fit.yaml"
RIG = FILE.parent / "rigs" / "possible.yaml"


@pytest.fixture(scope="module")
def rig():
    """The default rig, which the choices of the file start from."""
    return load_rig(RIG)


@pytest.fixture
def config():
    return validated(fit.FitConfig, read_yaml(FILE), str(FILE))


def target(**fields):
    base = {"claim": "C25", "ring_radius_m": 0.308, "output": "left_share_pct", "printed": 10.0, "tolerance": 2.0,
            "reason": "why"}  # fmt: skip
    return fit.FitTarget.model_validate(base | fields)


def summaries(share=10.0, other=5.0, gap=0.0):
    return {0.308: {"left_share_pct": share, "left_gap_m": gap}, 0.313: {"left_share_pct": other}, None: None}


@pytest.mark.parametrize(
    ("fields", "share", "expected"),
    [
        ({}, 13.0, 1.5),
        ({}, 7.0, -1.5),
        ({"rule": "at_most"}, 7.0, 0.0),
        ({"rule": "at_most"}, 12.0, 1.0),
        ({"rule": "at_least"}, 12.0, 0.0),
        ({"rule": "at_least"}, 8.0, -1.0),
        ({}, float("nan"), -fit.MISSING),
        ({"relative_to": 0.313, "printed": 1.0, "tolerance": 0.5}, 10.0, 2.0),
    ],
)
def test_residuals_are_in_tolerances(fields, share, expected):
    assert fit.residual(target(**fields), summaries(share)) == pytest.approx(expected)


def test_a_contact_that_does_not_occur_has_a_gradient():
    """The nearer the arc comes to its groove, the less is missing: of a share, a ratio and of a time."""
    share = [fit.residual(target(), summaries(0.0, gap=gap)) for gap in (0.0, 1e-3, 2e-3)]
    assert share == pytest.approx([-5.0, -6.0, -7.0])
    times = [fit.residual(target(), summaries(float("nan"), gap=gap)) for gap in (0.0, 1e-3)]
    assert times == pytest.approx([-fit.MISSING, -fit.MISSING - 1])
    none = target(printed=0.0, rule="at_most")  # is to be missing, and is
    assert fit.residual(none, summaries(0.0, gap=1e-3)) == 0.0
    assert np.isnan(fit.residual(target(ring_radius_m=None), summaries()))


@pytest.mark.parametrize(
    ("change", "message"),
    [({"parameters": [{"names": ["bushing.stiffness"]}]}, "needs a range"), ({"full": "best"}, "best is missing")],
)
def test_a_file_that_does_not_fit_together_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        validated(fit.FitConfig, read_yaml(FILE) | change, "fit.yaml")


def test_a_known_value_is_found_again(config, rig, monkeypatch, tmp_path):
    """With a measure that is a plain function of two parameters in place of the simulator."""
    stage = fit.Stage(run="screen", rounds=[Round(evaluations=3, keep=1), Round(evaluations=60)])
    small = config.model_copy(
        update={
            "method": "trf",
            "parameters": [p for p in config.parameters if p.names[0] in ("tension.pre_tension", "groove.seat_depth")],
            "rigs": {name: {"tension.pre_tension": 2000.0, "groove.seat_depth": depth, "run_direction": "climbs",
                            "tension": "sprung"} for name, depth in (("near", 0.001), ("far", 0.0079))},
            "forms": {"full": fit.FitForm(starts=0, stages=[stage])},
            "targets": [
                target(printed=3.0, tolerance=0.1),
                target(output="ring_share_pct", printed=2.0, tolerance=0.1),
            ],
        }
    )  # fmt: skip

    def case(made, radius, scene, steps, starts):
        assert scene["tension"] == "sprung"
        assert scene["drag"] == "rolling"
        tension, depth = made.tension.pre_tension / 1000, made.groove.seat_depth * 1000
        return {"left_share_pct": tension**0.5 + depth, "ring_share_pct": tension - depth}

    monkeypatch.setattr(fit, "_case", case)
    found, scene, (ends,) = fit.fit_rig(rig, small, log=lambda _: None, store=tmp_path)
    assert scene == {"tension": "sprung"}
    assert [end.start for end in ends] == ["near", "far"]
    tension, depth = found.tension.pre_tension / 1000, found.groove.seat_depth * 1000
    # T^0.5 + d = 3, T - d = 2: T^0.5 + T = 5
    root = (-1 + 21**0.5) / 2
    assert tension == pytest.approx(root**2, rel=1e-2)
    assert depth == pytest.approx(3 - root, rel=2e-2)
    assert ends[0].cost < 1e-2 * ends[0].first_cost
    assert found.idler.x > 0

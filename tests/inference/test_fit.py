"""The fit: residuals on constructed results, positions between bounds, and one parameter found again."""

import io
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import trackdyn.inference.fit as fit
from trackdyn.errors import InputError
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml

FILE = Path(__file__).parents[2] / "config" / "fit.yaml"


@pytest.fixture
def config():
    return validated(fit.FitConfig, read_yaml(FILE), str(FILE))


def target(**fields):
    base = {"claim": "C25", "ring_radius_m": 0.308, "output": "left_share_pct", "printed": 10.0, "tolerance": 2.0,
            "reason": "why"}  # fmt: skip
    return fit.FitTarget.model_validate(base | fields)


def summaries(share=10.0, other=5.0):
    return {0.308: {"left_share_pct": share}, 0.313: {"left_share_pct": other}, None: None}


@pytest.mark.parametrize(
    ("fields", "share", "expected"),
    [
        ({}, 13.0, 1.5),
        ({}, 7.0, -1.5),
        ({"rule": "at_most"}, 7.0, 0.0),
        ({"rule": "at_most"}, 12.0, 1.0),
        ({"rule": "at_least"}, 12.0, 0.0),
        ({"rule": "at_least"}, 8.0, -1.0),
        ({}, 1e6, fit.FAILED),
        ({}, float("nan"), fit.FAILED),
        ({"ring_radius_m": None}, 10.0, fit.FAILED),
        ({"relative_to": 0.313, "printed": 1.0, "tolerance": 0.5}, 10.0, 2.0),
    ],
)
def test_residuals_are_in_tolerances(fields, share, expected):
    assert fit.residual(target(**fields), summaries(share)) == pytest.approx(expected)


def test_every_parameter_of_the_shipped_fit_exists_and_lies_within_its_bounds(config, rig):
    for parameter in config.parameters:
        assert parameter.low < rig.value(parameter.label) < parameter.high, parameter.names
    same = fit.with_values(rig, config, [p.position(rig.value(p.label)) for p in config.parameters])
    for parameter in config.parameters:
        for name in parameter.names:
            assert same.value(name) == pytest.approx(rig.value(name), rel=1e-12)


@pytest.mark.parametrize("fields", [{"start": 3}, {"low": None}, {"names": [], "name": "way"}])
def test_a_fit_begins_between_bounds(fields):
    choices = {"choices": {"one": {}, "other": {}}} if "name" in fields else {}
    with pytest.raises(InputError, match="low < high and a start between them"):
        fit.Fitted(**({"names": ["bushing.stiffness"], "low": 1, "high": 2, "start": 1} | fields | choices))


def test_held_out_targets_do_not_enter_the_fit(config):
    results = {radius: dict.fromkeys({t.output for t in config.targets}, 1.0) for radius in config.cases()}
    held = [t for t in config.targets if t.held_out]
    assert held
    assert len(fit.residuals(config, results)) + len(held) == len(config.targets)


def test_a_known_value_is_found_again(config, rig, monkeypatch):
    """With a measure that is a plain function of two parameters in place of the simulator."""
    small = config.model_copy(
        update={
            "parameters": [p for p in config.parameters if p.names[0] in ("tension.pre_tension", "groove.seat_depth")],
            "targets": [
                target(printed=3.0, tolerance=0.1),
                target(output="ring_share_pct", printed=2.0, tolerance=0.1),
            ],
        }
    )

    def summary(rig, **case):
        tension, depth = rig["tension"]["pre_tension"] / 1000, rig["groove"]["seat_depth"] * 1000
        return {"left_share_pct": tension**0.5 + depth, "ring_share_pct": tension - depth}

    monkeypatch.setattr(fit, "_case", summary)
    found, history = fit.fit_rig(rig, small, log=lambda _: None)
    tension, depth = found.tension.pre_tension / 1000, found.groove.seat_depth * 1000
    # T^0.5 + d = 3, T - d = 2: T^0.5 + T = 5
    root = (-1 + 21**0.5) / 2
    assert tension == pytest.approx(root**2, rel=1e-3)
    assert depth == pytest.approx(3 - root, rel=1e-3)
    assert history["cost"].min() < 1e-3 * history["cost"].iloc[0]


def test_restriction_to_some_radii(config):
    small = config.restricted([0.308], without_ring=False)
    assert {t.ring_radius_m for t in small.targets} == {0.308}
    assert config.restricted([], without_ring=True) is config
    with pytest.raises(InputError, match="no target of the fit"):
        config.restricted([0.4], without_ring=False)


def measured_as(table):
    """Summaries of every candidate in the cases 0.308 and none, as files of the cases give them."""
    return fit.summaries_of(pd.read_csv(io.StringIO(table.to_csv(index=False))))


def cases(config, rig, share):
    rows = [
        {
            "candidate": name,
            "ring_radius_m": radius,
            "failed": "",
            "left_share_pct": share(candidate),
            "right_share_pct": 2.0,
        }
        for radius in (0.308, None)
        for name, candidate in fit.candidates(rig, config).items()
    ]
    return pd.DataFrame(rows)


def test_equal_pitch_readings_solve_for_the_arc_length(config, rig):
    summaries = measured_as(cases(config, rig, lambda candidate: candidate.sprocket.equal_pitch_radius))
    table = fit.equal_pitch_readings(rig, summaries).set_index("reading")
    assert table.loc["polygonal", "polygonal_m"] == 0.308
    assert table.loc["arc length", "arc_m"] == pytest.approx(0.308, abs=1e-6)
    assert table.loc["arc length", "polygonal_m"] < 0.308 < table.loc["polygonal", "arc_m"]
    for name in ("0.308", "none"):  # each reading was run with its own equal pitch
        assert table[f"left_share_pct_{name}"].tolist() == pytest.approx(table["polygonal_m"].tolist(), rel=1e-9)


def test_sensitivity_moves_one_parameter_at_a_time(config, rig):
    """With a share that is a plain function of the tension alone, which is moved by a factor of 1.2."""
    small = config.model_copy(update={"targets": [target(tolerance=0.5), target(ring_radius_m=None, tolerance=2.0)]})
    summaries = measured_as(cases(small, rig, lambda candidate: candidate.tension.pre_tension / 1000))
    table = fit.sensitivity(rig, small, summaries).set_index("parameter")
    tension = rig.tension.pre_tension / 1000
    moved = table.loc["tension.pre_tension"]
    assert moved["change"].tolist() == pytest.approx([0.2 * tension] * 2)
    assert moved["change_in_tolerances"].tolist() == pytest.approx([0.4 * tension, 0.1 * tension])
    assert (table.drop("tension.pre_tension")["change"].abs() < 1e-12).all()
    assert len(table) == 2 * len(config.parameters)


def test_a_candidate_that_cannot_run_has_no_measure(config, rig):
    rows = cases(config, rig, lambda candidate: 1.0)
    rows.loc[rows["candidate"] == "polygonal", "failed"] = "the chain does not mesh"
    summaries = measured_as(rows)
    assert summaries["polygonal"] == {0.308: None, None: None}
    assert np.isnan(fit.measured(target(), summaries["polygonal"]))
    assert np.isnan(
        fit.equal_pitch_readings(rig, summaries).set_index("reading").loc["polygonal", "left_share_pct_none"]
    )

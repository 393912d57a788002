"""The scorecard: rules, verdicts, and claims that are refused."""

import copy
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from trackdyn.errors import InputError
from trackdyn.paper.claims import (
    IN_TREND,
    NOT_COMPARABLE,
    NOT_REPRODUCED,
    REPRODUCED,
    Claim,
    judge,
    judge_all,
    load_claims,
)
from trackdyn.paper.evidence import MEASURES, Evidence

FILE = Path(__file__).parents[2] / "config" / "claims.yaml"
RADII = [0.303, 0.305, 0.307, 0.308, 0.313]


def evidence(**left):
    """Two speeds, five radii; the left share of single radii may be given."""
    rows = []
    for rpm in (115.0, 210.0):
        rows.append({"run": f"{rpm:g}rpm", "rpm": rpm, "rms_g": rpm / 100, "sd_g": rpm / 100, "line_hz": rpm / 1000,
                     "line_g": 1.17, "line_hz_binfree": rpm / 1000, "high_frequency_g": rpm,
                     "loop_gap_max_m": 1e-13})  # fmt: skip
        for i, radius in enumerate(RADII):
            rows.append({"run": f"ring/{rpm:g}rpm_{radius}", "rpm": rpm, "ring_radius_m": radius,
                         "left_share_pct": left.get(f"r{i}", 9.0), "right_share_pct": 20.0 if radius < 0.305 else 0.0,
                         "left_rms_n": 100.0 + rpm, "ring_rms_n": 100.0 * (i + 1) + rpm,
                         "ring_sd_n": 100.0 * (i + 1)})  # fmt: skip
    return Evidence(pd.DataFrame(rows), pd.DataFrame(columns=["run", "event", "mean_s"]), 115.0, 0.308)


def claim(**fields):
    base = {"id": "C99", "place": "here", "claim": "something", "reason": "a reason long enough", "rule": "equal",
            "measure": "left_shares_from_0307", "printed": 10, "tolerance": 2}  # fmt: skip
    return Claim.model_validate(base | fields)


def test_all_28_claims_are_there_in_order():
    assert [c.id for c in load_claims(FILE)] == [f"C{i:02d}" for i in range(1, 29)]


def test_no_number_stands_for_a_lost_one():
    """Claims whose printed cells are lost must not be judged."""
    claims = {c.id: c for c in load_claims(FILE)}
    for name in ("C03", "C04", "C05", "C13"):
        assert claims[name].rule == "not_comparable"
    assert claims["C03"].printed is None and claims["C13"].printed is None


@pytest.mark.parametrize(
    ("shares", "verdict"),
    [((10.5, 9.0, 8.1), REPRODUCED), ((10.5, 9.0, 7.9), IN_TREND), ((16.0, 9.0, 9.0), NOT_REPRODUCED)],
)
def test_equal_within_the_tolerance_the_trend_or_neither(shares, verdict):
    e = evidence(**{f"r{i + 2}": s for i, s in enumerate(shares)})
    measured, found = judge(claim(trend_tolerance=5), e)
    assert measured == list(shares)
    assert found == verdict


def test_a_nan_is_never_a_success():
    assert judge(claim(trend_tolerance=5), evidence(r3=np.nan))[1] == NOT_REPRODUCED
    events = claim(measure="events_with_ring", printed=[0.2] * 5, tolerance=0.1, rising_is_trend=True)
    assert judge(events, evidence())[1] == NOT_REPRODUCED


@pytest.mark.parametrize(("rule", "bound", "verdict"), [
    ("at_most", 0.5, REPRODUCED), ("at_most", -1, NOT_REPRODUCED), ("at_least", 0.0, REPRODUCED), ("at_least", 1.0, NOT_REPRODUCED),
])  # fmt: skip
def test_bounds(rule, bound, verdict):
    assert judge(claim(measure="right_share_from_0305", rule=rule, printed=bound), evidence())[1] == verdict


def test_trends():
    e = evidence()
    for name in ("rms_and_sd_rise_with_speed", "high_frequency_rises_with_speed", "ring_force_rises_with_radius"):
        assert judge(claim(measure=name, rule="true"), e)[1] == REPRODUCED
        worse = Evidence(e.metrics.assign(rpm=-e.metrics["rpm"]).sort_index(ascending=False), e.events, -115.0, 0.308)
        if name != "ring_force_rises_with_radius":
            assert judge(claim(measure=name, rule="true"), worse)[1] == NOT_REPRODUCED
    falling = e.metrics.assign(ring_rms_n=-e.metrics["ring_rms_n"])
    assert not MEASURES["ring_force_rises_with_radius"](Evidence(falling, e.events, 115.0, 0.308))


def test_ratio_of_forces_is_fastest_to_slowest():
    left, ring = MEASURES["force_growth_with_speed"](evidence())
    assert left == pytest.approx(310 / 215)
    assert ring == pytest.approx((400 + 210) / (400 + 115))


def test_what_cannot_be_compared_is_not_judged():
    card = judge_all([claim(rule="not_comparable", measure=None)], evidence())
    assert card.loc[0, "verdict"] == NOT_COMPARABLE
    assert card.loc[0, "measured"] == ""


@pytest.mark.parametrize(
    ("change", "parts"),
    [
        ({"measure": "no_such"}, ["C01", "measure = 'no_such' is unknown", "loop_gap_max"]),
        ({"reason": ...}, ["reason is missing"]),
        ({"reason": "short"}, ["reason = 'short'"]),
        ({"rule": "equal", "tolerance": ...}, ["C01", "tolerance is missing"]),
        ({"rule": "about"}, ["rule = 'about'"]),
        ({"id": "X1"}, ["id = 'X1'"]),
        ({"colour": 1}, ["colour is not a known parameter"]),
        ({"id": "C02"}, ["C02 stands twice"]),
    ],
)
def test_bad_claims_are_refused_in_one_sentence(tmp_path, change, parts):
    data = yaml.safe_load(FILE.read_text(encoding="utf-8"))
    first = copy.deepcopy(data["claims"][0])
    for key, value in change.items():
        if value is ...:
            first.pop(key, None)
        else:
            first[key] = value
    data["claims"][0] = first
    path = tmp_path / "claims.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_claims(path)
    text = str(caught.value)
    assert text.startswith(str(path)) and "\n" not in text
    for part in parts:
        assert part in text

"""The rings that the rules choose on sampled tracks, from rows that are invented."""

import numpy as np
import pytest

from laboratory.plausible.rings import of_track, rings
from laboratory.plausible.rows import scene_name
from laboratory.plausible.settings import load_plausible
from trackdyn.rig.rig import load_rig
from trackdyn.sweeps.engine import DONE, REFUSED

CONFIG = load_plausible("config/plausible.yaml")
RUN, RADII, RIG = CONFIG.rings.runs[0], CONFIG.rings.radii_m, load_rig("parts")
BARE = 8000.0  # N, of the right arc


def row(force, right=(0.0,) * 11, carried=40.0):
    """A row whose left arc has these forces (N) by radius at 115 rpm, a tenth less at 210 rpm."""
    values = {}
    for rpm in RUN.speeds_rpm:
        common = {"ring_share_pct": carried, "mobilised_friction": rpm / 1e3, "left_rms_n": 90.0, "right_rms_n": 9.0}
        none = {"left_peak_n": 100.0, "right_peak_n": BARE, "settled_tension_n": 4000.0, "right_share_pct": 40.0}
        values[scene_name(rpm, None)] = common | none | {"left_share_pct": 40.0}
        for radius, peak, share in zip(RADII, force, right, strict=True):
            values[scene_name(rpm, radius)] = common | {
                "left_peak_n": peak * (1.0 if rpm == 115 else 0.9), "right_peak_n": 50.0, "left_share_pct": 9.0,
                "right_share_pct": share, "settled_tension_n": 4e6 * (radius - 0.3),
            }  # fmt: skip
    return {"state": DONE, "values": {"starts": [values]}}


def chosen(force, **columns):
    return {choice["rule"]: choice for choice in of_track(CONFIG, RUN, row(force, **columns), RIG)}


# by radius from 0.303 m on, in steps of a millimetre: half is 4000 N
FORCE = [9000, 7000, 5000, 3900, 3000, 2000, 2100, 2000, 2000, 2000, 4500]


def test_each_rule_chooses_a_ring_with_its_gain_and_cost():
    of = chosen(FORCE, right=[3, 0.6, 0.4, 0, 0, 0, 0, 0, 0.5, 2, 3])
    radii = {rule: choice["radius_m"] for rule, choice in of.items() if choice["state"] == "chosen"}
    assert radii == {"0.3": 0.308, "0.5": 0.306, "0.7": 0.305, "durations": 0.305}
    half = of["0.5"]
    assert half["tooth_ratio"] == pytest.approx(3900 / BARE) and half["tension_ratio"] == pytest.approx(6.0)
    assert half["kept_m"] == "0.306 0.307 0.308 0.309 0.31 0.311 0.312"
    assert of["durations"]["tooth_ratio"] == 5000 / BARE and of["durations"]["least_ratio"] == 2000 / BARE
    # the right arc is free from 0.305 m on and comes back at 0.311 m
    assert {choice["right_back_m"] for choice in of.values()} == {0.311}
    assert half["mobilised_friction"] == pytest.approx((0.115 + 0.210) / 2)


def test_why_no_ring_is_chosen_is_told_apart():
    small, half, *_ = chosen([9000] * 5 + [3000] + [9000] * 5).values()
    assert (half["state"], half["kept_m"]) == ("larger misses", "0.308") and np.isnan(half["radius_m"])
    assert (small["state"], small["kept_m"], small["least_ratio"]) == ("none", "", 3000 / BARE)
    assert np.isnan(small["right_back_m"])
    assert of_track(CONFIG, RUN, row(FORCE, carried=0.4), RIG) == [{"state": "jammed"}]
    assert of_track(CONFIG, RUN, {"state": REFUSED, "values": {}}, RIG) == [{"state": REFUSED}]


def test_a_run_takes_each_so_many_tracks_from_its_own_start(monkeypatch):
    starts = []

    def run_rigs(config, rigs, scenes, jobs, store):
        starts.append((config.row.starts, len(rigs), len(scenes)))
        return [row(FORCE)] * len(rigs)

    monkeypatch.setattr("laboratory.plausible.rings.run_rigs", run_rigs)
    table = rings(CONFIG, dict.fromkeys(range(20), RIG), {0, 8}, 1, "")
    scenes = 2 * (1 + len(RADII))
    assert starts == [(CONFIG.row.starts[:1], 20, scenes), (CONFIG.row.starts[1:2], 3, scenes)]
    assert table.groupby("start")["draw"].unique().map(list).to_dict() == {1: list(range(20)), 2: [0, 8, 16]}
    assert table.loc[table["draw"] == 8, "engaged"].all() and not table.loc[table["draw"] == 9, "engaged"].any()
    assert (table["polygon_m"] == RIG.equal_pitch_radii["polygon"]).all()

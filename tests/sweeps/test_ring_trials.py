"""The rule on stored studies of five tracks: neither the ends of the radii nor their grid move the choice.

``python -m tests.sweeps.ring_trials`` made the rows (``docs/measured/ring_trials.csv``).
"""

import numpy as np
import pandas as pd
import pytest

from tests.sweeps.ring_trials import BEYOND, STORED, TRACKS
from trackdyn.measure.ring_rule import RULE, parse_rule
from trackdyn.rig.rig import load_rig
from trackdyn.scene.rings import study_radii

ROWS = pd.read_csv(STORED)


def grids(rows):
    """Rows of the default radii, then of these with ends cut or extended by a millimetre, and of the halved grid."""
    radius = rows["ring_radius_m"]
    default = rows[rows["grid"] == "default"]
    ends = default["ring_radius_m"].min(), default["ring_radius_m"].max()
    low, high = (default["ring_radius_m"] >= ends[0] + BEYOND), (default["ring_radius_m"] <= ends[1] - BEYOND)
    return {
        "default": default,
        "lower end cut": default[low],
        "upper end cut": default[high],
        "both cut": default[low & high],
        "lower end extended": rows[(rows["grid"] == "default") | (radius < ends[0])],
        "upper end extended": rows[(rows["grid"] == "default") | (radius > ends[1])],
        "halved": rows[rows["grid"].isin(["default", "halved"])],
        "halved and extended": rows,
    }


@pytest.mark.parametrize("margin", [1.0, 1.5, 2.0, 2.5, 3.0])
@pytest.mark.parametrize("speed", [0, 1, None])
@pytest.mark.parametrize("track", TRACKS)
def test_the_choice_stays_within_a_step_of_the_grid(track, speed, margin):
    rows = ROWS[(ROWS["track"] == track) & ROWS["ring_radius_m"].notna()]
    if speed is not None:
        rows = rows[rows["rpm"] == TRACKS[track][1][speed]]
    rule = parse_rule(RULE.replace("tooth + 2", f"tooth + {margin:g}"), int(rows["teeth"].iloc[0]))
    chosen = {name: rule.radius(of) for name, of in grids(rows).items()}
    step = np.diff(np.unique(grids(rows)["default"]["ring_radius_m"])).max()
    assert list(chosen.values()) == pytest.approx([chosen["default"]] * len(chosen), abs=1.01 * step), chosen


@pytest.mark.parametrize("track", TRACKS)
def test_the_rows_are_those_of_the_present_rig(track):
    """To a tenth of a millimetre; else the rig has changed and its trials have to run again."""
    stored = ROWS.loc[(ROWS["track"] == track) & (ROWS["grid"] == "default"), "ring_radius_m"].unique()
    assert sorted(stored) == pytest.approx(study_radii(load_rig(TRACKS[track][0])), abs=1e-4)


def test_a_rule_that_looks_at_the_least_of_all_radii_would_fail():
    """What the trials are for: where the left contact falls to the end of the radii, it takes such a choice along."""
    halves = np.arange(-2, 23)
    grid = np.where((halves < 0) | (halves > 20), "beyond", np.where(halves % 2, "halved", "default"))
    rows = pd.DataFrame({"ring_radius_m": 0.303 + 5e-4 * halves, "grid": grid, "left_share_pct": 11 - 0.35 * halves})

    def choice(of):
        return of.loc[of["left_share_pct"] <= of["left_share_pct"].min() + 2, "ring_radius_m"].min()

    chosen = {name: choice(of) for name, of in grids(rows).items()}
    assert np.ptp(list(chosen.values())) > 1.5e-3, chosen  # steps of 1 mm

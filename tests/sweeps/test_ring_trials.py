"""The rule on the studies that `ring_trials` stored: neither the ends of the radii nor their grid move the choice."""

import numpy as np
import pandas as pd
import pytest

from tests.sweeps.ring_trials import BEYOND, STORED, TRACKS
from trackdyn.measure.ring_rule import RingRule
from trackdyn.rig.rig import load_rig
from trackdyn.scene.rings import study_radii

ROWS = pd.read_csv(STORED)


def grids(rows):
    """Rows of the default radii, then of these with ends cut or extended by a millimetre, and of the halved grid."""
    radius, grid, none = rows["ring_radius_m"], rows["grid"], rows["ring_radius_m"].isna()
    default, (low, high) = (grid == "default") | none, radius[grid == "default"].agg(["min", "max"])
    lower, upper = radius < low + BEYOND, radius > high - BEYOND
    chosen = {
        "default": default, "lower end cut": default & ~lower, "upper end cut": default & ~upper,
        "both cut": default & ~lower & ~upper, "lower end extended": default | (radius < low),
        "upper end extended": default | (radius > high), "halved": default | (grid == "halved"),
        "halved and extended": grid.notna(),
    }  # fmt: skip
    return {name: rows[of] for name, of in chosen.items()}


@pytest.mark.parametrize("share", [0.3, 0.5, 0.7])
@pytest.mark.parametrize("speed", [0, 1, None])
@pytest.mark.parametrize("track", TRACKS)
def test_the_ends_of_the_radii_do_not_move_the_choice(track, speed, share):
    """Twice as many radii may find a narrow window below the choice, and none above it by more than a step."""
    rows = ROWS[ROWS["track"] == track]
    if speed is not None:
        rows = rows[rows["rpm"] == TRACKS[track][1][speed]]
    chosen = {name: RingRule(share).radius(of) for name, of in grids(rows).items()}
    halved = [chosen.pop(name) for name in ("halved", "halved and extended")]
    default, step = chosen["default"], np.diff(np.unique(grids(rows)["default"]["ring_radius_m"].dropna())).max()
    assert list(chosen.values()) == pytest.approx([default] * len(chosen), abs=1.01 * step, nan_ok=True), chosen
    assert halved[0] == pytest.approx(halved[1], abs=1.01 * step, nan_ok=True)
    assert not halved[0] > default + 1.01 * step and (np.isnan(default) or not np.isnan(halved[0]))


@pytest.mark.parametrize("track", TRACKS)
def test_the_rows_are_those_of_the_present_rig(track):
    """To a tenth of a millimetre; else the rig has changed and its trials have to run again."""
    stored = ROWS.loc[(ROWS["track"] == track) & (ROWS["grid"] == "default"), "ring_radius_m"].unique()
    assert sorted(stored) == pytest.approx(study_radii(load_rig(TRACKS[track][0])), abs=1e-4)

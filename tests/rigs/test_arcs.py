"""Tooth profiles from any list of arcs."""

import numpy as np
import pytest

from tests.conftest import RIG, refused
from trackdyn.rig.arcs import ToothProfile, groove_of_arcs
from trackdyn.rig.rig import load_rig


def arcs_of(groove):
    half = len(groove.radius) // 2
    return np.column_stack([groove.centre, groove.radius, np.where(groove.convex, 1.0, -1.0)])[:half]


@pytest.mark.parametrize("name", ["paper", "parts", "m113", "robot", RIG])
@pytest.mark.parametrize("decimals", [7, 6, 5, 4])
def test_arcs_as_print_rounds_them_are_joined(name, decimals):
    """Radii stay as printed, and errors of the contour are those of the slopes of its joints.

    From two rounded centres, a slope errs by up to root 2 units of the last decimal over their distance, and the end
    of an arc by its radius times as much. Two units are for the centres and radii themselves.
    """
    rig = load_rig(name)
    groove, arcs = rig.groove_profile, arcs_of(rig.groove_profile)
    rounded = np.round(arcs, decimals)
    joined = rig.changed(groove=None, profile=ToothProfile(arcs=rounded.tolist())).groove_profile
    distance = np.hypot(*np.diff(arcs[:, :2], axis=0).T)
    larger = np.maximum(arcs[1:, 2], arcs[:-1, 2])
    accepted = 10.0**-decimals * (2 + 2**0.5 * (larger / distance).max())
    assert np.abs(joined.profile() - groove.profile()).max() <= max(accepted, 1e-6)
    if decimals < 6:
        assert (joined.radius[1:5] == rounded[1:, 2]).all()
        assert np.abs([joined.arc(j, 2)[-1] - joined.arc(j + 1, 2)[0] for j in range(1, 10)]).max() < 1e-14


def test_arcs_that_do_not_fit_are_refused(rig):
    fitting = arcs_of(rig.groove_profile)
    for row, column, change, word in (
        (1, 2, 1e-3, "miss each other by 1 mm"), (0, 2, -1.0, "positive radii"), (slice(9), 0, 1e-3, "not centred"),
    ):  # fmt: skip
        arcs = fitting.copy()
        arcs[row, column] += change
        refused(groove_of_arcs, arcs, rig.sprocket.teeth, words=[word])
    in_mm, narrow = ToothProfile(arcs=fitting * [1e3, 1e3, 1e3, 1]), ToothProfile(arcs=[[0.0, 0.3, 0.089, -1]])
    refused(rig.changed, groove=None, profile=in_mm, words=["profile lies ", " in m, not in mm"])
    refused(narrow.groove, 10, 0.1, match=r"concave area of radius 0\.0\d+ m; it must be wider than")


def test_one_arc_a_groove_gets_a_tip_that_is_tangent_to_it():
    for teeth, height, radius in ((10, 0.3, 0.089), (12, 0.31, 0.05), (21, 0.0439, 0.0043)):
        groove = ToothProfile(arcs=[[0.0, height, radius, -1]]).groove(teeth)
        assert groove.convex.tolist() == [True, False, False, True]
        assert groove.profile()[:, 1].min() == pytest.approx(height - radius, abs=1e-12)
        assert np.abs([groove.arc(j, 2)[-1] - groove.arc(j + 1, 2)[0] for j in range(1, 4)]).max() < 1e-9
    refused(ToothProfile(arcs=[[0.0, 0.3, 0.089, 1]]).groove, 10, match="one row, which must be a concave arc")

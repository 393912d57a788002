"""Tooth profiles from any list of arcs."""

import numpy as np
import pytest

from tests.conftest import RIG
from trackdyn.inputs.errors import InputError
from trackdyn.rig.arcs import ToothProfile, groove_of_arcs
from trackdyn.rig.rig import load_rig


def arcs_of(groove):
    half = len(groove.radius) // 2
    sign = np.where(groove.convex, 1.0, -1.0)
    return np.column_stack([groove.centre, groove.radius, sign])[:half]


@pytest.mark.parametrize("name", ["paper", "parts", "m113", "robot", RIG])
@pytest.mark.parametrize("decimals", [7, 6, 5, 4])
def test_arcs_as_print_rounds_them_are_joined(name, decimals):
    """Radii stay as printed; the error of the contour depends on the difference of neighbouring radii.

    The slope of a joint, from two rounded centres, errs by up to root 2 units of the last decimal over their distance,
    and the end of an arc by its radius times as much. Two units are for the centres and radii themselves.
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
        with pytest.raises(InputError, match=word):
            groove_of_arcs(arcs, rig.sprocket.teeth)


def test_one_arc_a_groove_gets_a_tip_that_is_tangent_to_it():
    for teeth, height, radius in ((10, 0.3, 0.089), (12, 0.31, 0.05), (21, 0.0439, 0.0043)):
        groove = ToothProfile(arcs=[[0.0, height, radius, -1]]).groove(teeth)
        assert groove.convex.tolist() == [True, False, False, True]
        assert groove.profile()[:, 1].min() == pytest.approx(height - radius, abs=1e-12)
        assert np.abs([groove.arc(j, 2)[-1] - groove.arc(j + 1, 2)[0] for j in range(1, 4)]).max() < 1e-9
    with pytest.raises(InputError, match="one row, which must be a concave arc"):
        ToothProfile(arcs=[[0.0, 0.3, 0.089, 1]]).groove(10)


def test_lengths_in_mm_are_named_by_the_size_of_the_sprocket(rig):
    arcs = (arcs_of(rig.groove_profile) * [1e3, 1e3, 1e3, 1]).tolist()
    with pytest.raises(InputError, match=r"profile lies [23]\d\d\.?\d* m from .* in m, not in mm"):
        rig.changed(groove=None, profile=ToothProfile(arcs=arcs))


def test_arcs_that_connectors_do_not_fit_into_are_refused():
    with pytest.raises(InputError, match=r"concave area of radius 0\.0\d+ m; it must be wider than"):
        ToothProfile(arcs=[[0.0, 0.3, 0.089, -1]]).groove(10, 0.1)

"""Gaps between arcs and their grooves: against the contact search, and on a recording that was made by hand."""

import numpy as np
import pytest

from trackdyn.contact.tooth import find_area
from trackdyn.measure.clearance import groove_gap
from trackdyn.scene.scene import Scene


@pytest.fixture(scope="module")
def tooth(rig):
    return Scene(rig, 115, 0.308).model.tooth


def test_a_gap_is_what_the_depth_lacks(tooth, rng=None):
    """Where the search finds an area the gap is its depth with the other sign; elsewhere no arc touches."""
    rng = np.random.default_rng(3)
    x = rng.uniform(-0.06, 0.06, 4000)
    y = rng.uniform(0.25, 0.36, 4000)
    gap = groove_gap(tooth, x, y)
    found = [getattr(find_area, "py_func", find_area)(tooth, *at)[:2] for at in zip(x, y, strict=True)]
    touching = np.array([area > 0 and depth > 0 for area, depth in found])
    depth = np.array([depth for _, depth in found])
    assert 20 < touching.sum() < 3000
    assert (gap[touching] <= -depth[touching] + 1e-12).all()
    assert np.median(gap[touching] + depth[touching]) == pytest.approx(0, abs=1e-12)


def test_lifting_an_arc_off_its_seat_opens_the_gap_by_as_much(tooth):
    """Along the normal of an area, from its middle."""
    for j in (1, 2):  # concave ones of the left side
        assert not tooth.convex[j]
        reach = tooth.radius[j] - tooth.arc_radius
        lift = np.array([0.0, 0.2e-3, 0.5e-3])
        x = tooth.centre_x[j] + (reach - lift) * tooth.direction_x[j]
        y = tooth.centre_y[j] + (reach - lift) * tooth.direction_y[j]
        assert groove_gap(tooth, x, y) == pytest.approx(lift, abs=1e-9)

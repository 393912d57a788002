"""Schematics follow the geometry and the program: groove, sectors, elements, flow of the search, contact cases."""

import numpy as np
import pytest
from matplotlib.patches import Wedge

from replication.report.figures.schematics import FIGURES
from tests.conftest import ROOT
from trackdyn.contact.laws import find_area
from trackdyn.rig.rig import load_rig
from trackdyn.scene.build import make_tooth

RIG = load_rig(ROOT / "tests" / "viscous.yaml")
# another groove: wider flanks, higher bumps, a smaller arc on the connector
OTHER = RIG.changed(groove__r2=0.047, groove__r4=0.026, chain__connector_radius=0.028)
DRAWN = {}


def drawn(number, rig=RIG):
    """A figure, drawn once for all tests."""
    key = number, rig is RIG
    if key not in DRAWN:
        DRAWN[key] = FIGURES[number](rig)
    return DRAWN[key]


def labelled(figure, label, kind=object):
    """All artists of a figure with this label."""
    return [
        item for ax in figure.axes for item in ax.get_children() if item.get_label() == label and isinstance(item, kind)
    ]


def tooth_of(rig):
    return make_tooth(rig.groove_profile, rig.chain.connector_radius, 0)


@pytest.mark.parametrize("rig", [RIG, OTHER], ids=["shipped", "other"])
def test_drawn_sectors_hold_exactly_the_points_that_the_search_gives_to_their_area(rig):
    figure, tooth = drawn(7, rig), tooth_of(rig)
    sectors = [labelled(figure, f"sector {area}", Wedge) for area in range(1, 11)]
    assert all(len(points_of_area) == 1 for points_of_area in sectors)
    points = np.random.default_rng(7).uniform([-0.1, 0.28], [0.1, 0.37], (6000, 2))
    inside = np.zeros((10, len(points)), bool)
    for within, (sector,) in zip(inside, sectors, strict=True):
        e = points - sector.center
        distance = np.hypot(*e.T)
        angle = (np.degrees(np.arctan2(e[:, 1], e[:, 0])) - sector.theta1) % 360
        within[:] = (distance >= sector.r - sector.width) & (distance <= sector.r)
        within &= angle <= (sector.theta2 - sector.theta1) % 360
    assert inside.sum(axis=0).max() == 1, "sectors do not overlap"
    drawn_area = np.where(inside.any(axis=0), inside.argmax(axis=0) + 1, 0)
    searched = [find_area(tooth, float(x), float(y))[0] for x, y in points]
    np.testing.assert_array_equal(drawn_area, searched)
    assert set(searched) >= {0, 1, 2, 4, 5, 6, 7, 9, 10}


@pytest.mark.parametrize("name", ["bench", "robot", "m113"])
def test_rigs_with_other_wheels_are_drawn(name):
    """The figures that name the wheels: one, two on arms, six beside the sprocket, without a ring."""
    for number in (1, 4, 16):
        FIGURES[number](load_rig(name))

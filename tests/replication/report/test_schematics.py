"""Schematics follow the geometry and the program: groove, sectors, elements, flow of the search, contact cases."""

from pathlib import Path
from pkgutil import resolve_name

import numpy as np
import pytest
from matplotlib.patches import Wedge

from replication.paper.contents import PAPER
from replication.report.figures import engagement
from trackdyn.contact.tooth import find_area
from trackdyn.parameters.layout import belt_around
from trackdyn.parameters.rig import load_rig
from trackdyn.plots.style import save
from trackdyn.scene.build import make_tooth

ROOT = Path(__file__).parents[3]
RIG = load_rig(ROOT / "config" / "rig.yaml")
# another groove: wider flanks, higher bumps, a smaller arc on the connector
OTHER = RIG.changed(groove__r2=0.047, groove__r4=0.026, chain__connector_radius=0.028)
FIGURES = {int(item.key[3:]): resolve_name(item.draw) for item in PAPER if item.rule == "schematics"}
EXACT = 1e-12  # m: positions below 1 m through a few operations
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


def test_every_schematic_of_the_paper_is_there():
    assert sorted(FIGURES) == [*range(1, 13), 16]


@pytest.mark.parametrize("number", [3, 7, 12])
def test_the_same_rig_gives_the_same_bytes(number, tmp_path):
    for name in ("one", "two"):
        save(FIGURES[number](RIG), tmp_path / f"{name}.png")
    for ending in (".png", ".svg"):
        assert (tmp_path / f"one{ending}").read_bytes() == (tmp_path / f"two{ending}").read_bytes()


@pytest.mark.parametrize("rig", [RIG, OTHER], ids=["shipped", "other"])
def test_drawn_sectors_hold_exactly_the_points_that_the_search_gives_to_their_area(rig):
    figure, tooth = drawn(7, rig), tooth_of(rig)
    sectors = [labelled(figure, f"sector {area}", Wedge) for area in range(1, 11)]
    assert all(len(found) == 1 for found in sectors)
    points = np.random.default_rng(7).uniform([-0.1, 0.28], [0.1, 0.37], (6000, 2))
    inside = np.zeros((10, len(points)), bool)
    for held, (sector,) in zip(inside, sectors, strict=True):
        e = points - sector.center
        distance = np.hypot(*e.T)
        turn = (np.degrees(np.arctan2(e[:, 1], e[:, 0])) - sector.theta1) % 360
        held[:] = (distance >= sector.r - sector.width) & (distance <= sector.r)
        held &= turn <= (sector.theta2 - sector.theta1) % 360
    assert inside.sum(axis=0).max() == 1, "sectors do not overlap"
    drawn_area = np.where(inside.any(axis=0), inside.argmax(axis=0) + 1, 0)
    searched = [find_area(tooth, float(x), float(y))[0] for x, y in points]
    np.testing.assert_array_equal(drawn_area, searched)
    assert set(searched) >= {0, 1, 2, 4, 5, 6, 7, 9, 10}


def test_the_kinematic_passage_rides_on_the_ring_and_just_touches_its_flank():
    way, tooth = engagement.passage(RIG), tooth_of(RIG)
    np.testing.assert_allclose(np.hypot(*(way.pins[:, 1] - way.pins[:, 0]).T), RIG.connector_length, rtol=0, atol=1e-10)
    middle = len(way.turn) // 2
    on_ring = np.hypot(RIG.sprocket.ring_radius + RIG.chain.link_thickness / 2, RIG.chain.link_length / 2)
    np.testing.assert_allclose(np.hypot(*way.pins[middle].T), on_ring, rtol=0, atol=1e-10)
    assert belt_around(RIG)[0].circles[0, 2] == pytest.approx(on_ring, abs=EXACT)
    left = way.pins[:, 0]
    assert not any(find_area(tooth, float(x), float(y))[0] for x, y in left)
    assert any(find_area(tooth, float(x) - 1e-5, float(y))[0] in (1, 2) for x, y in left)
    # at both ends the connector is farther out than on the ring
    assert (way.pins[[0, -1], :, 1].mean(axis=1) > way.pins[middle, :, 1].mean() + 0.005).all()

"""Schematics follow the geometry and the program: groove, sectors, elements, flow of the search, contact cases."""

import ast
import importlib
import inspect
import re
from itertools import combinations, pairwise
from pathlib import Path
from pkgutil import resolve_name

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import Circle, Polygon, Wedge
from matplotlib.text import Text

from replication.paper.contents import PAPER
from replication.report.figures import contact_cases, engagement, flow, system, topology
from trackdyn.contact import loads
from trackdyn.contact.tooth import find_area
from trackdyn.contact.wheel import foot
from trackdyn.parameters.layout import belt_around
from trackdyn.parameters.rig import load_rig
from trackdyn.plots.drawing import laid_frame
from trackdyn.plots.style import save
from trackdyn.scene.build import build_chain, make_tooth

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


def circle_through(points):
    """Centre and radius of the circle through the first, middle and last of some points."""
    a, b, c = points[0], points[len(points) // 2], points[-1]
    centre = np.linalg.solve(2 * np.array([b - a, c - a]), [b @ b - a @ a, c @ c - a @ a])
    return centre, np.hypot(*(a - centre))


def tooth_of(rig):
    return make_tooth(rig.groove_profile, rig.chain.connector_radius, 0)


def test_every_schematic_of_the_paper_is_there():
    assert sorted(FIGURES) == [*range(1, 13), 16]


@pytest.mark.parametrize("number", sorted(FIGURES))
def test_no_two_texts_overlap_and_none_is_cut_off(number):
    figure = drawn(number)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    width, height = canvas.get_width_height()
    boxes = []
    for text in figure.findobj(Text):
        if text.get_visible() and text.get_text().strip():
            boxes.append((text.get_text(), Text.get_window_extent(text, renderer)))  # without a leader
    ticks = {label.get_text() for ax in figure.axes for label in (*ax.get_xticklabels(), *ax.get_yticklabels())}
    boxes = [(name, box) for name, box in boxes if name not in ticks]
    for name, box in boxes:
        assert box.x0 > -1 and box.y0 > -1 and box.x1 < width + 1 and box.y1 < height + 1, name
    for (one, a), (two, b) in combinations(boxes, 2):
        across = min(a.x1, b.x1) - max(a.x0, b.x0)
        up = min(a.y1, b.y1) - max(a.y0, b.y0)
        # boxes of turned and of mathematical text are larger than what is inked
        assert min(across, up) < 4, f"{one!r} and {two!r}"


@pytest.mark.parametrize("number", [3, 7, 12])
def test_the_same_rig_gives_the_same_bytes(number, tmp_path):
    for name in ("one", "two"):
        save(FIGURES[number](RIG), tmp_path / f"{name}.png")
    for ending in (".png", ".svg"):
        assert (tmp_path / f"one{ending}").read_bytes() == (tmp_path / f"two{ending}").read_bytes()


@pytest.mark.parametrize("rig", [RIG, OTHER], ids=["shipped", "other"])
def test_drawn_arcs_are_the_groove_and_meet_with_a_common_tangent(rig):
    figure = drawn(5, rig)
    arcs = [labelled(figure, f"area {area}")[0] for area in range(1, 11)]
    points = [arc.get_xydata() for arc in arcs]
    for area, arc in enumerate(points, 1):
        centre, radius = circle_through(arc)
        # three points of an arc of 2 theta: the centre is known to rounding over 1 - cos theta
        lost = 1e-15 / (1 - np.cos(rig.groove_profile.half_angle[area - 1]))
        np.testing.assert_allclose(radius, rig.groove_profile.radius[area - 1], rtol=0, atol=EXACT + 10 * lost)
        np.testing.assert_allclose(centre, rig.groove_profile.centre[area - 1], rtol=0, atol=EXACT + 10 * lost)
    for before, after in pairwise(points):
        np.testing.assert_allclose(before[-1], after[0], rtol=0, atol=EXACT)
        end, start = before[-1] - before[-2], after[1] - after[0]
        turn = np.arctan2(end[0] * start[1] - end[1] * start[0], end @ start)
        # chords deviate from the tangent by half their arcs: at most 35 degrees on 59 chords each
        assert abs(turn) < np.radians(36) / 59
    dashes = {str(arc.get_linestyle()) for arc, convex in zip(arcs, rig.groove_profile.convex, strict=True) if convex}
    assert len(dashes) == 1, "convex areas have one look"
    others = {
        str(arc.get_linestyle()) for arc, convex in zip(arcs, rig.groove_profile.convex, strict=True) if not convex
    }
    assert len(others) == 1 and others != dashes, "which can be told without colour"


@pytest.mark.parametrize("number", [7, 8])
def test_drawn_sectors_follow_the_config(number):
    """Eq. 21 by hand, for a rig with other radii."""
    rc, r2, r4 = OTHER.chain.connector_radius, OTHER.groove.r2, OTHER.groove.r4
    sector = labelled(drawn(number, OTHER), "sector 2", Wedge)[0]
    np.testing.assert_allclose([sector.r, sector.width], [r2, rc], rtol=0, atol=EXACT)
    before = labelled(drawn(number), "sector 2", Wedge)[0]
    assert abs(before.r - sector.r) > 1e-3 and abs(before.width - sector.width) > 1e-3
    for sector in labelled(drawn(number, OTHER), "sector 4", Wedge):
        np.testing.assert_allclose([sector.r, sector.width], [r4 + rc, rc], rtol=0, atol=EXACT)


def test_drawn_arcs_follow_the_config():
    for number, area in ((5, 2), (5, 4), (7, 4), (8, 2)):
        radius = circle_through(labelled(drawn(number, OTHER), f"area {area}")[0].get_xydata())[1]
        assert abs(radius - getattr(OTHER.groove, f"r{area}")) < 1e-9, (number, area)


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


@pytest.mark.parametrize("rig", [RIG, OTHER], ids=["shipped", "other"])
def test_the_trajectory_keeps_the_radius_of_the_arc_from_the_profile(rig):
    path = labelled(drawn(7, rig), "trajectory")[0].get_xydata()
    profile = rig.groove_profile.profile(2000)
    nearest = np.hypot(*(path[:, None] - profile[None]).transpose(2, 0, 1)).min(axis=1)
    # half the spacing of the profile's points, 20 micrometres, over the radius
    np.testing.assert_allclose(nearest, rig.chain.connector_radius, rtol=0, atol=1e-8)


def test_a_seated_connector_just_touches():
    tooth, pins = tooth_of(RIG), engagement.seated_pins(RIG)
    np.testing.assert_allclose(pins[1] - pins[0], [RIG.connector_length, 0.0], rtol=0, atol=EXACT)
    for x, y in pins:
        assert find_area(tooth, float(x), float(y) - 1e-5)[0] > 0
        assert find_area(tooth, float(x), float(y) + 1e-5)[0] == 0


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


@pytest.mark.parametrize("bodies", [1, 2, 7])
def test_elements_form_one_closed_chain_that_is_cut_once(bodies):
    found = topology.elements(["link", "connector"] * bodies)
    count = 4 * bodies
    assert [element.number for element in found] == list(range(1, count + 1))
    way = [1]
    while (following := found[way[-1] - 1].outboard) != 1:
        way.append(following)
    assert way == list(range(1, count + 1))
    assert [element.number for element in found if element.cut] == [count]
    assert {element.kind for element in found[1::2]} == {"joint"}
    assert "joint" not in {element.kind for element in found[::2]}


def test_topology_is_drawn_from_the_chain_and_as_printed():
    figure, chain = drawn(3), build_chain(RIG)
    simulated, printed = figure.axes
    drawn_bodies = [
        [patch.get_label().split() for patch in ax.patches if isinstance(patch, (Circle, Polygon))]
        for ax in (simulated, printed)
    ]
    assert len(drawn_bodies[0]) == len(chain.length) == 70
    assert [kind for kind, _ in drawn_bodies[0]] == ["link", "connector"] * 35
    assert len(drawn_bodies[1]) == len(build_chain(RIG, "single_pin").length) == 35
    for ax, cut in ((simulated, 140), (printed, 70)):
        assert len(labelled(figure, "cut")) == 2
        assert any(f"joint {cut}, cut" in text.get_text() for text in ax.texts)
    # the paper: 35 bodies, 34 joints, joint element 70 cut
    assert "35 bodies, 34 joints" in printed.get_title(loc="left")


def calls_of(function):
    """Names that a function calls, in the order of the text."""
    tree = ast.parse(inspect.getsource(getattr(function, "py_func", function)))
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)]
    return [call.func.id for call in sorted(calls, key=lambda call: (call.lineno, call.col_offset))]


def in_order(names, calls):
    remaining = iter(calls)
    return all(name in remaining for name in names)


def test_the_flow_chart_names_functions_that_exist_and_are_called_in_its_order():
    steps = flow.contact_steps(RIG)
    for step in steps.values():
        module, _, name = step.function.partition(":")
        assert callable(getattr(importlib.import_module(f"trackdyn.contact.{module}"), name)), step
    assert in_order(["groove_index", "find_area", "stored_impact_speed", "apply"], calls_of(loads.tooth_loads))
    assert in_order(["normal_force", "friction_coefficients"], calls_of(loads.apply))
    assert in_order(["tooth_loads", "wheel_loads"], calls_of(loads.contact_loads))
    names = [step.function.partition(":")[2] for step in steps.values()]
    drawn_order = ["groove_index", "find_area", "stored_impact_speed", "normal_force", "friction_coefficient"]
    assert in_order(drawn_order, names)


def test_the_flow_chart_gives_equations_to_the_functions_that_the_map_gives_them_to():
    page = (ROOT / "docs" / "equations.md").read_text(encoding="utf-8")
    for key, step in flow.contact_steps(RIG).items():
        for equation in step.equations:
            row = re.search(rf"^\| {equation} \|.*$", page, re.MULTILINE)[0]
            assert f"`trackdyn.contact.{step.function}`" in row, (key, equation)


def test_the_flow_chart_has_the_order_in_which_the_search_visits_the_areas(monkeypatch):
    assert flow.search_order(RIG, left=True) == [1, 2, 3, 4, 5]
    assert flow.search_order(RIG, left=False) == [10, 9, 8, 7, 6]
    texts = " ".join(text.get_text() for text in drawn(11).axes[0].texts)
    assert "areas 1, 2, 3, 4, 5" in texts and "areas 10, 9, 8, 7, 6" in texts
    # another search is drawn as another chart
    monkeypatch.setattr(
        flow, "find_area", lambda tooth, x, y: find_area(tooth._replace(centre_x=-tooth.centre_x), -x, y)
    )
    assert flow.search_order(RIG, left=True) == [10, 9, 8, 7, 6]


def test_every_way_through_the_flow_chart_ends():
    steps = flow.contact_steps(RIG)
    after = {key: [end for start, end, *_ in flow.WAYS if start == key] for key in steps}
    for key, step in steps.items():
        assert len(after[key]) == (0 if key == "end" else 2 if step.question else 1), key
    reached, new = set(), {"start"}
    while new:
        reached |= new
        new = {end for key in new for end in after[key]} - reached
    assert reached == set(steps)


@pytest.mark.parametrize(("number", "area"), [(9, 1), (10, 2)])
def test_arc_contacts_are_drawn_where_the_search_finds_them(number, area):
    place = contact_cases.touching_centre(RIG, area)
    found, depth, nx, ny, _ = find_area(tooth_of(RIG), *map(float, place))
    assert found == area
    assert RIG.groove_profile.convex[area - 1] == (number == 9)
    assert depth == pytest.approx(contact_cases.SHOWN_DEPTH * RIG.chain.connector_radius, abs=EXACT)
    arc = labelled(drawn(number), "arc", Circle)[0]
    np.testing.assert_allclose(arc.center, place, rtol=0, atol=EXACT)
    # moved out along the normal by the depth, the arc just touches
    free = place + (depth + 1e-9) * np.array([nx, ny])
    assert find_area(tooth_of(RIG), *map(float, free))[0] == 0


def test_links_are_drawn_in_the_three_cases():
    ranges = {"left end contact": (-np.inf, 0), "vertical contact": (0, 1), "right end contact": (1, np.inf)}
    assert contact_cases.LINK_CASES.keys() == ranges.keys()
    ring, half = RIG.sprocket.ring_radius, RIG.chain.link_thickness / 2
    for ax, (case, fraction) in zip(drawn(12).axes[:3], contact_cases.LINK_CASES.items(), strict=True):
        start, end = contact_cases.placed_link(RIG, fraction)
        assert np.hypot(*(end - start)) == pytest.approx(RIG.chain.link_length, abs=EXACT)
        s, qx, qy, distance = foot(*map(float, (*start, *end, 0.0, 0.0)))
        assert s == pytest.approx(fraction, abs=1e-9)
        assert ranges[case][0] < s < ranges[case][1]
        assert ring + half - distance == pytest.approx(contact_cases.SHOWN_LINK_DEPTH * half, abs=EXACT)
        assert case in ax.get_title(loc="left")
        outline = next(patch for patch in ax.patches if patch.get_label() == "link").get_xy()
        # the drawn outline reaches as far below Q as the law of contact takes it to
        edge = np.linspace(outline[:-1], outline[1:], 50).reshape(-1, 2)
        assert np.hypot(*edge.T).min() == pytest.approx(distance - half, abs=1e-4)
        marked = [line.get_xydata()[0] for line in ax.lines if line.get_marker() == "o"]
        assert np.hypot(*(np.array(marked) - [qx, qy]).T).min() < EXACT


def test_the_model_shows_the_contacts_of_the_laid_loop():
    frame, shift = laid_frame(RIG)
    found = system.touching_links(RIG, frame, shift)
    assert {wheel for _, wheel, _ in found} == {0, 1, 2}
    assert all(body % 2 == 0 for body, *_ in found)
    # about as many links on the sprocket as pitches fit on its wrap
    wrap = belt_around(RIG, shift)[0].wrap[0]
    assert abs(sum(wheel == 0 for _, wheel, _ in found) - wrap / (2 * np.pi) * RIG.sprocket.teeth) < 1.5

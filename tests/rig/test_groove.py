"""Grooves of ten arcs, tangent and symmetric, and of any list of arcs; refusals."""

from math import asin, cos, degrees, pi, sin, sqrt

import numpy as np
import pytest

from tests.conftest import RIG, refused
from trackdyn.rig.arcs import ToothProfile, groove_of_arcs
from trackdyn.rig.groove import build_groove, coarse_groove, connector_length, equal_pitch_radii, true_depth
from trackdyn.rig.rig import load_rig
from trackdyn.rig.sections import GrooveParameters

EXACT = 1e-12  # m or a unit vector: coordinates below 1 m carry about 1e-16 through ten operations


def wide(**changes):
    """A second groove, for which every property must hold, too."""
    values = {"seat_depth": 0.001, "slope_bottom": 25, "slope_low": 0.0, "slope_seat": 30, "slope_tip": 65}
    values |= {"r2": 0.052, "r3": 0.033, "r4": 0.030, "r5": 0.045} | changes
    return build_groove(GrooveParameters(**values), 13, 0.0577, 0.030, 0.3268)


@pytest.fixture(params=["shipped", "wide"])
def groove(request, rig):
    return rig.groove_profile if request.param == "shipped" else wide()


def test_neighbouring_arcs_meet_with_a_common_tangent(groove):
    ends, starts = (np.array([groove.arc(area)[k] for area in range(1, 11)]) for k in (-1, 0))
    out_of_steel = np.where(groove.convex, 1, -1) / groove.radius
    last, first = ((points - groove.centre) * out_of_steel[:, None] for points in (ends, starts))
    np.testing.assert_allclose(ends[:-1], starts[1:], rtol=0, atol=EXACT)
    np.testing.assert_allclose(last[:-1], first[1:], rtol=0, atol=EXACT)


def test_table_1_is_mirror_symmetric_from_tooth_line_to_tooth_line(groove):
    for name, mirror in {"centre": [-1, 1], "direction": [-1, 1], "radius": 1, "half_angle": 1}.items():
        np.testing.assert_array_equal(getattr(groove, name)[::-1], getattr(groove, name) * mirror)
    assert (np.flatnonzero(groove.convex) + 1).tolist() == [1, 4, 7, 10]
    profile, half = groove.profile(400), pi / groove.teeth
    np.testing.assert_allclose(profile[0], groove.addendum * np.array([-sin(half), cos(half)]), rtol=0, atol=EXACT)
    assert np.hypot(*profile.T).max() <= groove.addendum + EXACT


def test_seat_holds_the_connector_at_its_depth(rig):
    groove, seat = rig.groove_profile, 3
    # an arc resting on the lowest point of area 3 has its centre r3 - r_C below O_3
    height = groove.centre[seat - 1, 1] - (groove.radius[seat - 1] - rig.chain.connector_radius)
    pin_height = sqrt(rig.pin_circle**2 - rig.connector_length**2 / 4)
    assert height == pytest.approx(pin_height - rig.groove.seat_depth, abs=EXACT)


def test_groove_worked_out_in_another_order_is_reproduced():
    """A groove that was designed from its addendum circle and its pins; lengths rounded to 1e-6 m."""
    design = GrooveParameters(
        seat_depth=0.0, slope_bottom=degrees(asin(35.519 / 90)), slope_low=6, slope_seat=38, slope_tip=58.905,
        r2=0.034, r3=0.0228, r4=0.030, r5=0.060,
    )  # fmt: skip
    groove = build_groove(design, 13, 0.060, 0.022, 0.336164)
    centre = [(-76.902, 312.002), (-23.105, 344.448), (-30.0, 335.622), (-35.519, 283.112), (0, 365.806)]
    np.testing.assert_allclose(groove.centre[:5], np.array(centre) / 1e3, rtol=0, atol=2e-6)
    np.testing.assert_allclose(groove.radius[:5] * 1e3, [28.8241, 34.0, 22.8, 30.0, 60.0], rtol=0, atol=2e-3)
    np.testing.assert_allclose(np.degrees(groove.half_angle[:5]), [36.376, 10.452, 16.0, 8.622, 11.622], atol=1e-2)
    direction = [0.38316, -0.74841, -0.37461, 0.25245, -0.20146], [0.92368, -0.66324, -0.92718, 0.96761, -0.9795]
    np.testing.assert_allclose(groove.direction[:5].T, direction, rtol=0, atol=1e-4)
    assert groove.addendum == pytest.approx(0.350164, abs=2e-6)


def test_coarse_groove_keeps_the_ends_of_the_flanks_and_their_symmetry(groove, rig):
    radius = rig.chain.connector_radius
    coarse = coarse_groove(groove, radius)
    joints = groove.joints()
    np.testing.assert_allclose(coarse.centre[0], joints[0], rtol=0, atol=EXACT)
    np.testing.assert_allclose(coarse.arc(2)[0], joints[0], rtol=0, atol=EXACT)
    for point in (joints[0], groove.arc(2, 3)[1], joints[2]):
        assert np.hypot(*(point - coarse.centre[1])) == pytest.approx(coarse.radius[1], abs=EXACT)
    np.testing.assert_allclose(coarse.arc(4)[::-1], coarse.arc(2) * [-1, 1], rtol=0, atol=EXACT)
    np.testing.assert_allclose(coarse.centre[2], 0.0, rtol=0, atol=EXACT)
    # one circle touches the ends of both sectors at once
    flank, seat = coarse.arc(2)[-1], coarse.arc(3)[0]
    both = flank + (coarse.centre[1] - flank) * radius / coarse.radius[1]
    np.testing.assert_allclose(both, seat * (1 + radius / coarse.radius[2]), rtol=0, atol=EXACT)


def closed_walk(lengths, turn: float) -> np.ndarray:
    """Return (n, 2) corners, from their mean, of a polygon of sides of these lengths and equal turns."""
    heading = turn * np.arange(len(lengths))
    corners = np.cumsum(lengths * np.array([np.cos(heading), np.sin(heading)]), axis=1).T
    np.testing.assert_allclose(corners[-1], 0, atol=1e-9)
    return corners - corners.mean(axis=0)


@pytest.mark.parametrize(("teeth", "link", "polygon", "thickness", "expected"), [
    (13, 0.1023812, 0.3031331, 0.03859795, (0.3031, 0.3062, 0.3072, 0.3093)), (10, 0.0984, 0.208796, 0.05, None),
])  # fmt: skip
def test_readings_of_equal_pitch_are_radii_of_drawn_chains(teeth, link, polygon, thickness, expected):
    """Sides of two lengths that turn by pi / teeth at every pin close after a turn of the sprocket."""
    connector = connector_length(teeth, link, np.hypot(polygon + thickness / 2, link / 2))
    pins = closed_walk(np.tile([link, connector], teeth), pi / teeth)
    assert np.hypot(*pins.T) == pytest.approx(np.hypot(*pins[0]), rel=1e-9)
    links = 0.5 * (pins[0::2] + np.roll(pins, 1, axis=0)[0::2])  # middles of the sides that end at corners 0, 2, ...
    pitch_circle = closed_walk(np.full(teeth, link + connector), 2 * pi / teeth)
    bent = np.exp(2j * pi * np.linspace(0, 1, 20001))  # a circle as long as the chain
    drawn = {name: np.hypot(*at.T).mean() for name, at in (("polygon", links), ("pins", pins), ("chord", pitch_circle))}
    drawn["arc"] = teeth * (link + connector) / np.abs(np.diff(bent)).sum()
    radii = equal_pitch_radii(teeth, link, connector, thickness)
    assert radii == pytest.approx({reading: radius - thickness / 2 for reading, radius in drawn.items()}, abs=1e-8)
    assert radii["polygon"] == pytest.approx(polygon, abs=EXACT)
    if expected:
        assert tuple(radii.values()) == pytest.approx(expected, abs=5e-5)


# the last one: the flanks of a tooth cross before its tip
@pytest.mark.parametrize(("changed", "value", "field"), [
    ("slope_bottom", -6, "slope_bottom"), ("slope_low", 26, "slope_bottom"), ("slope_seat", -0.6, "slope_seat"),
    ("slope_tip", 20, "slope_tip"), ("r2", 0.030, "r2"), ("r3", 0.029, "r3"), ("r5", 0.020, "r5"),
    ("r2", 0.120, "slope_tip"),
])  # fmt: skip
def test_groove_that_is_not_tangent_is_refused(changed, value, field):
    refused(wide, start=f"groove.{field} = ", **{changed: value})


def test_true_depth_is_the_signed_distance_to_the_profile(rig):
    """Against the profile and its mirror images about the tooth lines as a polygon of many points."""
    groove, radius, half = rig.groove_profile, rig.chain.connector_radius, np.pi / rig.sprocket.teeth
    profile = groove.profile(2000)
    lines = [np.array([np.cos(half), side * np.sin(half)]) for side in (1, -1)]  # normals of the tooth lines
    around = np.vstack([profile, *(profile - 2 * np.outer(profile @ normal, normal) for normal in lines)])
    rng = np.random.default_rng(3)
    out, angle = rng.uniform(0.25, 0.36, 400), rng.uniform(-half, half, 400)
    points = np.column_stack([out * np.sin(angle), out * np.cos(angle)])
    distance = np.array([np.hypot(*(around - point).T).min() for point in points])
    below = points[:, 1] < np.interp(points[:, 0], *profile[np.argsort(profile[:, 0])].T)
    clear = distance > 1e-4  # a point on the profile itself may count for either side
    depth = true_depth(groove, radius, points)
    expected = radius - np.where(below, -distance, distance)
    np.testing.assert_allclose(depth[clear], expected[clear], rtol=0, atol=2e-5)
    assert (depth[below & clear] > radius).all(), "deeper in the steel than the search"


def arcs_of(groove):
    half = len(groove.radius) // 2
    return np.column_stack([groove.centre, groove.radius, np.where(groove.convex, 1.0, -1.0)])[:half]


@pytest.mark.parametrize("name", ["paper", "parts", "m113", "robot", RIG])
@pytest.mark.parametrize("decimals", [7, 6, 5, 4])
def test_arcs_as_print_rounds_them_are_joined(name, decimals):
    """Radii stay as printed, and errors of the contour are those of the slopes of its joints."""
    rig = load_rig(name)
    groove, arcs = rig.groove_profile, arcs_of(rig.groove_profile)
    rounded = np.round(arcs, decimals)
    joined = rig.changed(groove=None, profile=ToothProfile(arcs=rounded.tolist())).groove_profile
    distance = np.hypot(*np.diff(arcs[:, :2], axis=0).T)
    larger = np.maximum(arcs[1:, 2], arcs[:-1, 2])
    # the slope between two centres errs by root 2 units of the last decimal over their distance, and the end of an arc
    # by its radius times as much; centres and radii themselves by two units
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
    in_mm = ToothProfile(arcs=(fitting * [1e3, 1e3, 1e3, 1]).tolist())
    refused(rig.changed, groove=None, profile=in_mm, words=["profile lies ", " in m, not in mm"])
    narrow = ToothProfile(arcs=[[0.0, 0.3, 0.089, -1]])
    refused(narrow.groove, 10, 0.1, match=r"concave area of radius 0\.0\d+ m; it must be wider than")


def test_one_arc_a_groove_gets_a_tip_that_is_tangent_to_it():
    for teeth, height, radius in ((10, 0.3, 0.089), (12, 0.31, 0.05), (21, 0.0439, 0.0043)):
        groove = ToothProfile(arcs=[[0.0, height, radius, -1]]).groove(teeth)
        assert groove.convex.tolist() == [True, False, False, True]
        assert groove.profile()[:, 1].min() == pytest.approx(height - radius, abs=1e-12)
        assert np.abs([groove.arc(j, 2)[-1] - groove.arc(j + 1, 2)[0] for j in range(1, 4)]).max() < 1e-9
    refused(ToothProfile(arcs=[[0.0, 0.3, 0.089, 1]]).groove, 10, match="one row, which must be a concave arc")

"""Search of the groove's areas against the distance to its arcs, computed in another way."""

from math import nextafter, pi

import numpy as np
import pytest

from trackdyn.contact.laws import find_area, groove_index
from trackdyn.integrate.run import refresh
from trackdyn.rig.groove import coarse_groove
from trackdyn.rig.rig import load_rig
from trackdyn.scene.build import make_law, make_tooth

RADIUS = 0.030
DEEPEST = 5e-4
EXACT = 1e-12  # m; the distances are below 1 m
LAW = make_law(0.05, 1e11, 0.5, 0.1, 0.1, 0.05, 0.1, 3.0)


@pytest.fixture(scope="module")
def groove(rig):
    return rig.groove_profile


@pytest.fixture(scope="module")
def tooth(groove):
    return make_tooth(groove, RADIUS, LAW)


def distance_to_arcs(groove, points):
    offset = (points - groove.centre[:, None]) @ [1, 1j]
    angle = np.angle(offset / (groove.direction @ [1, 1j])[:, None])
    ends = np.stack([groove.arc(area, 2) for area in range(1, len(groove.radius) + 1)])
    to_end = np.linalg.norm(points[:, None, None, :] - ends, axis=-1).min(axis=-1)
    return np.where(np.abs(angle.T) <= groove.half_angle, np.abs(np.abs(offset.T) - groove.radius), to_end)


def penetrating_points(groove, seed, count=5000):
    """Return centres of arcs up to `DEEPEST` in random points of the profile, their areas, normals and places."""
    rng = np.random.default_rng(seed)
    j, share = rng.integers(0, 10, count), rng.uniform(-1, 1, count)
    angle = np.arctan2(groove.direction[j, 1], groove.direction[j, 0]) + share * groove.half_angle[j]
    outward = np.column_stack([np.cos(angle), np.sin(angle)])
    surface = groove.centre[j] + groove.radius[j, None] * outward
    normal = np.where(groove.convex[j, None], outward, -outward)
    return surface + (RADIUS - rng.uniform(0, DEEPEST, (count, 1))) * normal, j + 1, normal, np.abs(share)


def test_penetrating_arcs_are_found_with_area_depth_and_normal(groove, tooth):
    points, area, normal, share = penetrating_points(groove, 1)
    true_depth = RADIUS - distance_to_arcs(groove, points).min(axis=1)
    for i, (x, y) in enumerate(points):
        touched, depth, nx, ny, radius = find_area(tooth, x, y)
        assert touched > 0 and depth == pytest.approx(true_depth[i], abs=EXACT)
        # the normal: an error of 1e-16 m over the least distance to a centre, 2.7 mm
        assert (nx, ny) == pytest.approx(tuple(normal[i]), abs=1e-12)
        if share[i] < 1 - 1e-9:  # neighbours share a boundary, with the same depth and normal
            assert touched == area[i]
            sign = 1 if groove.convex[touched - 1] else -1
            assert radius == pytest.approx(groove.radius[touched - 1] + sign * RADIUS, abs=1e-15)


def test_random_places_over_the_groove_touch_where_the_profile_is_near(groove, tooth):
    rng = np.random.default_rng(3)
    half = pi / groove.teeth
    angle = rng.uniform(-half, half, 20000)
    r = rng.uniform(0.30, groove.addendum + 1.2 * RADIUS, 20000)
    points = np.column_stack([r * np.sin(angle), r * np.cos(angle)])
    true_depth = RADIUS - distance_to_arcs(groove, points).min(axis=1)
    # shallow and on the free side, as a motion in small steps reaches
    free = points[:, 1] >= np.interp(points[:, 0], *groove.profile(200).T)
    chosen = free & (true_depth < DEEPEST) & (np.abs(true_depth) > EXACT)
    for (x, y), true in zip(points[chosen], true_depth[chosen], strict=True):
        area, depth, *_ = find_area(tooth, x, y)
        assert (area > 0) == (true > 0)
        assert depth == pytest.approx(max(true, 0.0), abs=EXACT)
    assert np.count_nonzero(true_depth[chosen] > 0) > 100


def test_mirrored_arc_touches_the_mirrored_area(groove):
    """In a coarse tooth, which a wrong search of one side would break."""
    profile = coarse_groove(groove, RADIUS)
    areas = len(profile.radius)
    both = make_tooth(profile, RADIUS, LAW)
    touched_areas = set()
    for x, y in penetrating_points(groove, 4)[0]:
        area, depth, nx, ny, radius = find_area(both, x, y)
        mirrored = find_area(both, -x, y)
        assert mirrored == ((areas + 1 - area, depth, -nx, ny, radius) if area else (0, 0.0, 0.0, 0.0, 0.0))
        touched_areas.add(area)
    assert touched_areas >= set(range(1, areas + 1))


@pytest.mark.parametrize("name", ["paper", "parts"])
def test_the_depth_in_a_coarse_tooth_is_continuous(name):
    """A jump between surfaces, or at the end of the tip, would add energy with every engagement."""
    rig = load_rig(name)
    radius = rig.chain.connector_radius
    profile = coarse_groove(rig.groove_profile, radius)
    tooth = make_tooth(profile, radius, LAW)
    rng, joints, move = np.random.default_rng(5), profile.joints(), 1e-6
    low, high = np.sort(joints[:, 1])[[0, -1]]
    points = np.column_stack([rng.uniform(1.2 * joints[0, 0], 0, 20_000), rng.uniform(low, high + radius, 20_000)])
    touched = set()
    for x, y in points:
        area, depth, *_ = find_area(tooth, x, y)
        if not 0 < depth < DEEPEST / 2:
            continue
        touched.add(area)
        angle = rng.uniform(0, 2 * pi)
        _, moved_depth, *_ = find_area(tooth, x + move * np.cos(angle), y + move * np.sin(angle))
        # a corner is left at a depth that differs by a fraction of the depth
        assert abs(moved_depth - depth) <= move + 0.05 * depth, (area, x, y, depth, moved_depth)
    assert touched == {1, 2, 3}


def test_every_groove_has_its_index(tooth):
    """Eq. 12: y_k of groove k points to the middle of the range of its index."""
    m = tooth.teeth
    for k in range(1, m + 1):
        middle, (c, s) = (2 * k - 1) * pi / m, (tooth.groove_cos[k - 1], tooth.groove_sin[k - 1])
        assert np.arctan2(c, -s) % (2 * pi) == pytest.approx(middle, abs=1e-14)
        for angle in middle + np.array([-0.999, -0.5, 0.0, 0.5, 0.999]) * pi / m:
            assert groove_index(m, 0.33 * np.cos(angle), 0.33 * np.sin(angle)) == k


def test_boundaries_of_the_grooves_belong_to_a_neighbour():
    m = 13
    for k, angle in enumerate(2 * pi * np.arange(1, m + 1) / m, 1):
        assert groove_index(m, 0.33 * np.cos(angle), 0.33 * np.sin(angle)) in (k, k % m + 1)
    # just below the x axis the angle is rounded to a whole turn
    assert [groove_index(m, 0.33, y) for y in (0.0, -0.0, -5e-324, -1e-20)] == [1, 1, m, m]
    assert groove_index(m, nextafter(-0.33, 0.0), 0.0) == 7


@pytest.mark.parametrize("ring_radius", [None, 0.303])
def test_turning_the_sprocket_by_a_groove_changes_no_force(driven_loop, ring_radius):
    model, state, work, _ = driven_loop(ring_radius).arrays
    impact, start = (state.tooth_impact.copy(), state.wheel_impact.copy()), state.wheel_angle[0]

    def turned(pitches):
        state.wheel_angle[0] = start + pitches * 2 * pi / model.tooth.teeth
        state.tooth_impact[:], state.wheel_impact[:] = impact
        refresh(model, state, work)
        load = np.concatenate([work.force_x, work.force_y, work.moment, work.wheel_torque])
        return work.tooth_force.copy(), load, work.tooth_area.copy(), work.tooth_groove.copy()

    force, load, area, groove = turned(0)
    assert (force > 0).any()
    for pitches in (1, -1, 6):
        new_force, new_load, new_area, new_groove = turned(pitches)
        # an error of 1e-16 m in the depth of some 1e-5 m changes the force by 1e-11
        np.testing.assert_allclose(new_force, force, rtol=1e-9)
        np.testing.assert_allclose(new_load, load, rtol=0, atol=1e-9 * np.abs(load).max())
        np.testing.assert_array_equal(new_area, area)
        expected = (groove - 1 - pitches) % model.tooth.teeth + 1
        np.testing.assert_array_equal(new_groove[force > 0], expected[force > 0])

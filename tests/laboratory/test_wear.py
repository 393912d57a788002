"""Wear against closed forms, conservation of work, and the same life whatever the step."""

import numpy as np
import pytest

from laboratory.wear.contour import ARC_NODES, contours, fit_flank, worn_rig
from laboratory.wear.law import Depths, depth, distribute, load_coefficients
from laboratory.wear.life import SHARES, Rates, Walk, Worn, live
from trackdyn.errors import DivergenceError, InputError
from trackdyn.parameters.outline import distance_to, flank_arcs, groove_of_arcs
from trackdyn.scene.scene import Scene, StopRule
from trackdyn.simulation.loop import Loop

COEFFICIENTS = load_coefficients()
NOTHING = np.zeros(0)
QUICK = StopRule(share_pct=2.0, force=0.1, passages=3, longest_turns=2)
FIELDS = {"integrator": "linearly_implicit", "step": 5e-4}


def walked(walk, y, end, length=None):
    """The state after a distance ``end``."""
    x, rates = 0.0, walk.rates(y)
    while x < end * (1 - 1e-12):
        taken, y, rates, _ = walk.step(y, rates, min(length or walk.longest(rates), end - x))
        x += taken
    return y


def test_a_block_on_a_rotating_disc_wears_by_the_closed_form():
    """A disc of radius R sinks into a flat block: the scar is a segment, V = L c^3 / (12 R) = mu F s / e."""
    radius, width, energy, push = 0.3, 0.05, 1e14, 0.1 * 3000.0
    x = np.linspace(-5e-3, 5e-3, 1001)
    shape = -(x**2) / (2 * radius)

    def rate(y):
        # the disc sinks as a whole: the work is spread evenly over the nodes that it touches
        touched = shape + y[-1] > 0
        sinking = depth(push, energy, width * (x[1] - x[0]) * touched.sum())
        return Rates(np.append(np.where(touched, sinking, 0.0), sinking), NOTHING)

    begin, distance = 4e-7, 1000.0  # m: the closed form begins with no scar at all
    start = np.append(np.maximum(shape + begin, 0.0), begin)
    y = walked(Walk(rate, np.full(len(start), 1e-7), NOTHING), start, distance)
    chord = (12 * radius * push * distance / energy / width + (8 * radius * begin) ** 1.5) ** (1 / 3)
    assert y[-1] == pytest.approx(chord**2 / (8 * radius), rel=0.01)
    assert np.ptp(x[y[:-1] > 1e-9]) == pytest.approx(chord, rel=0.01)
    assert y[:-1].sum() * (x[1] - x[0]) * width == pytest.approx(width * chord**3 / (12 * radius), rel=0.01)


def test_the_order_of_the_wear_step_is_two():
    def rate(y):
        return Rates(1e-3 * (1.0 - y) * (1.0 + y), NOTHING)

    errors = []
    for length in (200.0, 100.0, 50.0):
        walk = Walk(rate, np.array([1e9]), NOTHING)
        errors.append(abs(walked(walk, np.zeros(1), 1000.0, length)[0] - np.tanh(1.0)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.2)


# -- geometry ------------------------------------------------------------------------------------------------------


def test_a_flank_that_arcs_can_follow_is_found_again(rig):
    """Depths between two designs with one bottom: the fit returns the second design."""
    of = contours(rig.groove_profile)[0]
    arcs, teeth = of.arcs, rig.sprocket.teeth
    slopes = np.arctan2(*((np.diff(arcs[:, :2], axis=0) / -np.diff(arcs[:, 3] * arcs[:, 2])[:, None]).T))
    radii = arcs[1:, 2] + np.array([0.0, 1.7e-3, 0.0, 0.0])
    bottom = arcs[-1, 1] + arcs[-1, 3] * arcs[-1, 2] - arcs[-1, 3] * radii[-1]
    other = flank_arcs(arcs[:, 3], radii, slopes, bottom, teeth)
    wanted = groove_of_arcs(other, teeth)
    depths = np.zeros(len(of.points))
    for _ in range(20):  # along the normal of the new flank
        depths += distance_to(wanted, of.worn(depths))
    assert depths.min() > -1e-7 and depths.max() > 4e-5  # the other design lies within the steel of the new one
    fitted, missed = fit_flank(of, np.maximum(depths, 0.0), teeth, rig.chain.connector_radius)
    assert missed < 1e-6
    np.testing.assert_allclose(fitted[1:4, 2], other[1:4, 2], rtol=1e-2)


def test_worn_pins_lengthen_links_and_leave_connectors(rig):
    of = contours(rig.groove_profile)
    flat = [np.zeros(len(c.points)) for c in of]
    arcs = np.zeros((2, ARC_NODES))
    arcs[0, 10:20] = 2e-4
    worn, _ = worn_rig(rig, of, flat, arcs.ravel(), 5e-4)
    assert worn.chain.link_length == pytest.approx(rig.chain.link_length + 1e-3)
    assert worn.connector_length == pytest.approx(rig.connector_length, abs=1e-9)
    assert worn.chain.connector_radius == pytest.approx(rig.chain.connector_radius - 2e-4)


def test_flanks_wear_apart_and_meet_at_the_bottom(rig):
    of = contours(rig.groove_profile)
    position = np.linspace(0, 1, len(of[0].points))
    scar = 1e-4 * np.exp(-0.5 * ((position - 0.3) / 0.1) ** 2)
    worn, _ = worn_rig(rig, of, [scar, 0 * scar], np.zeros(2 * ARC_NODES), 0.0)
    new, old = worn.groove_profile, rig.groove_profile
    assert not np.allclose(new.radius[:5], old.radius[:5], rtol=1e-4)
    np.testing.assert_allclose(new.radius[5:], old.radius[5:], rtol=1e-9)
    np.testing.assert_allclose(new.joints()[4], old.joints()[4], atol=1e-9)


def test_flanks_of_other_bottoms_are_refused(rig):
    arcs = contours(rig.groove_profile)[0].arcs
    with pytest.raises(InputError, match=r"profile\.right: its bottom is 1 mm off"):
        groove_of_arcs(arcs, rig.sprocket.teeth, arcs + [0.0, 1e-3, 0.0, 0.0])


# -- one rig -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def steady(rig):
    loop = Loop(Scene(rig, 150.0, 0.302, sliding=True, **FIELDS))
    loop.advance(3.0)
    return loop


@pytest.fixture(scope="module")
def worked(rig, steady):
    of = contours(rig.groove_profile)
    return distribute(steady, [c.points for c in of], turns=2.0)


def test_the_account_says_what_the_law_of_friction_says(worked):
    """Divided by force, coefficient and slip of every contact, whose sum is the account but for the step."""
    assert worked.estimate == pytest.approx(worked.areas.sum(), rel=0.05)


def test_work_lies_where_arcs_touch(rig, worked):
    """Within the areas that the account names, on both flanks, the right one mirrored."""
    joints = [-np.inf, *rig.groove_profile.joints()[:4, 0], 0.0]
    for contour, work, areas in zip(
        contours(rig.groove_profile), worked.flanks, (worked.areas[:5], worked.areas[:4:-1]), strict=True
    ):
        assert areas.sum() > 0
        at = contour.points[work > 1e-6 * work.sum(), 0]
        touched = np.flatnonzero(areas)
        assert joints[touched[0]] - 5e-4 <= at.min() and at.max() <= joints[touched[-1] + 1] + 5e-4


def test_what_is_removed_is_the_integral_of_the_work(rig, worked):
    of = contours(rig.groove_profile)
    depths = Depths(of)
    gone = worked.distance * depths.rates(rig, 0.302, worked, COEFFICIENTS)
    width, turn = rig.tooth_contact.contact_length, 2 * np.pi / ARC_NODES
    removed = {
        "ring": gone[depths.ring] * 2 * np.pi * 0.302 * rig.ring_contact.contact_length,
        "arc": gone[depths.arcs].sum() * turn * rig.chain.connector_radius * width * rig.chain.pitches,
        "tooth": sum(gone[f] @ c.length for f, c in zip(depths.flanks, of, strict=True)) * width * rig.sprocket.teeth,
    }
    for body, work in (("ring", worked.ring), ("arc", worked.areas.sum()), ("tooth", worked.areas.sum())):
        assert removed[body] * getattr(COEFFICIENTS, body) == pytest.approx(work, rel=1e-6), body


def test_a_rig_without_friction_does_not_wear(rig):
    worn = Worn(rig, 150.0, COEFFICIENTS, FIELDS | {"friction": "none"}, QUICK)
    state = worn(np.zeros(worn.depths.size))
    assert state.known["left_share_pct"] + state.known["ring_share_pct"] > 10.0  # it touches
    assert state.rate[worn.depths.bushing] > 0  # lost within the rubber, not by friction
    assert not np.delete(state.rate, [worn.depths.bushing, worn.depths.distance]).any()


# -- a life --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rpm": 0.0}, "a chain at rest does not wear"),
        ({"fields": {"step": 3e-4}}, "step"),
        ({"fields": {"space": "spatial"}}, "wear needs wheels in the plane"),
        ({"fields": {"chain": "belt"}}, "belt"),
        ({"fields": {"tooth_contact": "three_surfaces"}}, "wear needs ten arcs"),
    ],
)
def test_what_cannot_wear_is_refused(rig, changes, words):
    with pytest.raises(InputError, match=words):
        worn = Worn(
            **{"rig": rig, "rpm": 150.0, "coefficients": COEFFICIENTS, "fields": FIELDS, "rule": QUICK} | changes
        )
        worn(np.zeros(worn.depths.size))


class Known(Worn):
    """Rates in closed form: the ring's falls with its height over 0.302 m, flanks deepen evenly."""

    decay = 1e-8

    def __call__(self, y):
        d, rate = self.depths, np.zeros(self.depths.size)
        over = self.rig.ring_radius - y[d.ring] - 0.302
        if over < self.least:
            raise DivergenceError("no such rig")
        rate[d.ring] = self.decay * over
        rate[d.flanks[0]], rate[d.distance] = 1e-12, 1.0
        shares = (10 - 1e3 * over, 0.0, 45.0)
        radius = self.rig.ring_radius - float(y[d.ring])
        return Rates(rate, np.array(shares), dict(zip(SHARES, shares, strict=True)) | {"ring_radius_m": radius})


@pytest.fixture
def known(rig):
    rig = rig.changed(sprocket__ring_radius=0.308)
    worn = Known(rig, 115.0, COEFFICIENTS, {})
    worn.least = 0.0
    return worn


def test_a_life_ends_at_its_bound(known):
    """The height over 0.302 m falls from 6 to 1 mm: ln 6 times the distance of its decay. A step of half that distance,
    the longest that the error allows near the end, errs by 0.5**3 / 6 = 2 % of the height, and three such by 6 %: 3 %
    of the life.
    """
    table = live(known, 0.303)
    assert table["end"].tolist() == [""] * (len(table) - 1) + ["reached ring 0.303 m"]
    assert table["ring_radius_m"].iloc[-1] == pytest.approx(0.303, abs=1e-9)
    assert 1e3 * table["distance_km"].iloc[-1] == pytest.approx(np.log(6) / known.decay, rel=0.03)
    assert live(known, until_distance=5e7)["distance_km"].iloc[-1] == pytest.approx(5e4)


def test_a_life_ends_where_the_rig_leaves_the_model(known):
    known.least = 2e-3
    table = live(known, 0.303)
    assert table["end"].iloc[-1] == "left the model: no such rig"
    assert table["ring_radius_m"].iloc[-1] == pytest.approx(0.304, abs=1e-4)


def test_work_over_the_contour_is_that_of_the_account(worked):
    left, right = worked.flanks
    assert worked.areas[1] > 0
    assert left.sum() == pytest.approx(worked.areas[:5].sum(), rel=1e-6)
    assert right.sum() == pytest.approx(worked.areas[5:].sum(), rel=1e-6)
    assert worked.arcs.sum() == pytest.approx(worked.areas.sum(), rel=1e-6)


def test_a_bound_behind_the_new_rig_is_refused(known):
    with pytest.raises(InputError, match=r"must be below the new ring's, 0\.308 m"):
        live(known, 0.309)
    with pytest.raises(InputError, match="until_distance = -1 m: must be above 0"):
        live(known, until_distance=-1.0)

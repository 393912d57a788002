"""Contacts in space: aligned wheels, overlap, axial friction, guides, and action against reaction."""

import numpy as np
import pytest

from tests.kinematics import ContactList, mass_centres
from trackdyn.contact.axial import friction_coefficients, overlap_ratio
from trackdyn.contact.laws import friction_coefficient, wheel_law
from trackdyn.integrate.run import refresh
from trackdyn.model.arrays import FLANK, GUIDE, RING, SURFACE, OptionalWork, make_space_work, make_work
from trackdyn.model.constants import SPROCKET
from trackdyn.scene.build import build_space, wheel_centres
from trackdyn.simulation.settling import start_plane

TILTED = {
    "sprocket__toe": 0.4, "idler__camber": -0.7, "idler__axial_offset": 0.003, "road_wheel__toe": -0.5,
    "road_wheel__camber": 0.3,
}  # fmt: skip


def evaluate(model, state):
    n, (pitches, wheels) = len(state.angle), state.wheel_impact.shape
    work, optional = make_work(n, pitches, wheels), OptionalWork(make_space_work(n, wheels))
    refresh(model, state, work, optional)
    return work, optional.space


@pytest.fixture
def make_spatial(driven_loop, make_scene, rig):
    """Return a function for model and state of the running loop in space, with other wheels and a moving plane."""

    def make(friction="independent", motion=(0.0, 0.0, 0.0, 0.0), **changes):
        loop = driven_loop(0.308)
        scene = make_scene(rig=rig.changed(**changes), space="spatial", friction=friction)
        model = loop.arrays.model
        model = model._replace(space=build_space(scene, model.tooth, model.wheels))
        state = loop.arrays.state._replace(plane=start_plane(wheel_centres(scene.rig, model.wheels), loop.arrays.state))
        state.plane.motion[:] += motion
        return model, state

    return make


def test_overlap_of_two_lengths(make_spatial):
    """Eq. 19 by hand for widths of 50 and 60 mm, between 0 and the shorter one."""
    space = make_spatial()[0].space
    for offset, share in ((0.0, 1.0), (0.005, 1.0), (-0.005, 1.0), (0.02, 0.7), (-0.02, 0.7), (0.055, 0.0), (0.2, 0.0)):
        assert overlap_ratio(space, FLANK, offset) == pytest.approx(share, abs=1e-15)
    assert overlap_ratio(space, RING, 0.02) == pytest.approx(0.96) == overlap_ratio(space, SURFACE, -0.02)


def test_less_overlap_gives_less_force(make_spatial):
    works = []
    for offset in (0.0, 0.02, -0.06):
        model, state = make_spatial(motion=(offset, 0.0, 0.0, 0.0))
        # no memory of the force before
        tooth, space = model.tooth._replace(mobility=0.0), model.space._replace(guide_reach=0 * model.space.guide_reach)
        works.append(evaluate(model._replace(space=space, tooth=tooth), state)[0])
    full, partial, none = works
    np.testing.assert_allclose(partial.tooth_force, 0.7 * full.tooth_force, rtol=1e-14)
    np.testing.assert_allclose(partial.wheel_force, 0.96 * full.wheel_force, rtol=1e-14)
    assert not none.tooth_force.any() and not none.tooth_area.any() and not state.tooth_impact.any()


@pytest.mark.parametrize("friction", ["tangential", "independent"])
def test_axial_friction_is_that_of_the_axial_slip_or_none(make_spatial, friction):
    model, _ = make_spatial(friction)
    law = model.tooth.law
    for slip, axial in [*np.random.default_rng(2).normal(0.0, 0.1, (100, 2)), (0.0, 0.0)]:
        expected = friction_coefficient(law, axial) if friction == "independent" else 0.0
        assert friction_coefficients(model.space, law, slip, axial) == (friction_coefficient(law, slip), expected)


@pytest.mark.parametrize("speed", [0.03, -0.03])
def test_chain_that_moves_along_the_axes_is_braked(make_spatial, speed):
    model, state = make_spatial(motion=(0.0, speed, 0.0, 0.0))
    # by the slip as it is, not as friction leaves it
    tooth, wheels = model.tooth, model.wheels
    model = model._replace(tooth=tooth._replace(mobility=0.0), wheels=wheels._replace(slip=np.zeros_like(wheels.slip)))
    touched = ContactList(evaluate(model, state)[0], axes="xyz")
    laws = {FLANK: model.tooth.law, RING: wheel_law(model.wheels, 0), SURFACE: wheel_law(model.wheels, 1)}
    assert len(touched.kind) > 5
    coefficients = [friction_coefficient(laws[kind], speed) for kind in touched.kind]
    np.testing.assert_allclose(touched.friction[:, 2], -touched.force * coefficients, rtol=1e-12)


def test_action_and_reaction(make_spatial):
    model, state = make_spatial(motion=(0.007, 0.02, 0.03, -0.02), **TILTED)  # beyond the play of the guides
    # flanks touch some 1e-5 m deep, less than the tilt lifts them
    model = model._replace(tooth=model.tooth._replace(arc_radius=model.tooth.arc_radius + 2e-4))
    work, spatial = evaluate(model, state)
    space, a_p = model.space, spatial.attitude
    at = np.insert(mass_centres(model.chain, state), 2, state.plane.motion[0], axis=1) @ a_p.T
    force = np.column_stack([work.force_x, work.force_y, spatial.force_z]) @ a_p.T
    moment = np.column_stack([spatial.moment_x, spatial.moment_y, work.moment]) @ a_p.T
    total_force, total_moment = force.sum(axis=0), (moment + np.cross(at, force)).sum(axis=0)
    size = np.abs(force).sum()
    assert (ContactList(work).kind == GUIDE).any() and (work.tooth_force > 0).any()
    assert np.abs(total_force[2]) > 100.0  # the axial force is not trivial
    for wheel, (frame, load) in enumerate(zip(space.frame, spatial.wheel_load, strict=True)):
        centre = np.array([model.wheels.x[wheel], model.wheels.y[wheel], 0.003 if wheel == 1 else 0.0])
        np.testing.assert_allclose(frame @ space.centre[wheel], centre, rtol=0, atol=1e-15)
        total_force += frame @ load[:3]
        total_moment += frame @ load[3:] + np.cross(centre, frame @ load[:3])
        assert work.wheel_torque[wheel] == pytest.approx(load[5], rel=1e-12)
    np.testing.assert_allclose(total_force, 0.0, atol=1e-12 * size)
    np.testing.assert_allclose(total_moment, 0.0, atol=1e-12 * size)


@pytest.mark.parametrize("wheel", [0, 1, 2])
def test_contact_that_turns_with_its_tilted_wheel_does_not_slip(make_spatial, wheel):
    """The whole loop turns as if fixed to the wheel, about the wheel's tilted axis."""
    model, state = make_spatial(**TILTED)
    spatial, rate = evaluate(model, state)[1], -2.16
    omega = rate * spatial.relative[wheel, 2]  # the axis in P
    pin = np.array([*state.pin[:2], state.plane.motion[0]])
    velocity = np.cross(omega, pin - spatial.centre[wheel])
    state.plane.motion[1:] = velocity[2], omega[0], omega[1]
    state.pin[2:], state.rate[:], state.wheel_rate[wheel] = velocity[:2], omega[2], rate
    state.tooth_impact[:], state.wheel_impact[:] = 0.0, 0.0
    work, _ = evaluate(model, state)
    touched = ContactList(work, wheel, (SURFACE, FLANK, RING), "xyz")
    assert len(touched.kind) > 0 and np.abs(omega[:2]).max() > 1e-3
    # slip of rounding, 1e-15 m/s, times the slope of the law, 25 s/m
    assert (np.linalg.norm(touched.friction, axis=1) <= 1e-12 * touched.force).all()
    np.testing.assert_allclose(touched.slip, 0.0, atol=1e-14)
    impact = state.wheel_impact[:, wheel]
    assert set(impact[impact > 0]) <= {model.tooth.law.speed_floor}
    if wheel == SPROCKET:
        assert (work.tooth_force > 0).any()
        assert set(state.tooth_impact[state.tooth_impact > 0]) == {model.tooth.law.speed_floor}


def test_guides_push_back_beyond_their_play_and_never_pull(make_spatial, make_scene):
    def guides(offset, speed):
        work, space = evaluate(*make_spatial("tangential", motion=(offset, speed, 0.0, 0.0)))
        return ContactList(work, kinds=(GUIDE,), axes="xyz"), space

    assert len(guides(0.0049, 0.5)[0].body) == 0
    touched, spatial = guides(0.0055, 0.1)
    assert set(touched.wheel) == {0, 1, 2} and (touched.body % 2 == 1).all()
    # 1e6 N/m x 0.5 mm + 1e3 N s/m x 0.1 m/s
    np.testing.assert_allclose(touched.normal[:, 2], -600.0, rtol=1e-9)
    assert not touched.normal[:, :2].any() and not touched.friction.any()
    assert spatial.force_z.sum() == pytest.approx(-600.0 * len(touched.body), rel=1e-9)
    np.testing.assert_allclose(guides(-0.0055, -0.1)[0].normal[:, 2], 600.0, rtol=1e-9)
    # leaving at 1 m/s the damper would pull with 1000 N
    assert (guides(0.0055, -1.0)[0].normal[:, 2] == 0.0).all()
    # a sprocket without teeth or ring has none
    toothed = make_scene(ring_radius=None, space="spatial")
    assert toothed.with_(tooth_contact="none").model.space.guide_reach[SPROCKET] == 0.0
    assert toothed.model.space.guide_reach[SPROCKET] > 0.3

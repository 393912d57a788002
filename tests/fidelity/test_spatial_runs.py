"""Runs in space: aligned as in the plane, misaligned in balance, a tumbling loop with its momentum."""

import numpy as np
import pytest

from tests.conftest import LAWS
from tests.kinematics import next_samples
from trackdyn.simulation.energy_balance import energy_residual
from trackdyn.simulation.loop import Loop


@pytest.fixture(scope="module")
def aligned(make_scene):
    """Return a settled aligned loop."""
    return Loop(make_scene(115.0, space="spatial", **LAWS))


def filled(loop, samples):
    """Record of the next samples, every configuration kept."""
    return next_samples(loop, samples, (1,), frame_stride=1)


def without_wheels(model, **chain):
    """A model whose chain touches nothing."""
    nothing = np.zeros_like(model.wheels.present)
    return model._replace(
        chain=model.chain._replace(**chain),
        tooth=model.tooth._replace(present=0),
        wheels=model.wheels._replace(present=nothing),
        space=model.space._replace(guide_reach=np.zeros_like(model.space.guide_reach)),
    )


def test_aligned_scene_repeats_the_planar_run(aligned):
    """Start-up and first contacts, the same operations in the same order; 1e-9 of g for other compilers' rounding."""
    loop = aligned.copy()
    planar, record = filled(Loop(loop.scene.with_(space="planar")), 1000), filled(loop, 1000)
    for name in ("raw", "mean"):
        np.testing.assert_allclose(getattr(record, name), getattr(planar, name), rtol=0, atol=1e-9 * 9.81)
    np.testing.assert_allclose(record.frame, planar.frame, rtol=0, atol=1e-9)
    np.testing.assert_allclose(record.energy, planar.energy, rtol=0, atol=1e-9 * np.abs(planar.energy).max())
    assert (record.force > 0).any() and (record.wheel_rate[-1] != 0).all()
    assert not record.plane[:, :4].any() and not record.axial_force.any()
    assert np.array_equal(loop.state.plane.attitude, [1.0, 0.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def misaligned(rig, make_scene):
    """A loop with one wheel out of the plane three seconds after the start, and the record of them."""
    scene = make_scene(210.0, rig=rig.changed(idler__toe=0.5, idler__axial_offset=0.003), **LAWS)
    assert scene.fidelity["space"].setting == "spatial" and scene.fidelity["friction"].setting == "independent"
    loop = Loop(scene)
    return loop, filled(loop, 3000)


def test_loop_stays_between_the_flanges(misaligned):
    """At no wheel further out than the play of its guides and their penetration.

    Axial friction of all contacts is at most mu_s times the normal forces of a few kN: below 5 kN, which six
    connectors between the flanges carry with less than 1 mm.
    """
    loop, record = misaligned
    guide = loop.scene.rig.guide
    assert np.abs(record.wheel_offset).max() < guide.clearance + 5000.0 / (6 * guide.stiffness)
    assert np.abs(record.wheel_offset).max() > 1e-3  # it does move
    assert np.abs(record.axial_force).mean(axis=0).max() > 5.0  # N


def test_energy_account_of_a_misaligned_loop(misaligned):
    """The tolerance of the planar run: 0.1 % of the sprocket's work, start-up included."""
    _, record = misaligned
    assert abs(energy_residual(record)) < 1e-3


def momenta(model, state):
    """Linear and angular momentum about the inertial origin of all bodies, inertial components."""
    chain, space, plane = model.chain, model.space, state.plane
    e0, v = plane.attitude[0], plane.attitude[1:]
    skew = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    a_p = np.eye(3) + 2 * e0 * skew + 2 * skew @ skew
    p, q = plane.motion[2:]
    at = np.array([state.pin[0], state.pin[1], plane.motion[0]])
    velocity = np.array([state.pin[2], state.pin[3], plane.motion[1]])
    linear, angular = np.zeros(3), np.zeros(3)
    for i in range(len(state.angle)):
        c, s = np.cos(state.angle[i]), np.sin(state.angle[i])
        rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        omega = np.array([p, q, state.rate[i]])
        arm = rotation @ [chain.com_x[i], chain.com_y[i], 0.0]
        push = chain.mass[i] * (velocity + np.cross(omega, arm))
        inertia = rotation @ np.diag([space.along[i], space.across[i], chain.inertia[i]]) @ rotation.T
        linear += push
        angular += np.cross(at + arm, push) + inertia @ omega
        out = rotation @ [chain.length[i], 0.0, 0.0]
        at, velocity = at + out, velocity + np.cross(omega, out)
    return a_p @ linear, a_p @ angular


def test_tumbling_loop_keeps_its_momentum(aligned):
    """Without contact and gravity the change is the error of the method, of first order in the step.

    It is at most h |omega|^2 t of the momentum, with the largest angular velocity of a body in the run: the
    strands swing out. Extrapolated to a step of zero, less than a hundredth of it is left, of second order.
    """
    drift, fastest = [], 0.0
    for step in (1e-4, 5e-5):
        loop = aligned.copy()
        loop.arrays = loop.arrays._replace(model=without_wheels(loop.arrays.model, gravity=0.0)._replace(step=step))
        loop.arrays.state.rate[:] = -3.0
        loop.arrays.state.pin[2:] = 0.4, -0.2
        plane = loop.arrays.state.plane
        plane.motion[:] = 0.1, 0.3, 1.5, -1.0
        start = momenta(loop.arrays.model, loop.arrays.state)
        for _ in range(20):
            loop.step(round(0.01 / step))
            assert np.linalg.norm(plane.attitude) == pytest.approx(1.0, abs=1e-15)
            fastest = max(fastest, np.abs(loop.state.rate).max())
        end = momenta(loop.arrays.model, loop.arrays.state)
        drift.append([(b - a) / np.linalg.norm(a) for a, b in zip(start, end, strict=True)])
    bound = 1e-4 * (fastest**2 + (plane.motion[2:] ** 2).sum()) * 0.2
    for kind in range(2):
        coarse, fine = drift[0][kind], drift[1][kind]
        assert np.linalg.norm(coarse) < bound
        assert np.linalg.norm(2 * fine - coarse) < 0.01 * np.linalg.norm(coarse)
    assert abs(plane.attitude[0]) < 0.999  # it has turned


def test_runs_repeat_bit_for_bit_and_mirror(rig, make_scene):
    """An idler turned the other way gives the mirrored motion; a second run gives the same."""
    motions = []
    for toe in (0.5, 0.5, -0.5):
        scene = make_scene(210.0, rig=rig.changed(idler__toe=toe), **LAWS)
        motions.append(filled(Loop(scene), 500))
    record, again, mirror = motions
    assert np.array_equal(record.frame, again.frame) and np.array_equal(record.plane, again.plane)
    assert np.abs(record.plane[-1, 0]) > 1e-5
    signs = [-1, -1, -1, -1, 1, -1, -1, 1]
    # every operation has its mirror image with the same rounding
    np.testing.assert_allclose(mirror.plane, record.plane * signs, rtol=0, atol=1e-12)
    np.testing.assert_allclose(mirror.frame, record.frame, rtol=0, atol=1e-12)
    np.testing.assert_allclose(mirror.axial_force, -record.axial_force, rtol=0, atol=1e-6)

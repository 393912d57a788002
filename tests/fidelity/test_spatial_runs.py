"""Runs in space: aligned as in the plane, misaligned in balance, a tumbling loop with its momentum."""

import numpy as np
import pytest

from tests.conftest import LAWS
from tests.kinematics import along_chain, bodies_in_space, next_samples, set_model
from trackdyn.simulation.energy_balance import energy_residual
from trackdyn.simulation.loop import Loop


@pytest.fixture(scope="module")
def aligned(make_scene):
    return Loop(make_scene(115.0, space="spatial", **LAWS))


def filled(loop, samples):
    return next_samples(loop, samples, (1,), frame_stride=1)


def test_aligned_scene_repeats_the_planar_run(aligned):
    loop = aligned.copy()
    planar, record = filled(Loop(loop.scene.with_(space="planar")), 1000), filled(loop, 1000)
    for name in ("raw", "mean"):
        np.testing.assert_allclose(getattr(record, name), getattr(planar, name), rtol=0, atol=1e-9 * 9.81)
    np.testing.assert_allclose(record.frame, planar.frame, rtol=0, atol=1e-9)
    np.testing.assert_allclose(record.energy, planar.energy, rtol=0, atol=1e-9 * np.abs(planar.energy).max())
    assert (record.force > 0).any() and (record.wheel_rate[-1] != 0).all()
    assert not record.plane[:, :4].any() and not record.axial_force.any()
    assert np.array_equal(loop.state.plane.attitude, [1.0, 0.0, 0.0, 0.0])


def test_a_misaligned_loop_stays_between_the_flanges_and_its_energy_balance_closes(rig, make_scene):
    scene = make_scene(210.0, rig=rig.changed(idler__toe=0.5, idler__axial_offset=0.003), **LAWS)
    assert scene.fidelity["space"].setting == "spatial" and scene.fidelity["friction"].setting == "independent"
    record = filled(Loop(scene), 3000)
    # axial friction is at most mu_s times normal forces of a few kN: 5 kN, which six connectors between flanges carry
    reach = rig.guide.clearance + 5000.0 / (6 * rig.guide.stiffness)
    assert 1e-3 < np.abs(record.wheel_offset).max() < reach
    assert np.abs(record.axial_force).mean(axis=0).max() > 5.0  # N
    assert abs(energy_residual(record)) < 1e-3  # of the sprocket's work, start-up included, as in the plane


def momenta(model, state):
    chain, space, motion = model.chain, model.space, state.plane.motion
    a_p, attitude, omega, centre, end = bodies_in_space(chain, state)
    at = along_chain(a_p @ [*state.pin[:2], motion[0]], end)[:-1]
    velocity = along_chain(a_p @ [*state.pin[2:], motion[1]], np.cross(omega, end))[:-1]
    push = chain.mass[:, None] * (velocity + np.cross(omega, centre))
    inertia = np.column_stack([space.along, space.across, chain.inertia])
    spin = np.einsum("nij,nj,nkj,nk->ni", attitude, inertia, attitude, omega)
    return push.sum(axis=0), (np.cross(at + centre, push) + spin).sum(axis=0)


def test_tumbling_loop_keeps_its_momentum(aligned):
    """Without contact and gravity it changes by at most h |omega|^2 t; extrapolated to h = 0 a hundredth is left."""
    drift, fastest = [], 0.0
    for step in (1e-4, 5e-5):
        loop = aligned.copy()
        model = loop.model
        set_model(
            loop, step=step, chain=model.chain._replace(gravity=0.0), tooth=model.tooth._replace(present=0),
            wheels=model.wheels._replace(present=0 * model.wheels.present),
            space=model.space._replace(guide_reach=0 * model.space.guide_reach),
        )  # fmt: skip
        state = loop.arrays.state
        state.rate[:], state.pin[2:], state.plane.motion[:] = -3.0, (0.4, -0.2), (0.1, 0.3, 1.5, -1.0)
        start = np.array(momenta(loop.model, state))
        for _ in range(20):
            loop.step(round(0.01 / step))
            assert np.linalg.norm(state.plane.attitude) == pytest.approx(1.0, abs=1e-15)
            fastest = max(fastest, np.abs(state.rate).max())  # the strands swing out
        drift.append((momenta(loop.model, state) - start) / np.linalg.norm(start, axis=1, keepdims=True))
    coarse, fine = drift
    size = np.linalg.norm(coarse, axis=1)
    assert (size < 1e-4 * (fastest**2 + (state.plane.motion[2:] ** 2).sum()) * 0.2).all()
    assert (np.linalg.norm(2 * fine - coarse, axis=1) < 0.01 * size).all()
    assert abs(state.plane.attitude[0]) < 0.999  # it has turned


def test_runs_repeat_bit_for_bit_and_mirror(rig, make_scene):
    record, again, mirror = (
        filled(Loop(make_scene(210.0, rig=rig.changed(idler__toe=toe), **LAWS)), 500) for toe in (0.5, 0.5, -0.5)
    )
    assert np.array_equal(record.frame, again.frame) and np.array_equal(record.plane, again.plane)
    assert np.abs(record.plane[-1, 0]) > 1e-5
    # every operation has its mirror image with the same rounding
    np.testing.assert_allclose(mirror.plane, record.plane * [-1, -1, -1, -1, 1, -1, -1, 1], rtol=0, atol=1e-12)
    np.testing.assert_allclose(mirror.frame, record.frame, rtol=0, atol=1e-12)
    np.testing.assert_allclose(mirror.axial_force, -record.axial_force, rtol=0, atol=1e-6)

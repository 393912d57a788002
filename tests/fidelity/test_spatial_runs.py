"""Runs in space: aligned as in the plane, misaligned in balance, a tumbling loop with its momentum."""

import copy

import numpy as np
import pytest
from trackdyn.chain.spatial import make_plane_record
from trackdyn.integrate.spatial import run_spatial
from trackdyn.space import build_space

from trackdyn.integrate.run import run
from trackdyn.measure.metrics import energy_residual
from trackdyn.settling import empty_record, settle


@pytest.fixture(scope="module")
def aligned(make_scene):
    """A settled aligned loop: scene, model, state, work."""
    scene = make_scene(115.0, space="spatial")
    return scene, *settle(scene)[:3]


def run_in_space(scene, model, state, work, seconds, stride=None):
    """Run with a record of every sample, or of every step with ``stride=1``."""
    stride = scene.stride if stride is None else stride
    samples = round(seconds / model.step / stride)
    record = empty_record(samples, len(state.angle), len(model.wheels.x), (1,), samples, 1)
    spatial = build_space(scene, model, state, make_plane_record(samples, len(model.wheels.x)))
    assert run_spatial(model, state, work, record, 0, samples, stride, spatial) == -1
    return record, spatial


def test_aligned_scene_repeats_the_planar_run(aligned):
    """The start-up and the first contacts, a second long: the same operations in the same order.

    1e-9 of g is allowed, for compilers that round differently; the rounding that remains grows by contact.
    """
    scene, model, state, work = copy.deepcopy(aligned)
    planar = empty_record(1000, 70, 3, (1,), 1000, 1)
    assert run(model, copy.deepcopy(state), copy.deepcopy(work), planar, 0, 1000, scene.stride) == -1
    record, spatial = run_in_space(scene, model, state, work, 1.0)
    for name in ("raw", "mean"):
        np.testing.assert_allclose(getattr(record, name), getattr(planar, name), rtol=0, atol=1e-9 * 9.81)
    np.testing.assert_allclose(record.frame, planar.frame, rtol=0, atol=1e-9)
    np.testing.assert_allclose(record.energy, planar.energy, rtol=0, atol=1e-9 * np.abs(planar.energy).max())
    assert (record.force > 0).any() and (record.wheel_rate[-1] != 0).all()
    assert not spatial.record.motion[:, :4].any() and not spatial.record.axial.any()
    assert np.array_equal(spatial.plane.attitude, [1.0, 0.0, 0.0, 0.0])


MISALIGNED = {
    "toe": {"idler__toe": 0.5},
    "offset": {"idler__axial_offset": 0.003},
}


@pytest.fixture(scope="module", params=MISALIGNED)
def misaligned(request, rig, make_scene):
    """A loop with one wheel out of the plane, two seconds after the start: scene, model, state, work, spatial."""
    changed = rig.changed(**MISALIGNED[request.param])
    scene = make_scene(210.0, rig=changed)
    assert scene.fidelity["space"].setting == "spatial" and scene.fidelity["friction"].setting == "independent"
    model, state, work, _ = settle(scene)
    samples = 3000
    record = empty_record(samples, 70, 3, (1,))
    spatial = build_space(scene, model, state, make_plane_record(samples, 3))
    assert run_spatial(model, state, work, record, 0, samples, scene.stride, spatial) == -1
    return scene, model, state, work, record, spatial


def test_loop_stays_between_the_flanges(misaligned):
    """At no wheel further out than the play of its guides and their penetration.

    Axial friction of all contacts is at most mu_s times the normal forces of a few kN: below 5 kN, which six
    connectors between the flanges carry with less than 1 mm.
    """
    scene, _, _, _, _, spatial = misaligned
    guide = scene.rig.guide
    assert np.abs(spatial.record.offset).max() < guide.clearance + 5000.0 / (6 * guide.stiffness)
    assert np.abs(spatial.record.offset).max() > 1e-3  # it does move
    assert np.abs(spatial.record.axial).mean(axis=0).max() > 5.0  # N


def test_energy_account_of_a_misaligned_loop(misaligned):
    """The tolerance of the planar run: 0.1 % of the sprocket's work, start-up included."""
    record = misaligned[4]

    class Recorded:
        energy = record.energy

    assert abs(energy_residual(Recorded)) < 1e-3


def momenta(model, state, spatial):
    """Linear and angular momentum about the inertial origin of all bodies, inertial components."""
    chain, space, plane = model.chain, spatial.space, spatial.plane
    e0, v = plane.attitude[0], plane.attitude[1:]
    skew = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    a_p = np.eye(3) + 2 * e0 * skew + 2 * skew @ skew
    p, q = plane.motion[2:]
    at = np.array([state.pin[0], state.pin[1], plane.motion[0]])
    velocity = np.array([state.pin[2], state.pin[3], plane.motion[1]])
    linear, angular = np.zeros(3), np.zeros(3)
    for i in range(len(state.angle)):
        c, s = np.cos(state.angle[i]), np.sin(state.angle[i])
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        omega = np.array([p, q, state.rate[i]])
        arm = turn @ [chain.com_x[i], chain.com_y[i], 0.0]
        push = chain.mass[i] * (velocity + np.cross(omega, arm))
        inertia = turn @ np.diag([space.along[i], space.across[i], chain.inertia[i]]) @ turn.T
        linear += push
        angular += np.cross(at + arm, push) + inertia @ omega
        out = turn @ [chain.length[i], 0.0, 0.0]
        at, velocity = at + out, velocity + np.cross(omega, out)
    return a_p @ linear, a_p @ angular


def test_axial_forces_are_in_balance(misaligned):
    """Every step: all forces on the chain are its mass times the acceleration of its mass centre; in the mean little.

    The change of velocity in a step is taken in the configuration before it, so that it is the acceleration
    exactly: rounding of forces of some 1e4 N, two decades for sums over the bodies.
    """
    _, model, state, work, record, spatial = copy.deepcopy(misaligned)
    chain, room, plane = model.chain, spatial.work, spatial.plane
    total_mass = chain.mass.sum()
    worst, size = 0.0, 0.0
    for _ in range(50):
        # bring the loads of the present state up, then take one step from the same state
        before = copy.deepcopy((state, plane))
        no_samples = run_spatial(model, state, work, record, 0, 0, 1, spatial)
        assert no_samples == -1
        a_p = room.attitude.copy()
        on_wheels = sum(frame @ load[:3] for frame, load in zip(spatial.space.frame, room.wheel_load, strict=True))
        assert run_spatial(model, state, work, record, 0, 1, 1, spatial) == -1
        load, sweep = work.sweep.load, work.sweep
        pin = np.array([*(sweep.base @ load), room.acceleration[0]])
        alpha = sweep.response @ load
        old, old_plane = before
        p, q = old_plane.motion[2:]
        dp, dq = room.acceleration[1:]
        push, acceleration = np.zeros(3), pin
        for i in range(70):
            c, s, w = np.cos(old.angle[i]), np.sin(old.angle[i]), old.rate[i]
            own = np.array([dp + q * w, dq - p * w, alpha[i]])
            omega = np.array([p, q, w])
            for x, y, share in ((chain.com_x[i], chain.com_y[i], True), (chain.length[i], 0.0, False)):
                arm = np.array([c * x - s * y, s * x + c * y, 0.0])
                moved = acceleration + np.cross(own, arm) + np.cross(omega, np.cross(omega, arm))
                if share:
                    push += chain.mass[i] * moved
            if i == model.sensor.body:  # what the sensor in the link feels
                arm = np.array([c * model.sensor.x - s * model.sensor.y, s * model.sensor.x + c * model.sensor.y, 0.0])
                felt = acceleration + np.cross(own, arm) + np.cross(omega, np.cross(omega, arm))
                # accelerations of up to some 1e3 m/s2; the plane's own part is of the order of 1e-5 m/s2
                np.testing.assert_allclose(
                    work.sensed[:2], [c * felt[0] + s * felt[1], c * felt[1] - s * felt[0]], atol=1e-9
                )
            acceleration = moved
        rest = a_p @ push + on_wheels + [0.0, total_mass * chain.gravity, 0.0]
        worst = max(worst, np.abs(rest).max())
        size = max(size, np.abs(room.contact[: room.count[0], :6]).sum())
    assert worst < 1e-9 * size
    # over the last second the axial forces cancel: their sum is the change of axial momentum and the
    # weight's share, both small, while the single ones are not
    weight = total_mass * chain.gravity
    mean = spatial.record.axial[-1000:].mean(axis=0)
    tilt = np.radians(0.5) + np.abs(spatial.record.offset).max()  # of axes and plane, over wheels 1 m apart
    assert abs(mean.sum()) < weight * tilt + 0.1 * np.abs(mean).sum()


def test_tumbling_loop_keeps_its_momentum(aligned):
    """No contact, no gravity: what changes is the error of the method, of first order in the step.

    It is at most h |omega|^2 t of the momentum, with the largest angular velocity of a body in the run: the
    strands swing out. What an extrapolation to no step leaves is of second order, less than a hundredth of it.
    """
    scene, model, state, _ = copy.deepcopy(aligned)
    model = model._replace(
        chain=model.chain._replace(gravity=0.0),
        tooth=model.tooth._replace(present=0),
        wheels=model.wheels._replace(present=np.zeros(3, np.int64)),
    )
    state.rate[:] = -3.0
    state.pin[2:] = 0.4, -0.2
    drift, fastest = [], 0.0
    for step in (1e-4, 5e-5):
        mine = copy.deepcopy(state)
        loop = model._replace(step=step)
        record = empty_record(1, 70, 3, (1,))
        spatial = build_space(scene, loop, mine)
        spatial = spatial._replace(space=spatial.space._replace(guide_reach=np.zeros(3)))
        spatial.plane.motion[:] = 0.1, 0.3, 1.5, -1.0
        start = momenta(loop, mine, spatial)
        work = copy.deepcopy(aligned[3])
        for _ in range(20):
            assert run_spatial(loop, mine, work, record, 0, 1, round(0.01 / step), spatial) == -1
            assert np.linalg.norm(spatial.plane.attitude) == pytest.approx(1.0, abs=1e-15)
            fastest = max(fastest, np.abs(mine.rate).max())
        end = momenta(loop, mine, spatial)
        drift.append([(b - a) / np.linalg.norm(a) for a, b in zip(start, end, strict=True)])
    bound = 1e-4 * (fastest**2 + (spatial.plane.motion[2:] ** 2).sum()) * 0.2
    for kind in range(2):
        coarse, fine = drift[0][kind], drift[1][kind]
        assert np.linalg.norm(coarse) < bound
        assert np.linalg.norm(2 * fine - coarse) < 0.01 * np.linalg.norm(coarse)
    assert abs(spatial.plane.attitude[0]) < 0.999  # it has turned


def test_energy_of_a_tumbling_loop(aligned):
    """Only the bushings take energy: kinetic, elastic and lost energy add up to what was there."""
    scene, model, state, work = copy.deepcopy(aligned)
    model = model._replace(
        tooth=model.tooth._replace(present=0), wheels=model.wheels._replace(present=np.zeros(3, np.int64))
    )
    state.rate[:] = -3.0
    spatial = build_space(scene, model, state, make_plane_record(200, 3))
    spatial = spatial._replace(space=spatial.space._replace(guide_reach=np.zeros(3)))
    spatial.plane.motion[:] = 0.1, 0.3, 1.5, -1.0
    record = empty_record(200, 70, 3, (1,))
    assert run_spatial(model, state, work, record, 0, 200, scene.stride, spatial) == -1
    total = record.energy[:, 6:].sum(axis=1)  # bushing loss, kinetic, gravity, bushing elastic
    kinetic = record.energy[:, 7]
    # of first order: the step times the rates of 3.5 rad/s and of the bushings' swinging
    assert np.abs(total - total[0]).max() < 1e-3 * kinetic.max()
    assert np.ptp(record.energy[:, 8]) > 0.1 * kinetic.max()  # it falls: gravity takes part


def test_runs_repeat_bit_for_bit_and_mirror(rig, make_scene):
    """An idler turned the other way gives the mirrored motion; a second run gives the same."""
    seen = []
    for toe in (0.5, 0.5, -0.5):
        scene = make_scene(210.0, rig=rig.changed(idler__toe=toe), friction="isotropic")
        model, state, work, _ = settle(scene)
        record, spatial = run_in_space(scene, model, state, work, 0.5)
        seen.append((record.frame, spatial.record))
    (frame, plane), (again_frame, again), (mirror_frame, mirror) = seen
    assert np.array_equal(frame, again_frame) and np.array_equal(plane.motion, again.motion)
    assert np.abs(plane.motion[-1, 0]) > 1e-5
    signs = [-1, -1, -1, -1, 1, -1, -1, 1]
    # every operation has its mirror image with the same rounding
    np.testing.assert_allclose(mirror.motion, plane.motion * signs, rtol=0, atol=1e-12)
    np.testing.assert_allclose(mirror_frame, frame, rtol=0, atol=1e-12)
    np.testing.assert_allclose(mirror.axial, -plane.axial, rtol=0, atol=1e-6)

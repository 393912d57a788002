"""Runs in space: aligned as in the plane, misaligned in balance, a tumbling loop with its momentum."""

import copy

import numpy as np
import pytest

from tests.conftest import LAWS
from trackdyn.model.work import components
from trackdyn.simulation.account import energy_residual
from trackdyn.simulation.loop import Loop


@pytest.fixture(scope="module")
def aligned(make_scene):
    """A settled aligned loop."""
    return Loop(make_scene(115.0, space="spatial", **LAWS))


def filled(loop, samples):
    """Record of the next samples, every configuration kept."""
    record = loop.room(samples, pitches=(1,), frames=samples, frame_stride=1)
    loop.fill(record)
    return record


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
    """The start-up and the first contacts, a second long: the same operations in the same order.

    1e-9 of g is allowed, for compilers that round differently; the rounding that remains grows by contact.
    """
    loop = aligned.copy()
    planar, record = filled(Loop(loop.scene.with_(space="planar")), 1000), filled(loop, 1000)
    for name in ("raw", "mean"):
        np.testing.assert_allclose(getattr(record, name), getattr(planar, name), rtol=0, atol=1e-9 * 9.81)
    np.testing.assert_allclose(record.frame, planar.frame, rtol=0, atol=1e-9)
    np.testing.assert_allclose(record.energy, planar.energy, rtol=0, atol=1e-9 * np.abs(planar.energy).max())
    assert (record.force > 0).any() and (record.wheel_rate[-1] != 0).all()
    assert not record.plane.motion[:, :4].any() and not record.plane.axial.any()
    assert np.array_equal(loop.state.plane.attitude, [1.0, 0.0, 0.0, 0.0])


MISALIGNED = {"toe": {"idler__toe": 0.5}, "offset": {"idler__axial_offset": 0.003}}


@pytest.fixture(scope="module", params=MISALIGNED)
def misaligned(request, rig, make_scene):
    """A loop with one wheel out of the plane three seconds after the start, and the record of them."""
    scene = make_scene(210.0, rig=rig.changed(**MISALIGNED[request.param]), **LAWS)
    assert scene.fidelity["space"].setting == "spatial" and scene.fidelity["friction"].setting == "independent"
    loop = Loop(scene)
    return loop, filled(loop, 3000)


def test_loop_stays_between_the_flanges(misaligned):
    """At no wheel further out than the play of its guides and their penetration.

    Axial friction of all contacts is at most mu_s times the normal forces of a few kN: below 5 kN, which six
    connectors between the flanges carry with less than 1 mm.
    """
    loop, record = misaligned
    guide, plane = loop.scene.rig.guide, record.plane
    assert np.abs(plane.offset).max() < guide.clearance + 5000.0 / (6 * guide.stiffness)
    assert np.abs(plane.offset).max() > 1e-3  # it does move
    assert np.abs(plane.axial).mean(axis=0).max() > 5.0  # N


def test_energy_account_of_a_misaligned_loop(misaligned):
    """The tolerance of the planar run: 0.1 % of the sprocket's work, start-up included."""
    _, record = misaligned  # energy is all that is asked of it
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
    loop, record = misaligned[0].copy(), misaligned[1]
    model, work = loop._parts.model, loop._parts.work
    chain, room = model.chain, work.space
    total_mass = chain.mass.sum()
    worst, size = 0.0, 0.0
    for _ in range(50):
        # bring the loads of the present state up, then take one step from the same state
        old = copy.deepcopy(loop._parts.state)
        assert loop.gap < 1e-10
        a_p = room.attitude.copy()
        on_wheels = sum(frame @ load[:3] for frame, load in zip(model.space.frame, room.wheel_load, strict=True))
        loop.step()
        load, sweep = work.sweep.load, work.sweep
        pin = np.array([*(sweep.base @ load), room.acceleration[0]])
        alpha = sweep.response @ load
        p, q = old.plane.motion[2:]
        dp, dq = room.acceleration[1:]
        push, acceleration = np.zeros(3), pin
        for i in range(70):
            c, s, w = np.cos(old.angle[i]), np.sin(old.angle[i]), old.rate[i]
            spin = np.array([dp + q * w, dq - p * w, alpha[i]])
            omega = np.array([p, q, w])
            for x, y, share in ((chain.com_x[i], chain.com_y[i], True), (chain.length[i], 0.0, False)):
                arm = np.array([c * x - s * y, s * x + c * y, 0.0])
                moved = acceleration + np.cross(spin, arm) + np.cross(omega, np.cross(omega, arm))
                if share:
                    push += chain.mass[i] * moved
            if i == model.sensor.body:  # what the sensor in the link feels
                arm = np.array([c * model.sensor.x - s * model.sensor.y, s * model.sensor.x + c * model.sensor.y, 0.0])
                felt = acceleration + np.cross(spin, arm) + np.cross(omega, np.cross(omega, arm))
                # accelerations of up to some 1e3 m/s2; the plane's contribution is of the order of 1e-5 m/s2
                np.testing.assert_allclose(
                    work.sensed[:2], [c * felt[0] + s * felt[1], c * felt[1] - s * felt[0]], atol=1e-9
                )
            acceleration = moved
        rest = a_p @ push + on_wheels + [0.0, total_mass * chain.gravity, 0.0]
        worst = max(worst, np.abs(rest).max())
        rows = work.contact[: work.count[0]]
        size = max(size, sum(np.abs(components(rows, name, "xyz")).sum() for name in ("normal", "friction")))
    assert worst < 1e-9 * size
    # over the last second the axial forces cancel: their sum is the change of axial momentum and the
    # weight's share, both small, while the single ones are not
    weight = total_mass * chain.gravity
    mean = record.plane.axial[-1000:].mean(axis=0)
    tilt = np.radians(0.5) + np.abs(record.plane.offset).max()  # of axes and plane, over wheels 1 m apart
    assert abs(mean.sum()) < weight * tilt + 0.1 * np.abs(mean).sum()


def test_tumbling_loop_keeps_its_momentum(aligned):
    """No contact, no gravity: what changes is the error of the method, of first order in the step.

    It is at most h |omega|^2 t of the momentum, with the largest angular velocity of a body in the run: the
    strands swing out. What an extrapolation to no step leaves is of second order, less than a hundredth of it.
    """
    drift, fastest = [], 0.0
    for step in (1e-4, 5e-5):
        loop = aligned.copy()
        loop._parts = loop._parts._replace(model=without_wheels(loop._parts.model, gravity=0.0)._replace(step=step))
        loop._parts.state.rate[:] = -3.0
        loop._parts.state.pin[2:] = 0.4, -0.2
        plane = loop._parts.state.plane
        plane.motion[:] = 0.1, 0.3, 1.5, -1.0
        start = momenta(loop._parts.model, loop._parts.state)
        for _ in range(20):
            loop.step(round(0.01 / step))
            assert np.linalg.norm(plane.attitude) == pytest.approx(1.0, abs=1e-15)
            fastest = max(fastest, np.abs(loop.rates).max())
        end = momenta(loop._parts.model, loop._parts.state)
        drift.append([(b - a) / np.linalg.norm(a) for a, b in zip(start, end, strict=True)])
    bound = 1e-4 * (fastest**2 + (plane.motion[2:] ** 2).sum()) * 0.2
    for kind in range(2):
        coarse, fine = drift[0][kind], drift[1][kind]
        assert np.linalg.norm(coarse) < bound
        assert np.linalg.norm(2 * fine - coarse) < 0.01 * np.linalg.norm(coarse)
    assert abs(plane.attitude[0]) < 0.999  # it has turned


def test_energy_of_a_tumbling_loop(aligned):
    """Only the bushings take energy: kinetic, elastic and lost energy add up to what was there."""
    loop = aligned.copy()
    loop._parts = loop._parts._replace(model=without_wheels(loop._parts.model))
    loop._parts.state.rate[:] = -3.0
    loop._parts.state.plane.motion[:] = 0.1, 0.3, 1.5, -1.0
    record = filled(loop, 200)
    total = record.energy[:, 6:].sum(axis=1)  # bushing loss, kinetic, gravity, bushing elastic
    kinetic = record.energy[:, 7]
    # of first order: the step times the rates of 3.5 rad/s and of the bushings' swinging
    assert np.abs(total - total[0]).max() < 1e-3 * kinetic.max()
    assert np.ptp(record.energy[:, 8]) > 0.1 * kinetic.max()  # it falls: gravity acts


def test_runs_repeat_bit_for_bit_and_mirror(rig, make_scene):
    """An idler turned the other way gives the mirrored motion; a second run gives the same."""
    seen = []
    for toe in (0.5, 0.5, -0.5):
        scene = make_scene(210.0, rig=rig.changed(idler__toe=toe), friction="isotropic", **LAWS)
        record = filled(Loop(scene), 500)
        seen.append((record.frame, record.plane))
    (frame, plane), (again_frame, again), (mirror_frame, mirror) = seen
    assert np.array_equal(frame, again_frame) and np.array_equal(plane.motion, again.motion)
    assert np.abs(plane.motion[-1, 0]) > 1e-5
    signs = [-1, -1, -1, -1, 1, -1, -1, 1]
    # every operation has its mirror image with the same rounding
    np.testing.assert_allclose(mirror.motion, plane.motion * signs, rtol=0, atol=1e-12)
    np.testing.assert_allclose(mirror_frame, frame, rtol=0, atol=1e-12)
    np.testing.assert_allclose(mirror.axial, -plane.axial, rtol=0, atol=1e-6)

"""The Riccati sweep against dense multipliers, and the mobility of a chain against its mass matrix."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import null_space

from tests import reference
from tests.kinematics import irregular_chain, mass_centres, mass_matrix
from trackdyn.chain.kinematics import bushing_torques, damping_weight, forward_kinematics, orient
from trackdyn.chain.riccati import accelerate, accelerations
from trackdyn.model.arrays import make_state, make_work
from trackdyn.model.constants import Chain
from trackdyn.scene.build import mobility_of_slip

SIZES = [6, 7, 12, 13, 35, 70]
# Set beforehand: the sweep is stable, and its end and closure matrices have condition numbers up to 1e5.
AGREEMENT = 1e-10


def make_ring(n, seed, percussion=False):
    """Irregular convex ring of ``n`` bodies that closes exactly, with rates that keep it closed."""
    rng = np.random.default_rng(seed)
    chain, angle, corner, rate, loads = irregular_chain(n, rng)
    if percussion:  # every pin is the centre of percussion of the other: k^2 = (l / 2)^2
        half = chain.length / 2
        chain = chain._replace(com_x=half, com_y=np.zeros(n), inertia=chain.mass * half**2)
    state = make_state(n, n // 2, 3)
    state.pin[:], state.angle[:], state.rate[:] = [*corner, *rng.normal(0, 1, 2)], angle, rate
    return chain, state, loads


def sweep(chain, state, loads, step):
    work = make_work(len(state.angle), len(state.wheel_impact), 3)
    for array in work.sweep:
        array[...] = 7.0  # an old solution
    work.force_x[:], work.force_y[:], work.moment[:] = loads
    orient(state.angle, work.cos, work.sin)
    bushing_torques(chain, state, work)
    accelerations(chain, state, work, step * chain.damping)
    accelerate(chain, state, work, 0)
    return work


def assert_close(result, expected, scale=None):
    scale = np.abs(expected).max() if scale is None else scale
    np.testing.assert_allclose(np.asarray(result) / scale, np.asarray(expected) / scale, rtol=0, atol=AGREEMENT)


@pytest.mark.parametrize("step", [0.0, 1e-4, 5e-3])
@pytest.mark.parametrize("percussion", [False, True])
@pytest.mark.parametrize("n", SIZES)
def test_sweep_agrees_with_the_reference(n, percussion, step):
    for seed in range(3):
        chain, state, loads = make_ring(n, seed, percussion)
        work = sweep(chain, state, loads, step)
        expected = reference.reference_accelerations(chain, state.angle, state.rate, *loads, implicit_step=step)
        scale = np.abs(expected.alpha).max()
        assert_close(work.alpha, expected.alpha)
        assert_close([work.pin_ax[0], work.pin_ay[0]], expected.pins[0], scale * chain.length.max())
        # the load through the cut acts on body 0, the outboard one of the closing joint
        assert_close(work.sweep.load[:2], expected.pin_force[-1], np.abs(expected.pin_force).max())
        # and the torque of the cut joint is its bushing's, with the damping at the end of the step
        torque = work.torque[-1] - step * chain.damping * (expected.alpha[0] - expected.alpha[-1])
        assert_close(work.sweep.load[2], torque, np.abs(work.torque).max())


@pytest.mark.parametrize("step", [0.0, 5e-3])
@pytest.mark.parametrize("n", SIZES)
def test_projection_closes_the_gap_with_the_least_change_of_energy(n, step):
    """Unit gaps, closed as the time loop does by columns 0 to 2 and ``inverse`` (`advance`)."""
    chain, state, loads = make_ring(n, 1)
    result = sweep(chain, state, loads, step).sweep
    alpha, base, end = (array[:, :3] @ result.inverse[:, :2] for array in (result.response, result.base, result.end))
    side = chain.length * np.array([-np.sin(state.angle), np.cos(state.angle)])
    size = np.abs(alpha).max() * chain.length.max()
    np.testing.assert_allclose(side @ alpha, np.eye(2), rtol=0, atol=AGREEMENT * size)
    np.testing.assert_allclose(end[:2] - base, np.eye(2), rtol=0, atol=AGREEMENT * size)

    # Weighted by mass, the change is orthogonal to motions that keep the gap; implicit damping adds to the mass matrix.
    mass, joints = mass_matrix(chain, state), np.roll(np.eye(n), 1, axis=1) - np.eye(n)
    mass[2:, 2:] += step * chain.damping * joints.T @ joints
    motions = null_space(np.hstack([np.zeros((2, 2)), side])).T  # rows that span the motions of the closed chain
    change = np.vstack([base, alpha])
    np.testing.assert_allclose(motions @ mass @ change, 0.0, atol=AGREEMENT * (np.abs(mass) @ np.abs(change)).max())


def test_pins_and_velocities_along_the_chain():
    chain, state, _ = make_ring(10, 8)
    work = make_work(10, 5, 3)
    orient(state.angle, work.cos, work.sin)
    forward_kinematics(chain, state, work)
    assert (work.pin_x[-1], work.pin_y[-1]) == pytest.approx((work.pin_x[0], work.pin_y[0]), abs=1e-13)
    # velocities by differences of the places: of second order in the step, 1e-6^2, and rounding over it
    eps = 1e-6
    places = []
    for sign in (-1, 1):
        moved = state._replace(pin=state.pin.copy(), angle=state.angle + sign * eps * state.rate)
        moved.pin[:2] += sign * eps * state.pin[2:]
        places.append(mass_centres(chain, moved).T)
    np.testing.assert_allclose([work.com_vx, work.com_vy], (places[1] - places[0]) / (2 * eps), rtol=0, atol=1e-8)


@pytest.mark.parametrize("decay", [0.0, 1e-6, 0.1, 1.0, 1.999, 2.0, 2.001, 5.0, 1e3, 1e9])
def test_bushing_damping_at_half_a_step_never_overshoots(decay):
    """One step leaves (1 - (1 - weight) x) / (1 + weight x) >= 0 of the zigzag's joint rates."""
    length, inertia = np.array([0.1, 0.1]), np.array([0.01, 0.01])
    # equal bodies, mass centres at rest: both turn by half of the joint's rate, each against two bushings
    chain = Chain(length, np.ones(2), inertia, length / 2, np.zeros(2), 0.0, decay * 0.01 / (2 * 2) / 1e-4, 0.0, 9.81)
    weight = damping_weight(chain, 1e-4)
    remaining = (1 - (1 - weight) * decay) / (1 + weight * decay)
    assert -1e-15 <= remaining <= 1.0
    if decay < 2.0:
        assert weight == 0.5
        assert remaining == pytest.approx(np.exp(-decay), abs=decay**3 / 12 + 1e-15)


@pytest.mark.parametrize("fraction", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("x", [-0.8, 0.5])
def test_mobility_of_a_sliding_point_is_that_of_the_mass_matrix(fraction, x):
    """Its slip is ``x``, the normal's component along the chain, times its displacement, less arm times rotation."""
    rng, n, middle, arm = np.random.default_rng(4), 41, 20, 0.03
    length, mass = rng.uniform(0.05, 0.2, n), rng.uniform(1, 12, n)
    bodies = length, mass, mass * length**2 / 9, rng.uniform(0.3, 0.7, n) * length, np.zeros(n)
    along, slip = fraction * length[middle], np.zeros(n + 2)
    slip[1], slip[2 : 2 + middle], slip[2 + middle] = x, x * length[:middle], x * along - arm
    matrix = mass_matrix(Chain(*bodies, 0.0, 0.0, 0.0, 9.81), SimpleNamespace(pin=np.zeros(4), angle=np.zeros(n)))
    # bodies behind the tenth one are below rounding
    rolled = Chain(*(np.roll(values, -middle) for values in bodies), 0.0, 0.0, 0.0, 9.81)
    a, b, c = mobility_of_slip(rolled, 0, along, arm)
    assert (a * x + b) * x + c == pytest.approx(slip @ np.linalg.solve(matrix, slip), rel=1e-9)


@pytest.mark.parametrize("kind", ["double_pin", "single_pin"])
def test_symmetric_arcs_of_a_connector_meet_the_same_mass(make_scene, kind):
    model = make_scene(chain=kind).model
    left, right = (mobility_of_slip(model.chain, model.shoes.arc_body[k], model.shoes.arc_x[k], 0.0)[0] for k in (0, 1))
    assert left == pytest.approx(right, rel=1e-12)
    assert left == pytest.approx(model.tooth.mobility, rel=1e-12)
    chain = model.chain
    assert 1 / chain.mass.sum() < left < 1 / chain.mass.min() + chain.length.max() ** 2 / chain.inertia.min()

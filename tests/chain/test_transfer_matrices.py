"""Transfer matrices block by block against Newton and Euler in space, and the size of their product."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests import reference
from tests.kinematics import closed_rates
from trackdyn.model.constants import Chain
from trackdyn_replication.study.extremes import transfer_product as product

# Sums of a few dozen products of numbers up to 1e2: a few hundred roundings of 1e-16 each.
ROUNDING = 1e-12
Z = np.array([0.0, 0.0, 1.0])
SEEDS = range(5)


def random_body(rng, omega):
    """Return the matrix of seven joined particles, their masses and positions from the input, arms and loads."""
    mass, points, r_io = rng.uniform(0.3, 2.0, 7), rng.normal(0.0, 0.1, (7, 3)), rng.normal(0.0, 0.1, 3)
    r_ic = mass @ points / mass.sum()
    inertia = sum(m * (a @ a * np.eye(3) - np.outer(a, a)) for m, a in zip(mass, points - r_ic, strict=True))
    force, moment = rng.normal(0.0, 20.0, 3), rng.normal(0.0, 2.0, 3)
    matrix = product.body_matrix(mass.sum(), inertia, r_ic, r_io, omega, force, moment)
    return matrix, mass, points, r_ic, r_io, force, moment


def split(state):
    assert state[12] == 1.0
    return np.split(state[:12], 4)


@pytest.mark.parametrize("seed", SEEDS)
def test_body_balances_the_momentum_of_its_particles(seed):
    """The sums of m a and r x m a over particles equal the loads at input, output and centre."""
    rng = np.random.default_rng(seed)
    omega = rng.normal(0.0, 3.0, 3)
    matrix, mass, points, r_ic, r_io, force, moment = random_body(rng, omega)
    state = np.append(rng.normal(0.0, 10.0, 12), 1.0)
    acc, spin, m_in, q_in = split(state)
    acc_out, spin_out, m_out, q_out = split(matrix @ state)

    def moved(arm):
        return acc + np.cross(spin, arm) + np.cross(omega, np.cross(omega, arm))

    np.testing.assert_allclose(acc_out, moved(r_io), rtol=0, atol=ROUNDING * 100)
    assert (spin_out == spin).all()
    pin = rng.normal(0.0, 1.0, 3)  # the input in space
    rate = np.array([m * moved(r) for m, r in zip(mass, points, strict=True)])
    np.testing.assert_allclose(rate.sum(axis=0), q_in - q_out + force, rtol=0, atol=ROUNDING * 100)
    expected = m_in - m_out + moment
    expected += np.cross(pin, q_in) - np.cross(pin + r_io, q_out) + np.cross(pin + r_ic, force)
    np.testing.assert_allclose(np.cross(pin + points, rate).sum(axis=0), expected, rtol=0, atol=ROUNDING * 100)


@pytest.mark.parametrize("seed", SEEDS)
def test_joint_passes_loads_and_turns_about_its_axis_only(seed):
    rng = np.random.default_rng(seed)
    frame, next_frame = Rotation.random(2, rng).as_matrix()
    axis, axis_next = frame @ Z, next_frame @ Z
    spin, rate, torque = rng.normal(0.0, 3.0, 3), rng.normal(0.0, 4.0), rng.normal(0.0, 5.0)
    body, zeta = random_body(rng, spin + axis * rate)[0], np.cross(spin, axis) * rate
    state = np.append(rng.normal(0.0, 10.0, 12), 1.0)
    out = product.joint_matrix(body, axis, axis_next, zeta, torque) @ state
    for k in (0, 2, 3):
        assert (split(out)[k] == split(state)[k]).all(), "position, moment and force are the same on both sides"
    relative = out[3:6] - state[3:6]
    size = np.abs(relative).max()
    # all but zeta is along the axis
    np.testing.assert_allclose(np.cross(relative - zeta, axis) / size, 0.0, atol=ROUNDING)
    # the bushing behind the outboard body has its torque; the row cancels terms of the size of m
    moment = (body @ out)[6:9]
    assert axis_next @ moment == pytest.approx(torque, abs=1e3 * ROUNDING * max(1.0, np.abs(moment).max()))
    # Eq. 7 as printed, in the frame of the inboard body
    printed = frame.T @ relative - np.cross(frame.T @ spin, rate * Z)
    acceleration = product.joint_acceleration(axis, state, out)
    assert acceleration == pytest.approx(printed[2], rel=1e-11)
    # and d/dt (Omega + axis phi') = Omega' + axis phi'' + zeta has this phi''
    np.testing.assert_allclose(relative / size, (axis * acceleration + zeta) / size, atol=ROUNDING)


TRACK = np.array([[0.1, 10.0, 0.012], [0.058, 2.5, 0.003]])
BAR = np.array([[0.1, 8.0, 8.0 * 0.1**2 / 12.0]] * 2)


def make_chain(kind, n, com=0.0):
    """``n`` bodies (length, mass, inertia), two kinds by turns, mass centre in the middle or off it."""
    length, mass, inertia = np.ascontiguousarray(kind[np.arange(n) % 2].T)
    return Chain(length, mass, inertia, (0.5 + com) * length, com * length, 130.0, 10.0, -2.0 * np.pi / n, 9.81)


@pytest.mark.parametrize("kind", [TRACK, BAR], ids=["track", "bar"])
@pytest.mark.parametrize("n", [4, 6])
def test_product_over_a_short_chain_is_the_reference(kind, n):
    """The constant times eps times the growth over six bodies of the track, 4e5: at most 1e-10 over 200 poses."""
    for seed in range(4):
        chain, rng = make_chain(kind, n, 0.1), np.random.default_rng(seed)
        angle = 0.3 - 2.0 * np.pi * np.arange(n) / n  # two interlaced regular polygons close for every pair of lengths
        rate = closed_rates(chain.length, angle, rng.normal(0.0, 4.0, n))
        *loads, torque = (rng.normal(0.0, size, n) for size in (2000.0, 2000.0, 60.0, 60.0))
        pose = angle, rate, *loads
        alpha, start = product.accelerations(chain, *pose, torque)
        expected = reference.reference_accelerations(chain, *pose, torque=torque, implicit_damping=0.0)
        size = 3e-9 * np.abs(expected.alpha).max()
        np.testing.assert_allclose(alpha, expected.alpha, rtol=0, atol=size)
        np.testing.assert_allclose(start[:2], expected.pins[0], rtol=0, atol=size * chain.length.max())
        force = 3e-9 * np.abs(expected.pin_force).max()
        np.testing.assert_allclose(start[9:11], expected.pin_force[-1], rtol=0, atol=force)
        np.testing.assert_array_equal(start[[6, 7, 11]], 0.0)


@pytest.mark.parametrize("body", [*TRACK, BAR[0]], ids=["link", "connector", "bar"])
def test_growth_of_single_bodies_is_the_closed_form(body):
    """Two equal bodies multiply; a uniform bar, whose k is a / sqrt(3), has mu = 2 + sqrt(3)."""
    chain = make_chain(np.array([body, body]), 4)
    half, radius = 0.5 * chain.length[0], np.sqrt(chain.inertia[0] / chain.mass[0])
    # eigenvalues of a matrix that is not normal, with a double eigenvalue 1
    assert product.growth(chain) == pytest.approx(((half + radius) / abs(half - radius)) ** 2, rel=1e-9)


def size_of_the_product(kind, n):
    chain, angle, zero = make_chain(kind, n), -2.0 * np.pi * np.arange(n) / n, np.zeros(n)
    return np.log10(np.linalg.norm(product.multiply(product.elements_of(chain, angle, *[zero] * 5))[:12, :12]))


@pytest.mark.parametrize("kind", [BAR, TRACK])
def test_size_of_the_product_grows_by_the_closed_form(kind):
    """The closed form holds for a straight chain; the bend of a ring fades with the square of the number of bodies."""
    small, middle, large = (size_of_the_product(kind, n) for n in (20, 40, 80))
    expected = np.log10(product.growth(make_chain(kind, 4)))
    wide, narrow = (middle - small) / 10.0 - expected, (large - middle) / 20.0 - expected
    # A turn of 2 pi / n from body to body changes the exponent by at most a tenth of (2 pi / n)^2 (the track). No
    # rounding shows: the norm is exact to eps times the number of factors.
    assert abs(narrow) < 0.2 * (2.0 * np.pi / 40) ** 2  # 0.005 of 1.14 (bars) and 1.87 (track)
    assert narrow == pytest.approx(wide / 4.0, abs=1e-3), "the rest is the bend"

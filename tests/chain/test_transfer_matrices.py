"""Transfer matrices block by block against Newton and Euler in space, and the error of their product."""

import numpy as np
import pytest
from scipy import stats

from replication.study.extremes import reference
from replication.study.extremes.transfer_product import (
    accelerations,
    body_matrix,
    elements_of,
    growth,
    joint_acceleration,
    joint_matrix,
    multiply,
    skew,
    solve_boundaries,
)
from trackdyn.model.constants import Chain

# Sums of a few dozen products of numbers up to 1e2: a few hundred roundings of 1e-16 each.
ROUNDING = 1e-12
Z = np.array([0.0, 0.0, 1.0])
SEEDS = range(5)


def usable_bodies(chain: Chain) -> int:
    """Number of bodies after which `growth` has used up double precision."""
    digits = -np.log10(np.finfo(float).eps)
    return int(2.0 * digits / np.log10(growth(chain).pitch))


def random_rotation(rng):
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.linalg.det(q)


def random_body(rng):
    """Seven particles, joined rigidly: mass, places from the input, r_ic, r_io, inertia about the centre."""
    mass = rng.uniform(0.3, 2.0, 7)
    points = rng.normal(0.0, 0.1, (7, 3))
    centre = mass @ points / mass.sum()
    arm = points - centre
    inertia = sum(m * (a @ a * np.eye(3) - np.outer(a, a)) for m, a in zip(mass, arm, strict=True))
    return mass, points, centre, rng.normal(0.0, 0.1, 3), inertia


def random_matrix(rng, omega=None):
    mass, _, r_ic, r_io, inertia = random_body(rng)
    omega = rng.normal(0.0, 3.0, 3) if omega is None else omega
    force, moment = rng.normal(0.0, 20.0, 3), rng.normal(0.0, 2.0, 3)
    return body_matrix(mass.sum(), inertia, r_ic, r_io, omega, force, moment)


def random_input(rng):
    """State with accelerations and loads of random size; its last entry is 1."""
    return np.append(rng.normal(0.0, 10.0, 12), 1.0)


def split(state):
    """r'', Omega', m and q of a state."""
    assert state[12] == 1.0
    return state[0:3], state[3:6], state[6:9], state[9:12]


@pytest.mark.parametrize("seed", SEEDS)
def test_skew_is_the_cross_product(seed):
    v, w = np.random.default_rng(seed).normal(size=(2, 3))
    np.testing.assert_allclose(skew(v) @ w, np.cross(v, w), rtol=0, atol=1e-15)


@pytest.mark.parametrize("seed", SEEDS)
def test_body_balances_the_momentum_of_its_particles(seed):
    """Sum over particles of m a and r x m a about a fixed point equals what acts at input, output and centre."""
    rng = np.random.default_rng(seed)
    mass, points, r_ic, r_io, inertia = random_body(rng)
    omega, force, moment = rng.normal(0.0, 3.0, 3), rng.normal(0.0, 20.0, 3), rng.normal(0.0, 2.0, 3)
    matrix = body_matrix(mass.sum(), inertia, r_ic, r_io, omega, force, moment)
    state = random_input(rng)
    acc, spin, m_in, q_in = split(state)
    acc_out, spin_out, m_out, q_out = split(matrix @ state)

    def moved(arm):
        return acc + np.cross(spin, arm) + np.cross(omega, np.cross(omega, arm))

    np.testing.assert_allclose(acc_out, moved(r_io), rtol=0, atol=ROUNDING * 100)
    assert (spin_out == spin).all()
    pin = rng.normal(0.0, 1.0, 3)  # the input in space
    rate = np.array([m * moved(r) for m, r in zip(mass, points, strict=True)])
    np.testing.assert_allclose(rate.sum(axis=0), q_in - q_out + force, rtol=0, atol=ROUNDING * 100)
    expected = (
        m_in - m_out + moment
        + np.cross(pin, q_in) - np.cross(pin + r_io, q_out) + np.cross(pin + r_ic, force)
    )  # fmt: skip
    np.testing.assert_allclose(np.cross(pin + points, rate).sum(axis=0), expected, rtol=0, atol=ROUNDING * 100)


@pytest.mark.parametrize("seed", SEEDS)
def test_body_at_rest_has_the_printed_blocks(seed):
    rng = np.random.default_rng(seed)
    mass, _, r_ic, r_io, inertia = random_body(rng)
    zero, mass = np.zeros(3), mass.sum()
    matrix = body_matrix(mass, inertia, r_ic, r_io, zero, zero, zero)
    inertia_input = inertia - mass * skew(r_ic) @ skew(r_ic)
    unit, none, column = np.eye(3), np.zeros((3, 3)), np.zeros((3, 1))
    expected = np.block([
        [unit, -skew(r_io), none, none, column],
        [none, unit, none, none, column],
        [mass * skew(r_io - r_ic), -inertia_input - mass * skew(r_io) @ skew(r_ic), unit, -skew(r_io), column],
        [-mass * unit, mass * skew(r_ic), none, unit, column],
        [np.zeros((1, 12)), np.ones((1, 1))],
    ])  # fmt: skip
    np.testing.assert_allclose(matrix, expected, rtol=0, atol=ROUNDING)
    # no load and no acceleration is lost in a body: the matrix can always be inverted
    assert np.linalg.det(random_matrix(rng)) == pytest.approx(1.0, abs=ROUNDING)


@pytest.mark.parametrize("seed", SEEDS)
def test_body_cut_in_two_is_the_product_of_its_parts(seed):
    """Welded together, two parts are one body: particles on either side, one angular velocity."""
    rng = np.random.default_rng(seed)
    omega = rng.normal(0.0, 3.0, 3)
    force, moment = rng.normal(0.0, 20.0, (2, 3)), rng.normal(0.0, 2.0, (2, 3))
    parts = [random_body(rng) for _ in range(2)]
    first, second = parts
    matrix = [
        body_matrix(mass.sum(), inertia, r_ic, r_io, omega, force[k], moment[k])
        for k, (mass, _, r_ic, r_io, inertia) in enumerate(parts)
    ]
    mass = np.array([first[0].sum(), second[0].sum()])
    centre = np.array([first[2], first[3] + second[2]])  # from the common input
    whole = mass @ centre / mass.sum()
    arm = centre - whole
    inertia = sum(
        half[4] + m * (a @ a * np.eye(3) - np.outer(a, a)) for half, m, a in zip(parts, mass, arm, strict=True)
    )
    total = moment.sum(axis=0) + np.cross(arm, force).sum(axis=0)
    one = body_matrix(mass.sum(), inertia, whole, first[3] + second[3], omega, force.sum(axis=0), total)
    np.testing.assert_allclose(multiply(matrix), one, rtol=0, atol=ROUNDING * 10)


def random_joint(rng):
    """Joint with axes in space: its matrix, outboard body, both axes, zeta, torque behind that body."""
    frame = random_rotation(rng)
    axis, axis_next = frame @ Z, random_rotation(rng) @ Z
    spin, rate = rng.normal(0.0, 3.0, 3), rng.normal(0.0, 4.0)
    zeta = np.cross(spin, axis) * rate
    body, torque = random_matrix(rng, spin + axis * rate), rng.normal(0.0, 5.0)
    matrix = joint_matrix(body, axis, axis_next, zeta, torque)
    return matrix, body, frame, axis_next, spin, rate, zeta, torque


@pytest.mark.parametrize("seed", SEEDS)
def test_joint_passes_loads_and_turns_about_its_axis_only(seed):
    rng = np.random.default_rng(seed)
    matrix, body, frame, axis_next, spin, rate, zeta, torque = random_joint(rng)
    state = random_input(rng)
    out = matrix @ state
    for k in (0, 2, 3):
        assert (split(out)[k] == split(state)[k]).all(), "position, moment and force are the same on both sides"
    relative = out[3:6] - state[3:6]
    size = np.abs(relative).max()
    # what is neither zeta nor along the axis would break the bearing
    np.testing.assert_allclose(np.cross(relative - zeta, frame @ Z) / size, 0.0, atol=ROUNDING)
    # the bushing behind the outboard body has its torque; the row cancels terms of the size of m
    moment = (body @ out)[6:9]
    assert axis_next @ moment == pytest.approx(torque, abs=1e3 * ROUNDING * max(1.0, np.abs(moment).max()))
    # Eq. 7 as printed, in the frame of the inboard body
    printed = frame.T @ relative - np.cross(frame.T @ spin, rate * Z)
    assert joint_acceleration(frame @ Z, state, out) == pytest.approx(printed[2], rel=1e-11)
    # and d/dt (Omega + axis phi') = Omega' + axis phi'' + zeta has this phi''
    np.testing.assert_allclose(
        relative / size, (frame @ Z * joint_acceleration(frame @ Z, state, out) + zeta) / size, atol=ROUNDING
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_joint_forgets_the_turn_about_its_axis(seed):
    """A free joint does not pass rotation about its axis on, so that its matrix is singular."""
    matrix, _, frame, *_ = random_joint(np.random.default_rng(seed))
    turn = np.zeros(13)
    turn[3:6] = frame @ Z
    np.testing.assert_allclose(matrix @ turn, 0.0, atol=ROUNDING * np.abs(matrix).max())
    assert np.linalg.matrix_rank(matrix, tol=1e-10) == 12
    others = [k for k in range(13) if k not in (3, 4, 5)]
    np.testing.assert_array_equal(matrix[others], np.eye(13)[others])


def percussion_joint(radius):
    """Joint in front of a body with its pins at +-1/16 m (exact in binary) and this radius of gyration."""
    half, zero = 0.0625, np.zeros(3)
    arms = np.array([half, 0, 0]), np.array([2 * half, 0, 0])
    return joint_matrix(body_matrix(8.0, 8.0 * radius**2 * np.eye(3), *arms, zero, zero, zero), Z, Z, zero, 1.0)


def test_joint_is_singular_where_the_pins_are_mutual_centres_of_percussion():
    assert not np.isfinite(percussion_joint(0.0625)).all()
    near, far = percussion_joint(0.0625 * 0.999), percussion_joint(0.0625 * 0.5)
    assert np.isfinite(near).all()
    # torque_next / D with D = -m (k^2 - a^2): 0.75 against 0.001999
    assert near[5, 12] / far[5, 12] == pytest.approx(0.75 / (1.0 - 0.999**2), rel=1e-9)
    assert far[5, 12] > 0, "-D = m (k^2 - a^2) is negative for a body with its mass between the pins"


TRACK = np.array([[0.1, 10.0, 0.012], [0.058, 2.5, 0.003]])
BAR = np.array([[0.1, 8.0, 8.0 * 0.1**2 / 12.0]] * 2)


def make_chain(kind, n, com=0.0):
    """``n`` bodies (length, mass, inertia), two kinds by turns, mass centre in the middle or off it."""
    length, mass, inertia = np.ascontiguousarray(kind[np.arange(n) % 2].T)
    return Chain(length, mass, inertia, (0.5 + com) * length, com * length, 130.0, 10.0, -2.0 * np.pi / n, 9.81)


def regular_state(chain, rng, turn=0.0):
    """Clockwise polygon of alternating sides, closed exactly, with rates that keep it closed, and loads."""
    n = len(chain.length)
    angle = turn - 2.0 * np.pi * np.arange(n) / n  # two interlaced regular polygons close for every pair of lengths
    rows = chain.length * np.array([-np.sin(angle), np.cos(angle)])
    rate = rng.normal(0.0, 4.0, n)
    rate -= rows.T @ np.linalg.solve(rows @ rows.T, rows @ rate)
    return angle, rate, rng.normal(0.0, 2000.0, n), rng.normal(0.0, 2000.0, n), rng.normal(0.0, 60.0, n)


def loaded(chain, angle, rate, *loads):
    """A pose with the bushing torques."""
    turn = np.append(np.diff(angle), angle[0] - angle[-1] - 2.0 * np.pi)
    relative = np.append(np.diff(rate), rate[0] - rate[-1])
    return angle, rate, *loads, -chain.stiffness * (turn - chain.free_angle) - chain.damping * relative


def error_of_the_product(kind, n, seeds, turned=False):
    """Median relative error of the angular accelerations, reference in extended precision."""
    chain, errors = make_chain(kind, n), []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        pose = regular_state(chain, rng, rng.uniform(0.0, 2.0 * np.pi) if turned else 0.0)
        alpha, _ = accelerations(chain, *loaded(chain, *pose))
        expected = reference.reference_accelerations(chain, *pose).alpha
        errors.append(np.abs(alpha - expected).max() / np.abs(expected).max())
    return np.median(errors)


@pytest.mark.parametrize("kind", [TRACK, BAR], ids=["track", "bar"])
@pytest.mark.parametrize("n", [4, 6])
def test_product_over_a_short_chain_is_the_reference(kind, n):
    """The constant times eps times the growth over six bodies of the track, 4e5: at most 1e-10 over 200 poses."""
    for seed in range(4):
        chain = make_chain(kind, n, 0.1)
        pose = regular_state(chain, np.random.default_rng(seed), 0.3)
        alpha, start = accelerations(chain, *loaded(chain, *pose))
        expected = reference.reference_accelerations(chain, *pose)
        size = 3e-9 * np.abs(expected.alpha).max()
        np.testing.assert_allclose(alpha, expected.alpha, rtol=0, atol=size)
        pin = expected.pin_ax, expected.pin_ay
        np.testing.assert_allclose(start[:2], pin, rtol=0, atol=size * chain.length.max())
        force = 3e-9 * np.abs(expected.pin_force).max()
        np.testing.assert_allclose(start[9:11], expected.pin_force[-1], rtol=0, atol=force)
        np.testing.assert_array_equal(start[[6, 7, 11]], 0.0)


@pytest.mark.parametrize("com", [0.0, 0.15])
def test_boundaries_hold_on_both_sides_of_the_cut(com):
    n = 6
    chain = make_chain(TRACK, n, com)
    angle, rate, *loads = regular_state(chain, np.random.default_rng(0))
    *pose, torque = loaded(chain, angle, rate, *loads)
    elements = elements_of(chain, *pose, torque)
    product = multiply(elements)
    start = solve_boundaries(product, elements[0], torque[0], torque[-1])
    end = product @ start
    # Exact up to roundings of terms as large as product times start. The last joint has cancelled the moment
    # along the axis, so that its rounding is that of the other loads.
    size = np.abs(product) @ np.abs(start)
    gap = end - start
    np.testing.assert_allclose(gap[6:12], 0.0, atol=1e-13 * size[6:12].max(), err_msg="one load through the cut")
    np.testing.assert_allclose(gap[:3], 0.0, atol=1e-13 * size[:3].max(), err_msg="the pins of the cut separate")
    np.testing.assert_allclose(start[[2, 3, 4, 6, 7, 11]], 0.0, atol=1e-12, err_msg="nothing leaves the plane")
    # every bushing of the chain has its torque, the first one included
    state = start
    for i in range(n):
        state = elements[2 * i] @ state
        tolerance = 1e-9 * np.abs(loads[0]).max() * chain.length.max()  # growth over six bodies: 4e5
        assert state[8] == pytest.approx(torque[i], abs=tolerance), f"joint {i}"
        if i < n - 1:
            state = elements[2 * i + 1] @ state


def test_growth_of_single_bodies_is_the_closed_form():
    chain = make_chain(TRACK, 4)
    half, radius = 0.5 * chain.length, np.sqrt(chain.inertia / chain.mass)
    np.testing.assert_allclose(growth(chain).body, (half + radius) / np.abs(half - radius), rtol=1e-13)
    # uniform bar: k = a / sqrt(3), so that mu = 2 + sqrt(3), and two equal bodies multiply
    bars = growth(make_chain(BAR, 4))
    np.testing.assert_allclose(bars.body, 2.0 + np.sqrt(3.0), rtol=1e-13)
    # eigenvalues of a matrix that is not normal, with a double eigenvalue 1 beside it
    assert bars.pitch == pytest.approx((2.0 + np.sqrt(3.0)) ** 2, rel=1e-9)


@pytest.mark.parametrize("com", [0.0, 0.2, -0.3])
def test_growth_of_a_body_off_its_centre_is_an_eigenvalue(com):
    """Two equal bodies, for which the factors do multiply."""
    chain = make_chain(np.array([TRACK[0]] * 2), 4, com)
    seen = growth(chain)
    assert seen.pitch == pytest.approx(seen.body[0] ** 2, rel=1e-9)


def test_growth_is_without_bound_at_the_centres_of_percussion():
    kind = np.array([[0.125, 8.0, 8.0 * 0.0625**2]] * 2)
    chain = make_chain(kind, 4)
    assert np.isinf(growth(chain).body).all()
    assert growth(chain).pitch == np.inf
    assert usable_bodies(chain) == 0


def size_of_the_product(kind, n):
    """Decimal logarithm of the norm of the product over a ring of ``n`` bodies, at rest and without loads."""
    chain, angle, zero = make_chain(kind, n), -2.0 * np.pi * np.arange(n) / n, np.zeros(n)
    return np.log10(np.linalg.norm(multiply(elements_of(chain, angle, *[zero] * 5))[:12, :12]))


@pytest.mark.parametrize("kind", [BAR, TRACK])
def test_size_of_the_product_grows_by_the_closed_form(kind):
    """The closed form holds for a straight chain; the bend of a ring fades with the square of the number of bodies."""
    small, middle, large = (size_of_the_product(kind, n) for n in (20, 40, 80))
    expected = np.log10(growth(make_chain(kind, 4)).pitch)
    wide, narrow = (middle - small) / 10.0 - expected, (large - middle) / 20.0 - expected
    # A turn of 2 pi / n from body to body changes the exponent by at most a tenth of (2 pi / n)^2 (the track). No
    # rounding shows: the norm is exact to eps times the number of factors.
    assert abs(narrow) < 0.2 * (2.0 * np.pi / 40) ** 2  # 0.005 of 1.14 (bars) and 1.87 (track)
    assert narrow == pytest.approx(wide / 4.0, abs=1e-3), "what is left is the bend"


@pytest.mark.parametrize(("kind", "sizes"), [(BAR, np.arange(8, 26, 2)), (TRACK, np.arange(6, 18, 2))])
def test_error_of_the_product_grows_with_its_size(kind, sizes):
    """A regression: the linear-algebra library rounds by the processor, so that every error is a random draw."""
    seeds, pitches = 120, sizes / 2.0
    # Turned by a random angle, the same polygon rounds anew with every seed.
    errors = [[error_of_the_product(kind, n, [1000 * n + k], turned=True) for k in range(seeds)] for n in sizes]
    # Rounding errors of the n bodies add up as n^a: none adds to the largest (a = 0), at random (1/2), all of one sign
    # (1). What is left of the error beside size and n^(1/2) has a slope between that of n^(-1/2) and of n^(1/2).
    rest = np.log10(errors).T - [size_of_the_product(kind, n) for n in sizes] - 0.5 * np.log10(sizes)
    summation = 0.5 * np.log10(sizes[-1] / sizes[0]) / (pitches[-1] - pitches[0])
    # A single error scatters by a factor of three, so that the slope has a standard error of 0.006 (bars) or 0.011
    # (track) decimal digits a pitch, taken here from the residuals. Student's t at 5e-7 a side: a false alarm in 1e6.
    fit = stats.linregress(np.tile(pitches, seeds), rest.ravel())
    bound = summation + stats.t.isf(5e-7, rest.size - 2) * fit.stderr
    assert abs(fit.slope) < bound
    assert bound < 0.07 * np.log10(growth(make_chain(kind, 4)).pitch), "a growth 10 % off must not pass"


def test_usable_bodies_of_the_track_leave_no_digit():
    chain = make_chain(TRACK, 16)
    assert usable_bodies(chain) == 16
    assert usable_bodies(make_chain(BAR, 4)) == 27
    # At the limit the constant in front of eps * growth counts: one or two digits. The median of nine scatters by
    # 0.2 decimal digits from one library to the next; both bounds are more than eight times that away.
    assert error_of_the_product(TRACK, 16, range(9)) > 1e-3
    assert error_of_the_product(TRACK, 8, range(9)) < 1e-7


def test_product_of_the_whole_track_gives_nothing():
    """Seventy bodies: the solver refuses, or every digit is wrong."""
    chain = make_chain(TRACK, 70)
    pose = regular_state(chain, np.random.default_rng(0))
    try:
        with np.errstate(all="ignore"):
            alpha, _ = accelerations(chain, *loaded(chain, *pose))
    except np.linalg.LinAlgError:
        return
    expected = reference.reference_accelerations(chain, *pose).alpha
    error = np.abs(alpha - expected).max() / np.abs(expected).max()
    assert not error < 1.0

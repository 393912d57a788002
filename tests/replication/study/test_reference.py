"""The multiplier formulation against closed forms and conservation laws."""

import numpy as np
import pytest

from replication.study.extremes.reference import _solve_symmetric, reference_accelerations
from trackdyn.errors import InputError
from trackdyn.model.constants import Chain

GRAVITY = 9.81


def make_chain(n, stiffness=40.0, damping=0.7, free_angle=-0.11, gravity=GRAVITY, seed=1):
    rng = np.random.default_rng(seed)
    length = rng.uniform(0.06, 0.16, n)
    return Chain(
        length=length, mass=rng.uniform(2.0, 15.0, n), inertia=rng.uniform(0.003, 0.02, n),
        com_x=length * rng.uniform(0.35, 0.65, n), com_y=rng.uniform(-0.02, 0.02, n), stiffness=stiffness,
        damping=damping, free_angle=free_angle, gravity=gravity,
    )  # fmt: skip


def close_ring(n, seed=2):
    """Lengths and angles of an irregular clockwise polygon that closes exactly."""
    rng = np.random.default_rng(seed)
    turn = -2.0 * np.pi * (np.arange(n) + rng.uniform(-0.2, 0.2, n)) / n
    corner = np.stack([0.9 * np.cos(turn), 0.4 * np.sin(turn)], axis=1)
    side = np.roll(corner, -1, axis=0) - corner
    angle = np.unwrap(np.arctan2(side[:, 1], side[:, 0]))
    return np.hypot(*side.T), angle


def make_ring(n, **options):
    length, angle = close_ring(n)
    chain = make_chain(n, **options)
    return chain._replace(length=length, com_x=0.5 * length), angle


def random_state(n, seed=3):
    rng = np.random.default_rng(seed)
    angle = np.cumsum(rng.uniform(-0.6, 0.4, n))
    wrench = rng.normal(0.0, 300.0, (3, n))
    return angle, rng.normal(0.0, 5.0, n), wrench[0], wrench[1], 0.1 * wrench[2]


def turn(angle, x, y):
    return np.stack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y], axis=1)


def replay(chain, angle, rate, result):
    """Position from body 0's input pin and acceleration of every mass centre and pin, along the chain."""
    pin, pin_acc = np.zeros(2), np.array([result.pin_ax, result.pin_ay])
    centres, centre_accs, pins, pin_accs = [], [], [pin], [pin_acc]
    centre_arm, link = turn(angle, chain.com_x, chain.com_y), turn(angle, chain.length, 0.0 * chain.length)
    for i in range(len(angle)):

        def moved(arm, i=i, start=pin_acc):
            return start + result.alpha[i] * np.array([-arm[1], arm[0]]) - rate[i] ** 2 * arm

        centres.append(pin + centre_arm[i])
        centre_accs.append(moved(centre_arm[i]))
        pin, pin_acc = pin + link[i], moved(link[i])
        pins.append(pin)
        pin_accs.append(pin_acc)
    return np.array(centres), np.array(centre_accs), np.array(pins), np.array(pin_accs)


def residual_forces(chain, angle, rate, force_x, force_y, moment, result, joints, implicit_step=0.0, turns=-1):
    """Newton-Euler residual of every body, from its own free-body diagram."""
    n = len(angle)
    centres, centre_accs, pins, _ = replay(chain, angle, rate, result)
    force = np.stack([force_x, force_y - chain.mass * chain.gravity], axis=1)
    torque = np.array(moment, dtype=float)
    for j in range(joints):
        o = (j + 1) % n
        phi = angle[o] - angle[j] + (2.0 * np.pi * turns if o == 0 else 0.0)
        phi_rate = rate[o] - rate[j] + implicit_step * (result.alpha[o] - result.alpha[j])
        bushing = -chain.stiffness * (phi - chain.free_angle) - chain.damping * phi_rate
        for body, sign, pin in ((o, 1.0, pins[o]), (j, -1.0, pins[j + 1])):
            arm, pull = pin - centres[body], sign * result.pin_force[j]
            force[body] += pull
            torque[body] += arm[0] * pull[1] - arm[1] * pull[0] + sign * bushing
    return force - chain.mass[:, None] * centre_accs, torque - chain.inertia * result.alpha


def test_free_fall_of_an_open_chain_does_not_turn_it():
    chain = make_chain(6, stiffness=0.0, damping=0.0)
    angle, *_ = random_state(6)
    zero = np.zeros(6)
    result = reference_accelerations(chain, angle, zero, zero, zero, zero, closed=False)
    assert result.pin_ax == pytest.approx(0.0, abs=1e-12)
    assert result.pin_ay == pytest.approx(-GRAVITY, rel=1e-12)
    np.testing.assert_allclose(result.alpha, 0.0, atol=1e-11)
    np.testing.assert_allclose(result.pin_force, 0.0, atol=1e-11)


def test_ring_without_bushings_falls_without_turning():
    chain, angle = make_ring(10, stiffness=0.0, damping=0.0)
    zero = np.zeros(10)
    result = reference_accelerations(chain, angle, zero, zero, zero, zero)
    assert (result.pin_ax, result.pin_ay) == pytest.approx((0.0, -GRAVITY), abs=1e-11)
    np.testing.assert_allclose(result.alpha, 0.0, atol=1e-10)


def test_one_free_body_follows_newton_and_euler():
    chain = make_chain(1)
    angle, rate = np.array([0.7]), np.array([3.0])
    result = reference_accelerations(
        chain, angle, rate, np.array([12.0]), np.array([-5.0]), np.array([0.8]), closed=False
    )
    alpha = 0.8 / chain.inertia[0]
    centre = np.array([12.0, -5.0]) / chain.mass[0] - [0.0, GRAVITY]
    arm = -turn(angle, chain.com_x, chain.com_y)[0]
    pin = centre + alpha * np.array([-arm[1], arm[0]]) - 9.0 * arm
    assert result.alpha == pytest.approx([alpha], rel=1e-12)
    assert (result.pin_ax, result.pin_ay) == pytest.approx(tuple(pin), rel=1e-12)
    assert result.pin_force.shape == (0, 2)


def test_heavy_first_body_makes_the_second_a_compound_pendulum():
    chain = make_chain(2, stiffness=0.0, damping=0.0)
    anchor = 1e13
    chain = chain._replace(mass=np.array([anchor, 3.0]), inertia=np.array([anchor, 0.01]))
    angle, zero = np.array([0.2, -0.4]), np.zeros(2)
    # The anchor is held up against gravity, so its pin stays where it is.
    result = reference_accelerations(chain, angle, zero, zero, np.array([anchor * GRAVITY, 0.0]), zero, closed=False)
    reach = turn(angle, chain.com_x, chain.com_y)[1]
    expected = -3.0 * GRAVITY * reach[0] / (0.01 + 3.0 * (reach @ reach))
    assert result.alpha[1] == pytest.approx(expected, rel=1e-9)


def test_bushing_of_two_bodies_pinned_at_their_mass_centres():
    """Two discs on one pin: the bushing alone turns them, phi'' = tau (1/J0 + 1/J1)."""
    chain = make_chain(2, stiffness=50.0, damping=2.0, free_angle=0.3, gravity=0.0)
    chain = chain._replace(com_x=np.array([chain.length[0], 0.0]), com_y=np.zeros(2))
    angle, rate, zero = np.array([0.1, 0.9]), np.array([1.0, -2.0]), np.zeros(2)
    for step in (0.0, 1e-2):
        result = reference_accelerations(chain, angle, rate, zero, zero, zero, implicit_step=step, closed=False)
        compliance = np.sum(1.0 / chain.inertia)
        explicit = -50.0 * (0.8 - 0.3) - 2.0 * (-3.0)
        tau = explicit / (1.0 + step * 2.0 * compliance)
        np.testing.assert_allclose(result.alpha, np.array([-tau, tau]) / chain.inertia, rtol=1e-12)


@pytest.mark.parametrize(("n", "closed"), [(2, False), (7, False), (70, False), (3, True), (8, True), (70, True)])
@pytest.mark.parametrize("implicit_step", [0.0, 5e-3])
def test_every_body_satisfies_newton_and_euler(n, closed, implicit_step):
    _, rate, force_x, force_y, moment = random_state(n)
    chain, angle = make_ring(n) if closed else (make_chain(n), random_state(n)[0])
    result = reference_accelerations(chain, angle, rate, force_x, force_y, moment, implicit_step, closed)
    joints = n if closed else n - 1
    assert result.pin_force.shape == (joints, 2)
    force, torque = residual_forces(chain, angle, rate, force_x, force_y, moment, result, joints, implicit_step)
    size = max(1.0, np.abs(result.pin_force).max())
    np.testing.assert_allclose(force / size, 0.0, atol=1e-12)
    np.testing.assert_allclose(torque / size, 0.0, atol=1e-12)


def test_pin_accelerations_coincide_at_the_closing_joint():
    chain, angle = make_ring(12)
    _, rate, force_x, force_y, moment = random_state(12)
    result = reference_accelerations(chain, angle, rate, force_x, force_y, moment)
    _, _, pins, pin_accs = replay(chain, angle, rate, result)
    np.testing.assert_allclose(pins[-1], pins[0], atol=1e-14)
    np.testing.assert_allclose(pin_accs[-1], pin_accs[0], rtol=1e-11, atol=1e-11 * np.abs(pin_accs).max())


@pytest.mark.parametrize("closed", [False, True])
def test_momentum_changes_by_external_loads_only(closed):
    n = 9
    _, rate, force_x, force_y, moment = random_state(n)
    chain, angle = make_ring(n) if closed else (make_chain(n), random_state(n)[0])
    result = reference_accelerations(chain, angle, rate, force_x, force_y, moment, 2e-3, closed)
    centres, accs, *_ = replay(chain, angle, rate, result)
    momentum_rate = np.sum(chain.mass[:, None] * accs, axis=0)
    expected = [force_x.sum(), force_y.sum() - chain.mass.sum() * GRAVITY]
    np.testing.assert_allclose(momentum_rate, expected, rtol=1e-11)

    angular_rate = np.sum(
        chain.inertia * result.alpha + chain.mass * (centres[:, 0] * accs[:, 1] - centres[:, 1] * accs[:, 0])
    )
    weight = force_y - chain.mass * GRAVITY
    external = np.sum(moment + centres[:, 0] * weight - centres[:, 1] * force_x)
    assert angular_rate == pytest.approx(external, rel=1e-10)


def test_relaxed_regular_ring_is_at_rest_only_with_the_right_number_of_turns():
    n = 14
    chain = make_chain(n, stiffness=100.0, damping=0.0, free_angle=-2.0 * np.pi / n, gravity=0.0)
    chain = chain._replace(length=np.full(n, 0.1), com_x=np.full(n, 0.05))
    angle, zero = -2.0 * np.pi * np.arange(n) / n, np.zeros(n)
    result = reference_accelerations(chain, angle, zero, zero, zero, zero)
    np.testing.assert_allclose(result.alpha, 0.0, atol=1e-8)
    wrong = reference_accelerations(chain, angle, zero, zero, zero, zero, turns=0)
    assert np.abs(wrong.alpha).max() > 1e3
    mirrored = reference_accelerations(
        chain._replace(free_angle=2.0 * np.pi / n, com_y=-chain.com_y), -angle, zero, zero, zero, zero, turns=1
    )
    np.testing.assert_allclose(mirrored.alpha, 0.0, atol=1e-8)


def test_spinning_regular_ring_carries_the_centrifugal_tension():
    """A polygon of n equal bars spinning at w: pins carry m r_c w^2 / (2 sin(pi/n))."""
    n, side, mass, speed = 12, 0.1, 4.0, 6.0
    chain = make_chain(n, stiffness=0.0, damping=0.0, gravity=0.0)
    chain = chain._replace(
        length=np.full(n, side), mass=np.full(n, mass), inertia=np.full(n, 0.01), com_x=np.full(n, side / 2),
        com_y=np.zeros(n),
    )  # fmt: skip
    angle, zero = -2.0 * np.pi * np.arange(n) / n, np.zeros(n)
    result = reference_accelerations(chain, angle, np.full(n, speed), zero, zero, zero)
    centre_radius = side / (2.0 * np.tan(np.pi / n))
    tension = mass * centre_radius * speed**2 / (2.0 * np.sin(np.pi / n))
    np.testing.assert_allclose(np.hypot(*result.pin_force.T), tension, rtol=1e-11)
    np.testing.assert_allclose(result.alpha, 0.0, atol=1e-9)


def test_answer_does_not_depend_on_the_body_counted_first():
    """Bodies near their centres of percussion, where the plain transfer matrices lose all digits."""
    n = 70
    chain, angle = make_ring(n)
    a = 0.5 * chain.length
    chain = chain._replace(inertia=chain.mass * (0.999 * a) ** 2, com_y=np.zeros(n))
    _, rate, force_x, force_y, moment = random_state(n)
    first = reference_accelerations(chain, angle, rate, force_x, force_y, moment)
    # The same loop entered one body later is another elimination order and must give the same answer.
    rolled = Chain(*(np.roll(v, -1) if np.ndim(v) else v for v in chain))
    later = np.append(angle[1:], angle[0] - 2.0 * np.pi)
    second = reference_accelerations(rolled, later, *(np.roll(v, -1) for v in (rate, force_x, force_y, moment)))
    scale = np.abs(first.alpha).max()
    np.testing.assert_allclose(np.roll(second.alpha, 1) / scale, first.alpha / scale, atol=1e-12)


def test_solver_is_accurate_on_an_ill_conditioned_and_badly_scaled_system():
    """27720 times the Hilbert matrix of order six has whole entries, so that its right side is exact."""
    order = np.arange(6)
    matrix = np.rint(27720.0 / (order[:, None] + order + 1.0))
    scale = 2.0 ** np.array([0, 12, -9, 4, -15, 7])
    exact = np.array([3.0, -1.0, 4.0, 1.0, -5.0, 9.0])
    matrix_scaled = (matrix * scale * scale[:, None]).astype(np.longdouble)
    solution = _solve_symmetric(matrix_scaled, (scale * (matrix @ exact)).astype(np.longdouble))
    np.testing.assert_allclose((solution * scale).astype(float), exact, rtol=1e-12)


def test_wrong_input_is_refused():
    chain = make_chain(4)
    four, three = np.zeros(4), np.zeros(3)
    with pytest.raises(InputError, match=r"shapes .*\(3,\)"):
        reference_accelerations(chain, four, three, four, four, four)
    with pytest.raises(InputError, match="at least 3 bodies"):
        reference_accelerations(make_chain(2), *(np.zeros(2) for _ in range(5)))

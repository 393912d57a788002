"""The multiplier formulation against closed forms and conservation laws."""

import numpy as np
import pytest

from replication.study.extremes.reference import reference_accelerations
from tests.conftest import irregular_ring
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


def make_ring(n, **options):
    length, angle, _ = irregular_ring(n, np.random.default_rng(2), (0.9 * np.pi / n, 0.4 * np.pi / n))
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


def test_wrong_input_is_refused():
    chain = make_chain(4)
    four, three = np.zeros(4), np.zeros(3)
    with pytest.raises(InputError, match=r"shapes .*\(3,\)"):
        reference_accelerations(chain, four, three, four, four, four)
    with pytest.raises(InputError, match="at least 3 bodies"):
        reference_accelerations(make_chain(2), *(np.zeros(2) for _ in range(5)))

"""Normal and friction laws of one contact against closed forms."""

from math import pi, sqrt

import numpy as np
import pytest

from trackdyn.contact.laws import (
    elastic_force,
    force_and_slopes,
    friction_coefficient,
    implicit_speed,
    stored_impact_speed,
)
from trackdyn.rig.laws import delivered_restitution
from trackdyn.scene.build import make_law

STEEL = 1.154e11


def law(restitution=0.5, mu_s=0.15, mu_d=0.10, v_t=0.05, length=0.05, modulus=STEEL, limit=3.0):
    return make_law(length, modulus, restitution, mu_s, mu_d, v_t, 0.1, limit)


# --- friction, Eq. 10


@pytest.mark.parametrize(("mu_s", "mu_d", "v_t"), [(0.15, 0.10, 0.05), (0.5, 0.45, 0.1), (0.3, 0.0, 0.01)])
def test_friction_peaks_at_the_transition_velocity_with_the_static_coefficient(mu_s, mu_d, v_t):
    contact = law(mu_s=mu_s, mu_d=mu_d, v_t=v_t)
    # the term of the peak is exact at x = 1; tanh(4) lacks 6.7e-4 of 1
    assert friction_coefficient(contact, v_t) == pytest.approx(mu_s - mu_d * 6.71e-4, abs=1e-6)
    x = np.linspace(0.5, 2.0, 3001)
    mu = np.array([friction_coefficient(contact, v_t * value) for value in x])
    # tanh still rises by 5.4e-3 mu_d there, against a curvature of (mu_s - mu_d): a shift of that quotient
    shift = 5.4e-3 * mu_d / (mu_s - mu_d)
    assert x[mu.argmax()] == pytest.approx(1.0, abs=shift + 5e-4)
    assert mu.max() <= mu_s + 5.4e-3 * mu_d * shift


def test_friction_is_odd_and_tends_to_the_dynamic_coefficient():
    contact = law()
    for slip in np.geomspace(1e-9, 1e3, 40):
        assert friction_coefficient(contact, -slip) == -friction_coefficient(contact, slip)
    assert friction_coefficient(contact, 0.0) == 0.0
    # the peak's term falls as 16 (mu_s - mu_d) / x^3
    assert friction_coefficient(contact, 100 * 0.05) == pytest.approx(0.10, abs=1e-6)


def test_friction_has_the_slope_that_the_step_limit_assumes():
    contact = law()
    slip = 1e-9
    slope = (4 * 0.10 + 16 / 9 * 0.05) / 0.05
    # next term of the series: of the order of (slip / v_t)^2
    assert friction_coefficient(contact, slip) / slip == pytest.approx(slope, rel=1e-12)


def normal_force(*arguments):
    return force_and_slopes(*arguments)[0]


# --- normal force, Eq. 8


@pytest.mark.parametrize("depth", [1e-7, 1e-5, 1e-3])
@pytest.mark.parametrize("radius", [8e-4, 0.05, 0.3])
def test_elastic_force_is_equation_8(depth, radius):
    contact = law()
    expected = 0.5 * pi * 0.05 * STEEL * depth * sqrt(depth / (2 * (radius + depth)))
    assert elastic_force(contact, depth, radius)[0] == pytest.approx(expected, rel=1e-14)
    # at rest no damping; the factor is 1 + 3 (1 - c^2) / 4 at the initial impact velocity
    assert normal_force(contact, depth, 0.0, 0.3, radius) == pytest.approx(expected, rel=1e-14)
    assert normal_force(contact, depth, 0.3, 0.3, radius) == pytest.approx(1.5625 * expected, rel=1e-14)


def test_contact_never_pulls_and_its_factor_is_limited():
    contact = law(restitution=0.5, limit=2.0)
    depth, radius, impact = 1e-4, 0.05, 0.1
    elastic, _ = elastic_force(contact, depth, radius)
    for speed in np.linspace(-20, 20, 801):
        force = normal_force(contact, depth, speed, impact, radius)
        assert 0.0 <= force <= 2.0 * elastic
    assert normal_force(contact, depth, -10.0, impact, radius) == 0.0
    assert normal_force(contact, depth, 10.0, impact, radius) == 2.0 * elastic
    # inside of the limits the factor is linear in the velocity
    assert normal_force(contact, depth, -0.05, impact, radius) == pytest.approx((1 - 0.5625 / 2) * elastic, rel=1e-14)


@pytest.mark.parametrize("compliance", [1e-8, 1e-5, 1e-2])
def test_implicit_speed_is_that_under_its_own_force(compliance):
    contact = law(limit=1.4)
    clipped = set()
    for depth in (1e-7, 1e-5, 1e-3):
        elastic, _ = elastic_force(contact, depth, 0.05)
        for speed in np.linspace(-3.0, 3.0, 61):
            implicit = implicit_speed(contact, elastic, speed, 0.3, compliance)
            force = normal_force(contact, depth, implicit, 0.3, 0.05)
            # the sum of two numbers of the size of ``given * elastic`` and of the speed
            assert implicit + compliance * force == pytest.approx(
                speed, rel=1e-12, abs=1e-12 * (1 + compliance * elastic)
            )
            clipped.add((force == 0.0, force == pytest.approx(1.4 * elastic, rel=1e-12)))
    assert clipped == {(False, False), (True, False), (False, True)}


def impact_by_steps(contact, steps, impeded, mass=5.0, speed=0.35, radius=8e-4):
    """Mean peak (N) and rebound of a mass that meets a tooth, with velocities half a step behind; ``steps`` a
    contact.
    """
    deepest = (1.25 * mass * speed**2 * sqrt(radius) / contact.stiffness) ** 0.4
    h = 3.2 * deepest / speed / steps
    compliance, rebounds = 0.5 * h / mass, []
    for begin in (np.arange(10) + 0.5) / 10:  # how far into a step the mass touches
        depth, velocity, change, forces = -begin * h * speed, speed, 0.0, [0.0]
        for _ in range(2 * steps):
            depth += h * velocity
            force = 0.0
            if depth > 0:
                now = velocity + 0.5 * change
                if impeded:
                    elastic, _ = elastic_force(contact, depth, radius)
                    now = implicit_speed(contact, elastic, now + compliance * forces[-1], speed, compliance)
                force = normal_force(contact, depth, now, speed, radius)
            change = -h * force / mass
            velocity += change
            forces.append(force)
        k = int(np.argmax(forces))
        before, middle, after = forces[k - 1 : k + 2]
        rebounds.append((middle - (after - before) ** 2 / (8 * (before - 2 * middle + after)), -velocity / speed))
    return np.mean(rebounds, axis=0)


@pytest.mark.parametrize("restitution", [0.2, 0.5, 0.8])
def test_implicit_speed_keeps_restitution_and_peak_of_an_impact_of_eight_steps(restitution):
    """As many as `standard` has where an arc meets a tooth. Led by the last step alone the mass would lose too much."""
    contact = law(restitution)
    peak, rebound = impact_by_steps(contact, 2000, True)
    assert rebound == pytest.approx(delivered_restitution(contact.loss), abs=1e-5)
    led, impeded = (impact_by_steps(contact, 8, way) for way in (False, True))
    # second order, and next to nothing where the force ends as gently as it began
    assert impeded == pytest.approx([peak, rebound], rel=2e-2) and impeded[1] == pytest.approx(rebound, rel=1e-3)
    assert led[1] < rebound * (1 - 0.04 * contact.loss)


def test_initial_impact_velocity_is_kept_and_has_a_floor():
    assert stored_impact_speed(0.7, 0.2, 0.1) == 0.7
    assert stored_impact_speed(0.0, 0.2, 0.1) == 0.2
    assert stored_impact_speed(0.0, 0.02, 0.1) == 0.1
    # inside while already leaving: the magnitude
    assert stored_impact_speed(0.0, -0.3, 0.1) == 0.3


def test_composite_modulus_is_equation_9(rig):
    rig = rig.changed(steel__youngs_modulus=2.1e11, tooth_contact__youngs_modulus=2.1e11)
    assert rig.composite_modulus(rig.tooth_contact) == pytest.approx(2.1e11 / (2 * (1 - 0.3**2)), rel=1e-14)
    rubber = rig.changed(ring_contact__youngs_modulus=5e7, ring_contact__poisson_ratio=0.49)
    alone = 5e7 / (1 - 0.49**2)
    steel = 2.1e11 / (1 - 0.3**2)
    # steel is 3500 times stiffer and takes that share of the rubber's modulus away
    assert rubber.composite_modulus(rubber.ring_contact) == pytest.approx(alone / (1 + alone / steel), rel=1e-14)

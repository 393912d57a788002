"""Normal and friction laws of one contact against closed forms, and the restitution of each normal law."""

from itertools import product
from math import pi, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from trackdyn.contact import laws
from trackdyn.contact.laws import elastic_force, force_and_slopes, friction_coefficient, implicit_speed, wheel_law
from trackdyn.model.constants import SPROCKET
from trackdyn.rig.laws import NORMAL_LAWS, delivered_restitution, delivering_loss
from trackdyn.scene.build import make_law
from trackdyn.scene.scene import Scene

STEEL = 1.154e11


def law(normal_law="printed", restitution=0.5, mu_s=0.15, mu_d=0.10, v_t=0.05, limit=3.0):
    return make_law(0.05, STEEL, restitution, mu_s, mu_d, v_t, 0.1, limit, normal_law)


def normal_force(*arguments):
    return force_and_slopes(*arguments)[0]


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
    """Near 0 it has the slope that the step limit assumes; the next term is of the order of (slip / v_t)^2."""
    contact = law()
    assert friction_coefficient(contact, 1e-9) / 1e-9 == pytest.approx((4 * 0.10 + 16 / 9 * 0.05) / 0.05, rel=1e-12)
    # up to 80 transition velocities: from 89 on the exponential overflows, which is infinite only where it is compiled
    for slip in np.geomspace(1e-9, 80 * 0.05, 40):
        assert friction_coefficient(contact, -slip) == -friction_coefficient(contact, slip)
    assert friction_coefficient(contact, 0.0) == 0.0
    # the peak's term falls as 16 (mu_s - mu_d) / x^3
    assert friction_coefficient(contact, 80 * 0.05) - 0.10 == pytest.approx(16 * 0.05 / 80**3, rel=2e-3)


@pytest.mark.parametrize("depth", [1e-7, 1e-5, 1e-3])
@pytest.mark.parametrize("radius", [8e-4, 0.05, 0.3])
def test_elastic_force_is_equation_8(depth, radius):
    contact = law()
    expected = 0.5 * pi * 0.05 * STEEL * depth * sqrt(depth / (2 * (radius + depth)))
    assert elastic_force(contact, depth, radius)[0] == pytest.approx(expected, rel=1e-14)
    # at rest no damping; the factor is 1 + 3 (1 - c^2) / 4 at the initial impact velocity
    assert normal_force(contact, depth, 0.0, 0.3, radius) == pytest.approx(expected, rel=1e-14)
    assert normal_force(contact, depth, 0.3, 0.3, radius) == pytest.approx(1.5625 * expected, rel=1e-14)


@pytest.mark.parametrize("compliance", [1e-8, 1e-5, 1e-2])
def test_implicit_speed_is_that_under_its_own_force(compliance):
    contact, clipped = law(limit=1.4), set()
    for depth in (1e-7, 1e-5, 1e-3):
        elastic, _ = elastic_force(contact, depth, 0.05)
        for speed in np.linspace(-3.0, 3.0, 61):
            implicit = implicit_speed(contact, elastic, speed, 0.3, compliance)
            force = normal_force(contact, depth, implicit, 0.3, 0.05)
            rounding = 1e-12 * (1 + compliance * elastic)  # of the two terms
            assert implicit + compliance * force == pytest.approx(speed, rel=1e-12, abs=rounding)
            clipped.add((force == 0.0, force == pytest.approx(1.4 * elastic, rel=1e-12)))
    assert clipped == {(False, False), (True, False), (False, True)}


def impact_by_steps(contact, steps, impeded, mass=5.0, speed=0.35, radius=8e-4):
    """Return mean peak (N) and rebound of a mass on a tooth, ``steps`` a contact, velocities half a step behind."""
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
    """The steps of `standard` where an arc meets a tooth; by the last step's change only the mass loses too much."""
    contact = law(restitution=restitution)
    peak, rebound = impact_by_steps(contact, 2000, True)
    assert rebound == pytest.approx(delivered_restitution(contact.loss), abs=1e-5)
    led, impeded = (impact_by_steps(contact, 8, way) for way in (False, True))
    # second order, and next to nothing where the force ends as gently as it began
    assert impeded == pytest.approx([peak, rebound], rel=2e-2) and impeded[1] == pytest.approx(rebound, rel=1e-3)
    assert led[1] < rebound * (1 - 0.04 * contact.loss)


def test_initial_impact_velocity_is_stored_and_has_a_floor():
    cases = {(0.7, 0.2): 0.7, (0.0, 0.2): 0.2, (0.0, 0.02): 0.1, (0.0, -0.3): 0.3}  # the last one already opens
    assert {case: laws.stored_impact_speed(*case, 0.1) for case in cases} == cases


def test_composite_modulus_is_equation_9(rig):
    rig = rig.changed(steel__youngs_modulus=2.1e11, tooth_contact__youngs_modulus=2.1e11)
    assert rig.composite_modulus(rig.tooth_contact) == pytest.approx(2.1e11 / (2 * (1 - 0.3**2)), rel=1e-14)
    rubber = rig.changed(ring_contact__youngs_modulus=5e7, ring_contact__poisson_ratio=0.49)
    soft, steel = 5e7 / (1 - 0.49**2), 2.1e11 / (1 - 0.3**2)
    # steel is 3500 times stiffer and takes that share of the rubber's modulus away
    assert rubber.composite_modulus(rubber.ring_contact) == pytest.approx(soft / (1 + soft / steel), rel=1e-14)


@pytest.mark.parametrize("restitution", [0.01, 0.05, 0.2, 0.5, 0.8, 0.95, 0.999, 0.9999, 0.99990001, 0.99999, 1.0])
def test_the_delivering_factor_is_the_inverse_of_the_delivered_restitution(restitution):
    # the root is exact to 2e-12; near 1 the equation keeps 1e-16 / (1 - c_r)^2 of its digits, a series takes over
    assert delivered_restitution(delivering_loss(restitution)) == pytest.approx(restitution, abs=1e-11)


def rebound(contact, mass=2.5, speed=0.5, radius=0.05):
    """Return the quotient of the velocities after and before the impact of a mass on a surface at rest."""

    def rates(_, y):
        # stages may look a rounding outside of the surface, where there is no force
        return [y[1], -normal_force(contact, y[0], y[1], speed, radius) / mass if y[0] > 0.0 else 0.0]

    def left(_, y):
        return y[0]

    left.terminal, left.direction = True, -1
    deepest = (1.25 * mass * speed**2 * np.sqrt(radius) / contact.stiffness) ** 0.4
    # a heavily damped mass creeps out at a hundredth of its speed
    span, tolerances = (0.0, 1000 * deepest / speed), {"rtol": 1e-9, "atol": [1e-9 * deepest, 1e-9 * speed]}
    end = solve_ivp(rates, span, [0.0, speed], events=left, method="LSODA", **tolerances)
    assert end.t_events[0].size == 1, "the mass did not leave"
    return -end.y_events[0][0][1] / speed


@pytest.mark.parametrize(
    ("normal_law", "restitution"),
    [("delivered", 0.05), ("delivered", 0.5), ("delivered", 0.99), ("printed", 0.01), ("printed", 0.9), ("elastic", 1)],
)
def test_an_impact_delivers_the_restitution_of_the_law(normal_law, restitution):
    """At 0.05 chi is 20 and the bracket of Eq. 8 would be clipped; the printed chi, at most 3/4, delivers 0.664."""
    contact = law(normal_law, restitution)
    expected = delivered_restitution(contact.loss) if normal_law == "printed" else restitution
    assert rebound(contact) == pytest.approx(expected, abs=1e-3)
    assert expected > 0.66 or normal_law == "delivered"
    assert normal_law != "delivered" or contact.factor_limit >= 1 + contact.loss
    assert contact.loss > 0 or normal_law == "elastic"


@pytest.mark.parametrize("normal_law", NORMAL_LAWS)
@pytest.mark.parametrize("radius", [8e-4, 0.05, 0.3])
def test_slopes_are_those_of_the_force(normal_law, radius):
    contact = law(normal_law, 0.3, limit=1.4)
    impact, zones = 0.2, set()
    for depth, speed in product((1e-6, 1e-4, 3e-3), (-3.0, -0.2, -0.05, 0.0, 0.05, 0.19, 3.0)):
        _, stiffness, damping = force_and_slopes(contact, depth, speed, impact, radius)
        deeper, shallower, faster, slower = (
            normal_force(contact, depth + a, speed + b, impact, radius)
            for a, b in ((1e-5 * depth, 0), (-1e-5 * depth, 0), (0, 1e-5), (0, -1e-5))
        )
        size = max(normal_force(contact, depth, 0.0, impact, radius), deeper)
        # second-order differences over 1e-5 of the depth, rounding of the force over them
        assert stiffness == pytest.approx((deeper - shallower) / (2e-5 * depth), abs=1e-8 * size / depth)
        assert damping == pytest.approx((faster - slower) / 2e-5, abs=1e-8 * size / impact)
        bracket = 1 + contact.loss * speed / impact
        zones.add("pulls" if bracket < 0 else "limited" if bracket > contact.factor_limit else "free")
        assert (damping > 0) == (zones == {"free"} or 0 < bracket < contact.factor_limit) or contact.loss == 0
    # the delivered law cannot be limited at its impact velocity, but beyond it
    assert zones == ({"free"} if normal_law == "elastic" else {"pulls", "free", "limited"})


@pytest.mark.parametrize("friction", ["tangential", "none"])
@pytest.mark.parametrize("normal_law", NORMAL_LAWS)
def test_a_scene_uses_the_laws_that_it_names(rig, normal_law, friction):
    model = Scene(rig, 115.0, normal_law=normal_law, friction=friction).model
    contacts = model.tooth.law, wheel_law(model.wheels, SPROCKET), wheel_law(model.wheels, 1)
    for contact, surface in zip(contacts, (rig.tooth_contact, rig.ring_contact, rig.wheel_contact), strict=True):
        c = surface.restitution
        expected = {"printed": 0.75 * (1 - c**2), "delivered": delivering_loss(c), "elastic": 0.0}[normal_law]
        assert contact.loss == pytest.approx(expected, rel=1e-14)
        for slip in (-10.0, -1e-3, 1e-9, 0.05, 3.0):  # no friction is exactly none
            assert (friction_coefficient(contact, slip) == 0.0) == (friction == "none")

"""The choice of the normal law: what each delivers in an impact, and its slopes."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from trackdyn.contact.laws import force_and_slopes, friction_coefficient, wheel_law
from trackdyn.model.constants import SPROCKET
from trackdyn.rig.laws import NORMAL_LAWS, delivered_restitution, delivering_loss
from trackdyn.scene.build import make_law
from trackdyn.scene.scene import Scene

STEEL = 1.154e11
RADIUS, MASS, SPEED = 0.05, 2.5, 0.5
RESTITUTIONS = [0.01, 0.02, 0.03, 0.05, 0.2, 0.5, 0.8, 0.95, 0.999, 0.9999, 0.99999]


def normal_force(*arguments):
    return force_and_slopes(*arguments)[0]


def law(normal_law, restitution=0.5, limit=3.0):
    return make_law(0.05, STEEL, restitution, 0.15, 0.10, 0.05, 0.1, limit, normal_law)


@pytest.mark.parametrize("restitution", RESTITUTIONS)
def test_the_delivering_factor_is_the_inverse_of_what_a_factor_delivers(restitution):
    # the root is exact to 2e-12; near 1 the equation keeps 1e-16 / (1 - c_r)^2 of its digits, a series takes over
    assert delivered_restitution(delivering_loss(restitution)) == pytest.approx(restitution, abs=1e-11)


def test_a_factor_and_what_it_delivers_fall_together():
    """Monotonous through the change to the series and through the range where chi e rounds to 1."""
    loss = np.array([delivering_loss(e) for e in [*RESTITUTIONS, 0.99989999, 0.99990001, 1.0]])
    order = np.argsort([*RESTITUTIONS, 0.99989999, 0.99990001, 1.0])
    assert (np.diff(loss[order]) < 0).all()
    assert loss[-1] == 0.0 and delivered_restitution(0.0) == 1.0
    # small losses: 1 - e = 2 chi / 3; large ones: e = 1 / chi
    assert delivering_loss(1 - 1e-6) == pytest.approx(1.5e-6, rel=2e-6)
    assert delivering_loss(0.01) == pytest.approx(100.0, rel=1e-12)


def rebound(contact):
    """Quotient of the velocities after and before the impact of a mass on a surface at rest."""

    def rates(_, y):
        # stages may look a rounding outside of the surface
        return [y[1], -normal_force(contact, max(y[0], 0.0), y[1], SPEED, RADIUS) / MASS]

    def left(_, y):
        return y[0]

    left.terminal, left.direction = True, -1
    deepest = (1.25 * MASS * SPEED**2 * np.sqrt(RADIUS) / contact.stiffness) ** 0.4
    # a heavily damped mass creeps out at a hundredth of its speed
    end = solve_ivp(
        rates, (0.0, 1000 * deepest / SPEED), [0.0, SPEED], events=left, method="LSODA",
        rtol=1e-9, atol=[1e-9 * deepest, 1e-9 * SPEED],
    )  # fmt: skip
    assert end.t_events[0].size == 1, "the mass did not leave"
    return -end.y_events[0][0][1] / SPEED


@pytest.mark.parametrize("restitution", [0.05, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99])
def test_delivered_law_delivers_the_restitution_it_is_named_after(restitution):
    """Down to 0.05, where chi is 20 and the bracket of Eq. 8 would be clipped long before."""
    contact = law("delivered", restitution)
    assert contact.factor_limit >= 1 + contact.loss
    assert rebound(contact) == pytest.approx(restitution, abs=1e-3)


@pytest.mark.parametrize("normal_law", NORMAL_LAWS)
@pytest.mark.parametrize("radius", [8e-4, 0.05, 0.3])
def test_slopes_are_those_of_the_force(normal_law, radius):
    """Central differences, also where the bracket is clipped at 0 and at its limit: no slope with the velocity
    there.
    """
    contact = law(normal_law, 0.3, limit=1.4)
    impact, zones = 0.2, set()
    for depth in (1e-6, 1e-4, 3e-3):
        for speed in (-3.0, -0.2, -0.05, 0.0, 0.05, 0.19, 3.0):
            _, stiffness, damping = force_and_slopes(contact, depth, speed, impact, radius)
            force = [
                normal_force(contact, depth + a, speed + b, impact, radius)
                for a, b in ((1e-5 * depth, 0), (-1e-5 * depth, 0), (0, 1e-5), (0, -1e-5))
            ]
            size = max(normal_force(contact, depth, 0.0, impact, radius), force[0])
            # second-order differences over 1e-5 of the depth, rounding of the force over them
            assert stiffness == pytest.approx((force[0] - force[1]) / (2e-5 * depth), abs=1e-8 * size / depth)
            assert damping == pytest.approx((force[2] - force[3]) / 2e-5, abs=1e-8 * size / impact)
            bracket = 1 + contact.loss * speed / impact
            zones.add("pulls" if bracket < 0 else "limited" if bracket > contact.factor_limit else "free")
            assert (damping > 0) == (zones == {"free"} or 0 < bracket < contact.factor_limit) or contact.loss == 0
    # the delivered law cannot be limited at its impact velocity, but beyond it
    assert zones == ({"free"} if normal_law == "elastic" else {"pulls", "free", "limited"})


def test_no_friction_is_exactly_none(rig):
    model = Scene(rig, 115.0, friction="none").model
    for contact in (model.tooth.law, *(wheel_law(model.wheels, wheel) for wheel in range(len(model.wheels.x)))):
        assert contact.friction_static == contact.friction_dynamic == 0.0
        for slip in (-10.0, -1e-3, 0.0, 1e-9, 0.05, 3.0):
            assert friction_coefficient(contact, slip) == 0.0
    model = Scene(rig, 115.0).model
    assert friction_coefficient(wheel_law(model.wheels, 1), 0.05) > 0.1


@pytest.mark.parametrize("normal_law", NORMAL_LAWS)
def test_a_scene_uses_the_law_that_it_names(rig, normal_law):
    model = Scene(rig, 115.0, normal_law=normal_law).model
    laws = (
        (model.tooth.law, rig.tooth_contact),
        (wheel_law(model.wheels, SPROCKET), rig.ring_contact),
        (wheel_law(model.wheels, 1), rig.wheel_contact),
    )
    for law_of, surface in laws:
        expected = {
            "printed": 0.75 * (1 - surface.restitution**2),
            "delivered": delivering_loss(surface.restitution),
            "elastic": 0.0,
        }[normal_law]
        assert law_of.loss == pytest.approx(expected, rel=1e-14)


def test_elastic_law_returns_all():
    contact = law("elastic", 0.3)
    assert contact.loss == 0.0
    assert rebound(contact) == pytest.approx(1.0, abs=1e-6)  # tolerance of the integration
    for speed in (-3.0, 0.0, 3.0):
        assert normal_force(contact, 1e-4, speed, 0.1, RADIUS) == normal_force(contact, 1e-4, 0.0, 0.1, RADIUS)


@pytest.mark.parametrize("restitution", [0.01, 0.05, 0.5, 0.9])
def test_printed_law_delivers_two_thirds_or_more(restitution):
    """chi is at most 3/4, which delivers 0.664 (the root of its own equation) however small the name."""
    delivered = delivered_restitution(0.75 * (1 - restitution**2))
    assert rebound(law("printed", restitution)) == pytest.approx(delivered, abs=1e-3) and delivered > 0.66

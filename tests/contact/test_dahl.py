"""Dahl's law of friction: closed form, energy, step, refusals."""

import numpy as np
import pytest

from tests.conftest import recorded, refused, written
from tests.kinematics import ContactList, without_extrapolation
from trackdyn import Scene, load_rig
from trackdyn.contact.laws import sheared
from trackdyn.integrate.run import refresh
from trackdyn.model.arrays import ENERGY_NAMES, RING
from trackdyn.model.constants import SPROCKET
from trackdyn.scene.build import make_law
from trackdyn.scene.step import step_limits
from trackdyn.simulation.energy_balance import energy_residual

STIFFNESS, MU, NORMAL = 5e4, 0.3, 800.0  # N/m, 1, N
SLIDING = MU * NORMAL  # N
LIMIT = SLIDING / STIFFNESS  # m
DAHL = {"ring_contact__friction_law": "dahl", "ring_contact__shear_stiffness": STIFFNESS}


@pytest.fixture(scope="module")
def law():
    return make_law(0.25, 5e7, 0.5, MU, 0.2, 0.1, 0.1, 3.0, shear_stiffness=STIFFNESS)


def pushed(law, distance, shear=0.0, steps=50):
    """Return the displacement after a push of a link along a surface, and its work (J), by trapezia."""
    work = 0.0
    for _ in range(steps):
        before, (shear, _) = shear, sheared(law, shear, distance / steps / 1e-3, NORMAL, 1e-3)
        work += 0.5 * STIFFNESS * (before + shear) * distance / steps
    return shear, work


@pytest.mark.parametrize("steps", [1, 7, 300])
def test_push_and_reversal_follow_the_closed_form_in_any_number_of_steps(law, steps):
    """F = mu N (1 - exp(-x / d)) with d = mu N / k; pushed back, F = -mu N + (mu N + F_0) exp(-y / d)."""
    there, _ = pushed(law, 1.5 * LIMIT, steps=steps)
    assert there * STIFFNESS == pytest.approx(SLIDING * (1 - np.exp(-1.5)), rel=1e-12)
    back, _ = pushed(law, -0.4 * LIMIT, there, steps=steps)
    assert back * STIFFNESS == pytest.approx(-SLIDING + (SLIDING + there * STIFFNESS) * np.exp(-0.4), rel=1e-12)
    far, _ = pushed(law, -60 * LIMIT, back, steps=steps)
    assert far * STIFFNESS == pytest.approx(-SLIDING, rel=1e-12)  # the plateau
    # a smaller normal force lets go, and none holds nothing
    assert sheared(law, far, 0.0, NORMAL / 4, 1e-3)[0] == pytest.approx(far / 4, rel=1e-12)
    assert sheared(law, far, 0.3, 0.0, 1e-3) == (0.0, 0.0)


def test_cycle_loses_the_area_of_its_loop(law):
    """4 mu N (X - d tanh(X / d)) in a cycle of amplitude X; trapezia of 1/2000 d are within 1e-6 of it."""
    amplitude, work = 2.0 * LIMIT, []
    shear, _ = pushed(law, amplitude)
    for distance in 3 * (-2 * amplitude, 2 * amplitude):  # the first cycle is not yet periodic
        shear, taken = pushed(law, distance, shear, steps=8000)
        work.append(taken)
    assert sum(work[4:]) == pytest.approx(4 * SLIDING * (amplitude - LIMIT * np.tanh(amplitude / LIMIT)), rel=1e-6)


@pytest.mark.parametrize("slip", [0.8, -0.8])
@pytest.mark.parametrize("shear", [0.0, 0.6 * LIMIT, -0.9 * LIMIT])
def test_slope_with_the_slip_is_that_of_the_displacement(law, shear, slip):
    higher, lower = (sheared(law, shear, slip + d, NORMAL, 1e-3)[0] for d in (1e-6, -1e-6))
    # central differences: rounding of 1e-16 / 1e-6 on slopes of 1e-4 to 1e-3
    assert sheared(law, shear, slip, NORMAL, 1e-3)[1] == pytest.approx((higher - lower) / 2e-6, rel=1e-5)


def test_links_on_a_ring_follow_the_closed_form_from_step_to_step(driven_loop):
    model, state, work, _ = driven_loop(0.308).arrays
    law = model.wheels.law[SPROCKET : SPROCKET + 1]
    law["shear_stiffness"], law["friction_static"] = STIFFNESS, MU
    for rates in (state.rate, state.pin[2:], state.shear):
        rates[:] = 0.0
    state.wheel_rate[SPROCKET] = -15.0
    model = without_extrapolation(model, work)
    begin = state.steps[0]
    for step in range(60):
        state.steps[0] = begin + step
        refresh(model, state, work)
        touched = ContactList(work, kinds=(RING,))
        surface, limit = touched.rows["rate"][:, None] * touched.surface, MU * touched.force
        expected = limit * -np.expm1(-STIFFNESS * np.hypot(*surface.T) * step * model.step / limit)
        # carried along by the surface; its speed along the tangent is all of it but for the tilt of the point, 1e-4
        along = (touched.friction * surface).sum(axis=1)
        np.testing.assert_allclose(along, expected * np.hypot(*surface.T), rtol=1e-3)
    assert len(limit) > 3 and (expected > 0.3 * limit).all()


@pytest.mark.parametrize("integrator", ["semi_implicit", "linearly_implicit"])
def test_energy_balance_closes_with_the_step_and_nothing_is_given_back(make_scene, rig, integrator):
    opened = []
    for step in (1e-4, 5e-5):
        scene = Scene(
            rig.changed(**DAHL, ring_contact__friction_static=MU, ring_contact__friction_dynamic=0.2), 210.0,
            ring_radius=0.308, duration=1.5, lead_in=0.5, ramp=0.4, step=step, integrator=integrator,
        )  # fmt: skip
        recording = recorded(scene)
        change = np.diff(recording.energy[[0, -1]], axis=0)[0]
        assert abs(energy_residual(recording)) < 1e-3 if integrator == "semi_implicit" else True
        opened.append(change[0] - change[1:].sum())
        lost = np.diff(recording.energy[:, ENERGY_NAMES.index("ring_friction")])
        assert lost.min() > -0.02 * lost.max() and lost.sum() > 0
        normal, tangential = recording.ring_force.T
        # the law bounds the force of each link, so also their sums
        assert (tangential <= MU * normal * (1 + 1e-9)).all() and tangential.mean() > 0.01 * normal.mean()
    assert opened[1] == pytest.approx(opened[0] / 2, rel=0.1)


def test_law_without_a_stiffness_on_a_tooth_or_in_a_method_without_its_state_is_refused(rig, tmp_path):
    refused(rig.changed, words=["ring_contact.shear_stiffness is missing", "N/m"], ring_contact__friction_law="dahl")
    tooth = {"tooth_contact__friction_law": "dahl", "tooth_contact__shear_stiffness": 1e5}
    refused(rig.changed, words=["tooth_contact.friction_law = dahl", "regularised"], **tooth)
    dahl = rig.changed(**DAHL)
    refused(dahl.changed, words=["ring_contact.shear_stiffness = -1"], ring_contact__shear_stiffness=-1.0)
    refused(rig.changed, words=["ring_contact.friction_law", "dahl"], ring_contact__friction_law="dhal")
    scene = {"rig": dahl, "motor_rpm": 115.0, "integrator": "rk4"}
    refused(Scene, words=["integrator = 'rk4'", "ring_contact.friction_law is dahl"], **scene)
    Scene(friction="none", **scene)  # no law is asked for
    own = "ring_contact: {source: a test, friction_law: dahl, shear_stiffness: 30000 N/m}"
    assert load_rig(written(tmp_path / "a.yaml", f"like: bench\n{own}\n")).ring_contact.shear_stiffness == 30_000.0
    # values that a law does not read are listed
    assert {"ring_contact.transition_velocity", "ring_contact.friction_dynamic"} <= set(dahl.without_effect)
    assert "ring_contact.shear_stiffness" in dahl.changed(ring_contact__friction_law="regularised").without_effect


def test_shear_stiffness_limits_the_step(rig):
    scene = Scene(rig.changed(**(DAHL | {"ring_contact__shear_stiffness": 1e9})), 115.0, ring_radius=0.308)
    limit = step_limits(scene.model_of_step(1e-5), 3000.0)["shear stiffness of the ring contact"]
    assert limit == pytest.approx(2 * np.sqrt(rig.chain.link_mass / 1e9), rel=1e-12)  # a link on such a spring

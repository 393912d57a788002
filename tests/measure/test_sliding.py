"""The sliding work of a run against Eq. 10 written anew, and its share per turn of the sprocket."""

import numpy as np
import pytest

from tests.kinematics import ContactList
from trackdyn import Loop, Scene, load_rig
from trackdyn.contact.laws import wheel_law
from trackdyn.measure.metrics import run_metrics
from trackdyn.model.arrays import ENERGY_NAMES, FLANK, RING
from trackdyn.simulation.simulate import simulate

RIG = load_rig("bench")


def coulomb(law, slip):
    """Eq. 10 from the paper's text: ``mu_d tanh(4 x) + (mu_s - mu_d) x / (x^2 / 4 + 3 / 4)^2``, x the slip over v_t."""
    x, extra = slip / law.transition_velocity, law.friction_static - law.friction_dynamic
    return law.friction_dynamic * np.tanh(4 * x) + extra * x / (x**2 / 4 + 0.75) ** 2


def test_it_is_normal_force_times_friction_times_slip():
    """Summed from the contact list at both ends of every step; a step of 1e-5 s leaves 1 % to the path in between."""
    loop = Loop(Scene(RIG, 115, 0.305, ramp=0.5, step=1e-5))
    loop.advance(1.0)
    wheels, power, steps = loop.model.wheels, np.zeros(3), 1500
    before = loop.energy
    for k in range(steps + 1):
        row = ContactList(loop.work)
        slip = np.linalg.det(np.stack([row.normal, row.slip], axis=1)) / np.maximum(row.force, 1e-12)
        surface = np.where(row.kind == FLANK, 0, np.where(row.kind == RING, 1, 2))
        laws = [(loop.model.tooth.law, wheel_law(wheels, 0), wheel_law(wheels, 1))[i] for i in surface]
        work = [abs(float(coulomb(law, v)) * v) for law, v in zip(laws, slip, strict=True)]
        power += np.bincount(surface, (0.5 if k in (0, steps) else 1.0) * row.force * work, 3)
        if k < steps:
            loop.step()
    change = [loop.energy[name] - before[name] for name in ("tooth_friction", "ring_friction", "wheel_friction")]
    assert min(change) > 0
    np.testing.assert_allclose(change, 1e-5 * power, rtol=0.01, atol=1e-3 * max(change))


@pytest.mark.parametrize(("integrator", "step"), [("semi_implicit", None), ("rk4", 5e-5)])
def test_a_turn_takes_its_share_of_the_work_of_a_record(integrator, step):
    """Whole passages count, which leave at most two of twenty out."""
    run = simulate(Scene(RIG, 115, 0.305, lead_in=0.5, duration=4.6, integrator=integrator, step=step))
    row = run_metrics("", run)
    for surface, name in (("teeth", "tooth_friction"), ("ring", "ring_friction")):
        change = np.ptp(run.energy[:, ENERGY_NAMES.index(name)])
        assert row[f"{surface}_sliding_j"] == pytest.approx(change / run.seconds * run.periods.turn, rel=0.05)
        assert 0 < row[f"{surface}_sliding_error_j"] < 0.05 * row[f"{surface}_sliding_j"]
    power = np.ptp(run.energy[:, ENERGY_NAMES.index("sprocket_work")]) / run.seconds
    assert row["motor_power_w"] == pytest.approx(power, rel=0.05) and 0 < row["motor_power_error_w"] < 0.05 * power


def test_without_a_ring_none_slides_on_it_and_a_record_shorter_than_a_passage_has_no_sliding_work():
    bare, short = (
        run_metrics("", simulate(Scene(RIG, 115, ring, lead_in=0.5, duration=duration)))
        for ring, duration in ((None, 4.6), (0.305, 0.2))
    )
    assert bare["ring_sliding_j"] == 0.0 < bare["teeth_sliding_j"]
    assert np.isnan([short[name] for name in ("teeth_sliding_j", "ring_sliding_error_j", "motor_power_w")]).all()

"""Mobilised friction of the ring: tangential over normal force of the links on it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import recorded
from tests.kinematics import ContactList, without_extrapolation
from trackdyn.integrate.run import refresh
from trackdyn.measure.metrics import run_metrics
from trackdyn.measure.whole_loop import mobilised_friction
from trackdyn.model.arrays import FLANK, RING
from trackdyn.model.constants import SPROCKET


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("multiple", [1.0, 3.0])
def test_constant_slip_mobilises_the_coefficient_of_eq_10(driven_loop, multiple, direction):
    """Eq. 10 at v_t: mu_d tanh 4 + mu_s - mu_d; at three times that x / q^2 is 1/3."""
    loop = driven_loop(0.308)
    model, state, work, _ = loop.arrays
    law = model.wheels.law[SPROCKET]
    law["friction_static"], law["friction_dynamic"] = 0.5, 0.2
    state.rate[:] = 0.0  # the chain held still over a ring whose surface moves
    state.pin[2:] = 0.0
    state.wheel_rate[SPROCKET] = direction * multiple * law["transition_velocity"] / model.wheels.radius[SPROCKET]
    refresh(without_extrapolation(model, work), state, work)
    ring = ContactList(work, kinds=[RING])
    expected = 0.2 * np.tanh(4.0 * multiple) + 0.3 * {1.0: 1.0, 3.0: 1.0 / 3.0}[multiple]
    # links touch less than 2 mm of 308 below the surface: a slip up to 0.65 % lower, a coefficient up to 0.45 % higher
    friction = np.linalg.norm(ring.friction, axis=1).sum() / ring.force.sum()
    assert len(ring.rows) > 3 and friction == pytest.approx(expected, rel=5e-3)


def test_recorded_forces_are_the_sums_over_the_links_on_the_ring(make_scene, driven_loop):
    """At the last sample, from the contact list; arcs on the teeth do not count."""
    loop = driven_loop(0.308)
    recording = loop.record(0.5)
    teeth, ring = (ContactList(loop.arrays.work, kinds=[kind]) for kind in (FLANK, RING))
    sums = [np.linalg.norm(force, axis=1).sum() for force in (ring.normal, ring.friction)]
    np.testing.assert_allclose(recording.ring_force[-1], sums, rtol=1e-9)
    assert len(teeth.rows) and not recorded(make_scene(ring_radius=None)).ring_force.any()


def test_ratio_is_of_integrals_not_of_instants(driven_loop):
    """A force that is ten times larger for half of the time weighs ten times as much."""
    recording = driven_loop(0.308).record(3.0)
    forces = np.tile([[100.0, 20.0], [10.0, 5.0]], (len(recording.ring_force) // 2, 1))
    estimate = mobilised_friction(replace(recording, ring_force=forces))
    # odd numbers of samples in a passage: one sample of 223 more of either
    assert estimate.value == pytest.approx(25 / 110, rel=0.01) and estimate.error < 0.01 * estimate.value
    row = run_metrics("some", replace(recording, ring_force=0.0 * forces))
    assert np.isnan(row["mobilised_friction"])  # a ring that carries nothing


def test_running_loop_uses_less_than_its_static_friction(driven_loop):
    """Slips of a few percent of v_t use a part of the friction, and all of it where v_t is far below them."""
    loop, gripping = driven_loop(0.308), driven_loop(0.308)
    for each, velocity in ((loop, 10.0), (gripping, 1e-3)):
        each.arrays.model.wheels.law["transition_velocity"][SPROCKET] = velocity
    static = loop.arrays.model.wheels.law["friction_static"][SPROCKET]
    low, high = (mobilised_friction(each.record(1.0)).value for each in (loop, gripping))
    assert 0.0 < low < 0.05 * static and 0.5 * static < high <= 1.1 * static

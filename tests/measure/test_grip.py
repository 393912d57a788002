"""Mobilised friction of the ring: tangential over normal force of the links on it."""

import numpy as np
import pytest

from tests.conftest import refused
from tests.kinematics import without_extrapolation
from trackdyn.integrate.run import refresh
from trackdyn.measure.grip import mobilised_friction
from trackdyn.model.arrays import FLANK, RING
from trackdyn.model.constants import SPROCKET


@pytest.fixture
def sliding_loop(driven_loop, monkeypatch):
    """Function that holds the chain of a loop still over a ring whose surface moves at a multiple of v_t."""

    def make(multiple, friction_static, friction_dynamic):
        loop = driven_loop(0.308)
        model, state, work, _ = loop.arrays
        law = model.wheels.law[SPROCKET]
        law["friction_static"], law["friction_dynamic"] = friction_static, friction_dynamic
        state.rate[:] = 0.0
        state.pin[2:] = 0.0
        state.wheel_rate[SPROCKET] = multiple * law["transition_velocity"] / model.wheels.radius[SPROCKET]
        model = without_extrapolation(model, work)
        monkeypatch.setattr(loop, "step", lambda count: refresh(model, state, work), raising=False)
        return loop

    return make


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("multiple", [1.0, 3.0])
def test_constant_slip_mobilises_the_coefficient_of_eq_10(sliding_loop, multiple, direction):
    """Eq. 10 at v_t: mu_d tanh 4 + mu_s - mu_d; at three times that x / q^2 is 1/3, and tanh 12 is 1 to 1e-10.

    The links touch below the surface of the ring, less than 2 mm of 308: their slip is lower by 0.65 % at most, and the
    coefficient at three times v_t, whose slope is 0.22 of mu_s - mu_d there, higher by 0.45 %.
    """
    loop = sliding_loop(direction * multiple, 0.5, 0.2)
    expected = 0.2 * np.tanh(4.0 * multiple) + 0.3 * {1.0: 1.0, 3.0: 1.0 / 3.0}[multiple]
    rows = loop.arrays.work.contact
    assert mobilised_friction(loop, 2).value == pytest.approx(expected, rel=5e-3)
    kinds = rows[: loop.arrays.work.count[0]]["kind"]
    assert (kinds == RING).sum() > 3 and (kinds == FLANK).any()  # what else touches does not count


def test_ratio_is_of_integrals_not_of_instants(driven_loop, monkeypatch):
    """A force that is ten times larger for half of the time weighs ten times as much, whichever way it points."""
    loop = driven_loop(0.308)
    work, calls = loop.arrays.work, []

    def step(count):
        calls.append(count)
        heavy = len(calls) % 2
        work.count[0] = 2
        work.contact[:2] = np.zeros(2, work.contact.dtype)
        work.contact["kind"][:2], work.contact["normal_y"][0] = (RING, FLANK), 100.0 if heavy else 10.0
        work.contact["friction_x"][0] = -20.0 if heavy else 5.0
        work.contact["normal_x"][1] = work.contact["friction_y"][1] = 1e4

    monkeypatch.setattr(loop, "step", step, raising=False)
    estimate = mobilised_friction(loop, 12)
    scene = loop.scene
    assert len(calls) == round(12 * scene.periods.passage * scene.rig.rate)
    # odd numbers of samples in a passage: one sample of 223 more of either
    assert estimate.value == pytest.approx(25 / 110, rel=0.01) and estimate.error < 0.01 * estimate.value


def test_running_loop_uses_less_than_its_static_friction(driven_loop):
    """Slips of a few percent of v_t use a part of the friction, and all of it where v_t is far below them."""
    loop, gripping = driven_loop(0.308), driven_loop(0.308)
    for one, velocity in ((loop, 10.0), (gripping, 1e-3)):
        one.arrays.model.wheels.law["transition_velocity"][SPROCKET] = velocity
    static = loop.arrays.model.wheels.law["friction_static"][SPROCKET]
    low, high = (mobilised_friction(one, 3).value for one in (loop, gripping))
    assert 0.0 < low < 0.05 * static and 0.5 * static < high <= 1.1 * static


def test_scene_without_ring_is_refused(driven_loop):
    refused(mobilised_friction, driven_loop(None), words=["ring_radius = None", "set ring_radius"])


def test_ring_that_carries_nothing_has_no_mobilised_friction(driven_loop, monkeypatch):
    loop = driven_loop(0.308)
    loop.arrays.work.count[0] = 0
    monkeypatch.setattr(loop, "step", lambda count: None, raising=False)
    assert np.isnan(mobilised_friction(loop, 2).value)

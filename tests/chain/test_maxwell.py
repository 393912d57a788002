"""Maxwell elements of the bushings: loss of a sinusoid, exact step, energy balance of whole loops."""

import numpy as np
import pytest

from tests.conftest import refused
from tests.kinematics import spinning_loop
from trackdyn.chain.kinematics import add_maxwell_moments, advance_maxwell, maxwell_energy
from trackdyn.model.arrays import BUSHING_LOSS
from trackdyn.model.constants import Maxwell
from trackdyn.rig.laws import BAND, maxwell_elements
from trackdyn.scene.step import step_limits
from trackdyn.simulation.energy_balance import open_share
from trackdyn.simulation.loop import Loop

RIPPLE = 0.07  # of the loss factor (0.05 to 0.3), by which the elements miss it within the band


def moduli(share, time, frequency):
    """Return storage and loss modulus over the stiffness at rest."""
    x = 2 * np.pi * np.asarray(frequency)[:, None] * time
    return 1 + (share * x**2 / (1 + x**2)).sum(axis=1), (share * x / (1 + x**2)).sum(axis=1)


@pytest.mark.parametrize("loss_factor", [0.05, 0.15, 0.3])
def test_elements_have_the_loss_factor_over_the_band(loss_factor):
    assert (maxwell_elements(0.5)[0] > 0.0).all()  # the largest of a rig: no element would feed energy in
    share, time = maxwell_elements(loss_factor)
    storage, loss = moduli(share, time, np.geomspace(*BAND, 300))
    assert (share > 0).all()
    np.testing.assert_allclose(loss / storage, loss_factor, rtol=RIPPLE)
    # a damper parallel to a spring would have a hundred times the loss at one end of the band
    assert storage[-1] / storage[0] == pytest.approx(100 ** (2 * loss_factor / np.pi), rel=0.1)


@pytest.fixture
def hysteretic(make_scene):
    loop = spinning_loop(make_scene(0.0, ring_radius=None, bushing_law="hysteretic"))
    loop.arrays.state.rate[:] = 0.0
    return loop


@pytest.mark.parametrize("frequency", [0.5, 4.47, 50.0])
def test_a_sinusoid_has_the_loss_of_the_law(hysteretic, rig, frequency):
    model, state, work, _ = hysteretic.arrays
    share, time = maxwell_elements(rig.bushing.loss_factor)
    steps, omega, size = 2500, 2 * np.pi * frequency, 0.05
    h = 1.0 / frequency / steps
    model = model._replace(step=h)
    marks = np.arange(8 * steps + 1)
    angle = size * np.sin(omega * h * marks)
    for k in range(len(marks) - 1):
        if k == 7 * steps:  # the transient has decayed
            before, work_in, elastic = state.work_done[BUSHING_LOSS], 0.0, maxwell_energy(state, model.maxwell)
        state.rate[1] = (angle[k + 1] - angle[k]) / h
        old = state.maxwell[:, 0].sum()
        advance_maxwell(model, state, work, BUSHING_LOSS, model.maxwell)
        if k >= 7 * steps:
            work_in += 2 * h * state.rate[1] * 0.5 * (old + state.maxwell[:, 0].sum())
    lost = state.work_done[BUSHING_LOSS] - before
    storage, loss = moduli(share, time, [frequency])
    # both joints, and a cycle of steps of 1/2500: the sine of half a step
    scale = 2 * np.pi * rig.bushing.stiffness * size**2
    assert lost == pytest.approx(scale * loss[0], rel=1e-4)
    assert lost == pytest.approx(scale * rig.bushing.loss_factor * storage[0], rel=RIPPLE)
    assert lost + maxwell_energy(state, model.maxwell) - elastic == pytest.approx(work_in, rel=1e-6)
    np.testing.assert_array_equal(state.maxwell[:, 0], -state.maxwell[:, 1])
    assert not state.maxwell[:, 2:].any()


def test_a_step_is_exact_however_long(hysteretic):
    """Ten steps at one rate or one of ten times their length: the same moments, loss and energy."""
    maxwell, states = Maxwell(np.array([30.0, 200.0]), np.array([1e-4, 0.3])), []

    def moments(ahead):
        work.torque[:], work.joint_rate[:] = 0.0, np.roll(state.rate, -1) - state.rate
        add_maxwell_moments(state, work, ahead, maxwell)
        return work.torque.copy()

    for h, count in ((1e-3, 10), (1e-2, 1)):
        model, state, work, _ = hysteretic.copy().arrays
        state = state._replace(maxwell=np.array([[1.0], [-4.0]]) * np.ones(len(state.rate)))
        state.rate[::2] = 0.7
        before, ahead = maxwell_energy(state, maxwell), moments(h)
        for _ in range(count):
            advance_maxwell(model._replace(step=h), state, work, BUSHING_LOSS, maxwell)
        states.append([*state.maxwell.ravel(), state.work_done[BUSHING_LOSS], maxwell_energy(state, maxwell) - before])
    np.testing.assert_allclose(states[0], states[1], rtol=1e-9)
    # moments extrapolated over the long step, and those of the state after it
    np.testing.assert_allclose([ahead, moments(0.0)], [-state.maxwell.sum(axis=0)] * 2, rtol=1e-12)


@pytest.mark.parametrize(("integrator", "step"), [("semi_implicit", 1e-4), ("linearly_implicit", 5e-5), ("rk4", 5e-5)])
def test_the_energy_balance_of_a_loop_closes(make_scene, integrator, step):
    loop = Loop(make_scene(115.0, bushing_law="hysteretic", drag="rolling", integrator=integrator, step=step))
    assert loop.model.chain.damping == 0.0
    loop.advance(0.8)
    assert np.abs(loop.state.maxwell).max() > 1.0
    recording = loop.record(0.5)
    change = recording.energy[-1] - recording.energy[0]
    assert abs(open_share(recording.energy, loop.model, 0.5)[0]) < 1e-3
    assert change[BUSHING_LOSS] > 0.01 * change[0]


def test_stiff_elements_limit_the_step_and_missing_values_are_refused(make_scene, rig):
    soft, lossless = rig.changed(bushing__stiffness=2000.0), rig.changed(bushing__loss_factor=0.0)
    limits = [
        step_limits(make_scene(115.0, rig=soft, bushing_law=law, step=1e-5).model, 1000.0)["stiffness of the bushing"]
        for law in ("viscous", "hysteretic")
    ]
    share, _ = maxwell_elements(rig.bushing.loss_factor)
    assert limits[0] / limits[1] == pytest.approx((1 + share.sum()) ** 0.5)
    words = ["bushing_law = 'hysteretic': ", "loss_factor is 0", "'viscous'"]
    refused(make_scene, rig=lossless, bushing_law="hysteretic", words=words)
    for elastic in (lossless.changed(bushing__damping=0.0), rig.changed(bushing__stiffness=0.0)):
        model = make_scene(115.0, rig=elastic, bushing_law="hysteretic").model
        assert not len(model.maxwell.time) and model.chain.damping == 0.0

"""Orders of the integrators and their closure on a spinning loop without wheels, a smooth motion."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.kinematics import closed_rates, spinning_loop
from trackdyn.chain.kinematics import add_maxwell_moments, bushing_torques, orient
from trackdyn.chain.riccati import accelerations
from trackdyn.integrate.methods import METHODS
from trackdyn.model.arrays import make_optional, make_state, make_work
from trackdyn.scene.scene import Scene

PITCHES = 5
# long enough for the loop to change its shape by a third of a radian, short enough to stay smooth
SECONDS = 0.2


def packed(loop):
    state = loop.state
    return np.hstack([state.pin, state.angle, state.rate / 10.0, state.maxwell.ravel(), loop.energy["bushing_loss"]])


def derivative(model):
    """Return the right-hand side of the exact motion from the accelerations of the sweep."""
    chain, maxwell = model.chain, model.maxwell
    n = len(chain.length)
    state, work = make_state(n, PITCHES, 1, maxwell=len(maxwell.time)), make_work(n, PITCHES, 1)

    def rates(_, y):
        state.angle[:], state.rate[:] = y[4 : 4 + n], y[4 + n : 4 + 2 * n] * 10.0
        orient(state.angle, work.cos, work.sin)
        bushing_torques(chain, state, work)
        state.maxwell[:] = y[4 + 2 * n : -1].reshape(-1, n)
        add_maxwell_moments(state, work, 0.0, maxwell)
        moments = np.outer(maxwell.stiffness, work.joint_rate) - state.maxwell / maxwell.time[:, None]
        loss = chain.damping * (work.joint_rate**2).sum()
        loss += (state.maxwell**2 / (maxwell.stiffness * maxwell.time)[:, None]).sum()
        accelerations(chain, state, work, 0.0)
        sweep = work.sweep
        change = sweep.base @ sweep.load, state.rate, sweep.response @ sweep.load / 10.0
        return np.concatenate([y[2:4], *change, np.ravel(moments), [loss]])

    return rates


@pytest.fixture(scope="module", params=["viscous", "hysteretic"])
def loop(rig, request):
    """Return a loop with bushings so soft that no method is near its limit, and its motion to twelve digits."""
    law = request.param
    changes = {"gravity": 9.81, "bushing__stiffness": 20.0, "bushing__damping": 0.05, "bushing__law": law}
    small = rig.changed(chain__pitches=PITCHES, sensor__pitch=1, bushing__free_angle=-0.5, **changes)
    # without contact: kernels of the default laws
    drag = "rolling" if law == "hysteretic" else "viscous"
    loop = spinning_loop(Scene(small, 300.0, ring_radius=None, step=2e-5, drag=drag))
    # a few modes more than the spin: rates that keep the loop closed
    extra = np.random.default_rng(3).normal(0.0, 3.0, len(loop.state.angle))
    loop.arrays.state.rate[:] += closed_rates(loop.model.chain.length, loop.state.angle, extra)
    loop.arrays.state.pin[2:] += [0.3, 0.8]
    rates, tolerances = derivative(loop.arrays.model), {"rtol": 1e-13, "atol": 1e-13}
    exact = solve_ivp(rates, (0.0, SECONDS), packed(loop), method="DOP853", **tolerances)
    assert exact.success
    return loop, exact.y[:, -1]


@pytest.mark.parametrize("integrator", METHODS)
def test_error_falls_with_the_declared_order(loop, integrator):
    """Against the motion by another method, with the loss of the bushings; RK4 leaves the square of a step's gap."""
    (start, exact), method, errors = loop, METHODS[integrator], []
    lengths = (5e-5, 2.5e-5) if method.order == 1 else (1e-3, 5e-4)  # above rounding, and below the next order
    for h in lengths:
        after, model = start.copy(), start.arrays.model._replace(step=h)
        after.arrays = after.arrays._replace(model=model, optional=make_optional(model, method))
        after.step(round(SECONDS / h))
        errors.append(np.abs(packed(after) - exact).max())
        side = after.model.chain.length * np.array([np.cos(after.state.angle), np.sin(after.state.angle)])
        assert np.hypot(*side.sum(axis=1)) < 1.1e-10
    assert errors[1] > 1e-11  # above the error of the reference
    order = np.log(errors[0] / errors[1]) / np.log(lengths[0] / lengths[1])
    assert order == pytest.approx(method.order, abs=0.2)

"""Orders, closure and step limits of the integrators, on spinning loops without wheels."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.kinematics import closed_rates, set_model, spinning_loop
from trackdyn import DivergenceError, Scene
from trackdyn.chain.kinematics import add_maxwell_moments, bushing_torques, orient
from trackdyn.chain.riccati import accelerations
from trackdyn.integrate.methods import METHODS
from trackdyn.model.arrays import make_optional, make_state, make_work
from trackdyn.scene.step import FRICTION_LEEWAY, elastic_depth, step_limits

RK4 = METHODS["rk4"]
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
    exact = solve_ivp(derivative(loop.model), (0.0, SECONDS), packed(loop), method="DOP853", rtol=1e-13, atol=1e-13)
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
    assert np.log2(errors[0] / errors[1]) == pytest.approx(method.order, abs=0.2)


def test_reach_is_the_edge_of_the_stability_region():
    """Growth factor of RK4 on an oscillation and on a decay: 1 at its reach, rounded down to two decimals."""
    assert RK4.oscillation == pytest.approx(np.sqrt(8), abs=0.01)
    for direction, reach in ((1j, RK4.oscillation), (-1, RK4.decay)):
        inside, outside = (abs(np.polyval([1 / 24, 1 / 6, 1 / 2, 1, 1], direction * z)) for z in (reach, reach + 0.01))
        assert inside <= 1 < outside


@pytest.mark.parametrize("ring", [0.308, None])
def test_limits_of_rk4_are_larger_by_its_reach(make_scene, ring):
    scene = make_scene(ring_radius=ring)
    methods = METHODS["semi_implicit"], RK4
    euler, rk4 = (step_limits(scene.model, scene.rig.tension.pre_tension, method) for method in methods)
    # of accuracy, where a method has one
    euler, rk4 = ({name: h for name, h in bounds.items() if "turn" not in name} for bounds in (euler, rk4))
    # stiffness and friction of the teeth and of every wheel, and the bushing
    assert len(euler) == 2 * (1 + scene.model.wheels.present.sum()) + 1
    assert {type(limit) for limit in euler.values()} == {float}
    for name, limit in euler.items():
        # semi-implicit Euler takes friction with the slip that it leaves
        reach = RK4.decay / FRICTION_LEEWAY if name.startswith("friction") else RK4.oscillation
        assert rk4[name] / limit == pytest.approx(reach / 2.0, rel=1e-12)
    # semi-implicit Euler takes it at the end of the step
    assert set(rk4) - set(euler) == {"damping of the bushing"}


def grows(start, step, steps=120):
    """Return whether small random rates (rad/s) of the loop at rest grow to a hundred times their size."""
    loop = start.copy()
    extra = np.random.default_rng(0).normal(0.0, 1e-3, len(loop.state.angle))
    loop.arrays.state.rate[:] = closed_rates(loop.model.chain.length, loop.state.angle, extra)
    set_model(loop, step=step)
    try:
        loop.step(steps)
    except DivergenceError:
        return True
    return not np.abs(loop.state.rate).max() < 0.3


CUT = {"closure": "elastic_damping"}


@pytest.mark.parametrize(("pitches", "damping", "fields", "changes", "cause"), [
    (5, 12.4, {}, {}, "damping of the bushing"),
    (35, 12.4, {}, {}, "damping of the bushing"),
    (35, 12.4, {"chain": "single_pin"}, {}, "damping of the bushing"),
    (5, 0.1, CUT, {"closure__stiffness": 1e9, "closure__damping": 100.0}, "stiffness of the cut (closure)"),
    (5, 0.1, CUT, {"closure__stiffness": 1e6, "closure__damping": 1e4}, "damping of the cut (closure)"),
])  # fmt: skip
def test_damping_and_a_compliant_cut_limit_rk4_where_predicted(rig, pitches, damping, fields, changes, cause):
    """The zigzag of a straight strand decays fastest, in a small round loop slower by a seventh."""
    changes = changes | {"chain__pitches": pitches, "bushing__stiffness": 0.0, "bushing__damping": damping}
    small = rig.changed(sensor__pitch=1, gravity=0.0, **changes)
    loop = spinning_loop(Scene(small, 0.0, ring_radius=None, integrator="rk4", step=1e-6, **fields))
    bounds = step_limits(loop.model, rig.tension.pre_tension, RK4)
    assert min(bounds, key=bounds.get) == cause
    low, high = bounds[cause] / 5, bounds[cause] * 5
    assert not grows(loop, low) and grows(loop, high)
    for _ in range(7):  # to 4 %
        middle = np.sqrt(low * high)
        low, high = (low, middle) if grows(loop, middle) else (middle, high)
    assert (0.95 if damping > 1 else 0.9) < low / bounds[cause] < 1.4


@pytest.mark.parametrize("stiffness", [1e12, 1e8, 1.0, 1e-200])
def test_a_contact_of_any_stiffness_carries_its_load_at_its_elastic_depth(stiffness):
    depth = elastic_depth(SimpleNamespace(stiffness=stiffness), 3e3, 0.02)
    assert stiffness * depth * (depth / (depth + 0.02)) ** 0.5 == pytest.approx(3e3, rel=1e-12)

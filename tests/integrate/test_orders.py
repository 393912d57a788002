"""Orders of the integrators and what they conserve, on a free loop: smooth, spinning, no contacts."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from trackdyn.chain import riccati
from trackdyn.chain.kinematics import orient, place
from trackdyn.integrate.energy import energies
from trackdyn.integrate.methods import ORDERS, make_method
from trackdyn.integrate.run import run
from trackdyn.model import BUSHING_LOSS, KINETIC, make_buffers
from trackdyn.scene import Scene
from trackdyn.settling import empty_record, settle

PITCHES = 5
# long enough for the loop to change its shape by a third of a radian, short enough to stay smooth
SECONDS = 0.2


def make_loop(rig, integrator="semi_implicit", **fields):
    """Model and state of a spinning loop of few bodies; bushings so soft that no method is near its limit."""
    changes = {"gravity": 9.81, "bushing__stiffness": 20.0, "bushing__damping": 0.05} | fields
    small = rig.changed(chain__pitches=PITCHES, sensor__pitch=1, bushing__free_angle=-0.5, **changes)
    scene = Scene(small, 300.0, ring_radius=None, spells=False, loop="free", integrator=integrator, step=2e-5,
                  tolerance=1e-6 if integrator == "adaptive" else None)  # fmt: skip
    model, state, _, _ = settle(scene)
    # a few modes more than the spin: rates that keep the loop closed
    rng = np.random.default_rng(3)
    rows = model.chain.length * np.array([-np.sin(state.angle), np.cos(state.angle)])
    extra = rng.normal(0.0, 3.0, len(state.angle))
    state.rate[:] += extra - rows.T @ np.linalg.solve(rows @ rows.T, rows @ extra)
    state.pin[2:] += [0.3, 0.8]
    return model, state


def march_on(model, state, integrator, step, seconds=SECONDS, tolerance=0.0):
    """State, account of work and the method's own arrays after ``seconds`` in steps of ``step``."""
    state = type(state)(*(array.copy() for array in state))
    model = model._replace(step=step)
    n = len(state.angle)
    work = make_buffers(n, 1, PITCHES)
    method = make_method(integrator, n, PITCHES, 1, tolerance)
    bad = run(
        model, state, work, empty_record(1, n, 1, loop=PITCHES), 0, 1, round(seconds / step),
        method if integrator == "linearly_implicit" else None, method if integrator in ("rk4", "adaptive") else None,
    )  # fmt: skip
    assert bad < 0
    place(model.chain, state, work)
    account = np.zeros(10)
    energies(model, state, work, account)
    return state, account, method


def packed(state):
    return np.concatenate([state.pin, state.angle, state.rate / 10.0])


def derivative(chain):
    """Right-hand side of the exact motion, around the accelerations of the sweep alone."""
    n = len(chain.length)
    work, zero = riccati.make_work(n), np.zeros(n)

    def rates(_, y):
        angle, rate = y[4 : 4 + n], y[4 + n :] * 10.0
        phi = np.append(angle[1:], angle[0] - 2 * np.pi) - angle
        torque = -chain.stiffness * (phi - chain.free_angle) - chain.damping * (np.roll(rate, -1) - rate)
        riccati.accelerations(chain, np.cos(angle), np.sin(angle), rate, zero, zero, zero, torque, 0.0, 0, work)
        return np.concatenate([y[2:4], work.base @ work.load, rate, work.response @ work.load / 10.0])

    return rates


@pytest.fixture(scope="module")
def loop(rig):
    """The loop and its motion to twelve digits."""
    model, state = make_loop(rig)
    exact = solve_ivp(derivative(model.chain), (0.0, SECONDS), packed(state), method="DOP853", rtol=1e-13, atol=1e-13)
    assert exact.success
    return model, state, exact.y[:, -1]


# two steps for each method, between which its error is neither rounding nor of the next order
STEPS = {
    "semi_implicit": (1e-4, 2.5e-5),
    "linearly_implicit": (5e-5, 2.5e-5),
    "rk4": (1e-3, 5e-4),
    "adaptive": (1.25e-3, 6.25e-4),
}


def observed_order(errors, steps):
    return np.log(errors[0] / errors[1]) / np.log(steps[0] / steps[1])


@pytest.mark.parametrize("integrator", ORDERS)
def test_error_falls_with_the_declared_order(loop, integrator):
    """Against the motion that another method finds; the tableau of the adaptive one at fixed steps (tolerance 0)."""
    model, state, exact = loop
    errors = [np.abs(packed(march_on(model, state, integrator, h)[0]) - exact).max() for h in STEPS[integrator]]
    assert errors[1] > 1e-11  # above what the reference itself lacks
    assert observed_order(errors, STEPS[integrator]) == pytest.approx(ORDERS[integrator], abs=0.2)


def test_closure_projected_at_every_step_leaves_no_gap(loop):
    """Open by rounding after hundreds of steps of any method; 1.1e-10 m is asked for."""
    model, state, _ = loop
    for integrator in ORDERS:
        after, _, _ = march_on(model, state, integrator, 1e-3 if integrator in ("rk4", "adaptive") else 1e-4)
        side = model.chain.length * np.array([np.cos(after.angle), np.sin(after.angle)])
        # RK4 projects once a step of 1e-3 s: what one step opened, squared, is left
        assert np.hypot(*side.sum(axis=1)) < 1.1e-10, integrator


def test_error_control_keeps_its_tolerance(loop):
    """The error of the motion follows the tolerance of a step, and the steps that it costs its order."""
    model, state, exact = loop
    tolerances = np.array([1e-6, 1e-8, 1e-10])
    errors, taken = [], []
    for tolerance in tolerances:
        # reports every 0.1 s: no step is shortened to meet one
        after, _, method = march_on(model, state, "adaptive", 0.1, tolerance=tolerance)
        errors.append(np.abs(packed(after) - exact).max())
        taken.append(method.counts[0])
    # a few hundred steps add up or cancel: a decade to either side
    assert (np.array(errors) < 10 * tolerances).all()
    assert (np.array(errors) > 0.1 * tolerances).all()
    # the control takes what a step of length h may lose, h^5: the error falls with the fifth power of their number
    assert observed_order([errors[0], errors[2]], [1 / taken[0], 1 / taken[2]]) == pytest.approx(5, abs=0.4)


def test_account_of_a_damped_loop_closes_with_rk4(loop):
    """Kinetic, elastic and potential energy lose what the bushings take, which is integrated beside the motion."""
    model, state, _ = loop
    _, before, _ = march_on(model, state, "rk4", 5e-4, seconds=0.0)
    residual, scale = [], before[KINETIC]
    for step in (1e-3, 5e-4):
        _, after, _ = march_on(model, state, "rk4", step)
        assert after[BUSHING_LOSS] > 0.05 * scale  # there is something to account for
        residual.append(abs((after[KINETIC:] - before[KINETIC:]).sum() + after[BUSHING_LOSS]))
    assert residual[1] < 1e-8 * scale
    # of order 4 like the motion: their quotient is 16, or more where fifth-order terms still count
    assert 12 < residual[0] / residual[1] < 32


# --- momentum


def momenta(model, state):
    """Linear momentum (2) and angular momentum about the origin, SI."""
    chain, work = model.chain, make_buffers(len(state.angle), 1, PITCHES)
    orient(state.angle, work.cos, work.sin)
    place(chain, state, work)
    x = work.pin_x[:-1] + chain.com_x * work.cos - chain.com_y * work.sin
    y = work.pin_y[:-1] + chain.com_x * work.sin + chain.com_y * work.cos
    vx, vy = work.com_vx, work.com_vy
    return np.array([chain.mass @ vx, chain.mass @ vy, chain.mass @ (x * vy - y * vx) + chain.inertia @ state.rate])


def test_no_acceleration_changes_the_momentum_of_a_free_loop(rig):
    """Differences of the momentum along the exact derivative: bushings and closure are inner forces."""
    model, state = make_loop(rig, gravity=0.0)
    slope = derivative(model.chain)(0.0, packed(state))
    n, eps = len(state.angle), 1e-5
    ends = []
    for sign in (-1, 1):
        y = packed(state) + sign * eps * slope
        ends.append(momenta(model, state._replace(pin=y[:4], angle=y[4 : 4 + n], rate=10.0 * y[4 + n :])))
    # the difference is of second order: eps^2 times third derivatives, up to 1e6 of the momentum
    scale = np.abs(momenta(model, state)).max()
    np.testing.assert_allclose((ends[1] - ends[0]) / (2 * eps), 0.0, atol=1e-4 * scale)


@pytest.mark.parametrize("integrator", ORDERS)
def test_momentum_of_a_free_loop_is_kept_to_the_order_of_the_method(rig, integrator):
    """The pins and angles are integrated, and the momentum is no linear function of them: it has the method's error."""
    model, state = make_loop(rig, gravity=0.0)
    before = momenta(model, state)
    drift = [np.abs(momenta(model, march_on(model, state, integrator, h)[0]) - before).max() for h in STEPS[integrator]]
    assert drift[1] < {1: 1e-3, 4: 1e-8, 5: 1e-8}[ORDERS[integrator]] * np.abs(before).max()
    if drift[1] > 1e-12 * np.abs(before).max():  # above rounding
        # at least: parts of the leading term cancel between the bodies
        assert observed_order(drift, STEPS[integrator]) > ORDERS[integrator] - 0.3


def test_momentum_changes_by_gravity_alone(loop):
    """Gravity takes m g t from the vertical momentum and nothing from the horizontal one."""
    model, state, _ = loop
    change = momenta(model, march_on(model, state, "adaptive", 0.1, tolerance=1e-10)[0]) - momenta(model, state)
    impulse = model.chain.mass.sum() * model.chain.gravity * SECONDS
    # the tolerance of the integration, relative to the momentum of 62.5 kg at 0.3 m/s and the spin
    np.testing.assert_allclose(change[:2] / impulse, [0.0, -1.0], atol=1e-8)

"""The linearly implicit step: its equations against a dense system, its balance of momentum, its stability."""

import numpy as np
import pytest

from tests import reference
from tests.conftest import recorded, refused
from tests.kinematics import ContactList, irregular_chain, mass_centre_arms, without_extrapolation
from trackdyn import Loop, sense
from trackdyn.chain import implicit
from trackdyn.chain.kinematics import SLOW
from trackdyn.chain.riccati import accelerate
from trackdyn.contact.forces import AHEAD
from trackdyn.integrate.dynamics import solve_chain
from trackdyn.integrate.run import refresh
from trackdyn.measure.spectra import rms
from trackdyn.model.arrays import OptionalWork, make_implicit, make_state, make_work

# as for the plain sweep: the end and closure matrices have condition numbers up to 1e5
AGREEMENT = 1e-10
STEP = 5e-4
WHEELS = 3


def contact_matrices(rng, n):
    """Return ``h C + h^2 K`` of random contacts over input pins, angles and wheels, dense: (3 n + w, 3 n + w)."""
    matrix = np.zeros((3 * n + WHEELS, 3 * n + WHEELS))
    for _ in range(n):
        body, wheel, direction = rng.integers(n), rng.integers(WHEELS), rng.uniform(0, 2 * np.pi)
        arm, spoke = rng.normal(0, 0.05, 2), rng.normal(0, 0.3, 2)  # from the input pin and the wheel's centre
        # along the normal and across it, kg: those of a tooth of 1e8 N/m at this step reach 25 kg
        normal, across = rng.uniform(0, 25), rng.uniform(0, 5)
        c, s = np.cos(direction), np.sin(direction)
        for share, (ux, uy) in ((normal, (c, s)), (across, (-s, c))):
            # velocity of the body's point along u relative to the wheel, whose rotation acts across the normal only
            row = np.zeros(3 * n + WHEELS)
            row[3 * body : 3 * body + 3] = ux, uy, arm[0] * uy - arm[1] * ux
            if share is across:
                row[3 * n + wheel] = -(spoke[0] * uy - spoke[1] * ux)
            matrix += share * np.outer(row, row)
    return matrix


@pytest.mark.parametrize("cut", [None, (3.0, (800.0, -300.0))], ids=["rigid", "compliant"])
@pytest.mark.parametrize("carried", [np.zeros(3), np.array([9e3, 4e3, 0.0])], ids=["viscous", "rolling"])
@pytest.mark.parametrize("n", [6, 35, 70])
def test_sweep_solves_the_dense_system_of_the_step(make_scene, n, carried, cut):
    model, pitches = make_scene(bushing_law="viscous").model._replace(step=STEP), max(n // 2, 1)
    work, terms = make_work(n, pitches, WHEELS)._replace(carried=carried), make_implicit(n, WHEELS)
    rolling = np.array([0.0, 0.007, 0.009])
    for array in work.sweep:
        array[...] = 7.0
    for seed in range(3):  # without a reset of the arrays
        rng = np.random.default_rng(seed)
        chain, angle, _, rate, loads = irregular_chain(n, rng)
        matrix, torque = contact_matrices(rng, n), rng.normal(0, 5, n)
        wheel_torque, wheel_rate = rng.normal(0, 200, WHEELS), rng.normal(0, 5, WHEELS)
        inertia, drag = np.array([1.0, 3.0, 2.0]), np.array([0.0, 23.0, 11.0])
        for i in range(n):
            block = matrix[3 * i : 3 * i + 3]
            terms.inertia[i] = block[:, 3 * i : 3 * i + 3][np.triu_indices(3)][[0, 1, 3, 2, 4, 5]]
            # a load for a unit acceleration of the wheel: on the other side of the equation
            terms.couple[i] = -block[:, 3 * n :].T
        terms.wheel_inertia[:] = np.diag(matrix)[3 * n :]
        here = model._replace(chain=chain, wheels=model.wheels._replace(inertia=inertia, drag=drag, rolling=rolling))
        state = make_state(n, pitches, WHEELS)._replace(angle=angle, rate=rate, wheel_rate=wheel_rate)
        work.cos[:], work.sin[:] = np.cos(angle), np.sin(angle)
        work.force_x[:], work.force_y[:], work.moment[:] = loads
        work.torque[:], work.wheel_torque[:] = torque, wheel_torque
        implicit.accelerations(here, state, work, terms, (1.0 / cut[0], *cut[1]) if cut else (0.0, 0.0, 0.0))
        accelerate(chain, state, work, n - 1)
        drag = drag + rolling * carried * np.tanh(wheel_rate / SLOW) / wheel_rate  # secant of the load's torque
        damping = STEP * chain.damping + STEP**2 * chain.stiffness
        extra = reference.WheelTerms(matrix, inertia + STEP * drag, wheel_torque - drag * wheel_rate)
        expected = reference.reference_accelerations(
            chain, angle, rate, *loads, torque=torque, implicit_damping=damping, wheels=extra, cut=cut
        )
        scale, pins = np.abs(expected.alpha).max(), np.column_stack([work.pin_ax, work.pin_ay])
        for solution, right, size in (
            (work.alpha, expected.alpha, scale), (pins, expected.pins, scale * chain.length.max()),
            (terms.load[4:], expected.wheels[1:], max(1.0, np.abs(expected.wheels).max())),
        ):  # fmt: skip
            np.testing.assert_allclose(solution, right, rtol=0, atol=AGREEMENT * size)


def evaluate(model, state, work, implicit=None, step=STEP):
    """Return model and state of evaluated loads, extrapolated with ``implicit`` work, without a change of impacts."""
    model = model._replace(step=step)
    state = state._replace(tooth_impact=state.tooth_impact.copy(), wheel_impact=state.wheel_impact.copy())
    refresh(model, state, work, OptionalWork(implicit=implicit))
    return model, state


@pytest.fixture
def parts(driven_loop):
    """Return model, state and work of the running loop, and the terms of a linearly implicit step."""
    model, state, work, _ = driven_loop().arrays
    return without_extrapolation(model, work), state, work, make_implicit(len(state.angle), WHEELS)


def test_forces_are_extrapolated_along_the_path_of_the_step(parts, make_scene):
    model, state, work, terms = parts
    laws = make_scene(normal_law="elastic", friction="none").model
    tooth, wheels = model.tooth._replace(law=laws.tooth.law), model.wheels._replace(law=laws.wheels.law)
    model = model._replace(tooth=tooth, wheels=wheels)
    h = 1e-6  # central differences: an error of third order
    evaluate(model, state, work, terms, h)
    ahead, there = ContactList(work).force, []
    for time in (-h, 0.0, h):
        pin = state.pin + time * np.append(state.pin[2:], [0.0, 0.0])
        angle, wheel_angle = state.angle + time * state.rate, state.wheel_angle + time * state.wheel_rate
        evaluate(model, state._replace(pin=pin, angle=angle, wheel_angle=wheel_angle), work)
        there.append(ContactList(work).force)
    before, now, after = there
    change = AHEAD * (after - before) / 2
    assert np.abs(change).max() > 1e-2
    # rounding of places of 1 m over a penetration of 1e-5 m leaves 1e-6 N
    np.testing.assert_allclose(ahead - now, change, rtol=0, atol=1e-4 * np.abs(change).max())


def test_contacts_act_on_chain_and_wheels_alike(make_scene):
    """Balance of momentum: the forces led to the end of the step move the chain, and turn the wheels back."""
    loop = Loop(make_scene(115.0, integrator="linearly_implicit", step=STEP))
    loop.advance(1.0)
    loop.drive(150.0, ramp=0.2)  # in steady motion the wheels hardly change their speed
    loop.advance(0.1)
    model, state, work, (_, terms, _) = loop.arrays
    chain, wheels = model.chain, model.wheels
    evaluate(model, state, work, terms)
    solve_chain(model, state, work, STEP, terms)
    # vectors in the plane as complex numbers: i v is across v, the real part of v* w their scalar product
    plane, contacts, spin = np.array([1, 1j]), ContactList(work), np.append(0.0, terms.load[4:])
    pins, centre = work.pin_ax + 1j * work.pin_ay, mass_centre_arms(chain, state) @ plane
    momentum_rate = (pins + (1j * work.alpha - state.rate**2) * centre) @ chain.mass
    # forces: the contact list less the terms of the step's accelerations
    rows, body, wheel, spoke = contacts.rows, contacts.body, contacts.wheel, contacts.spoke @ plane
    assert set(wheel) == {0, 1, 2}
    normal = contacts.normal @ plane / contacts.force
    point = pins[body] + 1j * work.alpha[body] * (contacts.arm @ plane + centre[body])
    across = (np.conj(1j * normal) * (point - 1j * spin[wheel] * spoke)).real
    force = (contacts.normal + contacts.friction) @ plane - rows["friction_slope"] * across * 1j * normal
    force -= rows["normal_slope"] * (normal.conj() * point).real * normal
    scale = np.abs(force).sum()  # N; closure and sweep lose 1e-10 of it
    weight = -1j * chain.mass.sum() * chain.gravity
    assert abs(force.sum() + weight - momentum_rate) < AGREEMENT * scale
    for k in (1, 2):
        torque = -(spoke.conj() * force).imag[wheel == k].sum()
        torque -= wheels.drag[k] * (state.wheel_rate[k] + STEP * spin[k])
        assert abs(spin[k]) > 0.1  # the wheel does change its speed
        assert wheels.inertia[k] * spin[k] == pytest.approx(torque, abs=AGREEMENT * scale)


def test_step_tends_to_the_semi_implicit_one(parts):
    model, state, work, terms = parts
    evaluate(model, state, work)
    solve_chain(model, state, work, 0.0, None)
    explicit = work.alpha.copy()
    wheel = (work.wheel_torque - model.wheels.drag * state.wheel_rate)[1:] / model.wheels.inertia[1:]
    error, lag = [], []
    for h in (2e-8, 1e-8):
        here, there = evaluate(model, state, work, terms, h)
        solve_chain(here, there, work, h, terms)
        error.append(np.abs(work.alpha - explicit).max())
        lag.append(np.abs(terms.load[4:] - wheel).max())
    assert error[1] < 1e-3 * np.abs(explicit).max()
    # of the torque, of which drag and contacts nearly cancel
    assert lag[1] < 1e-4 * np.abs(work.wheel_torque[1:] / model.wheels.inertia[1:]).max()
    # the next order is h c / J of the bushings, 4e-5
    assert error[0] / error[1] == pytest.approx(2.0, abs=0.01)
    assert lag[0] / lag[1] == pytest.approx(2.0, abs=0.01)


def test_long_steps_stay_stable_and_give_the_sensor_of_short_ones(make_scene):
    """At a step that the explicit method refuses: over its interval the sensor sees the same motion within 2 %."""
    long = make_scene(150.0, duration=3.0, lead_in=1.0, integrator="linearly_implicit", step=STEP)
    refused(long.with_, integrator="semi_implicit", match=r"step = 0\.0005: too large")
    values = []
    for scene in (long, make_scene(150.0, duration=3.0, lead_in=1.0)):
        recording = recorded(scene)
        # the gap that the paper prints for its own runs
        assert np.isfinite(recording.raw).all() and recording.gap.max() <= 1.1e-10
        signal = sense(recording)
        values.append([rms(signal.ax), rms(signal.ay)])
    np.testing.assert_allclose(*values, rtol=0.02)

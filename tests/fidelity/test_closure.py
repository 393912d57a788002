"""The compliant cut tends to the closed one, keeps the momentum, and runs with every integrator."""

import numpy as np
import pytest

from trackdyn.chain.kinematics import orient, place
from trackdyn.integrate.methods import make_method
from trackdyn.integrate.run import run
from trackdyn.model import make_buffers
from trackdyn.scene import Scene
from trackdyn.settling import empty_record, settle
from trackdyn.simulate import simulate

STIFFNESS = (1e7, 1e8, 1e9)


@pytest.mark.parametrize("integrator", ["semi_implicit", "linearly_implicit"])
def test_compliant_cut_tends_to_the_closed_one(rig, make_scene, integrator):
    """At rest the gap is the tension over the stiffness; running, the sensor beside the cut comes to feel the same."""
    rigid = simulate(make_scene(150.0, integrator=integrator))
    assert rigid.gap.max() <= 1.1e-10
    difference = []
    for stiffness in STIFFNESS:
        soft = rig.changed(closure__stiffness=stiffness)
        scene = make_scene(150.0, rig=soft, integrator=integrator, closure="elastic_damping")
        _, _, work, layout = settle(scene)
        # the tensioner is locked a little before the loop has come to rest
        assert np.hypot(*work.cut[:2]) * stiffness == pytest.approx(layout["tension_n"], rel=0.1)
        recording = simulate(scene)
        # the tension of running, at most three times that of rest
        assert 1.0 < recording.gap.max() * stiffness / rig.tension.pre_tension < 3.0
        difference.append(np.sqrt(np.mean((recording.mean - rigid.mean)[:, :2] ** 2)))
    # of the order of the compliance until the difference of the settled states is left
    assert difference[0] > 4 * difference[1] > 16 * difference[2]
    assert difference[2] < 0.02 * np.sqrt(np.mean(rigid.mean[:, :2] ** 2))


# --- a free loop with a soft, damped cut that is pulled open


def open_loop(rig, integrator, **changes):
    small = rig.changed(
        chain__pitches=5, sensor__pitch=1, gravity=0.0, bushing__stiffness=20.0, bushing__damping=0.05,
        closure__stiffness=1e5, closure__damping=200.0, **changes,
    )  # fmt: skip
    scene = Scene(
        small, 300.0, ring_radius=None, spells=False, loop="free", closure="elastic_damping", step=1e-5,
        integrator=integrator,
    )  # fmt: skip
    model, state, work, _ = settle(scene)
    # open by some millimetres, the ends moving past each other: the couple is then not zero
    rng = np.random.default_rng(1)
    state.angle[:] += rng.normal(0.0, 0.15, len(state.angle))
    state.rate[:] += rng.normal(0.0, 10.0, len(state.angle))
    return model, state, work


def momenta(model, state, work):
    """Linear (2) and angular momentum about the origin; the gap of the cut stays in ``work``."""
    chain = model.chain
    orient(state.angle, work.cos, work.sin)
    place(chain, state, work)
    x = work.pin_x[:-1] + chain.com_x * work.cos - chain.com_y * work.sin
    y = work.pin_y[:-1] + chain.com_x * work.sin + chain.com_y * work.cos
    vx, vy = work.com_vx, work.com_vy
    return np.array([chain.mass @ vx, chain.mass @ vy, chain.mass @ (x * vy - y * vx) + chain.inertia @ state.rate])


def drift(model, state, integrator, step, seconds=0.05):
    """Change of the momenta over ``seconds``."""
    state = type(state)(*(array.copy() for array in state))
    n = len(state.angle)
    work = make_buffers(n, 1, 5)
    before = momenta(model, state, work)
    assert np.hypot(*work.cut[:2]) > 5e-3
    assert abs(work.cut[0] * work.cut[3] - work.cut[1] * work.cut[2]) > 1e-3  # the rate of the gap turns it
    method = make_method(integrator, n, 5, 1)
    implicit = method if integrator == "linearly_implicit" else None
    stages = method if integrator == "rk4" else None
    model = model._replace(step=step)
    assert run(model, state, work, empty_record(1, n, 1, loop=5), 0, 1, round(seconds / step), implicit, stages) < 0
    return np.abs(momenta(model, state, work) - before)


def test_couple_of_the_open_cut_keeps_the_angular_momentum(rig):
    """Explicit, so that force and couple belong to the same instant: the error is that of the method, of order 4."""
    model, state, work = open_loop(rig, "rk4")
    scale = np.abs(momenta(model, state, work)).max()
    # the longer step still has terms of the next order; without the couple the drift would not fall at all
    coarse, fine = (drift(model, state, "rk4", h)[2] for h in (5e-4, 2.5e-4))
    assert fine < 1e-6 * scale
    assert coarse / fine > 10


@pytest.mark.parametrize("integrator", ["semi_implicit", "linearly_implicit"])
def test_implicit_cut_keeps_the_momentum_to_first_order(rig, integrator):
    """Order 1, as the declared order of both; the gap is taken at the end of the step, its couple at the start."""
    model, state, work = open_loop(rig, integrator)
    scale = np.abs(momenta(model, state, work)).max()
    coarse, fine = (drift(model, state, integrator, h) for h in (4e-5, 2e-5))
    assert fine.max() < 1e-2 * scale
    assert coarse.max() / fine.max() == pytest.approx(2.0, abs=0.3)


@pytest.mark.parametrize("integrator", ["semi_implicit", "linearly_implicit"])
def test_explicit_and_implicit_cut_move_alike(rig, integrator):
    """The same open loop by RK4 and by both implicit methods: errors of order 1 fall to the same motion."""
    model, state, _ = open_loop(rig, "rk4")
    ends = {}
    for name, step in (("rk4", 1e-4), (integrator, 4e-5), (integrator, 2e-5)):
        here = type(state)(*(array.copy() for array in state))
        n = len(here.angle)
        work, method = make_buffers(n, 1, 5), make_method(name, n, 5, 1)
        implicit, stages = method if name == "linearly_implicit" else None, method if name == "rk4" else None
        record = empty_record(1, n, 1, loop=5)
        assert run(model._replace(step=step), here, work, record, 0, 1, round(0.02 / step), implicit, stages) < 0
        ends[name, step] = here.angle
    error = [np.abs(ends[integrator, h] - ends["rk4", 1e-4]).max() for h in (4e-5, 2e-5)]
    assert error[0] / error[1] == pytest.approx(2.0, abs=0.2)

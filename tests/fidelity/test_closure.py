"""The compliant cut tends to the rigid one, conserves momentum, and runs with every integrator."""

import numpy as np
import pytest

from tests.conftest import recorded
from tests.kinematics import set_model, spinning_loop
from trackdyn import Loop, Scene


@pytest.mark.parametrize("integrator", ["semi_implicit", "linearly_implicit"])
def test_compliant_cut_tends_to_the_closed_one(rig, make_scene, integrator):
    """At rest the gap is the tension over the stiffness; running, the sensor next to the cut measures the same."""
    rigid = recorded(make_scene(150.0, integrator=integrator))
    assert rigid.gap.max() <= 1.1e-10
    difference = []
    for stiffness in (1e7, 1e8, 1e9):
        soft = rig.changed(closure__stiffness=stiffness)
        loop = Loop(make_scene(150.0, rig=soft, integrator=integrator, closure="elastic_damping"))
        # the tensioner is locked a little before the loop has come to rest
        assert loop.gap * stiffness == pytest.approx(loop.layout.tension_n, rel=0.1)
        loop.lead_in()
        recording = loop.record(loop.scene.duration)
        # the tension of running, at most three times that of rest
        assert 1.0 < recording.gap.max() * stiffness / rig.tension.pre_tension < 3.0
        difference.append(np.sqrt(np.mean((recording.mean - rigid.mean)[:, :2] ** 2)))
    # in proportion to the compliance, down to the difference of the settled states
    assert difference[0] > 4 * difference[1] > 16 * difference[2]
    assert difference[2] < 0.02 * np.sqrt(np.mean(rigid.mean[:, :2] ** 2))


def open_loop(rig, integrator):
    small = rig.changed(
        chain__pitches=5, sensor__pitch=1, gravity=0.0, bushing__stiffness=20.0, bushing__damping=0.05,
        closure__stiffness=1e5, closure__damping=200.0,
    )  # fmt: skip
    scene = Scene(small, 300.0, ring_radius=None, closure="elastic_damping", step=1e-5, integrator=integrator)
    loop = spinning_loop(scene)
    # open by some millimetres and turning, so that the couple is not zero
    rng, state, gap = np.random.default_rng(1), loop.arrays.state, loop.arrays.work.cut
    state.angle[:] += rng.normal(0.0, 0.15, len(state.angle))
    state.rate[:] += rng.normal(0.0, 10.0, len(state.angle))
    assert loop.gap > 5e-3
    assert abs(gap[0] * gap[3] - gap[1] * gap[2]) > 1e-3  # its rate turns it
    return loop


def after(loop, step, seconds):
    later = loop.copy()
    set_model(later, step=step)
    later.advance(seconds)
    return later


def test_couple_of_the_open_cut_keeps_the_angular_momentum(rig):
    """Explicit, so that force and couple belong to the same instant: the error is that of the method, of order 4."""
    loop = open_loop(rig, "rk4")
    # without the couple the drift would not fall
    coarse, fine = (abs(after(loop, h, 0.05).momentum[2] - loop.momentum[2]) for h in (5e-4, 2.5e-4))
    assert fine < 1e-6 * np.abs(loop.momentum).max()
    assert coarse / fine > 10


@pytest.mark.parametrize("integrator", ["semi_implicit", "linearly_implicit"])
def test_explicit_and_implicit_cut_move_alike(rig, integrator):
    """An open loop moves by both implicit methods as by RK4, but for errors of order 1."""
    exact = after(open_loop(rig, "rk4"), 1e-4, 0.02)
    loop = open_loop(rig, integrator)
    error = [np.abs(after(loop, h, 0.02).state.angle - exact.state.angle).max() for h in (4e-5, 2e-5)]
    assert error[0] / error[1] == pytest.approx(2.0, abs=0.2)

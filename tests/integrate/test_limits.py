"""Predicted step limits: how they follow the method, and where a free loop really becomes unstable."""

import numpy as np
import pytest
from trackdyn.integrate.limits import REACH, step_limits

from trackdyn.errors import InputError
from trackdyn.integrate.methods import make_method
from trackdyn.integrate.run import run
from trackdyn.scene import Scene, build_model
from trackdyn.settling import empty_record, settle


def limits(scene, integrator):
    return step_limits(build_model(scene), scene.rig.tension.pre_tension, integrator)


def test_reach_is_the_edge_of_the_stability_region():
    """Growth factor of RK4 on an oscillation and on a decay: 1 at its reach."""

    def growth(z):
        return abs(1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24)

    oscillation, decay = REACH["rk4"]
    assert oscillation == pytest.approx(np.sqrt(8), abs=0.01)
    # rounded down to two decimals: just inside, and outside a hundredth further
    for inside, outside in ((1j * oscillation, 1j * (oscillation + 0.01)), (-decay, -decay - 0.01)):
        assert growth(inside) <= 1 < growth(outside)


@pytest.mark.parametrize("ring", [0.308, None])
def test_limits_of_rk4_are_larger_by_its_reach(make_scene, ring):
    scene = make_scene(ring_radius=ring)
    euler, rk4 = limits(scene, "semi_implicit"), limits(scene, "rk4")
    # of accuracy, where a method has one
    euler, rk4 = ({name: h for name, h in found.items() if "turn" not in name} for found in (euler, rk4))
    assert len(euler) == (7 if ring else 5)
    for name, limit in euler.items():
        kind = 1 if name.startswith("friction") else 0
        assert rk4[name] / limit == pytest.approx(REACH["rk4"][kind] / 2.0, rel=1e-12)
    # what semi-implicit Euler takes at the end of the step limits the explicit method
    assert set(rk4) - set(euler) == {"damping of the bushing"}


def free_loop(rig, pitches, integrator="rk4", closure="rigid", chain="double_pin", **changes):
    small = rig.changed(chain__pitches=pitches, sensor__pitch=1, gravity=0.0, **changes)
    return Scene(
        small, 0.0, ring_radius=None, spells=False, loop="free", integrator=integrator, closure=closure, chain=chain,
        step=1e-6,
    )  # fmt: skip


def grows(scene, step, steps=120):
    """Whether small random rates (rad/s) of the loop at rest grow to a hundred times their size.

    An unstable loop does not always run away: it may rattle at some hundred rad/s.
    """
    model, state, work, _ = settle(scene)
    n, pitches = len(state.angle), scene.rig.chain.pitches
    rows = model.chain.length * np.array([-np.sin(state.angle), np.cos(state.angle)])
    extra = np.random.default_rng(0).normal(0.0, 1e-3, n)
    state.rate[:] = extra - rows.T @ np.linalg.solve(rows @ rows.T, rows @ extra)
    method = make_method("rk4", n, pitches, 1)
    record = empty_record(1, n, 1, loop=pitches)
    bad = run(model._replace(step=step), state, work, record, 0, 1, steps, None, method)
    return bad >= 0 or not np.abs(state.rate).max() < 0.3


def measured(scene, guess):
    """Largest step at which the loop stays calm, by bisection within a decade around ``guess``."""
    low, high = guess / 5, guess * 5
    assert not grows(scene, low) and grows(scene, high)
    for _ in range(7):  # to 4 %
        middle = np.sqrt(low * high)
        low, high = (low, middle) if grows(scene, middle) else (middle, high)
    return low


@pytest.mark.parametrize(("pitches", "chain"), [(5, "double_pin"), (35, "double_pin"), (35, "single_pin")])
def test_bushing_damping_limits_rk4_where_predicted(rig, pitches, chain):
    """The zigzag of a straight strand decays fastest; in a small round loop it is slower by a seventh."""
    scene = free_loop(rig, pitches, chain=chain, bushing__stiffness=0.0, bushing__damping=12.4)
    found = limits(scene, "rk4")
    assert list(found) == ["damping of the bushing"]
    predicted = found["damping of the bushing"]
    ratio = measured(scene, predicted) / predicted
    assert 0.95 < ratio < 1.4


@pytest.mark.parametrize(
    ("stiffness", "damping", "cause"),
    [(1e9, 100.0, "stiffness of the cut (closure)"), (1e6, 1e4, "damping of the cut (closure)")],
)
def test_compliant_cut_limits_rk4_where_predicted(rig, stiffness, damping, cause):
    scene = free_loop(
        rig, 5, closure="elastic_damping", bushing__stiffness=0.0, bushing__damping=0.1,
        closure__stiffness=stiffness, closure__damping=damping,
    )  # fmt: skip
    found = limits(scene, "rk4")
    assert min(found, key=found.get) == cause
    ratio = measured(scene, found[cause]) / found[cause]
    # the bodies beyond the two at the cut make it a little slower
    assert 0.9 < ratio < 1.4


def test_scene_refuses_a_step_beyond_the_limit_of_its_cut(rig):
    scene = free_loop(rig, 5, closure="elastic_damping", bushing__damping=0.1)
    with pytest.raises(InputError, match=r"step = 0\.0001 is not accepted: too large for the stiffness of the cut"):
        scene.with_(step=1e-4)
    scene.with_(step=1e-4, integrator="semi_implicit")

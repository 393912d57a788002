"""Predicted step limits: by method, and against the instability of a loop without wheels."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.kinematics import closed_rates, set_model, spinning_loop
from trackdyn.inputs.errors import DivergenceError
from trackdyn.integrate.methods import METHODS
from trackdyn.scene.scene import Scene
from trackdyn.scene.step import FRICTION_LEEWAY, elastic_depth, step_limits

RK4 = METHODS["rk4"]


def limits(of, integrator):
    """Return limits of a scene or a loop at the pre-tension of its rig."""
    rig = getattr(of, "scene", of).rig
    return step_limits(of.model, rig.tension.pre_tension, METHODS[integrator])


def test_reach_is_the_edge_of_the_stability_region():
    """Growth factor of RK4 on an oscillation and on a decay: 1 at its reach."""

    def growth(z):
        return abs(1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24)

    oscillation, decay = RK4.oscillation, RK4.decay
    assert oscillation == pytest.approx(np.sqrt(8), abs=0.01)
    # rounded down to two decimals: just inside, and outside a hundredth further
    for inside, outside in ((1j * oscillation, 1j * (oscillation + 0.01)), (-decay, -decay - 0.01)):
        assert growth(inside) <= 1 < growth(outside)


@pytest.mark.parametrize("ring", [0.308, None])
def test_limits_of_rk4_are_larger_by_its_reach(make_scene, ring):
    scene = make_scene(ring_radius=ring)
    euler, rk4 = limits(scene, "semi_implicit"), limits(scene, "rk4")
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


def resting_loop(rig, pitches, closure="rigid", chain="double_pin", **changes):
    small = rig.changed(chain__pitches=pitches, sensor__pitch=1, gravity=0.0, **changes)
    scene = Scene(small, 0.0, ring_radius=None, integrator="rk4", closure=closure, chain=chain, step=1e-6)
    return spinning_loop(scene)


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


def measured(start, guess):
    """Return the largest stable step, by bisection within a decade around ``guess``."""
    low, high = guess / 5, guess * 5
    assert not grows(start, low) and grows(start, high)
    for _ in range(7):  # to 4 %
        middle = np.sqrt(low * high)
        low, high = (low, middle) if grows(start, middle) else (middle, high)
    return low


NO_SPRING = {"bushing__stiffness": 0.0, "bushing__damping": 12.4}
CUT = {"closure": "elastic_damping", "bushing__stiffness": 0.0, "bushing__damping": 0.1}


CAUSES = [
    (5, NO_SPRING, "damping of the bushing"),
    (35, NO_SPRING, "damping of the bushing"),
    (35, NO_SPRING | {"chain": "single_pin"}, "damping of the bushing"),
    (5, CUT | {"closure__stiffness": 1e9, "closure__damping": 100.0}, "stiffness of the cut (closure)"),
    (5, CUT | {"closure__stiffness": 1e6, "closure__damping": 1e4}, "damping of the cut (closure)"),
]


@pytest.mark.parametrize(("pitches", "fields", "cause"), CAUSES)
def test_damping_and_a_compliant_cut_limit_rk4_where_predicted(rig, pitches, fields, cause):
    """The zigzag of a straight strand decays fastest, in a small round loop slower by a seventh."""
    loop = resting_loop(rig, pitches, **fields)
    bounds = limits(loop, "rk4")
    assert min(bounds, key=bounds.get) == cause
    ratio = measured(loop, bounds[cause]) / bounds[cause]
    assert (0.95 if fields["bushing__damping"] > 1 else 0.9) < ratio < 1.4


@pytest.mark.parametrize("stiffness", [1e12, 1e8, 1.0, 1e-200])
def test_a_contact_of_any_stiffness_carries_its_load_at_its_elastic_depth(stiffness):
    depth = elastic_depth(SimpleNamespace(stiffness=stiffness), 3e3, 0.02)
    assert stiffness * depth * (depth / (depth + 0.02)) ** 0.5 == pytest.approx(3e3, rel=1e-12)

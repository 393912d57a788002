"""An integrator is one entry: set from outside it is chosen, limited and run."""

import pytest

from tests.kinematics import spinning_loop
from trackdyn.integrate.methods import METHODS, Method, Tableau
from trackdyn.scene.scene import Scene
from trackdyn.scene.step import step_limits


def test_an_entry_from_outside_is_an_integrator(rig, monkeypatch):
    """Kutta's method of order 3: chosen by its name, run, and limited by its reach."""
    tableau = Tableau([[0, 0, 0], [1 / 2, 0, 0], [-1, 2, 0]], [1 / 6, 2 / 3, 1 / 6])
    rk3, rk4 = Method(order=3, oscillation=1.73, decay=2.51, tableau=tableau), METHODS["rk4"]
    monkeypatch.setitem(METHODS, "rk3", rk3)
    scene = Scene(rig, 115.0, integrator="rk3", ring_radius=None, step=5e-5)
    assert scene.fidelity["integrator"].setting == "rk3"
    loop = spinning_loop(scene)
    loop.step(2)
    assert len(loop.arrays.optional.stages.b) == 3
    assert loop.time == pytest.approx(1e-4) and loop.gap < 1.1e-10
    limits, expected = (step_limits(loop.model, 0.0, method) for method in (rk3, rk4))
    for cause, limit in limits.items():
        ratio = rk3.decay / rk4.decay if "damping" in cause else rk3.oscillation / rk4.oscillation
        assert limit / expected[cause] == pytest.approx(ratio, rel=1e-12)

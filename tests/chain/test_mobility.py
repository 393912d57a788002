"""Mobility of a straight chain against the mass matrix of its coordinates."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.kinematics import mass_matrix
from trackdyn.model.constants import Chain
from trackdyn.scene.build import mobility_of_slip


@pytest.mark.parametrize("fraction", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("x", [-0.8, 0.5])
def test_mobility_of_a_sliding_point_is_that_of_the_mass_matrix(fraction, x):
    """Its slip is ``x``, the normal's component along the chain, times its displacement, less arm times rotation."""
    rng, n, middle, arm = np.random.default_rng(4), 41, 20, 0.03
    length, mass = rng.uniform(0.05, 0.2, n), rng.uniform(1, 12, n)
    bodies = length, mass, mass * length**2 / 9, rng.uniform(0.3, 0.7, n) * length, np.zeros(n)
    along, slip = fraction * length[middle], np.zeros(n + 2)
    slip[1], slip[2 : 2 + middle], slip[2 + middle] = x, x * length[:middle], x * along - arm
    matrix = mass_matrix(Chain(*bodies, 0.0, 0.0, 0.0, 9.81), SimpleNamespace(pin=np.zeros(4), angle=np.zeros(n)))
    # bodies behind the tenth one are below rounding
    rolled = Chain(*(np.roll(values, -middle) for values in bodies), 0.0, 0.0, 0.0, 9.81)
    a, b, c = mobility_of_slip(rolled, 0, along, arm)
    assert (a * x + b) * x + c == pytest.approx(slip @ np.linalg.solve(matrix, slip), rel=1e-9)


@pytest.mark.parametrize("kind", ["double_pin", "single_pin"])
def test_symmetric_arcs_of_a_connector_meet_the_same_mass(make_scene, kind):
    model = make_scene(chain=kind).model
    left, right = (mobility_of_slip(model.chain, model.shoes.arc_body[k], model.shoes.arc_x[k], 0.0)[0] for k in (0, 1))
    assert left == pytest.approx(right, rel=1e-12)
    assert left == pytest.approx(model.tooth.mobility, rel=1e-12)
    chain = model.chain
    assert 1 / chain.mass.sum() < left < 1 / chain.mass.min() + chain.length.max() ** 2 / chain.inertia.min()

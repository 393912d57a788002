"""Mobility of a straight chain against the mass matrix of its coordinates."""

import numpy as np
import pytest

from trackdyn.model.constants import Chain
from trackdyn.scene.build import build_chain, mobility_of_slip


def by_mass_matrix(chain, body, along, arm=0.0, x=1.0):
    """Return the mobility of a free straight chain with one displacement and ``n`` angles as coordinates.

    The slip of a sliding point is its displacement times ``x``, less ``arm`` times the rotation.
    """
    n = len(chain.mass)

    def across(i, at):
        row = np.zeros(n + 1)
        row[0], row[1 : 1 + i], row[1 + i] = 1.0, chain.length[:i], at
        return row

    matrix = np.diag([0.0, *chain.inertia])
    for i in range(n):
        matrix += chain.mass[i] * np.outer(across(i, chain.com_x[i]), across(i, chain.com_x[i]))
    slip = x * across(body, along)
    slip[1 + body] -= arm
    return slip @ np.linalg.solve(matrix, slip)


@pytest.fixture
def uneven():
    """Return a chain of different bodies, its middle body, and the chain from there on; the tenth is below rounding."""
    rng, n, middle = np.random.default_rng(4), 41, 20
    length, mass = rng.uniform(0.05, 0.2, n), rng.uniform(1, 12, n)
    chain = Chain(
        length, mass, mass * length**2 / 9, rng.uniform(0.3, 0.7, n) * length, np.zeros(n), 0.0, 0.0, 0.0, 9.81
    )
    return chain, middle, Chain(*(np.roll(values, -middle) for values in chain[:5]), *chain[5:])


@pytest.mark.parametrize("fraction", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("x", [-0.8, 0.5])
def test_mobility_of_a_sliding_point_is_that_of_the_mass_matrix(uneven, fraction, x):
    """The normal has the component x along the chain."""
    (chain, middle, rolled), arm = uneven, 0.03
    along = fraction * chain.length[middle]
    a, b, c = mobility_of_slip(rolled, 0, along, arm)
    assert (a * x + b) * x + c == pytest.approx(by_mass_matrix(chain, middle, along, arm, x), rel=1e-9)


@pytest.mark.parametrize("kind", ["double_pin", "single_pin"])
def test_arcs_of_a_pitch_meet_the_same_mass(make_scene, kind):
    """Links and connectors are symmetric, so are the places of the two arcs of a connector."""
    scene = make_scene(chain=kind)
    model = scene.model
    left, right = (mobility_of_slip(model.chain, model.shoes.arc_body[k], model.shoes.arc_x[k], 0.0)[0] for k in (0, 1))
    assert left == pytest.approx(right, rel=1e-12)
    assert left == pytest.approx(model.tooth.mobility, rel=1e-12)
    chain = build_chain(scene.rig, kind)
    assert 1 / chain.mass.sum() < left < 1 / chain.mass.min() + chain.length.max() ** 2 / chain.inertia.min()

"""The contacts against an independent multibody code, and what happens where it is missing."""

import sys

import numpy as np
import pytest

from replication.peers import exudyn_loop
from replication.peers.contact import Memory, force_vector, jacobian_triplets, make_contacts, peer_contact_loads
from replication.peers.exudyn_loop import drive_at, require_exudyn
from tests.kinematics import without_extrapolation
from trackdyn.inputs.errors import InputError
from trackdyn.integrate.run import refresh
from trackdyn.scene.scene import Scene

pytestmark = pytest.mark.peer


@pytest.fixture
def both_contacts(rig, driven_loop):
    """Contacts of a driven loop: model, state, work, and the peer's constants, coordinates, rates and memory."""

    def make(ring_radius):
        loop = driven_loop(ring_radius)
        model, state, work, _ = loop.arrays
        model = without_extrapolation(model, work)
        w = model.wheels
        contacts = make_contacts(Scene(rig, 115.0, ring_radius=ring_radius), 0.0)
        radius = w.radius * w.present
        contacts = contacts._replace(circle=np.column_stack([w.x, w.y, radius]))
        q, v = (
            np.concatenate([coordinate.ravel(), np.zeros(2)])
            for coordinate in exudyn_loop.coordinates(model.chain, state)
        )
        v[-2:] = state.wheel_rate[1:]
        return model, state, work, contacts, q, v, Memory(state.tooth_impact.copy(), state.wheel_impact.copy())

    return make


@pytest.mark.parametrize("ring_radius", [None, 0.303, 0.308])
def test_both_contact_laws_give_the_same_loads(ring_radius, both_contacts):
    model, state, work, contacts, q, v, memory = both_contacts(ring_radius)
    refresh(model, state, work)
    n = len(state.angle)
    load, torque = np.zeros((n, 3)), np.zeros((n, 3))
    peer_contact_loads(
        contacts, model.chain.length, q, v, state.wheel_angle[0], state.wheel_rate[0], memory, False, load, torque
    )
    ours = np.column_stack([work.force_x, work.force_y, work.moment])
    assert np.count_nonzero(ours[1::2, 0]) > 0  # some teeth bear
    # N and N m on loads of some thousand: what rounding of positions leaves under stiff steel
    assert np.abs(load - ours).max() < 1e-5
    assert np.abs(torque.sum(axis=0) - work.wheel_torque).max() < 1e-5


def test_derivatives_of_the_contacts_are_those_of_the_forces(both_contacts):
    model, state, _, contacts, q, v, memory = both_contacts(0.308)
    n, length = len(state.angle), model.chain.length
    drive = state.wheel_angle[0], state.wheel_rate[0]
    load, torque = np.zeros((n, 3)), np.zeros((n, 3))
    loads, torques, triplets = np.zeros((2, n, 3)), np.zeros((2, n, 3)), np.zeros((40 * n, 3))
    count = jacobian_triplets(contacts, length, q, v, *drive, memory, 2.0, 3.0, loads, torques, triplets)
    matrix = np.zeros((3 * n + 2, 3 * n + 2))
    np.add.at(matrix, (triplets[:count, 0].astype(int), triplets[:count, 1].astype(int)), triplets[:count, 2])
    direction = np.random.default_rng(1).standard_normal((2, 3 * n + 2))
    sides = []
    for sign in (1, -1):
        force = np.zeros(3 * n + 2)
        # positions count twice, velocities three times; the nudges stay within one contact state
        force_vector(contacts, length, q + sign * 2e-9 * direction[0], v + sign * 3e-9 * direction[0], *drive, memory,
                     load, torque, force)  # fmt: skip
        sides.append(force)
    slope = -(sides[0] - sides[1]) / 2e-9
    assert np.abs(matrix @ direction[0] - slope).max() < 1e-3 * np.abs(slope).max()


def test_ramp_of_the_sprocket_is_integrated_exactly(make_scene):
    drive = make_scene(115.0).model.drive
    times = np.linspace(0, 2 * drive.ramp, 4001)
    angle, rate = np.array([drive_at(drive, t) for t in times]).T
    assert rate[-1] == drive.rate
    sums = np.concatenate([[0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(times))])
    assert np.abs(sums - angle).max() < 1e-6


@pytest.fixture
def without_exudyn(monkeypatch):
    """As if it were not installed."""
    monkeypatch.setitem(sys.modules, "exudyn", None)


def test_missing_extra_is_named(without_exudyn):
    with pytest.raises(InputError) as caught:
        require_exudyn()
    assert str(caught.value) == "exudyn is not installed; in the clone: pip install -e '.[peers]'"

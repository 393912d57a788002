"""The contacts against an independent multibody code, and the message where it is missing."""

import sys

import numpy as np
import pytest

from tests.conftest import refused
from tests.kinematics import without_extrapolation
from trackdyn.integrate.run import refresh
from trackdyn.scene.scene import Scene
from trackdyn_replication.peers import exudyn_loop
from trackdyn_replication.peers.contact import Memory, make_contacts, peer_contact_loads
from trackdyn_replication.peers.exudyn_loop import require_exudyn

pytestmark = pytest.mark.peer


@pytest.mark.parametrize("ring_radius", [None, 0.303, 0.308])
def test_both_contact_laws_give_the_same_loads(rig, driven_loop, ring_radius):
    model, state, work, _ = driven_loop(ring_radius).arrays
    model = without_extrapolation(model, work)
    wheels, contacts = model.wheels, make_contacts(Scene(rig, 115.0, ring_radius=ring_radius), 0.0)
    contacts = contacts._replace(circle=np.column_stack([wheels.x, wheels.y, wheels.radius * wheels.present]))
    q, v = (np.append(coordinate, np.zeros(2)) for coordinate in exudyn_loop.coordinates(model.chain, state))
    v[-2:] = state.wheel_rate[1:]
    memory = Memory(state.tooth_impact.copy(), state.wheel_impact.copy())
    refresh(model, state, work)
    load, torque = np.zeros((2, len(state.angle), 3))
    sprocket = state.wheel_angle[0], state.wheel_rate[0]
    peer_contact_loads(contacts, model.chain.length, q, v, *sprocket, memory, False, load, torque)
    ours = np.column_stack([work.force_x, work.force_y, work.moment])
    assert np.count_nonzero(ours[1::2, 0]) > 0  # some teeth bear
    # N and N m on loads of some thousand: rounding of positions under stiff steel
    assert np.abs(load - ours).max() < 1e-5
    assert np.abs(torque.sum(axis=0) - work.wheel_torque).max() < 1e-5


def test_missing_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "exudyn", None)
    refused(require_exudyn, start="exudyn is not installed; in the clone: pip install -e '.[peers]'")

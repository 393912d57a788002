"""Places and velocities of the bodies of a loop, its contacts as rows, and loops that move as a test wants them."""

from types import SimpleNamespace

import numpy as np
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

from trackdyn.integrate.methods import METHODS
from trackdyn.model.arrays import components, make_arrays, make_record
from trackdyn.model.constants import Chain
from trackdyn.scene.build import suspensions_of
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.loop_arrays import LoopArrays, allocate
from trackdyn.simulation.settling import Layout


class ContactList:
    """The contacts of a work, a row each; those of one wheel, or of some kinds, if they are given.

    ``surface`` is the velocity of the wheel's point at unit rate, ``spoke`` its position from the wheel's centre,
    ``slip`` the velocity of the body's point against the wheel's.
    """

    def __init__(self, work, wheel=None, kinds=None, axes="xy"):
        rows = work.contact[: work.count[0]]
        if wheel is not None:
            rows = rows[rows["wheel"] == wheel]
        if kinds is not None:
            rows = rows[np.isin(rows["kind"], kinds)]
        self.rows, self.body, self.wheel, self.kind = rows, rows["body"], rows["wheel"], rows["kind"]
        self.normal, self.friction, self.arm, self.surface, speed = (
            components(rows, name, axes) for name in ("normal", "friction", "arm", "spin", "speed")
        )
        self.spoke = self.surface[:, 1::-1] * [1, -1]
        self.slip = speed - rows["rate"][:, None] * self.surface
        self.force = np.linalg.norm(self.normal, axis=1)


def along_chain(start, change):
    """(n + 1, k) values at the pins: that of the first one and the changes (n, k) from pin to pin."""
    return np.cumsum(np.vstack([start, change]), axis=0)


def pins(chain, state):
    """(n + 1, 2) pins; the last one is the first one again if the loop is closed."""
    return along_chain(state.pin[:2], chain.length[:, None] * np.transpose([np.cos(state.angle), np.sin(state.angle)]))


def mass_centre_arms(chain, state):
    """(n, 2) mass centres from the input pins."""
    c, s = np.cos(state.angle), np.sin(state.angle)
    return np.column_stack([c * chain.com_x - s * chain.com_y, s * chain.com_x + c * chain.com_y])


def mass_centres(chain, state):
    """(n, 2) mass centres."""
    return pins(chain, state)[:-1] + mass_centre_arms(chain, state)


def bodies_in_space(chain, state):
    """Attitudes of the plane and of all bodies; their angular velocities, arms to mass centre and output pin."""
    plane, zero = Rotation.from_quat(np.roll(state.plane.attitude, -1)), np.zeros(len(state.angle))
    attitude = plane * Rotation.from_rotvec(np.column_stack([zero, zero, state.angle]))
    omega = plane.apply(np.column_stack([*np.add.outer(state.plane.motion[2:], zero), state.rate]))
    centre = attitude.apply(np.column_stack([chain.com_x, chain.com_y, zero]))
    end = attitude.apply(np.column_stack([chain.length, zero, zero]))
    return plane.as_matrix(), attitude.as_matrix(), omega, centre, end


def mass_matrix(chain, state):
    """(n + 2, n + 2) mass matrix of the chain, open, over its first pin and its angles."""
    n, side = len(chain.mass), np.diff(pins(chain, state), axis=0) @ [[0, 1], [-1, 0]]
    centre, matrix = mass_centre_arms(chain, state) @ [[0, 1], [-1, 0]], np.diag([0.0, 0.0, *chain.inertia])
    for i in range(n):
        to_centre = np.vstack([np.eye(2), side[:i], centre[i], np.zeros((n - 1 - i, 2))])
        matrix += chain.mass[i] * to_centre @ to_centre.T
    return matrix


def closed_rates(length, angle, rate):
    """Rates of the bodies of a loop, with the least change that keeps it closed."""
    rows = length * np.array([-np.sin(angle), np.cos(angle)])
    return rate - rows.T @ np.linalg.solve(rows @ rows.T, rows @ rate)


def irregular_ring(n, rng, size=(0.08, 0.04)):
    """Lengths, angles and first corner of a convex clockwise ring that closes exactly; ``size`` (m) a body over pi."""
    turn = -2 * np.pi * (np.arange(n) + rng.uniform(-0.2, 0.2, n)) / n
    corner = n / np.pi * np.column_stack([size[0] * np.cos(turn), size[1] * np.sin(turn)])
    side = np.roll(corner, -1, axis=0) - corner
    return np.hypot(*side.T), np.unwrap(np.arctan2(side[:, 1], side[:, 0])), corner[0]


def irregular_chain(n, rng):
    """A ring of ``n`` bodies that differ: its chain, angles and first corner, rates that keep it closed, and loads."""
    length, angle, corner = irregular_ring(n, rng)
    mass = rng.uniform(1.0, 15.0, n)
    inertia = mass * (length * rng.uniform(0.2, 0.5, n)) ** 2
    com = length * rng.uniform(0.2, 0.8, n), rng.uniform(-0.02, 0.02, n)
    rate = closed_rates(length, angle, rng.normal(0, 4, n))
    loads = rng.normal(0, 2000, n), rng.normal(0, 2000, n), rng.normal(0, 60, n)
    return Chain(length, mass, inertia, *com, 130.0, 10.0, -0.036, 9.81), angle, corner, rate, loads


def without_extrapolation(model, work):
    """A model whose contacts know nothing of the last step, and a work that has forgotten it."""
    for change in (work.com_dvx, work.com_dvy, work.delta_omega):
        change[:] = 0.0
    wheels = model.wheels._replace(slip=np.zeros_like(model.wheels.slip))
    return model._replace(tooth=model.tooth._replace(mobility=0.0), wheels=wheels)


def unsettled_loop(scene):
    """A loop whose state is allocated and zero: nothing is compiled for it."""
    loop = Loop.__new__(Loop)
    loop.scene, loop.layout, loop.arrays = scene, Layout(), allocate(scene, scene.time_step)
    return loop


def spinning_loop(scene):
    """The chain of a scene as an oblong clockwise loop that touches nothing and spins as its sprocket."""
    loop = unsettled_loop(scene)
    model, spin = loop.arrays.model, scene.sprocket_rate
    wheels = {name: column[:1] for name, column in model.wheels._asdict().items() if np.ndim(column)}
    wheels = model.wheels._replace(**wheels | {"present": np.zeros(1, int)})
    model = model._replace(wheels=wheels, tooth=model.tooth._replace(present=0), suspensions=suspensions_of([], 1))
    state, work, optional = make_arrays(model, METHODS[scene.integrator])
    phase = -2 * np.pi * np.arange(scene.bodies) / scene.bodies

    def angles(first):  # the second harmonic makes the loop oblong, the first one closes it
        return phase + 0.3 * np.sin(2 * phase) + first @ [np.cos(phase), np.sin(phase)]

    def gap(first):
        return np.array([np.cos(angles(first)), np.sin(angles(first))]) @ model.chain.length

    state.angle[:] = angles(fsolve(gap, np.zeros(2), xtol=1e-15, full_output=True)[0])
    state.pin[:2] -= pins(model.chain, state)[:-1].mean(axis=0)
    state.rate[:] = spin
    state.pin[2:] = [-spin * state.pin[1], spin * state.pin[0]]
    loop.arrays = LoopArrays(model, state, work, optional)
    return loop


def set_model(loop, **fields):
    """Change fields of the model that no scene would have, such as a step beyond its limits."""
    loop.arrays = loop.arrays._replace(model=loop.arrays.model._replace(**fields))


def next_samples(loop, samples, pitches=(), frame_stride=0, log_rows=0):
    """Arrays of the next samples by the time loop, ``log_rows`` contacts that end among them."""
    frames = -(-samples // frame_stride) if frame_stride else 0
    record = make_record(samples, loop.state, len(loop.model.sensors.body), pitches, frames, frame_stride, log_rows)
    loop.fill(record, 0, samples)
    return SimpleNamespace(**record._asdict() | record.samples._asdict())

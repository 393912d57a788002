"""Quantities of a loop: positions, velocities, joint forces, energies and sensor signals."""

import numpy as np
from numpy.typing import ArrayLike

from trackdyn.chain.kinematics import rotated
from trackdyn.integrate.energy import energies
from trackdyn.integrate.run import refresh
from trackdyn.model.arrays import ENERGY_NAMES, Record, State, Work
from trackdyn.model.constants import Model
from trackdyn.rig.rig import Rig
from trackdyn.simulation.loop_arrays import LoopArrays


def specific_force(acceleration: ArrayLike, angle: ArrayLike, gravity: float = 9.81) -> np.ndarray:
    """Return the specific force ``a_t = a_s + A_t^T G`` (Eq. 40), (..., 2) in the link frame, m/s2.

    At rest on a level link it is ``gravity`` along y. ``acceleration`` (..., 2) is that of the sensor's point in the
    link frame, m/s2; ``angle`` (...) is that of the link's x axis, rad.
    """
    projection = np.stack([np.sin(angle), np.cos(angle)], axis=-1) * gravity
    return np.asarray(acceleration, dtype=float) + projection


def sensor_signal(motion: np.ndarray, rig: Rig, limit: float = np.inf) -> np.ndarray:
    """Return signals of sensors (Eq. 40), (..., 2) along the body and the outward normal, clipped at ``limit``, g.

    ``motion`` (..., 3) holds accelerations (m/s2) and angles (rad) as in ``Recording.mean``.
    """
    return np.clip(specific_force(motion[..., :2], motion[..., 2], rig.gravity) / rig.g, -limit, limit)


class Readings:
    """Present quantities of a loop that has ``n`` bodies, ``p`` pitches, ``w`` wheels and ``k`` sensors.

    ``model``, ``state`` and ``work`` are read-only views of the arrays of kernels (`trackdyn.model`); ``arrays`` can be
    written to, unchecked.
    """

    arrays: LoopArrays
    _views: LoopArrays
    _scratch: Record  # one row: the last step, or the last chunk of steps

    @property
    def model(self) -> Model:  # noqa: D102
        return self._views.model

    @property
    def state(self) -> State:  # noqa: D102
        return self._views.state

    @property
    def work(self) -> Work:  # noqa: D102
        return self._views.work

    @property
    def time(self) -> float:
        """Time since the sprocket began to turn, s."""
        return float(self.arrays.state.steps[0] * self.arrays.model.step)

    @property
    def pins(self) -> np.ndarray:
        """(n + 1, 2) input pins of the bodies and output pin of the last one, m."""
        refresh(*self.arrays)
        return np.column_stack([self.arrays.work.pin_x, self.arrays.work.pin_y])

    @property
    def mass_centres(self) -> np.ndarray:
        """(n, 2) mass centres of the bodies, m."""
        return self.pins[:-1] + self._arms

    @property
    def momentum(self) -> np.ndarray:
        """(3,) momentum (N s) and angular momentum about the inertial origin (N m s) of the chain."""
        (x, y), work, chain = self.mass_centres.T, self.arrays.work, self.arrays.model.chain
        px, py = chain.mass * work.com_vx, chain.mass * work.com_vy
        return np.array([px.sum(), py.sum(), (chain.inertia * self.arrays.state.rate + x * py - y * px).sum()])

    @property
    def tension(self) -> float:
        """Tension of the chain at the cut joint in the last step, N."""
        return float(np.hypot(*self.arrays.work.sweep.load[:2]))

    @property
    def joint_forces(self) -> np.ndarray:
        """(n, 2) force of body i on body i + 1 through the joint between them in the last step, N.

        It follows from Newton's law along the chain, from the cut (the last entry) on, with the accelerations of that
        step and the contacts of the present state, one step later.
        """
        chain, work, sweep = self.arrays.model.chain, self.arrays.work, self.arrays.work.sweep
        alpha, acceleration = sweep.response @ sweep.load, sweep.base @ sweep.load
        rate2 = self.arrays.state.rate**2
        links = chain.length[:, None] * np.column_stack([work.cos, work.sin])

        def relative(r: np.ndarray) -> np.ndarray:
            return alpha[:, None] * np.column_stack([-r[:, 1], r[:, 0]]) - rate2[:, None] * r

        pins = acceleration + np.vstack([np.zeros(2), np.cumsum(relative(links), axis=0)[:-1]])
        outer = np.column_stack([work.force_x, work.force_y - chain.mass * chain.gravity])
        passed = outer - chain.mass[:, None] * (pins + relative(self._arms))
        return np.asarray(sweep.load[:2]) + np.cumsum(passed, axis=0)

    @property
    def energy(self) -> dict[str, float]:
        """Energy balance and energies by name (`model.arrays.ENERGY_NAMES`), J."""
        refresh(*self.arrays)
        out = np.zeros(len(ENERGY_NAMES))
        energies(*self.arrays[:3], self.arrays.optional.space, out)
        return dict(zip(ENERGY_NAMES, out.tolist(), strict=True))

    @property
    def gap(self) -> float:
        """Distance of the two pins of the cut joint, m."""
        refresh(*self.arrays)
        return float(np.hypot(*self.arrays.work.cut[:2]))

    @property
    def _arms(self) -> np.ndarray:
        """(n, 2) vectors from the input pin of each body to its mass centre, m."""
        chain, work = self.arrays.model.chain, self.arrays.work
        return np.column_stack(rotated.py_func(chain.com_x, chain.com_y, work.cos, work.sin))

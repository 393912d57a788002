"""Signals of sensors (Eq. 40)."""

import numpy as np
from numpy.typing import ArrayLike

from trackdyn.rig.rig import Rig


def specific_force(acceleration: ArrayLike, angle: ArrayLike, gravity: float = 9.81) -> np.ndarray:
    """Return the specific force ``a_t = a_s + A_t^T G`` (Eq. 40), (..., 2) in the link frame, m/s2.

    At rest on a level link it is ``gravity`` along y. ``acceleration`` (..., 2) is that of the sensor's point in the
    link frame, m/s2; ``angle`` (...) is that of the link's x axis, rad.
    """
    return np.asarray(acceleration, dtype=float) + np.stack([np.sin(angle), np.cos(angle)], axis=-1) * gravity


def sensor_signal(motion: np.ndarray, rig: Rig, limit: float = np.inf) -> np.ndarray:
    """Return signals (Eq. 40) of ``Recording.mean``, (..., 2) along the body and its normal, clipped at a limit, g."""
    return np.clip(specific_force(motion[..., :2], motion[..., 2], rig.gravity) / rig.g, -limit, limit)


def normal_signal(motion: np.ndarray, rig: Rig, limit: float = np.inf) -> np.ndarray:
    """Return signals as `sensor_signal` along the outward normal only, (...), g."""
    return np.clip(_normal_force(motion, rig.gravity) / rig.g, -limit, limit)


def _normal_force(motion: np.ndarray, gravity: float) -> np.ndarray:
    """Return the y component of `specific_force`, the other of which is half of its time."""
    return motion[..., 1] + np.cos(motion[..., 2]) * gravity


def mean_square(motion: np.ndarray, gravity: float) -> float:
    """Return the mean square of the sensor's y acceleration (Eq. 40), m2/s4; ``motion`` as in ``Recording.mean``."""
    return float((_normal_force(motion, gravity) ** 2).mean())

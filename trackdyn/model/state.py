"""Everything that a run carries from step to step, written in place."""

from typing import NamedTuple

import numpy as np

from trackdyn.model.constants import zeros

OFFSET, SPEED, P, Q = range(4)  # entries of the plane's motion
# motion of a carrier: way or turn q from its rest position (m or rad), its rate and that before the last step, and the
# direction in which the wheel moved in that step (`integrate.carriers.along`)
SLIDE = np.dtype([(name, float) for name in ("q", "rate", "rate_before", "along_x", "along_y")])


class Plane(NamedTuple):
    """State of the plane of the chain (`chain.plane`)."""

    # (4,) offset and speed of the plane along its normal (m, m/s): z components of the pin's position and velocity; its
    # angular velocities p and q (rad/s). All in components of the plane's frame
    motion: np.ndarray
    attitude: np.ndarray  # (4,) Euler parameters of ``A_P``, the scalar first


class State(NamedTuple):
    """State of a chain of ``n`` bodies and ``p`` pitches on ``w`` wheels."""

    steps: np.ndarray  # (1,) integers: steps taken; the time is ``steps * step``
    pin: np.ndarray  # (4,) position and velocity of the input pin of body 1 (m, m/s)
    # angle, rate: (n,) orientation (rad) and angular velocity (rad/s) of the bodies
    angle: np.ndarray
    rate: np.ndarray
    # wheel_angle, wheel_rate: (w,) the same of the wheels
    wheel_angle: np.ndarray
    wheel_rate: np.ndarray
    # (2 p,) stored initial impact velocity of the left (even entries) and right (odd) arc of the ``p`` connectors, 0
    # without contact, m/s
    tooth_impact: np.ndarray
    wheel_impact: np.ndarray  # (p, w) the same for link and wheel
    work_done: np.ndarray  # (7,) work by entry of the energy balance (`model.record`), J
    slide: np.ndarray  # (k,) a `SLIDE` of every carrier of a wheel
    branch: np.ndarray  # (b, n) moment of every Maxwell branch of every bushing, N m
    plane: Plane | None = None  # the plane of the chain; None in planar motion


def make_state(n: int, pitches: int, wheels: int, carriers: int = 0, branches: int = 0) -> State:
    """Allocate the planar state of ``n`` bodies and ``pitches`` pitches on ``wheels`` wheels, everything 0."""
    return State(
        steps=np.zeros(1, np.int64),
        **zeros(pin=4, angle=n, rate=n, wheel_angle=wheels, wheel_rate=wheels, work_done=7),
        **zeros(tooth_impact=2 * pitches, wheel_impact=(pitches, wheels), branch=(branches, n)),
        slide=np.zeros(carriers, SLIDE),
    )

"""Bearings of the wheels that turn freely."""

from math import tanh

from trackdyn.jit import kernel
from trackdyn.model.constants import Wheels

# rate below which a torque of Coulomb friction fades, rad/s: a twentieth of the slowest running
SLOW = 0.1


@kernel
def bearing_drag(wheels: Wheels, wheel, rate):
    """Torque of a wheel's bearing over its rate (rad/s), N m s/rad: viscous, and the secant of a constant torque.

    The constant torque fades below ``SLOW``.
    """
    drag = wheels.drag[wheel]
    if wheels.torque[wheel] > 0.0:
        turning = max(abs(rate), 1e-6 * SLOW)
        drag += wheels.torque[wheel] * tanh(turning / SLOW) / turning
    return drag

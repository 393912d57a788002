"""Bearings of the wheels, and the rolling resistance of the links on them."""

from math import tanh

from trackdyn.jit import kernel
from trackdyn.model.constants import Wheels

# rate below which a torque of Coulomb friction or rolling resistance fades, rad/s: a twentieth of the slowest running
SLOW = 0.1


@kernel
def bearing_drag(wheels: Wheels, wheel, rate, carried):
    """Torque against a wheel's rotation over its rate (rad/s), N m s/rad.

    A viscous part, and the secant of a torque that fades below ``SLOW``: a constant one, and that of rolling
    resistance, ``rolling`` times the sum of the links' normal forces (``carried``, (w,), N).
    """
    drag, torque = wheels.drag[wheel], wheels.torque[wheel] + wheels.rolling[wheel] * carried[wheel]
    if torque > 0.0:
        turning = max(abs(rate), 1e-6 * SLOW)
        drag += torque * tanh(turning / SLOW) / turning
    return drag

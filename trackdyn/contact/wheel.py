"""Contact of a link with the ring, the idler or the road wheel (Eqs. 35 to 38), in the plane."""

from math import sqrt

from trackdyn.jit import kernel
from trackdyn.model.state import State


@kernel
def foot(ax, ay, bx, by, cx, cy):
    """Point of the segment AB nearest to the wheel's centre C: vertical, left-end or right-end case.

    Returns
    -------
    fraction : float
        Foot parameter before it is limited: 0 to 1 vertical, below 0 end A, above 1 end B.
    qx, qy : float
        The contact point Q on AB, m.
    distance : float
        From C to Q, m.
    """
    ux = bx - ax
    uy = by - ay
    s = ((cx - ax) * ux + (cy - ay) * uy) / (ux * ux + uy * uy)
    limited = min(max(s, 0.0), 1.0)
    qx = ax + limited * ux
    qy = ay + limited * uy
    dx = qx - cx
    dy = qy - cy
    return s, qx, qy, sqrt(dx * dx + dy * dy)


@kernel
def wheel_velocity(state: State, tensioner, wheel):
    """Velocity of a wheel's centre, m/s: 0 but for the one that slides."""
    if tensioner is None:
        return 0.0, 0.0
    if wheel != tensioner.wheel:
        return 0.0, 0.0
    return state.slide[1] * tensioner.along_x, state.slide[1] * tensioner.along_y

"""Contact of a link with the ring or another wheel (Eqs. 35 to 38), in the plane."""

from math import sqrt

from trackdyn.jit import kernel
from trackdyn.model.constants import SPROCKET, Law, Wheels
from trackdyn.model.state import ALONG_X, ALONG_Y, SLIDE_RATE, State


@kernel
def foot(ax, ay, bx, by, cx, cy):
    """Point of the segment AB nearest to the wheel's centre C: vertical, left-end or right-end case.

    Returned are the foot parameter before it is limited (0 to 1 vertical, below 0 end A, above 1 end B), the contact
    point Q on AB and its distance from C, m.
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
def wheel_law(wheels: Wheels, wheel, own):
    """Law of the links on a wheel; ``own`` is ``wheels.own_law``, without rows where two laws serve all."""
    if own.shape[0] == 0:
        return wheels.ring_law if wheel == SPROCKET else wheels.wheel_law
    return Law(own[wheel, 0], own[wheel, 1], own[wheel, 2], own[wheel, 3], own[wheel, 4], own[wheel, 5], own[wheel, 6])


@kernel
def wheel_velocity(state: State, carriers, wheel):
    """Velocity of a wheel's centre, m/s: 0 but for one on a carrier."""
    k = carriers.of_wheel[wheel]
    if k < 0:
        return 0.0, 0.0
    # the direction is that of the step before: a turn of an arm in one step is lost in rounding of the velocity
    return state.slide[k, SLIDE_RATE] * state.slide[k, ALONG_X], state.slide[k, SLIDE_RATE] * state.slide[k, ALONG_Y]


@kernel
def carry(carried, wheel, force):
    """Add a link's normal force (N) to what its wheel carries."""
    carried[wheel] += force


@kernel
def unload(carried):
    """Begin the sums of `carry` anew."""
    carried[:] = 0.0

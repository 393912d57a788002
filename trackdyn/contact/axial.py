"""Contact along the axes of the wheels: overlap, axial slip, centre guides (Eqs. 11, 19, 20, 32, 39).

A contact is computed in the frame of its wheel, which has the wheel's axis and does not spin: points in the middle
plane of the chain are transformed to it (Eqs. 15, 20); their x and y give area or closest point, depth and normal as in
planar motion, their z is the axial offset ``l_z``. The axial slip is the z component of the relative velocity. The
force acts in the middle plane of the chain, where depth and slip are taken: its work is the energy that the contact
stores and dissipates. In planar motion ``space`` is None, and the wheel's frame is the inertial one.
"""

from trackdyn.contact.laws import friction_coefficient
from trackdyn.jit import kernel
from trackdyn.model.arrays import OFFSET
from trackdyn.model.constants import INDEPENDENT, Space


@kernel
def to_wheel_frame(space, wheel, x, y, z):
    """Transform a vector from the plane's frame to the wheel's (`model.arrays.SpaceWork`)."""
    if space is None:
        return x, y, z
    b = space.relative
    return (
        b[wheel, 0, 0] * x + b[wheel, 0, 1] * y + b[wheel, 0, 2] * z,
        b[wheel, 1, 0] * x + b[wheel, 1, 1] * y + b[wheel, 1, 2] * z,
        b[wheel, 2, 0] * x + b[wheel, 2, 1] * y + b[wheel, 2, 2] * z,
    )


@kernel
def to_plane_frame(space, wheel, x, y, z):
    """Transform a vector from the wheel's frame to the plane's."""
    if space is None:
        return x, y, z
    b = space.relative
    return (
        b[wheel, 0, 0] * x + b[wheel, 1, 0] * y + b[wheel, 2, 0] * z,
        b[wheel, 0, 1] * x + b[wheel, 1, 1] * y + b[wheel, 2, 1] * z,
        b[wheel, 0, 2] * x + b[wheel, 1, 2] * y + b[wheel, 2, 2] * z,
    )


@kernel
def wheel_centre(model, space, wheel):
    """Return the centre of a wheel in its own frame, m."""
    if space is None:
        return model.wheels.x[wheel], model.wheels.y[wheel], 0.0
    centre = model.space.centre
    return centre[wheel, 0], centre[wheel, 1], centre[wheel, 2]


@kernel
def centre_in_plane(model, space, wheel):
    """Return the centre of a wheel in the plane's frame, m."""
    if space is None:
        return model.wheels.x[wheel], model.wheels.y[wheel], 0.0
    return space.centre[wheel, 0], space.centre[wheel, 1], space.centre[wheel, 2]


@kernel
def height(state, space):
    """Return the offset of the chain's plane along its normal, m."""
    return 0.0 if space is None else state.plane.motion[OFFSET]


@kernel
def overlap_ratio(space, kind, offset):
    """Return the overlap at an axial offset (m) over the contact length (Eq. 19); ``space`` is that of the model."""
    if space is None:
        return 1.0
    length = space.length[kind]
    return min(max(length + space.overhang[kind] - abs(offset), 0.0), length) / length


@kernel
def friction_coefficients(space, law, slip, axial_slip):
    """Return signed coefficients of the tangential and the axial friction force (Eqs. 10, 11), against the slip."""
    mu = friction_coefficient(law, slip)
    if space is None or space.friction != INDEPENDENT:
        return mu, 0.0
    return mu, friction_coefficient(law, axial_slip)


@kernel
def guide_force(space: Space, offset, speed):
    """Return the axial force (N) of a guide beyond its play, never in tension, at an offset (m) and its rate (m/s)."""
    depth = abs(offset) - space.clearance
    if depth <= 0.0:
        return 0.0
    side = 1.0 if offset > 0.0 else -1.0
    return -side * max(space.stiffness * depth + space.damping * side * speed, 0.0)

"""Neighbour lists: arcs and links close to a wheel, valid until something has moved too far.

A loop of 35 pitches has 175 pairs of a surface and a wheel, of which some 30 are ever close. The lists hold all pairs
closer than ``MARGIN`` to their contact and are made anew once the motion of pins, wheels and the chain's plane together
could exceed it (Verlet, Phys. Rev. 159, 1967, 98): no contact can be missed, at any speed.
"""

from math import sqrt

from trackdyn.chain.kinematics import on_pin_line
from trackdyn.contact.axial import centre_in_plane, height, to_wheel_frame, wheel_centre
from trackdyn.jit import kernel
from trackdyn.model.arrays import OFFSET, State, Work
from trackdyn.model.constants import SPROCKET, Model

MARGIN = 8e-3  # m; a link moves as far in a hundred steps
# Fractions of it for the motion of pins, wheels and the plane. Arcs and ends of links are at most half a body's length
# beyond its pins, so that they move at most twice as far as the pins do.
PINS, WHEELS, PLANE = 0.25, 0.25, 0.25


@kernel
def update(model: Model, state: State, work: Work, space):
    """Make the lists anew if they no longer hold; an arc or link that leaves them has no contact."""
    work.candidates.count[2] = 0
    if _valid(model, state, work, space):
        return
    candidates, shoes, tooth, wheels = work.candidates, model.shoes, model.tooth, model.wheels
    for i in range(work.pin_x.shape[0]):
        candidates.pin_x[i], candidates.pin_y[i] = work.pin_x[i], work.pin_y[i]
    for wheel in range(wheels.x.shape[0]):
        candidates.wheel[wheel, 0], candidates.wheel[wheel, 1] = wheels.x[wheel], wheels.y[wheel]
    if space is not None:
        for r in range(3):
            for k in range(3):
                candidates.plane[r, k] = space.attitude[r, k]
        candidates.plane[3, 0] = state.plane.motion[OFFSET]
        size = 0.0
        for i in range(work.pin_x.shape[0]):
            size = max(size, work.pin_x[i] ** 2 + work.pin_y[i] ** 2)
        candidates.plane[3, 1] = sqrt(size) + MARGIN  # largest distance moved per radian of the plane, m
    z = height(state, space)
    mx, my, mz = centre_in_plane(model, space, SPROCKET)
    arcs = 0
    for arc in range(shoes.arc_body.shape[0]):
        x, y = on_pin_line(work, shoes.arc_body[arc], shoes.arc_x[arc])
        lx, ly, _ = to_wheel_frame(space, SPROCKET, x - mx, y - my, z - mz)
        if model.tooth.present and lx * lx + ly * ly <= (tooth.addendum + tooth.arc_radius + MARGIN) ** 2:
            candidates.arc[arcs], arcs = arc, arcs + 1
        else:
            work.tooth_area[arc] = work.tooth_groove[arc] = 0
            work.tooth_force[arc] = state.tooth_impact[arc] = 0.0
    links = 0
    for link in range(shoes.link_body.shape[0]):
        body = shoes.link_body[link]
        middle_x, middle_y = on_pin_line(work, body, 0.5 * (shoes.link_start[link] + shoes.link_end[link]))
        half = 0.5 * (shoes.link_end[link] - shoes.link_start[link])
        for wheel in range(wheels.x.shape[0]):
            x, y, _ = to_wheel_frame(space, wheel, middle_x, middle_y, z)
            cx, cy, _ = wheel_centre(model, space, wheel)
            reach = wheels.radius[wheel] + wheels.half_thickness + half + MARGIN
            if wheels.present[wheel] and (x - cx) ** 2 + (y - cy) ** 2 < reach * reach:
                candidates.link[links, 0], candidates.link[links, 1] = link, wheel
                links += 1
            else:
                work.wheel_force[link, wheel] = state.wheel_impact[link, wheel] = 0.0
    candidates.count[0], candidates.count[1], candidates.count[2] = arcs, links, 1


@kernel
def _valid(model: Model, state: State, work: Work, space):
    """Return whether the lists exist and the motion since they were made is within the margin."""
    candidates = work.candidates
    if candidates.count[0] < 0:
        return False
    far = 0
    for i in range(work.pin_x.shape[0]):
        x, y = work.pin_x[i] - candidates.pin_x[i], work.pin_y[i] - candidates.pin_y[i]
        far += not x * x + y * y <= (PINS * MARGIN) ** 2
    for wheel in range(candidates.wheel.shape[0]):
        x, y = model.wheels.x[wheel] - candidates.wheel[wheel, 0], model.wheels.y[wheel] - candidates.wheel[wheel, 1]
        far += not x * x + y * y <= (WHEELS * MARGIN) ** 2
    if space is not None:
        turned = 0.0
        for r in range(3):
            for k in range(3):
                turned += (space.attitude[r, k] - candidates.plane[r, k]) ** 2
        shift = abs(state.plane.motion[OFFSET] - candidates.plane[3, 0])
        far += not sqrt(turned) * candidates.plane[3, 1] + shift <= PLANE * MARGIN
    return far == 0

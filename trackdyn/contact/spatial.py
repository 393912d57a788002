"""All contacts of the loop in space: overlap, axial slip and centre guides (Eqs. 11, 18 to 20, 32, 39).

Every contact is judged in the frame of its wheel, which has the wheel's axis and does not spin: arc
centres and link ends, which lie in the middle plane of the chain, are transformed to it (Eqs. 15, 20),
their x and y choose area or foot, depth and normal as in planar motion, their z is the axial offset ``l_z``.
The overlap of Eq. 19, never more than the shorter of the two lengths,

    L = clip(contact length + overhang - |l_z|, 0, contact length),

scales the stiffness. Normal and tangent lie in the wheel's plane; the axial slip is the z component of the
relative velocity of the two material points. The force acts in the middle plane of the chain, where depth
and slip are taken: what it does is then what the contact stores and loses.
"""

from math import cos as cosine
from math import sin as sine
from math import sqrt

from trackdyn.chain.model import Chain
from trackdyn.chain.spatial import (
    INDEPENDENT,
    ISOTROPIC,
    OFFSET,
    RING,
    SPEED,
    TOOTH,
    WHEEL,
    P,
    Plane,
    Q,
    Space,
    SpaceWork,
)
from trackdyn.contact.laws import friction_coefficient, normal_force, stored_impact_speed
from trackdyn.contact.tooth import find_area, groove_index
from trackdyn.contact.wheel import foot
from trackdyn.jit import kernel
from trackdyn.model import SPROCKET, Model, State, Work

SURFACE, FLANK, GUIDE = range(3)  # kinds of contact in the list


@kernel
def overlap(space: Space, surface, offset):
    """Share of the contact length that is left at an axial ``offset`` (m): Eq. 19 with its cap."""
    length = space.length[surface]
    left = length + space.overhang[surface] - abs(offset)
    return min(max(left, 0.0), length) / length


@kernel
def axial_friction(kind, law, slip, axial_slip):
    """Signed coefficients of the tangential and the axial friction force (Eqs. 10, 11), against the slip."""
    if kind == ISOTROPIC:
        total = sqrt(slip * slip + axial_slip * axial_slip)
        if total == 0.0:
            return 0.0, 0.0
        mu = friction_coefficient(law, total)
        return mu * (slip / total), mu * (axial_slip / total)
    if kind == INDEPENDENT:
        return friction_coefficient(law, slip), friction_coefficient(law, axial_slip)
    return friction_coefficient(law, slip), 0.0


@kernel
def _see(b, wheel, x, y, z):
    """Components of a vector in the wheel's frame from those in P."""
    return (
        b[wheel, 0, 0] * x + b[wheel, 0, 1] * y + b[wheel, 0, 2] * z,
        b[wheel, 1, 0] * x + b[wheel, 1, 1] * y + b[wheel, 1, 2] * z,
        b[wheel, 2, 0] * x + b[wheel, 2, 1] * y + b[wheel, 2, 2] * z,
    )


@kernel
def _back(b, wheel, x, y, z):
    """Components of a vector in P from those in the wheel's frame."""
    return (
        b[wheel, 0, 0] * x + b[wheel, 1, 0] * y + b[wheel, 2, 0] * z,
        b[wheel, 0, 1] * x + b[wheel, 1, 1] * y + b[wheel, 2, 1] * z,
        b[wheel, 0, 2] * x + b[wheel, 1, 2] * y + b[wheel, 2, 2] * z,
    )


@kernel
def _velocity(chain: Chain, state: State, work: Work, plane: Plane, body, x, y, z):
    """Velocity of the point (x, y, z) of a body, P components; arms from the mass centre; x, y from the pin."""
    c, s, w = work.cos[body], work.sin[body], state.rate[body]
    p, q = plane.motion[P], plane.motion[Q]
    ax = x - (work.pin_x[body] + chain.com_x[body] * c - chain.com_y[body] * s)
    ay = y - (work.pin_y[body] + chain.com_x[body] * s + chain.com_y[body] * c)
    az = z - plane.motion[OFFSET]
    rx = x - state.pin[0]
    ry = y - state.pin[1]
    vx = work.com_vx[body] - w * ay + q * az
    vy = work.com_vy[body] + w * ax - p * az
    return vx, vy, plane.motion[SPEED] + p * ry - q * rx, ax, ay, az, rx, ry


@kernel
def _apply(chain: Chain, state: State, work: Work, plane: Plane, room: SpaceWork, body, wheel, kind, px, py, pz,
           nx, ny, normal, law, centre, friction, axial):  # fmt: skip
    """Forces at the point p (wheel frame) into the loads and onto the contact list.

    Parameters
    ----------
    px, py, pz, nx, ny : float
        Point and normal in the wheel's frame, m.
    normal : float
        Normal force, N.
    axial : float
        Force of a centre guide on the body along the wheel's axis, N.
    """
    b = room.relative
    x, y, z = _back(b, wheel, px, py, pz)
    vx, vy, vz, ax, ay, az, rx, ry = _velocity(chain, state, work, plane, body, x, y, z)
    ox = px - centre[wheel, 0]
    oy = py - centre[wheel, 1]
    oz = pz - centre[wheel, 2]
    ww = state.wheel_rate[wheel]
    tangential = across = 0.0
    if kind != GUIDE:
        # slip of the two material points: along tau = z x n (Eqs. 31, 38) and along the axis (Eqs. 32, 39)
        sx, sy, sz = _see(b, wheel, vx, vy, vz)
        mu, mu_axial = axial_friction(friction, law, -ny * (sx + ww * oy) + nx * (sy - ww * ox), sz)
        tangential = -normal * mu
        across = -normal * mu_axial
    wx = normal * nx - tangential * ny
    wy = normal * ny + tangential * nx
    wz = across + axial
    fx, fy, fz = _back(b, wheel, wx, wy, wz)
    work.force_x[body] += fx
    work.force_y[body] += fy
    work.moment[body] += ax * fy - ay * fx
    room.force_z[body] += fz
    room.moment_x[body] += ay * fz - az * fy
    room.moment_y[body] += az * fx - ax * fz
    turn = ox * wy - oy * wx
    work.wheel_torque[wheel] -= turn
    load = room.wheel_load
    load[wheel, 0] -= wx
    load[wheel, 1] -= wy
    load[wheel, 2] -= wz
    load[wheel, 3] -= oy * wz - oz * wy
    load[wheel, 4] -= oz * wx - ox * wz
    load[wheel, 5] -= turn
    row, k = room.contact, room.count[0]
    row[k, 0], row[k, 1], row[k, 2] = _back(b, wheel, normal * nx, normal * ny, axial)
    row[k, 3], row[k, 4], row[k, 5] = _back(b, wheel, -tangential * ny, tangential * nx, across)
    row[k, 6], row[k, 7], row[k, 8] = ax, ay, az
    row[k, 9], row[k, 10], row[k, 11] = vx, vy, vz
    row[k, 12], row[k, 13], row[k, 14] = _back(b, wheel, -oy, ox, 0.0)
    row[k, 15] = ww
    row[k, 16] = rx
    row[k, 17] = ry
    room.contact_body[k, 0] = body
    room.contact_body[k, 1] = wheel
    room.contact_body[k, 2] = kind
    room.count[0] = k + 1


@kernel
def tooth_loads(model: Model, state: State, work: Work, space: Space, plane: Plane, room: SpaceWork):
    """Contact of every arc near the sprocket with its groove."""
    chain, shoes, tooth, law = model.chain, model.shoes, model.tooth, model.tooth.law
    b, z = room.relative, plane.motion[OFFSET]
    cs = cosine(state.wheel_angle[SPROCKET])
    ss = sine(state.wheel_angle[SPROCKET])
    ws = state.wheel_rate[SPROCKET]
    cx, cy, cz = space.centre[SPROCKET, 0], space.centre[SPROCKET, 1], space.centre[SPROCKET, 2]
    reach = tooth.addendum + tooth.arc_radius  # Eq. 18
    dz = z - room.centre[SPROCKET, 2]
    for arc in range(shoes.arc_body.shape[0]):
        body = shoes.arc_body[arc]
        along = shoes.arc_x[arc]
        c, s = work.cos[body], work.sin[body]
        x = work.pin_x[body] + along * c
        y = work.pin_y[body] + along * s
        dx = x - room.centre[SPROCKET, 0]
        dy = y - room.centre[SPROCKET, 1]
        lx, ly, lz = _see(b, SPROCKET, dx, dy, dz)
        area = k = 0
        depth = nkx = nky = radius = ck = sk = share = 0.0
        if lx * lx + ly * ly <= reach * reach:
            share = overlap(space, TOOTH, lz)
        if share > 0.0:
            # each arc searches the groove that its own centre is in: tips are shared by neighbours
            k = groove_index(tooth.teeth, cs * lx + ss * ly, -ss * lx + cs * ly)
            ck = cs * tooth.groove_cos[k - 1] - ss * tooth.groove_sin[k - 1]
            sk = ss * tooth.groove_cos[k - 1] + cs * tooth.groove_sin[k - 1]
            area, depth, nkx, nky, radius = find_area(tooth, ck * lx + sk * ly, -sk * lx + ck * ly)
        if area == 0:
            work.tooth_force[arc] = 0.0
            work.tooth_area[arc] = 0
            work.tooth_groove[arc] = 0
            state.tooth_impact[arc] = 0.0
            continue
        nx = ck * nkx - sk * nky
        ny = sk * nkx + ck * nky
        # velocity of the arc's centre seen from the groove (Eq. 27); the force pushes along n
        w = state.rate[body]
        gx = (chain.com_x[body] - along) * c - chain.com_y[body] * s
        gy = (chain.com_x[body] - along) * s + chain.com_y[body] * c
        vz = plane.motion[SPEED] + plane.motion[P] * (y - state.pin[1]) - plane.motion[Q] * (x - state.pin[0])
        vx, vy, _ = _see(b, SPROCKET, work.com_vx[body] + w * gy, work.com_vy[body] - w * gx, vz)
        vx += ws * ly
        vy -= ws * lx
        speed = -(nx * vx + ny * vy)
        impact = stored_impact_speed(state.tooth_impact[arc], speed, law.speed_floor)
        state.tooth_impact[arc] = impact
        force = share * normal_force(law, depth, speed, impact, radius)
        work.tooth_force[arc] = force
        work.tooth_area[arc] = area
        work.tooth_groove[arc] = k
        rc = tooth.arc_radius
        _apply(
            chain, state, work, plane, room, body, SPROCKET, FLANK, cx + lx - rc * nx, cy + ly - rc * ny, cz + lz,
            nx, ny, force, law, space.centre, space.friction, 0.0,
        )  # fmt: skip


@kernel
def wheel_loads(model: Model, state: State, work: Work, space: Space, plane: Plane, room: SpaceWork):
    """Contact of every link near a wheel with it, points counted from the inertial origin in the wheel's frame."""
    chain, shoes, wheels = model.chain, model.shoes, model.wheels
    b, z, thick = room.relative, plane.motion[OFFSET], wheels.half_thickness
    for wheel in range(wheels.x.shape[0]):
        if not wheels.present[wheel]:
            continue
        cx, cy, cz = space.centre[wheel, 0], space.centre[wheel, 1], space.centre[wheel, 2]
        reach = wheels.radius[wheel] + thick
        law = wheels.ring_law if wheel == SPROCKET else wheels.wheel_law
        surface = RING if wheel == SPROCKET else WHEEL
        for link in range(shoes.link_body.shape[0]):
            body = shoes.link_body[link]
            c, s = work.cos[body], work.sin[body]
            start, end = shoes.link_start[link], shoes.link_end[link]
            ax, ay, az = _see(b, wheel, work.pin_x[body] + start * c, work.pin_y[body] + start * s, z)
            bx, by, bz = _see(b, wheel, work.pin_x[body] + end * c, work.pin_y[body] + end * s, z)
            half = 0.5 * (end - start)
            mx = 0.5 * (ax + bx) - cx
            my = 0.5 * (ay + by) - cy
            depth = share = 0.0
            if mx * mx + my * my < (reach + half) ** 2:
                fraction, qx, qy, distance = foot(ax, ay, bx, by, cx, cy)
                depth = reach - distance
            if depth > 0.0:
                qz = az + min(max(fraction, 0.0), 1.0) * (bz - az)
                share = overlap(space, surface, qz - cz)
            if share <= 0.0:
                work.wheel_force[link, wheel] = 0.0
                state.wheel_impact[link, wheel] = 0.0
                continue
            nx = (qx - cx) / distance
            ny = (qy - cy) / distance
            x, y, _ = _back(b, wheel, qx, qy, qz)
            vx, vy, vz, _, _, _, _, _ = _velocity(chain, state, work, plane, body, x, y, z)
            vx, vy, _ = _see(b, wheel, vx, vy, vz)
            speed = -(nx * vx + ny * vy)
            impact = stored_impact_speed(state.wheel_impact[link, wheel], speed, law.speed_floor)
            state.wheel_impact[link, wheel] = impact
            force = share * normal_force(law, depth, speed, impact, wheels.radius[wheel])
            work.wheel_force[link, wheel] = force
            _apply(
                chain, state, work, plane, room, body, wheel, SURFACE, qx - thick * nx, qy - thick * ny, qz,
                nx, ny, force, law, space.centre, space.friction, 0.0,
            )  # fmt: skip


@kernel
def guide_loads(model: Model, state: State, work: Work, space: Space, plane: Plane, room: SpaceWork):
    """Centre guides of the connectors between the flanges of the wheels: a spring and damper that only push."""
    chain, shoes, b, z = model.chain, model.shoes, room.relative, plane.motion[OFFSET]
    for wheel in range(space.guide_reach.shape[0]):
        reach = space.guide_reach[wheel]
        if reach == 0.0:
            continue
        dz = z - room.centre[wheel, 2]
        for pitch in range(shoes.link_body.shape[0]):
            body = shoes.arc_body[2 * pitch]
            middle = 0.5 * (shoes.arc_x[2 * pitch] + shoes.arc_x[2 * pitch + 1])
            x = work.pin_x[body] + middle * work.cos[body]
            y = work.pin_y[body] + middle * work.sin[body]
            dx = x - room.centre[wheel, 0]
            dy = y - room.centre[wheel, 1]
            lx, ly, lz = _see(b, wheel, dx, dy, dz)
            depth = abs(lz) - space.clearance
            if depth <= 0.0 or lx * lx + ly * ly > reach * reach:
                continue
            vx, vy, vz, _, _, _, _, _ = _velocity(chain, state, work, plane, body, x, y, z)
            side = 1.0 if lz > 0.0 else -1.0
            _, _, speed = _see(b, wheel, vx, vy, vz)
            force = max(space.stiffness * depth + space.damping * side * speed, 0.0)
            _apply(
                chain, state, work, plane, room, body, wheel, GUIDE, space.centre[wheel, 0] + lx,
                space.centre[wheel, 1] + ly, space.centre[wheel, 2] + lz, 0.0, 0.0, 0.0, model.tooth.law,
                space.centre, space.friction, -side * force,
            )  # fmt: skip


@kernel
def contact_loads(model: Model, state: State, work: Work, space: Space, plane: Plane, room: SpaceWork):
    """Contact loads on bodies and wheels at the present state; the wheels' views must be those of it (`aim`)."""
    work.force_x[:] = 0.0
    work.force_y[:] = 0.0
    work.moment[:] = 0.0
    work.wheel_torque[:] = 0.0
    work.count[0] = 0  # the planar list stays empty
    room.force_z[:] = 0.0
    room.moment_x[:] = 0.0
    room.moment_y[:] = 0.0
    room.wheel_load[:, :] = 0.0
    room.count[0] = 0
    if model.tooth.present:
        tooth_loads(model, state, work, space, plane, room)
    wheel_loads(model, state, work, space, plane, room)
    guide_loads(model, state, work, space, plane, room)

"""All contacts of the loop at one state: who touches what, and the loads that follow (Fig. 11, Fig. 12).

One statement serves the plane and space (`contact.axial`): points and normals are in the frame of the wheel
that is touched, which in the plane is the inertial one.
"""

from math import cos as cosine
from math import sin as sine
from typing import NamedTuple

from trackdyn.contact import neighbours
from trackdyn.contact.axial import (
    centre_in_plane,
    friction_coefficients,
    guide_force,
    height,
    normal_velocity,
    overlap_ratio,
    to_plane_frame,
    to_wheel_frame,
    wheel_centre,
)
from trackdyn.contact.laws import (
    elastic_force,
    find_area,
    foot,
    groove_index,
    implicit_speed,
    in_groove,
    normal_force,
    normal_slopes,
    stored_impact_speed,
)
from trackdyn.jit import kernel
from trackdyn.model.arrays import FLANK, GUIDE, OFFSET, RING, SURFACE, P, Q, State, Work
from trackdyn.model.constants import SPROCKET, Law, Model, Wheels

# Part of a linearly implicit step at which contact depths are taken: half way is stable for any
# stiffness and loses half the energy that the end of the step would.
AHEAD = 0.5


class ContactPoint(NamedTuple):
    """One contact: the body at a point of its wheel's frame, with the normal of the force on the body.

    ``depth`` (m), ``speed`` (m/s, positive while the depth grows), ``impact`` (its initial value) and ``radius``
    (m) are those of Eq. 8, ``share`` the fraction of the contact length that overlaps, ``axial`` the force of a
    guide along the wheel's axis (N). ``extrapolation`` is the share of the last step's change that is added to
    velocities, ``slip_compliance`` what a unit of friction takes from the slip until then (m/s/N), ``item`` the
    contact's position in ``work.friction``.
    """

    body: int
    wheel: int
    kind: int
    x: float
    y: float
    z: float
    normal_x: float
    normal_y: float
    depth: float
    speed: float
    impact: float
    radius: float
    share: float
    axial: float
    extrapolation: float
    slip_compliance: float
    item: int
    law: Law


@kernel
def body_motion(model, state, work, body, x, y):
    """Arm of a point from the body's mass centre (m) and its velocity as far as the plane does not turn (m/s)."""
    chain, w = model.chain, state.rate[body]
    c, s = work.cos[body], work.sin[body]
    ax = x - (work.pin_x[body] + chain.com_x[body] * c - chain.com_y[body] * s)
    ay = y - (work.pin_y[body] + chain.com_x[body] * s + chain.com_y[body] * c)
    return ax, ay, work.com_vx[body] - w * ay, work.com_vy[body] + w * ax


@kernel
def extrapolated_velocity(work, body, vx, vy, ax, ay, extrapolation):
    """Velocity (m/s) of a body's point led ahead by a fraction of the last step's change.

    Damping forces would otherwise lag half a step behind the places that they are taken at. ``ax, ay`` is the arm
    from the mass centre, m.
    """
    turn = extrapolation * work.delta_omega[body]
    return vx + extrapolation * work.com_dvx[body] - turn * ay, vy + extrapolation * work.com_dvy[body] + turn * ax


@kernel
def with_plane(state, space, x, y, z, vx, vy):
    """Velocity of a point with what the turning plane adds, m/s."""
    if space is None:
        return vx, vy, 0.0
    az, motion = z - state.plane.motion[OFFSET], state.plane.motion
    return vx + motion[Q] * az, vy - motion[P] * az, normal_velocity(state, space, x, y)


@kernel
def apply(model: Model, state: State, work: Work, point: ContactPoint, space, implicit):
    """Forces of a contact into the loads and onto the contact list; returns the normal force at this state, N."""
    law, body, wheel, nx, ny = point.law, point.body, point.wheel, point.normal_x, point.normal_y
    x, y, z = to_plane_frame(space, wheel, point.x, point.y, point.z)
    ax, ay, vx, vy = body_motion(model, state, work, body, x, y)
    px, py = extrapolated_velocity(work, body, vx, vy, ax, ay, point.extrapolation)
    vx, vy, vz = with_plane(state, space, x, y, z, vx, vy)
    px, py, _ = with_plane(state, space, x, y, z, px, py)
    cx, cy, cz = wheel_centre(model, space, wheel)
    ox = point.x - cx
    oy = point.y - cy
    ww = state.wheel_rate[wheel]
    # slip of the two material points: along tau = z x n (Eqs. 31, 38 with the links' own rotation) and along
    # the axis (Eqs. 32, 39)
    sx, sy, sz = to_wheel_frame(space, wheel, px, py, vz)
    tx, ty = wheel_velocity(state, model.carriers, wheel)
    sx -= tx
    sy -= ty
    slip = -ny * (sx + ww * oy) + nx * (sy - ww * ox)
    fn = point.share * normal_force(law, point.depth, point.speed, point.impact, point.radius)
    mu, axial_mu = friction_coefficients(model.space, law, slip, sz)
    present = fn
    row = work.contact[work.count[0]]
    if implicit is not None:
        # the normal force is led ahead by its slopes, friction to the end of the step by its secant;
        # the rest, proportional to the accelerations of the step, goes into the sweep
        step = model.step
        stiffness, damping = normal_slopes(law, point.depth, point.speed, point.impact, point.radius)
        fn += AHEAD * step * stiffness * point.speed
        normal = step * (damping + AHEAD * step * stiffness)
        if fn <= 0.0:
            fn = normal = 0.0
        across = step * fn * abs(mu) / max(abs(slip), 1e-9)
        rx = x - work.pin_x[body]
        ry = y - work.pin_y[body]
        m1 = rx * ny - ry * nx
        m2 = rx * nx + ry * ny
        inertia = implicit.inertia
        inertia[body, 0] += normal * nx * nx + across * ny * ny
        inertia[body, 1] += (normal - across) * nx * ny
        inertia[body, 2] += normal * ny * ny + across * nx * nx
        inertia[body, 3] += normal * nx * m1 - across * ny * m2
        inertia[body, 4] += normal * ny * m1 + across * nx * m2
        inertia[body, 5] += normal * m1 * m1 + across * m2 * m2
        if wheel != SPROCKET:
            arm = across * (ox * nx + oy * ny)  # slip falls by (o . n) times the wheel's acceleration
            implicit.couple[body, wheel, 0] -= arm * ny
            implicit.couple[body, wheel, 1] += arm * nx
            implicit.couple[body, wheel, 2] += arm * m2
            implicit.wheel_inertia[wheel] += arm * (ox * nx + oy * ny)
        row["normal_slope"] = normal
        row["friction_slope"] = across
    ft = -fn * mu
    if point.slip_compliance > 0.0:
        # of its own force the slip has until then that of the step before: by the secant of Eq. 10
        resisted = point.slip_compliance * fn * abs(mu) / max(abs(slip), 1e-9)
        ft = (ft + resisted * work.friction[1, point.item]) / (1.0 + resisted)
        work.friction[0, point.item] = ft
    across_force = -fn * axial_mu
    wx = fn * nx - ft * ny
    wy = fn * ny + ft * nx
    wz = across_force + point.axial
    fx, fy, fz = to_plane_frame(space, wheel, wx, wy, wz)
    turn = ox * wy - oy * wx
    work.force_x[body] += fx
    work.force_y[body] += fy
    work.moment[body] += ax * fy - ay * fx
    work.wheel_torque[wheel] -= turn
    row["normal_x"], row["normal_y"], normal_z = to_plane_frame(space, wheel, fn * nx, fn * ny, point.axial)
    row["friction_x"], row["friction_y"], friction_z = to_plane_frame(space, wheel, -ft * ny, ft * nx, across_force)
    row["turn_x"], row["turn_y"], turn_z = to_plane_frame(space, wheel, -oy, ox, 0.0)
    row["arm_x"] = ax
    row["arm_y"] = ay
    row["speed_x"] = vx
    row["speed_y"] = vy
    row["rate"] = ww
    if space is not None:
        az = z - state.plane.motion[OFFSET]
        space.force_z[body] += fz
        space.moment_x[body] += ay * fz - az * fy
        space.moment_y[body] += az * fx - ax * fz
        oz = point.z - cz
        load = space.wheel_load
        load[wheel, 0] -= wx
        load[wheel, 1] -= wy
        load[wheel, 2] -= wz
        load[wheel, 3] -= oy * wz - oz * wy
        load[wheel, 4] -= oz * wx - ox * wz
        load[wheel, 5] -= turn
        row["normal_z"] = normal_z
        row["friction_z"] = friction_z
        row["turn_z"] = turn_z
        row["arm_z"] = az
        row["speed_z"] = vz
        row["pin_x"] = x - state.pin[0]
        row["pin_y"] = y - state.pin[1]
    row["body"] = body
    row["wheel"] = wheel
    row["kind"] = point.kind
    work.count[0] += 1
    return present


@kernel
def tooth_loads(model: Model, state: State, work: Work, space, implicit):
    """Contact of every arc near the sprocket with its groove (Fig. 11).

    Steel on steel the force rises within a few steps, and what the last step changed says little of this one:
    velocities are led by it less what the force has grown since, which the chain meets with its own mass alone.
    """
    chain, shoes, tooth = model.chain, model.shoes, model.tooth
    cs = cosine(state.wheel_angle[SPROCKET])
    ss = sine(state.wheel_angle[SPROCKET])
    ws = state.wheel_rate[SPROCKET]
    cx, cy, cz = wheel_centre(model, space, SPROCKET)
    mx, my, mz = centre_in_plane(model, space, SPROCKET)
    dz = height(state, space) - mz
    extrapolation = 0.5 if implicit is None else 0.0
    compliance = extrapolation * model.step * tooth.mobility
    half = extrapolation * model.step if compliance > 0.0 else 0.0
    reach = tooth.addendum + tooth.arc_radius  # Eq. 18
    rc = tooth.arc_radius
    near = work.near
    for item in range(near.count[0]):
        arc = near.arc[item]
        body = shoes.arc_body[arc]
        along = shoes.arc_x[arc]
        c, s = work.cos[body], work.sin[body]
        x = work.pin_x[body] + along * c
        y = work.pin_y[body] + along * s
        lx, ly, lz = to_wheel_frame(space, SPROCKET, x - mx, y - my, dz)
        area = 0
        k = near.groove[arc]
        depth = nkx = nky = radius = ck = sk = share = 0.0
        if lx * lx + ly * ly <= reach * reach:
            share = overlap_ratio(model.space, FLANK, lz)
        if share > 0.0:
            # each arc searches the groove that its own centre is in: tips are shared by neighbours
            ck, sk, x_k, y_k = in_groove(tooth, k, cs, ss, lx, ly)
            if abs(x_k) > tooth.half_pitch * y_k:
                k = near.groove[arc] = groove_index(tooth.teeth, cs * lx + ss * ly, -ss * lx + cs * ly)
                ck, sk, x_k, y_k = in_groove(tooth, k, cs, ss, lx, ly)
            area, depth, nkx, nky, radius = find_area(tooth, x_k, y_k)
        work.tooth_area[arc] = area
        if area == 0:
            work.tooth_force[arc] = work.friction[0, arc] = 0.0
            work.tooth_groove[arc] = 0
            state.tooth_impact[arc] = 0.0
            continue
        work.tooth_groove[arc] = k
        nx = ck * nkx - sk * nky
        ny = sk * nkx + ck * nky
        # velocity of the arc's centre seen from the groove (Eq. 27); the force pushes along n
        w = state.rate[body]
        gx = (chain.com_x[body] - along) * c - chain.com_y[body] * s
        gy = (chain.com_x[body] - along) * s + chain.com_y[body] * c
        vx, vy = extrapolated_velocity(
            work, body, work.com_vx[body] + w * gy, work.com_vy[body] - w * gx, -gx, -gy, extrapolation
        )
        vx, vy, _ = to_wheel_frame(space, SPROCKET, vx, vy, normal_velocity(state, space, x, y))
        vx += ws * ly
        vy -= ws * lx
        speed = -(nx * vx + ny * vy)
        impact = stored_impact_speed(state.tooth_impact[arc], speed, tooth.law.speed_floor)
        state.tooth_impact[arc] = impact
        if compliance > 0.0:
            elastic = share * elastic_force(tooth.law.stiffness, depth, radius)
            speed = implicit_speed(tooth.law, elastic, speed + compliance * work.tooth_before[arc], impact, compliance)
        ex = nx * c + ny * s
        slides = (tooth.slip[arc % 2, 0] * ex + tooth.slip[arc % 2, 1]) * ex + tooth.slip[arc % 2, 2]
        point = ContactPoint(
            body, SPROCKET, FLANK, cx + lx - rc * nx, cy + ly - rc * ny, cz + lz,
            nx, ny, depth, speed, impact, radius, share, 0.0, extrapolation, half * slides, arc, tooth.law,
        )  # fmt: skip
        work.tooth_force[arc] = apply(model, state, work, point, space, implicit)
        work.contact[work.count[0] - 1]["area"] = area


@kernel
def wheel_loads(model: Model, state: State, work: Work, space, implicit):
    """Contact of every link near a wheel with it (Fig. 12)."""
    shoes, wheels, thick = model.shoes, model.wheels, model.wheels.half_thickness
    extrapolation = 0.5 if implicit is None else 0.0
    z = height(state, space)
    near, (links, count) = work.near, work.wheel_force.shape
    for k in range(near.count[1]):
        link, wheel = near.link[k, 0], near.link[k, 1]
        item = 2 * links + link * count + wheel  # index in ``work.friction``
        body = shoes.link_body[link]
        c, s = work.cos[body], work.sin[body]
        start, end = shoes.link_start[link], shoes.link_end[link]
        ax, ay, az = to_wheel_frame(space, wheel, work.pin_x[body] + start * c, work.pin_y[body] + start * s, z)
        bx, by, bz = to_wheel_frame(space, wheel, work.pin_x[body] + end * c, work.pin_y[body] + end * s, z)
        cx, cy, cz = wheel_centre(model, space, wheel)
        kind = RING if wheel == SPROCKET else SURFACE
        fraction, qx, qy, distance = foot(ax, ay, bx, by, cx, cy)
        depth = wheels.radius[wheel] + thick - distance
        share = qz = 0.0
        if depth > 0.0:
            qz = az + min(max(fraction, 0.0), 1.0) * (bz - az)
            share = overlap_ratio(model.space, kind, qz - cz)
        if share <= 0.0:
            work.wheel_force[link, wheel] = work.friction[0, item] = 0.0
            state.wheel_impact[link, wheel] = 0.0
            continue
        inverse = 1.0 / distance
        nx = (qx - cx) * inverse
        ny = (qy - cy) * inverse
        x, y, height_there = to_plane_frame(space, wheel, qx, qy, qz)
        gx, gy, vx, vy = body_motion(model, state, work, body, x, y)
        vx, vy = extrapolated_velocity(work, body, vx, vy, gx, gy, extrapolation)
        vx, vy, vz = with_plane(state, space, x, y, height_there, vx, vy)
        vx, vy, _ = to_wheel_frame(space, wheel, vx, vy, vz)
        tx, ty = wheel_velocity(state, model.carriers, wheel)
        vx -= tx
        vy -= ty
        speed = -(nx * vx + ny * vy)
        law = wheel_law(wheels, wheel, wheels.own_law)
        impact = stored_impact_speed(state.wheel_impact[link, wheel], speed, law.speed_floor)
        state.wheel_impact[link, wheel] = impact
        point = ContactPoint(
            body, wheel, kind, qx - thick * nx, qy - thick * ny, qz,
            nx, ny, depth, speed, impact, wheels.radius[wheel], share, 0.0,
            extrapolation, extrapolation * model.step * wheels.slip[wheel], item, law,
        )  # fmt: skip
        work.wheel_force[link, wheel] = apply(model, state, work, point, space, implicit)
        work.carried[wheel] += work.wheel_force[link, wheel]


@kernel
def guide_loads(model: Model, state: State, work: Work, space, implicit):
    """Centre guides of the connectors between the flanges of the wheels."""
    shoes = model.shoes
    for wheel in range(model.wheels.x.shape[0]):
        reach = model.space.guide_reach[wheel]
        if reach == 0.0:
            continue
        mx, my, mz = centre_in_plane(model, space, wheel)
        cx, cy, cz = wheel_centre(model, space, wheel)
        for pitch in range(shoes.link_body.shape[0]):
            body = shoes.arc_body[2 * pitch]
            middle = 0.5 * (shoes.arc_x[2 * pitch] + shoes.arc_x[2 * pitch + 1])
            x = work.pin_x[body] + middle * work.cos[body]
            y = work.pin_y[body] + middle * work.sin[body]
            z = height(state, space)
            lx, ly, lz = to_wheel_frame(space, wheel, x - mx, y - my, z - mz)
            if abs(lz) <= model.space.clearance or lx * lx + ly * ly > reach * reach:
                continue
            _, _, vx, vy = body_motion(model, state, work, body, x, y)
            vx, vy, vz = with_plane(state, space, x, y, z, vx, vy)
            _, _, speed = to_wheel_frame(space, wheel, vx, vy, vz)
            # neither depth nor normal: only the axial force is left of the contact
            point = ContactPoint(
                body, wheel, GUIDE, cx + lx, cy + ly, cz + lz, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0,
                guide_force(model.space, lz, speed), 0.0, 0.0, 0, model.tooth.law,
            )  # fmt: skip
            apply(model, state, work, point, space, implicit)


@kernel
def contact_loads(model: Model, state: State, work: Work, space=None, implicit=None):
    """Contact loads on bodies and wheels at the present state.

    ``space`` is ``work.space``, its wheels seen from the plane as it is (`chain.plane.update_frame`); with ``implicit``
    the forces are led to the end of the step and their slopes added up for the linearly implicit sweep.
    """
    work.force_x[:] = 0.0
    work.force_y[:] = 0.0
    work.moment[:] = 0.0
    work.wheel_torque[:] = 0.0
    work.carried[:] = 0.0
    work.count[0] = 0
    if implicit is not None:
        implicit.inertia[:] = 0.0
        implicit.couple[:] = 0.0
        implicit.wheel_inertia[:] = 0.0
    if space is not None:
        space.force_z[:] = 0.0
        space.moment_x[:] = 0.0
        space.moment_y[:] = 0.0
        space.wheel_load[:, :] = 0.0
    neighbours.update(model, state, work, space)
    if model.tooth.present:
        tooth_loads(model, state, work, space, implicit)
    wheel_loads(model, state, work, space, implicit)
    if space is not None:
        guide_loads(model, state, work, space, implicit)


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
    moved = state.slide[k]
    return moved["rate"] * moved["along_x"], moved["rate"] * moved["along_y"]

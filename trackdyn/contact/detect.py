"""Contact detection: arcs near the sprocket and their grooves, links near a wheel, guides (Fig. 11, Fig. 12)."""

from math import cos as cosine
from math import sin as sine

from trackdyn.chain.kinematics import on_pin_line, rotated
from trackdyn.contact import axial, forces, laws, neighbours
from trackdyn.jit import kernel
from trackdyn.model.arrays import FLANK, GUIDE, RING, SURFACE, State, Work
from trackdyn.model.constants import SPROCKET, Model, Tooth


@kernel
def touched_area(tooth: Tooth, groove, arc, cos, sin, x, y):
    """Return groove, area (0: no contact), depth (m), normal in the wheel's frame and radius (m) of a contact."""
    k = groove[arc]  # that of its last contact, else that of its own centre: tips are shared by neighbours
    ck, sk, x_k, y_k = laws.in_groove(tooth, k, cos, sin, x, y)
    if abs(x_k) > tooth.half_pitch * y_k:
        k = groove[arc] = laws.groove_index(tooth.teeth, cos * x + sin * y, -sin * x + cos * y)
        ck, sk, x_k, y_k = laws.in_groove(tooth, k, cos, sin, x, y)
    area, depth, nx, ny, radius = laws.find_area(tooth, x_k, y_k)
    return k, area, depth, ck * nx - sk * ny, sk * nx + ck * ny, radius


@kernel
def tooth_loads(model: Model, state: State, work: Work, space, implicit):
    """Add the contact of every arc near the sprocket with its groove (Fig. 11).

    The force of steel on steel rises within a few steps: the velocity that the last step predicts is corrected for the
    growth of the force since, resisted by the mass of the chain only.
    """
    chain, shoes, tooth, law = model.chain, model.shoes, model.tooth, model.tooth.law
    cs, ss = cosine(state.wheel_angle[SPROCKET]), sine(state.wheel_angle[SPROCKET])
    cx, cy, cz = axial.wheel_centre(model, space, SPROCKET)
    mx, my, mz = axial.centre_in_plane(model, space, SPROCKET)
    z = axial.height(state, space)
    prediction = forces.PREDICTION if implicit is None else 0.0
    compliance = prediction * model.step * tooth.mobility
    half = prediction * model.step if compliance > 0.0 else 0.0
    reach = tooth.addendum + tooth.arc_radius  # Eq. 18
    rc = tooth.arc_radius
    candidates = work.candidates
    for item in range(candidates.count[0]):
        arc = candidates.arc[item]
        body, along = shoes.arc_body[arc], shoes.arc_x[arc]
        c, s = work.cos[body], work.sin[body]
        x, y = on_pin_line(work, body, along)
        lx, ly, lz = axial.to_wheel_frame(space, SPROCKET, x - mx, y - my, z - mz)
        groove = area = 0
        depth = nx = ny = radius = share = 0.0
        if lx * lx + ly * ly <= reach * reach:
            share = axial.overlap_ratio(model.space, FLANK, lz)
        if share > 0.0:
            groove, area, depth, nx, ny, radius = touched_area(tooth, candidates.groove, arc, cs, ss, lx, ly)
        work.tooth_area[arc] = area
        work.tooth_groove[arc] = groove if area > 0 else 0
        if area == 0:
            work.tooth_force[arc] = work.friction[0, arc] = state.tooth_impact[arc] = 0.0
            continue
        # velocity of the arc's centre seen from the groove (Eq. 27); the force pushes along n
        gx, gy = rotated(chain.com_x[body] - along, chain.com_y[body], c, s)
        velocity = forces.point_velocity(state, work, space, body, (x, y, z), (-gx, -gy), prediction)
        vx, vy, _ = forces.velocity_over_wheel(model, state, space, SPROCKET, velocity, lx, ly)
        speed = -(nx * vx + ny * vy)
        impact = laws.stored_impact_speed(state.tooth_impact[arc], speed, law.speed_floor)
        state.tooth_impact[arc] = impact
        if compliance > 0.0:
            elastic = share * laws.elastic_force(law, depth, radius)[0]
            speed = laws.implicit_speed(law, elastic, speed + compliance * work.tooth_before[arc], impact, compliance)
        ex = nx * c + ny * s
        slides = (tooth.slip[arc % 2, 0] * ex + tooth.slip[arc % 2, 1]) * ex + tooth.slip[arc % 2, 2]
        contact = forces.Contact(
            body=body, wheel=SPROCKET, kind=FLANK, slot=arc,
            x=cx + lx - rc * nx, y=cy + ly - rc * ny, z=cz + lz, normal_x=nx, normal_y=ny,
            law=law, depth=depth, speed=speed, impact_speed=impact, radius=radius, share=share,
            slip_compliance=half * slides, guide=0.0,
        )  # fmt: skip
        work.tooth_force[arc] = forces.apply(model, state, work, contact, space, implicit)


@kernel
def wheel_loads(model: Model, state: State, work: Work, space, implicit):
    """Add the contact of every link near a wheel with it (Fig. 12)."""
    shoes, wheels, thick = model.shoes, model.wheels, model.wheels.half_thickness
    prediction = forces.PREDICTION if implicit is None else 0.0
    z = axial.height(state, space)
    candidates, (links, count) = work.candidates, work.wheel_force.shape
    for k in range(candidates.count[1]):
        link, wheel = candidates.link[k, 0], candidates.link[k, 1]
        slot = 2 * links + link * count + wheel
        body = shoes.link_body[link]
        ax, ay = on_pin_line(work, body, shoes.link_start[link])
        bx, by = on_pin_line(work, body, shoes.link_end[link])
        ax, ay, az = axial.to_wheel_frame(space, wheel, ax, ay, z)
        bx, by, bz = axial.to_wheel_frame(space, wheel, bx, by, z)
        cx, cy, cz = axial.wheel_centre(model, space, wheel)
        kind = RING if wheel == SPROCKET else SURFACE
        along, qx, qy, distance = laws.closest_point(ax, ay, bx, by, cx, cy)
        depth = wheels.radius[wheel] + thick - distance
        share = qz = 0.0
        if depth > 0.0:
            qz = az + min(max(along, 0.0), 1.0) * (bz - az)
            share = axial.overlap_ratio(model.space, kind, qz - cz)
        if share <= 0.0:
            work.wheel_force[link, wheel] = work.friction[0, slot] = state.wheel_impact[link, wheel] = 0.0
            continue
        inverse = 1.0 / distance
        nx, ny = (qx - cx) * inverse, (qy - cy) * inverse
        px, py, pz = axial.to_plane_frame(space, wheel, qx, qy, qz)
        arm = forces.mass_centre_arm(model.chain, work, body, px, py)
        velocity = forces.point_velocity(state, work, space, body, (px, py, pz), arm, prediction)
        # the wheel's rotation moves nothing along n
        vx, vy, _ = forces.velocity_over_wheel(model, state, space, wheel, velocity, 0.0, 0.0)
        speed = -(nx * vx + ny * vy)
        law = laws.wheel_law(wheels, wheel)
        impact = laws.stored_impact_speed(state.wheel_impact[link, wheel], speed, law.speed_floor)
        state.wheel_impact[link, wheel] = impact
        contact = forces.Contact(
            body=body, wheel=wheel, kind=kind, slot=slot,
            x=qx - thick * nx, y=qy - thick * ny, z=qz, normal_x=nx, normal_y=ny,
            law=law, depth=depth, speed=speed, impact_speed=impact, radius=wheels.radius[wheel], share=share,
            slip_compliance=prediction * model.step * wheels.slip[wheel], guide=0.0,
        )  # fmt: skip
        work.wheel_force[link, wheel] = forces.apply(model, state, work, contact, space, implicit)
        work.carried[wheel] += work.wheel_force[link, wheel]


@kernel
def guide_loads(model: Model, state: State, work: Work, space, implicit):
    """Add the forces of the connectors' centre guides between the flanges of the wheels."""
    shoes = model.shoes
    z = axial.height(state, space)
    for wheel in range(model.wheels.x.shape[0]):
        reach = model.space.guide_reach[wheel]
        if reach == 0.0:
            continue
        mx, my, mz = axial.centre_in_plane(model, space, wheel)
        cx, cy, cz = axial.wheel_centre(model, space, wheel)
        for pitch in range(shoes.link_body.shape[0]):
            body = shoes.arc_body[2 * pitch]
            x, y = on_pin_line(work, body, 0.5 * (shoes.arc_x[2 * pitch] + shoes.arc_x[2 * pitch + 1]))
            lx, ly, lz = axial.to_wheel_frame(space, wheel, x - mx, y - my, z - mz)
            if abs(lz) <= model.space.clearance or lx * lx + ly * ly > reach * reach:
                continue
            arm = forces.mass_centre_arm(model.chain, work, body, x, y)
            velocity = forces.point_velocity(state, work, space, body, (x, y, z), arm, 0.0)
            _, _, speed = forces.velocity_over_wheel(model, state, space, wheel, velocity, lx, ly)
            # no normal and no share of a contact length: only the axial force is left of the contact
            contact = forces.Contact(
                body=body, wheel=wheel, kind=GUIDE, slot=0,
                x=cx + lx, y=cy + ly, z=cz + lz, normal_x=0.0, normal_y=0.0,
                law=model.tooth.law, depth=1.0, speed=0.0, impact_speed=1.0, radius=1.0, share=0.0,
                slip_compliance=0.0, guide=axial.guide_force(model.space, lz, speed),
            )  # fmt: skip
            forces.apply(model, state, work, contact, space, implicit)


@kernel
def contact_loads(model: Model, state: State, work: Work, space=None, implicit=None):
    """Compute contact loads on bodies and wheels now; with ``implicit`` at the end of the step, with their slopes."""
    work.force_x[:] = work.force_y[:] = work.moment[:] = work.wheel_torque[:] = work.carried[:] = 0.0
    work.count[0] = 0
    if implicit is not None:
        implicit.inertia[:] = implicit.couple[:] = implicit.wheel_inertia[:] = 0.0
    if space is not None:
        space.force_z[:] = space.moment_x[:] = space.moment_y[:] = space.wheel_load[:] = 0.0
    neighbours.update(model, state, work, space)
    if model.tooth.present:
        tooth_loads(model, state, work, space, implicit)
    wheel_loads(model, state, work, space, implicit)
    if space is not None:
        guide_loads(model, state, work, space, implicit)

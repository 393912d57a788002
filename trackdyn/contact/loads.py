"""All contacts of the loop at one state: who touches what, and the loads that follow (Fig. 11, Fig. 12)."""

from math import cos as cosine
from math import sin as sine

from trackdyn.chain.model import Chain
from trackdyn.contact.laws import friction_coefficient, normal_force, normal_slopes, stored_impact_speed
from trackdyn.contact.tooth import Tooth, find_area, groove_index
from trackdyn.contact.wheel import foot
from trackdyn.jit import kernel
from trackdyn.model import SPROCKET, Model, Shoes, State, Wheels, Work

# Part of a linearly implicit step at which contact depths are taken: half way is stable for any
# stiffness and loses half the energy that the end of the step would.
AHEAD = 0.5


@kernel
def _apply(chain: Chain, state: State, wheels: Wheels, work: Work, law, body, wheel, tooth, px, py, nx, ny, depth,
           speed, impact, radius, step, implicit):  # fmt: skip
    """Contact at point p with normal n on ``body``: forces into the loads and onto the contact list.

    Returns the normal force at the present state, N.
    """
    c, s = work.cos[body], work.sin[body]
    gx = work.pin_x[body] + chain.com_x[body] * c - chain.com_y[body] * s
    gy = work.pin_y[body] + chain.com_x[body] * s + chain.com_y[body] * c
    ax = px - gx
    ay = py - gy
    w = state.rate[body]
    vx = work.com_vx[body] - w * ay
    vy = work.com_vy[body] + w * ax
    ox = px - wheels.x[wheel]
    oy = py - wheels.y[wheel]
    ww = state.wheel_rate[wheel]
    # slip of the two material points at p along tau = z x n (Eqs. 31, 38 with the links' own rotation)
    slip = -ny * (vx + ww * oy) + nx * (vy - ww * ox)
    fn = normal_force(law, depth, speed, impact, radius)
    mu = friction_coefficient(law, slip)
    present = fn
    k = work.count[0]
    row = work.contact
    if implicit is not None:
        # the normal force is led ahead by its slopes, friction to the end of the step by its secant;
        # the rest, proportional to the accelerations of the step, goes into the sweep
        stiffness, damping = normal_slopes(law, depth, speed, impact, radius)
        fn += AHEAD * step * stiffness * speed
        normal = step * (damping + AHEAD * step * stiffness)
        if fn <= 0.0:
            fn = normal = 0.0
        across = step * fn * abs(mu) / max(abs(slip), 1e-9)
        rx = px - work.pin_x[body]
        ry = py - work.pin_y[body]
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
        row[k, 11] = normal
        row[k, 12] = across
    ft = -fn * mu
    fx = fn * nx - ft * ny
    fy = fn * ny + ft * nx
    work.force_x[body] += fx
    work.force_y[body] += fy
    work.moment[body] += ax * fy - ay * fx
    work.wheel_torque[wheel] -= ox * fy - oy * fx
    row[k, 0] = fn * nx
    row[k, 1] = fn * ny
    row[k, 2] = -ft * ny
    row[k, 3] = ft * nx
    row[k, 4] = ax
    row[k, 5] = ay
    row[k, 6] = vx
    row[k, 7] = vy
    row[k, 8] = ox
    row[k, 9] = oy
    row[k, 10] = ww
    work.contact_body[k, 0] = body
    work.contact_body[k, 1] = wheel
    work.contact_body[k, 2] = tooth
    work.count[0] = k + 1
    return present


@kernel
def tooth_loads(chain: Chain, shoes: Shoes, tooth: Tooth, wheels: Wheels, state: State, work: Work, step, implicit):
    """Contact of every arc near the sprocket with its groove (Fig. 11)."""
    cs = cosine(state.wheel_angle[SPROCKET])
    ss = sine(state.wheel_angle[SPROCKET])
    ws = state.wheel_rate[SPROCKET]
    ox = wheels.x[SPROCKET]
    oy = wheels.y[SPROCKET]
    reach = tooth.addendum + tooth.arc_radius  # Eq. 18
    for arc in range(shoes.arc_body.shape[0]):
        body = shoes.arc_body[arc]
        along = shoes.arc_x[arc]
        c, s = work.cos[body], work.sin[body]
        lx = work.pin_x[body] + along * c - ox
        ly = work.pin_y[body] + along * s - oy
        area = k = 0
        depth = nkx = nky = radius = ck = sk = 0.0
        if lx * lx + ly * ly <= reach * reach:
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
        vx = work.com_vx[body] + w * gy + ws * ly
        vy = work.com_vy[body] - w * gx - ws * lx
        speed = -(nx * vx + ny * vy)
        impact = stored_impact_speed(state.tooth_impact[arc], speed, tooth.law.speed_floor)
        state.tooth_impact[arc] = impact
        px = ox + lx - tooth.arc_radius * nx
        py = oy + ly - tooth.arc_radius * ny
        work.tooth_force[arc] = _apply(
            chain, state, wheels, work, tooth.law, body, SPROCKET, 1, px, py, nx, ny, depth, speed, impact, radius,
            step, implicit,
        )  # fmt: skip
        work.tooth_area[arc] = area
        work.tooth_groove[arc] = k


@kernel
def wheel_loads(chain: Chain, shoes: Shoes, wheels: Wheels, state: State, work: Work, step, implicit):
    """Contact of every link near a wheel with it (Fig. 12)."""
    for link in range(shoes.link_body.shape[0]):
        body = shoes.link_body[link]
        c, s = work.cos[body], work.sin[body]
        start, end = shoes.link_start[link], shoes.link_end[link]
        ax = work.pin_x[body] + start * c
        ay = work.pin_y[body] + start * s
        bx = work.pin_x[body] + end * c
        by = work.pin_y[body] + end * s
        half = 0.5 * (end - start)
        for wheel in range(wheels.x.shape[0]):
            if not wheels.present[wheel]:
                continue
            cx, cy = wheels.x[wheel], wheels.y[wheel]
            reach = wheels.radius[wheel] + wheels.half_thickness
            mx = 0.5 * (ax + bx) - cx
            my = 0.5 * (ay + by) - cy
            depth = 0.0
            if mx * mx + my * my < (reach + half) ** 2:
                _, qx, qy, distance = foot(ax, ay, bx, by, cx, cy)
                depth = reach - distance
            if depth <= 0.0:
                work.wheel_force[link, wheel] = 0.0
                state.wheel_impact[link, wheel] = 0.0
                continue
            nx = (qx - cx) / distance
            ny = (qy - cy) / distance
            gx = work.pin_x[body] + chain.com_x[body] * c - chain.com_y[body] * s
            gy = work.pin_y[body] + chain.com_x[body] * s + chain.com_y[body] * c
            w = state.rate[body]
            speed = -(nx * (work.com_vx[body] - w * (qy - gy)) + ny * (work.com_vy[body] + w * (qx - gx)))
            law = wheels.ring_law if wheel == SPROCKET else wheels.wheel_law
            impact = stored_impact_speed(state.wheel_impact[link, wheel], speed, law.speed_floor)
            state.wheel_impact[link, wheel] = impact
            px = qx - wheels.half_thickness * nx
            py = qy - wheels.half_thickness * ny
            work.wheel_force[link, wheel] = _apply(
                chain, state, wheels, work, law, body, wheel, 0, px, py, nx, ny, depth, speed, impact,
                wheels.radius[wheel], step, implicit,
            )  # fmt: skip


@kernel
def contact_loads(model: Model, state: State, work: Work, implicit=None):
    """Contact loads on bodies and wheels at the present state.

    With ``implicit`` (`chain.implicit.ImplicitWork`) the forces are led to the end of the step and
    their slopes are added up for the linearly implicit sweep.
    """
    work.force_x[:] = 0.0
    work.force_y[:] = 0.0
    work.moment[:] = 0.0
    work.wheel_torque[:] = 0.0
    work.count[0] = 0
    if implicit is not None:
        implicit.inertia[:] = 0.0
        implicit.couple[:] = 0.0
        implicit.wheel_inertia[:] = 0.0
    if model.tooth.present:
        tooth_loads(model.chain, model.shoes, model.tooth, model.wheels, state, work, model.step, implicit)
    wheel_loads(model.chain, model.shoes, model.wheels, state, work, model.step, implicit)

"""Contact laws for the independent code, written from the equations, not from ``trackdyn.contact``.

They differ by design from the simulator's kernels: of a groove folded about its middle the deepest area is taken, links
are tested in their own frame. Everything is in one file, so that numba's cache sees every edit.
"""

from math import atan2, cos, floor, hypot, pi, sin, sqrt, tanh
from typing import NamedTuple

import numpy as np

from trackdyn.inputs.errors import InputError
from trackdyn.jit import kernel
from trackdyn.rig.layout import wheel_circles
from trackdyn.scene.scene import Scene

POSITION_NUDGE, RATE_NUDGE = 1e-8, 1e-6  # steps of the difference quotients: m or rad, m/s or rad/s


class Contacts(NamedTuple):
    """Constants of all contacts."""

    # (w, 3) centre x, y and radius of the sprocket's ring and of the other wheels, m; radius 0: no ring
    circle: np.ndarray
    # (1 + w, 7) a row each for tooth, ring and every other wheel: ``(pi / (2 sqrt 2)) L E*`` (N/m), ``3 (1 - c_r^2) /
    # 4``, static and dynamic friction, transition velocity (m/s), least impact velocity (m/s), largest damping bracket
    law: np.ndarray
    # (k, 6) areas of the left flank, 1 to 5, in the groove's frame: centre x, y, radius (m), direction x, y,
    # half angle (rad)
    arc: np.ndarray
    sign: np.ndarray  # (k,) +1 for a convex area, -1 for a concave one
    teeth: int  # number of grooves
    reach: float  # distance from the sprocket's centre beyond which no arc is in contact, m
    arc_radius: float  # radius of the connector's arcs, m
    half_thickness: float  # half thickness of the links, m


class Memory(NamedTuple):
    """Memory of the contacts: initial impact velocity of every arc (n,) and of link and wheel (n / 2, w), m/s."""

    tooth: np.ndarray
    wheel: np.ndarray


def make_contacts(scene: Scene, shift: float) -> Contacts:
    """Return the constants for a scene whose tensioning wheel is shifted by ``shift`` (m)."""
    rig, groove = scene.rig, scene.rig.groove_profile
    flank = slice(len(groove.radius) // 2)
    circle = wheel_circles(rig, shift, surface=True)
    circle[0, 2] = scene.ring_radius or 0.0
    columns = (groove.centre, groove.radius, groove.direction, groove.half_angle)
    arc = np.column_stack([column[flank] for column in columns])
    surfaces = [rig.contact_surfaces[wheel.surface] for wheel in rig.wheels.values()]
    if any(surface.friction_law == "dahl" for surface in (rig.ring_contact, *surfaces)):
        only = "the comparison with another program has only Eq. 10; use regularised there"
        raise InputError(f"friction_law = dahl: {only}")
    law = [
        (
            pi * surface.contact_length * rig.composite_modulus(surface) / sqrt(8),
            0.75 * (1 - surface.restitution**2), surface.friction_static, surface.friction_dynamic,
            surface.transition_velocity, rig.impact.speed_floor, rig.impact.factor_limit,
        )
        for surface in (rig.tooth_contact, rig.ring_contact, *surfaces)
    ]  # fmt: skip
    sign, teeth = np.where(groove.convex[flank], 1.0, -1.0), rig.sprocket.teeth
    arc_radius, half_thickness = rig.chain.connector_radius, rig.chain.link_thickness / 2
    reach = groove.addendum + arc_radius
    return Contacts(circle, np.array(law), arc, sign, teeth, reach, arc_radius, half_thickness)


@kernel
def _forces(law, depth, speed, slip, memory, radius):
    """Return the normal (Eq. 8) and the friction force (Eq. 10) of a contact, N."""
    impact = memory if memory > 0.0 else max(abs(speed), law[5])
    bracket = min(max(1.0 + law[1] * speed / impact, 0.0), law[6])
    normal = law[0] * depth * sqrt(depth / (depth + radius)) * bracket
    x = abs(slip) / law[4]
    mu = law[3] * tanh(4.0 * x) + (law[2] - law[3]) * x / (0.25 * x * x + 0.75) ** 2
    return normal, -normal * mu if slip > 0.0 else normal * mu


@kernel
def _add(i, wheel, px, py, nx, ny, law, depth, speed, memory, radius, q, v, circle, spin, load, torque):
    """Add the contact of body ``i`` at point p to its load (n, 3) and to the wheel's torque (n, w)."""
    ax, ay = px - q[3 * i], py - q[3 * i + 1]
    ox, oy = px - circle[wheel, 0], py - circle[wheel, 1]
    # the two material points that touch; slip against the tangent that lies to the left of n
    vx = v[3 * i] - v[3 * i + 2] * ay + spin * oy
    vy = v[3 * i + 1] + v[3 * i + 2] * ax - spin * ox
    normal, friction = _forces(law, depth, speed, nx * vy - ny * vx, memory, radius)
    fx, fy = normal * nx - friction * ny, normal * ny + friction * nx
    load[i, 0] += fx
    load[i, 1] += fy
    load[i, 2] += ax * fy - ay * fx
    torque[i, wheel] -= ox * fy - oy * fx


@kernel
def _groove_contact(c: Contacts, x, y, sprocket_angle):
    """Return depth, n and R of Eq. 8 of the deepest contact of an arc centred at (x, y) from the sprocket's centre."""
    sector = 2.0 * pi / c.teeth
    position = (atan2(y, x) - sprocket_angle) / sector
    middle = sprocket_angle + (floor(position) + 0.5) * sector
    s, k = sin(middle), cos(middle)
    gx, gy = x * s - y * k, x * k + y * s  # the groove's axes: clockwise and outward
    mirror = -1.0 if gx > 0.0 else 1.0
    depth = nx = ny = radius = 0.0
    for j in range(c.arc.shape[0]):
        ex, ey = mirror * gx - c.arc[j, 0], gy - c.arc[j, 1]
        d = hypot(ex, ey)
        along = ex * c.arc[j, 3] + ey * c.arc[j, 4]
        sideways = ex * c.arc[j, 4] - ey * c.arc[j, 3]
        if d == 0.0 or abs(atan2(sideways, along)) > c.arc[j, 5]:
            continue
        here = c.arc_radius + c.sign[j] * (c.arc[j, 2] - d)
        if depth < here <= c.arc_radius:
            depth, radius = here, c.arc[j, 2] + c.sign[j] * c.arc_radius
            nx, ny = mirror * c.sign[j] * ex / d, c.sign[j] * ey / d
    return depth, nx * s + ny * k, ny * s - nx * k, radius


@kernel
def peer_contact_loads(c: Contacts, length, q, v, angle, spin, memory: Memory, update, load, torque):
    """Compute the (n, 3) ``load`` of all contacts on the bodies and their (n, w) ``torque`` on each wheel.

    ``q`` and ``v`` (3 n + w - 1,) are mass centre x, y and angle of every body, angles of the wheels but the sprocket,
    and their rates; ``angle`` and ``spin`` are the sprocket's. With ``update`` the step is accepted.
    """
    load[:] = 0.0
    torque[:] = 0.0
    for i in range(load.shape[0]):
        x, y, w = q[3 * i], q[3 * i + 1], v[3 * i + 2]
        hx, hy = 0.5 * length[i] * cos(q[3 * i + 2]), 0.5 * length[i] * sin(q[3 * i + 2])
        if i % 2 == 1:
            for side in range(2):
                dx, dy = (hx, hy) if side else (-hx, -hy)
                lx, ly = x + dx - c.circle[0, 0], y + dy - c.circle[0, 1]
                depth = nx = ny = speed = radius = 0.0
                arc = i - 1 + side
                if hypot(lx, ly) <= c.reach:
                    depth, nx, ny, radius = _groove_contact(c, lx, ly, angle)
                if depth > 0.0:
                    speed = -nx * (v[3 * i] - w * dy + spin * ly) - ny * (v[3 * i + 1] + w * dx - spin * lx)
                    px, py = x + dx - c.arc_radius * nx, y + dy - c.arc_radius * ny
                    _add(i, 0, px, py, nx, ny, c.law[0], depth, speed, memory.tooth[arc], radius, q, v, c.circle,
                         spin, load, torque)  # fmt: skip
                if update:
                    memory.tooth[arc] = _remembered(memory.tooth[arc], depth, speed, c.law[0, 5])
            continue
        for wheel in range(c.circle.shape[0]):
            radius, law = c.circle[wheel, 2], c.law[wheel + 1]
            if radius == 0.0:
                continue
            # the wheel's centre in the link's frame
            ex, ey = c.circle[wheel, 0] - x, c.circle[wheel, 1] - y
            half = 0.5 * length[i]
            u = min(max((ex * hx + ey * hy) / half, -half), half) / half
            nx, ny = u * hx - ex, u * hy - ey
            distance = hypot(nx, ny)
            depth = radius + c.half_thickness - distance
            speed = 0.0
            if depth > 0.0:
                nx, ny = nx / distance, ny / distance
                speed = -nx * (v[3 * i] - w * u * hy) - ny * (v[3 * i + 1] + w * u * hx)
                rate = spin if wheel == 0 else v[3 * load.shape[0] + wheel - 1]
                px, py = x + u * hx - c.half_thickness * nx, y + u * hy - c.half_thickness * ny
                _add(i, wheel, px, py, nx, ny, law, depth, speed, memory.wheel[i // 2, wheel], radius, q, v, c.circle,
                     rate, load, torque)  # fmt: skip
            if update:
                memory.wheel[i // 2, wheel] = _remembered(memory.wheel[i // 2, wheel], depth, speed, law[5])


@kernel
def _remembered(stored, depth, speed, floor):
    if depth <= 0.0:
        return 0.0
    return stored if stored > 0.0 else max(abs(speed), floor)


@kernel
def force_vector(c: Contacts, length, q, v, angle, spin, memory: Memory, load, torque, force):
    """Write the generalised ``force`` (3 n + w - 1,) of all contacts; other arguments as in `peer_contact_loads`."""
    peer_contact_loads(c, length, q, v, angle, spin, memory, False, load, torque)
    n = load.shape[0]
    force[3 * n :] = 0.0
    for i in range(n):
        for k in range(3):
            force[3 * i + k] = load[i, k]
        for k in range(c.circle.shape[0] - 1):
            force[3 * n + k] += torque[i, 1 + k]


@kernel
def jacobian_triplets(c: Contacts, length, q, v, angle, spin, memory: Memory, by_q, by_v, loads, torques, triplets):
    """Write the nonzero entries of ``-by_q dF/dq - by_v dF/dv`` as rows (row, column, value); return their count."""
    n, free = loads.shape[1], c.circle.shape[0] - 1
    count = 0
    peer_contact_loads(c, length, q, v, angle, spin, memory, False, loads[0], torques[0])
    # loads of a body depend on it and on the wheels that it touches: all bodies are nudged at once, then each wheel
    for k in range(6 + free):
        nudge = POSITION_NUDGE if k < 3 else RATE_NUDGE
        factor = -by_q / nudge if k < 3 else -by_v / nudge
        changed = q if k < 3 else v
        first, stride, times = (k % 3, 3, n) if k < 6 else (3 * n + k - 6, 1, 1)
        for i in range(times):
            changed[first + stride * i] += nudge
        peer_contact_loads(c, length, q, v, angle, spin, memory, False, loads[1], torques[1])
        for i in range(times):
            changed[first + stride * i] -= nudge
        for i in range(n):
            column = 3 * i + k % 3 if k < 6 else first
            # the body's three coordinates, then the angles of the wheels
            for j in range(3 + free):
                if j < 3:
                    row, change = 3 * i + j, loads[1, i, j] - loads[0, i, j]
                else:
                    row, change = 3 * n + j - 3, torques[1, i, j - 2] - torques[0, i, j - 2]
                if change != 0.0:
                    triplets[count, 0], triplets[count, 1], triplets[count, 2] = row, column, factor * change
                    count += 1
    return count

"""One contact: motion of its point, forces of its laws, and their loads (Eqs. 8 to 11, 31, 32, 38, 39).

Points and normals are in the frame of the touched wheel (`contact.axial`), in the plane the inertial one. ``implicit``
is the work of a linearly implicit step or None, ``space`` that of motion in space or None.
"""

from typing import NamedTuple

from trackdyn.chain.kinematics import mass_centre
from trackdyn.contact.axial import friction_coefficients, to_plane_frame, to_wheel_frame, wheel_centre
from trackdyn.contact.laws import force_and_slopes, sheared
from trackdyn.jit import inlined, kernel
from trackdyn.model.arrays import GUIDE, OFFSET, SPEED, P, Q, State, Work
from trackdyn.model.constants import SPROCKET, Law, Model

# Fraction of a linearly implicit step at which contact depths are taken: half is stable for any stiffness and
# dissipates half as much as the end of the step.
AHEAD = 0.5
# Fraction of the last step's change that other steps of order 1 add to velocities: damping forces would otherwise lag
# half a step behind the positions.
PREDICTION = 0.5


class Contact(NamedTuple):
    """Point at which a body touches a wheel, in the wheel's frame, and the arguments of the laws except the slip."""

    body: int
    wheel: int
    kind: int  # `model.arrays.SURFACE` and those behind it
    slot: int  # index in ``work.friction``
    x: float  # the point, m, and the unit normal of the force on the body
    y: float
    z: float
    normal_x: float
    normal_y: float
    law: Law
    depth: float  # m, m/s, m/s, m: arguments of `contact.laws.force_and_slopes`
    speed: float
    impact_speed: float
    radius: float
    share: float  # fraction of the contact length that overlaps
    slip_compliance: float  # change of the slip per unit of friction within the step, m/s/N
    guide: float  # force of a guide along the wheel's axis, N


@inlined
def mass_centre_arm(chain, work, body, x, y):
    """Return the arm of a point from a body's mass centre, m."""
    gx, gy = mass_centre(chain, work, body)
    return x - (work.pin_x[body] + gx), y - (work.pin_y[body] + gy)


@kernel
def point_velocity(state, work, space, body, point, arm, prediction):
    """Return the velocity of a body's point, plus ``prediction`` times its last change, in the plane's frame, m/s."""
    (x, y, z), (ax, ay) = point, arm
    w, dw = state.rate[body], prediction * work.delta_omega[body]
    vx = work.com_vx[body] - w * ay + prediction * work.com_dvx[body] - dw * ay
    vy = work.com_vy[body] + w * ax + prediction * work.com_dvy[body] + dw * ax
    if space is None:
        return vx, vy, 0.0
    motion = state.plane.motion
    az, vz = z - motion[OFFSET], motion[SPEED] + motion[P] * (y - state.pin[1]) - motion[Q] * (x - state.pin[0])
    return vx + motion[Q] * az, vy - motion[P] * az, vz


@kernel
def wheel_velocity(state: State, suspensions, wheel, past):
    """Return the velocity of a wheel's centre, m/s, 0 without a suspension; ``past`` is the weight of the last step."""
    k = suspensions.of_wheel[wheel]
    if k < 0:
        return 0.0, 0.0
    # the direction is that of the step before: an arm's rotation in one step is lost in rounding of the velocity
    suspension = state.suspension[k]
    rate = (1.0 - past) * suspension["rate"] + past * suspension["rate_before"]
    return rate * suspension["along_x"], rate * suspension["along_y"]


@kernel
def velocity_over_wheel(model, state, space, wheel, velocity, ox, oy):
    """Return the ``velocity`` of a point (``ox, oy`` from the wheel's centre) over the wheel, in the wheel's frame."""
    vx, vy, vz = to_wheel_frame(space, wheel, velocity[0], velocity[1], velocity[2])
    tx, ty = wheel_velocity(state, model.suspensions, wheel, 0.0)
    rate = state.wheel_rate[wheel]
    return vx - tx + rate * oy, vy - ty - rate * ox, vz


@inlined
def friction_secant(force, mu, slip):
    """Return friction over slip (N s/m) under a normal force."""
    return force * abs(mu) / max(abs(slip), 1e-9)


@kernel
def add_inertia(work, implicit, contact, x, y, ox, oy, normal, friction):
    """Add the slopes of a contact to the masses of a linearly implicit sweep.

    ``x, y`` is the point in the plane's frame, ``ox, oy`` from the wheel's centre (m); ``normal`` and ``friction`` are
    the forces against a unit acceleration along normal and tangent, kg.
    """
    body, wheel, nx, ny = contact.body, contact.wheel, contact.normal_x, contact.normal_y
    rx, ry = x - work.pin_x[body], y - work.pin_y[body]
    m1, m2 = rx * ny - ry * nx, rx * nx + ry * ny
    inertia = implicit.inertia[body]
    inertia[0] += normal * nx * nx + friction * ny * ny
    inertia[1] += (normal - friction) * nx * ny
    inertia[2] += normal * ny * ny + friction * nx * nx
    inertia[3] += normal * nx * m1 - friction * ny * m2
    inertia[4] += normal * ny * m1 + friction * nx * m2
    inertia[5] += normal * m1 * m1 + friction * m2 * m2
    if wheel != SPROCKET:
        arm = friction * (ox * nx + oy * ny)  # slip falls by (o . n) times the wheel's acceleration
        couple = implicit.couple[body, wheel]
        couple[0] -= arm * ny
        couple[1] += arm * nx
        couple[2] += arm * m2
        implicit.wheel_inertia[wheel] += arm * (ox * nx + oy * ny)


@kernel
def add_in_space(space, contact, arm, load, from_centre, wheel_load):
    """Add the loads of a contact across the plane of the chain, and on the bearing of its wheel.

    ``arm`` from the body's mass centre (m) and ``load`` (N) are in the plane's frame, ``from_centre`` of the wheel and
    ``wheel_load`` the same force in the wheel's.
    """
    (ax, ay, az), (fx, fy, fz) = arm, load
    (ox, oy, oz), (wx, wy, wz) = from_centre, wheel_load
    space.force_z[contact.body] += fz
    space.moment_x[contact.body] += ay * fz - az * fy
    space.moment_y[contact.body] += az * fx - ax * fz
    reaction = space.wheel_load[contact.wheel]
    reaction[0] -= wx
    reaction[1] -= wy
    reaction[2] -= wz
    reaction[3] -= oy * wz - oz * wy
    reaction[4] -= oz * wx - ox * wz
    reaction[5] -= ox * wy - oy * wx


@kernel
def list_contact(state: State, row, space, contact: Contact, places, velocity, force):
    """Write a contact into its ``row`` of the contact list.

    ``places``: the point and its arm from the body's mass centre in the plane's frame, and the point from the wheel's
    centre in the wheel's, m; ``velocity`` is the body's, m/s; ``force``: normal, tangential and axial components, N.
    """
    ((x, y, z), (ax, ay), (ox, oy)), (normal, friction, axial) = places, force
    wheel, nx, ny = contact.wheel, contact.normal_x, contact.normal_y
    row["normal_x"], row["normal_y"], normal_z = to_plane_frame(space, wheel, normal * nx, normal * ny, contact.guide)
    row["friction_x"], row["friction_y"], friction_z = to_plane_frame(
        space, wheel, -friction * ny, friction * nx, axial
    )
    row["spin_x"], row["spin_y"], spin_z = to_plane_frame(space, wheel, -oy, ox, 0.0)
    row["arm_x"], row["arm_y"] = ax, ay
    row["speed_x"], row["speed_y"] = velocity[0], velocity[1]
    row["rate"] = state.wheel_rate[wheel]
    row["body"], row["wheel"], row["kind"], row["slot"] = contact.body, wheel, contact.kind, contact.slot
    if space is not None:
        row["normal_z"], row["friction_z"], row["spin_z"] = normal_z, friction_z, spin_z
        row["arm_z"], row["speed_z"] = z - state.plane.motion[OFFSET], velocity[2]
        row["pin_x"], row["pin_y"] = x - state.pin[0], y - state.pin[1]


@kernel
def shear_after_step(model: Model, state: State, contact: Contact, slip, normal):
    """Return the elastic displacement of a link along a wheel under Dahl's law at this state, m; 0 where it begins.

    It is advanced once a step, over the last step at the slip (m/s) of the velocity that moved the link in it.
    """
    k = contact.slot - state.tooth_impact.shape[0]
    passed = state.steps[0] - state.shear[1, k]
    if passed == 1.0:
        state.shear[0, k] = sheared(contact.law, state.shear[0, k], slip, normal, model.step)[0]
    elif passed != 0.0:
        state.shear[0, k] = 0.0
    state.shear[1, k] = state.steps[0]
    return state.shear[0, k]


@kernel
def shear_energy(model: Model, state: State, wheel):
    """Return the energy of the elastic displacements of the links on a wheel under Dahl's law, J."""
    stiffness, (links, count) = model.wheels.law[wheel]["shear_stiffness"], state.wheel_impact.shape
    energy = 0.0
    if stiffness > 0.0:
        for link in range(links):
            k = link * count + wheel
            if state.wheel_impact[link, wheel] > 0.0:  # touches
                energy += 0.5 * stiffness * state.shear[0, k] * state.shear[0, k]
    return energy


@kernel
def apply(model: Model, state: State, work: Work, contact: Contact, space, implicit):
    """Add the forces of a contact to loads and contact list; return the normal force now, N."""
    law, body, wheel, nx, ny = contact.law, contact.body, contact.wheel, contact.normal_x, contact.normal_y

    # slip of the predicted velocity: along tau = z x n (Eqs. 31, 38 with the links' own rotation), and axial (32, 39)
    x, y, z = to_plane_frame(space, wheel, contact.x, contact.y, contact.z)
    ax, ay = mass_centre_arm(model.chain, work, body, x, y)
    vx, vy, vz = point_velocity(state, work, space, body, (x, y, z), (ax, ay), 0.0)
    prediction = PREDICTION if implicit is None else 0.0
    predicted = point_velocity(state, work, space, body, (x, y, z), (ax, ay), prediction)
    cx, cy, cz = wheel_centre(model, space, wheel)
    ox, oy = contact.x - cx, contact.y - cy
    sx, sy, axial_slip = velocity_over_wheel(model, state, space, wheel, predicted, ox, oy)
    slip = nx * sy - ny * sx

    # normal force, and friction against the slip
    speed = contact.speed
    force, stiffness, damping = force_and_slopes(law, contact.depth, speed, contact.impact_speed, contact.radius)
    normal = present = contact.share * force
    mu, axial_mu = friction_coefficients(model.space, law, slip, axial_slip)
    shear = 0.0
    if law.shear_stiffness > 0.0:
        passed = velocity_over_wheel(model, state, space, wheel, (vx, vy, vz), ox, oy)
        shear = shear_after_step(model, state, contact, nx * passed[1] - ny * passed[0], present)
    row = work.contact[work.count[0]]
    if implicit is not None:
        # ahead by the slopes; terms proportional to the step's accelerations go into the sweep
        normal = present + AHEAD * model.step * stiffness * speed
        normal_slope = model.step * (damping + AHEAD * model.step * stiffness)
        if normal <= 0.0:
            normal = normal_slope = 0.0
        if law.shear_stiffness > 0.0:
            shear, shear_slope = sheared(law, shear, slip, normal, model.step)
            friction_slope = model.step * law.shear_stiffness * shear_slope
        else:
            friction_slope = friction_secant(model.step * normal, mu, slip)
        add_inertia(work, implicit, contact, x, y, ox, oy, normal_slope, friction_slope)
        row["normal_slope"] = normal_slope
        row["friction_slope"] = friction_slope
    friction = -normal * mu
    if law.shear_stiffness > 0.0:
        friction = -law.shear_stiffness * shear
    elif contact.slip_compliance > 0.0:
        # the predicted slip contains the last step's friction; its change acts by the secant of Eq. 10
        resisted = friction_secant(contact.slip_compliance * normal, mu, slip)
        friction = (friction + resisted * work.friction[1, contact.slot]) / (1.0 + resisted)
    if contact.kind != GUIDE:
        work.friction[0, contact.slot] = friction
    axial = -normal * axial_mu

    # onto body, wheel and list
    wx, wy, wz = normal * nx - friction * ny, normal * ny + friction * nx, axial + contact.guide
    fx, fy, fz = to_plane_frame(space, wheel, wx, wy, wz)
    work.force_x[body] += fx
    work.force_y[body] += fy
    work.moment[body] += ax * fy - ay * fx
    work.wheel_torque[wheel] -= ox * wy - oy * wx
    places, components = ((x, y, z), (ax, ay), (ox, oy)), (normal, friction, axial)
    list_contact(state, row, space, contact, places, (vx, vy, vz), components)
    if space is not None:
        arm = (ax, ay, z - state.plane.motion[OFFSET])
        add_in_space(space, contact, arm, (fx, fy, fz), (ox, oy, contact.z - cz), (wx, wy, wz))
    work.count[0] += 1
    return present

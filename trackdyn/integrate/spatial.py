"""The time loop of motion in space: the planar step, and the plane of the chain carried along with it.

In the plane the step is that of `integrate.semi_implicit.advance`, projection included: a scene whose wheels
are all aligned gives the numbers of the planar run. The plane follows with the same method: velocities
with the accelerations at the start of the step, then offset and attitude with the new velocities.
"""

from math import sqrt

from trackdyn.chain.kinematics import bushing_torques, orient, place
from trackdyn.chain.model import Chain
from trackdyn.chain.spatial import (
    OFFSET,
    SPEED,
    P,
    Plane,
    Q,
    Space,
    SpaceWork,
    Spatial,
    aim,
    plane_dynamics,
    turn_plane,
)
from trackdyn.contact.spatial import FLANK, contact_loads
from trackdyn.integrate.dynamics import accumulate, sense, solve_chain
from trackdyn.integrate.energy import energies
from trackdyn.integrate.run import keep
from trackdyn.integrate.semi_implicit import RATE_LIMIT, advance
from trackdyn.integrate.spells import log_spells
from trackdyn.jit import kernel
from trackdyn.model import (
    BUSHING_LOSS,
    GRAVITY,
    KINETIC,
    SPROCKET,
    SPROCKET_WORK,
    TOOTH_FRICTION,
    TOOTH_NORMAL,
    WHEEL_FRICTION,
    WHEEL_NORMAL,
    Model,
    Record,
    State,
    Work,
)


@kernel
def run_spatial(model: Model, state: State, work: Work, record: Record, first, last, stride, spatial: Spatial):
    """Integrate samples ``first`` to ``last - 1`` of ``stride`` steps each and fill their rows.

    As `integrate.run.run`, with ``spatial`` (`trackdyn.space.build_space`) for what lies out of the plane.

    Returns
    -------
    body : int
        -1, or the body at which the run left the physical range (0 for the plane itself).
    """
    orient(state.angle, work.cos, work.sin)
    place(model.chain, state, work)
    evaluate_loads(model, state, work, spatial)
    room = spatial.work
    for sample in range(first, last):
        gap = 0.0
        for k in range(3):
            work.sensed[3 + k] = 0.0
        room.axial[:] = 0.0
        orient(state.angle, work.cos, work.sin)
        for _ in range(stride):
            for wheel in range(room.axial.shape[0]):
                room.axial[wheel] += room.wheel_load[wheel, 2] / stride
            bad = take_step(model, state, work, spatial)
            if bad >= 0:
                return bad
            if record.spells.enabled:
                log_spells(record.spells, state, work, state.steps[0] * model.step, model.step)
            gap = max(gap, sqrt(work.cut[0] * work.cut[0] + work.cut[1] * work.cut[1]))
        keep(model, state, work, record, sample, stride, gap)
        add_energies(model.chain, spatial.space, spatial.plane, state, work, room, record.energy[sample])
        keep_plane(spatial, sample)
    return -1


@kernel
def evaluate_loads(model: Model, state: State, work: Work, spatial: Spatial):
    """Contacts and bushings at the present state, the bodies placed in the plane."""
    aim(spatial.space, spatial.plane, model.chain.gravity, spatial.work)
    contact_loads(model, state, work, spatial.space, spatial.plane, spatial.work)
    bushing_torques(model.chain, state, work, 0.0)


@kernel
def take_step(model: Model, state: State, work: Work, spatial: Spatial):
    """One step from evaluated loads to the loads of the next one; returns -1 or the body that left the range."""
    chain, plane, room = model.chain, spatial.plane, spatial.work
    plane_dynamics(chain, spatial.space, plane, state, work, room)
    solve_chain(model, state, work, model.step)
    sense(model, state, work)
    sense_plane(model, plane, state, work)
    accumulate(work, 1.0)
    bad = advance(model, state, work, None)
    if bad >= 0:
        return bad
    turn_plane(plane, state, room, model.step)
    if not abs(plane.motion[P]) + abs(plane.motion[Q]) < RATE_LIMIT:
        return 0
    place(chain, state, work)
    account(model, state, work, room)
    evaluate_loads(model, state, work, spatial)
    return -1


@kernel
def sense_plane(model: Model, plane: Plane, state: State, work: Work):
    """Add ``(q u, -p u)``, the part of the sensor's acceleration that the turning plane makes."""
    sensor, p, q = model.sensor, plane.motion[P], plane.motion[Q]
    b = sensor.body
    c, s = work.cos[b], work.sin[b]
    x = work.pin_x[b] - state.pin[0] + (c * sensor.x - s * sensor.y)
    y = work.pin_y[b] - state.pin[1] + (s * sensor.x + c * sensor.y)
    u = p * y - q * x
    work.sensed[0] += (c * q - s * p) * u
    work.sensed[1] -= (s * q + c * p) * u


@kernel
def account(model: Model, state: State, work: Work, room: SpaceWork):
    """Work of every force over the last step: its place at the start, the mean of the velocities.

    As `integrate.energy.account`. Axial friction counts as friction of its surface, guides as normal
    forces of the wheels.
    """
    chain, h, done, row = model.chain, model.step, state.work_done, room.contact
    dvz, dp, dq = room.change[0], room.change[1], room.change[2]
    for k in range(room.count[0]):
        body = room.contact_body[k, 0]
        wheel = room.contact_body[k, 1]
        kind = room.contact_body[k, 2]
        ax, ay, az = row[k, 6], row[k, 7], row[k, 8]
        dw = state.rate[body] - work.old_rate[body]
        vx = row[k, 9] + 0.5 * (work.com_dvx[body] - dw * ay + dq * az)
        vy = row[k, 10] + 0.5 * (work.com_dvy[body] + dw * ax - dp * az)
        vz = row[k, 11] + 0.5 * (dvz + dp * row[k, 17] - dq * row[k, 16])
        ww = 0.5 * (row[k, 15] + state.wheel_rate[wheel])
        sx, sy, sz = ww * row[k, 12], ww * row[k, 13], ww * row[k, 14]
        if wheel == SPROCKET:
            done[SPROCKET_WORK] += h * (
                (row[k, 0] + row[k, 3]) * sx + (row[k, 1] + row[k, 4]) * sy + (row[k, 2] + row[k, 5]) * sz
            )
        vx -= sx
        vy -= sy
        vz -= sz
        normal = -h * (row[k, 0] * vx + row[k, 1] * vy + row[k, 2] * vz)
        friction = -h * (row[k, 3] * vx + row[k, 4] * vy + row[k, 5] * vz)
        if kind == FLANK:
            done[TOOTH_NORMAL] += normal
            done[TOOTH_FRICTION] += friction
        else:
            done[WHEEL_NORMAL] += normal
            done[WHEEL_FRICTION] += friction
    n = state.rate.shape[0]
    loss = 0.0
    for i in range(n):
        after = state.rate[i + 1 if i < n - 1 else 0] - state.rate[i]
        loss += after * (work.joint_rate[i] + after)
    done[BUSHING_LOSS] += 0.5 * h * chain.damping * loss


@kernel
def add_energies(chain: Chain, space: Space, plane: Plane, state: State, work: Work, room: SpaceWork, out):
    """Add the out-of-plane kinetic energy and what the tilt changes in the energy of gravity (J)."""
    p, q, z = plane.motion[P], plane.motion[Q], plane.motion[OFFSET]
    a = room.attitude
    kinetic = lift = 0.0
    for i in range(state.rate.shape[0]):
        c, s = work.cos[i], work.sin[i]
        x = work.pin_x[i] + chain.com_x[i] * c - chain.com_y[i] * s
        y = work.pin_y[i] + chain.com_x[i] * s + chain.com_y[i] * c
        v = plane.motion[SPEED] + p * (y - state.pin[1]) - q * (x - state.pin[0])
        own_x = c * p + s * q  # the plane's angular velocity along the pin line and across it
        own_y = c * q - s * p
        kinetic += 0.5 * (chain.mass[i] * v * v + space.along[i] * own_x * own_x + space.across[i] * own_y * own_y)
        lift += chain.mass[i] * chain.gravity * (a[1, 0] * x + (a[1, 1] - 1.0) * y + a[1, 2] * z)
    out[KINETIC] += kinetic
    out[GRAVITY] += lift


@kernel
def all_energies(model: Model, state: State, work: Work, spatial: Spatial, out):
    """Fill ``out`` with the account of work and the energies of the present state (J)."""
    energies(model, state, work, out)
    add_energies(model.chain, spatial.space, spatial.plane, state, work, spatial.work, out)


@kernel
def keep_plane(spatial: Spatial, sample):
    """Fill the out-of-plane rows of one sample."""
    plane, room, record = spatial.plane, spatial.work, spatial.record
    for k in range(4):
        record.motion[sample, k] = plane.motion[k]
        record.motion[sample, 4 + k] = plane.attitude[k]
    for wheel in range(room.axial.shape[0]):
        # the plane crosses the axis, direction (b20, b21, b22) in P, where its normal component is the offset
        across = plane.motion[OFFSET] - room.centre[wheel, 2]
        record.offset[sample, wheel] = across / room.relative[wheel, 2, 2]
        record.axial[sample, wheel] = room.axial[wheel]

"""The time loop: semi-implicit Euler (order 1) with the closure solved exactly and projected once a step.

Velocities are advanced with the accelerations at the start of the step, positions with the new
velocities. The remaining gap of the cut joint, of second order in the step, is removed by an extra
load through the cut: the response of the chain to that load is known from the sweep, so the
correction is the mass-weighted one and costs two multiply-adds a body. It changes positions and
velocities alike (the SHAKE form), which keeps the discrete path symplectic where nothing dissipates.
"""

from math import cos as cosine
from math import sin as sine
from math import sqrt
from typing import NamedTuple

import numpy as np

from trackdyn.chain.model import Chain
from trackdyn.chain.riccati import SweepWork, accelerations, make_work
from trackdyn.contact.laws import Law, friction_coefficient, normal_force, stored_impact_speed
from trackdyn.contact.tooth import Tooth, find_area, groove_index
from trackdyn.contact.wheel import foot
from trackdyn.jit import kernel

# rows of the account of work, all in J and counted from the start of the run
SPROCKET_WORK, TOOTH_NORMAL, TOOTH_FRICTION, WHEEL_NORMAL, WHEEL_FRICTION, BEARING, BUSHING_LOSS = range(7)
KINETIC, GRAVITY, BUSHING_ELASTIC = range(7, 10)
ENERGY_NAMES = (
    "sprocket_work",
    "tooth_normal",
    "tooth_friction",
    "wheel_normal",
    "wheel_friction",
    "bearing",
    "bushing_loss",
    "kinetic",
    "gravity",
    "bushing_elastic",
)
# |angular velocity| of a body beyond which a run has left the physical range, rad/s
RATE_LIMIT = 1000.0
SPROCKET = 0


class Wheels(NamedTuple):
    """The wheels that links touch: 0 the sprocket's ring, then the others.

    Attributes
    ----------
    present : (w,) integer array
        0: no contact with links (a sprocket without ring).
    x, y, radius, inertia, drag : (w,) arrays
        Centre, radius, moment of inertia, bearing drag; SI. The sprocket's motion is prescribed.
    half_thickness : float
        D/2 of the links, m.
    ring_law, wheel_law : Law
        Links on the sprocket's ring; links on the other wheels.
    """

    present: np.ndarray
    x: np.ndarray
    y: np.ndarray
    radius: np.ndarray
    inertia: np.ndarray
    drag: np.ndarray
    half_thickness: float
    ring_law: Law
    wheel_law: Law


class Drive(NamedTuple):
    """Prescribed angular velocity of the sprocket: 0 to ``rate`` in ``ramp`` seconds, then constant."""

    rate: float
    ramp: float


class Sensor(NamedTuple):
    """Body that carries the sensor and the sensor's place in the body frame, m."""

    body: int
    x: float
    y: float


class Model(NamedTuple):
    """Everything that stays constant during a run."""

    chain: Chain
    tooth: Tooth
    wheels: Wheels
    drive: Drive
    sensor: Sensor
    step: float


class State(NamedTuple):
    """Everything that a run carries from step to step (written in place).

    Attributes
    ----------
    steps : (1,) integer array
        Steps taken; the time is ``steps * step``.
    pin : (4,) array
        Position and velocity of the input pin of body 1 (m, m/s).
    angle, rate : (n,) arrays
        Orientation (rad) and angular velocity (rad/s) of the bodies.
    wheel_angle, wheel_rate : (w,) arrays
        The same of the wheels.
    tooth_impact : (n,) array
        Stored initial impact velocity of the arc at the input (even entries: left) and output
        (odd: right) pin of connector ``i // 2``, 0 without contact, m/s.
    wheel_impact : (n // 2, w) array
        The same for link and wheel.
    work_done : (7,) array
        Account of work, J.
    """

    steps: np.ndarray
    pin: np.ndarray
    angle: np.ndarray
    rate: np.ndarray
    wheel_angle: np.ndarray
    wheel_rate: np.ndarray
    tooth_impact: np.ndarray
    wheel_impact: np.ndarray
    work_done: np.ndarray


class Work(NamedTuple):
    """Arrays that a step overwrites.

    ``contact`` holds a row a contact: force normal (x, y), friction (x, y), arm from the body's
    mass centre (x, y), velocity of the body's point (x, y), arm from the wheel's centre (x, y),
    wheel rate. ``contact_body`` holds body, wheel and 1 for a tooth.
    """

    cos: np.ndarray
    sin: np.ndarray
    pin_x: np.ndarray
    pin_y: np.ndarray
    com_vx: np.ndarray
    com_vy: np.ndarray
    force_x: np.ndarray
    force_y: np.ndarray
    moment: np.ndarray
    torque: np.ndarray
    joint_rate: np.ndarray
    wheel_torque: np.ndarray
    tooth_force: np.ndarray
    tooth_area: np.ndarray
    tooth_groove: np.ndarray
    wheel_force: np.ndarray
    contact: np.ndarray
    contact_body: np.ndarray
    count: np.ndarray
    sweep: SweepWork


class Record(NamedTuple):
    """Arrays that a run fills, one row a sample.

    Attributes
    ----------
    raw, mean : (s, 3) arrays
        Acceleration of the sensor in the link frame (m/s2) and the link's angle (rad): at the
        sample's instant, and averaged over the interval before it.
    gap : (s,) array
        Largest distance between the two pins of the cut joint in the interval, m.
    place : (s, 2) array
        Middle of the sensor's link, m.
    wheel_rate : (s, w) array
        Angular velocities of the wheels, rad/s.
    energy : (s, 10) array
        See ``ENERGY_NAMES``, J.
    force : (s, p, 3) array
        Normal force of left arc, right arc and ring on the chosen pitches, N.
    area, groove : (s, p, 2) integer arrays
        Area and groove of the left and right arc, 0 without contact.
    pitches : (p,) integer array
        The chosen pitches (0-based).
    frame : (f, n + 3) array
        Configuration every ``frame_stride`` samples: pin x, y, angles, sprocket angle.
    frame_stride : int
        Samples between frames.
    """

    raw: np.ndarray
    mean: np.ndarray
    gap: np.ndarray
    place: np.ndarray
    wheel_rate: np.ndarray
    energy: np.ndarray
    force: np.ndarray
    area: np.ndarray
    groove: np.ndarray
    pitches: np.ndarray
    frame: np.ndarray
    frame_stride: int


def make_buffers(n: int, wheels: int) -> Work:
    """Allocate the arrays of a step for ``n`` bodies and ``wheels`` wheels."""
    contacts = n + (n // 2) * wheels
    return Work(
        *(np.zeros(n) for _ in range(2)),
        *(np.zeros(n + 1) for _ in range(2)),
        *(np.zeros(n) for _ in range(7)),
        np.zeros(wheels),
        np.zeros(n),
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.zeros((n // 2, wheels)),
        np.zeros((contacts, 11)),
        np.zeros((contacts, 3), np.int64),
        np.zeros(1, np.int64),
        make_work(n),
    )


@kernel
def orient(angle, cos, sin):
    """Cosine and sine of every body's angle."""
    for i in range(angle.shape[0]):
        cos[i] = cosine(angle[i])
        sin[i] = sine(angle[i])


@kernel
def place(chain: Chain, state: State, work: Work):
    """Pins and velocities of the mass centres along the chain."""
    x, y, vx, vy = state.pin[0], state.pin[1], state.pin[2], state.pin[3]
    for i in range(state.angle.shape[0]):
        c, s, w = work.cos[i], work.sin[i], state.rate[i]
        work.pin_x[i] = x
        work.pin_y[i] = y
        gx = chain.com_x[i] * c - chain.com_y[i] * s
        gy = chain.com_x[i] * s + chain.com_y[i] * c
        work.com_vx[i] = vx - w * gy
        work.com_vy[i] = vy + w * gx
        dx = chain.length[i] * c
        dy = chain.length[i] * s
        x += dx
        y += dy
        vx -= w * dy
        vy += w * dx
    work.pin_x[-1] = x
    work.pin_y[-1] = y


@kernel
def bushing_torques(chain: Chain, state: State, work: Work):
    """Torque of every bushing at the start of the step, and the joint rates it was taken at."""
    n = state.angle.shape[0]
    for i in range(n):
        k = i + 1 if i < n - 1 else 0
        phi = state.angle[k] - state.angle[i]
        if k == 0:
            phi -= 2.0 * np.pi  # a clockwise loop: angles fall by one turn along the chain
        rate = state.rate[k] - state.rate[i]
        work.joint_rate[i] = rate
        work.torque[i] = -chain.stiffness * (phi - chain.free_angle) - chain.damping * rate


@kernel
def _apply(chain: Chain, state: State, wheels: Wheels, work: Work, law, body, wheel, tooth, px, py, nx, ny, depth,
           speed, impact, radius):  # fmt: skip
    """Contact at point p with normal n on ``body``: forces into the loads and onto the contact list."""
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
    ft = -fn * friction_coefficient(law, slip)
    fx = fn * nx - ft * ny
    fy = fn * ny + ft * nx
    work.force_x[body] += fx
    work.force_y[body] += fy
    work.moment[body] += ax * fy - ay * fx
    work.wheel_torque[wheel] -= ox * fy - oy * fx
    k = work.count[0]
    row = work.contact[k]
    row[0] = fn * nx
    row[1] = fn * ny
    row[2] = -ft * ny
    row[3] = ft * nx
    row[4] = ax
    row[5] = ay
    row[6] = vx
    row[7] = vy
    row[8] = ox
    row[9] = oy
    row[10] = ww
    work.contact_body[k, 0] = body
    work.contact_body[k, 1] = wheel
    work.contact_body[k, 2] = tooth
    work.count[0] = k + 1
    return fn


@kernel
def tooth_loads(chain: Chain, tooth: Tooth, wheels: Wheels, state: State, work: Work):
    """Contact of both arcs of every connector near the sprocket (Fig. 11)."""
    cs = cosine(state.wheel_angle[SPROCKET])
    ss = sine(state.wheel_angle[SPROCKET])
    ws = state.wheel_rate[SPROCKET]
    ox = wheels.x[SPROCKET]
    oy = wheels.y[SPROCKET]
    reach = tooth.addendum + tooth.arc_radius  # Eq. 18
    for body in range(1, state.angle.shape[0], 2):
        mx = 0.5 * (work.pin_x[body] + work.pin_x[body + 1]) - ox
        my = 0.5 * (work.pin_y[body] + work.pin_y[body + 1]) - oy
        near = mx * mx + my * my <= (reach + 0.5 * chain.length[body]) ** 2
        k = 0
        if near:
            # the connector's middle chooses the groove, so both arcs always share one
            k = groove_index(tooth.teeth, cs * mx + ss * my, -ss * mx + cs * my)
            ck = cs * tooth.groove_cos[k - 1] - ss * tooth.groove_sin[k - 1]
            sk = ss * tooth.groove_cos[k - 1] + cs * tooth.groove_sin[k - 1]
        for side in range(2):
            arc = body - 1 + side
            area = 0
            depth = nkx = nky = radius = lx = ly = 0.0
            if near:
                lx = work.pin_x[body + side] - ox
                ly = work.pin_y[body + side] - oy
                if lx * lx + ly * ly <= reach * reach:
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
            c, s = work.cos[body], work.sin[body]
            w = state.rate[body]
            gx = chain.com_x[body] * c - chain.com_y[body] * s - side * chain.length[body] * c
            gy = chain.com_x[body] * s + chain.com_y[body] * c - side * chain.length[body] * s
            vx = work.com_vx[body] + w * gy + ws * ly
            vy = work.com_vy[body] - w * gx - ws * lx
            speed = -(nx * vx + ny * vy)
            impact = stored_impact_speed(state.tooth_impact[arc], speed, tooth.law.speed_floor)
            state.tooth_impact[arc] = impact
            px = work.pin_x[body + side] - tooth.arc_radius * nx
            py = work.pin_y[body + side] - tooth.arc_radius * ny
            work.tooth_force[arc] = _apply(
                chain, state, wheels, work, tooth.law, body, SPROCKET, 1, px, py, nx, ny, depth, speed, impact, radius
            )
            work.tooth_area[arc] = area
            work.tooth_groove[arc] = k


@kernel
def wheel_loads(chain: Chain, wheels: Wheels, state: State, work: Work):
    """Contact of every link near a wheel with it (Fig. 12)."""
    for body in range(0, state.angle.shape[0], 2):
        link = body // 2
        ax, ay = work.pin_x[body], work.pin_y[body]
        bx, by = work.pin_x[body + 1], work.pin_y[body + 1]
        for wheel in range(wheels.x.shape[0]):
            if not wheels.present[wheel]:
                continue
            cx, cy = wheels.x[wheel], wheels.y[wheel]
            reach = wheels.radius[wheel] + wheels.half_thickness
            mx = 0.5 * (ax + bx) - cx
            my = 0.5 * (ay + by) - cy
            depth = 0.0
            if mx * mx + my * my < (reach + 0.5 * chain.length[body]) ** 2:
                fraction, qx, qy, distance = foot(ax, ay, bx, by, cx, cy)
                depth = reach - distance
            if depth <= 0.0:
                work.wheel_force[link, wheel] = 0.0
                state.wheel_impact[link, wheel] = 0.0
                continue
            nx = (qx - cx) / distance
            ny = (qy - cy) / distance
            c, s = work.cos[body], work.sin[body]
            gx = ax + chain.com_x[body] * c - chain.com_y[body] * s
            gy = ay + chain.com_x[body] * s + chain.com_y[body] * c
            w = state.rate[body]
            speed = -(nx * (work.com_vx[body] - w * (qy - gy)) + ny * (work.com_vy[body] + w * (qx - gx)))
            law = wheels.ring_law if wheel == SPROCKET else wheels.wheel_law
            impact = stored_impact_speed(state.wheel_impact[link, wheel], speed, law.speed_floor)
            state.wheel_impact[link, wheel] = impact
            px = qx - wheels.half_thickness * nx
            py = qy - wheels.half_thickness * ny
            work.wheel_force[link, wheel] = _apply(
                chain, state, wheels, work, law, body, wheel, 0, px, py, nx, ny, depth, speed, impact,
                wheels.radius[wheel],
            )  # fmt: skip


@kernel
def loads(model: Model, state: State, work: Work):
    """All external loads at the present state."""
    work.force_x[:] = 0.0
    work.force_y[:] = 0.0
    work.moment[:] = 0.0
    work.wheel_torque[:] = 0.0
    work.count[0] = 0
    if model.tooth.present:
        tooth_loads(model.chain, model.tooth, model.wheels, state, work)
    wheel_loads(model.chain, model.wheels, state, work)
    bushing_torques(model.chain, state, work)


@kernel
def account(model: Model, state: State, work: Work):
    """Work of every force over the last step, at the mean of the velocities before and after it.

    With that mean the work of all forces is the change of kinetic energy of the discrete motion, so
    what remains of the balance shows errors of the equations and of the path, not of the quadrature.
    """
    chain, h, done = model.chain, model.step, state.work_done
    for k in range(work.count[0]):
        row = work.contact[k]
        body = work.contact_body[k, 0]
        wheel = work.contact_body[k, 1]
        w = state.rate[body]
        vx = 0.5 * (row[6] + work.com_vx[body] - w * row[5])
        vy = 0.5 * (row[7] + work.com_vy[body] + w * row[4])
        ww = 0.5 * (row[10] + state.wheel_rate[wheel])
        sx = -ww * row[9]
        sy = ww * row[8]
        if wheel == SPROCKET:
            done[SPROCKET_WORK] += h * ((row[0] + row[2]) * sx + (row[1] + row[3]) * sy)
        normal = -h * (row[0] * (vx - sx) + row[1] * (vy - sy))
        friction = -h * (row[2] * (vx - sx) + row[3] * (vy - sy))
        if work.contact_body[k, 2]:
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
def energies(model: Model, state: State, work: Work, out):
    """Fill ``out`` with the account of work and the energies of the present state (J)."""
    chain = model.chain
    out[:7] = state.work_done
    kinetic = gravity = elastic = 0.0
    n = state.angle.shape[0]
    for i in range(n):
        v2 = work.com_vx[i] ** 2 + work.com_vy[i] ** 2
        kinetic += 0.5 * (chain.mass[i] * v2 + chain.inertia[i] * state.rate[i] ** 2)
        y = work.pin_y[i] + chain.com_x[i] * work.sin[i] + chain.com_y[i] * work.cos[i]
        gravity += chain.mass[i] * chain.gravity * y
        phi = state.angle[i + 1] - state.angle[i] if i < n - 1 else state.angle[0] - state.angle[i] - 2.0 * np.pi
        elastic += 0.5 * chain.stiffness * (phi - chain.free_angle) ** 2
    for wheel in range(1, model.wheels.x.shape[0]):
        kinetic += 0.5 * model.wheels.inertia[wheel] * state.wheel_rate[wheel] ** 2
    out[KINETIC] = kinetic
    out[GRAVITY] = gravity
    out[BUSHING_ELASTIC] = elastic


@kernel
def sprocket_rate(drive: Drive, time):
    """Prescribed angular velocity at ``time`` (s): a smooth ramp with zero slope at both ends."""
    if time >= drive.ramp:
        return drive.rate
    x = time / drive.ramp
    return drive.rate * x * x * (3.0 - 2.0 * x)


@kernel
def advance(model: Model, state: State, work: Work):
    """Velocities, then positions, then the projection of the closure.

    Returns
    -------
    gap : float
        Distance between the pins of the cut joint after the step, m.
    body : int
        -1, or the body whose angular velocity left the physical range.
    """
    chain, wheels, sweep, h = model.chain, model.wheels, work.sweep, model.step
    lx, ly, lm = sweep.load[0], sweep.load[1], sweep.load[2]
    n = state.angle.shape[0]
    bad = -1
    gx = gy = 0.0
    for i in range(n):
        r = sweep.response[i]
        rate = state.rate[i] + h * (r[0] * lx + r[1] * ly + r[2] * lm + r[3])
        if not abs(rate) < RATE_LIMIT and bad < 0:
            bad = i
        state.rate[i] = rate
        angle = state.angle[i] + h * rate
        state.angle[i] = angle
        c = cosine(angle)
        s = sine(angle)
        work.cos[i] = c
        work.sin[i] = s
        gx += chain.length[i] * c
        gy += chain.length[i] * s

    # extra cut load that closes the gap: end - start moves by h^2 (closure matrix) d_lambda
    inv = sweep.inverse
    dx = -(inv[0, 0] * gx + inv[0, 1] * gy) / h
    dy = -(inv[1, 0] * gx + inv[1, 1] * gy) / h
    dm = -(inv[2, 0] * gx + inv[2, 1] * gy) / h
    gx = gy = 0.0
    for i in range(n):
        r = sweep.response[i]
        d = r[0] * dx + r[1] * dy + r[2] * dm
        state.rate[i] += d
        d *= h
        state.angle[i] += d
        # d is of third order in the step: two terms of the rotation leave nothing in double precision
        c, s = work.cos[i], work.sin[i]
        half = 0.5 * d * d
        work.cos[i] = c - d * s - half * c
        work.sin[i] = s + d * c - half * s
        gx += chain.length[i] * work.cos[i]
        gy += chain.length[i] * work.sin[i]
    b = sweep.base
    for k in range(2):
        state.pin[2 + k] += h * (b[k, 0] * lx + b[k, 1] * ly + b[k, 2] * lm + b[k, 3])
        state.pin[2 + k] += b[k, 0] * dx + b[k, 1] * dy + b[k, 2] * dm
        state.pin[k] += h * state.pin[2 + k]

    state.steps[0] += 1
    time = state.steps[0] * h
    old = state.wheel_rate[SPROCKET]
    state.wheel_rate[SPROCKET] = sprocket_rate(model.drive, time)
    # the mean of both rates: exact for a constant speed and of second order on the ramp
    state.wheel_angle[SPROCKET] += 0.5 * h * (old + state.wheel_rate[SPROCKET])
    for wheel in range(1, wheels.x.shape[0]):
        # drag is taken at the end of the step, which cannot overshoot
        old = state.wheel_rate[wheel]
        rate = (wheels.inertia[wheel] * old + h * work.wheel_torque[wheel]) / (
            wheels.inertia[wheel] + h * wheels.drag[wheel]
        )
        state.wheel_rate[wheel] = rate
        state.wheel_angle[wheel] += h * rate
        state.work_done[BEARING] += h * wheels.drag[wheel] * rate * 0.5 * (old + rate)
    return sqrt(gx * gx + gy * gy), bad


@kernel
def run(model: Model, state: State, work: Work, record: Record, first, last, stride):
    """Integrate samples ``first`` to ``last - 1`` of ``stride`` steps each and fill their rows.

    Returns
    -------
    body : int
        -1, or the body at which the run left the physical range; ``state.steps`` says when.
    """
    sensor, sweep, chain = model.sensor, work.sweep, model.chain
    b = sensor.body
    n = state.angle.shape[0]
    damping = model.step * chain.damping
    orient(state.angle, work.cos, work.sin)
    place(chain, state, work)
    loads(model, state, work)
    for sample in range(first, last):
        sum_x = sum_y = sum_angle = gap = 0.0
        raw_x = raw_y = 0.0
        for _ in range(stride):
            accelerations(
                chain, work.cos, work.sin, state.rate, work.force_x, work.force_y, work.moment, work.torque,
                damping, b, sweep,
            )  # fmt: skip
            # sensor: pin, angular and centripetal part, in the link frame (a_s of Eq. 40)
            p, load, r = sweep.probe, sweep.load, sweep.response[b]
            ax = p[0, 0] * load[0] + p[0, 1] * load[1] + p[0, 2] * load[2] + p[0, 3]
            ay = p[1, 0] * load[0] + p[1, 1] * load[1] + p[1, 2] * load[2] + p[1, 3]
            alpha = r[0] * load[0] + r[1] * load[1] + r[2] * load[2] + r[3]
            w2 = state.rate[b] ** 2
            c, s = work.cos[b], work.sin[b]
            raw_x = c * ax + s * ay - alpha * sensor.y - w2 * sensor.x
            raw_y = c * ay - s * ax + alpha * sensor.x - w2 * sensor.y
            raw_angle = state.angle[b]
            sum_x += raw_x
            sum_y += raw_y
            sum_angle += raw_angle
            distance, bad = advance(model, state, work)
            if bad >= 0:
                return bad
            gap = max(gap, distance)
            place(chain, state, work)
            account(model, state, work)
            loads(model, state, work)
        record.raw[sample, 0] = raw_x
        record.raw[sample, 1] = raw_y
        record.raw[sample, 2] = raw_angle
        record.mean[sample, 0] = sum_x / stride
        record.mean[sample, 1] = sum_y / stride
        record.mean[sample, 2] = sum_angle / stride
        record.gap[sample] = gap
        record.place[sample, 0] = 0.5 * (work.pin_x[b] + work.pin_x[b + 1])
        record.place[sample, 1] = 0.5 * (work.pin_y[b] + work.pin_y[b + 1])
        record.wheel_rate[sample] = state.wheel_rate
        energies(model, state, work, record.energy[sample])
        for i in range(record.pitches.shape[0]):
            pitch = record.pitches[i]
            for side in range(2):
                record.force[sample, i, side] = work.tooth_force[2 * pitch + side]
                record.area[sample, i, side] = work.tooth_area[2 * pitch + side]
                record.groove[sample, i, side] = work.tooth_groove[2 * pitch + side]
            record.force[sample, i, 2] = work.wheel_force[pitch, SPROCKET]
        if record.frame_stride > 0 and sample % record.frame_stride == 0:
            frame = record.frame[sample // record.frame_stride]
            frame[0] = state.pin[0]
            frame[1] = state.pin[1]
            for i in range(n):
                frame[2 + i] = state.angle[i]
            frame[2 + n] = state.wheel_angle[SPROCKET]
    return -1

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

from trackdyn.chain.kinematics import bushing_torques, orient, place
from trackdyn.chain.riccati import accelerations
from trackdyn.contact.loads import contact_loads
from trackdyn.integrate.energy import account, energies
from trackdyn.integrate.spells import log_spells
from trackdyn.jit import kernel
from trackdyn.model import BEARING, SPROCKET, Drive, Model, Record, State, Work

# |angular velocity| of a body beyond which a run has left the physical range, rad/s
RATE_LIMIT = 1000.0
# rotation in one step up to which cosine and sine are updated by their series, rad
TURN_LIMIT = 0.02


@kernel
def evaluate_loads(model: Model, state: State, work: Work):
    """Contacts and bushings at the present state."""
    contact_loads(model, state, work)
    bushing_torques(model.chain, state, work)


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
    response = sweep.response
    lx, ly, lm = sweep.load[0], sweep.load[1], sweep.load[2]
    n = state.angle.shape[0]
    bad = -1
    b = sweep.base
    # change of velocity along the chain, in the configuration before the step (for the account)
    dvx = h * (b[0, 0] * lx + b[0, 1] * ly + b[0, 2] * lm + b[0, 3])
    dvy = h * (b[1, 0] * lx + b[1, 1] * ly + b[1, 2] * lm + b[1, 3])
    state.pin[2] += dvx
    state.pin[3] += dvy
    gx = gy = 0.0
    for i in range(n):
        c, s, old, length = work.cos[i], work.sin[i], state.rate[i], chain.length[i]
        dw = h * (response[i, 0] * lx + response[i, 1] * ly + response[i, 2] * lm + response[i, 3])
        work.com_dvx[i] = dvx - dw * (chain.com_x[i] * s + chain.com_y[i] * c)
        work.com_dvy[i] = dvy + dw * (chain.com_x[i] * c - chain.com_y[i] * s)
        work.old_rate[i] = old
        dvx -= dw * s * length
        dvy += dw * c * length
        rate = old + dw
        if not abs(rate) < RATE_LIMIT and bad < 0:
            bad = i
        state.rate[i] = rate
        turn = h * rate
        state.angle[i] += turn
        # Rotate by series: the next terms, turn^7 / 5040 and turn^8 / 40320, are below rounding up to
        # TURN_LIMIT. Every sample starts from exact values again (`orient`).
        if abs(turn) < TURN_LIMIT:
            t2 = turn * turn
            ds = turn * (1.0 - t2 * (1.0 / 6.0 - t2 / 120.0))
            dc = t2 * (0.5 - t2 * (1.0 / 24.0 - t2 / 720.0))
            nc = c - (c * dc + s * ds)
            ns = s - (s * dc - c * ds)
        else:
            nc = cosine(state.angle[i])
            ns = sine(state.angle[i])
        work.cos[i] = nc
        work.sin[i] = ns
        gx += length * nc
        gy += length * ns

    # extra cut load that closes the gap: end - start moves by h^2 (closure matrix) d_lambda
    inv = sweep.inverse
    dx = -(inv[0, 0] * gx + inv[0, 1] * gy) / h
    dy = -(inv[1, 0] * gx + inv[1, 1] * gy) / h
    dm = -(inv[2, 0] * gx + inv[2, 1] * gy) / h
    gx = gy = 0.0
    for i in range(n):
        d = response[i, 0] * dx + response[i, 1] * dy + response[i, 2] * dm
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
    for k in range(2):
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
    evaluate_loads(model, state, work)
    for sample in range(first, last):
        sum_x = sum_y = sum_angle = gap = 0.0
        raw_x = raw_y = 0.0
        orient(state.angle, work.cos, work.sin)
        for _ in range(stride):
            accelerations(
                chain, work.cos, work.sin, state.rate, work.force_x, work.force_y, work.moment, work.torque,
                damping, b, sweep,
            )  # fmt: skip
            # sensor: pin, angular and centripetal part, in the link frame (a_s of Eq. 40)
            p, load, r = sweep.probe, sweep.load, sweep.response
            ax = p[0, 0] * load[0] + p[0, 1] * load[1] + p[0, 2] * load[2] + p[0, 3]
            ay = p[1, 0] * load[0] + p[1, 1] * load[1] + p[1, 2] * load[2] + p[1, 3]
            alpha = r[b, 0] * load[0] + r[b, 1] * load[1] + r[b, 2] * load[2] + r[b, 3]
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
            evaluate_loads(model, state, work)
            if record.spells.enabled:
                log_spells(record.spells, state, work, state.steps[0] * model.step, model.step)
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

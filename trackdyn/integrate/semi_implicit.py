"""Semi-implicit Euler (order 1) with the closure solved exactly and projected once a step.

Velocities are advanced with the accelerations at the start of the step, positions with the new
velocities. The remaining gap of the cut joint, of second order in the step, is removed by an extra
load through the cut: the response of the chain to that load is known from the sweep, so the
correction is the mass-weighted one and costs two multiply-adds a body. It changes positions and
velocities alike (the SHAKE form). Energy is kept to the order of the step and not better: a free loop
without damping gains about 7e-4 of it in 20 s, steadily.

Velocities so belong to the middle of a step, and there damping is taken: that of the bushings by the sweep
(`chain.kinematics.bushing_lead`), that of contacts with velocities led ahead by half of what the last step changed
them (`contact.loads.approach`). Without that, forces that last a few steps come out a tenth too high.
"""

from math import cos as cosine
from math import sin as sine

from trackdyn.chain.bearings import bearing_drag
from trackdyn.jit import kernel
from trackdyn.model.constants import SPROCKET, Drive, Model
from trackdyn.model.record import BEARING
from trackdyn.model.state import State
from trackdyn.model.work import Work

# |angular velocity| of a body beyond which a run has left the physical range, rad/s
RATE_LIMIT = 1000.0
# rotation in one step up to which cosine and sine are updated by their series, rad
TURN_LIMIT = 0.02


@kernel
def sprocket_rate(drive: Drive, time):
    """Prescribed angular velocity at ``time`` (s): a smooth ramp with zero slope at both ends."""
    x = (time - drive.begin) / drive.ramp
    if x >= 1.0:
        return drive.rate
    return drive.start + (drive.rate - drive.start) * x * x * (3.0 - 2.0 * x)


@kernel
def sprocket_acceleration(drive: Drive, time):
    """Derivative of `sprocket_rate`, rad/s2."""
    x = (time - drive.begin) / drive.ramp
    return 6.0 * (drive.rate - drive.start) / drive.ramp * x * (1.0 - x) if x < 1.0 else 0.0


@kernel
def advance(model: Model, state: State, work: Work, implicit, radial=None):
    """Velocities, then positions, then the projection of a rigid closure.

    ``implicit`` is None, or the work of a linearly implicit sweep that has found the accelerations of
    the wheels too; ``radial`` that of joints whose pins part, the cut among them: nothing is projected then.

    Returns
    -------
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
        work.turned[i] = dw
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
        if radial is not None and i < n - 1:
            part = state.part
            for k in range(2):
                part[i, 2 + k] += h * radial.apart[i, k]
                part[i, k] += h * part[i, 2 + k]
            dvx += h * radial.apart[i, 0]
            dvy += h * radial.apart[i, 1]
            gx += part[i, 0]
            gy += part[i, 1]

    work.cut[4] = gx
    work.cut[5] = gy
    if model.closure.compliant:
        gx = gy = 0.0  # a gap is part of the model, not an error
    if radial is not None:
        gx = gy = 0.0
    # extra cut load that closes the gap: end - start moves by h^2 (closure matrix) d_lambda
    inv = sweep.inverse
    dx = -(inv[0, 0] * gx + inv[0, 1] * gy) / h
    dy = -(inv[1, 0] * gx + inv[1, 1] * gy) / h
    dm = -(inv[2, 0] * gx + inv[2, 1] * gy) / h
    for i in range(n):
        d = response[i, 0] * dx + response[i, 1] * dy + response[i, 2] * dm
        state.rate[i] += d
        work.turned[i] += d
        d *= h
        state.angle[i] += d
        # d is of third order in the step: two terms of the rotation leave nothing in double precision
        c, s = work.cos[i], work.sin[i]
        half = 0.5 * d * d
        work.cos[i] = c - d * s - half * c
        work.sin[i] = s + d * c - half * s
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
        drag = bearing_drag(wheels, wheel, old)
        if implicit is None:
            rate = (wheels.inertia[wheel] * old + h * work.wheel_torque[wheel]) / (wheels.inertia[wheel] + h * drag)
        else:
            rate = old + h * implicit.load[3 + wheel]
        state.wheel_rate[wheel] = rate
        state.wheel_angle[wheel] += h * rate
        state.work_done[BEARING] += h * drag * rate * 0.5 * (old + rate)
    return bad

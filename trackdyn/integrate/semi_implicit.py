"""Semi-implicit Euler (order 1) with the closure solved exactly and projected once a step.

Velocities are advanced with the accelerations at the start of the step, positions with the new velocities. The
remaining gap of the cut joint, of second order in the step, is removed from positions and velocities alike (the SHAKE
form) by a load through the cut. A free loop without damping gains about 7e-4 of its energy in 20 s, steadily.
Velocities belong to the middle of a step, where damping is taken: that of the bushings by the sweep
(`chain.kinematics.damping_weight`), that of contacts with extrapolated velocities (`contact.forces.PREDICTION`), on the
teeth also by the effect of the force itself (`contact.laws.implicit_speed`).
"""

from trackdyn.chain.kinematics import bearing_drag, orient, rotated
from trackdyn.chain.riccati import closing_load, response_to
from trackdyn.jit import fused, kernel
from trackdyn.model.arrays import BEARING, State, Work
from trackdyn.model.constants import SPROCKET, Drive, Model

RATE_LIMIT = 1000.0  # |angular velocity| of a body beyond which a run has left the physical range, rad/s
ROTATION_LIMIT = 0.02  # rotation in one step up to which cosine and sine are updated by their series, rad


@kernel
def sprocket_rate(drive: Drive, time):
    """Return the prescribed angular velocity at ``time`` (s): a smooth ramp with zero slope at both ends."""
    x = (time - drive.begin) / drive.ramp
    if x >= 1.0:
        return drive.rate
    return drive.start + (drive.rate - drive.start) * x * x * (3.0 - 2.0 * x)


@kernel
def sprocket_acceleration(drive: Drive, time):
    """Return the derivative of `sprocket_rate`, rad/s2."""
    x = (time - drive.begin) / drive.ramp
    return 6.0 * (drive.rate - drive.start) / drive.ramp * x * (1.0 - x) if x < 1.0 else 0.0


@fused
def _first_beyond(rate):
    """Return the first body whose angular velocity is beyond the physical range, or not a number; -1 if none."""
    for i in range(rate.shape[0]):
        if not abs(rate[i]) < RATE_LIMIT:
            return i
    return -1


@fused
def _rotate(angle, rate, step, cos, sin):
    """Turn every body by its rate over a step (s).

    Cosine and sine follow by series, whose next terms, a^7 / 5040 and a^8 / 40320, are below rounding up to
    ``ROTATION_LIMIT``. Every sample begins with exact values (`kinematics.orient`).
    """
    far = 0
    for i in range(angle.shape[0]):
        rotation = step * rate[i]
        angle[i] += rotation
        far += not abs(rotation) < ROTATION_LIMIT
    for i in range(angle.shape[0]):
        rotation = step * rate[i]
        square = rotation * rotation
        ds = rotation * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0)))
        dc = square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0)))
        c, s = cos[i], sin[i]
        cos[i] = c - (c * dc + s * ds)
        sin[i] = s - (s * dc - c * ds)
    if far > 0:
        orient(angle, cos, sin)


@fused
def _project(model: Model, state: State, work: Work):
    """Remove the gap of a rigid closure from velocities and positions, and move the pin of body 1 over the step."""
    chain, sweep, h, n = model.chain, work.sweep, model.step, state.angle.shape[0]
    response, delta_omega, rate, cos, sin = sweep.response, work.delta_omega, state.rate, work.cos, work.sin
    gx = gy = 0.0
    for i in range(n):
        gx += chain.length[i] * cos[i]
        gy += chain.length[i] * sin[i]
    work.cut[4], work.cut[5] = gx, gy
    if model.closure.compliant:
        gx = gy = 0.0  # a gap belongs to the model, it is no error
    # extra cut load that closes the gap: end - start moves by h^2 (closure matrix) d_lambda
    projection_delta = work.projection_delta
    lx, ly, lm = closing_load(sweep.inverse, gx, gy)
    load = (lx / h, ly / h, lm / h)
    for i in range(n):
        projection_delta[i] = response_to(response, i, load)
    for i in range(n):
        rate[i] += projection_delta[i]
        delta_omega[i] += projection_delta[i]
    for i in range(n):
        d = h * projection_delta[i]
        state.angle[i] += d
        # d is of third order in the step: two terms of the rotation leave nothing in double precision
        c, s = cos[i], sin[i]
        half = 0.5 * d * d
        cos[i] = c - d * s - half * c
        sin[i] = s + d * c - half * s
    for k in range(2):
        state.pin[2 + k] += response_to(sweep.base, k, load)
        state.pin[k] += h * state.pin[2 + k]


@fused
def _advance_wheels(model: Model, state: State, work: Work, implicit):
    """Advance rates and angles of the wheels to the end of the step, and add the work of their bearings."""
    wheels, h = model.wheels, model.step
    old = state.wheel_rate[SPROCKET]
    state.wheel_rate[SPROCKET] = sprocket_rate(model.drive, state.steps[0] * h)
    # the mean of both rates: exact for a constant speed and of second order on the ramp
    state.wheel_angle[SPROCKET] += 0.5 * h * (old + state.wheel_rate[SPROCKET])
    for wheel in range(1, wheels.x.shape[0]):
        # drag is taken at the end of the step, which cannot overshoot
        old = state.wheel_rate[wheel]
        drag = bearing_drag(wheels, wheel, old, work.carried)
        if implicit is None:
            rate = (wheels.inertia[wheel] * old + h * work.wheel_torque[wheel]) / (wheels.inertia[wheel] + h * drag)
        else:
            rate = old + h * implicit.load[3 + wheel]
        state.wheel_rate[wheel] = rate
        state.wheel_angle[wheel] += h * rate
        state.work_done[BEARING] += h * drag * rate * 0.5 * (old + rate)


@fused
def advance(model: Model, state: State, work: Work, implicit):
    """Advance velocities, then positions, then project a rigid closure; return -1, or the body that left the range."""
    chain, h, n = model.chain, model.step, state.angle.shape[0]
    # change of velocity along the chain, in the configuration before the step (for the energy balance)
    dvx, dvy = h * work.pin_ax[0], h * work.pin_ay[0]
    state.pin[2] += dvx
    state.pin[3] += dvy
    # loops without a branch or a sum from body to body are vectorized
    delta_omega, rate, cos, sin = work.delta_omega, state.rate, work.cos, work.sin
    for i in range(n):
        delta_omega[i] = h * work.alpha[i]
    for i in range(n):
        dw, c, s = delta_omega[i], cos[i], sin[i]
        ax, ay = rotated(chain.com_x[i], chain.com_y[i], c, s)
        work.com_dvx[i], work.com_dvy[i] = dvx - dw * ay, dvy + dw * ax
        dvx -= dw * (chain.length[i] * s)
        dvy += dw * (chain.length[i] * c)
    far = 0
    for i in range(n):
        rate[i] += delta_omega[i]
        far += not abs(rate[i]) < RATE_LIMIT
    bad = _first_beyond(rate) if far > 0 else -1
    _rotate(state.angle, rate, h, cos, sin)
    _project(model, state, work)
    state.steps[0] += 1
    _advance_wheels(model, state, work, implicit)
    return bad

"""Loads and accelerations of a state, for all integrators."""

from trackdyn.chain import implicit as linear
from trackdyn.chain import riccati
from trackdyn.chain.kinematics import add_maxwell_moments, bushing_torques, damping_weight
from trackdyn.contact.detect import contact_loads
from trackdyn.integrate.plane import update_frame
from trackdyn.jit import kernel
from trackdyn.model.arrays import P, Q, State, Work
from trackdyn.model.constants import Model


@kernel
def evaluate_loads(model: Model, state: State, work: Work, space, implicit):
    """Compute loads of contacts and bushings at the present state, or extrapolated to the end of an implicit step."""
    if space is not None:
        update_frame(model, state, space)
    contact_loads(model, state, work, space, implicit)
    ahead = 0.0 if implicit is None else model.step
    bushing_torques(model.chain, state, work, ahead)
    add_maxwell_moments(state, work, ahead, model.maxwell)


@kernel
def solve_chain(model: Model, state: State, work: Work, step, implicit):
    """Solve for the accelerations of the chain under the loads in ``work``, the closure rigid or compliant.

    ``step`` (s) is the one over which bushing damping and a compliant cut are implicit, 0: explicit; ``implicit`` the
    work of the linearly implicit system or None.
    """
    chain, cut, closure, sweep = model.chain, work.cut, model.closure, work.sweep
    damping = damping_weight(chain, step) * step * chain.damping
    stiff = force_x = force_y = 0.0
    if closure.compliant:
        resistance = step * closure.stiffness + closure.damping
        stiff = step * resistance
        force_x = closure.stiffness * cut[0] + resistance * cut[2]
        force_y = closure.stiffness * cut[1] + resistance * cut[3]
        # the two ends of the cut do not coincide: this couple keeps the angular momentum (A.6)
        work.moment[-1] += cut[0] * force_y - cut[1] * force_x
    if implicit is not None:
        compliance = 1.0 / stiff if closure.compliant else 0.0
        linear.accelerations(model, state, work, implicit, (compliance, force_x, force_y))
    else:
        riccati.sweep(chain, state, work, damping, None)
        if not closure.compliant:
            riccati.close(0.0, 0.0, 0.0, work.torque[-1], damping, sweep)
        elif stiff > 0.0:
            riccati.close(1.0 / stiff, force_x / stiff, force_y / stiff, work.torque[-1], damping, sweep)
        else:
            sweep.load[0], sweep.load[1], sweep.load[2], sweep.load[3] = force_x, force_y, work.torque[-1], 1.0
    last = 0 if implicit is None else state.rate.shape[0] - 1  # body whose pin a sensor or `finish_forces` needs
    for body in model.sensors.body:
        last = max(last, body)
    riccati.accelerate(chain, state, work, last)


@kernel
def sense(model: Model, state: State, work: Work, space, out):
    """Write the acceleration of every sensor in its body's frame (a_s of Eq. 40) and the body's angle to ``out``."""
    sensors = model.sensors
    for k in range(sensors.body.shape[0]):
        b, x, y = sensors.body[k], sensors.x[k], sensors.y[k]
        ax, ay, alpha = work.pin_ax[b], work.pin_ay[b], work.alpha[b]
        w2 = state.rate[b] * state.rate[b]
        c, s = work.cos[b], work.sin[b]
        out[k, 0] = c * ax + s * ay - alpha * y - w2 * x
        out[k, 1] = c * ay - s * ax + alpha * x - w2 * y
        out[k, 2] = state.angle[b]
        if space is not None:
            # the turning plane adds (q u, -p u)
            rate_p, rate_q = state.plane.motion[P], state.plane.motion[Q]
            px = work.pin_x[b] - state.pin[0] + (c * x - s * y)
            py = work.pin_y[b] - state.pin[1] + (s * x + c * y)
            u = rate_p * py - rate_q * px
            out[k, 0] += (c * rate_q - s * rate_p) * u
            out[k, 1] -= (s * rate_q + c * rate_p) * u


@kernel
def accumulate(model: Model, work: Work, sensed, weight):
    """Store ``sensed`` as the last values of the sensors, and add it times ``weight`` to the sums of the sample."""
    for sensor in range(model.sensors.body.shape[0]):
        for k in range(3):
            work.sensed[sensor, k] = sensed[sensor, k]
            work.sensed[sensor, 3 + k] += weight * sensed[sensor, k]

"""Loads and accelerations of a state: what every integrator asks for."""

from trackdyn.chain import implicit as linear
from trackdyn.chain import riccati
from trackdyn.chain.kinematics import add_moments, bushing_torques, damping_weight
from trackdyn.contact.detect import contact_loads
from trackdyn.integrate.plane import update_frame
from trackdyn.jit import kernel
from trackdyn.model.arrays import P, Q, State, Work
from trackdyn.model.constants import Model


@kernel
def evaluate_loads(model: Model, state: State, work: Work, space, implicit):
    """Contacts and bushings at the present state, led to the end of the step by a linearly implicit integrator."""
    if space is not None:
        update_frame(model, state, space)
    contact_loads(model, state, work, space, implicit)
    ahead = 0.0 if implicit is None else model.step
    bushing_torques(model.chain, state, work, ahead)
    add_moments(state, work, ahead, model.branches)


@kernel
def solve_chain(model: Model, state: State, work: Work, step, implicit):
    """Accelerations of the chain under the loads in ``work``, the closure rigid or compliant.

    ``step`` (s) is the one over which bushing damping and a compliant cut are implicit, 0: explicit; ``implicit`` the
    work of the linearly implicit system or None.
    """
    chain, cut, closure, sweep = model.chain, work.cut, model.closure, work.sweep
    probe = model.sensor.body
    damping = damping_weight(chain, step) * step * chain.damping
    stiff = force_x = force_y = 0.0
    if closure.compliant:
        stiff = step * (step * closure.stiffness + closure.damping)
        rate_part = step * closure.stiffness + closure.damping
        force_x = closure.stiffness * cut[0] + rate_part * cut[2]
        force_y = closure.stiffness * cut[1] + rate_part * cut[3]
        # the two ends of the cut do not coincide: this couple keeps the angular momentum (A.6)
        work.moment[-1] += cut[0] * force_y - cut[1] * force_x
    if implicit is not None:
        compliance = 1.0 / stiff if closure.compliant else 0.0
        linear.accelerations(model, state, work, implicit, (compliance, force_x, force_y))
        return
    riccati.sweep(chain, state, work, damping, probe, None)
    if not closure.compliant:
        riccati.close(0.0, 0.0, 0.0, work.torque[-1], damping, sweep)
    elif stiff > 0.0:
        riccati.close(1.0 / stiff, force_x / stiff, force_y / stiff, work.torque[-1], damping, sweep)
    else:
        sweep.load[0], sweep.load[1], sweep.load[2], sweep.load[3] = force_x, force_y, work.torque[-1], 1.0


@kernel
def sense(model: Model, state: State, work: Work, space):
    """Acceleration of the sensor in the link frame (a_s of Eq. 40) and the link's angle, into ``work.sensed``."""
    sensor, sweep = model.sensor, work.sweep
    p, load, r, b = sweep.probe, sweep.load, sweep.response, sensor.body
    ax = p[0, 0] * load[0] + p[0, 1] * load[1] + p[0, 2] * load[2] + p[0, 3]
    ay = p[1, 0] * load[0] + p[1, 1] * load[1] + p[1, 2] * load[2] + p[1, 3]
    alpha = r[b, 0] * load[0] + r[b, 1] * load[1] + r[b, 2] * load[2] + r[b, 3]
    _sense_at(model, state, work, b, ax, ay, alpha, work.sensed, space)


@kernel
def _sense_at(model: Model, state: State, work: Work, body, ax, ay, alpha, out, space):
    """What the sensor's position on a body feels, whose input pin is accelerated by ``ax, ay``, into ``out``."""
    x, y = model.sensor.x, model.sensor.y
    w2 = state.rate[body] * state.rate[body]
    c, s = work.cos[body], work.sin[body]
    out[0] = c * ax + s * ay - alpha * y - w2 * x
    out[1] = c * ay - s * ax + alpha * x - w2 * y
    out[2] = state.angle[body]
    if space is not None:
        # the turning plane adds (q u, -p u)
        p, q = state.plane.motion[P], state.plane.motion[Q]
        px = work.pin_x[body] - state.pin[0] + (c * x - s * y)
        py = work.pin_y[body] - state.pin[1] + (s * x + c * y)
        u = p * py - q * px
        out[0] += (c * q - s * p) * u
        out[1] -= (s * q + c * p) * u


@kernel
def sense_links(model: Model, state: State, work: Work, space):
    """What `sense` gives, for the sensor's position on every link, into ``work.links``: a walk along the pins."""
    chain, shoes, sweep, links = model.chain, model.shoes, work.sweep, work.links
    load, r, base = sweep.load, sweep.response, sweep.base
    ax = base[0, 0] * load[0] + base[0, 1] * load[1] + base[0, 2] * load[2] + base[0, 3]
    ay = base[1, 0] * load[0] + base[1, 1] * load[1] + base[1, 2] * load[2] + base[1, 3]
    link = 0
    for i in range(state.rate.shape[0]):
        alpha = r[i, 0] * load[0] + r[i, 1] * load[1] + r[i, 2] * load[2] + r[i, 3]
        w2 = state.rate[i] * state.rate[i]
        c, s = work.cos[i], work.sin[i]
        if link < links.shape[0] and shoes.link_body[link] == i:
            _sense_at(model, state, work, i, ax, ay, alpha, links[link], space)
            link += 1
        dx = chain.length[i] * c
        dy = chain.length[i] * s
        ax -= alpha * dy + w2 * dx
        ay += alpha * dx - w2 * dy


@kernel
def accumulate(work: Work, weight, links):
    """Add the sensed values to the sums of the sample, those of the first ``links`` links too."""
    for k in range(3):
        work.sensed[3 + k] += weight * work.sensed[k]
        for link in range(links):
            work.links[link, 3 + k] += weight * work.links[link, k]

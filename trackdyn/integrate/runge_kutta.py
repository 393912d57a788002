"""Explicit Runge-Kutta methods of the loop, with a fixed step.

The closure is solved in every stage; positions and velocities are projected after every step. Initial impact velocities
of contacts are those at the start of the step in all stages. Forces jump where a contact begins or changes its area;
there the order is lost.
"""

from trackdyn.chain.kinematics import bearing_drag, forward_kinematics, maxwell_rates, orient
from trackdyn.chain.riccati import closing_load, response_to
from trackdyn.integrate.contact_log import log_contacts
from trackdyn.integrate.dynamics import accumulate, evaluate_loads, sense, solve_chain
from trackdyn.integrate.energy import powers
from trackdyn.integrate.semi_implicit import RATE_LIMIT, sprocket_acceleration
from trackdyn.jit import inlined, kernel
from trackdyn.model.arrays import BUSHING_LOSS, Record, Stages, State, Work
from trackdyn.model.constants import SPROCKET, Model


@inlined
def _vectors(state):
    """Return the integrated arrays of the state, in the order of the packed one."""
    return (
        state.pin, state.angle, state.rate, state.wheel_angle, state.wheel_rate, state.work_done,
        state.maxwell.reshape(state.maxwell.size),
    )  # fmt: skip


@kernel
def _pack(state: State, out):
    """Pack the state into one vector."""
    first = 0
    for vector in _vectors(state):
        for j in range(vector.shape[0]):
            out[first + j] = vector[j]
        first += vector.shape[0]


@kernel
def _copy_memory(tooth, wheel, to_tooth, to_wheel):
    """Copy the initial impact velocities of the contacts, ``tooth`` and ``wheel``."""
    for j in range(tooth.shape[0]):
        to_tooth[j] = tooth[j]
    for j in range(wheel.shape[0]):
        for k in range(wheel.shape[1]):
            to_wheel[j, k] = wheel[j, k]


@kernel
def _unpack(state: State, start, slope, weight, last, step):
    """Set the state to ``start + step * sum(weight * slope)`` over the first ``last`` stages."""
    first = 0
    for vector in _vectors(state):
        for j in range(vector.shape[0]):
            value = 0.0
            for k in range(last):
                value += weight[k] * slope[k, first + j]
            vector[j] = start[first + j] + step * value
        first += vector.shape[0]


@kernel
def _derivative(model: Model, state: State, work: Work, time, out):
    """Write the derivative of the packed state at ``time`` (s) to ``out``, with the accelerations in ``work``."""
    n, w, wheels = state.angle.shape[0], state.wheel_rate.shape[0], model.wheels
    out[0], out[1], out[2], out[3] = state.pin[2], state.pin[3], work.pin_ax[0], work.pin_ay[0]
    for i in range(n):
        out[4 + i] = state.rate[i]
        out[4 + n + i] = work.alpha[i]
    for wheel in range(w):
        out[4 + 2 * n + wheel] = state.wheel_rate[wheel]
        if wheel == SPROCKET:
            out[4 + 2 * n + w] = sprocket_acceleration(model.drive, time)
        else:
            rate = state.wheel_rate[wheel]
            torque = work.wheel_torque[wheel] - bearing_drag(wheels, wheel, rate, work.carried) * rate
            out[4 + 2 * n + w + wheel] = torque / wheels.inertia[wheel]
    powers(model, state, work, out, 4 + 2 * n + 2 * w)
    maxwell_rates(state, work, out, 4 + 2 * n + 2 * w, BUSHING_LOSS, model.maxwell)


@kernel
def _project(model: Model, state: State, work: Work):
    """Remove the gap of the cut joint and its rate, weighted with the mass."""
    base, response, cut = work.sweep.base, work.sweep.response, work.cut
    for level in range(2):
        forward_kinematics(model.chain, state, work)
        load = closing_load(work.sweep.inverse, cut[2 * level], cut[2 * level + 1])
        for k in range(2):
            state.pin[2 * level + k] += response_to(base, k, load)
        for i in range(state.angle.shape[0]):
            d = response_to(response, i, load)
            if level == 0:
                state.angle[i] += d
            else:
                state.rate[i] += d
        orient(state.angle, work.cos, work.sin)
    forward_kinematics(model.chain, state, work)


@kernel
def rk_step(model: Model, state: State, work: Work, record: Record, stages: Stages):
    """Take one step; return -1, or the body that left the range."""
    step, contact_log = model.step, record.contact_log
    begin = state.steps[0] * step
    _pack(state, stages.start)
    _copy_memory(state.tooth_impact, state.wheel_impact, stages.tooth_impact, stages.wheel_impact)
    for s in range(stages.b.shape[0]):
        offset = 0.0
        if s > 0:
            for k in range(s):
                offset += stages.a[s, k]
            _unpack(state, stages.start, stages.slope, stages.a[s], s, step)
            orient(state.angle, work.cos, work.sin)
            forward_kinematics(model.chain, state, work)
            _copy_memory(stages.tooth_impact, stages.wheel_impact, state.tooth_impact, state.wheel_impact)
            evaluate_loads(model, state, work, None, None)
        solve_chain(model, state, work, 0.0, None)
        sense(model, state, work, None, stages.sensed[s])
        _derivative(model, state, work, begin + offset * step, stages.slope[s])
    _unpack(state, stages.start, stages.slope, stages.b, stages.b.shape[0], step)
    for i in range(state.rate.shape[0]):
        if not abs(state.rate[i]) < RATE_LIMIT:
            return i
    orient(state.angle, work.cos, work.sin)
    forward_kinematics(model.chain, state, work)
    work.cut[4], work.cut[5] = work.cut[0], work.cut[1]
    if not model.closure.compliant:
        _project(model, state, work)
    for s in range(stages.b.shape[0] - 1, -1, -1):  # the mean over the step; the first stage comes last
        accumulate(model, work, stages.sensed[s], stages.b[s])
    _copy_memory(stages.tooth_impact, stages.wheel_impact, state.tooth_impact, state.wheel_impact)
    evaluate_loads(model, state, work, None, None)
    if contact_log.rows.size:
        log_contacts(contact_log, state, work, begin + step, step)
    state.steps[0] += 1
    return -1

"""Time loop: samples of equal length, each of one or more steps, and their record.

A feature that a scene lacks is None when a kernel is compiled, and its code is left out. Every such choice doubles the
code to compile: features that cost no time when absent have empty arrays, or zeros, instead.
"""

from collections.abc import Callable
from math import sqrt

from trackdyn.chain.kinematics import advance_maxwell, damping_weight, forward_kinematics, orient
from trackdyn.inputs.errors import DivergenceError
from trackdyn.integrate.contact_log import log_contacts
from trackdyn.integrate.dynamics import accumulate, evaluate_loads, sense, solve_chain
from trackdyn.integrate.energy import add_work, energies, finish_forces
from trackdyn.integrate.plane import plane_dynamics, turn_plane
from trackdyn.integrate.runge_kutta import rk_step
from trackdyn.integrate.semi_implicit import RATE_LIMIT, advance
from trackdyn.integrate.suspensions import advance_suspensions
from trackdyn.jit import direct, kernel
from trackdyn.model.arrays import BUSHING_LOSS, OFFSET, OptionalWork, P, Q, Record, State, Work
from trackdyn.model.constants import SPROCKET, Model

# Steps from one check for chatter to the next, each over three steps: a power of two that costs less than 1 % of a step
CHATTER_INTERVAL = 16


class Integration:
    """Kernel of a method with its work arrays: the same arrays and types of arguments in every call."""

    def __init__(self, work: Work, optional: OptionalWork):
        self._work, self._kernel, self._optional = work, _run, (optional.space, optional.implicit)
        if optional.stages is not None:
            self._kernel, self._optional = _run_stages, (optional.stages,)
        self._call: Callable | None = None

    def __call__(self, model: Model, state: State, record: Record, first: int, last: int, phase: str = "the run"):
        """Fill rows ``first`` to ``last - 1``; `DivergenceError` names the phase in which a body leaves the range."""
        arguments = model, state, self._work, record, (first, last), *self._optional
        if self._call is None:
            self._call = direct(self._kernel, *arguments)
        if (body := self._call(*arguments)) >= 0:
            single_pin = len(state.angle) == len(state.wheel_impact)
            name = f"pitch {body + 1}" if single_pin else f"{'connector' if body % 2 else 'link'} {body // 2 + 1}"
            raise DivergenceError(
                f"the run left the physical range at t = {state.steps[0] * model.step:.6g} s of {phase}, first at "
                f"{name}; use a step smaller than {model.step:g} s, or check the rig"
            )


def refresh(model: Model, state: State, work: Work, optional: OptionalWork = OptionalWork()):
    """Compute positions, velocities and loads of a state that was not set by a step."""
    _refresh(model, state, work, optional.space, optional.implicit)


@kernel
def _refresh(model: Model, state: State, work: Work, space, implicit):
    _place(model, state, work)
    evaluate_loads(model, state, work, space, implicit)


@kernel
def _place(model: Model, state: State, work: Work):
    """Compute positions and velocities of the bodies, and discard the neighbour lists."""
    orient(state.angle, work.cos, work.sin)
    forward_kinematics(model.chain, state, work)
    work.candidates.count[0] = -1  # lists of another model would not hold


@kernel
def _run(model: Model, state: State, work: Work, record: Record, rows, space, implicit):
    """Fill the rows from ``rows[0]`` to before ``rows[1]`` by steps of order 1."""
    weight = damping_weight(model.chain, model.step) if implicit is None else 1.0
    _place(model, state, work)
    sample, left, stepped = rows[0], 0, False
    while True:
        # called in one place, as most of the code to compile: a sample ends with the loads of the step after it
        evaluate_loads(model, state, work, space, implicit)
        if stepped:
            if record.contact_log.rows.size:
                log_contacts(record.contact_log, state, work, state.steps[0] * model.step, model.step)
            _track_gap(work)
            left -= 1
            if left == 0:
                _write_sample(model, state, work, record, sample, space)
                sample += 1
        if left == 0:
            if sample >= rows[1]:
                return -1
            left = model.stride
            _begin_sample(state, work)
            if space is not None:
                space.axial[:] = 0.0
        stepped = True
        if space is not None:
            for wheel in range(space.axial.shape[0]):
                space.axial[wheel] += space.wheel_load[wheel, 2] / model.stride
            plane_dynamics(model, state, work, space)
        solve_chain(model, state, work, model.step, implicit)
        sense(model, state, work, space, work.sensed)
        accumulate(model, work, work.sensed, 1.0)
        if implicit is not None:
            finish_forces(model, work, implicit)
        bad = advance(model, state, work, implicit)
        if bad >= 0:
            return bad
        _detect_chatter(model, state, work)
        if space is not None:
            turn_plane(model, state, space)
            if not abs(state.plane.motion[P]) + abs(state.plane.motion[Q]) < RATE_LIMIT:
                return 0
        advance_suspensions(model, state, work, model.suspensions)
        forward_kinematics(model.chain, state, work)
        add_work(model, state, work, weight, space)
        advance_maxwell(model, state, work, BUSHING_LOSS, model.maxwell)
        if implicit is None:
            for arc in range(work.tooth_force.shape[0]):
                work.tooth_before[arc] = work.tooth_force[arc]
            for slot in range(work.friction.shape[1]):
                work.friction[1, slot] = work.friction[0, slot]


@kernel
def _run_stages(model: Model, state: State, work: Work, record: Record, rows, stages):
    """Fill the rows from ``rows[0]`` to before ``rows[1]`` by steps of an explicit Runge-Kutta method."""
    _refresh(model, state, work, None, None)
    for sample in range(rows[0], rows[1]):
        _begin_sample(state, work)
        for _ in range(model.stride):
            bad = rk_step(model, state, work, record, stages)
            if bad >= 0:
                return bad
            _track_gap(work)
        _write_sample(model, state, work, record, sample, None)
    return -1


@kernel
def _begin_sample(state: State, work: Work):
    """Reset the sums of a sample, and compute exact cosines and sines."""
    work.sensed[:, 3:] = 0.0
    work.worst[:] = 0.0
    orient(state.angle, work.cos, work.sin)


@kernel
def _track_gap(work: Work):
    """Update the largest squares of the gap, of its rate and of the gap before the projection."""
    cut, worst = work.cut, work.worst
    for k in range(3):
        worst[k] = max(worst[k], cut[2 * k] * cut[2 * k] + cut[2 * k + 1] * cut[2 * k + 1])


@kernel
def _detect_chatter(model: Model, state: State, work: Work):
    """Add the motion that alternates from step to step to the sums of chatter, every `CHATTER_INTERVAL` steps.

    The second difference of three successive steps is four times its amplitude, and small where motion is resolved.
    """
    phase = state.steps[0] % CHATTER_INTERVAL
    if phase > 2:
        return
    dvx, dvy, velocity_history = work.com_dvx, work.com_dvy, work.velocity_history
    if phase < 2:
        for i in range(dvx.shape[0]):
            velocity_history[phase, 0, i], velocity_history[phase, 1, i] = dvx[i], dvy[i]
        return
    mass = model.chain.mass
    total = change = 0.0
    for i in range(dvx.shape[0]):
        x = velocity_history[0, 0, i] - 2.0 * velocity_history[1, 0, i] + dvx[i]
        y = velocity_history[0, 1, i] - 2.0 * velocity_history[1, 1, i] + dvy[i]
        change += mass[i] * (x * x + y * y)
        total += mass[i]
    work.alternating[0] += change / (16.0 * total)
    work.alternating[1] += 1.0


@kernel
def _write_sample(model: Model, state: State, work: Work, record: Record, sample, space):
    """Fill the rows of one sample."""
    n, rows = state.angle.shape[0], record.samples
    for sensor in range(model.sensors.body.shape[0]):
        for k in range(3):
            rows.raw[sample, sensor, k] = work.sensed[sensor, k]
            rows.mean[sample, sensor, k] = work.sensed[sensor, 3 + k] / model.stride
    rows.gap[sample] = sqrt(work.worst[0])
    rows.cut[sample, 0], rows.cut[sample, 1] = sqrt(work.worst[2]), sqrt(work.worst[1])
    body = model.sensors.body[0]
    middle = 0.5 * model.chain.length[body]
    rows.link_position[sample, 0] = work.pin_x[body] + middle * work.cos[body]
    rows.link_position[sample, 1] = work.pin_y[body] + middle * work.sin[body]
    for wheel in range(state.wheel_rate.shape[0]):
        rows.wheel_rate[sample, wheel] = state.wheel_rate[wheel]
    energies(model, state, work, space, rows.energy[sample])
    links, wheels = work.wheel_force.shape
    normal = tangential = 0.0
    for link in range(links):
        if work.wheel_force[link, SPROCKET] > 0.0:
            normal += work.wheel_force[link, SPROCKET]
            tangential += abs(work.friction[0, 2 * links + link * wheels + SPROCKET])
    rows.ring_force[sample, 0], rows.ring_force[sample, 1] = normal, tangential
    for i in range(record.pitches.shape[0]):
        pitch = record.pitches[i]
        for side in range(2):
            rows.force[sample, i, side] = work.tooth_force[2 * pitch + side]
            rows.area[sample, i, side] = work.tooth_area[2 * pitch + side]
            rows.groove[sample, i, side] = work.tooth_groove[2 * pitch + side]
        rows.force[sample, i, 2] = work.wheel_force[pitch, SPROCKET]
    if record.frame_stride > 0 and sample % record.frame_stride == 0:
        frame = sample // record.frame_stride
        record.frame[frame, 0], record.frame[frame, 1] = state.pin[0], state.pin[1]
        for i in range(n):
            record.frame[frame, 2 + i] = state.angle[i]
        record.frame[frame, 2 + n] = state.wheel_angle[SPROCKET]
    if space is not None:
        for k in range(4):
            rows.plane[sample, k] = state.plane.motion[k]
            rows.plane[sample, 4 + k] = state.plane.attitude[k]
        for wheel in range(space.axial.shape[0]):
            # on the axis, direction (b20, b21, b22) in P, the plane is where the normal component is the offset
            across = state.plane.motion[OFFSET] - space.centre[wheel, 2]
            rows.wheel_offset[sample, wheel] = across / space.relative[wheel, 2, 2]
            rows.axial_force[sample, wheel] = space.axial[wheel]

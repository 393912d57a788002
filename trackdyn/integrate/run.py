"""The time loop: samples of equal length, each of one or more steps, and what is kept of them.

Arguments that are None when a kernel is compiled take their code with them: an ordinary run carries
nothing of the other integrators and solvers.
"""

from math import sqrt

from trackdyn.chain.kinematics import orient, place
from trackdyn.integrate.dynamics import accumulate, evaluate_loads, sense, solve_chain
from trackdyn.integrate.energy import account, energies, finish_forces
from trackdyn.integrate.runge_kutta import march
from trackdyn.integrate.semi_implicit import advance
from trackdyn.integrate.spells import log_spells
from trackdyn.jit import kernel
from trackdyn.model import SPROCKET, Model, Record, State, Work


@kernel
def run(
    model: Model, state: State, work: Work, record: Record, first, last, stride, terms=None, stages=None, solver=None
):
    """Integrate samples ``first`` to ``last - 1`` of ``stride`` steps each and fill their rows.

    Parameters
    ----------
    terms : chain.implicit.ImplicitWork or None
        Take linearly implicit steps.
    stages : integrate.methods.RungeKutta or None
        Take the steps of an explicit Runge-Kutta method.
    solver : int or None
        As in `dynamics.solve_chain`.

    Returns
    -------
    body : int
        -1, or the body at which the run left the physical range; ``state.steps`` says when.
    """
    orient(state.angle, work.cos, work.sin)
    place(model.chain, state, work)
    evaluate_loads(model, state, work, terms)
    for sample in range(first, last):
        gap = 0.0
        for k in range(3):
            work.sensed[3 + k] = 0.0
        orient(state.angle, work.cos, work.sin)
        for _ in range(stride):
            if stages is not None:
                bad = march(model, state, work, record.spells, stages, solver)
                if bad >= 0:
                    return bad
            else:
                solve_chain(model, state, work, model.step, terms, solver)
                sense(model, state, work)
                accumulate(work, 1.0)
                if terms is not None:
                    finish_forces(model, state, work, terms)
                bad = advance(model, state, work, terms)
                if bad >= 0:
                    return bad
                place(model.chain, state, work)
                account(model, state, work)
                evaluate_loads(model, state, work, terms)
                if record.spells.enabled:
                    log_spells(record.spells, state, work, state.steps[0] * model.step, model.step)
            gap = max(gap, sqrt(work.cut[0] * work.cut[0] + work.cut[1] * work.cut[1]))
        keep(model, state, work, record, sample, stride, gap)
    return -1


@kernel
def keep(model: Model, state: State, work: Work, record: Record, sample, stride, gap):
    """Fill the rows of one sample."""
    n = state.angle.shape[0]
    for k in range(3):
        record.raw[sample, k] = work.sensed[k]
        record.mean[sample, k] = work.sensed[3 + k] / stride
    record.gap[sample] = gap
    body = model.sensor.body
    middle = 0.5 * model.chain.length[body]
    record.place[sample, 0] = work.pin_x[body] + middle * work.cos[body]
    record.place[sample, 1] = work.pin_y[body] + middle * work.sin[body]
    for wheel in range(state.wheel_rate.shape[0]):
        record.wheel_rate[sample, wheel] = state.wheel_rate[wheel]
    energies(model, state, work, record.energy[sample])
    for i in range(record.pitches.shape[0]):
        pitch = record.pitches[i]
        for side in range(2):
            record.force[sample, i, side] = work.tooth_force[2 * pitch + side]
            record.area[sample, i, side] = work.tooth_area[2 * pitch + side]
            record.groove[sample, i, side] = work.tooth_groove[2 * pitch + side]
        record.force[sample, i, 2] = work.wheel_force[pitch, SPROCKET]
    if record.frame_stride > 0 and sample % record.frame_stride == 0:
        frame = sample // record.frame_stride
        record.frame[frame, 0] = state.pin[0]
        record.frame[frame, 1] = state.pin[1]
        for i in range(n):
            record.frame[frame, 2 + i] = state.angle[i]
        record.frame[frame, 2 + n] = state.wheel_angle[SPROCKET]

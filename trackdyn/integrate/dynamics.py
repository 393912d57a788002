"""Loads and accelerations of a state: what every integrator asks for."""

from trackdyn.chain import dense, implicit, riccati, transfer_matrices
from trackdyn.chain.kinematics import bushing_torques
from trackdyn.contact.loads import contact_loads
from trackdyn.integrate.methods import MULTIPLIERS
from trackdyn.jit import kernel
from trackdyn.model import Model, State, Work


@kernel
def evaluate_loads(model: Model, state: State, work: Work, terms=None):
    """Contacts and bushings at the present state, led to the end of the step if ``terms`` are given."""
    contact_loads(model, state, work, terms)
    bushing_torques(model.chain, state, work, 0.0 if terms is None else model.step)


@kernel
def solve_chain(model: Model, state: State, work: Work, step, terms=None, solver=None):
    """Accelerations of the chain under the loads in ``work``, the closure rigid or compliant.

    Parameters
    ----------
    step : float
        Step over which bushing damping and a compliant cut are implicit, s; 0: explicit.
    terms : chain.implicit.ImplicitWork or None
        Solve the linearly implicit system.
    solver : int or None
        None for the Riccati sweep, else ``TRANSFER_PRODUCT`` or ``MULTIPLIERS``.
    """
    chain, cut, closure = model.chain, work.cut, model.closure
    probe = model.sensor.body
    damping = step * chain.damping
    stiff = force_x = force_y = 0.0
    if closure.compliant:
        stiff = step * (step * closure.stiffness + closure.damping)
        rate_part = step * closure.stiffness + closure.damping
        force_x = closure.stiffness * cut[0] + rate_part * cut[2]
        force_y = closure.stiffness * cut[1] + rate_part * cut[3]
        # the two ends of the cut do not coincide: this couple keeps the angular momentum (A.6)
        work.moment[-1] += cut[0] * force_y - cut[1] * force_x
    if terms is not None:
        wheels = model.wheels
        implicit.accelerations(
            chain, work.cos, work.sin, state.rate, work.force_x, work.force_y, work.moment, work.torque,
            damping + step * step * chain.stiffness, work.wheel_torque, wheels.inertia, wheels.drag, state.wheel_rate,
            step, probe, 1.0 / stiff if closure.compliant else 0.0, force_x, force_y, work.sweep, terms,
        )  # fmt: skip
    elif solver is not None:
        if solver == MULTIPLIERS:
            dense.accelerations(
                chain, work.cos, work.sin, state.rate, work.force_x, work.force_y, work.moment, work.torque, damping,
                probe, work.sweep,
            )  # fmt: skip
        else:
            transfer_matrices.accelerations(
                chain, work.cos, work.sin, state.rate, work.force_x, work.force_y, work.moment, work.torque, probe,
                work.sweep,
            )  # fmt: skip
    else:
        riccati.sweep(
            chain, work.cos, work.sin, state.rate, work.force_x, work.force_y, work.moment, work.torque, damping,
            probe, work.sweep,
        )  # fmt: skip
        if closure.compliant:
            riccati.close_compliant(force_x, force_y, stiff, work.torque[-1], damping, work.sweep)
        else:
            riccati.close(work.torque[-1], damping, work.sweep)


@kernel
def sense(model: Model, state: State, work: Work):
    """Acceleration of the sensor in the link frame (a_s of Eq. 40) and the link's angle, into ``work.sensed``."""
    sensor, sweep = model.sensor, work.sweep
    p, load, r, b = sweep.probe, sweep.load, sweep.response, sensor.body
    ax = p[0, 0] * load[0] + p[0, 1] * load[1] + p[0, 2] * load[2] + p[0, 3]
    ay = p[1, 0] * load[0] + p[1, 1] * load[1] + p[1, 2] * load[2] + p[1, 3]
    alpha = r[b, 0] * load[0] + r[b, 1] * load[1] + r[b, 2] * load[2] + r[b, 3]
    w2 = state.rate[b] ** 2
    c, s = work.cos[b], work.sin[b]
    work.sensed[0] = c * ax + s * ay - alpha * sensor.y - w2 * sensor.x
    work.sensed[1] = c * ay - s * ax + alpha * sensor.x - w2 * sensor.y
    work.sensed[2] = state.angle[b]


@kernel
def accumulate(work: Work, weight):
    """Add the sensed values to the sums of the sample."""
    for k in range(3):
        work.sensed[3 + k] += weight * work.sensed[k]

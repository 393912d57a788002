"""The account of work: what every force did during a run, and the energies of a state."""

import numpy as np

from trackdyn.jit import kernel
from trackdyn.model import (
    BEARING,
    BUSHING_ELASTIC,
    BUSHING_LOSS,
    GRAVITY,
    KINETIC,
    SPROCKET,
    SPROCKET_WORK,
    TOOTH_FRICTION,
    TOOTH_NORMAL,
    WHEEL_FRICTION,
    WHEEL_NORMAL,
    Model,
    State,
    Work,
)


@kernel
def account(model: Model, state: State, work: Work):
    """Work of every force over the last step: its place at the start, the mean of the velocities.

    The velocities after the step are taken in the configuration before it. Then joint forces do no
    work, as they should, and the work of all other forces is the change of kinetic energy of the
    discrete motion: what remains of the balance shows errors of the equations and of the path, not
    of the quadrature.
    """
    chain, h, done = model.chain, model.step, state.work_done
    row = work.contact
    for k in range(work.count[0]):
        body = work.contact_body[k, 0]
        wheel = work.contact_body[k, 1]
        dw = state.rate[body] - work.old_rate[body]
        vx = row[k, 6] + 0.5 * (work.com_dvx[body] - dw * row[k, 5])
        vy = row[k, 7] + 0.5 * (work.com_dvy[body] + dw * row[k, 4])
        ww = 0.5 * (row[k, 10] + state.wheel_rate[wheel])
        sx = -ww * row[k, 9]
        sy = ww * row[k, 8]
        if wheel == SPROCKET:
            done[SPROCKET_WORK] += h * ((row[k, 0] + row[k, 2]) * sx + (row[k, 1] + row[k, 3]) * sy)
        normal = -h * (row[k, 0] * (vx - sx) + row[k, 1] * (vy - sy))
        friction = -h * (row[k, 2] * (vx - sx) + row[k, 3] * (vy - sy))
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
def finish_forces(model: Model, state: State, work: Work, terms):
    """Contact forces of a linearly implicit step with the part that its accelerations add.

    The rows of the contact list hold the forces led ahead without it. Called between the sweep and the
    step; overwrites ``com_dvx, com_dvy, old_rate``, which the step fills afterwards.
    """
    chain, sweep, row = model.chain, work.sweep, work.contact
    base, response, load = sweep.base, sweep.response, sweep.load
    ax = base[0, 0] * load[0] + base[0, 1] * load[1] + base[0, 2] * load[2] + base[0, 3]
    ay = base[1, 0] * load[0] + base[1, 1] * load[1] + base[1, 2] * load[2] + base[1, 3]
    for i in range(state.rate.shape[0]):
        alpha = response[i, 0] * load[0] + response[i, 1] * load[1] + response[i, 2] * load[2] + response[i, 3]
        work.com_dvx[i] = ax  # of the input pin
        work.com_dvy[i] = ay
        work.old_rate[i] = alpha
        dx = chain.length[i] * work.cos[i]
        dy = chain.length[i] * work.sin[i]
        w2 = state.rate[i] * state.rate[i]
        ax -= alpha * dy + w2 * dx
        ay += alpha * dx - w2 * dy
    for k in range(work.count[0]):
        fn = np.sqrt(row[k, 0] * row[k, 0] + row[k, 1] * row[k, 1])
        if fn == 0.0:
            continue
        body, wheel = work.contact_body[k, 0], work.contact_body[k, 1]
        nx = row[k, 0] / fn
        ny = row[k, 1] / fn
        c, s = work.cos[body], work.sin[body]
        rx = row[k, 4] + chain.com_x[body] * c - chain.com_y[body] * s
        ry = row[k, 5] + chain.com_x[body] * s + chain.com_y[body] * c
        px = work.com_dvx[body] - work.old_rate[body] * ry
        py = work.com_dvy[body] + work.old_rate[body] * rx
        turn = 0.0 if wheel == SPROCKET else terms.load[3 + wheel] * (row[k, 8] * nx + row[k, 9] * ny)
        normal = -row[k, 11] * (nx * px + ny * py)
        across = -row[k, 12] * (nx * py - ny * px - turn)
        row[k, 0] += normal * nx
        row[k, 1] += normal * ny
        row[k, 2] -= across * ny
        row[k, 3] += across * nx


@kernel
def powers(model: Model, state: State, work: Work, out, first):
    """Power of every force at the present state into ``out[first]`` and the six entries behind it, W."""
    for k in range(7):
        out[first + k] = 0.0
    row = work.contact
    for k in range(work.count[0]):
        wheel = work.contact_body[k, 1]
        ww = row[k, 10]
        sx = -ww * row[k, 9]
        sy = ww * row[k, 8]
        if wheel == SPROCKET:
            out[first + SPROCKET_WORK] += (row[k, 0] + row[k, 2]) * sx + (row[k, 1] + row[k, 3]) * sy
        normal = -(row[k, 0] * (row[k, 6] - sx) + row[k, 1] * (row[k, 7] - sy))
        friction = -(row[k, 2] * (row[k, 6] - sx) + row[k, 3] * (row[k, 7] - sy))
        if work.contact_body[k, 2]:
            out[first + TOOTH_NORMAL] += normal
            out[first + TOOTH_FRICTION] += friction
        else:
            out[first + WHEEL_NORMAL] += normal
            out[first + WHEEL_FRICTION] += friction
    n = state.rate.shape[0]
    for i in range(n):
        out[first + BUSHING_LOSS] += model.chain.damping * work.joint_rate[i] * work.joint_rate[i]
    for wheel in range(1, model.wheels.x.shape[0]):
        out[first + BEARING] += model.wheels.drag[wheel] * state.wheel_rate[wheel] * state.wheel_rate[wheel]


@kernel
def energies(model: Model, state: State, work: Work, out):
    """Fill ``out`` with the account of work and the energies of the present state (J)."""
    chain = model.chain
    for k in range(7):
        out[k] = state.work_done[k]
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

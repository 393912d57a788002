"""Energy balance: work of every force during a run, and the energies of a state."""

import numpy as np

from trackdyn.chain.kinematics import bearing_drag, joint_angles, joint_differences, mass_centre, maxwell_energy
from trackdyn.contact.forces import shear_energy, wheel_velocity
from trackdyn.integrate.suspensions import suspension_energies
from trackdyn.jit import kernel
from trackdyn.model import arrays
from trackdyn.model.arrays import FLANK, OFFSET, RING, SPEED, ImplicitWork, P, Q, State, Work
from trackdyn.model.constants import SPROCKET, Model


@kernel
def _add_contact_work(out, first, row, body, wheel, step):
    """Add the work of a contact in a step (s) to ``out[first:]``; ``body``, ``wheel``: velocities of its two points."""
    sx, sy, sz = wheel
    vx, vy, vz = body[0] - sx, body[1] - sy, body[2] - sz
    if row["wheel"] == SPROCKET:
        drive = (row["normal_x"] + row["friction_x"]) * sx + (row["normal_y"] + row["friction_y"]) * sy
        out[first + arrays.SPROCKET_WORK] += step * (drive + (row["normal_z"] + row["friction_z"]) * sz)
    normal = -step * (row["normal_x"] * vx + row["normal_y"] * vy + row["normal_z"] * vz)
    friction = -step * (row["friction_x"] * vx + row["friction_y"] * vy + row["friction_z"] * vz)
    if row["kind"] == FLANK:
        out[first + arrays.TOOTH_NORMAL] += normal
        out[first + arrays.TOOTH_FRICTION] += friction
    else:
        out[first + arrays.WHEEL_NORMAL] += normal
        out[first + (arrays.RING_FRICTION if row["kind"] == RING else arrays.WHEEL_FRICTION)] += friction


@kernel
def add_work(model: Model, state: State, work: Work, damping_weight, space):
    """Add the work of every force over the last step: positions at its start, the mean of the velocities.

    The velocities after the step are taken in the configuration before it. Joint forces then do no work, and the work
    of the others is the change of kinetic energy of the discrete motion: the residual of the balance shows errors of
    the equations and of the path, not of the quadrature. Bushings are damped with the velocities at the fraction
    ``damping_weight`` of the step. Axial friction counts as friction of its surface, guides as normal forces.
    """
    chain, h, done = model.chain, model.step, state.work_done
    for k in range(work.count[0]):
        row = work.contact[k]
        body = row["body"]
        dw = work.delta_omega[body]
        vx = row["speed_x"] + 0.5 * (work.com_dvx[body] - dw * row["arm_y"])
        vy = row["speed_y"] + 0.5 * (work.com_dvy[body] + dw * row["arm_x"])
        ww = 0.5 * (row["rate"] + state.wheel_rate[row["wheel"]])
        tx, ty = wheel_velocity(state, model.suspensions, row["wheel"], 0.5)
        vz = sz = 0.0
        if space is not None:
            dvz, dp, dq = space.change[0], space.change[1], space.change[2]
            vx += 0.5 * dq * row["arm_z"]
            vy -= 0.5 * dp * row["arm_z"]
            vz = row["speed_z"] + 0.5 * (dvz + dp * row["pin_y"] - dq * row["pin_x"])
            sz = ww * row["spin_z"]
        _add_contact_work(done, 0, row, (vx, vy, vz), (ww * row["spin_x"] + tx, ww * row["spin_y"] + ty, sz), h)
    joint_differences(state.rate, work.joint_difference)
    loss = 0.0
    for i in range(state.rate.shape[0]):
        before, after = work.joint_rate[i], work.joint_difference[i]
        loss += (before + damping_weight * (after - before)) * (before + after)
    done[arrays.BUSHING_LOSS] += 0.5 * h * chain.damping * loss


@kernel
def finish_forces(model: Model, work: Work, implicit: ImplicitWork):
    """Add the terms of the accelerations of a linearly implicit step to the contact list, between sweep and step."""
    for k in range(work.count[0]):
        row = work.contact[k]
        fn = np.sqrt(row["normal_x"] * row["normal_x"] + row["normal_y"] * row["normal_y"])
        if fn == 0.0:
            continue
        body, wheel = row["body"], row["wheel"]
        nx, ny = row["normal_x"] / fn, row["normal_y"] / fn
        gx, gy = mass_centre(model.chain, work, body)
        px = work.pin_ax[body] - work.alpha[body] * (row["arm_y"] + gy)
        py = work.pin_ay[body] + work.alpha[body] * (row["arm_x"] + gx)
        own = 0.0 if wheel == SPROCKET else implicit.load[3 + wheel] * (row["spin_y"] * nx - row["spin_x"] * ny)
        normal = -row["normal_slope"] * (nx * px + ny * py)
        friction = -row["friction_slope"] * (nx * py - ny * px - own)
        row["normal_x"] += normal * nx
        row["normal_y"] += normal * ny
        row["friction_x"] -= friction * ny
        row["friction_y"] += friction * nx


@kernel
def powers(model: Model, state: State, work: Work, out, first):
    """Write the power of every force at the present state, W, into the entries of work from ``out[first]`` on."""
    for k in range(arrays.KINETIC):
        out[first + k] = 0.0
    for k in range(work.count[0]):
        row = work.contact[k]
        wheel = row["rate"] * row["spin_x"], row["rate"] * row["spin_y"], 0.0
        _add_contact_work(out, first, row, (row["speed_x"], row["speed_y"], 0.0), wheel, 1.0)
    for i in range(state.rate.shape[0]):
        out[first + arrays.BUSHING_LOSS] += model.chain.damping * work.joint_rate[i] * work.joint_rate[i]
    for wheel in range(1, model.wheels.x.shape[0]):
        rate = state.wheel_rate[wheel]
        out[first + arrays.BEARING] += bearing_drag(model.wheels, wheel, rate, work.carried) * rate * rate


@kernel
def energies(model: Model, state: State, work: Work, space, out):
    """Fill ``out`` with the energy balance and the energies of the present state (J)."""
    chain = model.chain
    for k in range(arrays.KINETIC):
        out[k] = state.work_done[k]
    kinetic = gravity = elastic = 0.0
    joint_angles(state, work.joint_difference)
    for i in range(state.angle.shape[0]):
        v2 = work.com_vx[i] ** 2 + work.com_vy[i] ** 2
        kinetic += 0.5 * (chain.mass[i] * v2 + chain.inertia[i] * state.rate[i] ** 2)
        _, gy = mass_centre(chain, work, i)
        gravity += chain.mass[i] * chain.gravity * (work.pin_y[i] + gy)
        elastic += 0.5 * chain.stiffness * (work.joint_difference[i] - chain.free_angle) ** 2
    for wheel in range(1, model.wheels.x.shape[0]):
        kinetic += 0.5 * model.wheels.inertia[wheel] * state.wheel_rate[wheel] ** 2
    # friction stored in a wheel's surface under shear is lost only when the link leaves or slides
    for wheel in range(model.wheels.x.shape[0]):
        stored_shear = shear_energy(model, state, wheel)
        out[arrays.RING_FRICTION if wheel == SPROCKET else arrays.WHEEL_FRICTION] -= stored_shear
        elastic += stored_shear
    sliding, spring, lifted = suspension_energies(model, state, model.suspensions)
    out[arrays.KINETIC] = kinetic + sliding
    out[arrays.GRAVITY] = gravity + lifted
    out[arrays.BUSHING_ELASTIC] = elastic + spring + maxwell_energy(state, model.maxwell)
    if space is not None:
        _add_plane(model, state, work, space, out)


@kernel
def _add_plane(model: Model, state: State, work: Work, space, out):
    """Add the out-of-plane kinetic energy and the change of the gravitational energy by the tilt (J)."""
    chain, along, across = model.chain, model.space.along, model.space.across
    motion, a = state.plane.motion, space.attitude
    p, q, z = motion[P], motion[Q], motion[OFFSET]
    kinetic = lifted = 0.0
    for i in range(state.rate.shape[0]):
        c, s = work.cos[i], work.sin[i]
        gx, gy = mass_centre(chain, work, i)
        x, y = work.pin_x[i] + gx, work.pin_y[i] + gy
        v = motion[SPEED] + p * (y - state.pin[1]) - q * (x - state.pin[0])
        own_x, own_y = c * p + s * q, c * q - s * p  # the plane's angular velocity along and across the pin line
        kinetic += 0.5 * (chain.mass[i] * v * v + along[i] * own_x * own_x + across[i] * own_y * own_y)
        lifted += chain.mass[i] * chain.gravity * (a[1, 0] * x + (a[1, 1] - 1.0) * y + a[1, 2] * z)
    out[arrays.KINETIC] += kinetic
    out[arrays.GRAVITY] += lifted

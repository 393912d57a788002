"""Suspensions of wheels: sliders and trailing arms that move under the contact forces of the chain.

A suspension has one coordinate q from its rest position: the displacement of a slider (m) or the rotation of an arm
(rad). Its wheel's position is ``P(q)``, and ``T = dP/dq`` projects forces onto the coordinate.
"""

from math import cos, sin

from trackdyn.chain.kinematics import rotated
from trackdyn.jit import kernel
from trackdyn.model.arrays import BEARING, State, Work
from trackdyn.model.constants import Model, Suspensions


@kernel
def along(suspensions: Suspensions, k, q):
    """Return ``T``, x and y of the wheel's velocity at unit rate of suspension ``k``."""
    x, y = suspensions.along_x[k], suspensions.along_y[k]
    return rotated(x, y, cos(q), sin(q)) if suspensions.arm[k] else (x, y)


@kernel
def chain_force(work: Work, wheel):
    """Return the sum of the contact forces of the chain on a wheel, x and y, N."""
    fx = fy = 0.0
    for k in range(work.count[0]):
        row = work.contact[k]
        if row["wheel"] == wheel:
            fx -= row["normal_x"] + row["friction_x"]
            fy -= row["normal_y"] + row["friction_y"]
    return fx, fy


@kernel
def advance_suspensions(model: Model, state: State, work: Work, suspensions):
    """Advance the suspensions by semi-implicit Euler, with the dampers at the end of the step."""
    h = model.step
    for k in range(suspensions.wheel.shape[0]):
        motion, mass, low, high = state.suspension[k], suspensions.mass[k], suspensions.low[k], suspensions.high[k]
        wheel, (tx, ty) = suspensions.wheel[k], along(suspensions, k, motion["q"])
        fx, fy = chain_force(work, wheel)
        force = tx * fx + ty * fy + suspensions.preload[k] - suspensions.stiffness[k] * motion["q"]
        force -= suspensions.weight[k] * ty
        old = motion["rate"]
        rate = free = (mass * old + h * force) / (mass + h * suspensions.damping[k])
        position = motion["q"] + h * rate
        if position < low or position > high:
            position = min(max(position, low), high)
            rate = (position - motion["q"]) / h
            if (position == low and rate < 0.0) or (position == high and rate > 0.0):
                rate = 0.0
        # the energy lost at a stop and the damper's work count as bearing losses
        lost = h * suspensions.damping[k] * free * (0.5 * (old + free)) + 0.5 * mass * (free * free - rate * rate)
        state.work_done[BEARING] += lost
        motion["q"], motion["rate"], motion["rate_before"] = position, rate, old
        motion["along_x"], motion["along_y"] = tx, ty
        tx, ty = along(suspensions, k, position)
        if suspensions.arm[k] == 0:
            tx, ty = tx * position, ty * position
        else:  # the arm is T turned back by a right angle
            tx, ty = ty, -tx
        model.wheels.x[wheel], model.wheels.y[wheel] = suspensions.x[k] + tx, suspensions.y[k] + ty


@kernel
def suspension_energies(model: Model, state: State, suspensions):
    """Return the kinetic energy of the suspensions, the energy of their springs, and that of their weight, J."""
    kinetic = spring = lifted = 0.0
    for k in range(suspensions.wheel.shape[0]):
        q, rate = state.suspension[k]["q"], state.suspension[k]["rate"]
        kinetic += 0.5 * suspensions.mass[k] * rate * rate
        spring += (0.5 * suspensions.stiffness[k] * q - suspensions.preload[k]) * q
        lifted += suspensions.weight[k] * model.wheels.y[suspensions.wheel[k]]
    return kinetic, spring, lifted

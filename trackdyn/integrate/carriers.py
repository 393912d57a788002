"""Suspensions of wheels: sliders and trailing arms that move under the contact forces of the chain.

A suspension (``carrier`` in the code) has one coordinate q from its rest position: the displacement of a slider (m) or
the rotation of an arm (rad). Its wheel's position is ``P(q)``, and ``T = dP/dq`` projects forces onto the coordinate.
"""

from math import cos, sin

from trackdyn.jit import kernel
from trackdyn.model.arrays import BEARING, State, Work
from trackdyn.model.constants import Carriers, Model


@kernel
def along(carriers: Carriers, k, q):
    """Return ``T``, x and y of the wheel's velocity at unit rate of suspension ``k``."""
    if carriers.arm[k] == 0:
        return carriers.along_x[k], carriers.along_y[k]
    c, s = cos(q), sin(q)
    return c * carriers.along_x[k] - s * carriers.along_y[k], s * carriers.along_x[k] + c * carriers.along_y[k]


@kernel
def place_wheel(model: Model, carriers: Carriers, k, q):
    """Place the wheel of suspension ``k`` at the coordinate ``q``."""
    wheel = carriers.wheel[k]
    tx, ty = along(carriers, k, q)
    if carriers.arm[k] == 0:
        model.wheels.x[wheel] = carriers.x[k] + tx * q
        model.wheels.y[wheel] = carriers.y[k] + ty * q
    else:  # the arm is T turned back by a right angle
        model.wheels.x[wheel] = carriers.x[k] + ty
        model.wheels.y[wheel] = carriers.y[k] - tx


@kernel
def push(work: Work, wheel):
    """Return the contact force of the chain on a wheel, x and y, N."""
    fx = fy = 0.0
    for k in range(work.count[0]):
        row = work.contact[k]
        if row["wheel"] == wheel:
            fx -= row["normal_x"] + row["friction_x"]
            fy -= row["normal_y"] + row["friction_y"]
    return fx, fy


@kernel
def advance_carriers(model: Model, state: State, work: Work, carriers):
    """Advance the suspensions by semi-implicit Euler, with the dampers at the end of the step.

    At a stop a suspension loses its velocity; that energy and the damper's work count as bearing losses.
    """
    h = model.step
    for k in range(carriers.wheel.shape[0]):
        moved, mass = state.slide[k], carriers.mass[k]
        tx, ty = along(carriers, k, moved["q"])
        fx, fy = push(work, carriers.wheel[k])
        force = tx * fx + ty * fy + carriers.preload[k] - carriers.stiffness[k] * moved["q"]
        force -= carriers.weight[k] * ty
        old = moved["rate"]
        rate = (mass * old + h * force) / (mass + h * carriers.damping[k])
        free = rate
        position = moved["q"] + h * rate
        low, high = carriers.low[k], carriers.high[k]
        if position < low or position > high:
            position = min(max(position, low), high)
            rate = (position - moved["q"]) / h
            if (position == low and rate < 0.0) or (position == high and rate > 0.0):
                rate = 0.0
        mean = 0.5 * (old + free)
        lost = h * carriers.damping[k] * free * mean + 0.5 * mass * (free * free - rate * rate)
        state.work_done[BEARING] += lost
        moved["q"] = position
        moved["rate"] = rate
        moved["rate_before"] = old
        moved["along_x"] = tx
        moved["along_y"] = ty
        place_wheel(model, carriers, k, position)


@kernel
def carrier_energy(model: Model, state: State, carriers):
    """Return the kinetic energy of the suspensions, the energy of their springs, and that of their weight, J."""
    kinetic = spring = lifted = 0.0
    for k in range(carriers.wheel.shape[0]):
        q, rate = state.slide[k]["q"], state.slide[k]["rate"]
        kinetic += 0.5 * carriers.mass[k] * rate * rate
        spring += (0.5 * carriers.stiffness[k] * q - carriers.preload[k]) * q
        lifted += carriers.weight[k] * model.wheels.y[carriers.wheel[k]]
    return kinetic, spring, lifted

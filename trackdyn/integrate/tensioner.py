"""The tensioning wheel on a spring and a damper: it slides under the contact forces of the chain."""

from trackdyn.jit import kernel
from trackdyn.model.constants import Model
from trackdyn.model.record import BEARING
from trackdyn.model.state import State
from trackdyn.model.work import FRICTION_X, FRICTION_Y, NORMAL_X, NORMAL_Y, WHEEL, Work


@kernel
def push(work: Work, tensioner):
    """Force of the chain on the sliding wheel along its way, N."""
    force, row = 0.0, work.contact
    for k in range(work.count[0]):
        if work.contact_body[k, WHEEL] == tensioner.wheel:
            force -= tensioner.along_x * (row[k, NORMAL_X] + row[k, FRICTION_X])
            force -= tensioner.along_y * (row[k, NORMAL_Y] + row[k, FRICTION_Y])
    return force


@kernel
def slide(model: Model, state: State, work: Work, tensioner):
    """Advance the sliding wheel by semi-implicit Euler, its damper taken at the end of the step.

    At a stop it stays where it is and loses its velocity; that and the damper's work count as bearing losses.
    """
    if tensioner is None:
        return
    h, moved, mass = model.step, state.slide, tensioner.mass
    force = push(work, tensioner) + tensioner.preload - tensioner.stiffness * moved[0]
    old = moved[1]
    rate = (mass * old + h * force) / (mass + h * tensioner.damping)
    free = rate
    place = moved[0] + h * rate
    if place < tensioner.low or place > tensioner.high:
        place = min(max(place, tensioner.low), tensioner.high)
        rate = (place - moved[0]) / h
        if (place == tensioner.low and rate < 0.0) or (place == tensioner.high and rate > 0.0):
            rate = 0.0
    mean = 0.5 * (old + free)
    state.work_done[BEARING] += h * tensioner.damping * free * mean + 0.5 * mass * (free * free - rate * rate)
    moved[0] = place
    moved[1] = rate
    moved[2] = old
    model.wheels.x[tensioner.wheel] = tensioner.x + tensioner.along_x * place
    model.wheels.y[tensioner.wheel] = tensioner.y + tensioner.along_y * place


@kernel
def mean_velocity(state: State, tensioner, wheel):
    """Mean velocity of a wheel's centre over the last step, m/s: 0 but for the one that slides."""
    if tensioner is None:
        return 0.0, 0.0
    if wheel != tensioner.wheel:
        return 0.0, 0.0
    mean = 0.5 * (state.slide[1] + state.slide[2])
    return mean * tensioner.along_x, mean * tensioner.along_y


@kernel
def tensioner_energy(state: State, tensioner):
    """Kinetic energy of what slides and energy of its spring, J."""
    if tensioner is None:
        return 0.0, 0.0
    place, rate = state.slide[0], state.slide[1]
    return 0.5 * tensioner.mass * rate * rate, (0.5 * tensioner.stiffness * place - tensioner.preload) * place

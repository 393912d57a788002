"""Pins, mass centres and bushing torques along the chain (relative coordinates, Eq. 6 in the plane).

Rubber loses a share of its energy in every cycle: Maxwell elements parallel to the spring of a bushing, each a spring k
and a damper k T in series. The moment s of one follows the rate r of its joint by ``s' = k r - s / T``; over a step the
rate is constant, so that

    s(t) = k T r + (s_0 - k T r) e^(-t / T)

is exact, and with it the energy ``s^2 / 2 k`` stored and the energy that is lost, the integral of ``s^2 / k T``.
`rig.laws` chooses those that give a loss factor that hardly depends on the frequency.
"""

from math import cos as cosine
from math import exp, tanh
from math import sin as sine

import numpy as np

from trackdyn.jit import inlined, kernel
from trackdyn.model.arrays import State, Work
from trackdyn.model.constants import Chain, Model, Wheels


@kernel
def orient(angle, cos, sin):
    """Write cosine and sine of every body's angle."""
    for i in range(angle.shape[0]):
        cos[i], sin[i] = cosine(angle[i]), sine(angle[i])


@inlined
def rotated(x, y, c, s):
    """Rotate a vector by the angle whose cosine is ``c`` and whose sine is ``s``."""
    return x * c - y * s, x * s + y * c


@inlined
def mass_centre(chain, work, body):
    """Return the mass centre of a body from its input pin, m."""
    return rotated(chain.com_x[body], chain.com_y[body], work.cos[body], work.sin[body])


@inlined
def on_pin_line(work, body, along):
    """Return the position of a point on a body's pin line, ``along`` from its input pin, m."""
    return work.pin_x[body] + along * work.cos[body], work.pin_y[body] + along * work.sin[body]


@kernel
def forward_kinematics(chain: Chain, state, work):
    """Write pins and velocities of the mass centres along the chain, gap of the cut joint and its rate."""
    x, y, vx, vy = state.pin[0], state.pin[1], state.pin[2], state.pin[3]
    for i in range(state.angle.shape[0]):
        gx, gy = mass_centre(chain, work, i)
        dx, dy, w = chain.length[i] * work.cos[i], chain.length[i] * work.sin[i], state.rate[i]
        work.pin_x[i], work.pin_y[i] = x, y
        work.com_vx[i], work.com_vy[i] = vx - w * gy, vy + w * gx
        x += dx
        y += dy
        vx -= w * dy
        vy += w * dx
    work.pin_x[-1], work.pin_y[-1] = x, y
    for k, end in enumerate((x, y, vx, vy)):
        work.cut[k] = end - state.pin[k]


@kernel
def damping_weight(chain: Chain, step):
    """Return the fraction of a step at which bushing damping is evaluated: half, for an error of second order.

    It is larger where the fastest decay, links and connectors in zigzag with their mass centres at rest, would
    overshoot: the decay then ends at zero (`scene.step.step_limits`).
    """
    a, b = chain.length[0], chain.length[1]
    mobility = 2.0 * (a + b) ** 2 / (chain.inertia[0] * b * b + chain.inertia[1] * a * a)
    decay = step * chain.damping * mobility
    return 0.5 if decay <= 2.0 else 1.0 - 1.0 / decay


@kernel
def joint_differences(values, out):
    """Write the value of the outboard body less that of the inboard one at every joint, the cut joint last."""
    last = values.shape[0] - 1
    for i in range(last):
        out[i] = values[i + 1] - values[i]
    out[last] = values[0] - values[last]


@kernel
def joint_angles(state: State, out):
    """Write the angle of every joint, rad."""
    joint_differences(state.angle, out)
    out[-1] -= 2.0 * np.pi  # a clockwise loop: angles fall by a full rotation along the chain


@kernel
def bushing_torques(chain: Chain, state, work, ahead=0.0):
    """Write torques of bushings and the joint rates that they use; springs are taken ``ahead`` seconds later."""
    joint_differences(state.rate, work.joint_rate)
    joint_angles(state, work.torque)
    for i in range(work.torque.shape[0]):
        rate = work.joint_rate[i]
        work.torque[i] = -chain.stiffness * (work.torque[i] + ahead * rate - chain.free_angle) - chain.damping * rate


SLOW = 0.1  # rad/s below which Coulomb friction and rolling resistance fade: a twentieth of the slowest running


@kernel
def bearing_drag(wheels: Wheels, wheel, rate, carried):
    """Return the drag coefficient of a wheel's bearing: torque over its rate (rad/s), N m s/rad.

    It is a viscous term plus the secant of a torque that fades below ``SLOW``: a constant one and rolling
    resistance, ``rolling`` times the sum of the links' normal forces (``carried``, (w,), N).
    """
    drag, torque = wheels.drag[wheel], wheels.torque[wheel] + wheels.rolling[wheel] * carried[wheel]
    if torque > 0.0:
        turning = max(abs(rate), 1e-6 * SLOW)
        drag += torque * tanh(turning / SLOW) / turning
    return drag


@kernel
def add_maxwell_moments(state: State, work: Work, step, maxwell):
    """Add the Maxwell elements' moments ``step`` s (0: now) later at the present rates, which the sweep changes."""
    for b in range(maxwell.time.shape[0]):
        decay = exp(-step / maxwell.time[b])
        gain = maxwell.stiffness[b] * maxwell.time[b] * (1.0 - decay)
        for i in range(state.maxwell.shape[1]):
            work.torque[i] -= decay * state.maxwell[b, i] + gain * work.joint_rate[i]


@kernel
def maxwell_damping(step, maxwell):
    """Return the sum of the moments that a unit rate adds over a step, N m s/rad."""
    total = 0.0
    for b in range(maxwell.time.shape[0]):
        total += maxwell.stiffness[b] * maxwell.time[b] * (1.0 - exp(-step / maxwell.time[b]))
    return total


@kernel
def advance_maxwell(model: Model, state: State, work: Work, row, maxwell):
    """Advance the moments over the last step; add its loss to ``state.work_done[row]``, and write ``joint_rate``."""
    if maxwell.time.shape[0] == 0:
        return
    rate, lost, h = work.joint_rate, work.joint_loss, model.step
    joint_differences(state.rate, rate)
    lost[:] = 0.0
    for b in range(maxwell.time.shape[0]):  # the inner loop vectorizes with one loss per joint
        k, time = maxwell.stiffness[b], maxwell.time[b]
        decay = exp(-h / time)
        squared, mixed, decayed = h / (k * time), 2.0 * (1.0 - decay) / k, (1.0 - decay * decay) / (2.0 * k)
        for i in range(rate.shape[0]):
            steady = k * time * rate[i]
            far = state.maxwell[b, i] - steady
            state.maxwell[b, i] = steady + decay * far
            lost[i] += steady * (squared * steady + mixed * far) + decayed * far * far
    loss = 0.0
    for i in range(lost.shape[0]):
        loss += lost[i]
    state.work_done[row] += loss


@kernel
def maxwell_rates(state: State, work: Work, out, first, row, maxwell):
    """Write the rates of the moments after the powers in ``out[first:]``; add the loss to entry ``row`` of these."""
    n, behind = state.maxwell.shape[1], first + state.work_done.shape[0]
    for b in range(maxwell.time.shape[0]):
        k, time = maxwell.stiffness[b], maxwell.time[b]
        for i in range(n):
            moment = state.maxwell[b, i]
            out[behind + b * n + i] = k * work.joint_rate[i] - moment / time
            out[first + row] += moment * moment / (k * time)


@kernel
def maxwell_energy(state: State, maxwell):
    """Return the energy in the springs of the Maxwell elements, J."""
    total = 0.0
    for b in range(maxwell.time.shape[0]):
        for i in range(state.maxwell.shape[1]):
            total += state.maxwell[b, i] * state.maxwell[b, i] / (2.0 * maxwell.stiffness[b])
    return total

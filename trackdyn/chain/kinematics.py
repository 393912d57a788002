"""Pins, mass centres and bushing torques along the chain (relative coordinates, Eq. 6 in the plane)."""

from math import cos as cosine
from math import sin as sine
from math import tanh

import numpy as np

from trackdyn.jit import kernel
from trackdyn.model.constants import Chain, Wheels


@kernel
def orient(angle, cos, sin):
    """Cosine and sine of every body's angle."""
    for i in range(angle.shape[0]):
        cos[i] = cosine(angle[i])
        sin[i] = sine(angle[i])


@kernel
def forward_kinematics(chain: Chain, state, work):
    """Pins and velocities of the mass centres along the chain, gap of the cut joint and its rate."""
    x, y, vx, vy = state.pin[0], state.pin[1], state.pin[2], state.pin[3]
    for i in range(state.angle.shape[0]):
        c, s, w = work.cos[i], work.sin[i], state.rate[i]
        work.pin_x[i] = x
        work.pin_y[i] = y
        gx = chain.com_x[i] * c - chain.com_y[i] * s
        gy = chain.com_x[i] * s + chain.com_y[i] * c
        work.com_vx[i] = vx - w * gy
        work.com_vy[i] = vy + w * gx
        dx = chain.length[i] * c
        dy = chain.length[i] * s
        x += dx
        y += dy
        vx -= w * dy
        vy += w * dx
    work.pin_x[-1] = x
    work.pin_y[-1] = y
    work.cut[0] = x - state.pin[0]
    work.cut[1] = y - state.pin[1]
    work.cut[2] = vx - state.pin[2]
    work.cut[3] = vy - state.pin[3]


@kernel
def damping_weight(chain: Chain, step):
    """Part of a step at which the damping torque of the bushings is taken: half, for its error is of second order
    there.

    Later where the fastest decay, links and connectors in zigzag with their mass centres at rest, would overshoot:
    it ends at zero then (`limits.step_limits`).
    """
    a, b = chain.length[0], chain.length[1]
    mobility = 2.0 * (a + b) ** 2 / (chain.inertia[0] * b * b + chain.inertia[1] * a * a)
    decay = step * chain.damping * mobility
    return 0.5 if decay <= 2.0 else 1.0 - 1.0 / decay


@kernel
def bushing_torques(chain: Chain, state, work, ahead=0.0):
    """Torque of every bushing and the joint rates it was taken at; the spring ``ahead`` seconds later (s)."""
    last = state.angle.shape[0] - 1
    for i in range(last):
        work.joint_rate[i] = state.rate[i + 1] - state.rate[i]
    work.joint_rate[last] = state.rate[0] - state.rate[last]
    for i in range(last):
        work.torque[i] = state.angle[i + 1] - state.angle[i]
    # a clockwise loop: angles fall by one turn along the chain
    work.torque[last] = state.angle[0] - state.angle[last] - 2.0 * np.pi
    for i in range(last + 1):
        rate = work.joint_rate[i]
        work.torque[i] = -chain.stiffness * (work.torque[i] + ahead * rate - chain.free_angle) - chain.damping * rate


# rate below which a torque of Coulomb friction or rolling resistance fades, rad/s: a twentieth of the slowest running
SLOW = 0.1


@kernel
def bearing_drag(wheels: Wheels, wheel, rate, carried):
    """Torque against a wheel's rotation over its rate (rad/s), N m s/rad.

    A viscous term, and the secant of a torque that fades below ``SLOW``: a constant one, and that of rolling
    resistance, ``rolling`` times the sum of the links' normal forces (``carried``, (w,), N).
    """
    drag, torque = wheels.drag[wheel], wheels.torque[wheel] + wheels.rolling[wheel] * carried[wheel]
    if torque > 0.0:
        turning = max(abs(rate), 1e-6 * SLOW)
        drag += torque * tanh(turning / SLOW) / turning
    return drag

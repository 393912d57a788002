"""The loop in space: all its pins are parallel, so it moves in a plane of its own, and the plane moves too.

The plane is described by a frame P: origin in the input pin of body 1, z axis normal to the plane,
attitude ``A_P`` (P to inertial) by Euler parameters, and an angular velocity ``(p, q, 0)`` in P components,
which has no part about the normal. What lies in the plane is then described exactly as in planar motion;
body i has the angular velocity ``(p, q, w_i)`` in P components. Seventy-three degrees of freedom: those of
the planar chain and three of the plane (B.1).

All vectors are held in P components, positions counted from the inertial origin (``A_P^T R``): the pin's
position and velocity are ``(pin[0], pin[1], motion[0])`` and ``(pin[2], pin[3], motion[1])``. They turn
back when P turns (`turn_plane`); a plane at rest adds exact zeros to the planar motion.

With ``r = (x, y, 0)`` from the pin, ``u = p y - q x`` and ``A_0`` the acceleration of the pin,

    v = V + (x', y', u)
    a = A_0 + (x'' + q u, y'' - p u, p' y - q' x + 2 (p y' - q x')).

The bodies are symmetric about the plane: mass centre in it, principal axes along the pin line, along its
normal and along the pin. With ``L = (I_perp (p, q), J_z w)``, ``I_perp = A_z diag(J_x, J_y) A_z^T``:

    L_x' + q L_z = M_x,   L_y' - p L_z = M_y,   J_z w' + p L_y - q L_x = M_z.

In the plane that is the planar chain under extra loads. Across it, joint loads are internal to the loop:
the sums of the z forces and of the moments about the pin's x and y axes give ``(A_0z, p', q')``.
"""

from math import sin as sine
from math import sqrt
from typing import NamedTuple

import numpy as np

from trackdyn.chain.model import Chain
from trackdyn.jit import kernel

OFFSET, SPEED, P, Q = range(4)  # entries of the plane's motion
TOOTH, RING, WHEEL = range(3)  # kinds of surface
TANGENTIAL, INDEPENDENT, ISOTROPIC = range(3)  # kinds of friction


class Space(NamedTuple):
    """What motion in space needs beyond the planar model; constant during a run.

    Attributes
    ----------
    along, across : (n,) arrays
        Principal moments of inertia of the bodies about their x axis (pin line) and y axis (normal
        of the track), kg m2; the third one is that of the planar chain.
    frame : (w, 3, 3) array
        ``A_W`` of every wheel: its frame, which does not spin, to the inertial one; z is its axis.
    centre : (w, 3) array
        Centres of the wheels in their own frames, ``A_W^T R_W``, m.
    length, overhang : (3,) arrays
        Contact length and the shift before the overlap of Eq. 19 shrinks, of teeth, ring and wheels, m.
    guide_reach : (w,) array
        Distance from the wheel's axis up to which the middle of a connector is between its flanges, m.
    clearance, stiffness, damping : float
        Play of a centre guide to either side (m), and its spring and damper beyond (N/m, N s/m).
    friction : int
        ``TANGENTIAL`` (no axial friction), ``INDEPENDENT`` (Eqs. 10 and 11 each for itself) or
        ``ISOTROPIC`` (one coefficient of the whole slip).
    """

    along: np.ndarray
    across: np.ndarray
    frame: np.ndarray
    centre: np.ndarray
    length: np.ndarray
    overhang: np.ndarray
    guide_reach: np.ndarray
    clearance: float
    stiffness: float
    damping: float
    friction: int


class Plane(NamedTuple):
    """State of the plane of the chain.

    Attributes
    ----------
    motion : (4,) array
        Offset and speed of the plane along its normal (m, m/s): z components of the pin's position
        and velocity; its angular velocities p and q (rad/s). All in P components.
    attitude : (4,) array
        Euler parameters of ``A_P``, the scalar first.
    """

    motion: np.ndarray
    attitude: np.ndarray


class SpaceWork(NamedTuple):
    """Arrays that a step overwrites.

    ``attitude`` is ``A_P``; ``relative`` holds ``A_W^T A_P`` of every wheel (P to wheel), ``centre`` the
    wheels' centres in P. ``gravity`` is in P components, m/s2. ``force_z``, ``moment_x``, ``moment_y``
    are the loads across the plane on the bodies about their mass centres. ``acceleration`` is
    ``(A_0z, p', q')``, ``change`` what the last step added to ``(V_z, p, q)``. ``wheel_load`` is the
    reaction on every wheel: force and moment about its centre in its own frame. ``contact`` holds a row a
    contact, in P components: normal force (3), friction (3), arm from the mass centre (3), velocity of
    the body's point (3), velocity of the wheel's point at unit rate (3), wheel rate, x and y from
    the pin; ``contact_body`` body, wheel and kind (0 surface, 1 tooth, 2 guide). ``axial`` is the sum of
    the axial forces on the wheels over the sample.
    """

    attitude: np.ndarray
    relative: np.ndarray
    centre: np.ndarray
    gravity: np.ndarray
    force_z: np.ndarray
    moment_x: np.ndarray
    moment_y: np.ndarray
    acceleration: np.ndarray
    change: np.ndarray
    wheel_load: np.ndarray
    contact: np.ndarray
    contact_body: np.ndarray
    count: np.ndarray
    axial: np.ndarray


class PlaneRecord(NamedTuple):
    """Out-of-plane part of a record, one row a sample.

    Attributes
    ----------
    motion : (s, 8) array
        Offset (m), speed (m/s), p, q (rad/s) and the Euler parameters of the plane.
    offset : (s, w) array
        Where the plane of the chain crosses the axis of every wheel, from its middle, m.
    axial : (s, w) array
        Force on every wheel along its axis, mean over the sample, N.
    """

    motion: np.ndarray
    offset: np.ndarray
    axial: np.ndarray


class Spatial(NamedTuple):
    """Constants, state, work and record of the motion in space."""

    space: Space
    plane: Plane
    work: SpaceWork
    record: PlaneRecord


def make_space_work(n: int, wheels: int, pitches: int) -> SpaceWork:
    """Allocate the arrays of a step for ``n`` bodies, ``wheels`` wheels and ``pitches`` pitches."""
    contacts = 2 * pitches * (1 + wheels)
    return SpaceWork(
        np.eye(3),
        np.zeros((wheels, 3, 3)),
        np.zeros((wheels, 3)),
        *(np.zeros(3) for _ in range(1)),
        *(np.zeros(n) for _ in range(3)),
        *(np.zeros(3) for _ in range(2)),
        np.zeros((wheels, 6)),
        np.zeros((contacts, 18)),
        np.zeros((contacts, 3), np.int64),
        np.zeros(1, np.int64),
        np.zeros(wheels),
    )


def make_plane_record(samples: int, wheels: int) -> PlaneRecord:
    """Allocate the out-of-plane part of a record."""
    return PlaneRecord(np.zeros((samples, 8)), np.zeros((samples, wheels)), np.zeros((samples, wheels)))


@kernel
def aim(space: Space, plane: Plane, gravity, work: SpaceWork):
    """Rotation matrices, wheel centres and gravity as seen from the plane."""
    e, a = plane.attitude, work.attitude
    e0, e1, e2, e3 = e[0], e[1], e[2], e[3]
    a[0, 0] = 1.0 - 2.0 * (e2 * e2 + e3 * e3)
    a[1, 1] = 1.0 - 2.0 * (e1 * e1 + e3 * e3)
    a[2, 2] = 1.0 - 2.0 * (e1 * e1 + e2 * e2)
    a[0, 1] = 2.0 * (e1 * e2 - e0 * e3)
    a[1, 0] = 2.0 * (e1 * e2 + e0 * e3)
    a[0, 2] = 2.0 * (e1 * e3 + e0 * e2)
    a[2, 0] = 2.0 * (e1 * e3 - e0 * e2)
    a[1, 2] = 2.0 * (e2 * e3 - e0 * e1)
    a[2, 1] = 2.0 * (e2 * e3 + e0 * e1)
    f, b, c = space.frame, work.relative, space.centre
    for w in range(f.shape[0]):
        for i in range(3):
            for j in range(3):
                b[w, i, j] = f[w, 0, i] * a[0, j] + f[w, 1, i] * a[1, j] + f[w, 2, i] * a[2, j]
        for j in range(3):
            work.centre[w, j] = b[w, 0, j] * c[w, 0] + b[w, 1, j] * c[w, 1] + b[w, 2, j] * c[w, 2]
    for j in range(3):
        work.gravity[j] = -gravity * a[1, j]


@kernel
def plane_dynamics(chain: Chain, space: Space, plane: Plane, state, planar, work: SpaceWork):
    """Add the loads that the moving plane puts on the planar chain, and solve for the plane's accelerations.

    Parameters
    ----------
    state, planar
        Planar state and work arrays (`trackdyn.model`): the loads in ``planar`` are added to.

    Notes
    -----
    ``(A_0z, p', q')`` solve the symmetric positive definite system of the sums over all bodies of
    ``[m, m y, -m x; ., m y^2 + I_xx, I_xy - m x y; ., ., m x^2 + I_yy]``; its right-hand side is the
    loads less Coriolis forces, less the change of ``I_perp`` as the bodies turn in the plane and less the
    turn of their angular momentum with the plane.
    """
    p, q = plane.motion[P], plane.motion[Q]
    gx, gz = work.gravity[0], work.gravity[2]
    gy = work.gravity[1] + chain.gravity  # the planar chain has its own gravity
    m00 = m01 = m02 = m11 = m12 = m22 = 0.0
    f0 = f1 = f2 = 0.0
    for i in range(state.rate.shape[0]):
        c, s, w, m = planar.cos[i], planar.sin[i], state.rate[i], chain.mass[i]
        x = planar.pin_x[i] - state.pin[0] + (chain.com_x[i] * c - chain.com_y[i] * s)
        y = planar.pin_y[i] - state.pin[1] + (chain.com_x[i] * s + chain.com_y[i] * c)
        ixx = space.along[i] * c * c + space.across[i] * s * s
        iyy = space.along[i] * s * s + space.across[i] * c * c
        ixy = (space.along[i] - space.across[i]) * s * c
        lx = ixx * p + ixy * q
        ly = ixy * p + iyy * q
        lz = chain.inertia[i] * w
        u = p * y - q * x
        planar.force_x[i] += m * (gx - q * u)
        planar.force_y[i] += m * (gy + p * u)
        planar.moment[i] -= p * ly - q * lx
        # I_perp' = w (A_z' diag A_z^T + ...): I_xx' = -2 w I_xy, I_yy' = 2 w I_xy, I_xy' = w (I_xx - I_yy)
        turn_x = w * (-2.0 * ixy * p + (ixx - iyy) * q)
        turn_y = w * ((ixx - iyy) * p + 2.0 * ixy * q)
        fz = work.force_z[i] + m * gz
        fz -= 2.0 * m * (p * (planar.com_vy[i] - state.pin[3]) - q * (planar.com_vx[i] - state.pin[2]))
        f0 += fz
        f1 += work.moment_x[i] + y * fz - turn_x - q * lz
        f2 += work.moment_y[i] - x * fz - turn_y + p * lz
        m00 += m
        m01 += m * y
        m02 -= m * x
        m11 += m * y * y + ixx
        m12 += ixy - m * x * y
        m22 += m * x * x + iyy
    l00 = sqrt(m00)
    l10 = m01 / l00
    l20 = m02 / l00
    l11 = sqrt(m11 - l10 * l10)
    l21 = (m12 - l20 * l10) / l11
    l22 = sqrt(m22 - l20 * l20 - l21 * l21)
    f0 /= l00
    f1 = (f1 - l10 * f0) / l11
    f2 = (f2 - l20 * f0 - l21 * f1) / l22
    f2 /= l22
    f1 = (f1 - l21 * f2) / l11
    work.acceleration[0] = (f0 - l10 * f1 - l20 * f2) / l00
    work.acceleration[1] = f1
    work.acceleration[2] = f2


@kernel
def turn_plane(plane: Plane, state, work: SpaceWork, step):
    """Advance the plane by semi-implicit Euler, the pin's place and velocity in the plane being advanced.

    Velocities first, then the offset and the attitude by the exact rotation ``exp(h (p, q, 0))``; the
    components of the pin's place and velocity are turned back by it.
    """
    motion, e = plane.motion, plane.attitude
    for k in range(3):
        work.change[k] = step * work.acceleration[k]
        motion[SPEED + k] += work.change[k]
    motion[OFFSET] += step * motion[SPEED]
    p, q = motion[P], motion[Q]
    omega = sqrt(p * p + q * q)
    if omega == 0.0:
        return
    half = sine(0.5 * step * omega)
    first = sine(step * omega) / omega
    second = 2.0 * half * half / (omega * omega)
    for k in range(2):  # place, velocity: v - first (Omega x v) + second (Omega x (Omega x v))
        x, y, z = state.pin[2 * k], state.pin[2 * k + 1], motion[k]
        u = p * y - q * x
        state.pin[2 * k] = x - first * q * z + second * q * u
        state.pin[2 * k + 1] = y + first * p * z - second * p * u
        motion[k] = z - first * u - second * omega * omega * z
    c = sqrt(1.0 - half * half)
    d1 = half * p / omega
    d2 = half * q / omega
    e0, e1, e2, e3 = e[0], e[1], e[2], e[3]
    e[0] = e0 * c - e1 * d1 - e2 * d2
    e[1] = e1 * c + e0 * d1 - e3 * d2
    e[2] = e2 * c + e0 * d2 + e3 * d1
    e[3] = e3 * c + e1 * d2 - e2 * d1
    norm = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3])
    for k in range(4):
        e[k] /= norm

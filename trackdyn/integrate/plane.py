"""Motion of the loop in space: all its pins are parallel, so it moves in a plane of its own, and the plane moves too.

The plane has a frame P: origin in the input pin of body 1, z axis normal to the plane, attitude ``A_P`` (P to inertial)
by Euler parameters, and an angular velocity ``(p, q, 0)`` in P components, without rotation about the normal. Motion
within the plane is described as planar motion; body i has the angular velocity ``(p, q, w_i)`` in P components.
Seventy-three degrees of freedom: those of the planar chain and three of the plane (B.1).

Vectors are in P components, positions from the inertial origin (``A_P^T R``): the pin's position and velocity are
``(pin[0], pin[1], motion[0])`` and ``(pin[2], pin[3], motion[1])``. They turn back when P turns (`turn_plane`); a plane
at rest adds exact zeros to the planar motion.

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

from trackdyn.chain.kinematics import mass_centre
from trackdyn.chain.riccati import factored, solve_factored
from trackdyn.jit import fused, kernel, summed
from trackdyn.model.arrays import OFFSET, SPEED, P, Q, SpaceWork, State, Work
from trackdyn.model.constants import Model


@kernel
def update_frame(model: Model, state: State, space: SpaceWork):
    """Write rotation matrices, wheel centres and gravity in the plane's frame."""
    e, a = state.plane.attitude, space.attitude
    e0, e1, e2, e3 = e[0], e[1], e[2], e[3]
    a[0, 0] = 1.0 - 2.0 * (e2 * e2 + e3 * e3)
    a[1, 1] = 1.0 - 2.0 * (e1 * e1 + e3 * e3)
    a[2, 2] = 1.0 - 2.0 * (e1 * e1 + e2 * e2)
    a[0, 1], a[1, 0] = 2.0 * (e1 * e2 - e0 * e3), 2.0 * (e1 * e2 + e0 * e3)
    a[0, 2], a[2, 0] = 2.0 * (e1 * e3 + e0 * e2), 2.0 * (e1 * e3 - e0 * e2)
    a[1, 2], a[2, 1] = 2.0 * (e2 * e3 - e0 * e1), 2.0 * (e2 * e3 + e0 * e1)
    f, b, c = model.space.frame, space.relative, model.space.centre
    for w in range(f.shape[0]):
        for i in range(3):
            for j in range(3):
                b[w, i, j] = f[w, 0, i] * a[0, j] + f[w, 1, i] * a[1, j] + f[w, 2, i] * a[2, j]
        for j in range(3):
            space.centre[w, j] = b[w, 0, j] * c[w, 0] + b[w, 1, j] * c[w, 1] + b[w, 2, j] * c[w, 2]
    for j in range(3):
        space.gravity[j] = -model.chain.gravity * a[1, j]


@summed
def plane_sums(model: Model, state: State, work: Work, space: SpaceWork):
    """Return sums over all bodies of the plane's inertia and of the loads on it (`plane_dynamics`)."""
    chain, p, q = model.chain, state.plane.motion[P], state.plane.motion[Q]
    along, across, mass, inertia = model.space.along, model.space.across, chain.mass, chain.inertia
    cos, sin, rate, pin_x, pin_y = work.cos, work.sin, state.rate, work.pin_x, work.pin_y
    vx, vy, force_z, moment_x, moment_y = work.com_vx, work.com_vy, space.force_z, space.moment_x, space.moment_y
    px, py, pvx, pvy = state.pin[0], state.pin[1], state.pin[2], state.pin[3]
    gz = space.gravity[2]
    m00 = m01 = m02 = m11 = m12 = m22 = 0.0
    f0 = f1 = f2 = 0.0
    for i in range(rate.shape[0]):
        c, s, w, m = cos[i], sin[i], rate[i], mass[i]
        gx, gy = mass_centre(chain, work, i)
        x, y = pin_x[i] - px + gx, pin_y[i] - py + gy
        ixx, iyy = along[i] * c * c + across[i] * s * s, along[i] * s * s + across[i] * c * c
        ixy = (along[i] - across[i]) * s * c
        lz = inertia[i] * w
        # I_perp' = w (A_z' diag A_z^T + ...): I_xx' = -2 w I_xy, I_yy' = 2 w I_xy, I_xy' = w (I_xx - I_yy)
        change_x = w * (-2.0 * ixy * p + (ixx - iyy) * q)
        change_y = w * ((ixx - iyy) * p + 2.0 * ixy * q)
        fz = force_z[i] + m * gz - 2.0 * m * (p * (vy[i] - pvy) - q * (vx[i] - pvx))
        f0 += fz
        f1 += moment_x[i] + y * fz - change_x - q * lz
        f2 += moment_y[i] - x * fz - change_y + p * lz
        m00 += m
        m01 += m * y
        m02 -= m * x
        m11 += m * y * y + ixx
        m12 += ixy - m * x * y
        m22 += m * x * x + iyy
    return m00, m01, m02, m11, m12, m22, f0, f1, f2


@fused
def plane_dynamics(model: Model, state: State, work: Work, space: SpaceWork):
    """Add the loads of the moving plane on the planar chain, and solve for the plane's accelerations.

    ``(A_0z, p', q')`` solve the symmetric positive definite system of the sums over all bodies of ``[m, m y, -m x; ., m
    y^2 + I_xx, I_xy - m x y; ., ., m x^2 + I_yy]``; its right-hand side is the loads less Coriolis forces, less the
    change of ``I_perp`` as the bodies turn in the plane and less the turn of their angular momentum with the plane.
    """
    m00, m01, m02, m11, m12, m22, f0, f1, f2 = plane_sums(model, state, work, space)
    chain, p, q = model.chain, state.plane.motion[P], state.plane.motion[Q]
    gravity_x, gravity_y = space.gravity[0], space.gravity[1] + chain.gravity  # the planar chain has its own gravity
    for i in range(state.rate.shape[0]):
        c, s, m = work.cos[i], work.sin[i], chain.mass[i]
        gx, gy = mass_centre(chain, work, i)
        x, y = work.pin_x[i] - state.pin[0] + gx, work.pin_y[i] - state.pin[1] + gy
        u = p * y - q * x
        work.force_x[i] += m * (gravity_x - q * u)
        work.force_y[i] += m * (gravity_y + p * u)
        # p L_y - q L_x
        a, b = model.space.along[i], model.space.across[i]
        work.moment[i] -= (a - b) * (s * c * (p * p - q * q) + (s * s - c * c) * p * q)
    factor = factored(m00, m01, m02, m11, m12, m22)
    for k, acceleration in enumerate(solve_factored(factor, (f0, f1, f2))):
        space.acceleration[k] = acceleration


@kernel
def turn_plane(model: Model, state: State, space: SpaceWork):
    """Advance the plane by semi-implicit Euler, after the pin's position and velocity in the plane.

    Velocities come first, then offset and attitude by the exact rotation ``exp(h (p, q, 0))``; it turns the components
    of the pin's position and velocity back.
    """
    motion, e, step = state.plane.motion, state.plane.attitude, model.step
    for k in range(3):
        space.change[k] = step * space.acceleration[k]
        motion[SPEED + k] += space.change[k]
    motion[OFFSET] += step * motion[SPEED]
    p, q = motion[P], motion[Q]
    omega = sqrt(p * p + q * q)
    if omega == 0.0:
        return
    half = sine(0.5 * step * omega)
    first, second = sine(step * omega) / omega, 2.0 * half * half / (omega * omega)
    for k in range(2):  # position, velocity: v - first (Omega x v) + second (Omega x (Omega x v))
        x, y, z = state.pin[2 * k], state.pin[2 * k + 1], motion[k]
        u = p * y - q * x
        state.pin[2 * k] = x - first * q * z + second * q * u
        state.pin[2 * k + 1] = y + first * p * z - second * p * u
        motion[k] = z - first * u - second * omega * omega * z
    c, d1, d2 = sqrt(1.0 - half * half), half * p / omega, half * q / omega
    e0, e1, e2, e3 = e[0], e[1], e[2], e[3]
    e[0] = e0 * c - e1 * d1 - e2 * d2
    e[1] = e1 * c + e0 * d1 - e3 * d2
    e[2] = e2 * c + e0 * d2 + e3 * d1
    e[3] = e3 * c + e1 * d2 - e2 * d1
    norm = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3])
    for k in range(4):
        e[k] /= norm

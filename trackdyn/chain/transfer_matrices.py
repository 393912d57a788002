"""Forward dynamics of the closed chain by the product of all transfer matrices, as the paper prints it (Eqs. 1-5, 7).

Every element, body or joint, maps ``z = [r'' (3), Omega' (3), m (3), q (3), 1]`` (Eq. 1) of its input to that of its
output, ``z_O = U z_I``: acceleration of the junction, angular acceleration of the body, moment and force through the
junction, in the inertial frame. (m, q) act at an input and (-m, -q) at an output, so that one element's output is the
next one's input. Body 1 is element 1, the joint behind it element 2; element 2 n is the joint that is cut (70 in the
paper). The product of elements 1 to 2 n - 1 relates both sides of the cut (Eqs. 2-5), boundary conditions and closure
give the state at the input of body 1, and multiplication every other state. `accelerations` takes the planar chain in z
= 0. Its errors grow by about `growth` a body: it serves short chains and shows why longer ones need
`trackdyn.chain.riccati`, which uses the same matrices.
"""

from typing import NamedTuple

import numpy as np

from trackdyn.jit import allocating as kernel
from trackdyn.model.constants import Chain
from trackdyn.model.work import Work

STATES = 13


@kernel
def skew(v):
    """(3, 3) matrix of the cross product: ``skew(v) @ w = v x w``, for (3,) ``v``."""
    out = np.zeros((3, 3))
    out[0, 1] = -v[2]
    out[0, 2] = v[1]
    out[1, 0] = v[2]
    out[1, 2] = -v[0]
    out[2, 0] = -v[1]
    out[2, 1] = v[0]
    return out


@kernel
def body_matrix(mass, inertia, r_ic, r_io, omega, force, moment, out):
    """Transfer matrix ``out`` (13, 13) of a rigid body with one input and one output.

    ``inertia`` (3, 3) is about the mass centre in the inertial frame, kg m2; ``r_ic`` and ``r_io`` lead from the input
    to the mass centre and to the output, m; ``omega`` is the angular velocity, rad/s; ``force`` (N) and ``moment`` (N
    m, about the mass centre) are resultants of the external loads with gravity.

    Rows of ``r''`` and ``Omega'``: motion of a rigid body. Rows of ``q``: Newton's law. Rows of ``m``: Euler's law
    about the mass centre, with ``q`` of the output replaced by the rows above it.
    """
    r_co = r_io - r_ic
    input_to_output = skew(r_io)
    centre_to_output = skew(r_co)
    spin = skew(omega)
    centripetal = spin @ (spin @ r_ic)
    mass_term = mass * centre_to_output
    inertia_term = inertia + mass_term @ skew(r_ic)

    out[:, :] = 0.0
    for k in range(STATES):
        out[k, k] = 1.0
    out[0:3, 3:6] = -input_to_output
    out[0:3, 12] = spin @ (spin @ r_io)

    out[6:9, 0:3] = mass_term
    out[6:9, 3:6] = -inertia_term
    out[6:9, 9:12] = -input_to_output
    out[6:9, 12] = moment - spin @ (inertia @ omega) + mass_term @ centripetal - centre_to_output @ force

    out[9:12, 3:6] = mass * skew(r_ic)
    out[9:12, 12] = force - mass * centripetal
    for k in range(3):
        out[9 + k, k] = -mass


@kernel
def joint_matrix(next_body, axis, axis_next, zeta, torque_next, out):
    """Transfer matrix ``out`` (13, 13) of a smooth revolute joint whose bushing turns about the axis.

    ``next_body`` is the `body_matrix` of the outboard body, between this joint and the next one, ``axis`` and
    ``axis_next`` are their unit axes, ``zeta = Omega_I x axis * phi'`` (rad/s2) with the joint's rate ``phi'``, and
    ``torque_next`` is that of the next joint on its outboard body along ``axis_next``, N m.

    ``Omega'_O = Omega'_I + axis phi'' + zeta``; everything else passes unchanged. ``phi''`` follows from the torque
    condition at the next joint, ``axis_next . m = torque_next`` behind the outboard body, and so is linear in the
    state: ``phi'' = -(u [z + zeta] - torque_next) / D`` with ``u`` the row of that moment and ``D`` its coefficient of
    ``phi''``. ``D`` is zero, and the matrix infinite, where the axes are parallel and each pin is the other's centre of
    percussion. The condition of the first joint is used by no element: it belongs to the boundary conditions.
    """
    row = np.zeros(STATES)
    for k in range(STATES):
        for i in range(3):
            row[k] += axis_next[i] * next_body[6 + i, k]
    d = 0.0
    row_zeta = 0.0
    for i in range(3):
        d += row[3 + i] * axis[i]
        row_zeta += row[3 + i] * zeta[i]

    out[:, :] = 0.0
    for k in range(STATES):
        out[k, k] = 1.0
    for i in range(3):
        for k in range(STATES):
            out[3 + i, k] -= axis[i] * row[k] / d
        out[3 + i, 12] += zeta[i] + axis[i] * (torque_next - row_zeta) / d


@kernel
def joint_acceleration(axis, state_in, state_out):
    """Joint acceleration phi'' (rad/s2) from the (13,) states on both sides of a joint (Eq. 7).

    The gyroscopic part of Eq. 7 has no component along the (3,) unit ``axis`` and is left out.
    """
    phi = 0.0
    for i in range(3):
        phi += axis[i] * (state_out[3 + i] - state_in[3 + i])
    return phi


@kernel
def fill_elements(chain: Chain, state, work: Work, elements):
    """Transfer matrices of elements 1 to 2 n - 1 of the planar chain, cut at joint 2 n.

    Of ``elements`` (2 n - 1, 13, 13), body i (from 0) is ``elements[2 i]``, the joint behind it ``elements[2 i + 1]``;
    parameters as in `accelerations`.
    """
    rate, force_x, force_y = state.rate, work.force_x, work.force_y
    n = rate.shape[0]
    axis = np.array([0.0, 0.0, 1.0])
    for i in range(n):
        c, s = work.cos[i], work.sin[i]
        x, y = chain.com_x[i], chain.com_y[i]
        r_ic = np.array([c * x - s * y, s * x + c * y, 0.0])
        r_io = np.array([c * chain.length[i], s * chain.length[i], 0.0])
        force = np.array([force_x[i], force_y[i] - chain.mass[i] * chain.gravity, 0.0])
        # Nothing turns out of the plane: the two transverse moments of inertia cannot matter.
        inertia = chain.inertia[i] * np.eye(3)
        omega = rate[i] * axis
        body_matrix(chain.mass[i], inertia, r_ic, r_io, omega, force, work.moment[i] * axis, elements[2 * i])
    for i in range(n - 1):
        # the angular velocity is parallel to the axis, so that zeta vanishes in the plane
        zeta = skew(rate[i] * axis) @ axis * (rate[i + 1] - rate[i])
        joint_matrix(elements[2 * i + 2], axis, axis, zeta, work.torque[i + 1], elements[2 * i + 1])


@kernel
def multiply(elements):
    """(13, 13) product ``U_{2n-1} ... U_2 U_1`` of (2 n - 1, 13, 13) ``elements`` (Eq. 5)."""
    product = elements[0].copy()
    for k in range(1, elements.shape[0]):
        product = elements[k] @ product
    return product


@kernel
def solve_boundaries(product, first_body, torque_first, torque_cut):
    """States (13, 3) at the input of body 1 that satisfy boundary conditions and closure (Eqs. 2-5).

    ``product`` is that of `multiply`, ``first_body`` the matrix of body 1; bushing torques of the first joint and of
    the cut one in N m. Columns 0 and 1 of the result are the homogeneous chain whose two sides of the cut part with the
    acceleration (1, 0) and (0, 1) m/s2, their last entry is 0; column 2 is the chain with its loads, closed. Raises
    `numpy.linalg.LinAlgError`: the product overflowed or the conditions are dependent.

    Twelve unknowns, ``x = [r''_1, Omega'_1]`` and the load through the cut ``[m, q]``, which is the same on both sides.
    Twelve rows: two of the three moments and the three forces at the output of the last body (its moment along the axis
    was used by the last joint), the torque of the first joint, the torque of the cut, and its kinematics. Of these,
    three are satisfied by any planar chain: position along z and the two alignments of the axes. Their loads are
    indeterminate and set to zero; the motion does not depend on them.
    """
    matrix = np.zeros((12, 12))
    right = np.zeros((12, 3))
    # z_O - z_I of the through-load: rows m_x, m_y, q_x, q_y, q_z
    for k in range(5):
        row = 6 + k if k < 2 else 7 + k
        for j in range(12):
            matrix[k, j] = product[row, j]
        matrix[k, row] -= 1.0
        right[k, 2] = -product[row, 12]
    # the first joint's torque condition, along z
    for j in range(12):
        matrix[5, j] = first_body[8, j]
    right[5, 2] = torque_first - first_body[8, 12]
    # closure in the plane
    for k in range(2):
        for j in range(12):
            matrix[6 + k, j] = product[k, j]
        matrix[6 + k, k] -= 1.0
        right[6 + k, 2] = -product[k, 12]
        right[6 + k, k] = 1.0
    # the load through the cut: m_x = m_y = q_z = 0 and m_z = torque_cut
    matrix[8, 6] = 1.0
    matrix[9, 7] = 1.0
    matrix[10, 11] = 1.0
    matrix[11, 8] = 1.0
    right[11, 2] = torque_cut

    start = np.zeros((STATES, 3))
    start[:12] = np.linalg.solve(matrix, right)
    start[12, 2] = 1.0
    return start


@kernel
def accelerations(chain: Chain, state, work: Work, implicit_damping, probe_body):
    """Accelerations of the closed planar chain by the product of all transfer matrices.

    Parameters as in `riccati.accelerations`; the bushing torque is taken as it is, ``implicit_damping`` must be 0.
    Columns 0 and 1 of ``response``, ``base``, ``probe`` and ``end`` in ``work.sweep`` are the motions with unit closure
    acceleration in x and y, column 2 is zero, column 3 is the motion of the closed chain; ``load = [0, 0, 0, 1]`` and
    ``inverse = I`` belong to that. ``gain`` is left alone. Returned is ``[m, q]`` through the cut joint on body 1, N m
    and N. Raises `numpy.linalg.LinAlgError`: the product overflowed, a body's pins are mutual centres of percussion, or
    the conditions are dependent.
    """
    swept, torque = work.sweep, work.torque
    n = state.rate.shape[0]
    axis = np.array([0.0, 0.0, 1.0])
    elements = np.empty((2 * n - 1, STATES, STATES))
    fill_elements(chain, state, work, elements)
    start = solve_boundaries(multiply(elements), elements[0], torque[0], torque[n - 1])

    for array in (swept.base, swept.probe, swept.end, swept.inverse):
        array[:, :] = 0.0
    swept.response[:, 2] = 0.0
    for k in range(3):
        column = 3 if k == 2 else k
        at = start[:, k].copy()
        angular = at[5]
        for i in range(n):
            swept.response[i, column] = angular
            if i == 0:
                swept.base[0, column] = at[0]
                swept.base[1, column] = at[1]
            if i == probe_body:
                swept.probe[0, column] = at[0]
                swept.probe[1, column] = at[1]
            at = elements[2 * i] @ at
            if i < n - 1:
                outboard = elements[2 * i + 1] @ at
                angular += joint_acceleration(axis, at, outboard)
                at = outboard
        swept.end[0, column] = at[0]
        swept.end[1, column] = at[1]
        swept.end[2, column] = at[5]
    for k in range(3):
        swept.inverse[k, k] = 1.0
        swept.load[k] = 0.0
    swept.load[3] = 1.0
    return start[6:12, 2].copy()


class Growth(NamedTuple):
    """Factors by which the product of transfer matrices enlarges an error."""

    body: np.ndarray  # (n,) of each body alone
    pitch: float  # of the first two bodies together, which is the period of an alternating chain


def growth(chain: Chain) -> Growth:
    """Growth of an error along a straight chain of two bodies or more; inf where pins are mutual centres of percussion.

    Across a straight chain, one body from pin to pin maps transverse acceleration and force by a matrix of determinant
    1, so that its eigenvalues are ``mu`` and ``1 / mu``. With the distances ``a`` and ``b`` of the mass centre from the
    pins along the body, its offset ``e`` and the radius of gyration ``k``, ``|mu + 1 / mu| = (a^2 + b^2 + 2 (k^2 +
    e^2)) / |a b - k^2 - e^2|``. For a mass centre half-way between the pins this is ``|mu| = (a + k) / |a - k|``.
    Factors of different bodies do not simply multiply: that of a pitch is the largest eigenvalue of the product of its
    four matrices, body and joint twice.
    """
    ahead = chain.length - chain.com_x
    gyration = chain.inertia / chain.mass + chain.com_y**2
    with np.errstate(divide="ignore"):
        half_trace = 0.5 * (chain.com_x**2 + ahead**2 + 2.0 * gyration) / np.abs(chain.com_x * ahead - gyration)
    # the square root of half_trace^2 - 1, without overflow
    body = half_trace + np.sqrt(np.maximum(half_trace - 1.0, 0.0)) * np.sqrt(half_trace + 1.0)
    pitch = _straight_pitch(chain)
    if not np.isfinite(pitch).all():
        return Growth(body, np.inf)
    return Growth(body, float(np.abs(np.linalg.eigvals(pitch)).max()))


def _straight_pitch(chain):
    """(13, 13) product of the first two bodies and their joints, in a line, at rest and without loads."""
    axis, zero = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    bodies = np.empty((2, STATES, STATES))
    for i in range(2):
        r_ic = np.array([chain.com_x[i], chain.com_y[i], 0.0])
        r_io = np.array([chain.length[i], 0.0, 0.0])
        body_matrix(chain.mass[i], chain.inertia[i] * np.eye(3), r_ic, r_io, zero, zero, zero, bodies[i])
    product, joint = np.eye(STATES), np.empty((STATES, STATES))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for i in range(2):
            joint_matrix(bodies[1 - i], axis, axis, zero, 0.0, joint)
            product = joint @ bodies[i] @ product
    return product

"""Forward dynamics of the closed chain by the product of all transfer matrices, as the paper prints it (Eqs. 1-5, 7).

Every element, body or joint, maps ``z = [r'' (3), Omega' (3), m (3), q (3), 1]`` (Eq. 1) of its input to that of its
output, ``z_O = U z_I``: acceleration of the junction, angular acceleration of the body, moment and force through the
junction. (m, q) act at an input and (-m, -q) at an output. Body 1 is element 1, the joint behind it element 2; element
2 n is the joint that is cut. The product of elements 1 to 2 n - 1 relates both sides of the cut (Eqs. 2-5), boundary
conditions and closure give the state at the input of body 1. Its errors grow by about `growth` a body: it shows why
longer chains need `trackdyn.chain.riccati`.
"""

import numpy as np

from trackdyn.model.constants import Chain

STATES = 13
AXIS = np.array([0.0, 0.0, 1.0])  # axis of the joints of a planar chain


def skew(v: np.ndarray) -> np.ndarray:
    """Return the (3, 3) matrix of the cross product: ``skew(v) @ w = v x w``, for (3,) ``v``."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def body_matrix(mass, inertia, r_ic, r_io, omega, force, moment) -> np.ndarray:
    """Return the (13, 13) matrix of a rigid body; ``r_ic``, ``r_io`` lead from its input to mass centre and output.

    ``force`` and ``moment``, about the mass centre, are resultants of the external loads with gravity.
    """
    spin, centre_to_output = skew(omega), skew(r_io - r_ic)
    centripetal = spin @ (spin @ r_ic)
    out = np.eye(STATES)
    out[0:3, 3:6] = -skew(r_io)
    out[0:3, 12] = spin @ (spin @ r_io)
    # Euler's law about the mass centre, with q of the output by Newton's law below it
    out[6:9, 0:3] = mass * centre_to_output
    out[6:9, 3:6] = -inertia - mass * centre_to_output @ skew(r_ic)
    out[6:9, 9:12] = -skew(r_io)
    out[6:9, 12] = moment - spin @ (inertia @ omega) + centre_to_output @ (mass * centripetal - force)
    out[9:12, 0:3] = -mass * np.eye(3)
    out[9:12, 3:6] = mass * skew(r_ic)
    out[9:12, 12] = force - mass * centripetal
    return out


def joint_matrix(next_body, axis, axis_next, zeta, torque_next) -> np.ndarray:
    """Return the (13, 13) transfer matrix of a smooth revolute joint whose bushing turns about the axis.

    ``next_body`` is the `body_matrix` between this joint and the next one, and ``zeta = Omega_I x axis * phi'``.
    ``Omega'_O = Omega'_I + axis phi'' + zeta``; everything else passes unchanged. ``phi''`` follows from the torque
    condition behind the outboard body, ``axis_next . m = torque_next``: ``phi'' = -(u [z + zeta] - torque_next) / D``
    with ``u`` the row of that moment and ``D`` its coefficient of ``phi''``, zero between mutual centres of percussion.
    """
    row, out = axis_next @ next_body[6:9], np.eye(STATES)
    with np.errstate(divide="ignore", invalid="ignore"):
        d = row[3:6] @ axis
        out[3:6] -= np.outer(axis, row / d)
        out[3:6, 12] += zeta + axis * ((torque_next - row[3:6] @ zeta) / d)
    return out


def joint_acceleration(axis, state_in, state_out) -> float:
    """Return the joint acceleration phi'' from both states (Eq. 7), whose gyroscopic term is normal to the axis."""
    return float(axis @ (state_out[3:6] - state_in[3:6]))


def elements_of(chain: Chain, angle, rate, force_x, force_y, moment, torque) -> list[np.ndarray]:
    """Return transfer matrices of elements 1 to 2 n - 1 of a planar chain, cut at joint 2 n (`accelerations`)."""
    bodies = []
    for i in range(len(angle)):
        along = np.array([np.cos(angle[i]), np.sin(angle[i]), 0.0])
        r_ic = chain.com_x[i] * along + chain.com_y[i] * np.cross(AXIS, along)
        force = np.array([force_x[i], force_y[i] - chain.mass[i] * chain.gravity, 0.0])
        inertia = chain.inertia[i] * np.eye(3)
        arms = r_ic, chain.length[i] * along
        bodies.append(body_matrix(chain.mass[i], inertia, *arms, rate[i] * AXIS, force, moment[i] * AXIS))
    elements = [bodies[0]]
    for body, behind in zip(bodies[1:], torque[1:], strict=True):
        # the angular velocity is parallel to the axis, so that zeta vanishes in the plane
        elements += [joint_matrix(body, AXIS, AXIS, np.zeros(3), behind), body]
    return elements


def multiply(elements) -> np.ndarray:
    """Return the (13, 13) product ``U_{2n-1} ... U_2 U_1`` of the elements (Eq. 5)."""
    product = np.eye(STATES)
    for element in elements:
        product = element @ product
    return product


def solve_boundaries(product, first_body, torque_first, torque_cut) -> np.ndarray:
    """Return the (13,) state at the input of body 1 that satisfies boundary conditions and closure (Eqs. 2-5).

    Twelve unknowns, ``x = [r''_1, Omega'_1]`` and the load through the cut ``[m, q]``, which is the same on both sides.
    Twelve rows: two of the three moments and the three forces at the output of the last body (its moment along the axis
    was used by the last joint), the torque of the first joint, the torque of the cut, and its kinematics. Of these,
    any planar chain satisfies three: position along z and both alignments of the axes, whose loads are set to zero.
    """
    matrix, right = np.zeros((12, 12)), np.zeros(12)
    # z_O - z_I of the through-load m_x, m_y, q_x, q_y, q_z, and of the closure in the plane
    for k, row in enumerate((6, 7, 9, 10, 11, 0, 1)):
        matrix[k], right[k] = product[row, :12], -product[row, 12]
        matrix[k, row] -= 1.0
    matrix[7], right[7] = first_body[8, :12], torque_first - first_body[8, 12]  # torque of the first joint, along z
    # the load through the cut: m_x = m_y = q_z = 0 and m_z = torque_cut
    matrix[[8, 9, 10, 11], [6, 7, 11, 8]] = 1.0
    right[11] = torque_cut
    return np.append(np.linalg.solve(matrix, right), 1.0)


def accelerations(chain: Chain, angle, rate, force_x, force_y, moment, torque) -> tuple[np.ndarray, np.ndarray]:
    """Return the (n,) angular accelerations of a closed planar chain and the (13,) state at the input of body 1.

    Loads are at the mass centres without gravity and bushings; ``torque`` is that of the bushing behind every body on
    the outboard one. Raises `numpy.linalg.LinAlgError`: the product overflowed or the conditions are dependent.
    """
    elements = elements_of(chain, angle, rate, force_x, force_y, moment, torque)
    with np.errstate(invalid="ignore", over="ignore"):
        product = multiply(elements)
    start = state = solve_boundaries(product, elements[0], torque[0], torque[-1])
    alpha = [state[5]]
    for body, joint in zip(elements[::2], elements[1::2], strict=False):
        before = body @ state
        state = joint @ before
        alpha.append(alpha[-1] + joint_acceleration(AXIS, before, state))
    return np.array(alpha), start


def growth(chain: Chain) -> float:
    """Return the growth of an error over two bodies of a straight chain; inf if pins are mutual centres of percussion.

    One body from pin to pin maps transverse acceleration and force by a matrix of determinant 1, with eigenvalues
    ``mu`` and ``1 / mu``: for a mass centre half-way between the pins, at a distance ``a``, and a radius of gyration
    ``k``, ``|mu| = (a + k) / |a - k|``. Factors of different bodies do not simply multiply.
    """
    # at rest, without loads, and the joint behind the second body
    straight = chain._replace(**{name: getattr(chain, name)[[0, 1, 0]] for name in chain._fields[:5]}, gravity=0.0)
    with np.errstate(invalid="ignore", over="ignore"):
        product = multiply(elements_of(straight, *np.zeros((6, 3)))[:4])
    return float(np.abs(np.linalg.eigvals(product)).max()) if np.isfinite(product).all() else np.inf

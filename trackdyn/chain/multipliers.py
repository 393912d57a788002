"""Forward dynamics of the closed chain in absolute coordinates, one dense system a step.

    [ M  J^T ] [ q''     ]   [ Q     ]
    [ J   0  ] [ -lambda ] = [ gamma ],

three coordinates for every body (mass centre and angle) and two rows for every joint. It costs O(n^3)
and shares no step of the solution with the transfer matrices (Eqs. 1-5), only their results' layout.
"""

import numpy as np

from trackdyn.jit import allocating as kernel
from trackdyn.model.constants import Chain
from trackdyn.model.work import Work


@kernel
def accelerations(chain: Chain, state, work: Work, implicit_damping, probe_body):
    """Accelerations of the closed chain and its response to a violated closure.

    Returned is the force through the last joint on body 0, N. Parameters as in `riccati.accelerations`. Columns 0 and 1
    of ``response``, ``base``, ``probe`` and ``end`` in ``work.sweep`` are the motions without loads and velocities
    whose two sides of the last joint part with the acceleration (1, 0) and (0, 1) m/s2, column 2 is zero, column 3 is
    the motion of the closed chain; ``load = [0, 0, 0, 1]`` and ``inverse = I`` belong to that. ``gain`` is left alone.
    Raises `numpy.linalg.LinAlgError` where the constraints are dependent, for example in a chain folded into one
    straight line.
    """
    cos, sin, rate, swept = work.cos, work.sin, state.rate, work.sweep
    n = rate.shape[0]
    size = 5 * n
    matrix = np.zeros((size, size))
    right = np.zeros((size, 3))
    _assemble(chain, state, work, implicit_damping, matrix, right)
    # pin of body 0 minus end of the last body: the other way round than the closure's violation
    right[size - 2, 0] = -1.0
    right[size - 1, 1] = -1.0
    solution = _solve_refined(matrix, right)

    for k in range(3):
        column = 3 if k == 2 else k
        actual = 1.0 if k == 2 else 0.0  # only the actual motion has a centripetal part
        for i in range(n):
            ax, ay, alpha = solution[3 * i, k], solution[3 * i + 1, k], solution[3 * i + 2, k]
            gx = chain.com_x[i] * cos[i] - chain.com_y[i] * sin[i]
            gy = chain.com_x[i] * sin[i] + chain.com_y[i] * cos[i]
            w2 = actual * rate[i] * rate[i]
            swept.response[i, column] = alpha
            px = ax + alpha * gy + w2 * gx
            py = ay - alpha * gx + w2 * gy
            if i == 0:
                swept.base[0, column] = px
                swept.base[1, column] = py
            if i == probe_body:
                swept.probe[0, column] = px
                swept.probe[1, column] = py
            if i == n - 1:
                dx = chain.length[i] * cos[i]
                dy = chain.length[i] * sin[i]
                swept.end[0, column] = px - alpha * dy - w2 * dx
                swept.end[1, column] = py + alpha * dx - w2 * dy
                swept.end[2, column] = alpha
    for array in (swept.response, swept.base, swept.probe, swept.end):
        array[:, 2] = 0.0
    for k in range(3):
        for j in range(3):
            swept.inverse[k, j] = 1.0 if k == j else 0.0
        swept.load[k] = 0.0
    swept.load[3] = 1.0
    return -solution[size - 2 :, 2].copy()


@kernel
def _assemble(chain: Chain, state, work: Work, implicit_damping, matrix, right):
    """Symmetric (5 n, 5 n) matrix and the right-hand side of the actual motion (column 2)."""
    cos, sin, rate = work.cos, work.sin, state.rate
    n = rate.shape[0]
    for i in range(n):
        o = i + 1 if i < n - 1 else 0
        # joint i is input pin of body o and output pin of body i
        ox = chain.com_y[o] * sin[o] - chain.com_x[o] * cos[o]
        oy = -chain.com_x[o] * sin[o] - chain.com_y[o] * cos[o]
        ahead = chain.length[i] - chain.com_x[i]
        ix = ahead * cos[i] + chain.com_y[i] * sin[i]
        iy = ahead * sin[i] - chain.com_y[i] * cos[i]
        a, b = 3 * i, 3 * o
        matrix[a, a] += chain.mass[i]
        matrix[a + 1, a + 1] += chain.mass[i]
        matrix[a + 2, a + 2] += chain.inertia[i] + implicit_damping
        matrix[b + 2, b + 2] += implicit_damping
        matrix[a + 2, b + 2] -= implicit_damping
        matrix[b + 2, a + 2] -= implicit_damping
        right[a, 2] += work.force_x[i]
        right[a + 1, 2] += work.force_y[i] - chain.mass[i] * chain.gravity
        right[a + 2, 2] += work.moment[i] - work.torque[i]
        right[b + 2, 2] += work.torque[i]

        row = 3 * n + 2 * i
        matrix[row, b] = 1.0
        matrix[row, b + 2] = -oy
        matrix[row, a] = -1.0
        matrix[row, a + 2] = iy
        matrix[row + 1, b + 1] = 1.0
        matrix[row + 1, b + 2] = ox
        matrix[row + 1, a + 1] = -1.0
        matrix[row + 1, a + 2] = -ix
        for k in range(3):
            for r in range(row, row + 2):
                matrix[a + k, r] = matrix[r, a + k]
                matrix[b + k, r] = matrix[r, b + k]
        wo = rate[o] * rate[o]
        wi = rate[i] * rate[i]
        right[row, 2] = wo * ox - wi * ix
        right[row + 1, 2] = wo * oy - wi * iy


@kernel
def _solve_refined(matrix, right):
    """Solve and refine once; equilibrating (kg, kg m2 and m side by side) was tried and changes no digit."""
    solution = np.linalg.solve(matrix, right)
    return solution + np.linalg.solve(matrix, right - matrix @ solution)

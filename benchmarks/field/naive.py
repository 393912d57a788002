"""A naive answer to the problem free_chain: NumPy, a dense system of equations, RK4. No other package is needed.

    python naive.py free_chain.json free_chain_start.csv answers.csv [step_s]

Unknowns are the first pin and the angles of all bodies; the loop is closed by two multipliers.
"""

import json
import sys
import time

import numpy as np


class ClosedChain:
    """Data of the problem."""

    def __init__(self, said):
        half = said["chain"]["bodies"] // 2
        self.length, self.mass, self.inertia = (
            np.tile([said["chain"][body][key] for body in ("link", "connector")], half)
            for key in ("length_m", "mass_kg", "inertia_kg_m2")
        )
        n = 2 * half
        # mass centre i = pin 1 + sum over j < i of length j e(angle j) + half of length i e(angle i)
        self.path = np.tril(np.tile(self.length, (n, 1)), -1) + np.diag(self.length / 2)
        self.bushing = said["bushing"]
        self.gravity = said["gravity_m_s2"]

    def torques(self, angle, rate):
        """Torque on every body by the bushings at its two pins."""
        bend, bending = np.roll(angle, -1) - angle, np.roll(rate, -1) - rate
        bend[-1] -= 2 * np.pi  # angles fall by one turn along the chain
        torque = -self.bushing["stiffness_n_m_rad"] * (bend - self.bushing["free_angle_rad"])
        torque -= self.bushing["damping_n_m_s_rad"] * bending
        return np.roll(torque, 1) - torque

    def solve(self, q, v):
        """Accelerations (n + 2,) and the force of the last body on the first one (2,)."""
        c, s, w = np.cos(q[2:]), np.sin(q[2:]), v[2:]
        n = len(c)
        one, zero = np.ones((n, 1)), np.zeros((n, 1))
        jx, jy = np.hstack([one, zero, -self.path * s]), np.hstack([zero, one, self.path * c])
        ax, ay = -self.path @ (c * w * w), -self.path @ (s * w * w)  # accelerations while q'' is 0
        weighted_x, weighted_y = jx.T * self.mass, jy.T * self.mass
        matrix = np.zeros((n + 4, n + 4))
        matrix[: n + 2, : n + 2] = weighted_x @ jx + weighted_y @ jy
        matrix[range(2, n + 2), range(2, n + 2)] += self.inertia
        closing = np.zeros((2, n + 2))
        closing[0, 2:], closing[1, 2:] = -self.length * s, self.length * c
        matrix[n + 2 :, : n + 2], matrix[: n + 2, n + 2 :] = closing, closing.T
        right = np.concatenate(
            [
                -weighted_x @ ax - weighted_y @ (ay + self.gravity),
                [self.length @ (c * w * w), self.length @ (s * w * w)],
            ]
        )
        right[2 : n + 2] += self.torques(q[2:], w)
        found = np.linalg.solve(matrix, right)
        return found[: n + 2], found[n + 2 :]

    def centres(self, q, v):
        """Mass centres and their velocities."""
        c, s = np.cos(q[2:]), np.sin(q[2:])
        place = q[0] + self.path @ c, q[1] + self.path @ s
        return *place, v[0] - self.path @ (s * v[2:]), v[1] + self.path @ (c * v[2:])

    def report(self, time, q, v):
        """A row of the answer."""
        x, y, vx, vy = self.centres(q, v)
        gap = np.hypot(self.length @ np.cos(q[2:]), self.length @ np.sin(q[2:]))
        spin = self.inertia @ v[2:] + self.mass @ (x * vy - y * vx)
        return time, x[0], y[0], *self.solve(q, v)[1], gap, spin


def start(chain, table):
    """Coordinates and velocities of the initial state."""
    q, v = np.concatenate([[0, 0], table[:, 3]]), np.concatenate([[0, 0], table[:, 6]])
    x, y, vx, vy = chain.centres(q, v)
    q[:2], v[:2] = table[0, 1:3] - (x[0], y[0]), table[0, 4:6] - (vx[0], vy[0])
    return q, v


def main(problem, state, out, step=1e-3):
    with open(problem, encoding="utf-8") as file:
        said = json.load(file)
    chain = ClosedChain(said)
    q, v = start(chain, np.loadtxt(state, delimiter=",", skiprows=1))
    interval, end = said["report"]["interval_s"], said["report"]["end_s"]
    steps = round(interval / step)
    h, rows = interval / steps, [chain.report(0.0, q, v)]
    begin = time.process_time()
    for k in range(1, round(end / interval) + 1):
        for _ in range(steps):
            a1 = chain.solve(q, v)[0]
            v2 = v + h / 2 * a1
            a2 = chain.solve(q + h / 2 * v, v2)[0]
            v3 = v + h / 2 * a2
            a3 = chain.solve(q + h / 2 * v2, v3)[0]
            v4 = v + h * a3
            a4 = chain.solve(q + h * v3, v4)[0]
            q = q + h / 6 * (v + 2 * v2 + 2 * v3 + v4)
            v = v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        rows.append(chain.report(k * interval, q, v))
    print(f"{time.process_time() - begin:.3g} s of CPU time")
    header = "time_s,x_m,y_m,force_x_n,force_y_n,gap_m,angular_momentum_n_m_s"
    np.savetxt(out, rows, delimiter=",", header=header, comments="", fmt="%.13g")


if __name__ == "__main__":
    main(*sys.argv[1:4], *map(float, sys.argv[4:]))

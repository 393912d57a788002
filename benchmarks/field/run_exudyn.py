"""Answers of Exudyn to the problems: its bodies, joints and solver, the contacts of `replication.peers.contact`."""

from math import hypot

import numpy as np
from models import chain_of, contacts_of

from laboratory.benchmark.problems import read_problem, read_start
from replication.peers.contact import Contacts, _forces, _groove_contact
from replication.peers.exudyn_loop import PeerStart, PeerWheels, drive_at, run_exudyn_loop
from trackdyn.jit import kernel
from trackdyn.model.constants import Drive


@kernel
def arc_forces(c: Contacts, length, q, v, angle, spin, memory, force):
    """Normal force (n,) of every arc on the sprocket, N: arcs of a connector in turn."""
    for i in range(1, len(length), 2):
        x, y, w = q[3 * i], q[3 * i + 1], v[3 * i + 2]
        hx, hy = 0.5 * length[i] * np.cos(q[3 * i + 2]), 0.5 * length[i] * np.sin(q[3 * i + 2])
        for side in range(2):
            dx, dy = (hx, hy) if side else (-hx, -hy)
            lx, ly = x + dx - c.circle[0, 0], y + dy - c.circle[0, 1]
            arc = i - 1 + side
            force[arc] = 0.0
            if hypot(lx, ly) <= c.reach:
                depth, nx, ny, radius = _groove_contact(c, lx, ly, angle)
                if depth > 0.0:
                    speed = -nx * (v[3 * i] - w * dy + spin * ly) - ny * (v[3 * i + 1] + w * dx - spin * lx)
                    force[arc], _ = _forces(c.law[0], depth, speed, 0.0, memory[arc], radius)


def answer(name: str, method: str, step: float):
    """Time series, contacts and CPU time (s) of a run."""
    said, start = read_problem(name), read_start(name)
    chain = chain_of(said)
    n, end, interval = len(chain.length), said["report"]["end_s"], said["report"]["interval_s"]
    half = chain.com_x[0]
    c, s = np.cos(start[0, 3]), np.sin(start[0, 3])
    omega = start[0, 6]
    pin = np.array([start[0, 1] - half * c, start[0, 2] - half * s, start[0, 4] + half * s * omega,
                    start[0, 5] - half * c * omega])  # fmt: skip
    more, drive = {}, Drive(0.0, 1.0)
    first = PeerStart(pin, start[:, 3].copy(), start[:, 6].copy())
    if "wheels" in said:
        contacts = contacts_of(said)
        free = [wheel for wheel in said["wheels"] if wheel["name"] != "ring"]
        drive = Drive(said["drive"]["rate_rad_s"], said["drive"]["ramp_s"])
        wheels = PeerWheels(*(tuple(wheel[key] for wheel in free) for key in ("inertia_kg_m2", "drag_n_m_s_rad")))
        first = PeerStart(pin, first.angle, first.rate, said["drive"]["start_angle_rad"])
        more = {"contacts": contacts, "wheels": wheels, "drive": drive}
    samples = round(end / interval) + 1
    force, spin = np.zeros((samples, 2)), np.zeros(samples)
    now, began, peak, events = np.zeros(n), np.zeros(n), np.zeros(n), []

    def watch(t, q, v, multipliers, memory):
        k = round(t / interval)
        if abs(k * interval - t) < 0.5 * step and k < samples:
            force[k] = -multipliers[2 * n - 2 : 2 * n]  # on body 1
            spin[k] = chain.inertia @ v[2 : 3 * n : 3] + chain.mass @ (
                q[: 3 * n : 3] * v[1 : 3 * n : 3] - q[1 : 3 * n : 3] * v[: 3 * n : 3]
            )
        if "sprocket" in said:
            turned, rate = drive_at(drive, t)
            arc_forces(contacts, chain.length, q, v, first.sprocket_angle + turned, rate, memory.tooth, now)
            for arc in np.flatnonzero((now > 0) | (began > 0)):
                if now[arc] > 0:
                    began[arc] = began[arc] or t
                    peak[arc] = max(peak[arc], now[arc])
                else:
                    events.append([arc + 1, began[arc], t, peak[arc]])
                    began[arc] = peak[arc] = 0.0

    run = run_exudyn_loop(chain, first, end, step, interval, watch=watch, **more)
    events += [[arc + 1, began[arc], end, peak[arc]] for arc in np.flatnonzero(began)]
    body = said["report"]["body"] - 1
    series = {"time_s": run.time, "x_m": run.centre[:, body, 0], "y_m": run.centre[:, body, 1]}
    force[0] = force[1]  # no multipliers before the first step; no error is taken at 0
    series |= {"force_x_n": force[:, 0], "force_y_n": force[:, 1], "gap_m": run.gap}
    if "wheels" in said:
        series |= {"idler_rad_s": run.wheel_rate[:, 0], "road_wheel_rad_s": run.wheel_rate[:, 1]}
    else:
        spin[0] = chain.inertia @ start[:, 6] + chain.mass @ (start[:, 1] * start[:, 5] - start[:, 2] * start[:, 4])
        series["angular_momentum_n_m_s"] = spin
    return series, np.array(events).reshape(-1, 4), run.cpu

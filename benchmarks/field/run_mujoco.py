"""Answers of MuJoCo: the chain is that of the problems, contacts are its own (`replication.peers.mujoco_contact`)."""

from math import cos, sin

import numpy as np
from models import chain_of, contacts_of

from laboratory.benchmark.problems import read_problem, read_reference, read_start
from replication.peers.exudyn_loop import PeerStart, PeerWheels
from replication.peers.mujoco_loop import build, run_mujoco_loop
from trackdyn.model.constants import Drive


def answer(name: str, method: str, step: float):
    """Time series, no contacts, and CPU time (s) of a run."""
    said, start = read_problem(name), read_start(name)
    chain, asked = chain_of(said), said["report"]
    half, (c, s), omega = chain.com_x[0], (cos(start[0, 3]), sin(start[0, 3])), start[0, 6]
    pin = np.array([start[0, 1] - half * c, start[0, 2] - half * s, start[0, 4] + half * s * omega,
                    start[0, 5] - half * c * omega])  # fmt: skip
    more, drive, first = {}, Drive(0.0, 1.0), PeerStart(pin, start[:, 3], start[:, 6])
    if "wheels" in said:
        free = [wheel for wheel in said["wheels"] if wheel["name"] != "ring"]
        drive = Drive(said["drive"]["rate_rad_s"], said["drive"]["ramp_s"])
        first = PeerStart(pin, start[:, 3], start[:, 6], said["drive"]["start_angle_rad"])
        tension, pitch = read_reference(name)[0]["statistics"]["mean_force_n"]["value"], chain.length[:2].sum()
        more = {
            "contacts": contacts_of(said),
            "wheels": PeerWheels(*(tuple(wheel[key] for wheel in free) for key in ("inertia_kg_m2", "drag_n_m_s_rad"))),
            "load": tension * pitch / free[0]["radius_m"],  # what its compliant contacts are matched at
            "speed": max(abs(drive.rate) * pitch / 2, said["laws"]["wheel"]["speed_floor_m_s"]),
        }
    model = build(chain, step, integrator=method, **more)
    run = run_mujoco_loop(model, chain, first, asked["end_s"], asked["interval_s"], drive)
    body = asked["body"] - 1
    series = {"time_s": run.time, "x_m": run.centre[:, body, 0], "y_m": run.centre[:, body, 1], "gap_m": run.gap}
    return series, None, run.cpu

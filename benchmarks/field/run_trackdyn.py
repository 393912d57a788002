"""Answers of trackdyn's integrators to the problems."""

from time import process_time

import numpy as np
from models import chain_of, model_of, state_of

from laboratory.benchmark.problems import read_problem, read_start
from trackdyn.integrate.dynamics import solve_chain
from trackdyn.integrate.energy import energies
from trackdyn.integrate.methods import equip
from trackdyn.integrate.run import refresh, shared
from trackdyn.model.record import BUSHING_LOSS, END, KINETIC, PEAK, PITCH, SIDE, START, make_record
from trackdyn.model.work import make_work
from trackdyn.simulation.stepping import march


def fresh(name: str, integrator: str, step: float, tolerance: float = 0.0):
    """Model, state, work and an empty record of a problem."""
    said = read_problem(name)
    model = model_of(said, integrator, step)
    state = state_of(said, read_start(name))
    n, wheels = len(state.angle), len(model.wheels.x)
    work = equip(make_work(n, n // 2, wheels), integrator, n // 2, tolerance)
    samples = round(said["report"]["end_s"] / said["report"]["interval_s"])
    return said, model, state, work, make_record(samples, state, frames=samples, frame_stride=1, spells=200_000)


def spend(name: str, integrator: str, step: float, tolerance: float = 0.0) -> float:
    """CPU time of a run, s."""
    _, model, state, work, record = fresh(name, integrator, step, tolerance)
    begin = process_time()
    march(model, state, work, record, 0, len(record.gap))
    return process_time() - begin


def answer(name: str, integrator: str, step: float, tolerance: float = 0.0, nudge: float = 0.0):
    """Time series (a dict of columns) and contacts (k, 4) of a run; ``nudge`` (rad) turns the first body's start."""
    said, model, state, work, record = fresh(name, integrator, step, tolerance)
    state.angle[0] += nudge
    bare = shared(model, state, work)
    chain, rows = chain_of(said), []

    def look():
        refresh(*bare)
        solve_chain(*bare, 0.0, None, None)
        out, body = np.zeros(10), model.sensor.body
        energies(*bare, None, out)
        x, y = work.pin_x[:-1], work.pin_y[:-1]
        half = chain.com_x
        cx, cy = x + half * work.cos, y + half * work.sin
        turn = chain.inertia * state.rate + chain.mass * (cx * work.com_vy - cy * work.com_vx)
        stored = out[KINETIC:].sum()
        gap = max(np.sqrt(work.worst[0]), np.hypot(*work.cut[:2]))
        force = work.sweep.load[:2]
        rates = state.wheel_rate[1:] if len(state.wheel_rate) > 1 else [0.0, 0.0]
        # the account: what came in less what was lost and what is stored
        return [cx[body], cy[body], *force, *rates, gap, stored - out[0] + out[1 : BUSHING_LOSS + 1].sum(), turn.sum()]

    for sample in range(len(record.gap) + 1):
        if sample:
            march(model, state, work, record, sample - 1, sample)
        rows.append(look())
    rows = np.array(rows)
    rows[:, -2] -= rows[0, -2]
    names = ("x_m", "y_m", "force_x_n", "force_y_n", "idler_rad_s", "road_wheel_rad_s", "gap_m", "balance_j",
             "angular_momentum_n_m_s")  # fmt: skip
    series = {"time_s": np.arange(len(rows)) * said["report"]["interval_s"]}
    series |= dict(zip(names, rows.T, strict=True))
    if name == "free_chain":
        del series["idler_rad_s"], series["road_wheel_rad_s"]
    else:
        del series["angular_momentum_n_m_s"]
    return series, contacts_of_record(record)


def contacts_of_record(record) -> np.ndarray:
    """Contacts (k, 4) of a record: arc, begin and end (s), highest force (N)."""
    columns = record.spells.rows.shape[1]
    spells = np.vstack([record.spells.rows[: record.spells.count[0]], record.spells.open[:, :columns]])
    spells = spells[(spells[:, END] > 0) & (spells[:, SIDE] < 2)]
    arc = 2 * spells[:, PITCH] + spells[:, SIDE] + 1
    contacts = np.column_stack([arc, spells[:, START], spells[:, END], spells[:, PEAK]])
    return contacts[np.argsort(contacts[:, 1], kind="stable")]

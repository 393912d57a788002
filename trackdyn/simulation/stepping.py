"""One call of the time loop, its message when a run leaves the physical range, and the forces in the joints."""

import numpy as np

from trackdyn.errors import DivergenceError
from trackdyn.integrate.run import run
from trackdyn.model.constants import Model
from trackdyn.model.record import Record
from trackdyn.model.state import State
from trackdyn.model.work import Work


def body_name(body: int, single_pin: bool = False) -> str:
    """``link 3`` or ``connector 3``: the body as a reader would call it."""
    if single_pin:
        return f"pitch {body + 1}"
    return f"{'connector' if body % 2 else 'link'} {body // 2 + 1}"


def march(
    model: Model, state: State, work: Work, record: Record, first: int = 0, last: int = 1, phase: str = "the run"
) -> None:
    """Integrate samples ``first`` to ``last - 1`` of ``model.stride`` steps each and fill their rows.

    Raises
    ------
    DivergenceError
        A body left the physical range: when, in which phase, which body.
    """
    bad = run(model, state, work, record, first, last)
    if bad >= 0:
        raise DivergenceError(
            f"the run left the physical range at t = {state.steps[0] * model.step:.6g} s of {phase}, first at "
            f"{body_name(bad, len(state.angle) == len(state.wheel_impact))}; "
            f"use a step smaller than {model.step:g} s, or check the rig"
        )


def joint_forces(model: Model, state: State, work: Work) -> np.ndarray:
    """(n, 2) force of body i on body i + 1 through the joint between them at the last step, N (`Loop.joint_forces`)."""
    if work.radial is not None:
        return work.radial.force.copy()
    chain, sweep = model.chain, work.sweep
    alpha, acceleration = sweep.response @ sweep.load, sweep.base @ sweep.load
    rate2 = state.rate**2
    arm = np.column_stack(
        [chain.com_x * work.cos - chain.com_y * work.sin, chain.com_x * work.sin + chain.com_y * work.cos]
    )
    across = chain.length[:, None] * np.column_stack([work.cos, work.sin])

    def relative(r: np.ndarray) -> np.ndarray:
        return alpha[:, None] * np.column_stack([-r[:, 1], r[:, 0]]) - rate2[:, None] * r

    pins = acceleration + np.vstack([np.zeros(2), np.cumsum(relative(across), axis=0)[:-1]])
    outer = np.column_stack([work.force_x, work.force_y - chain.mass * chain.gravity])
    passed = outer - chain.mass[:, None] * (pins + relative(arm))
    return np.asarray(sweep.load[:2]) + np.cumsum(passed, axis=0)

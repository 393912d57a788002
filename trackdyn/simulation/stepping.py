"""One call of the time loop, its message when a run leaves the physical range, and the forces in the joints."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import RLock
from typing import Any

import numpy as np

from trackdyn.errors import DivergenceError, InputError
from trackdyn.integrate.run import in_range, prepared, run
from trackdyn.jit import direct
from trackdyn.model.constants import Drive, Model
from trackdyn.model.record import Record
from trackdyn.model.state import State
from trackdyn.model.work import Work
from trackdyn.simulation.state_checks import Parts, copied, fault_of_range, limits_of, refuse_other


def march(model: Model, state: State, work: Work, record: Record, first=0, last=1, phase="the run") -> None:
    """Integrate samples ``first`` to ``last - 1`` of ``model.stride`` steps each and fill their rows."""
    refuse_divergence(run(model, state, work, record, first, last), model, state, phase)


def refuse_divergence(body: int, model: Model, state: State, phase: str = "the run") -> None:
    """Refuse (`DivergenceError`) a run that ended at a body (-1: none): when, in which phase, which body."""
    if body >= 0:
        single_pin = len(state.angle) == len(state.wheel_impact)
        name = f"pitch {body + 1}" if single_pin else f"{'connector' if body % 2 else 'link'} {body // 2 + 1}"
        raise DivergenceError(
            f"the run left the physical range at t = {state.steps[0] * model.step:.6g} s of {phase}, first at "
            f"{name}; "
            f"use a step smaller than {model.step:g} s, or check the rig"
        )


class Held:
    """Model, state and work of a loop: copies that kernels alone have, others only views of them."""

    def __init__(self, model: Model, state: State, work: Work):
        parts = Parts(model, state, work)
        self.__setstate__({"parts": parts, "limits": limits_of(parts)})

    def __getstate__(self) -> dict:
        return {"parts": self.parts, "limits": self.limits}

    def __setstate__(self, kept: dict) -> None:
        self.parts, self.limits, self.lock = kept["parts"], kept["limits"], RLock()
        self.take()

    @contextmanager
    def exclusive(self) -> Iterator[None]:
        """Hold the parts for this thread until the end of a call."""
        if not self.lock.acquire(blocking=False):
            raise InputError("another thread steps this loop; give each thread a copy")
        try:
            yield
        finally:
            self.lock.release()

    def take(self, **parts: Any) -> None:
        """Copy parts that are given, if kernels can take them."""
        given = self.parts._replace(**parts)
        refuse_other(given, self.parts, self.limits)
        self.parts, self.bounded = copied(given, self.limits)
        self.prepared: tuple | None = None
        self.entry: Callable | None = None

    def steer(self, drive: Drive) -> None:
        """Take a drive with other numbers."""
        self.parts, self.prepared = self.parts._replace(model=self.parts.model._replace(drive=drive)), None

    def refuse_out_of_range(self) -> None:
        """Refuse numbers that kernels cannot take, which may have been written in place."""
        if not in_range(*self.bounded):
            refuse_other(self.parts, self.parts, self.limits)

    def march(self, record: Record, first: int, last: int, stride: int) -> None:
        """Fill rows of a record with samples of ``stride`` steps."""
        self.refuse_out_of_range()
        if self.prepared is None:
            self.prepared = prepared(*self.parts)
        kernel, (model, state, work), after = self.prepared
        arguments = model._replace(stride=stride), state, work, record, (first, last), *after
        if self.entry is None:
            self.entry = direct(kernel, *arguments)
        refuse_divergence(self.entry(*arguments), model, state)
        if not in_range(*self.bounded) and (fault := fault_of_range(self.parts, self.limits)):
            raise DivergenceError(
                f"the run left the physical range before t = {state.steps[0] * model.step:.6g} s: "
                f"{fault.removeprefix('loop.').partition(':')[0]}; use a smaller step or a milder rig"
            )


def joint_forces(model: Model, state: State, work: Work) -> np.ndarray:
    """(n, 2) force of body i on body i + 1 through the joint between them at the last step, N (`Loop.joint_forces`)."""
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

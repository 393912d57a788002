"""Loop: a settled chain that can be stepped, read, recorded, steered and copied."""

import copy
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from threading import RLock
from time import process_time
from typing import Any

import numpy as np

from trackdyn.chain.kinematics import rotated
from trackdyn.inputs.errors import InputError
from trackdyn.inputs.validation import typed, within
from trackdyn.integrate.energy import energies
from trackdyn.integrate.run import Integration, refresh
from trackdyn.integrate.semi_implicit import sprocket_rate
from trackdyn.model.arrays import ENERGY_NAMES, Record, State, Work, make_record
from trackdyn.model.constants import Drive, Model
from trackdyn.scene.build import wheel_centres
from trackdyn.scene.scene import LONGEST_RUN, MOST_STEPS, Scene
from trackdyn.scene.step import allowed_step
from trackdyn.simulation.loop_arrays import LoopArrays, allocate, flatten, move_wheels, read_only, shift_tensioner
from trackdyn.simulation.recorder import CHUNK, Recorder
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.settling import SettledLoops, settle


@typed
class Loop:
    """A chain of ``n`` bodies on its wheels: ``scene``, ``layout`` (`Layout`) and state.

    ``model``, ``state`` and ``work`` are read-only views of the arrays of kernels (`trackdyn.model`); ``arrays`` can be
    written to, unchecked.

    The loop of the scene is laid, tensioned and settled, or copied from ``starts``, loops that were settled before; the
    sprocket rests until the first step. Without ``scene.step`` the step follows the tension at which the loop settles:
    ``model.step``. Methods that take steps raise `DivergenceError` if a body leaves the physical range, as settling
    does, and `InputError` if another thread steps this loop.
    """

    clock = staticmethod(process_time)  # CPU seconds that the work of loops took

    def __init__(self, scene: Scene, starts: SettledLoops | None = None):
        if scene.chain == "belt":
            raise InputError("scene: chain = 'belt': has no state to step; use 'double_pin'")
        self.scene = scene
        self.arrays, self.layout = settle(scene, starts)

    @property
    def arrays(self) -> LoopArrays:
        """Writable model, state and work, for steps of one's own: unchecked, and kernels index without bounds."""
        return self._written

    @arrays.setter
    def arrays(self, arrays: LoopArrays) -> None:
        self._scratch, self._lock = make_record(1, arrays.state, len(arrays.model.sensors.body)), RLock()
        self._show(copy.deepcopy(arrays))
        self._integration = Integration(self._written.work, self._written.optional)

    def _show(self, arrays: LoopArrays) -> None:
        """Set the arrays, and the read-only views of them."""
        self._written, self._views = arrays, read_only(arrays)

    def __getstate__(self) -> dict:
        return {name: getattr(self, name) for name in ("scene", "layout", "arrays")}

    def __setstate__(self, state: dict) -> None:
        for name, value in state.items():
            setattr(self, name, value)

    @contextmanager
    def _exclusive(self) -> Iterator[None]:
        """Refuse (`InputError`) other threads during a call."""
        if not self._lock.acquire(blocking=False):
            raise InputError("another thread steps this loop; give each thread a copy")
        try:
            yield
        finally:
            self._lock.release()

    def fill(self, record: Record, first: int, last: int, **changes: Any) -> None:
        """Fill rows ``first`` to ``last - 1`` of a record made for this loop, unchecked; ``changes``: of the model."""
        with self._exclusive():
            self._integration(self._written.model._replace(**changes), self._written.state, record, first, last)

    # -- stepping ------------------------------------------------------------------------------------------------------

    def step(self, count: int = 1) -> None:
        """Take ``count`` steps of ``model.step`` s."""
        self.fill(self._scratch, 0, 1, stride=int(within("count", count, 1, MOST_STEPS)))

    def advance(self, seconds: float, tick: Callable[[float], object] = lambda seconds: None) -> None:
        """Integrate for a time (s) in whole steps; call ``tick`` with the seconds of every chunk."""
        seconds = within("seconds", seconds, 0.0, LONGEST_RUN)
        with self._exclusive():
            step = self.arrays.model.step
            remaining = round(seconds / step)
            while remaining:
                count = min(remaining, max(round(CHUNK / step), 1))
                self.step(count)
                tick(count * step)
                remaining -= count

    def lead_in(self, tick: Callable[[float], object] = lambda seconds: None) -> None:
        """Integrate the ramp and the lead-in of the scene; ``tick`` as of `advance`."""
        self.advance(self.scene.ramp + self.scene.lead_in, tick)

    def record(
        self, seconds: float, pitches: Sequence[int] = (), frame_interval: float = 0.0, contact_log: bool = True,
        every_link: bool = False,
    ) -> Recording:  # fmt: skip
        """Integrate for a time and record.

        Parameters
        ----------
        seconds : float
            A whole number of sample intervals.
        pitches, frame_interval, contact_log, every_link
            As the fields of a `Scene`.

        Raises
        ------
        DivergenceError
            Also if contacts chatter, or the residual of the energy balance is too large (`check_energy_balance`).
        """
        options = {"frame_interval": frame_interval, "contact_log": contact_log, "every_link": every_link}
        with self._exclusive():
            scene = self.scene.with_(duration=seconds, pitches=tuple(pitches), **options)
            return Recorder(self, scene).finish().recording()

    # -- present quantities -------------------------------------------------------------------------------------------

    @property
    def model(self) -> Model:  # noqa: D102
        return self._views.model

    @property
    def state(self) -> State:  # noqa: D102
        return self._views.state

    @property
    def work(self) -> Work:  # noqa: D102
        return self._views.work

    @property
    def time(self) -> float:
        """Time since the sprocket began to turn, s."""
        return float(self.arrays.state.steps[0] * self.arrays.model.step)

    @property
    def pins(self) -> np.ndarray:
        """(n + 1, 2) input pins of the bodies and output pin of the last one, m."""
        refresh(*self.arrays)
        return np.column_stack([self.arrays.work.pin_x, self.arrays.work.pin_y])

    @property
    def mass_centres(self) -> np.ndarray:
        """(n, 2) mass centres of the bodies, m."""
        return self.pins[:-1] + self._arms

    @property
    def momentum(self) -> np.ndarray:
        """(3,) momentum (N s) and angular momentum about the inertial origin (N m s) of the chain."""
        (x, y), work, chain = self.mass_centres.T, self.arrays.work, self.arrays.model.chain
        px, py = chain.mass * work.com_vx, chain.mass * work.com_vy
        return np.array([px.sum(), py.sum(), (chain.inertia * self.arrays.state.rate + x * py - y * px).sum()])

    @property
    def tension(self) -> float:
        """Tension of the chain at the cut joint in the last step, N."""
        return float(np.hypot(*self.arrays.work.sweep.load[:2]))

    @property
    def joint_forces(self) -> np.ndarray:
        """(n, 2) force of body i on body i + 1 through the joint between them in the last step, N; the last: the cut.

        It follows from Newton's law along the chain, with the accelerations of that step and the contacts of the
        present state, one step later.
        """
        chain, work, sweep = self.arrays.model.chain, self.arrays.work, self.arrays.work.sweep
        alpha, acceleration = sweep.response @ sweep.load, sweep.base @ sweep.load
        links, rate2 = chain.length[:, None] * np.column_stack([work.cos, work.sin]), self.arrays.state.rate**2

        def relative(r: np.ndarray) -> np.ndarray:
            return alpha[:, None] * np.column_stack([-r[:, 1], r[:, 0]]) - rate2[:, None] * r

        pins = acceleration + np.vstack([np.zeros(2), np.cumsum(relative(links), axis=0)[:-1]])
        outer = np.column_stack([work.force_x, work.force_y - chain.mass * chain.gravity])
        passed = outer - chain.mass[:, None] * (pins + relative(self._arms))
        return np.asarray(sweep.load[:2]) + np.cumsum(passed, axis=0)

    @property
    def energy(self) -> dict[str, float]:
        """Energy balance and energies by name (`model.arrays.ENERGY_NAMES`), J."""
        refresh(*self.arrays)
        out = np.zeros(len(ENERGY_NAMES))
        energies(*self.arrays[:3], self.arrays.optional.space, out)
        return dict(zip(ENERGY_NAMES, out.tolist(), strict=True))

    @property
    def gap(self) -> float:
        """Distance of the two pins of the cut joint, m."""
        refresh(*self.arrays)
        return float(np.hypot(*self.arrays.work.cut[:2]))

    @property
    def _arms(self) -> np.ndarray:
        """(n, 2) vectors from the input pin of each body to its mass centre, m."""
        chain, work = self.arrays.model.chain, self.arrays.work
        return np.column_stack(rotated.py_func(chain.com_x, chain.com_y, work.cos, work.sin))

    # -- steering ------------------------------------------------------------------------------------------------------

    def drive(self, motor_rpm: float, ramp: float = 1e-3) -> None:
        """Change the motor speed (rev/min) over a ramp of ``ramp`` s that is smooth at both ends."""
        model, scene = self.arrays.model, self.scene.with_(motor_rpm=motor_rpm, ramp=ramp)
        scene.with_(step=model.step)  # refused where the step is too large for the speed
        self.scene = scene
        start = float(sprocket_rate(model.drive, self.time))
        drive = Drive(float(scene.sprocket_rate), float(scene.ramp), start, begin=self.time)
        self._show(self.arrays._replace(model=model._replace(drive=drive)))

    def shift_tensioner(self, shift: float) -> None:
        """Move a locked tensioning wheel along its line to ``shift`` (m) from its position in the rig.

        The present one is ``layout.tensioner_shift_m``. Raises `InputError`: beyond the travel, or on a spring.
        """
        rig = self.scene.rig
        if self.scene.tension == "sprung":
            raise InputError(f"shift = {shift!r} m: the tensioner slides on its spring; use tension='locked'")
        shift = within("shift", shift, -rig.tension.travel, rig.tension.travel, " m, the tensioner's travel,")
        shift_tensioner(self.arrays.model, rig, shift)
        self.layout = self.layout._replace(tensioner_shift_m=float(shift))

    # -- copying -------------------------------------------------------------------------------------------------------

    def copy(self) -> "Loop":
        """Return an independent loop in the same state."""
        return copy.deepcopy(self)

    def changed(self, **fields: Any) -> "Loop":
        """Return an independent loop in the same state, with some fields of its scene replaced.

        Step, integrator, motor speed, laws and masses may change; bodies, joints and wheels may not. The drive
        continues, or changes its speed from the present one (`drive`).

        Raises `InputError`: the chain, ring, joints or plane of motion differ, so that the state does not fit.
        """
        changed = type(self).__new__(type(self))
        changed.scene, changed.layout = self.scene.with_(**fields), self.layout
        for name in ("chain", "ring_radius"):
            if (value := getattr(changed.scene, name)) != getattr(self.scene, name):
                raise InputError(f"scene: {name} = {value!r}: cannot change in a loop; make a new Loop")
        step = allowed_step(changed.scene, changed.scene.time_step, self.layout.settled_tension_n)
        allocated = allocate(changed.scene, step)
        model, leaves, present = allocated.model, flatten(allocated.state), flatten(self.arrays.state)
        if [leaf.shape for leaf in leaves.values()] != [leaf.shape for leaf in present.values()]:
            raise InputError("scene: rig, space or joints differ, but a loop keeps bodies and joints; make a new Loop")
        before = self.arrays.model
        model.wheels.radius[:] = before.wheels.radius
        move_wheels(model, wheel_centres(self.scene.rig, before.wheels))
        for name, leaf in leaves.items():
            leaf[...] = present[name]
        leaves["steps"][0] = round(self.time / model.step)
        changed.arrays = allocated._replace(model=model._replace(drive=before.drive, suspensions=before.suspensions))
        if fields.keys() & {"motor_rpm", "ramp"}:
            changed.drive(changed.scene.motor_rpm, changed.scene.ramp)
        return changed

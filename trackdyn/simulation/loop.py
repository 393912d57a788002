"""Loop: one chain, settled and ready to run, that can be stepped, looked at, recorded, steered, saved and resumed."""

import copy
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import RLock
from typing import Any

import numpy as np

from trackdyn.errors import InputError
from trackdyn.integrate.energy import energies
from trackdyn.integrate.run import refresh, shared
from trackdyn.integrate.semi_implicit import sprocket_rate
from trackdyn.model.record import ENERGY_NAMES, Record, make_record
from trackdyn.parameters.layout import tensioner
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.validation import within
from trackdyn.scene.build import shift_wheel
from trackdyn.scene.carriers import CARRIED
from trackdyn.scene.scene import LONGEST, MOST_STEPS, Scene
from trackdyn.simulation.checkpoint import (
    filled,
    flat,
    read_checkpoint,
    refuse_other_model,
    refuse_other_places,
    whole,
    write_checkpoint,
)
from trackdyn.simulation.recorder import CHUNK, Recorder
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.settled_loops import SettledLoops
from trackdyn.simulation.settling import allocate, settle, with_sliding
from trackdyn.simulation.state_checks import Door, refuse_diverged, refuse_other_record
from trackdyn.simulation.stepping import joint_forces, march


class Loop:
    """A chain on its wheels, or a free one.

    Parameters
    ----------
    scene : Scene
        What is asked for. The loop is laid, tensioned and settled; the sprocket rests until the first step.
    starts : SettledLoops or None
        Loops that were settled before, among which this one may be.

    Attributes
    ----------
    scene : Scene
    model, state, work
        What kernels read and write (`trackdyn.model`): to be looked at; the numbers of the state may be changed in
        place between steps.
    layout : dict
        Shift of the tensioning wheel (m) and tension reached with the reference ring (N).

    Raises
    ------
    DivergenceError
        A body leaves the physical range, also in every method that takes steps.
    InputError
        In every method that takes steps: an array was changed to one that the kernels cannot take, or another thread
        steps this loop.
    """

    def __init__(self, scene: Scene, starts: SettledLoops | None = None):
        if scene.chain == "belt":
            raise InputError("scene: chain = 'belt': a path has no state to step; use 'double_pin'")
        self.scene = scene
        self.model, self.state, work, self.layout = starts.settle(scene) if starts else settle(scene)
        self.work = with_sliding(scene, self.model, work)
        self._made()

    def _made(self) -> None:
        """Remember what kernels were made for, once model, state and work are there."""
        self._scratch = make_record(1, self.state)
        self._door, self._lock = Door(self.model, self.state, self.work), RLock()

    def __getstate__(self) -> dict:
        """What a copy has: all but the lock."""
        return {name: value for name, value in vars(self).items() if name != "_lock"}

    def __setstate__(self, state: dict) -> None:
        vars(self).update(state)
        self._lock = RLock()

    # -- stepping ------------------------------------------------------------------------------------------------------

    def step(self, count: int = 1) -> None:
        """Take steps.

        Parameters
        ----------
        count : int
            Number of steps of ``scene.step`` s.
        """
        count = int(within("count", count, 1, MOST_STEPS))
        self._march(self._scratch, 0, 1, stride=count)

    def _march(self, record: Record, first: int, last: int, **changed: Any) -> None:
        """Fill rows of a record, with some fields of the model changed, if kernels can take what is there."""
        with self._alone():
            self._sound()
            model = self.model._replace(**changed)
            march(model, self.state, self.work, record, first, last)
            refuse_diverged(self.state, model.step)

    def _sound(self) -> None:
        self._door.refuse(self.model, self.state, self.work)

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Hold the loop for this thread until the end of a call."""
        if not self._lock.acquire(blocking=False):
            raise InputError("another thread steps this loop; give each thread a copy")
        try:
            yield
        finally:
            self._lock.release()

    def advance(self, seconds: float, tick: Callable[[float], object] = lambda seconds: None) -> None:
        """Integrate for a time, rounded to whole steps.

        Parameters
        ----------
        seconds : float
            Time, s.
        tick : function
            Called with the seconds that every chunk adds.
        """
        seconds = within("seconds", seconds, 0.0, LONGEST)
        with self._alone():
            self._sound()
            left = round(seconds / self.model.step)
            while left:
                count = min(left, max(round(CHUNK / self.model.step), 1))
                self.step(count)
                tick(count * self.model.step)
                left -= count

    def fill(self, record: Record, first: int = 0, last: int | None = None) -> None:
        """Go on and fill rows ``first`` to ``last - 1`` (all by default) of a record of one's own (`room`)."""
        if last is None:
            last = len(record.gap) if isinstance(record, Record) else 0
        first, last = (int(within(name, row, 0, MOST_STEPS)) for name, row in (("first", first), ("last", last)))
        with self._alone():
            self._sound()
            refuse_other_record(record, self.state, self.work, first, last)
            self._march(record, first, last)

    def room(self, samples: int, **what: Any) -> Record:
        """An empty record of this loop (`model.record.make_record`)."""
        return make_record(samples, self.state, **what)

    def record(
        self,
        seconds: float,
        pitches: tuple[int, ...] = (),
        frame_interval: float = 0.0,
        spells: bool = True,
        every_link: bool = False,
        tick: Callable[[float], object] = lambda seconds: None,
    ) -> Recording:
        """Integrate for a time and record.

        Parameters
        ----------
        seconds : float
            A whole number of sample intervals.
        pitches : tuple of int
            Pitches whose contacts are recorded (1-based); empty: the sensor's.
        frame_interval : float
            Time between recorded configurations, s; 0: none.
        spells : bool
            Log every contact with the sprocket.
        every_link : bool
            Record the sensor's place on every link, and the contacts of every pitch.
        tick : function
            Called with the seconds that every chunk adds.

        Raises
        ------
        DivergenceError
            Also if the contact chatters, or the energy balance stays open (`measure.energy`).
        """
        asked = self.scene.with_(
            duration=seconds, pitches=pitches, frame_interval=frame_interval, spells=spells, every_link=every_link
        )
        with self._alone():
            self._sound()
            writer = Recorder(self, asked.duration, asked.pitches, asked.frame_interval, asked.spells, asked.every_link)
            while not writer.finished:
                tick(writer.chunk())
            return writer.recording()

    # -- looking -------------------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Time since the sprocket began to turn, s."""
        return float(self.state.steps[0] * self.model.step)

    @property
    def pins(self) -> np.ndarray:
        """(n + 1, 2) input pins of the bodies and output pin of the last one, m."""
        self._refresh()
        return np.column_stack([self.work.pin_x, self.work.pin_y])

    @property
    def mass_centres(self) -> np.ndarray:
        """(n, 2) mass centres of the bodies, m."""
        chain, work, pins = self.model.chain, self.work, self.pins[:-1]
        x = pins[:, 0] + chain.com_x * work.cos - chain.com_y * work.sin
        y = pins[:, 1] + chain.com_x * work.sin + chain.com_y * work.cos
        return np.column_stack([x, y])

    @property
    def momentum(self) -> np.ndarray:
        """(3,) momentum (N s) and angular momentum about the inertial origin (N m s) of the chain."""
        (x, y), work, chain = self.mass_centres.T, self.work, self.model.chain
        px, py = chain.mass * work.com_vx, chain.mass * work.com_vy
        return np.array([px.sum(), py.sum(), (chain.inertia * self.state.rate + x * py - y * px).sum()])

    @property
    def angles(self) -> np.ndarray:
        """(n,) orientations of the bodies, rad; read-only view."""
        return _view(self.state.angle)

    @property
    def rates(self) -> np.ndarray:
        """(n,) angular velocities of the bodies, rad/s; read-only view."""
        return _view(self.state.rate)

    @property
    def wheel_rates(self) -> np.ndarray:
        """(w,) angular velocities of the sprocket and the other wheels, rad/s; read-only view."""
        return _view(self.state.wheel_rate)

    @property
    def tooth_forces(self) -> np.ndarray:
        """(p, 2) normal forces on the left and right arc of every connector, N; read-only view."""
        return _view(self.work.tooth_force).reshape(-1, 2)

    @property
    def wheel_forces(self) -> np.ndarray:
        """(p, w) normal forces of the ring and the other wheels on every link, N; read-only view."""
        return _view(self.work.wheel_force)

    @property
    def felt(self) -> np.ndarray:
        """(3,) acceleration of the sensor's place in the link frame, x and y (m/s2), and the link's angle (rad).

        Means over the last `step`, or over the last sample interval of `advance`; at rest before the first.
        """
        if not self.state.steps[0]:
            return np.array([0.0, 0.0, self.state.angle[self.model.sensor.body]])
        return self._scratch.mean[0].copy()

    @property
    def tension(self) -> float:
        """Tension of the chain at the cut joint in the last step, N."""
        return float(np.hypot(*self.work.sweep.load[:2]))

    @property
    def joint_forces(self) -> np.ndarray:
        """(n, 2) force of body i on body i + 1 through the joint between them at the last step taken, N.

        Newton's law along the chain, from the cut (the last entry) on, with the accelerations of that step and the
        contacts of the present state, one step later. With radial compliance it is the force of the bushings.
        """
        return joint_forces(self.model, self.state, self.work)

    @property
    def energy(self) -> dict[str, float]:
        """Energy balance and energies by name (`model.record.ENERGY_NAMES`), J."""
        self._refresh()
        out = np.zeros(len(ENERGY_NAMES))
        energies(*shared(self.model, self.state, self.work), self.work.space, out)
        return dict(zip(ENERGY_NAMES, out.tolist(), strict=True))

    @property
    def gap(self) -> float:
        """Distance of the two pins of the cut joint, m."""
        self._refresh()
        return float(np.hypot(*self.work.cut[:2]))

    def _refresh(self) -> None:
        self._sound()
        refresh(self.model, self.state, self.work)

    # -- steering ------------------------------------------------------------------------------------------------------

    def drive(self, motor_rpm: float, ramp: float = 1e-3) -> None:
        """Change the motor speed on a ramp that is smooth at both ends.

        Parameters
        ----------
        motor_rpm, ramp : float
            New speed, rev/min, and the time in which it is reached, s.
        """
        now = sprocket_rate(self.model.drive, self.time)
        self.scene = self.scene.with_(motor_rpm=motor_rpm, ramp=ramp)
        self.model = self.model._replace(
            drive=self.model.drive._replace(
                rate=self.scene.sprocket_rate, ramp=self.scene.ramp, start=float(now), begin=self.time
            )
        )

    def shift_tensioner(self, shift: float) -> None:
        """Move a locked tensioning wheel along its line.

        Parameters
        ----------
        shift : float
            Displacement from its position in the rig, m, within its travel; ``layout["tensioner_shift_m"]`` has the
            present one.

        Raises
        ------
        InputError
            Beyond the travel, or the tensioner is on a spring.
        """
        rig = self.scene.rig
        if self.scene.tension in CARRIED:
            raise InputError(f"shift = {shift!r} m: the tensioner slides on its spring; use tension='locked'")
        shift = within("shift", shift, -rig.tension.travel, rig.tension.travel, " m, the tensioner's travel,")
        shift_wheel(self.model, rig, tensioner(rig), shift)
        self.layout["tensioner_shift_m"] = float(shift)

    # -- keeping -------------------------------------------------------------------------------------------------------

    def copy(self) -> "Loop":
        """Return an independent loop in the same state."""
        return copy.deepcopy(self)

    def changed(self, **fields: Any) -> "Loop":
        """Return an independent loop in the same state, with some fields of its scene replaced.

        Step, integrator, solver, motor speed, laws, masses and the like may change; bodies, joints and wheels may not.
        The drive continues, or changes its speed from the present one (`drive`).

        Raises
        ------
        InputError
            Another chain, ring, joints or plane of motion would need another state.
        """
        self._sound()
        other = Loop.__new__(Loop)
        other.scene, other.layout = self.scene.with_(**fields), dict(self.layout)
        for name in ("loop", "chain", "ring_radius"):
            if (asked := getattr(other.scene, name)) != getattr(self.scene, name):
                raise InputError(f"scene: {name} = {asked!r}: cannot change in a loop; make a new Loop")
        other.model, other.state, other.work = allocate(other.scene)
        if [part.shape for part in flat(other.state).values()] != [part.shape for part in flat(self.state).values()]:
            raise InputError(
                "scene: rig, space or joints differ: a loop keeps bodies, plane and joints; make a new Loop"
            )
        other.model = other.model._replace(drive=self.model.drive, carriers=self.model.carriers)
        for name in ("x", "y", "radius"):
            getattr(other.model.wheels, name)[:] = getattr(self.model.wheels, name)
        filled(other.state, flat(self.state))
        other.state.steps[0] = round(self.time / other.model.step)
        other._made()
        if fields.keys() & {"motor_rpm", "ramp"}:
            other.drive(other.scene.motor_rpm, other.scene.ramp)
        return other

    def save(self, path: Path | str) -> None:
        """Write a checkpoint from which `Loop.load` continues bit for bit."""
        self._sound()
        write_checkpoint(path, self.describe())

    @classmethod
    def load(cls, path: Path | str) -> "Loop":
        """Read the loop that `save` wrote to ``path``.

        Raises
        ------
        InputError
            There is no such checkpoint, or other sources wrote it.
        """
        data = read_checkpoint(path)
        with whole(path):
            return cls.restored(data)

    def describe(self) -> dict:
        """Everything that a checkpoint holds: the scene, where the wheels stand, all arrays."""
        return {
            "scene": self.scene.describe(), "layout": self.layout,
            "model": self.model, "state": self.state, "work": self.work,
        }  # fmt: skip

    @classmethod
    def restored(cls, data: dict) -> "Loop":
        """The loop of a checkpoint's data."""
        loop = cls.__new__(cls)
        fields = data["scene"]
        loop.scene = Scene(**fields | {"rig": Rig.model_validate(fields["rig"])})
        loop.layout = data["layout"]
        if not np.isfinite(list(loop.layout.values())).all():
            raise ValueError("layout holds a value that is not a finite number")
        room = allocate(loop.scene)
        refuse_other_places(room[0], data["model"])
        if "tensioner_shift_m" in loop.layout:
            shift_wheel(room[0], loop.scene.rig, tensioner(loop.scene.rig), loop.layout["tensioner_shift_m"])
        refuse_other_model(room[0], data["model"])
        loop.model, loop.state, loop.work = (
            filled(part, data[name]) for part, name in zip(room, ("model", "state", "work"), strict=True)
        )
        loop._made()
        loop._sound()
        return loop


def _view(array: np.ndarray) -> np.ndarray:
    view = array.view()
    view.flags.writeable = False
    return view

"""Variables at the border of a co-simulation unit: inputs that a rig has, outputs, and one exchange after another."""

from collections.abc import Callable
from copy import copy
from math import inf, isfinite
from typing import NamedTuple

import numpy as np

from trackdyn.errors import InputError
from trackdyn.measure.sensor import readings
from trackdyn.model.constants import SPROCKET
from trackdyn.rig.layout import belt_around, belt_path, wheel_circles, wheel_names
from trackdyn.rig.validation import within
from trackdyn.scene.build import CARRIED
from trackdyn.scene.scene import LEAST_RAMP, LONGEST_RUN, Scene
from trackdyn.simulation.loop import Loop

LATEST = 1e9  # s; an importer's clock, whose rounding must stay far below a step
ROUNDING = 1e-12  # share of an input by which it may change and is the same
STATE = ("wanted", "torque", "speed_ramp", "now", "_applied", "_origin")  # of a unit, beside its loop


class Signal(NamedTuple):
    """A number that crosses the border: name, unit, what it is, and its value at the start."""

    name: str
    unit: str
    text: str
    start: float = 0.0


class Steering(NamedTuple):
    """An input: whether a scene has it, the signal, and what a new value does to a unit within an exchange (s)."""

    present: Callable[[Scene], bool]
    signal: Callable[[Scene], Signal]
    apply: Callable[["Unit", float, float], None]


def _limit(unit: "Unit", torque: float, exchange: float) -> None:
    if not 0.0 <= torque < inf:
        raise InputError(f"torque_limit = {torque:g} N m: must be finite and at least 0")
    drive = unit.loop.model.drive
    unit.loop._steer(drive._replace(motor=drive.motor._replace(torque=float(torque))))


def _push(unit: "Unit", force: float, exchange: float) -> None:
    if not isfinite(force):
        raise InputError(f"tensioner_force = {force:g} N: must be finite")
    unit.loop.arrays.model.carriers.force[:, 1] = force


def _drive(unit: "Unit", motor_rpm: float, exchange: float) -> None:
    unit.loop.drive(motor_rpm, max(unit.speed_ramp or exchange, LEAST_RAMP))


def _shift(unit: "Unit", shift: float, exchange: float) -> None:
    settled, travel = unit.settled_shift, unit.scene.rig.tension.travel
    if not abs(settled + shift) <= travel:
        raise InputError(
            f"tensioner_shift = {shift:g} m: must be between {-travel - settled:.4g} and "
            f"{travel - settled:.4g} m, the tensioner's travel from where the loop settled"
        )
    unit.loop.shift_tensioner(unit.settled_shift + shift)
    unit.locate_strands()


# Every input that some rig has; a unit has those that its own does.
STEERINGS = (
    Steering(
        lambda scene: True,
        lambda scene: Signal(
            "motor_rpm", "rev/min",
            "speed of the motor, at least 0; a new one is reached within the exchange or speed_ramp", scene.motor_rpm,
        ),
        _drive,
    ),
    Steering(
        lambda scene: scene.rig.drive is not None and scene.rig.drive.kind == "motor",
        lambda scene: Signal(
            "torque_limit", "N.m",
            "largest torque of the drive at the sprocket, which it gives while it is far from its speed",
            scene.rig.drive.torque,
        ),
        _limit,
    ),
    Steering(
        lambda scene: scene.tension == "forced",
        lambda scene: Signal(
            "tensioner_force", "N", "force that pushes the tensioning wheel along its line; taken at once",
            scene.rig.tension.force[0][1],
        ),
        _push,
    ),
    Steering(
        lambda scene: scene.tension not in CARRIED,
        lambda scene: Signal(
            "tensioner_shift", "m",
            "way of the tensioning wheel along its line from where the loop settled; taken at once",
        ),
        _shift,
    ),
)  # fmt: skip


class Unit:
    """A loop that takes inputs and gives outputs from exchange to exchange.

    Parameters
    ----------
    scene : Scene
        A loop on its wheels, in the plane. With a lead-in it runs at speed at time 0, without one it rests.

    Attributes
    ----------
    inputs, outputs : list of Signal
    wanted : dict
        Present value of every input by name; to be written between exchanges.
    speed_ramp : float
        Time in which a new speed is reached, s; 0: within the exchange.
    now : float or None
        Time of the importer, s; None until the first exchange, which says when the unit starts.

    Raises
    ------
    InputError
        A belt, a free loop or motion in space has no such unit.
    """

    def __init__(self, scene: Scene):
        for field, refused, accepted in (("chain", "belt", "double_pin"), ("loop", "free", "on_wheels")):
            if getattr(scene, field) == refused:
                raise InputError(f"scene: {field} = {refused!r}: a unit needs a chain on wheels; use {accepted!r}")
        if scene.fidelity["space"].setting != "planar":
            raise InputError("scene: space = 'spatial': a unit moves in the plane; align the wheels")
        self.scene = scene
        self.names = wheel_names(scene.rig)
        self.order = belt_around(scene.rig)[1]
        self.steerings = [steering for steering in STEERINGS if steering.present(scene)]
        self.inputs = [steering.signal(scene) for steering in self.steerings]
        self.wanted = {signal.name: signal.start for signal in self.inputs}
        self.speed_ramp = 0.0
        self.now: float | None = None
        names = [self.names[i] for i in self.order]
        strands = [f"{name}_to_{names[(i + 1) % len(names)]}" for i, name in enumerate(names)]
        self.outputs = [
            *(Signal(f"tension_{name}", "N", "force in the chain in the middle of this strand") for name in strands),
            Signal(
                "sprocket_torque",
                "N.m",
                "mean torque of the sprocket on the chain over the exchange: its work over the turn; 0 while it stands",
            ),
            *(Signal(f"rate_{name}", "rad/s", "angular velocity; negative is clockwise") for name in self.names),
            Signal("sensor_ax", "g", "what the sensor reports along its link (Eq. 40), mean over the exchange"),
            Signal("sensor_ay", "g", "what the sensor reports across its link (Eq. 40), mean over the exchange"),
            Signal("gap", "m", "distance of the two pins of the cut joint"),
        ]
        self._applied = dict(self.wanted)
        self.loop: Loop | None = None

    def start(self) -> None:
        """Lay, tension and settle the loop, and run up to speed if the scene has a lead-in."""
        scene = self.scene.with_(motor_rpm=self.wanted["motor_rpm"])
        self.loop = Loop(scene)
        self._applied = self.wanted | {"motor_rpm": scene.motor_rpm}
        self.settled_shift = self.loop.layout["tensioner_shift_m"]
        self.locate_strands()
        if shift := self.wanted.get("tensioner_shift"):
            _shift(self, shift, 0.0)
        if scene.lead_in:
            self.loop.advance(scene.ramp + scene.lead_in)
        self.now, self._origin = None, 0.0
        self._account(0.0)

    def locate_strands(self) -> None:
        """Find the strands again, where the wheels are now."""
        wheels = self.loop.model.wheels
        circles = wheel_circles(self.scene.rig, body=float(self.loop.model.chain.length[0]))[self.order]
        circles[:, :2] = np.column_stack([wheels.x, wheels.y])[self.order]
        self.strands = Strands(circles, [self.names[i] for i in self.order])

    def step(self, time: float, exchange: float) -> None:
        """Go on from ``time`` of the importer by an exchange, both s, to the nearest step of the loop.

        Raises
        ------
        InputError
            The unit has not started or stands at another time, an input is out of range, or the exchange is shorter
            than the loop's step.
        DivergenceError
            The loop left the physical range.
        """
        if self.loop is None:
            raise InputError("the unit cannot step before its initialisation; enter and exit that mode first")
        step = self.loop.model.step
        within("time", time, -LONGEST_RUN, LATEST, " s")
        if self.now is not None and not abs(time - self.now) < step / 2:
            raise InputError(f"time = {time:.9g} s: must be the time of the unit, {self.now:.9g} s")
        if not step / 2 <= exchange <= LONGEST_RUN:
            raise InputError(
                f"exchange = {exchange:g} s: must be between the step of the loop, {step:g} s, and {LONGEST_RUN:g} s"
            )
        if self.now is None:
            self._origin = time - self.loop.time
        within("speed_ramp", self.speed_ramp, 0.0, LONGEST_RUN, " s")
        for steering, signal in zip(self.steerings, self.inputs, strict=True):
            value, applied = self.wanted[signal.name], self._applied[signal.name]
            if not abs(value - applied) <= ROUNDING * abs(applied):  # importers interpolate a constant input, too
                steering.apply(self, value, exchange)
                self._applied[signal.name] = value
        end = round((time + exchange - self._origin) / step)
        before = self.loop.energy["sprocket_work"], float(self.loop.state.wheel_angle[SPROCKET])
        self.loop.step(max(end - int(self.loop.state.steps[0]), 1))
        if len(self.loop.model.carriers.wheel):
            self.locate_strands()
        self.now = time + exchange
        turned = float(self.loop.state.wheel_angle[SPROCKET]) - before[1]
        self._account((self.loop.energy["sprocket_work"] - before[0]) / turned if turned else 0.0)

    def _account(self, torque: float) -> None:
        self.torque = torque
        loop, rig = self.loop, self.scene.rig
        tension = self.strands.tension(loop.pins[1:], loop.joint_forces)
        felt = readings(loop.sensor_acceleration[0], rig, rig.first_sensor.range)
        values = [*tension, torque, *loop.wheel_rates, *felt, loop.gap]
        self.values = dict(zip((signal.name for signal in self.outputs), map(float, values), strict=True))

    # -- keeping -------------------------------------------------------------------------------------------------------

    def keep(self) -> dict:
        """The present state, to which `back` returns."""
        return {name: copy(getattr(self, name)) for name in STATE} | {"loop": self.loop.copy()}

    def back(self, saved: dict) -> None:
        """Return to a state that `keep` gave; it may be returned to again."""
        for name in STATE:
            setattr(self, name, copy(saved[name]))
        self.loop = saved["loop"].copy()
        self.locate_strands()
        self._account(self.torque)


class Strands:
    """The strands of a loop on its wheels, where the wheels are now.

    Parameters
    ----------
    circles : (w, 3) array
        Centres of the wheels and radii of the pins' path on them, m, in the order in which the chain meets them.
    names : list of str
        Of the wheels, in the same order.

    Attributes
    ----------
    names : list of (str, str)
        Wheels that a strand leaves and reaches.
    middle, along : (w, 2) arrays
        Middle of each strand (m) and its direction.
    """

    def __init__(self, circles, names):
        path = belt_path(circles, names)
        self.names = [(name, names[(i + 1) % len(names)]) for i, name in enumerate(names)]
        self.along = np.column_stack([np.cos(path.heading), np.sin(path.heading)])
        self.middle = path.along(0.5 * (path.start[1::2] + path.start[2::2]))[0]

    def tension(self, pins, forces) -> np.ndarray:
        """(w,) force in the chain in the middle of each strand, N.

        A value between those of the joints before and behind the middle, by their places along the strand: it does not
        jump when another joint comes nearest. The chain may sag by less than half the way to its other strand. ``pins``
        are (n, 2) joints, m, ``forces`` the (n, 2) force in each, N.
        """
        size, n = np.hypot(*np.transpose(forces)), len(pins)
        tensions = np.empty(len(self.middle))
        for k, (middle, along) in enumerate(zip(self.middle, self.along, strict=True)):
            away = pins - middle
            near = (np.argmin(np.hypot(*away.T)) + np.arange(-1, 2)) % n
            tensions[k] = np.interp(0.0, away[near] @ along, size[near])  # joints are numbered along the run
        return tensions

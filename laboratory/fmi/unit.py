"""Variables at the border of a co-simulation unit: inputs that a rig has, outputs, and one exchange after another."""

from math import inf, isfinite
from typing import NamedTuple

import numpy as np

from trackdyn.errors import InputError
from trackdyn.measure.sensor import readings
from trackdyn.model.constants import SPROCKET
from trackdyn.rig.layout import belt_around, belt_path, wheel_circles, wheel_names
from trackdyn.rig.rig import Rig
from trackdyn.rig.validation import within
from trackdyn.scene.build import CARRIED
from trackdyn.scene.scene import LEAST_RAMP, LONGEST_RUN, Scene
from trackdyn.simulation.loop import Loop

LATEST = 1e9  # s; an importer's clock, whose rounding must stay far below a step
ROUNDING = 1e-12  # share of an input by which it may change and is the same


class Signal(NamedTuple):
    """A number that crosses the border: name, unit, what it is, and its value at the start."""

    name: str
    unit: str
    text: str
    start: float = 0.0


def inputs_of(scene: Scene) -> list[Signal]:
    """Inputs that the unit of a scene has."""
    speed = "speed of the motor, at least 0; a new one is reached within the exchange or speed_ramp"
    signals, rig = [Signal("motor_rpm", "rev/min", speed, scene.motor_rpm)], scene.rig
    if rig.drive is not None and rig.drive.kind == "motor":
        limit = "largest torque of the drive at the sprocket, which it gives while it is far from its speed"
        signals.append(Signal("torque_limit", "N.m", limit, rig.drive.torque))
    if scene.tension == "forced":
        force = "force that pushes the tensioning wheel along its line; taken at once"
        signals.append(Signal("tensioner_force", "N", force, rig.tension.force[0][1]))
    if scene.tension not in CARRIED:
        shift = "way of the tensioning wheel along its line from where the loop settled; taken at once"
        signals.append(Signal("tensioner_shift", "m", shift))
    return signals


def outputs_of(rig: Rig) -> list[Signal]:
    """Outputs of the unit of a rig."""
    names, order = wheel_names(rig), belt_around(rig)[1]
    strands = [f"{names[i]}_to_{names[k]}" for i, k in zip(order, np.roll(order, -1), strict=True)]
    torque = "mean torque of the sprocket on the chain over the exchange: its work over the turn; 0 while it stands"
    return [
        *(Signal(f"tension_{name}", "N", "force in the chain in the middle of this strand") for name in strands),
        Signal("sprocket_torque", "N.m", torque),
        *(Signal(f"rate_{name}", "rad/s", "angular velocity; negative is clockwise") for name in names),
        Signal("sensor_ax", "g", "what the sensor reports along its link (Eq. 40), mean over the exchange"),
        Signal("sensor_ay", "g", "what the sensor reports across its link (Eq. 40), mean over the exchange"),
        Signal("gap", "m", "distance of the two pins of the cut joint"),
    ]


class Unit:
    """A loop that takes inputs and gives outputs from exchange to exchange; a deep copy goes on from the same state.

    Parameters
    ----------
    scene : Scene
        A loop on its wheels, in the plane. With a lead-in it runs at speed at time 0, without one it rests.

    Attributes
    ----------
    inputs, outputs : list of Signal
    wanted, values : dict
        Present value of every input, to be written between exchanges, and of every output, by name.
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
        self.scene, self.order = scene, belt_around(scene.rig)[1]
        self.inputs, self.outputs = inputs_of(scene), outputs_of(scene.rig)
        self.wanted = {signal.name: signal.start for signal in self.inputs}
        self.values = {signal.name: signal.start for signal in self.outputs}
        self.speed_ramp = 0.0
        self.now: float | None = None
        self.loop: Loop | None = None

    def start(self) -> None:
        """Lay, tension and settle the loop, and run up to speed if the scene has a lead-in."""
        scene = self.scene.with_(motor_rpm=self.wanted["motor_rpm"])
        self.loop = Loop(scene)
        self._applied = self.wanted | {"motor_rpm": scene.motor_rpm}
        self.settled_shift = self.loop.layout["tensioner_shift_m"]
        self._locate_strands()
        if self.wanted.get("tensioner_shift"):
            self._apply("tensioner_shift", 0.0)
        if scene.lead_in:
            self.loop.advance(scene.ramp + scene.lead_in)
        self.now, self._origin = None, 0.0
        self._read(0.0)

    def _locate_strands(self) -> None:
        """Find the strands where the wheels are now."""
        wheels, names = self.loop.model.wheels, wheel_names(self.scene.rig)
        circles = wheel_circles(self.scene.rig, body=float(self.loop.model.chain.length[0]))
        circles[:, :2] = np.column_stack([wheels.x, wheels.y])
        self.strands = Strands(circles[self.order], [names[i] for i in self.order])

    def _apply(self, name: str, exchange: float) -> None:
        """Give the loop the wanted value of an input for an exchange (s)."""
        value, loop = self.wanted[name], self.loop
        if name == "motor_rpm":
            loop.drive(value, max(self.speed_ramp or exchange, LEAST_RAMP))
        elif name == "torque_limit":
            if not 0.0 <= value < inf:
                raise InputError(f"torque_limit = {value:g} N m: must be finite and at least 0")
            drive = loop.model.drive
            loop._steer(drive._replace(motor=drive.motor._replace(torque=float(value))))
        elif name == "tensioner_force":
            if not isfinite(value):
                raise InputError(f"tensioner_force = {value:g} N: must be finite")
            loop.arrays.model.carriers.force[:, 1] = value
        else:
            settled, travel = self.settled_shift, self.scene.rig.tension.travel
            if not abs(settled + value) <= travel:
                raise InputError(
                    f"tensioner_shift = {value:g} m: must be between {-travel - settled:.4g} and "
                    f"{travel - settled:.4g} m, the tensioner's travel from where the loop settled"
                )
            loop.shift_tensioner(settled + value)
            self._locate_strands()
        self._applied[name] = value

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
        for name, value in self.wanted.items():
            applied = self._applied[name]
            if not abs(value - applied) <= ROUNDING * abs(applied):  # importers interpolate a constant input, too
                self._apply(name, exchange)
        end = round((time + exchange - self._origin) / step)
        work, angle = self.loop.energy["sprocket_work"], float(self.loop.state.wheel_angle[SPROCKET])
        self.loop.step(max(end - int(self.loop.state.steps[0]), 1))
        if len(self.loop.model.carriers.wheel):
            self._locate_strands()
        self.now = time + exchange
        turned = float(self.loop.state.wheel_angle[SPROCKET]) - angle
        self._read((self.loop.energy["sprocket_work"] - work) / turned if turned else 0.0)

    def _read(self, torque: float) -> None:
        """Set the outputs from the loop and the mean ``torque`` of the sprocket (N m)."""
        loop, rig = self.loop, self.scene.rig
        tension = self.strands.tension(loop.pins[1:], loop.joint_forces)
        felt = readings(loop.sensor_acceleration[0], rig, rig.first_sensor.range)
        values = [*tension, torque, *loop.wheel_rates, *felt, loop.gap]
        self.values = dict(zip(self.values, map(float, values), strict=True))


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
    middle, along : (w, 2) arrays
        Middle of each strand (m) and its direction.
    """

    def __init__(self, circles, names):
        path = belt_path(circles, names)
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

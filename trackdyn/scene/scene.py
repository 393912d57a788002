"""Scene: a rig, its operating conditions and recording options, and the model built from them."""

from functools import cached_property
from math import ceil, nan, pi
from typing import Annotated, Any, NamedTuple, NoReturn

import numpy as np
from pydantic import BeforeValidator, Field

from trackdyn.chain.kinematics import SLOW
from trackdyn.inputs.errors import InputError
from trackdyn.inputs.notebook import html_table
from trackdyn.inputs.validation import FROM_THE_RIG, FrozenDict, Positive, Section, plain_count, plain_number, shown
from trackdyn.model.constants import Model
from trackdyn.rig.layout import braked_wheel, wheel_names
from trackdyn.rig.rig import Rig
from trackdyn.rig.sections import SensorParameters
from trackdyn.scene.build import build_model
from trackdyn.scene.choices import Choices, Decision, check_choices, decide, of_rig
from trackdyn.scene.choices import preset as preset_fields
from trackdyn.scene.step import LEAST_STEP, allowed_step, round_step, usual_step

Number = Annotated[float, BeforeValidator(plain_number)]
LONGEST_RUN, LEAST_RAMP = 36000.0, 1e-6  # longest recording, lead-in or ramp; shortest ramp, s
# largest load, N, as of a rig file; rate of its wheel (rad/s) from which its brake has 99.5 % of its torque
LARGEST_LOAD, BRAKES_FROM = 1e7, 3 * SLOW
FASTEST = 1e5  # rev/min; the tests run 10,000
MOST_STEPS = 1e10  # a day of computing
MARGIN = 0.7  # share of the step limit at the pre-tension: with a larger ring the loop settles tighter

# Fields that concern only the record.
RECORD_FIELDS = ("duration", "lead_in", "ramp", "pitches", "frame_interval", "contact_log", "every_link")


def _pitches(value: Any) -> Any:
    """Return a list, tuple or array of whole numbers as a tuple; raise `ValueError` for other values."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, (list, tuple)) or any(
        isinstance(pitch, bool) or not isinstance(pitch, (int, np.integer)) for pitch in value
    ):
        raise ValueError(f"= {shown(value)}: must be a list of whole numbers, such as (1, 2)")
    return tuple(int(pitch) for pitch in value)


def _flag(value: Any) -> Any:
    if not isinstance(value, (bool, np.bool_)):
        raise ValueError(f"= {shown(value)}: must be True or False")
    return bool(value)


def _whole(number: float) -> bool:
    return abs(number - round(number)) <= 1e-6


class Periods(NamedTuple):
    """Periods of a loop at a constant speed, s; NaN at rest."""

    turn: float  # revolution of the sprocket
    loop: float  # revolution of the loop
    passage: float  # time in which the chain moves by one pitch
    loop_hz: float  # revolutions of the loop a second, Hz; 0 at rest

    @classmethod
    def at(cls, rig: Rig, motor_rpm: float) -> "Periods":
        """Return the periods of a rig at a motor speed, rev/min."""
        ratio, teeth, pitches = rig.sprocket.transmission_ratio, rig.sprocket.teeth, rig.chain.pitches
        if not motor_rpm:
            return cls(nan, nan, nan, 0.0)
        turn, loop_hz = 60 * ratio / motor_rpm, motor_rpm / ratio / 60 * teeth / pitches
        return cls(turn, turn * pitches / teeth, 1.0 / (loop_hz * pitches), loop_hz)


class Scene(Choices):
    """Description of a run: rig, speed, choices of fidelity (`trackdyn.scene.choices`) and recording options.

    ``preset`` sets integrator and step (`trackdyn.scene.choices.PRESETS`), by default ``standard``. Ring, load, chain,
    tension, drag and bushing law are by default the rig's.
    """

    #: Motor speed, rev/min; the sprocket turns clockwise at ``motor_rpm / ratio``.
    motor_rpm: Number
    #: Radius of the sprocket's rubber ring, m, None for no ring; the rig's own by default.
    ring_radius: Number | None = of_rig(lambda rig: rig.ring_radius)
    #: Pull of the chain, N: the difference of the tensions of the two strands at the wheel that it brakes
    #: (`trackdyn.rig.layout.braked_wheel`), in addition to the drag of all wheels; the rig's own by default. The loop
    #: is tensioned and settles without it.
    load: Number = of_rig(lambda rig: rig.load)
    #: Recorded time, s.
    duration: Number = 90.0
    #: Time at constant speed before the record begins, s.
    lead_in: Number = 5.0
    #: Start-up ramp of the sprocket speed, s.
    ramp: Number = 1.0
    #: Requested time step, s; the sample interval must be a multiple of it. None, by default, is that of the preset, or
    #: a smaller one that was tried on the rig or that its contacts need at the pre-tension (`time_step`), or at the
    #: tension at which the loop settles.
    step: Number | None = None
    #: Pitches whose contacts are recorded (1-based); if empty those of the sensors.
    pitches: Annotated[tuple[int, ...], BeforeValidator(_pitches)] = ()
    #: Time between recorded configurations, s; none with 0.
    frame_interval: Number = 0.0
    #: Log every contact with the sprocket.
    contact_log: Annotated[bool, BeforeValidator(_flag)] = True
    #: Record a sensor on every link as well, at the place of the rig's first one, and the contacts of every pitch.
    every_link: Annotated[bool, BeforeValidator(_flag)] = False

    def __init__(
        self, rig: Rig, motor_rpm: float, ring_radius: Any = FROM_THE_RIG, *, preset: str | None = None, **fields: Any
    ):
        """Make a scene; `InputError` names an impossible field."""
        if preset is not None:
            bundle = preset_fields(preset)
            if preset == "standard":
                del bundle["step"]  # the usual one, or less
            fields = bundle | fields
        if ring_radius is not FROM_THE_RIG:
            fields["ring_radius"] = ring_radius
        super().__init__(rig=rig, motor_rpm=motor_rpm, **fields)

    def model_post_init(self, context: Any) -> None:
        """Raise `InputError` for impossible values, in one sentence."""
        self._check_times()
        check_choices(self)
        self._check_loop()
        steps, most = (self.lead_in + self.ramp + self.duration) / self.time_step, f"{MOST_STEPS:.0g}"
        if steps > MOST_STEPS:
            raise InputError(f"scene: step = {self.time_step}: makes {steps:.2g} steps; a run may have at most {most}")

    def _refuse(self, field: str, remedy: str) -> NoReturn:
        raise InputError(f"scene: {field} = {shown(getattr(self, field))}: {remedy}")

    def _check_times(self) -> None:
        sample = 1.0 / self.rig.rate
        for field, least, most, unit in (
            ("motor_rpm", 0.0, FASTEST, "rev/min (clockwise)"),
            ("duration", sample, LONGEST_RUN, "s"),
            ("lead_in", 0.0, LONGEST_RUN, "s"),
            ("ramp", LEAST_RAMP, LONGEST_RUN, "s"),
            ("load", 0.0, LARGEST_LOAD, "N"),
        ):
            value = getattr(self, field)
            if not least <= value <= most:
                self._refuse(field, f"must be between {least:g} and {most:g} {unit}")
        step = sample if self.step is None else self.step
        if not (LEAST_STEP <= step <= sample * (1 + 1e-6) and _whole(sample / step)):
            close = round_step(step if LEAST_STEP < step < sample else sample / 20, sample)
            remedy = f"must divide the sample interval, {sample} s, and be at least {LEAST_STEP:g} s"
            self._refuse("step", f"{remedy}, such as {close:.7g} s")
        between = self.frame_interval / sample
        if between and not (between > 0.5 and self.frame_interval <= self.duration and _whole(between)):
            remedy = f"must be 0 or a multiple of the sample interval, {sample} s, no longer than the duration"
            self._refuse("frame_interval", remedy)

    def _check_loop(self) -> None:
        if self.ring_radius is not None:
            if self.ring_radius <= 0:
                self._refuse("ring_radius", "must be a radius in m, or null (command line: none) for no ring")
            low, high = self.ring_range(self.rig)
            if not low - 1e-9 <= self.ring_radius <= high + 1e-9:  # the bounds themselves are allowed, rounded or not
                bounds = f"{low:.4f} m (touches no link) and {high:.4f} m (overlaps the chain)"
                self._refuse("ring_radius", f"must be between {bounds}, or null (command line: none) for no ring")
        if self.load and 0 < self.motor_rpm * self.braked_rate < BRAKES_FROM:
            wheel = f"the {wheel_names(self.rig)[self.braked_wheel[0]]} at motor_rpm = {self.motor_rpm:g}"
            remedy = f"use a speed of {BRAKES_FROM / self.braked_rate:.3g} rev/min or more, or no load"
            self._refuse("load", f"its brake fades on a wheel that hardly turns, as {wheel}; {remedy}")
        for pitch in self.pitches:
            if not 1 <= pitch <= self.rig.chain.pitches:
                raise InputError(f"scene: pitches = {pitch!r}: must be between 1 and {self.rig.chain.pitches}")
            if self.pitches.count(pitch) > 1:
                self._refuse("pitches", f"holds {pitch} twice; leave one of them out")

    @cached_property
    def sensors(self) -> dict[str, SensorParameters]:
        """Recorded sensors by name: the rig's, and with ``every_link`` one on each body of the first one's kind."""
        first = self.rig.first_sensor
        pitches = range(1, self.rig.chain.pitches + 1) if self.every_link else ()
        of_links = {f"{first.body} {pitch}": first.model_copy(update={"pitch": pitch}) for pitch in pitches}
        return FrozenDict(self.rig.sensors | of_links)

    @property
    def recorded_pitches(self) -> tuple[int, ...]:
        """Pitches whose contacts are recorded, 1-based."""
        return self.pitches or tuple(sorted({sensor.pitch for sensor in self.sensors.values()}))

    @property
    def bodies(self) -> int:
        """Number of rigid bodies of the chain."""
        return self.rig.chain.pitches * (2 if self.chain == "double_pin" else 1)

    @cached_property
    def fidelity(self) -> dict[str, Decision]:
        """Setting and reason of every choice."""
        return FrozenDict(decide(self))

    @staticmethod
    def ring_range(rig: Rig) -> tuple[float, float]:
        """Return the smallest and the largest ring radius of a rig, m.

        Links do not touch a smaller ring, with the arcs of connectors at the bottom of their grooves; the wrap of a
        larger one needs more length than the tensioner's travel gives.
        """
        lower = max(rig.chain.link_thickness / 2 - rig.chain.connector_radius, 0.0)
        bottom = float(rig.groove_profile.joints()[:, 1].min())
        return bottom - lower, rig.sprocket.ring_radius + 0.4 * rig.tension.travel

    @property
    def sprocket_rate(self) -> float:
        """Angular velocity of the sprocket, rad/s; negative is clockwise."""
        return -self.motor_rpm / self.rig.sprocket.transmission_ratio * 2 * pi / 60

    @cached_property
    def braked_wheel(self) -> tuple[int, float]:
        """Index of the wheel that a load brakes, and the lever (m) of the chain about it (`layout.braked_wheel`)."""
        return braked_wheel(self.rig, self.chain)

    @property
    def braked_rate(self) -> float:
        """Rate (rad/s) of that wheel for a motor speed of 1 rev/min, where nothing slides on it."""
        return self.rig.pitch / Periods.at(self.rig, 1.0).passage / self.braked_wheel[1]

    @property
    def periods(self) -> Periods:
        """Periods of sprocket, loop and pitch at nominal speed; ``n / (60 ratio) m / N`` Hz."""
        return Periods.at(self.rig, self.motor_rpm)

    @cached_property
    def time_step(self) -> float:
        """Step at the pre-tension, s: the requested one, else the usual or the largest allowed one."""
        step = usual_step(self) if self.step is None else self.step
        belt = self.chain == "belt"  # a path without equations
        return step if belt else allowed_step(self, step, self.rig.tension.pre_tension, MARGIN)

    @cached_property
    def _model(self) -> Model:
        return build_model(self)

    def model_of_step(self, step: float) -> Model:
        """Return the model of the scene with a step (s); its arrays are shared: copy them before a change."""
        return self._model._replace(step=step, stride=round(1.0 / self.rig.rate / step))

    @property
    def model(self) -> Model:
        """Model of the scene at `time_step`."""
        return self.model_of_step(self.time_step)

    def with_(self, **changes: Any) -> "Scene":
        """Return a scene with some fields replaced; defaults are computed anew from the rig and the speed.

        Raises `InputError`: a field does not exist, is out of range, or contradicts another one.
        """
        return Scene(**{name: getattr(self, name) for name in self.model_fields_set} | changes)

    @property
    def summary(self) -> str:
        """Return one line: speed, ring, load, length and step."""
        ring = "no ring" if self.ring_radius is None else f"ring of {self.ring_radius:g} m"
        load = f"load of {self.load:g} N, " if self.load else ""
        return f"{self.motor_rpm:g} rev/min, {ring}, {load}{self.duration:g} s in steps of {self.time_step:g} s"

    def rows(self) -> dict[str, str]:
        """Return the scene as text by name, for a notebook."""
        ring = "none" if self.ring_radius is None else f"{self.ring_radius:g} m"
        times = {name.replace("_", "-"): f"{getattr(self, name):g} s" for name in ("duration", "lead_in", "ramp")}
        choices = {name.replace("_", " "): choice.setting.replace("_", " ") for name, choice in self.fidelity.items()}
        head = {"rig": self.rig.summary, "motor speed": f"{self.motor_rpm:g} rev/min", "ring radius": ring}
        if self.load:
            head["load"] = f"{self.load:g} N, by a brake on the {wheel_names(self.rig)[self.braked_wheel[0]]}"
        return head | times | {"step": f"{self.time_step:g} s"} | choices

    def _repr_html_(self) -> str:
        return html_table("Scene", self.rows())

    def __repr__(self) -> str:
        return f"<Scene: {self.summary}; {self.rig!r}>"

    __str__ = __repr__

    def describe(self) -> dict:
        """Return the fields and the rig as plain data, for provenance."""
        return self.model_dump(mode="json")


class StopRule(Section):
    """Tolerances of contacts at which a record ends: half of the 95 % intervals.

    The defaults are those of the ring study: a tenth of the narrowest tolerance of claims on shares (2 points), and
    less than a twentieth of that on forces (15 %).
    """

    share_pct: Positive = 0.2  # of shares, points of a turn
    force: Positive = 0.006  # of RMS forces, relative
    # least number (13.0 in a table of rows); None: the teeth of the sprocket, so that every groove is visited
    passages: Annotated[int, Field(ge=1), BeforeValidator(plain_count)] | None = None
    longest_turns: Annotated[float, Field(ge=1, le=1e6)] = 4  # of the loop, after which a record ends

    def visits(self, rig: Rig) -> int:
        """Return the least number of passages on a rig."""
        return self.passages or rig.sprocket.teeth


def steady_fields(rig: Rig, rpm: float, rule: StopRule) -> dict[str, float]:
    """Return fields of a scene that records from the end of its ramp on, for as long as ``rule`` allows."""
    seconds = rule.longest_turns * Periods.at(rig, rpm).loop
    if not seconds <= LONGEST_RUN:
        turns = f"{rule.longest_turns:g} turns of the loop take {seconds:.3g} s"
        raise InputError(f"motor_rpm = {rpm:g}: {turns}, a record at most {LONGEST_RUN:g} s; use a higher speed")
    return {"lead_in": 0.0, "duration": ceil(seconds * rig.rate) / rig.rate}

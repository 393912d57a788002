"""A scene: the rig, what it is asked to do, and the model that this requires."""

from dataclasses import dataclass, replace
from math import pi

import numpy as np

from trackdyn.chain.model import Chain
from trackdyn.contact.laws import Law, make_law
from trackdyn.contact.tooth import make_tooth
from trackdyn.errors import InputError
from trackdyn.integrate.limits import step_limits
from trackdyn.model import Drive, Model, Sensor, Wheels
from trackdyn.parameters.groove import coarse_groove
from trackdyn.parameters.layout import wheel_circles
from trackdyn.parameters.rig import Rig, Surface

TOOTH_CONTACTS = ("ten_arcs", "three_surfaces")


@dataclass(frozen=True)
class Scene:
    """What a run is asked to do.

    Attributes
    ----------
    rig : Rig
        Parameters.
    motor_rpm : float
        Motor speed, rev/min; the sprocket turns clockwise at ``motor_rpm / ratio``.
    ring_radius : float or None
        Radius of the sprocket's rubber ring, m; None: no ring.
    duration : float
        Recorded time, s.
    lead_in : float
        Time at constant speed before the record begins, s.
    ramp : float
        Start-up ramp of the sprocket speed, s.
    step : float
        Time step, s; the sample interval must be a multiple of it.
    pitches : tuple of int
        Pitches whose contacts are recorded (1-based); empty: the sensor's.
    frame_interval : float
        Time between recorded configurations, s; 0: none.
    spells : bool
        Log every contact with the sprocket.
    tooth_contact : str
        ``ten_arcs``, or ``three_surfaces``: left, seating and right surface, of the kind in Ref. [2].
    """

    rig: Rig
    motor_rpm: float
    ring_radius: float | None = 0.308
    duration: float = 90.0
    lead_in: float = 5.0
    ramp: float = 1.0
    step: float = 1e-4
    pitches: tuple[int, ...] = ()
    frame_interval: float = 0.0
    spells: bool = True
    tooth_contact: str = "ten_arcs"

    def __post_init__(self):
        def refuse(field, value, remedy):
            raise InputError(f"scene: {field} = {value!r} is not accepted: {remedy}")

        for field in ("motor_rpm", "duration", "lead_in", "ramp", "step", "frame_interval"):
            value = getattr(self, field)
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
                refuse(field, value, "a finite number is needed")
        if self.motor_rpm < 0:
            refuse("motor_rpm", self.motor_rpm, "the chain runs clockwise; 0 or more rev/min would do")
        sample = 1.0 / self.rig.sensor.rate
        if self.duration < sample:
            refuse("duration", self.duration, f"at least one sample, {sample} s, would do")
        if self.duration > 36000:
            refuse("duration", self.duration, "at most 36000 s (ten hours) would do")
        if self.lead_in < 0 or self.frame_interval < 0:
            refuse(
                "lead_in" if self.lead_in < 0 else "frame_interval", min(self.lead_in, self.frame_interval), "0 or more"
            )
        if self.ramp <= 0:
            refuse("ramp", self.ramp, "a start-up ramp of more than 0 s would do")
        if self.step <= 0 or abs(sample / self.step - round(sample / self.step)) > 1e-6:
            refuse(
                "step",
                self.step,
                f"a whole fraction of the sample interval {sample} s would do, such as {sample / 20} s",
            )
        if abs(self.frame_interval / sample - round(self.frame_interval / sample)) > 1e-6:
            refuse("frame_interval", self.frame_interval, f"a multiple of the sample interval {sample} s would do")
        radius = self.ring_radius
        if radius is not None:
            if isinstance(radius, bool) or not isinstance(radius, (int, float)) or not radius > 0:
                refuse("ring_radius", radius, "a radius in m or null for no ring would do")
            low, high = self.ring_range(self.rig)
            if not low <= radius <= high:
                refuse(
                    "ring_radius",
                    radius,
                    f"a ring of more than {high:.4f} m overlaps the chain of this loop and one of less than {low:.4f} m "
                    "never touches it; null means no ring",
                )
        for pitch in self.pitches:
            if not 1 <= pitch <= self.rig.chain.pitches:
                refuse("pitches", pitch, f"pitches 1 to {self.rig.chain.pitches} exist")
        if self.tooth_contact not in TOOTH_CONTACTS:
            refuse("tooth_contact", self.tooth_contact, f"{' or '.join(TOOTH_CONTACTS)} would do")
        limits = step_limits(build_model(self), self.rig.tension.pre_tension)
        name, limit = min(limits.items(), key=lambda item: item[1])
        if self.step > limit:
            refuse("step", self.step, f"too large for the {name}; at most {limit:.2g} s would do")

    @staticmethod
    def ring_range(rig: Rig) -> tuple[float, float]:
        """Least and greatest ring radius that the loop allows, m.

        Below the least one the links ride on the teeth alone; above the greatest one the extra
        length of the wrap exceeds what the tensioner's travel gave.
        """
        groove = rig.groove_profile
        return float(groove.joints()[:, 1].min()), rig.sprocket.ring_radius + 0.4 * rig.tension.travel

    @property
    def sprocket_rate(self) -> float:
        """Angular velocity of the sprocket, rad/s; negative is clockwise."""
        return -self.motor_rpm / self.rig.sprocket.transmission_ratio * 2 * pi / 60

    @property
    def loop_frequency(self) -> float:
        """Revolutions of the loop per second: ``n / (60 ratio) m / N``."""
        sprocket = self.motor_rpm / self.rig.sprocket.transmission_ratio / 60
        return sprocket * self.rig.sprocket.teeth / self.rig.chain.pitches

    @property
    def stride(self) -> int:
        """Steps in a sample interval."""
        return round(1.0 / self.rig.sensor.rate / self.step)

    def with_(self, **changes) -> "Scene":
        """A scene with some fields replaced."""
        return replace(self, **changes)

    def describe(self) -> dict:
        """Plain data for provenance."""
        data = {name: value for name, value in self.__dict__.items() if name != "rig"}
        return data | {"pitches": list(self.pitches), "rig": self.rig.model_dump()}


def _law(rig: Rig, surface: Surface) -> Law:
    return make_law(
        surface.contact_length,
        rig.composite_modulus(surface),
        surface.restitution,
        surface.friction_static,
        surface.friction_dynamic,
        surface.transition_velocity,
        rig.impact.speed_floor,
        rig.impact.factor_limit,
    )


def build_chain(rig: Rig) -> Chain:
    """Links and connectors in turn, mass centres in the middle of the pins."""
    c, n = rig.chain, rig.chain.pitches
    length = np.tile([c.link_length, rig.connector_length], n)
    return Chain(
        length,
        np.tile([c.link_mass, c.connector_mass], n),
        np.tile([c.link_inertia, c.connector_inertia], n),
        length / 2,
        np.zeros(2 * n),
        rig.bushing.stiffness,
        rig.bushing.damping,
        rig.bushing.free_angle,
        rig.gravity,
    )


def build_model(scene: Scene, shift: float = 0.0) -> Model:
    """The model that a scene requires, the tensioning wheel shifted by ``shift`` (m)."""
    rig = scene.rig
    circles = wheel_circles(rig, shift, surface=True)
    if scene.ring_radius is not None:
        circles[0, 2] = scene.ring_radius
    wheels = Wheels(
        np.array([int(scene.ring_radius is not None), 1, 1]),
        *np.ascontiguousarray(circles.T),
        np.array([0.0, rig.idler.inertia, rig.road_wheel.inertia]),
        np.array([0.0, rig.idler.bearing_drag, rig.road_wheel.bearing_drag]),
        rig.chain.link_thickness / 2,
        _law(rig, rig.ring_contact),
        _law(rig, rig.wheel_contact),
    )
    groove = rig.groove_profile if scene.tooth_contact == "ten_arcs" else coarse_groove(rig.groove_profile)
    tooth = make_tooth(groove, rig.chain.connector_radius, _law(rig, rig.tooth_contact))
    sensor = Sensor(2 * (rig.sensor.pitch - 1), float(rig.sensor.x), float(rig.sensor.y))
    return Model(
        build_chain(rig), tooth, wheels, Drive(float(scene.sprocket_rate), float(scene.ramp)), sensor, float(scene.step)
    )

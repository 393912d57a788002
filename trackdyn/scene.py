"""A scene: the rig, what it is asked to do, and the model that this requires."""

from dataclasses import dataclass, replace
from math import pi

import numpy as np

from trackdyn.chain.model import Chain
from trackdyn.contact.laws import Law, make_law
from trackdyn.contact.tooth import make_tooth
from trackdyn.errors import InputError
from trackdyn.fidelity import LITERAL_ERROR, Decision, decide, literal_error, refuse_nonsense
from trackdyn.integrate.limits import step_limits, turn_limit
from trackdyn.model import Closure, Drive, Model, Sensor, Shoes, Wheels
from trackdyn.parameters.groove import coarse_groove
from trackdyn.parameters.layout import wheel_circles
from trackdyn.parameters.rig import Rig, Surface


@dataclass(frozen=True)
class Scene:
    """What a run is asked to do, and how faithfully (`trackdyn.fidelity`).

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
    loop : str
        ``on_wheels``, or ``free``: an oblong loop without wheels that starts with the spin of the sprocket.
    chain : str
        ``double_pin`` (a link and a connector a pitch), ``single_pin`` (one rigid body a pitch, as the
        paper counts) or ``belt`` (a kinematic path at constant speed).
    space : str
        ``planar``, ``spatial``, or ``auto``: spatial only if a wheel is out of the plane.
    tooth_contact : str
        ``ten_arcs``, ``three_surfaces`` (left, seating and right surface, of the kind in Ref. [2]) or
        ``none``.
    normal_law : str
        ``printed`` (Eq. 8), ``delivered`` (its damping factor delivers the restitution) or ``elastic``.
    friction : str
        ``none``, ``tangential``, in space also ``independent`` (tangential and axial as printed) or
        ``isotropic`` (one coefficient of the whole slip); ``auto``: what the space allows.
    closure : str
        ``rigid``, or ``elastic_damping``: a spring and damper at the cut joint.
    solver : str
        ``riccati``, ``transfer_product`` (the literal product of Eqs. 2 to 5) or ``multipliers``.
    integrator : str
        ``semi_implicit``, ``linearly_implicit``, ``rk4`` or ``adaptive``.
    tolerance : float or None
        Relative error a step of the adaptive integrator may make.
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
    loop: str = "on_wheels"
    chain: str = "double_pin"
    space: str = "auto"
    tooth_contact: str = "ten_arcs"
    normal_law: str = "printed"
    friction: str = "auto"
    closure: str = "rigid"
    solver: str = "riccati"
    integrator: str = "semi_implicit"
    tolerance: float | None = None

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
        if self.tolerance is not None and not 0 < self.tolerance < 1:
            refuse("tolerance", self.tolerance, "a number between 0 and 1, such as 1e-6, would do")
        refuse_nonsense(self)
        radius = self.ring_radius
        if radius is not None:
            if isinstance(radius, bool) or not isinstance(radius, (int, float)) or not radius > 0:
                refuse("ring_radius", radius, "a radius in m or null for no ring would do")
            low, high = self.ring_range(self.rig)
            if not low - 1e-9 <= radius <= high + 1e-9:  # the bounds themselves are allowed, rounded or not
                refuse(
                    "ring_radius",
                    radius,
                    f"a ring of more than {high:.4f} m overlaps the chain of this loop and one of less than {low:.4f} m "
                    "never touches it; null means no ring",
                )
        for pitch in self.pitches:
            if not 1 <= pitch <= self.rig.chain.pitches:
                refuse("pitches", pitch, f"pitches 1 to {self.rig.chain.pitches} exist")
        if self.solver == "transfer_product":
            error = literal_error(build_chain(self.rig, self.chain))
            if error > LITERAL_ERROR:
                refuse(
                    "solver",
                    self.solver,
                    f"with the masses and inertias of this chain rounding grows to {error:.1g} of a result over "
                    f"{self.bodies} bodies, at worst where its pins are mutual centres of percussion; 'riccati' would do",
                )
        if self.chain == "belt" or self.integrator == "adaptive":
            return  # nothing explicit, or the step is only where it reports
        if self.integrator == "linearly_implicit":
            limits = turn_limit(self.sprocket_rate)
        else:
            limits = step_limits(build_model(self), self.rig.tension.pre_tension, self.integrator)
        if not limits:
            return
        name, limit = min(limits.items(), key=lambda item: item[1])
        if self.step > limit:
            refuse("step", self.step, f"too large for the {name}; at most {limit:.2g} s would do")

    @property
    def bodies(self) -> int:
        """Rigid bodies of the chain."""
        return self.rig.chain.pitches * (2 if self.chain == "double_pin" else 1)

    @property
    def fidelity(self) -> dict[str, Decision]:
        """Setting and reason of every choice."""
        return decide(self)

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


def _law(rig: Rig, surface: Surface, scene: Scene) -> Law:
    sliding = scene.friction != "none"
    return make_law(
        surface.contact_length,
        rig.composite_modulus(surface),
        surface.restitution,
        surface.friction_static if sliding else 0.0,
        surface.friction_dynamic if sliding else 0.0,
        surface.transition_velocity,
        rig.impact.speed_floor,
        rig.impact.factor_limit,
        scene.normal_law,
    )


def build_chain(rig: Rig, chain: str = "double_pin") -> Chain:
    """Links and connectors in turn, or one body a pitch; mass centres in the middle of the pins."""
    c, n = rig.chain, rig.chain.pitches
    if chain == "single_pin":
        # half a connector is fixed to each end of the link, its middle a quarter of a connector from the joint
        pitch, half = rig.single_pin_pitch, c.connector_mass / 2
        own = c.connector_inertia / 2 - half * (rig.connector_length / 4) ** 2
        inertia = c.link_inertia + 2 * (own + half * (pitch / 2 - rig.connector_length / 4) ** 2)
        length = np.full(n, pitch)
        mass, inertia = np.full(n, c.link_mass + c.connector_mass), np.full(n, inertia)
        in_series = 2  # two bushings behind one another
    else:
        length = np.tile([c.link_length, rig.connector_length], n)
        mass = np.tile([c.link_mass, c.connector_mass], n)
        inertia = np.tile([c.link_inertia, c.connector_inertia], n)
        in_series = 1
    return Chain(
        length,
        mass,
        inertia,
        length / 2,
        np.zeros(len(length)),
        rig.bushing.stiffness / in_series,
        rig.bushing.damping / in_series,
        rig.bushing.free_angle * in_series,
        rig.gravity,
    )


def build_shoes(rig: Rig, chain: str = "double_pin") -> Shoes:
    """Where the links and the connectors' arcs sit on the bodies.

    A body of the single-pin chain is a link whose ends carry one arc each of the connectors beside it,
    the joints where the middle lines of two links meet at equal pitch: arcs and links then stand in the
    grooves and on the ring as those of the double-pin chain do.
    """
    n, a = rig.chain.pitches, rig.chain.link_length
    pitch = np.arange(n)
    if chain == "single_pin":
        end = (rig.single_pin_pitch - a) / 2
        return Shoes(
            pitch,
            np.full(n, end),
            np.full(n, end + a),
            np.column_stack([pitch, (pitch + 1) % n]).ravel(),
            np.tile([end + a, end], n),
        )
    return Shoes(
        2 * pitch, np.zeros(n), np.full(n, a), np.repeat(2 * pitch + 1, 2), np.tile([0.0, rig.connector_length], n)
    )


def build_wheels(scene: Scene, shift: float = 0.0) -> Wheels:
    """The wheels that a scene has; a free loop has the sprocket alone, without ring."""
    rig = scene.rig
    circles = wheel_circles(rig, shift, surface=True)
    if scene.ring_radius is not None:
        circles[0, 2] = scene.ring_radius
    count = 3 if scene.loop == "on_wheels" else 1
    return Wheels(
        np.array([int(scene.ring_radius is not None), 1, 1])[:count],
        *np.ascontiguousarray(circles[:count].T),
        np.array([0.0, rig.idler.inertia, rig.road_wheel.inertia])[:count],
        np.array([0.0, rig.idler.bearing_drag, rig.road_wheel.bearing_drag])[:count],
        rig.chain.link_thickness / 2,
        _law(rig, rig.ring_contact, scene),
        _law(rig, rig.wheel_contact, scene),
    )


def build_model(scene: Scene, shift: float = 0.0) -> Model:
    """The model that a scene requires, the tensioning wheel shifted by ``shift`` (m)."""
    rig = scene.rig
    toothed = scene.tooth_contact != "none" and scene.loop == "on_wheels"
    groove = coarse_groove(rig.groove_profile) if scene.tooth_contact == "three_surfaces" else rig.groove_profile
    shoes = build_shoes(rig, scene.chain)
    body = int(shoes.link_body[rig.sensor.pitch - 1])
    return Model(
        build_chain(rig, scene.chain),
        shoes,
        make_tooth(groove, rig.chain.connector_radius, _law(rig, rig.tooth_contact, scene), toothed),
        build_wheels(scene, shift),
        Drive(float(scene.sprocket_rate), float(scene.ramp)),
        Sensor(body, float(rig.sensor.x + shoes.link_start[rig.sensor.pitch - 1]), float(rig.sensor.y)),
        float(scene.step),
        Closure(int(scene.closure == "elastic_damping"), rig.closure.stiffness, rig.closure.damping),
    )

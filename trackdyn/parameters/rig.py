"""Every parameter of the rig with value, unit, kind and source, read from YAML (`rig_file`) and validated."""

from functools import cached_property, reduce
from itertools import pairwise
from math import pi, radians, tan
from operator import getitem
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from trackdyn.errors import InputError
from trackdyn.parameters.drives import DriveParameters
from trackdyn.parameters.fields import NAME, FieldValue, fields_of, keys_of, may_have, no_field
from trackdyn.parameters.groove import Groove, build_groove, connector_length
from trackdyn.parameters.outline import ToothProfile, profile_groove
from trackdyn.parameters.paper_tables import rig_cells
from trackdyn.parameters.quantities import (
    FROM_FILE,
    Friction,
    Inertia,
    Length,
    Mass,
    Position,
    Quantity,
    RollingArm,
    Slope,
    Table,
    Tilt,
)
from trackdyn.parameters.rig_file import DEFAULT, cells_path, read_rig
from trackdyn.parameters.rubber import BushingLaw
from trackdyn.parameters.validation import Section, shown, validated
from trackdyn.parameters.wheels import CONTACTS, Drag, Kept, OmitsDefaults, Wheel


class ChainParameters(OmitsDefaults):
    """Links and connectors."""

    kind: Annotated[Literal["double_pin", "single_pin"], Quantity("name")] = "double_pin"
    pitches: Annotated[int, Quantity("1", ge=3, le=20_000)]  # twice what the scaling was measured to
    link_length: Length
    link_thickness: Length
    link_mass: Mass
    link_inertia: Inertia
    link_inertia_along: Inertia
    link_inertia_across: Inertia
    connector_mass: Mass
    connector_inertia: Inertia
    connector_inertia_along: Inertia
    connector_inertia_across: Inertia
    connector_radius: Length


class ClosureParameters(Section):
    """Spring and damper of the cut joint, where the closure is elastic."""

    stiffness: Annotated[float, Quantity("N/m", gt=0)]
    damping: Annotated[float, Quantity("N s/m", ge=0)]


class Bushing(OmitsDefaults):
    """Rubber bushings of the joints."""

    stiffness: Annotated[float, Quantity("N m/rad", ge=0)]
    damping: Annotated[float, Quantity("N m s/rad", ge=0)]
    free_angle: Annotated[float, Quantity("rad", gt=-1.6, lt=1.6)]
    radial_stiffness: Annotated[float, Quantity("N/m", gt=0)]
    radial_damping: Annotated[float, Quantity("N s/m", ge=0)]
    loss_factor: Annotated[float, Quantity("1", ge=0, le=0.5)] = 0.0
    law: Annotated[BushingLaw, Quantity("name")] = "hysteretic"


class GrooveParameters(Section):
    """Design values of the groove of ten arcs, slopes in degrees."""

    seat_depth: Position
    slope_bottom: Slope
    slope_low: Slope
    slope_seat: Slope
    slope_tip: Slope
    r2: Length
    r3: Length
    r4: Length
    r5: Length


class Sprocket(OmitsDefaults):
    """Sprocket and ring."""

    teeth: Annotated[int, Quantity("1", ge=5, le=127)]  # a groove's number is kept in a byte
    transmission_ratio: Annotated[float, Quantity("1", gt=0)]
    x: Position
    y: Position
    equal_pitch_radius: Length
    ring_radius: Length
    ring: Annotated[Literal["present", "none"], Quantity("name")] = "present"
    rolling_arm: RollingArm = 0.0
    axial_offset: Position
    toe: Tilt
    camber: Tilt


class Tension(OmitsDefaults):
    """Tensioner and pre-tension of the loop."""

    wheel: Annotated[Any, Quantity("name")]
    pre_tension: Annotated[float, Quantity("N", ge=0)]
    direction: Annotated[float, Quantity("deg")]
    travel: Length
    mass: Mass
    stiffness: Annotated[float, Quantity("N/m", gt=0)]
    damping: Annotated[float, Quantity("N s/m", ge=0)]
    kept: Annotated[Kept, Quantity("name")] = "locked"
    force: Annotated[Table | None, Quantity("s, N")] = None


class Guide(Section):
    """Lateral guide of the chain, in space."""

    clearance: Annotated[float, Quantity("m", ge=0)]
    stiffness: Annotated[float, Quantity("N/m", gt=0)]
    damping: Annotated[float, Quantity("N s/m", ge=0)]


class Surface(Section):
    """Contact surface: rubber or steel."""

    contact_length: Length
    axial_overhang: Annotated[float, Quantity("m", ge=0)]
    youngs_modulus: Annotated[float, Quantity("Pa", gt=0)]
    poisson_ratio: Annotated[float, Quantity("1", ge=0, lt=0.5)]
    restitution: Annotated[
        float, Quantity("1", ge=1e-3, le=1)
    ]  # a loss factor of 1000: less is no contact law but a wall of glue
    friction_static: Friction
    friction_dynamic: Friction
    transition_velocity: Annotated[float, Quantity("m/s", gt=0)]


class ImpactParameters(Section):
    """Limits of the loss factor of an impact."""

    speed_floor: Annotated[float, Quantity("m/s", gt=0)]
    factor_limit: Annotated[float, Quantity("1", ge=1)]


class Steel(Section):
    """Material of links and connectors."""

    youngs_modulus: Annotated[float, Quantity("Pa", gt=0)]
    poisson_ratio: Annotated[float, Quantity("1", ge=0, lt=0.5)]


class SensorParameters(Section):
    """Place, rate and range of the acceleration sensor."""

    pitch: Annotated[int, Quantity("1", ge=1)]
    x: Position
    y: Position
    rate: Annotated[int, Quantity("Hz", gt=0, le=10**8)]
    range: Annotated[float, Quantity("g", gt=0)]


class Rig(OmitsDefaults):
    """The rig: sections of parameters in SI units (angles of the groove in degrees).

    ``idler``, ``road_wheel`` and all of ``wheels`` are wheels alike; ``rollers`` has them by name.
    """

    gravity: Annotated[float, Quantity("m/s2", ge=0)]
    chain: ChainParameters
    bushing: Bushing
    closure: ClosureParameters
    sprocket: Sprocket
    groove: GrooveParameters | None = None
    profile: ToothProfile | None = None
    idler: Wheel | None = None
    road_wheel: Wheel | None = None
    wheels: dict[str, Wheel] = Field(default_factory=dict)
    drag: Annotated[Drag, Quantity("name")] = "rolling"
    drive: DriveParameters | None = None
    tension: Tension
    steel: Steel
    tooth_contact: Surface
    ring_contact: Surface
    wheel_contact: Surface
    surfaces: dict[str, Surface] = Field(default_factory=dict)
    guide: Guide
    impact: ImpactParameters
    sensor: SensorParameters

    def model_post_init(self, context: Any) -> None:
        """Check values that depend on each other."""
        for name, surface in self.contact_surfaces.items():
            if surface.friction_dynamic > surface.friction_static:
                raise InputError(
                    f"{name}.friction_dynamic = {surface.friction_dynamic} exceeds friction_static = "
                    f"{surface.friction_static}; the dynamic coefficient may at most equal the static one"
                )
        if self.sensor.pitch > self.chain.pitches:
            raise InputError(
                f"sensor.pitch = {self.sensor.pitch} is not a pitch of this chain; 1 to {self.chain.pitches} are"
            )
        if (self.groove is None) == (self.profile is None):
            raise InputError("groove is missing; a tooth has groove or profile, and one of them only")
        self._refuse_wheels()
        self._refuse_tension()

    def _refuse_wheels(self) -> None:
        if not self.rollers:
            raise InputError("wheels is missing; a loop needs at least one wheel beside its sprocket, such as idler")
        for name, wheel in self.rollers.items():
            if not NAME.fullmatch(name) or (name in self.wheels and name in type(self).model_fields):
                raise InputError(
                    f"wheels.{shown(name)} is not a valid name: use lower-case letters, digits and _, "
                    "and not the name of a section"
                )
            if wheel.surface not in self.contact_surfaces:
                raise InputError(
                    f"{name}.surface = {shown(wheel.surface)} is not a surface of this rig; "
                    f"choose {', '.join(self.contact_surfaces)}"
                )
            if wheel.arm is not None and wheel.slider is not None:
                raise InputError(
                    f"{name}.slider is not allowed together with {name}.arm; a wheel has one of them or is fixed"
                )
            if wheel.arm is not None and (wheel.arm.x, wheel.arm.y) == (wheel.x, wheel.y):
                raise InputError(
                    f"{name}.arm.x = {wheel.arm.x:g} m, and its y, are the wheel's own position; move the pivot"
                )

    def _refuse_tension(self) -> None:
        tension = self.tension
        if not isinstance(tension.wheel, str) or tension.wheel not in self.rollers:
            names = " or ".join(repr(name) for name in self.rollers)
            raise InputError(f"tension.wheel = {shown(tension.wheel)} is not a wheel of this rig; choose {names}")
        if self.rollers[tension.wheel].carrier is not None:
            raise InputError(
                f"tension.wheel = {tension.wheel!r} has an arm or a slider of its own, which "
                "tension.kept = sprung gives to the tensioner; choose a fixed wheel"
            )
        if tension.kept == "forced" and tension.force is None:
            raise InputError("tension.force is missing; kept = forced needs it: rows of time (s) and force (N)")
        rows = tension.force or ()
        if any(len(row) != 2 for row in rows) or any(a[0] >= b[0] for a, b in pairwise(rows)):
            raise InputError(f"tension.force = {shown(rows)}: must be rows of time (s, rising) and force (N)")

    @cached_property
    def rollers(self) -> dict[str, Wheel]:
        """The wheels beside the sprocket by name, in the order of wheels 1, 2, ... of a model."""
        named = {"idler": self.idler, "road_wheel": self.road_wheel}
        return {name: wheel for name, wheel in named.items() if wheel is not None} | self.wheels

    @property
    def contact_surfaces(self) -> dict[str, Surface]:
        """All contact surfaces by name."""
        return {name: getattr(self, name) for name in CONTACTS} | self.surfaces

    @property
    def ring_radius(self) -> float | None:
        """Radius of the ring that the rig has (m), None where it has none."""
        return self.sprocket.ring_radius if self.sprocket.ring == "present" else None

    @cached_property
    def pin_circle(self) -> float:
        """Radius of the circle of pins when links touch a ring of the equal-pitch radius, m."""
        middle = self.sprocket.equal_pitch_radius + self.chain.link_thickness / 2
        return (middle**2 + self.chain.link_length**2 / 4) ** 0.5

    @cached_property
    def connector_length(self) -> float:
        """Pin to pin length of the connector, derived from the equal-pitch radius, m."""
        return connector_length(self.sprocket.teeth, self.chain.link_length, self.pin_circle)

    @cached_property
    def single_pin_pitch(self) -> float:
        """Pin to pin length of a single-pin body, m: the pins stand where the links' lines meet at equal pitch."""
        middle = self.sprocket.equal_pitch_radius + self.chain.link_thickness / 2
        return 2 * middle * tan(pi / self.sprocket.teeth)

    @cached_property
    def groove_profile(self) -> Groove:
        """The arcs: the ten of the design, or those of a profile."""
        if self.groove is None:
            assert self.profile is not None, "a tooth has groove or profile"
            return profile_groove(self.profile, self.sprocket.teeth, self.chain.connector_radius)
        design = {name: radians(v) if name.startswith("slope") else v for name, v in self.groove.model_dump().items()}
        return build_groove(
            teeth=self.sprocket.teeth,
            connector_length=self.connector_length,
            connector_radius=self.chain.connector_radius,
            pin_circle=self.pin_circle,
            **design,
        )

    def loop_period(self, motor_rpm: float) -> float:
        """Time of one revolution of the loop, s."""
        return 60 * self.sprocket.transmission_ratio / motor_rpm * self.chain.pitches / self.sprocket.teeth

    def composite_modulus(self, surface: Surface) -> float:
        """E* of a surface against steel by Eq. (9), Pa."""
        steel = self.steel
        return 1 / (
            (1 - surface.poisson_ratio**2) / surface.youngs_modulus
            + (1 - steel.poisson_ratio**2) / steel.youngs_modulus
        )

    @cached_property
    def fields(self) -> dict[str, FieldValue]:
        """Value and unit of every field by its dotted name; a wheel or a surface is a section by its name."""
        return dict(fields_of(self))

    @classmethod
    def may_have(cls, name: str) -> bool:
        """Whether some rig has a field of this dotted name."""
        return may_have(cls, name)

    def value(self, name: str) -> Any:
        """Return the value of a field.

        Parameters
        ----------
        name : str
            Dotted name, such as ``sprocket.ring_radius`` or ``road_1.arm.stiffness``.

        Raises
        ------
        InputError
            There is no such field.
        """
        if name not in self.fields:
            raise no_field(self, name)
        return self.fields[name].value

    def changed(self, **changes: Any) -> "Rig":
        """Return a rig with some values replaced.

        Parameters
        ----------
        **changes
            Values in SI units by dotted name; two underscores stand for a dot, None removes an optional section.

        Returns
        -------
        Rig

        Raises
        ------
        InputError
            There is no such field, or the values give no rig.

        Examples
        --------
        ``rig.changed(sprocket__ring_radius=0.305, idler__bearing_drag=0.0)``, ``rig.changed(**{"road_1.arm": None})``.
        """
        data = self.model_dump()
        for name, value in changes.items():
            *sections, field = keys_of(self, name.replace("__", "."))
            reduce(getitem, sections, data)[field] = value
        return _validated(data, "rig")


def _validated(data: Any, name: str, context: str | None = None) -> Rig:
    rig = validated(Rig, data, name, "add it with value, unit, kind and source", context)
    try:
        rig.groove_profile  # noqa: B018 -- an impossible groove is refused here, not in mid-run
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    return rig


def load_rig(path: Path | str = DEFAULT) -> Rig:
    """Read and validate a rig.

    Parameters
    ----------
    path : path or str
        A YAML file, or the name of a shipped rig (`rig_file.shipped_rigs`).

    Returns
    -------
    Rig

    Raises
    ------
    InputError
        One sentence with file, field, value and what is accepted.
    """
    data, cells = read_rig(path), cells_path(path)
    if cells is not None and rig_cells(cells):
        return _validated(data, f"{path} with the cells of {cells}", FROM_FILE)
    return _validated(data, str(path), FROM_FILE)

"""Sections of a rig: its parameters with their units and bounds; wheels are in `wheels`."""

from typing import Annotated, Any, Literal

from trackdyn.parameters.quantities import Friction, Inertia, Length, Mass, Position, Quantity, Slope, Table, Tilt
from trackdyn.parameters.rubber import BushingLaw
from trackdyn.parameters.validation import Positive, Section
from trackdyn.parameters.wheels import Kept, OmitsDefaults


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
    # a loss factor of 1000: less is no contact law but a wall of glue
    restitution: Annotated[float, Quantity("1", ge=1e-3, le=1)]
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


class Tried(Section):
    """A step (s) that was tried on a rig, and the motor speed (rev/min) up to which it holds."""

    rpm: Positive
    step: Positive

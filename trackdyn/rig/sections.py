"""Sections of a rig: its parameters with their units and bounds."""

from typing import Annotated, Any, Literal

from trackdyn.inputs.quantities import Friction, Inertia, Length, Mass, Position, Quantity, Slope, Tilt
from trackdyn.inputs.validation import Positive, Section
from trackdyn.rig.laws import BushingLaw

# pull of the chain by a brake, N, at most a hundred times the weight of a heavy vehicle
Pull = Annotated[float, Quantity("N", ge=0, le=1e7)]
Kept = Literal["locked", "retensioned", "sprung"]
Drag = Literal["viscous", "coulomb", "rolling"]


class Arm(Section):
    """Trailing arm with torsion spring and damper; the wheel is at its free end.

    ``mass`` is that of wheel and arm reduced to the wheel's axle, ``travel`` the rotation to either side, ``preload``
    the counter-clockwise torque at the wheel's position in the file, by default the one that balances the loop.
    """

    x: Position
    y: Position
    mass: Mass
    stiffness: Annotated[float, Quantity("N m/rad", gt=0)]
    damping: Annotated[float, Quantity("N m s/rad", ge=0)]
    travel: Annotated[float, Quantity("deg", gt=0, le=80)]
    preload: Annotated[float | None, Quantity("N m")] = None


class Slider(Section):
    """Straight guide with spring and damper along ``direction``; ``preload`` as of `Arm`, positive along it."""

    direction: Annotated[float, Quantity("deg")]
    mass: Mass
    stiffness: Annotated[float, Quantity("N/m", gt=0)]
    damping: Annotated[float, Quantity("N s/m", ge=0)]
    travel: Length
    preload: Annotated[float | None, Quantity("N")] = None


class Wheel(Section):
    """Wheel that turns freely; drag by ``rolling_arm`` and ``seal_drag``, ``bearing_drag`` or ``bearing_torque``."""

    x: Position
    y: Position
    axial_offset: Position = 0.0
    toe: Tilt = 0.0
    camber: Tilt = 0.0
    radius: Length
    inertia: Inertia
    bearing_drag: Annotated[float, Quantity("N m s/rad", ge=0)] = 0.0
    bearing_torque: Annotated[float, Quantity("N m", ge=0)] = 0.0
    rolling_arm: Annotated[float, Quantity("m", ge=0, le=1)] = 0.0  # times the links' normal forces
    seal_drag: Annotated[float, Quantity("N m s/rad", ge=0)] = 0.0
    surface: Annotated[str, Quantity("name")] = "wheel_contact"
    arm: Arm | None = None
    slider: Slider | None = None

    @property
    def suspension(self) -> Arm | Slider | None:
        """Suspension of the wheel, an arm or a slider; None if it is fixed."""
        return self.arm or self.slider


class ChainParameters(Section):
    """Links and connectors."""

    kind: Annotated[Literal["double_pin", "single_pin"], Quantity("name")] = "double_pin"
    pitches: Annotated[int, Quantity("1", ge=3, le=20_000)]  # twice the largest number that the scaling was measured to
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


class Bushing(Section):
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


class Sprocket(Section):
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


class Tension(Section):
    """Tensioner and pre-tension of the loop."""

    wheel: Annotated[Any, Quantity("name")]
    pre_tension: Annotated[float, Quantity("N", ge=0)]
    direction: Annotated[float, Quantity("deg")]
    travel: Length
    mass: Mass
    stiffness: Annotated[float, Quantity("N/m", gt=0)]
    damping: Annotated[float, Quantity("N s/m", ge=0)]
    kept: Annotated[Kept, Quantity("name")] = "locked"


class Guide(Section):
    """Lateral guide of the chain, in 3D."""

    clearance: Annotated[float, Quantity("m", ge=0)]
    stiffness: Annotated[float, Quantity("N/m", gt=0)]
    damping: Annotated[float, Quantity("N s/m", ge=0)]


class Surface(Section):
    """Contact surface; by Dahl's law, with ``shear_stiffness``, it slides at ``friction_static``."""

    contact_length: Length
    axial_overhang: Annotated[float, Quantity("m", ge=0)]
    youngs_modulus: Annotated[float, Quantity("Pa", gt=0)]
    poisson_ratio: Annotated[float, Quantity("1", ge=0, lt=0.5)]
    restitution: Annotated[float, Quantity("1", ge=1e-3, le=1)]
    friction_static: Friction
    friction_dynamic: Friction
    transition_velocity: Annotated[float, Quantity("m/s", gt=0)]
    friction_law: Annotated[Literal["regularised", "dahl"], Quantity("name")] = "regularised"
    shear_stiffness: Annotated[float | None, Quantity("N/m", gt=0)] = None


class ImpactParameters(Section):
    """Limits of the loss factor of an impact."""

    speed_floor: Annotated[float, Quantity("m/s", gt=0)]
    factor_limit: Annotated[float, Quantity("1", ge=1)]


class Steel(Section):
    """Material of links and connectors."""

    youngs_modulus: Annotated[float, Quantity("Pa", gt=0)]
    poisson_ratio: Annotated[float, Quantity("1", ge=0, lt=0.5)]


class SensorParameters(Section):
    """Position (``x`` from the first pin of its body along the pin line, ``y`` outward), rate and range of a sensor."""

    pitch: Annotated[int, Quantity("1", ge=1)]
    body: Annotated[Literal["link", "connector"], Quantity("name")] = "link"
    x: Position
    y: Position
    rate: Annotated[int, Quantity("Hz", gt=0, le=10**8)]
    range: Annotated[float, Quantity("g", gt=0)]


class TestedStep(Section):
    """Step (s) that was tried on a rig, and the motor speed (rev/min) up to which it holds."""

    rpm: Positive
    step: Positive

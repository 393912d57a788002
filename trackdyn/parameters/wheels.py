"""Wheels beside the sprocket: what one is, and what it may stand on."""

from typing import Annotated, Any, Literal

from pydantic import model_serializer

from trackdyn.parameters.quantities import Inertia, Length, Mass, Position, Quantity, RollingArm, Tilt
from trackdyn.parameters.validation import Section

# contact surfaces that every rig has, by the name under which a wheel may ask for one
CONTACTS = ("wheel_contact", "ring_contact", "tooth_contact")


class OmitsDefaults(Section):
    """A section whose optional fields are left out of its data while they have their defaults."""

    @model_serializer(mode="wrap")
    def _without_defaults(self, handler: Any) -> dict:
        fields = type(self).model_fields
        return {
            name: value
            for name, value in handler(self).items()
            if fields[name].is_required() or getattr(self, name) != fields[name].get_default(call_default_factory=True)
        }


class Arm(OmitsDefaults):
    """A trailing arm with torsion spring and damper; the wheel is at its free end.

    ``mass`` is that of wheel and arm as if it were at the wheel's axle, ``travel`` the turn to either side. Without
    ``preload`` (torque on the arm at the wheel's position as filed, counter-clockwise positive) the spring holds what
    lies on it when the loop has been tensioned.
    """

    x: Position
    y: Position
    mass: Mass
    stiffness: Annotated[float, Quantity("N m/rad", gt=0)]
    damping: Annotated[float, Quantity("N m s/rad", ge=0)]
    travel: Annotated[float, Quantity("deg", gt=0, le=80)]
    preload: Annotated[float | None, Quantity("N m")] = None


class Slider(OmitsDefaults):
    """A straight guide with spring and damper along ``direction``; ``preload`` as of `Arm`, positive along it."""

    direction: Annotated[float, Quantity("deg")]
    mass: Mass
    stiffness: Annotated[float, Quantity("N/m", gt=0)]
    damping: Annotated[float, Quantity("N s/m", ge=0)]
    travel: Length
    preload: Annotated[float | None, Quantity("N")] = None


class Wheel(OmitsDefaults):
    """A wheel that turns freely: where it stands, what it is, which surface links touch, and what it stands on.

    A rig or a scene takes one of three laws of its drag: ``rolling_arm`` times the links' normal forces beside
    ``seal_drag`` of seals and bearings, ``bearing_drag`` alone, or ``bearing_torque`` alone.
    """

    x: Position
    y: Position
    axial_offset: Position
    toe: Tilt
    camber: Tilt
    radius: Length
    inertia: Inertia
    bearing_drag: Annotated[float, Quantity("N m s/rad", ge=0)]
    bearing_torque: Annotated[float, Quantity("N m", ge=0)]
    rolling_arm: RollingArm = 0.0
    seal_drag: Annotated[float, Quantity("N m s/rad", ge=0)] = 0.0
    surface: Annotated[str, Quantity("name")] = "wheel_contact"
    arm: Arm | None = None
    slider: Slider | None = None

    @property
    def carrier(self) -> Arm | Slider | None:
        """What the wheel stands on, None where it is fixed."""
        return self.arm or self.slider


Kept = Literal["locked", "retensioned", "sprung", "forced"]
Drag = Literal["viscous", "coulomb", "rolling"]
# fields of a wheel that a law of drag reads
OF_DRAG = {"viscous": ("bearing_drag",), "coulomb": ("bearing_torque",), "rolling": ("rolling_arm", "seal_drag")}

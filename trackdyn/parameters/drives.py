"""What turns the sprocket."""

from typing import Annotated, Any, Literal

from trackdyn.errors import InputError
from trackdyn.parameters.quantities import Quantity
from trackdyn.parameters.wheels import OmitsDefaults


class DriveParameters(OmitsDefaults):
    """The drive of the sprocket; everything is as the sprocket sees it, behind the gear."""

    # ``speed``: the scene's speed is prescribed. ``motor``: a torque that falls along a line from that speed, which is
    # the motor's without load: ``slope`` times what the sprocket lacks of it, at most ``torque``. ``free``: prescribed
    # until ``release``, then nothing drives it
    kind: Annotated[Literal["speed", "motor", "free"], Quantity("name")] = "speed"
    # ripple, ripple_order: amplitude of a speed that is prescribed, as a share of it, and its periods in a turn of the
    # sprocket
    ripple: Annotated[float, Quantity("1", ge=0, lt=1)] = 0.0
    ripple_order: Annotated[float, Quantity("1", gt=0, le=1000)] = 1.0
    # inertia, slope, torque: of sprocket, gear and rotor (kg m2); of the line (N m s/rad); the largest torque (N m)
    inertia: Annotated[float | None, Quantity("kg m2", gt=0)] = None
    slope: Annotated[float | None, Quantity("N m s/rad", gt=0)] = None
    torque: Annotated[float | None, Quantity("N m", gt=0)] = None
    release: Annotated[float | None, Quantity("s", ge=0)] = None  # s after the start

    def model_post_init(self, context: Any) -> None:
        """Check values that depend on each other."""
        needed = {"speed": (), "motor": ("inertia", "slope", "torque"), "free": ("inertia", "release")}[self.kind]
        for name in needed:
            if getattr(self, name) is None:
                raise InputError(f"drive.{name} is missing; a drive of kind {self.kind!r} needs {', '.join(needed)}")
        if self.ripple and self.kind == "motor":
            raise InputError("drive.ripple must be 0 with kind 'motor', whose speed is not prescribed")

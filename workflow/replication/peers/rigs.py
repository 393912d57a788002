"""A rig as the other codes have it: arms and sliders stand still, the tensioner is locked, the speed is prescribed."""

from trackdyn.parameters.rig import Rig


def fixed(rig: Rig) -> Rig:
    """The rig with every wheel fixed where its file has it, and a prescribed speed without ripple."""
    changes = {
        f"{name}__{part}": None
        for name, wheel in rig.rollers.items()
        for part in ("arm", "slider")
        if getattr(wheel, part)
    }
    if changes or rig.drive:
        changes |= {"drive": None}
    return rig.changed(**changes, tension__kept="locked")

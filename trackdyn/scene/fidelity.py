"""The ladder of fidelities: independent choices, cheap to dear, and what a scene requires of each.

A scene states its choices, or leaves those that its physics can decide to ``auto``. `decide` settles
them and says why; `refuse_nonsense` names the combinations that make no sense and the setting that
would do. The presets are bundles of choices with a step, measured in ``docs/choosing-a-fidelity.md``.
"""

from typing import NamedTuple

import numpy as np

from trackdyn.chain.transfer_matrices import growth
from trackdyn.errors import InputError
from trackdyn.integrate.dynamics import SOLVERS
from trackdyn.integrate.methods import METHODS
from trackdyn.model.constants import Chain
from trackdyn.parameters.groove import PROFILES
from trackdyn.parameters.normal_laws import NORMAL_LAWS

CHOICES = {
    "loop": ("on_wheels", "free"),
    "chain": ("belt", "single_pin", "double_pin"),
    "space": ("auto", "planar", "spatial"),
    "tooth_contact": ("none", *PROFILES),
    "normal_law": tuple(NORMAL_LAWS),
    "friction": ("auto", "none", "tangential", "independent", "isotropic"),
    "joint": ("revolute", "radial"),
    "closure": ("elastic_damping", "rigid"),
    "solver": SOLVERS,
    "integrator": tuple(sorted(METHODS, key=lambda name: METHODS[name].order)),
    "tension": ("locked", "retensioned", "sprung", "forced"),
    "drag": ("viscous", "coulomb"),
}
# bodies of this chain over which the literal product still keeps about half of its digits
LITERAL_BODIES = 8
# half of the digits of any other chain
LITERAL_ERROR = 1e-8
AXIAL_FRICTION = ("independent", "isotropic")

# name -> choices and step; each measured against the next one up (rule `fidelity`)
PRESETS = {
    "fast": {"integrator": "linearly_implicit", "step": 5e-4},
    "standard": {"integrator": "semi_implicit", "step": 1e-4},
    "paper": {"integrator": "semi_implicit", "step": 5e-5},
    "reference": {"integrator": "semi_implicit", "step": 1e-5},
}

ASKED = "as the scene asks"  # reason of a choice that the scene did not leave open


class Decision(NamedTuple):
    """What was chosen for one choice, and why."""

    setting: str
    reason: str


def preset(name: str) -> dict:
    """Fields of a `Scene` that a preset sets.

    Raises
    ------
    InputError
        There is no such preset.
    """
    if name not in PRESETS:
        raise InputError(f"preset = {name!r} is not accepted: {', '.join(PRESETS)} would do")
    return dict(PRESETS[name])


def literal_error(chain: Chain) -> float:
    """Relative error that rounding is expected to grow to in the literal product over a chain (`growth`)."""
    digits = np.log10(np.finfo(float).eps) + len(chain.length) / 2 * np.log10(growth(chain).pitch)
    return float(10.0 ** min(digits, 300.0))


def wheel_out_of_plane(rig) -> str | None:
    """Name, field and value of the first wheel that is not aligned with the plane of the chain, or None."""
    for name, wheel in {"sprocket": rig.sprocket, **rig.rollers}.items():
        for field in ("axial_offset", "toe", "camber"):
            if getattr(wheel, field) != 0.0:
                return f"{name}.{field} = {getattr(wheel, field):g}"
    return None


def decide(scene) -> dict[str, Decision]:
    """Setting and reason of every choice of a scene, the sprocket's ring and the wheels included."""
    found = {name: Decision(getattr(scene, name), ASKED) for name in CHOICES}
    tilted = wheel_out_of_plane(scene.rig)
    on_wheels = scene.loop == "on_wheels" and scene.chain != "belt"
    if scene.space == "auto":
        if tilted and on_wheels:
            found["space"] = Decision("spatial", f"{tilted} breaks the mirror symmetry across the plane of the chain")
        else:
            reason = "mirror-symmetric across the plane, no axial load" if on_wheels else "nothing acts along the axes"
            found["space"] = Decision("planar", reason)
    if scene.friction == "auto":
        if found["space"].setting == "spatial":
            found["friction"] = Decision("independent", "motion in space: tangential and axial friction as printed")
        else:
            found["friction"] = Decision("tangential", "planar: nothing moves along the axes")
    if scene.joint == "radial":
        found["joint"] = Decision("radial", "the scene asks for pins in rubber that part under load")
        found["closure"] = Decision("radial", "as every other joint: no joint of the loop is rigid")
    if scene.chain == "belt":
        for name in (
            "tooth_contact", "normal_law", "friction", "joint", "closure", "solver", "integrator", "tension", "drag",
        ):  # fmt: skip
            found[name] = Decision("none", "a kinematic path has no forces and no equations to solve")
    elif scene.loop == "free":
        for name in ("tooth_contact", "normal_law", "friction", "tension", "drag"):
            found[name] = Decision("none", "a free loop touches nothing")
    if on_wheels and scene.ring_radius is not None:
        found["ring"] = Decision("present", f"ring_radius = {scene.ring_radius:g} m")
    else:
        found["ring"] = Decision("none", "the scene has no ring: no link is tested against one")
    if on_wheels:
        names = [name.replace("_", " ") for name in scene.rig.rollers]
        listed = " and ".join(names) if len(names) < 3 else f"{len(names)} wheels"
        drive = (
            "the sprocket's speed is prescribed"
            if scene.rig.drive is None
            else f"the drive is a {scene.rig.drive.kind}"
        )
        found["wheels"] = Decision("turning", f"{listed} turn{'s' * (len(names) == 1)} freely; {drive}")
    else:
        found["wheels"] = Decision("none", "no wheel is touched")
    return found


def label(decisions: dict) -> str:
    """The choices that tell runs apart, in a few words; ``decisions`` as stored in a recording's provenance."""
    names = ("space", "chain", "tooth_contact", "integrator")
    return "/".join(decisions[name]["setting"] for name in names if decisions[name]["setting"] != "none")


def refuse_nonsense(scene) -> None:
    """Refuse combinations of choices that make no sense.

    Raises
    ------
    InputError
        Names the field, its value and the setting that would do.
    """

    def refuse(field, why):
        raise InputError(f"scene: {field} = {getattr(scene, field)!r} is not accepted: {why}")

    for name, settings in CHOICES.items():
        if not isinstance(getattr(scene, name), str) or getattr(scene, name) not in settings:
            refuse(name, f"{' or '.join(settings)} would do")
    tilted = wheel_out_of_plane(scene.rig)
    bodies = scene.bodies
    if scene.chain == "belt":
        if scene.ring_radius is not None:
            refuse(
                "ring_radius", "a belt is a path without contact (chain='belt'); None would do, or chain='double_pin'"
            )
        if scene.loop == "free":
            refuse("loop", "a belt lies on its wheels (chain='belt'); 'on_wheels' would do")
        if scene.spells or scene.pitches:
            refuse(
                "spells" if scene.spells else "pitches",
                "a belt has no contacts to log (chain='belt'); spells=False and pitches=() would do",
            )
        if scene.every_link:
            refuse("every_link", "on a belt every link does the same one pitch later (chain='belt'); False would do")
    if scene.sliding and (scene.chain == "belt" or scene.loop == "free"):
        refuse("sliding", "without contacts nothing slides (chain='belt' or loop='free'); False would do")
    if scene.sliding and METHODS[scene.integrator].tableau:
        refuse(
            "sliding",
            f"the stages of integrator={scene.integrator!r} keep no account by area; 'semi_implicit' would do",
        )
    if scene.loop == "free" and scene.ring_radius is not None:
        refuse("ring_radius", "a free loop touches no ring (loop='free'); None would do")
    if scene.space == "planar" and tilted and scene.loop == "on_wheels":
        refuse("space", f"{tilted} moves the chain out of its plane; 'spatial' or 'auto' would do")
    spatial = decide(scene)["space"].setting == "spatial"
    if scene.friction in AXIAL_FRICTION and not spatial:
        refuse("friction", "axial friction needs motion in space; 'tangential' would do, or space='spatial'")
    if spatial:
        if scene.chain != "double_pin":
            refuse("chain", "motion in space is modelled for 'double_pin' only")
        if scene.loop == "free":
            refuse("loop", "a free loop is mirror-symmetric; space='planar' or 'auto' would do")
        for field, only in (("closure", "rigid"), ("solver", "riccati"), ("integrator", "semi_implicit")):
            if getattr(scene, field) != only:
                refuse(field, f"motion in space is solved with '{only}' only; or space='planar' would do")
    why = "motion in space" if spatial else f"integrator={scene.integrator!r}"
    stepped = scene.integrator in ("semi_implicit", "linearly_implicit") and not spatial
    if scene.tension in ("sprung", "forced") and not stepped:
        refuse(
            "tension",
            f"a {scene.tension} tensioner moves in the plane by semi- or linearly implicit steps, not "
            f"with {why}; 'locked' would do",
        )
    if scene.tension == "forced" and scene.rig.tension.force is None:
        refuse("tension", "the rig has no tension.force; 'locked' would do")
    carried = [name for name, wheel in scene.rig.rollers.items() if wheel.carrier is not None]
    driven = scene.rig.drive is not None and (scene.rig.drive.kind != "speed" or scene.rig.drive.ripple > 0)
    semi_implicit = stepped and scene.integrator == "semi_implicit"
    if (
        scene.loop == "on_wheels"
        and scene.chain != "belt"
        and ((driven and not semi_implicit) or (carried and not stepped))
    ):
        drives = driven and not semi_implicit
        what = (
            "the rig's drive moves in the plane by semi-implicit Euler"
            if drives
            else (f"wheel {carried[0]} stands on a spring and moves in the plane by semi- or linearly implicit steps")
        )
        refuse("space" if spatial else "integrator", f"{what}, not with {why}; 'semi_implicit' would do")
    if scene.tooth_contact == "three_surfaces" and scene.rig.groove is None:
        refuse(
            "tooth_contact",
            "three surfaces are made of the ten-arc design, which this rig's profile is not; 'ten_arcs' would do",
        )
    if scene.joint == "radial":
        if spatial:
            refuse("joint", "pins part in the plane only; 'revolute' would do, or space='planar'")
        for field, only in (
            ("chain", "double_pin"), ("closure", "rigid"), ("solver", "riccati"), ("integrator", "semi_implicit"),
        ):  # fmt: skip
            if getattr(scene, field) != only:
                why = "; the cut is then a joint like all others" if field == "closure" else ""
                refuse(field, f"joint='radial' is modelled with '{only}' only{why}; or joint='revolute' would do")
        if scene.frame_interval:
            refuse("frame_interval", "configurations hold no parted pins; 0 would do, or joint='revolute'")
    if scene.solver == "transfer_product" and bodies > LITERAL_BODIES:
        refuse(
            "solver",
            f"the literal product of transfer matrices (Eqs. 2 to 5) keeps no digit over {bodies} bodies, errors grow "
            f"about eightfold a body; 'riccati' would do, or at most {LITERAL_BODIES} bodies",
        )
    if scene.solver != "riccati":
        if scene.closure != "rigid":
            refuse("closure", f"solver={scene.solver!r} closes the loop exactly; 'rigid' would do, or solver='riccati'")
        if METHODS[scene.integrator].linearly_implicit:
            refuse("integrator", "the linearly implicit step is part of the Riccati sweep; solver='riccati' would do")
    adaptive = METHODS[scene.integrator].adaptive
    if adaptive and scene.tolerance is None:
        refuse("tolerance", "the adaptive integrator needs one; 1e-6 would do")
    if not adaptive and scene.tolerance is not None:
        refuse("tolerance", f"integrator={scene.integrator!r} has a fixed step; None would do")

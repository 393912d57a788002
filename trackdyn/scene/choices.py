"""Choices of fidelity, independent of each other and ordered by cost (``docs/speed-and-accuracy.md``)."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field

from trackdyn.inputs.errors import InputError, shown
from trackdyn.inputs.validation import OneOf, Section, not_one_of
from trackdyn.integrate.methods import METHODS
from trackdyn.rig.groove import PROFILES
from trackdyn.rig.laws import NORMAL_LAWS, BushingLaw
from trackdyn.rig.rig import Rig
from trackdyn.rig.sections import Drag, Kept


def of_rig(value: Callable[[Rig], Any]) -> Any:
    """Return a field whose default is computed from the scene's rig."""
    return Field(default_factory=lambda fields: value(fields["rig"]))


class Choices(Section):
    """Settings of each choice of a scene, the cheapest first, and entries added to a registry."""

    rig: Rig  # fields after it may follow it
    #: ``double_pin`` (link and connector per pitch), ``single_pin`` (one rigid body per pitch, as the paper counts) or
    #: ``belt`` (a kinematic path at constant speed).
    chain: Annotated[Literal["belt", "single_pin", "double_pin"], OneOf()] = of_rig(lambda rig: rig.chain.kind)
    #: ``planar``, ``spatial``, or ``auto``, spatial only if a wheel is out of the plane.
    space: Annotated[Literal["auto", "planar", "spatial"], OneOf()] = "auto"
    #: ``ten_arcs``, ``three_surfaces`` (left, seating and right surface, of the kind in Ref. [2]) or ``none``.
    tooth_contact: Annotated[Literal["none", "three_surfaces", "ten_arcs"], OneOf(PROFILES)] = "ten_arcs"
    #: ``printed`` (Eq. 8), ``delivered`` (its damping factor delivers the restitution) or ``elastic``.
    normal_law: Annotated[str, OneOf(NORMAL_LAWS)] = "printed"
    #: ``none``, ``tangential``, in 3D also ``independent`` (tangential and axial as printed); ``auto``: by ``space``.
    friction: Annotated[Literal["auto", "none", "tangential", "independent"], OneOf()] = "auto"
    #: ``rigid``, or ``elastic_damping`` with a spring and damper at the cut joint.
    closure: Annotated[Literal["elastic_damping", "rigid"], OneOf()] = "rigid"
    #: ``semi_implicit``, ``linearly_implicit`` or ``rk4``.
    integrator: Annotated[str, OneOf(METHODS)] = "semi_implicit"
    #: ``locked`` (the tensioning wheel stays where the rig's own ring put it), ``retensioned`` (the pre-tension is set
    #: again with the scene's ring) or ``sprung`` (it slides on a spring and a damper while the chain runs).
    tension: Annotated[Kept, OneOf()] = of_rig(lambda rig: rig.tension.kept)
    #: ``rolling`` (rolling resistance in proportion to the load of a wheel, and the viscous drag of its seals),
    #: ``viscous`` (bearing drag grows with the rate of a wheel) or ``coulomb`` (a torque that does not).
    drag: Annotated[Drag, OneOf()] = of_rig(lambda rig: rig.drag)
    #: ``hysteretic`` (Maxwell elements, nearly the same share of its energy is lost in a cycle of any frequency from
    #: 0.5 to 50 Hz) or ``viscous`` (a damper parallel to the spring of every bushing).
    bushing_law: Annotated[BushingLaw, OneOf()] = of_rig(lambda rig: rig.bushing.law)


CHOICES = tuple(name for name in Choices.model_fields if name != "rig")

# name -> choices and step; each measured against the next one up (rule `fidelity`)
PRESETS = {
    "fast": {"integrator": "linearly_implicit", "step": 2.5e-4},
    "standard": {"integrator": "semi_implicit", "step": 1e-4},
    "paper": {"integrator": "semi_implicit", "step": 5e-5},
    "reference": {"integrator": "semi_implicit", "step": 1e-5},
}
# without a ring mean peaks of teeth are up to 2.6 % off their limit on the rig `paper`, RMS 0.1 % on all rigs (study
# `default_step`)
WITHOUT_RING: dict[str, dict] = {"standard": {"step": 5e-5}}

ASKED = "as the scene asks"  # reason of a choice that is not ``auto``


class Decision(NamedTuple):
    """Setting of a choice, and its reason."""

    setting: str
    reason: str


def preset(name: str, ring: bool = True) -> dict:
    """Return the fields of a `Scene` in a preset (else `InputError`); ``standard`` halves its step without a ring."""
    if not isinstance(name, str) or name not in PRESETS:
        raise InputError(f"preset {not_one_of(name, PRESETS)}")
    return PRESETS[name] | ({} if ring else WITHOUT_RING.get(name, {}))


def wheel_out_of_plane(rig) -> str | None:
    """Return name, field and value of the first wheel that is not aligned with the plane of the chain, or None."""
    wheels, fields = {"sprocket": rig.sprocket, **rig.wheels}, ("axial_offset", "toe", "camber")
    values = ((f"{name}.{field}", getattr(wheel, field)) for name, wheel in wheels.items() for field in fields)
    return next((f"{name} = {value:g}" for name, value in values if value), None)


def decide(scene) -> dict[str, Decision]:
    """Return setting and reason of every choice of a scene, the sprocket's ring and the wheels included."""
    decisions = {name: Decision(getattr(scene, name), ASKED) for name in CHOICES}
    tilted, belt = wheel_out_of_plane(scene.rig), scene.chain == "belt"
    if scene.space == "auto" and tilted and not belt:
        decisions["space"] = Decision("spatial", f"{tilted} breaks the mirror symmetry across the plane of the chain")
    elif scene.space == "auto":
        reason = "nothing acts along the axes" if belt else "mirror-symmetric across the plane, no axial load"
        decisions["space"] = Decision("planar", reason)
    if scene.friction == "auto" and decisions["space"].setting == "spatial":
        decisions["friction"] = Decision("independent", "3D motion: tangential and axial friction as printed")
    elif scene.friction == "auto":
        decisions["friction"] = Decision("tangential", "planar: nothing moves along the axes")
    ring = Decision("none", "the scene has no ring: no link is tested against one")
    wheels = Decision("turning", "all wheels turn freely; the sprocket's speed is prescribed")
    if belt:
        wheels = Decision("none", "no wheel is touched")
        nothing = Decision("none", "a kinematic path has no forces and no equations to solve")
        decisions |= dict.fromkeys(set(CHOICES) - {"chain", "space"}, nothing)
    elif scene.ring_radius is not None:
        ring = Decision("present", f"ring_radius = {scene.ring_radius:g} m")
    return decisions | {"ring": ring, "wheels": wheels}


# Combinations without meaning: field, condition on the facts of `check_choices`, and a message with reason and remedy,
# formatted with these facts. A row may rely on those above it.
REFUSALS: tuple[tuple[str, Callable[[SimpleNamespace], object], str], ...] = (
    # a belt, which has no contacts
    ("ring_radius", lambda s: s.belt and s.ring_radius is not None,
     "a belt is a path without contact (chain='belt'); use None, or chain='double_pin'"),
    ("contact_log", lambda s: s.belt and s.contact_log,
     "a belt has no contacts to log (chain='belt'); use contact_log=False and pitches=()"),
    ("pitches", lambda s: s.belt and s.pitches,
     "a belt has no contacts to log (chain='belt'); use contact_log=False and pitches=()"),
    ("load", lambda s: s.belt and s.load,
     "a belt is a path without forces (chain='belt'); use 0, or chain='double_pin'"),
    ("every_link", lambda s: s.belt and s.every_link,
     "on a belt every link does the same one pitch later (chain='belt'); use False"),
    ("chain",
     lambda s: s.chain == "single_pin" and "connector" in {sensor.body for sensor in s.rig.sensors.values()},
     "the rig has a sensor on a connector, which that chain does not have; use 'double_pin', or put it on a link"),
    # motion in space
    ("space", lambda s: s.space == "planar" and s.tilted,
     "{tilted} moves the chain out of its plane; use 'spatial' or 'auto'"),
    ("friction", lambda s: s.friction == "independent" and not s.spatial,
     "axial friction needs 3D motion; use 'tangential', or space='spatial'"),
    ("chain", lambda s: s.spatial and s.chain != "double_pin",
     "3D motion is modelled for 'double_pin' only"),
    ("closure", lambda s: s.spatial and s.closure != "rigid",
     "3D motion is solved with 'rigid' only; use it, or space='planar'"),
    ("integrator", lambda s: s.spatial and s.integrator != "semi_implicit",
     "3D motion is solved with 'semi_implicit' only; use it, or space='planar'"),
    ("integrator", lambda s: s.friction != "none" and s.dahl and s.method.tableau is not None,
     "{dahl}.friction_law is dahl, whose displacement that method does not carry; use 'semi_implicit'"),
    # tensioners and wheels that move
    ("tension", lambda s: s.tension == "sprung" and not s.stepped,
     "a {tension} tensioner moves in the plane by semi- or linearly implicit steps, not with {how}; use 'locked'"),
    ("space", lambda s: s.carried and s.spatial,
     "wheel {carried} is on a spring and moves in the plane by semi- or linearly implicit steps, not with "
     "{how}; use wheels in the plane and 'planar'"),
    ("integrator", lambda s: s.carried and not s.stepped,
     "wheel {carried} is on a spring and moves in the plane by semi- or linearly implicit steps, not with "
     "{how}; use 'semi_implicit'"),
    ("drag", lambda s: s.drag == "rolling" and s.armless,
     "wheel {armless} has a bearing_drag or bearing_torque and no rolling_arm; use 'viscous', or give it one"),
    ("tooth_contact", lambda s: s.tooth_contact == "three_surfaces" and not s.rig.groove_profile.as_table_1,
     "three surfaces are made of the ten arcs of Table 1, which this rig's profile does not have; use 'ten_arcs'"),
    ("bushing_law",
     lambda s: s.bushing_law == "hysteretic" and s.rig.bushing.damping > 0 and s.rig.bushing.loss_factor == 0,
     "bushing.damping of the rig is {rig.bushing.damping:g} and its loss_factor is 0; use 'viscous', or give it one"),
)  # fmt: skip


def check_choices(scene) -> None:
    """Raise `InputError` for combinations of choices that make no sense (`REFUSALS`)."""
    rig, integrator = scene.rig, scene.integrator
    spatial = decide(scene)["space"].setting == "spatial"
    wheels = {} if scene.chain == "belt" else rig.wheels
    # a wheel that another law slows must not lose its drag silently
    slowed = {name: wheel for name, wheel in wheels.items() if wheel.bearing_drag + wheel.bearing_torque > 0}
    facts = SimpleNamespace(
        **{name: getattr(scene, name) for name in type(scene).model_fields},
        bodies=scene.bodies, belt=scene.chain == "belt",
        method=METHODS[integrator], tilted=wheel_out_of_plane(rig), spatial=spatial,
        dahl=", ".join(name for name, surface in rig.contact_surfaces.items() if surface.friction_law == "dahl"),
        stepped=integrator in ("semi_implicit", "linearly_implicit") and not spatial,
        how="3D motion" if spatial else f"integrator={integrator!r}",
        carried=next((name for name, wheel in wheels.items() if wheel.suspension is not None), None),
        armless=next((name for name, wheel in slowed.items() if wheel.rolling_arm + wheel.seal_drag == 0), None),
    )  # fmt: skip
    for field, when, remedy in REFUSALS:
        if when(facts):
            raise InputError(f"scene: {field} = {shown(getattr(scene, field))}: {remedy.format(**vars(facts))}")

"""Variants of a scene, each with one difference, for all studies of effects."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from trackdyn.scene.choices import PRESETS

REFERENCE = "paper"  # preset of the scene that variants are compared with


class Variant(NamedTuple):
    """Fields of the scene and of the rig that differ."""

    name: str
    scene: Mapping[str, Any] = MappingProxyType({})
    rig: Mapping[str, Any] = MappingProxyType({})
    physics: str = ""  # name in the study of accuracy against cost
    departure: bool = True  # a modelling choice that docs/deviations.md names


BELT = {"chain": "belt", "ring_radius": None, "contact_log": False, "every_link": False}
VARIANTS = (
    Variant("preset=paper", physics="ten_arcs", departure=False),
    *(Variant(f"preset={name}", fields, departure=False) for name, fields in PRESETS.items() if name != REFERENCE),
    Variant("chain=belt", BELT, physics="belt", departure=False),
    Variant("chain=single_pin", {"chain": "single_pin"}, physics="single_pin"),
    Variant("space=spatial", {"space": "spatial"}, physics="spatial"),
    Variant("tooth_contact=three_surfaces", {"tooth_contact": "three_surfaces"}, physics="three_surfaces"),
    Variant("tooth_contact=none", {"tooth_contact": "none"}, departure=False),
    Variant("normal_law=delivered", {"normal_law": "delivered"}),
    Variant("normal_law=elastic", {"normal_law": "elastic"}),
    Variant("friction=none", {"friction": "none"}),
    Variant("closure=elastic_damping", {"closure": "elastic_damping"}),
    Variant("tension=sprung", {"tension": "sprung"}),
    Variant("tension=retensioned", {"tension": "retensioned"}),
    Variant("drag=viscous", {"drag": "viscous"}),
    Variant("drag=coulomb", {"drag": "coulomb"}),
    Variant("drag=rolling", {"drag": "rolling"}),
    Variant("bearing_drag=0", {"drag": "viscous"}, {"idler__bearing_drag": 0.0, "road_wheel__bearing_drag": 0.0}),
    Variant("bushing_law=viscous", {"bushing_law": "viscous"}),
    Variant("bushing_law=hysteretic", {"bushing_law": "hysteretic"}),
    Variant("bushing.free_angle=0.2", rig={"bushing__free_angle": 0.2}),
    Variant("impact.factor_limit=1000", rig={"impact__factor_limit": 1000.0}),
    Variant("impact.speed_floor=0.01", rig={"impact__speed_floor": 0.01}),
    Variant("impact.speed_floor=0.001", rig={"impact__speed_floor": 0.001}),
    Variant("equal_pitch_radius=0.305", rig={"sprocket__equal_pitch_radius": 0.305}),
    Variant("equal_pitch_radius=0.308", rig={"sprocket__equal_pitch_radius": 0.308}),
    Variant("integrator=linearly_implicit", {"integrator": "linearly_implicit"}),
    Variant("integrator=rk4", {"integrator": "rk4"}),
    Variant("step=1e-4", {"step": 1e-4}),
    # the scatter to compare the others with: the same motion recorded later
    Variant("lead_in=7", {"lead_in": 7.0}),
)
SETTINGS = {variant.name: variant for variant in VARIANTS}
PHYSICS = {variant.physics: variant.scene for variant in VARIANTS if variant.physics}
# words for methods and for coarser physics, in tables and pictures
METHOD_WORDS = {"semi_implicit": "semi-implicit Euler", "linearly_implicit": "linearly implicit", "rk4": "RK4"}
PHYSICS_WORDS = {
    "spatial": "3D", "three_surfaces": "three surfaces", "single_pin": "one body per pitch", "belt": "belt",
}  # fmt: skip

"""The variants of a scene, each with one thing different: one table, of which every study of effects takes its rows."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from trackdyn.scene.fidelity import PRESETS

REFERENCE = "paper"  # preset of the scene that variants are compared with


class Variant(NamedTuple):
    """Fields of the scene and of the rig that are different, and the names of the row in the outputs that have it."""

    setting: str = ""  # in the table of fidelities
    departure: str = ""  # in docs/deviations.md
    physics: str = ""  # in the study of accuracy against cost
    scene: Mapping[str, Any] = MappingProxyType({})
    rig: Mapping[str, Any] = MappingProxyType({})


VARIANTS = (
    Variant("preset=paper", physics="ten_arcs"),
    *(Variant(f"preset={name}", scene=fields) for name, fields in PRESETS.items() if name != REFERENCE),
    Variant("chain=belt", "", "belt", {"chain": "belt", "ring_radius": None, "spells": False, "every_link": False}),
    Variant("chain=single_pin", "", "single_pin", {"chain": "single_pin"}),
    Variant("space=spatial", "", "spatial", {"space": "spatial"}),
    Variant("tooth_contact=three_surfaces", "three surfaces", "three_surfaces", {"tooth_contact": "three_surfaces"}),
    Variant("tooth_contact=none", scene={"tooth_contact": "none"}),
    Variant("normal_law=delivered", "law delivers restitution", scene={"normal_law": "delivered"}),
    Variant("normal_law=elastic", scene={"normal_law": "elastic"}),
    Variant("friction=none", scene={"friction": "none"}),
    Variant("closure=elastic_damping", "cut elastic", scene={"closure": "elastic_damping"}),
    Variant("tension=sprung", "tension sprung", scene={"tension": "sprung"}),
    Variant("drag=viscous", scene={"drag": "viscous"}),
    Variant("drag=coulomb", "drag coulomb", scene={"drag": "coulomb"}),
    Variant("bushing_law=viscous", scene={"bushing_law": "viscous"}),
    Variant("integrator=linearly_implicit", scene={"integrator": "linearly_implicit"}),
    Variant("integrator=rk4", scene={"integrator": "rk4"}),
    # the scatter to compare departures with: the same motion recorded later
    Variant(departure="later start", scene={"lead_in": 7.0}),
    Variant(departure="step 1e-4 s", scene={"step": 1e-4}),
    Variant(departure="free angle 0.2 rad", rig={"bushing__free_angle": 0.2}),
    Variant(departure="bracket to 1000", rig={"impact__factor_limit": 1000.0}),
    Variant(departure="speed floor 0.01 m/s", rig={"impact__speed_floor": 0.01}),
    Variant(departure="speed floor 0.001 m/s", rig={"impact__speed_floor": 0.001}),
    Variant(
        departure="no drag",
        scene={"drag": "viscous"},
        rig={"idler__bearing_drag": 0.0, "road_wheel__bearing_drag": 0.0},
    ),
    Variant(departure="drag rolling", scene={"drag": "rolling"}),
    Variant(departure="bushings hysteretic", scene={"bushing_law": "hysteretic"}),
    Variant(departure="tension retensioned", scene={"tension": "retensioned"}),
    Variant(departure="equal pitch 0.3034 m", rig={"sprocket__equal_pitch_radius": 0.3034}),
    Variant(departure="equal pitch 0.308 m", rig={"sprocket__equal_pitch_radius": 0.308}),
)
SETTINGS = {variant.setting: variant.scene for variant in VARIANTS if variant.setting}
DEPARTURES = {variant.departure: variant for variant in VARIANTS if variant.departure}
PHYSICS = {variant.physics: variant.scene for variant in VARIANTS if variant.physics}


def change(measure: str, before: float, after: float) -> float:
    """Change of a measure: of a share, whose name says so, in points of a turn; of all else relative to ``before``."""
    if "_share" in measure:
        return after - before
    return (after - before) / before if before else float("nan")

"""Extremes of restitution."""

from collections.abc import Iterator
from itertools import product

import numpy as np

from trackdyn.contact.laws import force_and_slopes
from trackdyn.jit import kernel
from trackdyn.rig.laws import delivered_restitution
from trackdyn.rig.rig import Rig
from trackdyn.scene.build import make_law
from trackdyn_replication.study.extremes.judge import attempted, within_bounds

STEEL_AND_TOOTH = ("steel__youngs_modulus", "tooth_contact__youngs_modulus")


def lighter(rig: Rig, ratio: float) -> dict[str, float]:
    """Return changes of a rig that make its links ``ratio`` times as heavy as its connectors."""
    return {f"chain__connector_{name}": getattr(rig.chain, f"link_{name}") / ratio for name in ("mass", "inertia")}


@kernel
def _rebound(law, mass, speed, radius, steps):
    """Return speed after over speed before an impact, by leapfrog steps of a ``steps``-th of a half period."""
    x, v = 0.0, speed
    h = np.sqrt(mass * radius**0.5 / (law.stiffness * (speed + 1e-9) ** 0.5)) / steps
    for _ in range(1000 * steps):
        x += 0.5 * h * v
        if x <= 0.0:
            break
        v -= h * force_and_slopes(law, x, v, speed, radius)[0] / mass
        x += 0.5 * h * v
        if x <= 0.0:
            break
    return -v / speed


def _impact(rig: Rig, law_name: str, value: float) -> dict:
    surface = rig.tooth_contact
    law = make_law(
        surface.contact_length, rig.composite_modulus(surface), value, 0.0, 0.0, 1.0, 1e-9, rig.impact.factor_limit,
        law_name,
    )  # fmt: skip
    expected = delivered_restitution(law.loss) if law_name == "printed" else value
    restitution = _rebound(law, rig.chain.link_mass, 0.5, 0.08, 4000)
    return within_bounds(restitution, expected, 2e-3, "restitution", group=law_name, at=value)


def restitution(
    rig: Rig, nominal=(0.01, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0)
) -> Iterator[dict]:
    """Yield the restitution of an impact against the nominal one, for both normal laws."""
    for law, value in product(("printed", "delivered"), nominal):
        yield attempted("restitution", f"one impact, {law}, {value:g}", _impact, rig, law, value)

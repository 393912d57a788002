"""Which rings can be asked for on a rig: from the least that bears load to the largest that its tensioner allows."""

from math import ceil, floor, pi, sin

import numpy as np

from trackdyn.model.constants import Law
from trackdyn.parameters.groove import true_depth
from trackdyn.parameters.layout import assemble, belt_around, body_lengths
from trackdyn.parameters.rig import Rig
from trackdyn.scene.limits import elastic_depth
from trackdyn.scene.scene import Scene

# The tensioner stays where the rig's own ring put it: a larger ring tightens the loop, by this factor at most.
TIGHTER = 5.0
FINEST = 1e-5  # m, of the radii of a study


def usual_rings(rig: Rig) -> tuple[float, float]:
    """Least and largest ring of a study, m; both follow from the rig alone, without a run.

    Up to the least one the arcs of seated connectors bear the chain. With the largest one a loop whose wheels are
    locked stands at `TIGHTER` times the pre-tension: what the ring takes of its length, the strands give by their sag
    (``w^2 l^3 / (24 T^2)`` a strand) and the links by the depth of their contacts (Eq. 8). Settled loops of shipped
    rigs stand at 3 to 7 times the pre-tension there; where tensioner or wheels yield, at less.
    """
    low, high = Scene.ring_range(rig)
    least = max(rig.sprocket.equal_pitch_radius - _seat_depth(rig), low)
    return least, max(min(high, _tightened(rig)), least)


def study_radii(rig: Rig, count: int = 11) -> list[float]:
    """Radii of a ring study from the least to the largest of `usual_rings`, m, to a hundredth of a millimetre."""
    least, largest = usual_rings(rig)
    return (
        np.unique(np.round(np.linspace(ceil(least / FINEST), floor(largest / FINEST), count)) * FINEST)
        .round(5)
        .tolist()
    )


def _seat_depth(rig: Rig) -> float:
    """How far below the pin circle the arcs of a connector come to rest in its groove, m; a bisection."""
    half, arc, groove = rig.connector_length / 2, rig.chain.connector_radius, rig.groove_profile
    height = (rig.pin_circle**2 - half**2) ** 0.5
    free, steel = -arc, arc
    while steel - free > 1e-9:
        middle = (free + steel) / 2
        touches = true_depth(groove, arc, np.array([[-half, height - middle]]))[0] > 0
        free, steel = (free, middle) if touches else (middle, steel)
    return free


def _tightened(rig: Rig) -> float:
    """Ring at which a loop whose tensioner is locked stands at `TIGHTER` times its pre-tension, m."""
    model, lengths = Scene(rig, 0.0).model, body_lengths(rig, rig.chain.kind)
    path, order = belt_around(rig, assemble(rig, lengths).shift, float(lengths[0]))
    wheels, pitch = model.wheels, float(lengths.sum()) / rig.chain.pitches
    weight = model.chain.gravity * float(model.chain.mass.sum() / lengths.sum())
    sag = weight**2 * float((np.diff(path.start)[1::2] ** 3).sum()) / 24
    start = rig.ring_radius or rig.sprocket.ring_radius

    def spare(tension: float) -> float:
        """Length that sag and contacts give at a tension (N), but for a constant, m."""
        length = -sag / tension**2
        for wrap, wheel in zip(path.wrap, order, strict=True):
            radius = float(wheels.radius[wheel]) if wheel else start
            law = Law(*map(float, wheels.own_law[wheel])) if wheel and len(wheels.own_law) else wheels.wheel_law
            load = 2 * tension * sin(min(pitch / (2 * (radius + wheels.half_thickness)), pi / 2))
            length += float(wrap) * elastic_depth(law if wheel else wheels.ring_law, load, radius)
        return length

    tension = max(rig.tension.pre_tension, 1.0)
    return start + (spare(TIGHTER * tension) - spare(tension)) / float(path.wrap[order.index(0)])

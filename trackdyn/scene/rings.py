"""Radii of a ring study: from the least that bears load to the largest that the tensioner allows."""

from math import ceil, floor, log10

import numpy as np

from trackdyn.inputs.errors import InputError
from trackdyn.model.constants import Law
from trackdyn.rig.groove import true_depth
from trackdyn.rig.layout import assemble, body_lengths
from trackdyn.rig.rig import Rig
from trackdyn.scene.scene import Scene
from trackdyn.scene.step import elastic_depth, pitch_load

# The tensioner stays where the rig's own ring put it: a larger ring tightens the loop, by this factor at most.
TIGHTER = 5.0
FINEST = 1e-5  # m, of the radii of a study, or a hundredth of their range where that is less


def usual_rings(rig: Rig) -> tuple[float, float]:
    """Return the least and the largest radius of a study, m; both follow from the rig without a run.

    Below the least one the arcs of seated connectors bear the chain. With the largest one the tension of a loop with
    locked wheels is `TIGHTER` times the pre-tension: sag of the strands (``w^2 l^3 / (24 T^2)`` a strand) and depth of
    the contacts (Eq. 8) provide the length that the ring takes from the rig's own, or the least one, on. Settled loops
    of included rigs have 3 to 7 times the pre-tension there. Raises `InputError`: the least ring is too large.
    """
    least, high = least_ring(rig), Scene.ring_range(rig)[1]
    if not least < high:
        allowed = f"tension.travel = {rig.tension.travel:g} m allows {high:.5g} m"
        remedy = "check sprocket.equal_pitch_radius and sprocket.ring_radius, or enlarge the travel"
        raise InputError(f"ring: the least ring that carries the chain has {least:.5g} m, and {allowed}; {remedy}")
    return least, min(high, _tightened(rig, max(rig.ring_radius or rig.sprocket.ring_radius, least)))


def least_ring(rig: Rig) -> float:
    """Return the radius up to which the arcs of seated connectors bear the chain, m: a smaller ring carries nothing."""
    half, arc, groove = rig.connector_length / 2, rig.chain.connector_radius, rig.groove_profile
    height = (rig.pin_circle**2 - half**2) ** 0.5
    free, steel = -arc, arc  # depths below the pin circle, by bisection that at which the arcs rest in their groove
    while steel - free > 1e-9:
        middle = (free + steel) / 2
        touches = true_depth(groove, arc, np.array([[-half, height - middle]]))[0] > 0
        free, steel = (free, middle) if touches else (middle, steel)
    return max(rig.sprocket.equal_pitch_radius - free, Scene.ring_range(rig)[0])


def study_radii(rig: Rig, count: int = 11) -> list[float]:
    """Return radii of a ring study within `usual_rings`, m, rounded to `FINEST`; `InputError` as there."""
    least, largest = usual_rings(rig)
    digits = ceil(-log10(min(FINEST, (largest - least) / 100)))
    grid = 10.0**digits
    inside = np.linspace(ceil(least * grid), floor(largest * grid), count)
    return (np.round(inside) / grid).round(digits).tolist()


def _tightened(rig: Rig, start: float) -> float:
    """Return the radius that raises the tension to `TIGHTER` times the pre-tension, which is that at ``start``, m."""
    model, lengths = Scene(rig, 0.0, start).model, body_lengths(rig, rig.chain.kind)
    laid, wheels = assemble(rig, lengths), model.wheels
    sag = laid.path.sag(model.chain.gravity * float(model.chain.mass.sum() / lengths.sum()))

    def spare(tension: float) -> float:
        """Return the length provided by sag and contacts at a tension (N), up to a constant, m."""
        length = -sag / tension**2
        for wrap, wheel in zip(laid.path.wrap, laid.order, strict=True):
            load = pitch_load(model, tension, radius := float(wheels.radius[wheel]) if wheel else start)
            length += float(wrap) * elastic_depth(Law(*wheels.law[wheel].tolist()), load, radius)
        return length

    tension = max(rig.tension.pre_tension, 1.0)
    return start + (spare(TIGHTER * tension) - spare(tension)) / float(laid.path.wrap[laid.order.index(0)])

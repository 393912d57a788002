"""How strongly the links hold to the ring: the mobilised friction, which no law of friction has to be known for."""

import numpy as np

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.validation import typed, within
from trackdyn.measure.uncertainty import NAN, Estimate, Series, ratio_values
from trackdyn.model.arrays import RING, Work, components
from trackdyn.simulation.loop import Loop


def ring_forces(work: Work) -> tuple[float, float]:
    """Return the sums of normal and of tangential forces, by size, of all links on the ring at the last loads, N."""
    rows = work.contact[: work.count[0]]
    rows = rows[rows["kind"] == RING]
    normal, friction = (np.linalg.norm(components(rows, name, "xyz"), axis=1) for name in ("normal", "friction"))
    return float(normal.sum()), float(friction.sum())


@typed
def mobilised_friction(loop: Loop, passages: int | None = None) -> Estimate:
    """Run a loop on and return the mobilised friction of its ring.

    That is the integral of the size of the tangential force of all links on the ring over the integral of their normal
    force: the coefficient of friction that is in use, between 0 and the static one. It compares laws of friction that
    have no number in common, such as a transition velocity (Eq. 10) and a shear stiffness.

    Parameters
    ----------
    loop : Loop
        In steady running; it is left at the end of the passages.
    passages : int, optional
        Passages of a pitch to integrate over, a turn of the sprocket by default. Forces are taken at the rate of the
        sensor.

    Returns
    -------
    Estimate
        Value (1), its standard error by batch means over the passages, and half of the 95 % interval; NaN for a ring
        that carries nothing.

    Raises
    ------
    InputError
        The scene has no ring.
    DivergenceError
        As the steps of a `Loop`.
    """
    scene = loop.scene
    if scene.ring_radius is None:
        raise InputError("scene: ring_radius = None: mobilised friction needs a ring; set ring_radius")
    teeth = scene.rig.sprocket.teeth
    count = teeth if passages is None else int(within("passages", passages, 1, 1000 * teeth))
    edges = np.rint(np.arange(count + 1) * scene.periods.passage * scene.rig.rate).astype(int)
    forces = np.zeros((edges[-1], 2))
    for sample in range(len(forces)):
        loop.step(loop.model.stride)
        forces[sample] = ring_forces(loop.work)
    normal, friction = np.add.reduceat(forces, edges[:-1]).T
    if not normal.any():
        return Estimate(NAN, NAN, NAN)
    return Series(ratio_values(friction, normal), np.arange(count)).estimate()

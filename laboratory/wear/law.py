"""The law of wear: removed volume is work of friction over an energy density (Fleischer).

Archard's law with a constant coefficient of friction is the same: the energy density is ``mu H / K``.
"""

from itertools import pairwise
from math import pi
from pathlib import Path
from typing import Annotated

import numpy as np

from laboratory.wear.contour import ARC_NODES, Contour
from laboratory.wear.work import Worked
from trackdyn.parameters.quantities import FROM_FILE, Quantity
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.validation import Section, validated
from trackdyn.parameters.yaml_file import read_yaml

DEFAULT = Path(__file__).with_name("coefficients.yaml")
EnergyDensity = Annotated[float, Quantity("J/m3", gt=0)]


class Coefficients(Section):
    """Energy densities of the parts that wear (J/m3), the area of a bushing that does (m2), and the standard deviation
    of the place on a groove at which connectors touch (m): the model's connectors are alike, those of a chain are not.
    """

    tooth: EnergyDensity
    arc: EnergyDensity
    ring: EnergyDensity
    bushing: EnergyDensity
    bushing_area: Annotated[float, Quantity("m2", gt=0)]
    scatter: Annotated[float, Quantity("m", ge=0, le=0.01)]


def load_coefficients(path: Path | str = DEFAULT) -> Coefficients:
    """Read and validate a file of wear coefficients, each with value, unit, kind and source."""
    return validated(Coefficients, read_yaml(path), str(path), "add it with value, unit, kind and source", FROM_FILE)


def depth(work, energy_density: float, area):
    """Return the depth of wear, m, of an area (m2) for friction work (J) and energy density (J/m3)."""
    return work / (energy_density * area)


class Depths:
    """Where the parts of the state of a worn rig stand: depths in m, and the distance that the chain ran in m.

    ``ring`` and ``bushing`` are single depths, ``arcs`` those of left and right arc over the angle, ``flanks`` those
    of left and right flank over the nodes of the contour.
    """

    def __init__(self, contours: tuple[Contour, Contour]):
        self.contours = contours
        ends = np.cumsum([2, 2 * ARC_NODES, *(len(contour.points) for contour in contours)])
        self.ring, self.bushing, self.distance, self.size = 0, 1, int(ends[3]), int(ends[3]) + 1
        self.arcs, *self.flanks = (slice(int(a), int(b)) for a, b in pairwise(ends))

    def rates(self, rig: Rig, ring_radius: float | None, worked: Worked, coefficients: Coefficients) -> np.ndarray:
        """Change of the state for each metre that the chain runs, of the work over a stretch."""
        c, chain, found = coefficients, rig.chain, np.zeros(self.size)
        if ring_radius is not None:
            found[self.ring] = depth(worked.ring, c.ring, 2 * pi * ring_radius * rig.ring_contact.contact_length)
        found[self.bushing] = depth(worked.bushing, c.bushing, 2 * chain.pitches * c.bushing_area)
        width = rig.tooth_contact.contact_length
        strip = 2 * pi / ARC_NODES * chain.connector_radius * width
        found[self.arcs] = depth(worked.arcs.ravel(), c.arc, chain.pitches * strip)
        for flank, contour, work in zip(self.flanks, self.contours, worked.flanks, strict=True):
            spread = contour.spread(c.scatter) @ work.sum(axis=0)
            found[flank] = depth(spread, c.tooth, rig.sprocket.teeth * width * contour.length)
        found[self.distance] = worked.distance
        return found / worked.distance

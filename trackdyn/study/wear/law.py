"""The law of wear: removed volume is work of friction over an energy density (Fleischer).

Archard's law with a constant coefficient of friction is the same: the energy density is ``mu H / K``.
"""

from math import pi
from pathlib import Path
from typing import Annotated

import numpy as np

from trackdyn.parameters.quantities import FROM_FILE, Quantity
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.validation import Section, validated
from trackdyn.parameters.yaml_file import read_yaml
from trackdyn.study.wear.contour import ARC_NODES, Contour
from trackdyn.study.wear.work import Worked

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

    def scaled(self, **factors: float) -> "Coefficients":
        """With some energy densities multiplied."""
        return Coefficients(**self.model_dump() | {name: getattr(self, name) * by for name, by in factors.items()})


def load_coefficients(path: Path | str = DEFAULT) -> Coefficients:
    """Read and validate a file of coefficients; every one has value, unit, kind and source.

    Raises
    ------
    InputError
        One sentence with file, field, value and what is accepted.
    """
    return validated(Coefficients, read_yaml(path), str(path), "add it with value, unit, kind and source", FROM_FILE)


def depth(work, energy_density: float, area):
    """Depth (m) that work of friction (J) takes off an area (m2)."""
    return work / (energy_density * area)


class Depths:
    """Names of the parts of a vector of depths (m) of a worn rig: where each begins and ends.

    ``ring`` and ``bushing`` are single depths, ``arcs`` those of left and right arc over the angle, ``flanks`` those
    of left and right flank over the nodes of the contour.
    """

    def __init__(self, contours: tuple[Contour, Contour]):
        self.contours = contours
        ends = np.cumsum([1, 1, 2 * ARC_NODES, *(len(contour.points) for contour in contours)])
        self.size = int(ends[-1])
        self.ring, self.bushing = 0, 1
        self.arcs = slice(2, int(ends[2]))
        self.flanks = slice(int(ends[2]), int(ends[3])), slice(int(ends[3]), int(ends[4]))

    def rates(self, rig: Rig, ring_radius: float | None, worked: Worked, coefficients: Coefficients) -> np.ndarray:
        """Depths (m) for each metre that the chain runs, of the work over a stretch."""
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
        return found / worked.distance

    def removed(self, rig: Rig, ring_radius: float | None, depths: np.ndarray) -> dict[str, float]:
        """Volumes (m3) that depths are, of ``ring``, ``arc`` and ``tooth``: the other way around."""
        width, strip = rig.tooth_contact.contact_length, 2 * pi / ARC_NODES * rig.chain.connector_radius
        ring = 0.0 if ring_radius is None else 2 * pi * ring_radius * rig.ring_contact.contact_length
        lengths = zip(self.flanks, self.contours, strict=True)
        return {
            "ring": float(depths[self.ring]) * ring,
            "arc": float(depths[self.arcs].sum()) * strip * width * rig.chain.pitches,
            "tooth": sum(float(depths[f] @ c.length) for f, c in lengths) * width * rig.sprocket.teeth,
        }

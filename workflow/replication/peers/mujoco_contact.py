"""Contacts of the loop by MuJoCo's own primitives: discs as spheres, links as capsules, and MuJoCo's own law.

All centres lie in the plane of the chain, so a sphere is a disc there and a capsule a bar with round ends. A link on a
wheel is then the geometry of Eq. 35. The concave areas of a groove are tangents, each the side of a capsule.

MuJoCo's contact is a constraint with a force ``f = -(k r + b v + a) / R`` from depth ``r``, its rate and the
acceleration ``a`` that the step ends with: spring, damper and inertance 1 / R. With the impedance d, ``R = (1 - d) A /
d``; ``A`` is set to 1 / kg by the caller. Springs and dampers are matched to the rig's laws at one working load, in
force and slope; the inertance has no counterpart in the rig. It is what lets coarse steps run, and it is small beside
a link.
"""

from math import cos, pi, sin, sqrt, tan
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from replication.peers.contact import Contacts

# Inertance of a contact of rubber and of steel, kg; how many times as much against slip (MuJoCo's impratio).
RUBBER, STEEL, ACROSS = 1.0, 4.0, 10.0
# Largest rate at which friction slows slip, 1/s: a step of half a millisecond still takes it.
FASTEST = 4000.0
FACET = 0.08  # largest turn from one tangent of a concave arc to the next, rad


class Cushion(NamedTuple):
    """A contact at its working load."""

    depth: float  # penetration under the load, m
    stiffness: float  # load over depth, N/m; the slope is one and a half of it
    damping: float  # of the penetration rate, N s/m
    creep: float  # of the slip, below the friction limit, N s/m
    inertance: float  # kg
    friction: float  # coefficient of the friction limit


class Disc(NamedTuple):
    """A circle of steel: its centre (m) in the frame of the groove or of the sprocket, and its radius (m)."""

    centre: np.ndarray
    radius: float


class Facet(NamedTuple):
    """A bar of steel with round ends: the ends of its axis and half its thickness, m."""

    first: np.ndarray
    second: np.ndarray
    radius: float


def cushion(law: np.ndarray, radius: float, load: float, speed: float, inertance: float) -> Cushion:
    """What a law of `peers.contact` amounts to under a load.

    ``law`` is a row of ``Contacts.law``, ``radius`` (m) R and ``speed`` (m/s) the initial impact velocity of Eq. 8,
    ``load`` the working load (N).
    """
    depth = brentq(lambda d: law[0] * d * sqrt(d / (radius + d)) - load, 0.0, radius, xtol=1e-15)
    # Eq. 10 at rest: its slope times the load
    slope = (4 * law[3] + (law[2] - law[3]) / 0.75**2) / law[4]
    return Cushion(depth, load / depth, law[1] * load / speed, slope * load, inertance, law[3])


def soft(given: Cushion) -> dict[str, list[float]]:
    """MuJoCo's ``solref``, ``solimp`` and ``solreffriction`` of a cushion for ``A`` = 1 / kg.

    The impedance grows in line with the depth so that the force, which goes with ``d^2 r / (1 - d)``, has one and a
    half times its secant as its slope at the working depth: the slope of Eq. 8.
    """
    d = given.inertance / (1 + given.inertance)
    lean = 0.5 / (2 + d / (1 - d))
    least, most = d * (1 - lean), d * (1 + lean)
    creep = min(given.creep / (given.inertance * ACROSS), FASTEST)
    # MuJoCo divides a direct stiffness by the square of the largest impedance, a damping by itself
    stiffness, damping = given.stiffness * (1 - d) * (most / d) ** 2, given.damping * (1 - d) / d * most
    return {
        "solref": [-stiffness, -damping],
        "solimp": [least, most, 2 * given.depth, 0.5, 1.0],
        "solreffriction": [-stiffness, -creep * most],
    }


def groove_shapes(contacts: Contacts) -> tuple[list[Disc], list[Facet]]:
    """Discs and facets of one groove in its own frame (x clockwise, y outward).

    The tip stands on the tooth line and belongs to both grooves beside it: it is given once, on the left.
    """
    discs, facets = [], []
    back = 0.75 * contacts.arc[contacts.sign > 0, 2].min()  # round ends stay within the discs beside them
    for k, (x, y, radius, ux, uy, half) in enumerate(contacts.arc):
        for side in (1.0, -1.0):
            centre, direction = np.array([side * x, y]), np.array([side * ux, uy])
            if contacts.sign[k] > 0:
                if side > 0 or abs(_off_line(contacts, x, y)) > 1e-9:
                    discs.append(Disc(centre, radius))
                continue
            count = int(np.ceil(2 * half / FACET))
            turn = 2 * half / count
            for i in range(count):
                at = (i + 0.5) * turn - half
                outward = np.array([[cos(at), -sin(at)], [sin(at), cos(at)]]) @ direction
                along = radius * tan(turn / 2) * np.array([-outward[1], outward[0]])
                middle = centre + (radius + back) * outward
                facets.append(Facet(middle - along, middle + along, back))
    return discs, facets


def _off_line(contacts: Contacts, x: float, y: float) -> float:
    """Distance of a point of the left flank from the tooth line, m."""
    half = pi / contacts.teeth
    return x * cos(half) + y * sin(half)


def sprocket_shapes(contacts: Contacts) -> tuple[list[Disc], list[Facet]]:
    """The same of all grooves in the sprocket's frame."""
    discs, facets = groove_shapes(contacts)
    around, bars = [], []
    for k in range(contacts.teeth):
        middle = (2 * k + 1) * pi / contacts.teeth
        turn = np.array([[sin(middle), cos(middle)], [-cos(middle), sin(middle)]])
        around += [Disc(turn @ disc.centre, disc.radius) for disc in discs]
        bars += [Facet(turn @ bar.first, turn @ bar.second, bar.radius) for bar in facets]
    return around, bars

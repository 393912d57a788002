"""The worn rig: depths over the contour become arcs of the groove, a smaller ring, a longer link, a smaller connector.

Both flanks are looked at as left ones, the right one mirrored, tip first.
"""

from dataclasses import dataclass
from math import pi

import numpy as np
from scipy.optimize import brentq, least_squares

from trackdyn.errors import InputError
from trackdyn.parameters.groove import Groove, connector_length
from trackdyn.parameters.outline import LEAST_ARC, distance_to, flank_arcs, groove_of_arcs
from trackdyn.parameters.rig import Rig

SPACING = 4e-4  # m between the nodes of a contour: about the width of the contact of steel on steel under 3 kN
ARC_NODES = 360  # of a connector's arc
OFF = 1e-2  # m, what arcs count as missing a flank that are none
CLEAR = 1e-4  # m by which a concave arc stays wider than the connector's


@dataclass(frozen=True)
class Contour:
    """One flank of a new groove."""

    points: np.ndarray  # (n, 2) nodes from the tip to the bottom, m
    normal: np.ndarray  # (n, 2) unit normals out of the steel
    length: np.ndarray  # (n,) length of the contour that belongs to each node, m
    arcs: np.ndarray  # (k, 4) arcs of the flank (`parameters.outline.groove_of_arcs`)

    def worn(self, depth: np.ndarray) -> np.ndarray:
        """(n, 2) points with depths (n,) taken off, m."""
        return self.points - depth[:, None] * self.normal

    def spread(self, deviation: float) -> np.ndarray:
        """(n, n) matrix that spreads what each node gets over a normal distribution of places (m) along the flank."""
        along = np.cumsum(self.length) - self.length / 2
        weight = np.exp(-0.5 * ((along[:, None] - along) / max(deviation, SPACING / 10)) ** 2) * self.length[:, None]
        return weight / weight.sum(axis=0)


def contours(groove: Groove) -> tuple[Contour, Contour]:
    """Return the contours of the left and right flank of a groove."""
    areas, half = list(range(len(groove.radius))), len(groove.radius) // 2
    return _contour(groove, areas[:half], 1.0), _contour(groove, areas[half:][::-1], -1.0)


def _contour(groove: Groove, areas: list[int], side: float) -> Contour:
    mirror = np.array([side, 1.0])
    points, normals = [], []
    for j in areas:
        arc = groove.arc(j + 1, 400)[:: int(side)] * mirror
        out = (arc - groove.centre[j] * mirror) / groove.radius[j] * (1.0 if groove.convex[j] else -1.0)
        points.append(arc)
        normals.append(out)
    dense, normal = np.vstack(points), np.vstack(normals)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(dense, axis=0).T))])
    at = np.linspace(0.0, along[-1], max(int(along[-1] / SPACING), 8) + 1)
    nodes, normal = (
        np.column_stack([np.interp(at, along, values[:, k]) for k in (0, 1)]) for values in (dense, normal)
    )
    length = np.full(len(at), at[1])
    length[[0, -1]] /= 2
    signs = np.where(groove.convex[areas], 1.0, -1.0)
    arcs = np.column_stack([groove.centre[areas] * mirror, groove.radius[areas], signs])
    return Contour(nodes, normal / np.hypot(*normal.T)[:, None], length, arcs)


def fit_flank(flank: Contour, depth: np.ndarray, teeth: int, arc_radius: float) -> tuple[np.ndarray, float]:
    """Tangent arcs that follow a worn flank, and how far they miss it where it is worn, m.

    Squared distances are weighted with the depth and a tenth of the greatest one: a scar is narrow, and the point that
    touches is what counts. The second number is the root of their mean, weighted with the depth alone. The fit starts
    from the arcs of the new flank. The bottom stays where it is, so that both flanks meet there.

    Raises
    ------
    InputError
        The arcs cannot follow the flank.
    """
    depth = np.maximum(depth, 0.0)  # a step in which slip turns may give friction work that is less than nothing
    arcs, points = flank.arcs, flank.worn(depth)
    k, signs = len(arcs), arcs[:, 3]
    weight = np.sqrt(depth / depth.max() + 0.1)
    bottom = arcs[-1, 1] + signs[-1] * arcs[-1, 2]
    least = np.where(signs[1:] > 0, LEAST_ARC, arc_radius + CLEAR)
    between, reach = np.diff(arcs[:, :2], axis=0), -np.diff(signs * arcs[:, 2])
    slopes = np.arctan2(between[:, 0] / reach, between[:, 1] / reach)

    def arcs_of(p):
        radii = least + np.exp(p[: k - 1])
        return flank_arcs(signs, radii, p[k - 1 :], bottom - signs[-1] * radii[-1], teeth)

    def misses(p):
        try:
            return distance_to(groove_of_arcs(arcs_of(p), teeth), points) * weight
        except (InputError, OverflowError, ZeroDivisionError):
            return np.full(len(points), OFF)

    start = np.concatenate([np.log(np.maximum(arcs[1:, 2] - least, CLEAR)), slopes])
    fit = least_squares(misses, start, x_scale="jac", max_nfev=200, xtol=1e-12, ftol=1e-12)
    missed = float(np.sqrt(((fit.fun / weight) ** 2 @ depth) / depth.sum()))
    if not missed < OFF:
        raise InputError("no tangent arcs follow the worn flank")
    return arcs_of(fit.x), missed


def worn_rig(rig: Rig, of: tuple[Contour, Contour], flanks, arcs: np.ndarray, bushing: float) -> tuple[Rig, float]:
    """A rig with worn grooves, connectors and pins, and how far its arcs miss the worn flanks, m.

    Parameters
    ----------
    rig : Rig
        As new.
    of : tuple of Contour
        Its flanks.
    flanks : pair of (n,) arrays
        Depths over left and right flank, m.
    arcs : array
        Depths over the connector's arcs, m. Their mean, weighted with themselves, is taken off the radius of both: the
        model has one radius, and it is that of the point that touches.
    bushing : float
        Depth of every bore, m: a link grows by twice as much, the connector keeps its length.

    Raises
    ------
    InputError
        The arcs cannot follow a flank, or there is no such rig.
    """
    chain, teeth, half = rig.chain, rig.sprocket.teeth, rig.chain.link_thickness / 2
    radius = chain.connector_radius - (float((arcs**2).sum() / arcs.sum()) if arcs.any() else 0.0)
    fits = [
        fit_flank(contour, depth, teeth, radius) if depth.max() > 0 else (contour.arcs, 0.0)
        for contour, depth in zip(of, flanks, strict=True)
    ]
    link = chain.link_length + 2 * bushing

    def longer(r):
        return connector_length(teeth, link, ((r + half) ** 2 + link**2 / 4) ** 0.5) - rig.connector_length

    new = rig.sprocket.equal_pitch_radius
    # a longer link asks for a wheel larger by teeth / 2 pi of what it grew
    bound = new + max(4 * bushing * teeth / (2 * pi), 1e-6)
    equal = brentq(longer, new - 1e-6, bound, xtol=1e-15) if bushing else new
    worn = rig.changed(
        groove=None, profile={"arcs": fits[0][0].tolist(), "right": fits[1][0].tolist()}, chain__link_length=link,
        chain__connector_radius=radius, sprocket__equal_pitch_radius=equal,
    )  # fmt: skip
    return worn, max(missed for _, missed in fits)

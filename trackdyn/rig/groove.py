"""The tooth groove as ten tangent circular arcs (Table 1, Figs. 5 and 7).

Arcs are numbered as in the paper: 1 and 10 at the tooth tips, 5 and 6 at the bottom; 1, 4, 7, 10 are convex, the others
concave. Everything is in the groove frame {O_S, x_k, y_k}: y_k points from the sprocket's centre to the lowest point of
the groove, x_k clockwise from it, so areas 1 to 5 (the left flank) have x <= 0.
"""

from dataclasses import dataclass
from math import acos, asin, atan2, cos, hypot, pi, sin, sqrt

import numpy as np

from trackdyn.inputs.errors import InputError
from trackdyn.rig.sections import GrooveParameters

CONVEX = (1, 4, 7, 10)
EDGE = 1e-9  # radius of an edge, m


def connector_length(teeth: int, link_length: float, pin_circle: float) -> float:
    """Solve ``teeth [arcsin(a / 2 rp) + arcsin(b / 2 rp)] = pi`` for the connector's length b, m; or `InputError`."""
    if link_length >= 2 * pin_circle or (rest := pi / teeth - asin(link_length / (2 * pin_circle))) <= 0:
        circle = f"a pin circle of radius {pin_circle:.5g} m with {teeth} teeth"
        remedy = "shorten the link or enlarge sprocket.equal_pitch_radius"
        raise InputError(f"chain.link_length = {link_length} m leaves no room for a connector on {circle}; {remedy}")
    return 2 * pin_circle * sin(rest)


def pin_height(teeth: int, link_length: float, link_thickness: float, equal_pitch_radius: float) -> float:
    """Return the distance of a connector from the sprocket's centre when links lie on ``equal_pitch_radius``; m."""
    pin_circle = hypot(equal_pitch_radius + link_thickness / 2, link_length / 2)
    return sqrt(pin_circle**2 - connector_length(teeth, link_length, pin_circle) ** 2 / 4)


@dataclass(frozen=True)
class Groove:
    """Arcs in the groove frame: ten, or five of the coarse profile, edges included."""

    centre: np.ndarray  # (k, 2) centres O_j, m
    radius: np.ndarray  # (k,) radii r_j, m
    direction: np.ndarray  # (k, 2) unit vectors u_j from O_j to the middle of the annular sector j
    half_angle: np.ndarray  # (k,) spread angles theta_j to both sides of u_j, rad
    convex: np.ndarray  # areas 1, 4, 7 and 10 of the ten; the seating surface of the three
    addendum: float  # radius r_a of the addendum circle, m
    teeth: int  # number of grooves

    def __post_init__(self) -> None:
        """Make the arrays read-only, since all scenes of a rig share them."""
        for array in (self.centre, self.radius, self.direction, self.half_angle, self.convex):
            array.setflags(write=False)

    @property
    def as_table_1(self) -> bool:
        """True if its areas are convex and concave as those of Table 1."""
        return [area for area, convex in enumerate(self.convex, 1) if convex] == [*CONVEX] and len(self.convex) == 10

    def joints(self) -> np.ndarray:
        """Return the (k - 1, 2) points where neighbouring areas meet, area 1|2 first, m."""
        return np.array([self.arc(area, 2)[-1] for area in range(1, len(self.radius))])

    def arc(self, area: int, points: int = 30) -> np.ndarray:
        """Return (points, 2) points of an area from left to right, m."""
        j = area - 1
        middle = atan2(self.direction[j, 0], self.direction[j, 1])
        angle = middle + np.linspace(-1, 1, points) * self.half_angle[j]
        if not self.convex[j]:
            angle = angle[::-1]
        return self.centre[j] + self.radius[j] * np.column_stack([np.sin(angle), np.cos(angle)])

    def profile(self, points: int = 30) -> np.ndarray:
        """Return (k points, 2) points of the whole groove from left tip to right tip, m."""
        return np.vstack([self.arc(area, points) for area in range(1, len(self.radius) + 1)])


def groove_of_flank(teeth: int, arcs: np.ndarray, ends: np.ndarray) -> Groove:
    """Return the groove of a left flank and its mirror image.

    ``arcs`` (k, 4), tip first, are centre x, y, radius (m) and 1 for convex, -1 for concave; ``ends`` (k + 1,) the
    slopes at which they begin and the last one ends, rad.
    """
    middle, sign = (ends[:-1] + ends[1:]) / 2, arcs[:, 3]
    vectors = arcs[:, :2], sign[:, None] * np.column_stack([np.sin(middle), np.cos(middle)])
    centre, direction = (np.vstack([left, left[::-1] * [-1.0, 1.0]]) for left in vectors)
    numbers = arcs[:, 2], sign * np.diff(ends) / 2, sign > 0
    radius, half_angle, convex = (np.append(left, left[::-1]) for left in numbers)
    addendum = float(hypot(*arcs[0, :2]) + arcs[0, 3] * arcs[0, 2])
    return Groove(centre, radius, direction, half_angle, convex, addendum, teeth)


def flank_arcs(signs: np.ndarray, radii: np.ndarray, slopes: np.ndarray, bottom: float, teeth: int) -> np.ndarray:
    """Return arcs (k, 4) of a flank from (k - 1,) radii of all but the tip's (m) and slopes (rad) of its joints.

    ``bottom`` is the y of the last centre, m. From there on a common tangent at a slope puts the centres of neighbours
    on one line along its normal ``nu``. The tip arc's centre is on the tooth line, which gives its radius.
    """
    half, normals = pi / teeth, [np.array([sin(slope), cos(slope)]) for slope in slopes]
    arcs = np.zeros((len(signs), 4))
    arcs[:, 3], arcs[1:, 2], arcs[-1, 1] = signs, radii, bottom
    for i in range(len(signs) - 2, 0, -1):
        arcs[i, :2] = arcs[i + 1, :2] - (signs[i] * arcs[i, 2] - signs[i + 1] * arcs[i + 1, 2]) * normals[i]
    # O_1 = O_2 - (s_1 r_1 - s_2 r_2) nu on the tooth line x cos + y sin = 0
    towards_line = sin(slopes[0]) * cos(half) + cos(slopes[0]) * sin(half)
    reach = (arcs[1, 0] * cos(half) + arcs[1, 1] * sin(half)) / towards_line
    arcs[0, 2] = (reach + signs[1] * arcs[1, 2]) / signs[0]
    arcs[0, :2] = arcs[1, :2] - reach * normals[0]
    return arcs


def build_groove(
    design: GrooveParameters, teeth: int, connector_length: float, connector_radius: float, pin_circle: float
) -> Groove:
    """Build ten arcs with a common tangent at every joint, or raise `InputError`; lengths in m.

    Slopes of the design are those of the left flank at the joints 5|4, 4|3, 3|2 and 2|1, positive upward. An arc
    resting on the lowest point of area 3 has its centre ``seat_depth`` below the pin of a connector on the pin circle.
    """

    def refuse(field, remedy):
        unit = "deg" if field.startswith("slope") else "m"
        entry = f"groove.{field} = {getattr(design, field):.6g} {unit}"
        raise InputError(f"{entry} gives a profile that is not tangent: {remedy}")

    for higher, lower in (("slope_bottom", "slope_low"), ("slope_seat", "slope_low"), ("slope_tip", "slope_seat")):
        least = getattr(design, lower)
        if not getattr(design, higher) > least:
            refuse(higher, f"it must exceed {lower} = {least:.6g} deg")
    for name in ("r2", "r3", "r5"):
        if getattr(design, name) <= connector_radius:
            refuse(name, f"a concave area must be wider than the connector's arc, {connector_radius} m")

    signs = np.where(np.isin(np.arange(1, 6), CONVEX), 1.0, -1.0)
    radii = np.array([design.r2, design.r3, design.r4, design.r5])
    ends = np.radians([design.slope_tip, design.slope_seat, design.slope_low, design.slope_bottom])
    # the arc's centre over the lowest seat point is r3 - r_C below O_3
    third = sqrt(pin_circle**2 - connector_length**2 / 4) - design.seat_depth + design.r3 - connector_radius
    bottom = third - float(flank_arcs(signs, radii, ends, 0.0, teeth)[2, 1])
    arcs = flank_arcs(signs, radii, ends, bottom, teeth)
    if arcs[0, 2] <= 0:
        left = f"{teeth} teeth leave {connector_length:.3g} m for a connector between links"
        remedy = "enlarge sprocket.equal_pitch_radius, or take a smaller r2 or slope"
        refuse("slope_tip", f"the tip radius would be {arcs[0, 2]:.4g} m; {left}: {remedy}")
    return groove_of_flank(teeth, arcs, np.array([-pi / teeth, *ends, 0.0]))


def coarse_groove(groove: Groove, arc_radius: float) -> Groove:
    """Return left, seating and right surface instead of ten arcs, a coarser tooth of the kind in Ref. [2].

    Each flank is one concave arc through the tip-side end and the middle of area 2 and the bottom-side end of area 3;
    the seat is the root cylinder through the bottom-side ends of both. Their sectors end where an arc of radius
    ``arc_radius`` (m) touches both. Edges of the tips, areas 1 and 5 of no radius, keep the depth continuous.
    """
    joints = groove.joints()
    a, b, c = joints[0], groove.arc(2, 3)[1], joints[2]  # three points of the circle
    centre = np.linalg.solve(2 * np.array([b - a, c - a]), [b @ b - a @ a, c @ c - a @ a])
    radius = hypot(*(a - centre))
    root = hypot(*joints[2])
    both = _nearest_crossing(centre, radius - arc_radius, root + arc_radius, joints[2])
    left = (centre, radius, *_sector(joints[0] - centre, both - centre))
    seat = np.zeros(2), root, *_sector(both, both * [-1.0, 1.0])
    # a circle touches the edge between the normal of the flank and the sprocket's radius through it
    edge = joints[0], EDGE, *_sector(joints[0], centre - joints[0])
    mirror = np.array([-1.0, 1.0])
    right = [(point * mirror, size, middle * mirror, half) for point, size, middle, half in (left, edge)]
    centre, size, direction, half = (np.array(values) for values in zip(edge, left, seat, *right, strict=True))
    convex = np.array([True, False, True, False, True])
    return Groove(centre, size, direction, half, convex, groove.addendum, groove.teeth)


def true_depth(groove: Groove, arc_radius: float, points: np.ndarray) -> np.ndarray:
    """Return the depth (n,) of circles of radius ``arc_radius`` in the solid tooth, m; negative is clearance.

    ``points`` (n, 2) are their centres (m) in the frame of the groove in whose sector of half angle pi / m they are.
    Eqs. 20 to 23 search a band of width r_C along each arc; here the depth is ``r_C - s`` with the signed distance
    ``s`` to the profile, positive in the open groove. The ten arcs with their mirror images about the tooth lines are a
    closed curve with a continuous tangent: the closest point, at ``| |e| - r_j |`` on arcs whose sector holds the
    centre, is exact, and its side is the sign.
    """
    e = np.asarray(points, dtype=float)[:, None, :] - groove.centre
    d = np.hypot(e[..., 0], e[..., 1])
    along = (e * groove.direction).sum(axis=-1)
    within = along >= (np.cos(groove.half_angle) - 1e-9) * d
    outside = np.where(groove.convex, d - groove.radius, groove.radius - d)
    nearest = np.where(within, np.abs(outside), np.inf).argmin(axis=1)
    return arc_radius - np.take_along_axis(outside, nearest[:, None], axis=1)[:, 0]


def depths_on_sprocket(groove: Groove, arc_radius: float, centres: np.ndarray, angle: float) -> np.ndarray:
    """Return `true_depth` of arcs at ``centres`` (n, 2) of a sprocket turned by ``angle`` (rad); -inf out of reach."""
    distance, pitch = np.hypot(*centres.T), 2 * pi / groove.teeth
    # Eq. 12: groove 1 has its middle half a pitch from x_S; angles from that of the arc's own groove
    polar = np.arctan2(centres[:, 1], centres[:, 0]) - angle
    from_middle = (polar % pitch) - pitch / 2
    local = np.column_stack([-distance * np.sin(from_middle), distance * np.cos(from_middle)])
    return np.where(distance <= groove.addendum + arc_radius, true_depth(groove, arc_radius, local), -np.inf)


def _sector(first: np.ndarray, last: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the direction to the middle of the sector between two directions, and its half angle."""
    middle = first / hypot(*first) + last / hypot(*last)
    middle /= hypot(*middle)
    return middle, acos(min(1.0, float(first @ middle) / hypot(*first)))


def _nearest_crossing(centre: np.ndarray, radius: float, about_origin: float, target: np.ndarray) -> np.ndarray:
    """Return the intersection of two circles, one about the origin, nearer to ``target``, m; `InputError` if none."""
    distance = hypot(*centre)
    cosine = (distance**2 + about_origin**2 - radius**2) / (2 * distance * about_origin)
    if radius <= 0 or abs(cosine) > 1:
        reason = "an arc of chain.connector_radius touches no flank and seat at once"
        raise InputError(f"three surfaces: {reason}; use ten_arcs, or a smaller connector_radius")
    angles = atan2(centre[1], centre[0]) + acos(cosine) * np.array([1.0, -1.0])
    points = about_origin * np.column_stack([np.cos(angles), np.sin(angles)])
    return min(points, key=lambda point: hypot(*(point - target)))


def equal_pitch_radii(teeth: float, link_length: float, connector_length: float, thickness: float) -> dict[str, float]:
    """Return the ring radius (m) at which ``teeth`` pitches fill a sprocket turn, by four definitions; lengths in m.

    All pins lie on one circle in ``polygon`` and ``pins``, links and connectors are its chords: those of a pitch span
    ``c = 2 rp sin(pi / teeth)``, ``c^2 = a^2 + b^2 + 2 a b cos(pi / teeth)``, the inverse of `connector_length`.

    - ``polygon``: links touch the ring in their middle; the definition of ``sprocket.equal_pitch_radius``
    - ``arc``: the middle line of the chain bent to a circle, ``teeth (a + b) = 2 pi (r + D/2)``
    - ``pins``: half the thickness of a link below the circle of the pins, ``rp = r + D/2``
    - ``chord``: the same below the pitch circle of one chord a pitch, ``a + b = 2 (r + D/2) sin(pi / teeth)``
    """
    a, b, half = link_length, connector_length, pi / teeth
    pin_circle = sqrt(a**2 + b**2 + 2 * a * b * cos(half)) / (2 * sin(half))
    middle = {
        "polygon": sqrt(pin_circle**2 - a**2 / 4), "arc": (a + b) / (2 * half),
        "pins": pin_circle, "chord": (a + b) / (2 * sin(half)),
    }  # fmt: skip
    return {reading: radius - thickness / 2 for reading, radius in middle.items()}


# Tooth profiles by name, from coarse to fine: the groove that a rig (`rig.rig.Rig`) has with each.
PROFILES = {
    "three_surfaces": lambda rig: coarse_groove(rig.groove_profile, rig.chain.connector_radius),
    "ten_arcs": lambda rig: rig.groove_profile,
}

"""Tooth grooves from any list of tangent arcs, and from a measured outline that such arcs are fitted to.

Arcs are those of the left flank from the tip to the bottom, in the groove frame (`rig.groove`); the right flank
mirrors them. A sign is +1 for a convex arc and -1 for a concave one.
"""

from decimal import Decimal
from functools import lru_cache
from itertools import product
from math import cos, pi, sin, sqrt, tan
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import scipy  # loads its parts when they are used

from trackdyn.errors import InputError
from trackdyn.files import read_text
from trackdyn.rig.groove import Groove, flank_arcs, groove_of_flank, true_depth
from trackdyn.rig.quantities import Quantity, Table
from trackdyn.rig.validation import Section

TANGENT = 1e-6  # m by which neighbouring arcs may miss each other: less than machining and more than rounding of a file
COARSEST = 1e-4  # m, the last decimal of arcs that print has rounded
LONGEST_OUTLINE = 20_000  # points
TIP = 0.1  # radius of a tip over that of its hollow, beyond half the land between two hollows
# patterns that are tried on an outline without one: all signs, the tip convex; one more arc must gain a tenth
PATTERNS = tuple("+" + "".join(signs) for more in (1, 2, 3, 4) for signs in product("+-", repeat=more))
MORE_ARCS = 1.1
FOLLOWED = 1e-5  # m, RMS of an outline that needs no other pattern: a good measuring machine
LEAST_ARC = 1e-3  # m, a radius that a fit does not go below
MOST_ARCS = 15  # on a flank: the areas of a groove are stored as bits


class ToothProfile(Section):
    """A groove that is not the design of `groove`: a list of arcs, or a measured outline."""

    # rows ``centre x, centre y, radius`` (m) and sign of the left flank's arcs, tip first; rounded ones are joined
    arcs: Annotated[Table | None, Quantity("m, m, m, 1")] = None
    # measured points ``x, y`` (m) of the groove frame, of the left flank or of both
    outline: Annotated[Table | None, Quantity("m, m")] = None
    # signs of the arcs that the outline is fitted with, tip first: ``+`` convex, ``-`` concave; by default the best
    pattern: Annotated[str | None, Quantity("name")] = None

    def model_post_init(self, context: Any) -> None:
        """Refuse (`InputError`) values that do not fit each other."""
        if (self.arcs is None) == (self.outline is None):
            raise InputError("profile needs arcs or outline, and one of them only")
        if self.pattern is not None and (not 2 <= len(self.pattern) <= MOST_ARCS or set(self.pattern) - set("+-")):
            raise InputError(f"profile.pattern = {self.pattern!r}: must be 2 to {MOST_ARCS} signs, such as +--+-")
        if self.arcs is not None and len(self.arcs) > MOST_ARCS:
            raise InputError(f"profile.arcs has {len(self.arcs)} rows; it must have 1 to {MOST_ARCS}")

    @property
    def size(self) -> float:
        """Distance from the sprocket's centre: of the bottom of the arcs, or the median of the outline's points; m."""
        if self.outline is not None:
            return float(np.median(np.hypot(*np.array(self.outline).T)))
        assert self.arcs is not None, "a profile has arcs or an outline"
        _, y, radius, sign = self.arcs[-1]
        return abs(y + sign * radius)

    def groove(self, teeth: int, arc_radius: float = 0.0) -> Groove:
        """The groove of the arcs, or of those fitted to the outline, for connectors with arcs of ``arc_radius`` (m).

        Raises `InputError`: the arcs make no groove, or one that these connectors do not fit into.
        """
        if self.arcs is not None:
            return _wide(groove_of_arcs(joined(tipped(np.array(self.arcs), teeth), teeth), teeth), arc_radius)
        assert self.outline is not None, "a profile has arcs or an outline"
        return _fitted(self.outline, self.pattern, teeth, arc_radius)


def _wide(groove: Groove, arc_radius: float) -> Groove:
    """The groove, unless (`InputError`) a concave area is narrower than a connector's arc (m)."""
    narrow = groove.radius[~groove.convex].min(initial=np.inf)
    if narrow <= arc_radius:
        raise InputError(
            f"profile gives a concave area of radius {narrow:.6g} m; it must be wider than chain.connector_radius = "
            f"{arc_radius:g} m"
        )
    return groove


@lru_cache(maxsize=8)  # a sweep makes many rigs with one tooth
def _fitted(outline: Table, pattern: str | None, teeth: int, arc_radius: float) -> Groove:
    """Arcs of a pattern fitted to an outline, or of the pattern that follows it best and lets the connectors in."""
    points = np.array(outline)
    if pattern is not None:
        return _wide(fit_outline(points, pattern, teeth), arc_radius)
    fits: list[tuple[float, Groove]] = []
    for signs in PATTERNS:
        try:
            groove = _wide(fit_outline(points, signs, teeth), arc_radius)
        except InputError as error:
            refusal = error
            continue
        rms = float(np.sqrt((distance_to(groove, points) ** 2).mean()))
        fits.append((rms * MORE_ARCS ** len(signs), groove))
        if rms < FOLLOWED:
            break
    if not fits:
        raise refusal
    return min(fits, key=lambda fit: fit[0])[1]


def groove_of_arcs(arcs: np.ndarray, teeth: int) -> Groove:
    """Groove of the left flank's arcs (k, 4): centre x, y, radius, sign; tip first.

    With ``nu(alpha) = (sin alpha, cos alpha)`` a surface point is ``O + s r nu``; neighbours share point and slope, so
    ``O_j - O_i = (s_i r_i - s_j r_j) nu(alpha)`` gives the slope of their joint. The first arc ends on the tooth line
    with its centre on it, the last one in the middle of the groove. Raises `InputError`: neighbours are not tangent,
    arcs run backwards, or an end is not where it must be.
    """
    centre, radius, sign = arcs[:, :2], arcs[:, 2], arcs[:, 3]
    if not (radius > 0).all() or not np.isin(sign, (-1.0, 1.0)).all():
        raise InputError("profile.arcs needs positive radii and signs of 1 or -1")
    half, (between, reach, misses) = pi / teeth, _joints(arcs)
    if (apart := (misses > TANGENT) | (reach == 0)).any():
        k = int(apart.argmax())
        raise InputError(
            f"profile.arcs: arcs {k + 1} and {k + 2} miss each other by {1e3 * misses[k]:.3g} mm; centres "
            f"{abs(reach[k]):.6g} m apart would be tangent"
        )
    ends = np.array([-half, *np.arctan2(*(between / reach[:, None]).T), 0.0])
    for name, miss in (
        ("the first arc is not centred on the tooth line", abs(centre[0, 0] * cos(half) + centre[0, 1] * sin(half))),
        ("the last arc is not centred in the middle of the groove", abs(centre[-1, 0])),
    ):
        if miss > TANGENT:
            raise InputError(
                f"profile.arcs: {name} but {1e3 * miss:.3g} mm off; at most {1e3 * TANGENT:g} mm is allowed"
            )
    # along the flank a convex arc's slope rises from the tip on, a concave one's falls
    rise = sign * np.diff(ends)
    if (rise <= 0).any():
        k, room = int(np.argmax(rise <= 0)), "other radii would leave it room"
        raise InputError(f"profile.arcs: arc {k + 1} runs backwards, by {abs(np.degrees(rise[k])):.3g} deg; {room}")
    return groove_of_flank(teeth, arcs, ends)


def _joints(arcs: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ways (k - 1, 2) between the centres of neighbouring arcs (k, 4), their lengths along the normals if these are
    common, and by how much the arcs miss each other; m.
    """
    between, reach = np.diff(arcs[:, :2], axis=0), -np.diff(arcs[:, 3] * arcs[:, 2])
    return between, reach, np.abs(np.hypot(*between.T) - np.abs(reach))


def rounding(arcs: np.ndarray) -> float:
    """By how much arcs (k, 4) may miss each other because print has rounded centres and radii, m."""

    def half_unit(values: np.ndarray) -> float:  # of the last decimal
        last = min(int(Decimal(repr(value)).as_tuple().exponent) for value in values.ravel().tolist())
        return min(0.5 * 10.0**last, COARSEST / 2)

    return TANGENT + 2 * sqrt(2) * half_unit(arcs[:, :2]) + 2 * half_unit(arcs[:, 2])


def joined(arcs: np.ndarray, teeth: int) -> np.ndarray:
    """Arcs (k, 4) of a flank that miss each other by no more than their last decimal, with common tangents.

    Kept are all radii but the tip's, the directions in which the centres lie from each other, and the height of the
    last one. Arcs that are tangent, and those that miss by more, are returned as they are.
    """
    half, (between, reach, misses) = pi / teeth, _joints(arcs)
    worst = np.abs([*misses, arcs[0, 0] * cos(half) + arcs[0, 1] * sin(half), arcs[-1, 0]]).max()
    if worst <= TANGENT or worst > rounding(arcs) or not reach.all():
        return arcs
    slopes = np.arctan2(*(between / reach[:, None]).T)
    return flank_arcs(arcs[:, 3], arcs[1:, 2], slopes, float(arcs[-1, 1]), teeth)


def tipped(arcs: np.ndarray, teeth: int) -> np.ndarray:
    """Arcs (k, 4) of a flank; one concave arc alone gets a tip that is tangent to it, centred on the tooth line.

    Raises `InputError`: the only arc is not a concave one in the middle of the groove.
    """
    if len(arcs) > 1:
        return arcs
    x, y, radius, sign = arcs[0]
    half = pi / teeth
    to_line, along = x * cos(half) + y * sin(half), y * cos(half) - x * sin(half)
    if sign != -1.0 or not radius > 0.0 or to_line <= 0.0:
        raise InputError("profile.arcs has one row, which must be a concave arc (sign -1) in the middle of the groove")
    tip = max(to_line - radius, 0.0) + TIP * radius
    along -= sqrt((tip + radius) ** 2 - to_line**2)
    return np.vstack([[-along * sin(half), along * cos(half), tip, 1.0], arcs])


def fit_outline(points: np.ndarray, pattern: str, teeth: int) -> Groove:
    """Tangent arcs of least squared distance to measured points (n, 2) of a groove, m.

    The start follows the outline: its slope at as many places as there are joints, equal lengths apart. Raises
    `InputError`: too few points, or none of the starts leads to arcs that are tangent and in order.
    """
    signs = np.array([1.0 if sign == "+" else -1.0 for sign in pattern])
    k = len(signs)
    if len(points) < 3 * k:
        raise InputError(f"profile.outline has {len(points)} points; at least {3 * k} are needed for {k} arcs a flank")
    if (np.abs(points[:, 0]) > points[:, 1] * tan(pi / teeth) + 5e-3).any():
        raise InputError(
            "profile.outline leaves its groove; expected x across and y outward from the sprocket's centre, in m"
        )
    flank = left_flank(points)
    flank = flank[np.argsort(flank[:, 0])]
    size = float(np.ptp(flank[:, 1]) + np.ptp(flank[:, 0]))

    def groove(p):
        # the logarithm of a radius is the unknown, so that the radius stays positive
        arcs = flank_arcs(signs, LEAST_ARC + np.exp(p[: k - 1]), p[k - 1 : 2 * k - 2], p[-1], teeth)
        return groove_of_arcs(arcs, teeth)

    def misses(p):
        try:
            with np.errstate(over="raise"):  # a radius beyond all numbers
                return distance_to(groove(p), flank)
        except (InputError, OverflowError, ZeroDivisionError, FloatingPointError):
            return np.full(len(flank), size)

    sizes = product((0.1, 0.25, 0.5), (0.4, 0.7, 1.0, 1.3))
    starts = [_start(flank, signs, scale * size, rise, pi / teeth) for scale, rise in sizes]
    fits = [
        scipy.optimize.least_squares(misses, start, x_scale="jac", max_nfev=400)
        for start in starts
        if misses(start)[0] != size
    ]
    if not fits:
        raise InputError(f"profile.outline cannot be followed by the arcs {pattern}; try another pattern of signs")
    return groove(min(fits, key=lambda fit: fit.cost).x)


def _start(flank: np.ndarray, signs: np.ndarray, radius: float, rise: float, half: float) -> np.ndarray:
    """First guess: the slope rises by ``rise`` (rad) over every convex arc and falls evenly to 0 over the others."""
    convex, concave = int((signs > 0).sum()), max(int((signs < 0).sum()), 1)
    fall = (convex * rise - half) / concave
    slopes = -half + np.cumsum(np.where(signs > 0, rise, -fall))[:-1]
    radii = radius * (1 + 0.3 * np.arange(len(signs) - 1))  # neighbours of one radius and one sign would be one arc
    return np.concatenate([np.log(radii), slopes, [flank[-1, 1] - signs[-1] * radii[-1]]])


def left_flank(points: np.ndarray) -> np.ndarray:
    """Points (n, 2) of a groove, m, those of the right flank mirrored to the left."""
    return points * np.where(points[:, :1] > 0, [-1.0, 1.0], 1.0)


def distance_to(groove: Groove, points: np.ndarray) -> np.ndarray:
    """Signed distance of points (n, 2) of either flank to the left flank, positive in the open groove, m."""
    return -true_depth(groove, 0.0, left_flank(points))


def read_outline(path: Path) -> list[list[float]]:
    """Points of a CSV file with columns ``x_m`` and ``y_m`` of numbers; else `InputError`."""
    header, _, rows = read_text(path, "CSV file of points", 40 * LONGEST_OUTLINE).partition("\n")
    if header.split(",")[:2] != ["x_m", "y_m"] or not rows.strip():
        raise InputError(f"{path}: does not begin with the columns x_m,y_m; expected that header, then points in m")
    try:
        points = np.loadtxt(rows.splitlines(), delimiter=",", usecols=(0, 1), ndmin=2, quotechar='"')
        if not np.isfinite(points).all():
            raise ValueError("a number is not finite")
    except ValueError as error:
        raise InputError(f"{path}: is no CSV file of points ({error}); expected x_m,y_m, then points in m") from None
    return points.tolist()

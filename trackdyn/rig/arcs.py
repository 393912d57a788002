"""Tooth grooves from any list of tangent arcs.

Arcs are those of the left flank from the tip to the bottom, in the groove frame (`rig.groove`); a sign is +1 for a
convex arc and -1 for a concave one.
"""

from decimal import Decimal
from math import cos, pi, sin, sqrt
from typing import Annotated, Any

import numpy as np

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.quantities import Quantity, Table
from trackdyn.inputs.validation import Section
from trackdyn.rig.groove import Groove, flank_arcs, groove_of_flank

TANGENT = 1e-6  # m by which neighbouring arcs may miss each other: less than machining and more than rounding of a file
COARSEST = 1e-4  # m, the last decimal of arcs that print has rounded
TIP = 0.1  # radius of a tip over that of its hollow, beyond half the land between two hollows
MOST_ARCS = 15  # on a flank: the areas of a groove are stored as bits


class ToothProfile(Section):
    """Tooth profile as a list of arcs, in place of the design of `groove`."""

    # rows ``centre x, centre y, radius`` (m) and sign of the left flank's arcs, tip first; rounded ones are joined
    arcs: Annotated[Table, Quantity("m, m, m, 1")]

    def model_post_init(self, context: Any) -> None:
        """Refuse (`InputError`) values that do not fit each other."""
        if len(self.arcs) > MOST_ARCS:
            raise InputError(f"profile.arcs has {len(self.arcs)} rows; it must have 1 to {MOST_ARCS}")

    @property
    def size(self) -> float:
        """Distance of the lowest point of the arcs from the sprocket's centre, m."""
        _, y, radius, sign = self.arcs[-1]
        return abs(y + sign * radius)

    def groove(self, teeth: int, arc_radius: float = 0.0) -> Groove:
        """Return the groove of the arcs; `InputError` if they make none for connectors of ``arc_radius`` (m)."""
        groove = groove_of_arcs(joined(tipped(np.array(self.arcs), teeth), teeth), teeth)
        narrow = groove.radius[~groove.convex].min(initial=np.inf)
        if narrow <= arc_radius:
            remedy = f"it must be wider than chain.connector_radius = {arc_radius:g} m"
            raise InputError(f"profile gives a concave area of radius {narrow:.6g} m; {remedy}")
        return groove


def groove_of_arcs(arcs: np.ndarray, teeth: int) -> Groove:
    """Return the groove of a left flank's arcs (k, 4): centre x, y, radius, sign; tip first; or `InputError`.

    With ``nu(alpha) = (sin alpha, cos alpha)`` a surface point is ``O + s r nu``; neighbours share point and slope, so
    ``O_j - O_i = (s_i r_i - s_j r_j) nu(alpha)`` gives the slope of their joint. The first arc ends on the tooth line
    with its centre on it, the last one in the middle of the groove.
    """
    centre, radius, sign = arcs[:, :2], arcs[:, 2], arcs[:, 3]
    if not (radius > 0).all() or not np.isin(sign, (-1.0, 1.0)).all():
        raise InputError("profile.arcs needs positive radii and signs of 1 or -1")
    half, (between, reach, misses) = pi / teeth, _joints(arcs)
    if (apart := (misses > TANGENT) | (reach == 0)).any():
        k = int(apart.argmax())
        gap = f"arcs {k + 1} and {k + 2} miss each other by {1e3 * misses[k]:.3g} mm"
        raise InputError(f"profile.arcs: {gap}; centres {abs(reach[k]):.6g} m apart would be tangent")
    ends = np.array([-half, *np.arctan2(*(between / reach[:, None]).T), 0.0])
    for name, miss in (
        ("the first arc is not centred on the tooth line", abs(centre[0, 0] * cos(half) + centre[0, 1] * sin(half))),
        ("the last arc is not centred in the middle of the groove", abs(centre[-1, 0])),
    ):
        if miss > TANGENT:
            allowed = f"at most {1e3 * TANGENT:g} mm is allowed"
            raise InputError(f"profile.arcs: {name} but {1e3 * miss:.3g} mm off; {allowed}")
    # along the flank a convex arc's slope rises from the tip on, a concave one's falls
    rise = sign * np.diff(ends)
    if (rise <= 0).any():
        k, remedy = int(np.argmax(rise <= 0)), "other radii would leave it room"
        raise InputError(f"profile.arcs: arc {k + 1} runs backwards, by {abs(np.degrees(rise[k])):.3g} deg; {remedy}")
    return groove_of_flank(teeth, arcs, ends)


def _joints(arcs: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return vectors (k - 1, 2) between centres of neighbouring arcs (k, 4), lengths of tangent ones, and gaps, m."""
    between, reach = np.diff(arcs[:, :2], axis=0), -np.diff(arcs[:, 3] * arcs[:, 2])
    return between, reach, np.abs(np.hypot(*between.T) - np.abs(reach))


def rounding(arcs: np.ndarray) -> float:
    """Return the largest gap between arcs (k, 4) that rounding of printed centres and radii explains, m."""

    def half_unit(values: np.ndarray) -> float:  # of the last decimal
        last = min(int(Decimal(repr(value)).as_tuple().exponent) for value in values.ravel().tolist())
        return min(0.5 * 10.0**last, COARSEST / 2)

    return TANGENT + 2 * sqrt(2) * half_unit(arcs[:, :2]) + 2 * half_unit(arcs[:, 2])


def joined(arcs: np.ndarray, teeth: int) -> np.ndarray:
    """Return arcs (k, 4) of a flank made tangent by its tip's radius and its centres, if only rounding parts them."""
    half, (between, reach, misses) = pi / teeth, _joints(arcs)
    worst = np.abs([*misses, arcs[0, 0] * cos(half) + arcs[0, 1] * sin(half), arcs[-1, 0]]).max()
    if worst <= TANGENT or worst > rounding(arcs) or not reach.all():
        return arcs
    return flank_arcs(arcs[:, 3], arcs[1:, 2], np.arctan2(*(between / reach[:, None]).T), float(arcs[-1, 1]), teeth)


def tipped(arcs: np.ndarray, teeth: int) -> np.ndarray:
    """Return arcs (k, 4) of a flank, or `InputError`; a single one gets a tangent tip, centred on the tooth line."""
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

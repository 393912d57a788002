"""Contact of the connector's arcs with the ten areas of a groove (Eqs. 12 to 34), in the plane."""

from math import atan2, cos, floor, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from trackdyn.contact.laws import Law
from trackdyn.jit import kernel


class Tooth(NamedTuple):
    """Constants of the contact between connectors and grooves.

    Attributes
    ----------
    present : int
        0: the scene has no teeth.
    centre_x, centre_y, radius : (k,) arrays
        Arcs O_j and r_j in the groove frame (Table 1), m; ten of them, or three of the coarse profile.
    direction_x, direction_y, cos_half_angle : (k,) arrays
        u_j and cos theta_j of Eq. 23.
    convex : (k,) integer array
        1 for areas 1, 4, 7, 10 of the ten.
    groove_cos, groove_sin : (m,) arrays
        Cosine and sine of beta_k (Eq. 12).
    teeth : int
        m.
    addendum : float
        r_a of Eq. 18, m.
    arc_radius : float
        r_C of the connector's arcs, m.
    law : Law
        Steel on steel.
    """

    present: int
    centre_x: np.ndarray
    centre_y: np.ndarray
    radius: np.ndarray
    direction_x: np.ndarray
    direction_y: np.ndarray
    cos_half_angle: np.ndarray
    convex: np.ndarray
    groove_cos: np.ndarray
    groove_sin: np.ndarray
    teeth: int
    addendum: float
    arc_radius: float
    law: Law


def make_tooth(groove, arc_radius: float, law: Law, present: bool = True) -> Tooth:
    """Precompute the constants of the area search from the groove's geometry."""
    beta = [(2 * k - 1) * pi / groove.teeth - pi / 2 for k in range(1, groove.teeth + 1)]  # Eq. 12
    return Tooth(
        int(present),
        *np.ascontiguousarray(groove.centre.T),
        groove.radius.copy(),
        *np.ascontiguousarray(groove.direction.T),
        np.cos(groove.half_angle),
        groove.convex.astype(np.int64),
        np.array([cos(b) for b in beta]),
        np.array([sin(b) for b in beta]),
        groove.teeth,
        groove.addendum,
        arc_radius,
        law,
    )


@kernel
def groove_index(teeth, x, y):
    """Index k (1 to m) of the groove over the point (x, y) of the sprocket frame (Eqs. 16, 17)."""
    gamma = atan2(y, x)
    if gamma < 0.0:
        gamma += 2.0 * pi
    k = int(floor(teeth * gamma / (2.0 * pi))) + 1
    return min(k, teeth)


@kernel
def find_area(tooth: Tooth, x, y):
    """Area (1 to 10, or 0 for none) touched by an arc centred at (x, y) of the groove frame, and its depth.

    Returns
    -------
    area : int
        First annular sector of the search order that holds the point (Eqs. 20 to 23), 0 if none.
    depth : float
        Penetration (Eqs. 29, 33), m.
    normal_x, normal_y : float
        Unit normal of the force on the connector, groove frame.
    radius : float
        R of Eq. 8: ``r_j + r_C`` (convex) or ``r_j - r_C`` (concave), m.
    """
    rc = tooth.arc_radius
    left = x <= 0.0
    areas = tooth.radius.shape[0]
    for step in range((areas + 1) // 2):
        j = step if left else areas - 1 - step
        ex = x - tooth.centre_x[j]
        ey = y - tooth.centre_y[j]
        along = ex * tooth.direction_x[j] + ey * tooth.direction_y[j]
        if along <= 0.0:  # more than 90 degrees off u_j
            continue
        d2 = ex * ex + ey * ey
        r = tooth.radius[j]
        if tooth.convex[j]:
            if d2 < r * r or d2 > (r + rc) * (r + rc):
                continue
        elif d2 < (r - rc) * (r - rc) or d2 > r * r:
            continue
        d = sqrt(d2)
        if along < tooth.cos_half_angle[j] * d:
            continue
        if tooth.convex[j]:
            return j + 1, rc + r - d, ex / d, ey / d, r + rc
        return j + 1, d + rc - r, -ex / d, -ey / d, r - rc
    return 0, 0.0, 0.0, 0.0, 0.0

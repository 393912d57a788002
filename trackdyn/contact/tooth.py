"""Contact of the connector's arcs with the ten areas of a groove (Eqs. 12 to 34), in the plane."""

from math import atan2, floor, pi, sqrt

from trackdyn.jit import kernel
from trackdyn.model.constants import Tooth


@kernel
def groove_index(teeth, x, y):
    """Index k (1 to m) of the groove over the point (x, y) of the sprocket frame (Eqs. 16, 17)."""
    gamma = atan2(y, x)
    if gamma < 0.0:
        gamma += 2.0 * pi
    k = int(floor(teeth * gamma / (2.0 * pi))) + 1
    return min(k, teeth)


@kernel
def in_groove(tooth: Tooth, k, cos, sin, x, y):
    """Direction of groove k of a sprocket turned by ``cos, sin``, and a point in its frame; groove 0 holds none."""
    if k == 0:
        return 1.0, 0.0, 1.0, 0.0
    ck = cos * tooth.groove_cos[k - 1] - sin * tooth.groove_sin[k - 1]
    sk = sin * tooth.groove_cos[k - 1] + cos * tooth.groove_sin[k - 1]
    return ck, sk, ck * x + sk * y, -sk * x + ck * y


@kernel
def find_area(tooth: Tooth, x, y):
    """Area touched by an arc centred at (x, y) of the groove frame, depth (m), normal and radius R (m).

    The area, 1 to 10, is the first annular sector of the search order that holds the point (Eqs. 20 to 23), 0 if none;
    the depth is that of Eqs. 29 and 33, the unit normal that of the force on the connector in the groove frame, and R
    of Eq. 8 is ``r_j + r_C`` (convex) or ``r_j - r_C`` (concave).
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

"""Figures 9 to 12: the contact search of an area and of a link, depths exaggerated, and its flow chart."""

from math import atan2
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch, Polygon

from trackdyn.contact.laws import closest_point, find_area
from trackdyn.plots import drawing
from trackdyn.plots.style import BLACK, PURPLE, SMALL, new_figure, styled
from trackdyn.rig.rig import Rig
from trackdyn.scene.build import make_tooth
from trackdyn_replication.report import marks
from trackdyn_replication.report.figures.groove import draw_groove

SHOWN_DEPTH = 0.25  # drawn depth of a connector's arc, in parts of its radius
SHOWN_LINK_DEPTH = 0.5  # drawn depth of a link, in parts of half its thickness
# position of the perpendicular on AB (0 at A, 1 at B) in each case
LINK_CASES = {"left end contact": -0.7, "vertical contact": 0.4, "right end contact": 1.7}
ACTION = "#dcebf5"
MIDDLE = 5  # where the boxes of the main way stand


@styled
def arc_figure(rig: Rig, area: int) -> Figure:
    """Draw the contact of the left arc with an area: Figure 9, a convex one; Figure 10, a concave one."""
    groove, rc = rig.groove_profile, rig.chain.connector_radius
    convex, centre, r = bool(groove.convex[area - 1]), groove.centre[area - 1], groove.radius[area - 1]
    # the arc is a little off the middle of the sector
    bearing = np.arctan2(*groove.direction[area - 1][::-1]) + 0.3 * groove.half_angle[area - 1]
    point = centre + (r + (1 - SHOWN_DEPTH) * rc * (1.0 if convex else -1.0)) * marks.polar(bearing)
    touched, depth, nx, ny, effective = find_area(make_tooth(groove, rc, 0), float(point[0]), float(point[1]))
    n, tau = np.array([nx, ny]), np.array([-ny, nx])
    deepest = point - rc * n
    surface = deepest + depth * n

    figure = new_figure(3.8)
    figure.set_layout_engine("compressed")  # which knows of axes of equal scales
    ax, words = figure.subplots(1, 2, width_ratios=(1.0, 0.56))
    draw_groove(ax, rig, 0.03, emphasized=(touched,))
    face = {"facecolor": drawing.CONNECTOR, "alpha": 0.65, "edgecolor": "none", "zorder": drawing.Z_SPROCKET + 0.2}
    ax.add_patch(Circle(point, rc, **face))
    ax.add_patch(Circle(point, rc, fill=False, edgecolor=BLACK, linewidth=1.3, zorder=drawing.Z_CONNECTOR + 0.1))
    dashed = {"edgecolor": "0.35", "linestyle": (0, (5, 2)), "linewidth": 0.8}
    ax.add_patch(Circle(centre, r, fill=False, **dashed, zorder=drawing.Z_CONNECTOR + 0.2))
    aside = 0.16 * rc * marks.directions(centre, point)[1]  # e and the radii are on one line: these are drawn off it
    far = aside * (-2 if convex else -3.6)  # beyond the tangent
    marks.vector(ax, centre, point, f"$e_{area}$", 0.75 if convex else 0.5, side=-1, linewidth=1.2)
    marks.radius(ax, point + aside, deepest + aside, "$r_C$", 0.4 if convex else 0.5)
    marks.radius(ax, centre + far, surface + far, f"$r_{area}$", 0.5, side=-1)
    for end, away in ((point, aside), (deepest, aside), (centre, far), (surface, far)):
        marks.line(ax, end, end + 1.15 * away, color="0.45", linewidth=0.6)
    ends, offset = ((deepest, surface), 0.55) if convex else ((surface, deepest), 0.75)
    marks.dimension(ax, *ends, r"$\delta$", offset=offset * rc, turned=False, fontsize=9)
    for direction, name, side in ((n, "$n$", 1), (tau, r"$\tau$", -1)):
        end = surface + 0.45 * rc * direction
        marks.arrow(ax, surface, end, color=PURPLE, linewidth=2.2)
        marks.text_beside(ax, surface, end, name, 0.8, side, color=PURPLE, fontsize=10)
    marks.point(ax, point, "$C$", "right" if convex else "left", gap=5)
    marks.point(ax, centre, f"$O_{area}$", "right below" if convex else "right", gap=4)
    points = np.array([point + rc, point - rc, centre + far, deepest - 0.4 * rc])
    low, high = points.min(axis=0) - 0.1 * rc, points.max(axis=0) + 0.1 * rc
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    marks.frame_axes(ax)
    ax.set_title(f"the left arc in area {touched}")
    # result of the search for the drawn state, with the equations
    length, rj = f"|e_{area}|", f"r_{area}"
    law, normal, radius = rf"r_C + {rj} - {length}$   (Eq. 29)", "n = e", f"r_C + {rj}"
    if not convex:
        law, normal, radius = rf"{length} + r_C - {rj}$   (Eq. 33)", "n = -e", f"{rj} - r_C"
    components = f"({n[0]:.3f}, {n[1]:.3f})".replace("-", "\N{MINUS SIGN}")
    rows = [
        f"${length}$ = {marks.millimetres(np.hypot(*(point - centre)))}",
        rf"$\delta = {law}" + f"\n   = {marks.millimetres(depth)}, enlarged",
        f"${normal}_{area} / {length}$\n   = {components}",
        f"$R = {radius}$\n   = {marks.millimetres(effective)}",
        r"$\tau = \hat{z} \times n$",
    ]
    words.text(0.0, 0.5, "\n\n".join(rows), transform=words.transAxes, va="center", linespacing=1.5)
    words.set_axis_off()
    return figure


@styled
def link_figure(rig: Rig) -> Figure:
    """Draw Figure 12: a link on the ring, touching it between its ends or with one of them."""
    figure = new_figure(4.2)
    *axes, words = figure.subplots(2, 2).ravel()
    for ax, letter, (case, fraction) in zip(axes, "abc", LINK_CASES.items(), strict=True):
        s = _draw_link_case(ax, rig, fraction)
        ax.set_title(f"({letter}) {case}, $s$ = {s:.2f}".replace("-", "\N{MINUS SIGN}"))
    text = (
        "$s$: where the perpendicular\nfrom $O_S$ meets the line $AB$,\nin lengths of $AB$ from $A$\n\n"
        "$s$ below 0: $Q$ is $A$\n$s$ from 0 to 1: $Q$ is its foot\n$s$ above 1: $Q$ is $B$"
    )
    words.text(0.05, 0.5, text, transform=words.transAxes, va="center", linespacing=1.5)
    words.set_axis_off()
    return figure


def _draw_link_case(ax: Axes, rig: Rig, fraction: float) -> float:
    """Draw a link in the ring, centred at the origin, the perpendicular at ``fraction`` of AB; return the kernel's."""
    ring, half, length = rig.sprocket.ring_radius, rig.chain.link_thickness / 2, rig.chain.link_length
    height, end_share = ring + (1 - SHOWN_LINK_DEPTH) * half, min(max(fraction, 0.0), 1.0)
    # beyond an end the link leans, so that the perpendicular meets its line outside of it
    lean = marks.polar(-np.arcsin((fraction - end_share) * length / height))
    start = np.array([0.0, height]) - end_share * length * lean
    end = start + length * lean
    s, qx, qy, distance = closest_point(*map(float, (*start, *end, 0.0, 0.0)))
    q = np.array([qx, qy])
    p = ring * q / distance
    along, up = marks.directions(start, end)
    rubber = {"facecolor": "0.8", "edgecolor": drawing.RUBBER, "linewidth": 1.6, "zorder": drawing.Z_RING}
    ax.add_patch(Circle((0, 0), ring, **rubber))
    # body of the link in the law of contact: the points within half the thickness of the line AB
    outlines = drawing.link_outline(rig), drawing.stadium(length, half, 30)
    link, outline = (drawing.placed(points, start, atan2(along[1], along[0])) for points in outlines)
    ax.add_patch(Polygon(link, facecolor=drawing.LINK, alpha=0.75, edgecolor="none", zorder=drawing.Z_LINK))
    ax.add_patch(Polygon(outline, fill=False, edgecolor=BLACK, linewidth=1.0, zorder=drawing.Z_LINK + 0.1))
    marks.line(ax, start, end, linestyle=(0, (8, 2, 1, 2)), linewidth=0.8)
    if not 0 <= s <= 1:  # the perpendicular, outside of the link
        on_line = start + s * length * along
        for ends in ((q, on_line), (on_line, 0.87 * on_line)):
            marks.line(ax, *ends, linestyle=(0, (1, 1)), linewidth=0.9)
    low = ring - 2.6 * half
    marks.line(ax, q * low / q[1], q, linewidth=0.9)
    marks.arrow(ax, q * (low + 0.012) / q[1], q * low / q[1], linewidth=0.9)
    marks.write_mark(ax, q * (low + 0.006) / q[1] + [0.004, 0.0], "to $O_S$", ha="left")
    for point, name in ((start, "$A$"), (end, "$B$")):
        if 0 < s < 1 or not np.allclose(point, q):
            marks.point(ax, point, name, "above", gap=4)
    marks.point(ax, q, "$Q$" if 0 < s < 1 else ("$Q = A$" if s <= 0 else "$Q = B$"), "above", gap=4)
    marks.point(ax, p, "$P$", "left below", gap=4)
    near = q - half * q / distance
    sign = 1 if s < 0.5 else -1  # towards the other end of the link
    marks.dimension(ax, near, p, r"$\delta_r$", offset=-0.9 * sign * half, side=-sign, turned=False, fontsize=9)
    far, middle = (end if s < 0.5 else start), 0.5 * (start + end)
    inside = far + 0.5 * (middle - far)
    marks.dimension(ax, inside, inside + half * up, "$D/2$", side=sign, turned=False, fontsize=9)
    span = 0.085
    ax.set(xlim=(middle[0] - span, middle[0] + span), ylim=(low - 0.004, low + 1.6 * span))
    marks.bare(ax)
    return s


def search_order(rig: Rig, left: bool) -> list[int]:
    """Return areas in the order of the contact search, which finds each in turn at a point that every sector holds."""
    groove = rig.groove_profile
    tooth = make_tooth(groove, rig.chain.connector_radius, 0)
    x, y = -1e-3 if left else 1e-3, float(groove.addendum)
    width = 0.5 * tooth.arc_radius
    tooth = tooth._replace(
        # the point lies straight above every centre, in the middle between inner and outer radius
        centre_x=np.full(10, x),
        centre_y=y - groove.radius - np.where(groove.convex, width, -width),
        direction_x=np.zeros(10),
        direction_y=np.ones(10),
    )
    order = []
    while area := find_area(tooth, x, y)[0]:
        order.append(area)
        tooth.cos_half_angle[area - 1] = 2.0  # no angle has this cosine
    return order


class Step(NamedTuple):
    """Box of the flow chart."""

    text: str  # action or question
    x: float
    y: float
    function: str  # that does it
    question: bool = False  # drawn as a decision

    @property
    def half(self) -> np.ndarray:
        """Half width and half height."""
        return np.array([2.5, 0.62] if self.question else [2.3 if self.x == MIDDLE else 1.72, 0.36])


def contact_steps(rig: Rig) -> dict[str, Step]:
    """Return boxes of Figure 11 in the order of the program, with functions of ``trackdyn.contact`` and equations."""
    left, right = (", ".join(map(str, search_order(rig, side))) for side in (True, False))
    return {
        "start": Step("next arc of a connector: left, right", 5, 13.0, "tooth_loads"),
        "reach": Step(r"$|l_{S,O_S C}| \leq r_a + r_C$ ?", 5, 11.8, "tooth_loads  (15, 18)", True),
        "groove": Step("groove $k$ under the arc's centre $C$", 5, 10.5, "groove_index  (16, 17)"),
        "frame": Step("$C$ in the frame of groove $k$", 5, 9.4, "tooth_loads  (13, 14, 20)"),
        "side": Step(r"$l^{\,x}_{k,O_S C} \leq 0$ ?", 5, 8.2, "find_area  (20)", True),
        "left": Step(f"areas {left}", 2.1, 7.4, "find_area"),
        "right": Step(f"areas {right}", 7.9, 7.4, "find_area"),
        "sector": Step("$C$ in annular sector $j$ ?", 5, 5.9, "find_area  (21, 23)", True),
        "kind": Step("area $j$ convex ?", 5, 4.4, "find_area", True),
        "convex": Step(r"$\delta = r_C + r_j - |e_j|$", 2.1, 3.5, "find_area  (29)"),
        "concave": Step(r"$\delta = |e_j| + r_C - r_j$", 7.9, 3.5, "find_area  (33)"),
        "rate": Step(r"penetration velocity $\dot{\delta}$", 5, 2.6, "tooth_loads  (27, 30, 34)"),
        "impact": Step(r"$\dot{\delta}^{(-)}$, kept from first touch", 5, 1.5, "stored_impact_speed"),
        "normal": Step("normal force $f_n$", 5, 0.4, "force_and_slopes  (8)"),
        "friction": Step(r"friction $f_\tau$", 5, -0.7, "friction_coefficient  (10)"),
        "none": Step(r"no force, $\dot{\delta}^{(-)}$ cleared", 10.4, 5.9, "tooth_loads"),
        "end": Step("loads of connector and sprocket", 5, -1.8, "contact_loads"),
    }


# from box to box, label, corners of the line
WAYS = (
    ("start", "reach", ""), ("reach", "groove", "yes"), ("reach", "none", "no", (10.4, 11.8)),
    ("groove", "frame", ""), ("frame", "side", ""),
    ("side", "left", "yes", (2.1, 8.2)), ("left", "sector", "", (2.1, 6.75), (5, 6.75)),
    ("side", "right", "no", (7.9, 8.2)), ("right", "sector", "", (7.9, 6.75), (5, 6.75)),
    ("sector", "kind", "in the first that holds it"), ("sector", "none", "in none"),
    ("kind", "convex", "yes", (2.1, 4.4)), ("convex", "rate", "", (2.1, 2.6)),
    ("kind", "concave", "no", (7.9, 4.4)), ("concave", "rate", "", (7.9, 2.6)),
    ("rate", "impact", ""), ("impact", "normal", ""), ("normal", "friction", ""), ("friction", "end", ""),
    ("none", "end", "", (10.4, -1.8)),
)  # fmt: skip


@styled
def flow_figure(rig: Rig) -> Figure:
    """Draw Figure 11: from the pins of a connector to its loads; every box names its function."""
    figure = new_figure(8.4)
    ax = figure.subplots()
    steps = contact_steps(rig)
    text_look = {"ha": "center", "va": "center", "zorder": drawing.Z_MARK + 1, "fontsize": SMALL}
    for name, step in steps.items():
        centre, look = np.array([step.x, step.y]), {"edgecolor": BLACK, "linewidth": 0.9, "zorder": drawing.Z_MARK}
        if step.question:
            corners = centre + step.half * np.array([[-1, 0], [0, 1], [1, 0], [0, -1]])
            ax.add_patch(Polygon(corners, facecolor=drawing.CONNECTOR, **look))
        else:
            box = "round,pad=0,rounding_size=0.3" if name in ("start", "end") else "square,pad=0"
            look |= {"boxstyle": box, "facecolor": ACTION}
            ax.add_patch(FancyBboxPatch(centre - step.half, *(2 * step.half), **look))
        ax.text(*(centre + [0, 0.13]), step.text, **text_look)
        ax.text(*(centre - [0, 0.19]), step.function, family="DejaVu Sans Mono", **text_look)
    for start, end, text, *corners in WAYS:
        _draw_way(ax, steps[start], steps[end], text, corners)
    ax.set(xlim=(0.0, 12.3), ylim=(-2.4, 13.6))
    ax.set_axis_off()
    ax.set_title("Contact of both arcs of every connector with the sprocket's grooves")
    return figure


def _draw_way(ax: Axes, start: Step, end: Step, text: str, corners) -> None:
    points = np.array([(start.x, start.y), *corners, (end.x, end.y)], dtype=float)
    for at, neighbour, step in ((0, 1, start), (-1, -2, end)):
        points[at] += np.sign(points[neighbour] - points[at]) * step.half
    ax.plot(*points[:-1].T, "-", color=BLACK, linewidth=0.9, zorder=drawing.Z_MARK - 1)
    marks.arrow(ax, points[-2], points[-1], linewidth=0.9)
    if text:
        step = np.sign(points[1] - points[0])
        position = points[0] + step * 0.16 + (np.array([0.0, 0.16]) if step[0] else np.array([0.1, -0.04]))
        look = {"ha": "right" if step[0] < 0 else "left", "va": "center", "zorder": drawing.Z_MARK + 1}
        ax.text(*position, text, fontsize=SMALL, **look)

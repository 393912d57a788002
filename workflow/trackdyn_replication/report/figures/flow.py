"""Figure 11: flow chart of the contact search.

The order of the areas comes from the search itself; the functions that the chart names are
those that do the steps.
"""

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, Polygon

from trackdyn.contact.laws import find_area
from trackdyn.plots.drawing import CONNECTOR, Z_MARK
from trackdyn.plots.style import BLACK, SMALL, new_figure, styled
from trackdyn.rig.rig import Rig
from trackdyn.scene.build import make_tooth
from trackdyn_replication.report import marks

ACTION = "#dcebf5"
MIDDLE = 5  # where the boxes of the main way stand


def search_order(rig: Rig, left: bool) -> list[int]:
    """Return areas in the order in which the contact search visits them, measured on it.

    Every sector is made to hold the same point, so that the search returns the first area it
    visits; with that sector emptied it returns the second one, and so on.
    """
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
    for name, step in steps.items():
        _draw_step(ax, step, "round,pad=0,rounding_size=0.3" if name in ("start", "end") else "square,pad=0")
    for start, end, text, *corners in WAYS:
        _draw_way(ax, steps[start], steps[end], text, corners)
    ax.set(xlim=(0.0, 12.3), ylim=(-2.4, 13.6))
    ax.set_axis_off()
    ax.set_title("Contact of both arcs of every connector with the sprocket's grooves")
    return figure


def _draw_step(ax: Axes, step: Step, box: str) -> None:
    centre = np.array([step.x, step.y])
    look = {"edgecolor": BLACK, "linewidth": 0.9, "zorder": Z_MARK}
    if step.question:
        corners = centre + step.half * np.array([[-1, 0], [0, 1], [1, 0], [0, -1]])
        ax.add_patch(Polygon(corners, facecolor=CONNECTOR, **look))
    else:
        ax.add_patch(FancyBboxPatch(centre - step.half, *(2 * step.half), boxstyle=box, facecolor=ACTION, **look))
    look = {"ha": "center", "va": "center", "zorder": Z_MARK + 1, "fontsize": SMALL}
    ax.text(*(centre + [0, 0.13]), step.text, **look)
    ax.text(*(centre - [0, 0.19]), step.function, family="DejaVu Sans Mono", **look)


def _draw_way(ax: Axes, start: Step, end: Step, text: str, corners) -> None:
    points = np.array([(start.x, start.y), *corners, (end.x, end.y)], dtype=float)
    for at, neighbour, step in ((0, 1, start), (-1, -2, end)):
        points[at] += np.sign(points[neighbour] - points[at]) * step.half
    ax.plot(*points[:-1].T, "-", color=BLACK, linewidth=0.9, zorder=Z_MARK - 1)
    marks.arrow(ax, points[-2], points[-1], linewidth=0.9)
    if text:
        step = np.sign(points[1] - points[0])
        position = points[0] + step * 0.16 + (np.array([0.0, 0.16]) if step[0] else np.array([0.1, -0.04]))
        ax.text(*position, text, ha="right" if step[0] < 0 else "left", va="center", fontsize=SMALL, zorder=Z_MARK + 1)

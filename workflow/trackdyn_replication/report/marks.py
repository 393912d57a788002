"""Marks of technical drawings: arrows, dimensions, angles, named points, scales in mm."""

from math import atan2, cos, degrees, pi, radians, sin

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch
from matplotlib.patheffects import withStroke

from trackdyn.plots.drawing import Z_MARK, circle_points
from trackdyn.plots.style import BLACK

HALO = [withStroke(linewidth=2.0, foreground="white")]
STEPS = {"left": (-1, 0), "right": (1, 0), "above": (0, 1), "below": (0, -1)}


def millimetres(length: float) -> str:
    """Format a length in m as text in mm."""
    return f"{1e3 * length:.1f} mm"


def polar(angle: float) -> np.ndarray:
    """Return the unit vector at an angle (rad, counter-clockwise from x)."""
    return np.array([cos(angle), sin(angle)])


def directions(start, end) -> tuple[np.ndarray, np.ndarray]:
    """Return unit vectors from one point to another, and to the left of that."""
    along = (np.asarray(end, float) - start) / np.hypot(*(np.asarray(end, float) - start))
    return along, np.array([-along[1], along[0]])


def frame_axes(ax: Axes) -> None:
    """Set equal scales, numbered in mm, of the frame of groove k; no grid."""
    ax.set_aspect("equal")
    ax.grid(False)
    for axis, letter in ((ax.xaxis, "x"), (ax.yaxis, "y")):
        axis.set_major_formatter(lambda value, _: f"{1e3 * value:g}".replace("-", "\N{MINUS SIGN}"))
        axis.set_label_text(f"${letter}_{{k}}$ (mm)")


def bare(ax: Axes) -> None:
    """Set equal scales and no axes: a drawing with dimensions."""
    ax.set_aspect("equal")
    ax.set_axis_off()


def write_mark(ax: Axes, position, text: str, **look) -> None:
    """Write text with a white rim, centred at a point."""
    look = {"ha": "center", "va": "center", "fontsize": 8, "zorder": Z_MARK + 3, "clip_on": True} | look
    ax.text(*position, text, path_effects=HALO, **look)


def handle(label: str, **look) -> Line2D:
    """Return an entry of a legend: a line or a mark."""
    return Line2D([], [], **look, label=label)


def line(ax: Axes, *points, **look) -> None:
    """Draw a solid line through some points."""
    ax.plot(*np.transpose(points), **{"color": BLACK, "linestyle": "-", "zorder": Z_MARK} | look)


def arrow(ax: Axes, start, end, style: str = "-|>", **look) -> None:
    """Draw an arrow from ``start`` to ``end``, right up to both."""
    look = {"color": BLACK, "linewidth": 1.0, "mutation_scale": 9, "zorder": Z_MARK} | look
    ax.add_patch(FancyArrowPatch(tuple(start), tuple(end), arrowstyle=style, shrinkA=0, shrinkB=0, **look))


def point(ax: Axes, position, name: str = "", side: str = "right", gap: float = 5.0) -> None:
    """Draw a dot and its name, ``gap`` points away (left, right, above, below, or two of them)."""
    ax.plot(*position, linestyle="none", marker="o", markersize=3.5, color=BLACK, zorder=Z_MARK + 2)
    dx, dy = np.sum([STEPS[direction] for direction in side.split()], axis=0)
    look = {"ha": ("right", "center", "left")[dx + 1], "va": ("top", "center", "bottom")[dy + 1], "fontsize": 8.5}
    look |= {"color": BLACK, "zorder": Z_MARK + 3, "annotation_clip": True, "path_effects": HALO}
    ax.annotate(name, tuple(position), (gap * dx, gap * dy), textcoords="offset points", **look)


def leader(ax: Axes, position, text: str, label_at, **look) -> None:
    """Write text at ``label_at`` with a thin line to a point."""
    look = {"ha": "center", "va": "center", "fontsize": 8, "path_effects": HALO, "zorder": Z_MARK + 3} | look
    line = {"arrowstyle": "-", "linewidth": 0.6, "color": BLACK, "shrinkA": 1, "shrinkB": 0}
    ax.annotate(text, tuple(position), tuple(label_at), arrowprops=line, **look)


def text_beside(ax: Axes, start, end, text: str, at: float = 0.5, side: int = 1, turned: bool = False, **look) -> None:
    """Write text next to a line or along it, ``turned``; ``side`` 1 is left of its direction or above it, -1 right."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    along, left = directions(start, end)
    look = {"fontsize": 8, "ha": "center", "va": "center", "zorder": Z_MARK + 3, "annotation_clip": True} | look
    if turned:
        angle = (degrees(atan2(along[1], along[0])) + 90.0) % 180.0 - 90.0
        left = polar(radians(angle + 90.0))
        look |= {"rotation": angle}
    gap = 0.95 * side * look["fontsize"] * left
    position = tuple(start + at * (end - start))
    ax.annotate(text, position, tuple(gap), textcoords="offset points", path_effects=HALO, **look)


def vector(ax: Axes, start, end, text: str, at: float = 0.5, side: int = 1, **look) -> None:
    """Draw an arrow with its name next to it."""
    arrow(ax, start, end, **look)
    text_beside(ax, start, end, text, at, side, color=look.get("color", BLACK), fontsize=8.5)


def dimension(ax: Axes, start, end, text: str, offset: float = 0.0, side: int = 1, turned: bool = True, **look) -> None:
    """Draw a dimension line between two points, moved by ``offset`` (m) to the left of their direction."""
    shift = offset * directions(start, end)[1]
    if offset:
        for end_point in (start, end):
            line(ax, end_point, end_point + 1.1 * shift, color="0.45", linewidth=0.6)
    a, b = start + shift, end + shift
    arrow(ax, a, b, "<|-|>", linewidth=0.8, mutation_scale=7)
    text_beside(ax, a, b, text, side=side, turned=turned, **look)


def radius(ax: Axes, centre, end, text: str, at: float = 0.5, side: int = 1, **look) -> None:
    """Draw an arrow from a centre to a point of its circle, the text along it."""
    arrow(ax, centre, end, linewidth=0.9)
    text_beside(ax, centre, end, text, at, side, turned=True, **look)


def angle(ax: Axes, centre, size: float, start: float, end: float, text: str, spread: float = 1.25, **look) -> None:
    """Draw an arc with an arrow head from one direction to another (rad), its name outside the middle."""
    points = circle_points(centre, size, start, end, 30)
    line(ax, *points, linewidth=0.8)
    arrow(ax, points[-2], points[-1], linewidth=0.8, mutation_scale=7)
    write_mark(ax, np.asarray(centre) + spread * size * polar(0.5 * (start + end)), text, **look)


def axes_cross(ax: Axes, origin, size: float, angle: float, names: tuple[str, str], **look) -> None:
    """Draw two arrows of a coordinate frame whose x axis points at an ``angle`` (rad)."""
    for name, direction in zip(names, (angle, angle + pi / 2), strict=True):
        end = np.asarray(origin) + size * polar(direction)
        arrow(ax, origin, end, **look)
        write_mark(ax, np.asarray(origin) + 1.12 * size * polar(direction), name, color=look.get("color", BLACK))

"""Drawings of the rig in its own coordinates (m) for any axes, by the geometry of the simulator."""

from collections.abc import Iterable, Mapping
from math import atan2, cos, pi, sin

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from matplotlib.patheffects import withStroke

from trackdyn.plots.style import BLACK, BLUE, SMALL, VERMILION, new_figure, styled
from trackdyn.rig.layout import assemble, body_lengths, wheel_circles, wheel_names
from trackdyn.rig.rig import Rig
from trackdyn.rig.sections import Arm

STEEL, STEEL_EDGE = "#c9ced6", "#4d5560"
RUBBER = "#5a5a5a"
LINK, CONNECTOR, EDGE = "#9ecae9", "#f4e3b2", "#303030"
# look of a marked body in a picture, and that of a second one that it must not be taken for
MARKED = {"facecolor": "#f2a477", "hatch": "////", "edgecolor": "#9c5226"}
MARKED_TOO = {"facecolor": "#bfe5d2", "hatch": "....", "edgecolor": "#2f7d5b"}
JOINT = {"linestyle": "none", "marker": "o", "markersize": 3.2, "markerfacecolor": "white", "color": BLACK}
FORCE_BAR = 4000.0  # force of the scale bar, N; arrows of forces have one scale in all pictures of a kind
FORCE_MOST = 2.0  # longest arrow, in lengths of the bar
HUB = 0.03  # radius of the hubs, for the eye only, m
POINTS_AN_ARC = 12
# numbers of the areas: so far below the bottom of the groove (m), over this fraction of the pitch
NUMBERS_BELOW, NUMBERS_SPREAD = 0.022, 0.98
# stacking: wheels and ring, sprocket, connectors, links, labels on them
Z_RING, Z_SPROCKET, Z_CONNECTOR, Z_LINK, Z_MARK = 1.0, 2.0, 3.0, 4.0, 6.0


def ring_words(radius: float | None) -> str:
    """Return the label of a ring (radius in m)."""
    return "no ring" if radius is None else f"ring {radius:.3f} m"


def chain_points(rig: Rig, frame) -> tuple[np.ndarray, np.ndarray, float]:
    """Return pins (n + 1, 2), m, angles (n,) of the bodies, and that of the sprocket, rad, of a recorded frame."""
    frame = np.asarray(frame, dtype=float)
    angles = frame[2:-1]
    lengths = body_lengths(rig, "single_pin" if len(angles) == rig.chain.pitches else "double_pin")
    steps = lengths[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    return frame[:2] + np.vstack([np.zeros(2), np.cumsum(steps, axis=0)]), angles, float(frame[-1])


def laid_frame(rig: Rig) -> tuple[np.ndarray, float]:
    """Return the configuration of the loop laid around its wheels, and the layout's shift, m."""
    laid = assemble(rig)
    return np.concatenate([laid.pins[0], laid.angle, [laid.sprocket_angle]]), laid.shift


def sprocket_centre(rig: Rig) -> np.ndarray:
    """Return the (2,) centre of the sprocket, m."""
    return np.array([rig.sprocket.x, rig.sprocket.y])


def turned(rig: Rig, frame, angle: float) -> np.ndarray:
    """Return a configuration rotated about the sprocket's centre by an angle (rad)."""
    frame, centre = np.array(frame, dtype=float), sprocket_centre(rig)
    frame[:2] = placed([frame[:2] - centre], centre, angle)[0]
    frame[2:] += angle
    return frame


def link_outline(rig: Rig) -> np.ndarray:
    """Return the (4, 2) corners of a link in its body frame: pin to pin and its thickness, m."""
    a, half = rig.chain.link_length, rig.chain.link_thickness / 2
    return np.array([[0.0, -half], [a, -half], [a, half], [0.0, half]])


def circle_points(centre, radius: float, start: float, end: float, count: int) -> np.ndarray:
    """Return (count, 2) points of a circle from one direction to another (rad), m."""
    angle = np.linspace(start, end, count)
    return np.asarray(centre) + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def stadium(length: float, radius: float, count: int) -> np.ndarray:
    """Return the outline of a stadium, of a line along x from the origin, m; ``count`` points an end."""
    left = circle_points((0.0, 0.0), radius, pi / 2, 3 * pi / 2, count)
    return np.vstack([left, -left + [length, 0.0]])


def connector_outline(rig: Rig) -> np.ndarray:
    """Return the outline of a connector in its body frame: the arcs around its two pins, joined, m."""
    return stadium(rig.connector_length, rig.chain.connector_radius, 2 * POINTS_AN_ARC)


def connector_patch(rig: Rig, pins, **look) -> Polygon:
    """Return the patch of a connector between two pins."""
    (x, y), (u, v) = pins
    return Polygon(placed(connector_outline(rig), pins[0], atan2(v - y, u - x)), **look)


def placed(outline, origin, angle: float) -> np.ndarray:
    """Transform points (n, 2) of a body frame at ``origin``, rotated by ``angle`` (rad), to the inertial frame; m."""
    c, s = cos(angle), sin(angle)
    return np.asarray(origin) + np.asarray(outline) @ np.array([[c, s], [-s, c]])


def draw_chain(
    ax: Axes, rig: Rig, frame, highlight: Iterable[int] | Mapping[int, dict] = (), opacity: float = 1.0
) -> None:
    """Draw every body of a row of ``Recording.frame``.

    Bodies of ``highlight`` (0-based; even numbers are links) are darker and hatched; a mapping gives each its look,
    ``MARKED`` or ``MARKED_TOO``. An ``opacity`` below 1 lets the grooves shine through in close views.
    """
    pins, angles, _ = chain_points(rig, frame)
    looks = highlight if isinstance(highlight, Mapping) else dict.fromkeys(highlight, MARKED)
    links, connectors = range(0, len(angles), 2), range(1, len(angles), 2)
    link, ends, dot = link_outline(rig), [connector_outline(rig)], 2.0
    if len(angles) == rig.chain.pitches:  # single pins: both arcs that bear on the sprocket next to every pin
        links = connectors = range(len(angles))
        end, dot = (rig.single_pin_pitch - rig.chain.link_length) / 2, 3.0
        link, middles = link + [end, 0.0], (end, end + rig.chain.link_length)
        ends = [circle_points((x, 0.0), rig.chain.connector_radius, 0.0, 2 * pi, 4 * POINTS_AN_ARC) for x in middles]
    for numbers, outlines, face, z in ((links, [link], LINK, Z_LINK), (connectors, ends, CONNECTOR, Z_CONNECTOR)):
        bodies = [placed(outline, pins[i], angles[i]) for i in numbers for outline in outlines]
        plain = to_rgba(face, opacity)
        ax.add_collection(PolyCollection(bodies, facecolor=plain, edgecolor=EDGE, linewidth=0.6, zorder=z))
        for i in sorted(looks):
            if i in numbers:
                body, look = bodies[numbers.index(i)], looks[i]
                look = look | {"facecolor": to_rgba(look["facecolor"], opacity)}
                ax.add_patch(Polygon(body, **look, linewidth=0, zorder=z + 0.1))  # an edge has its hatch's colour
                ax.add_patch(Polygon(body, fill=False, edgecolor=BLACK, linewidth=0.9, zorder=z + 0.1))
    ax.plot(*pins.T, linestyle="none", marker=".", markersize=dot, color=BLACK, zorder=Z_LINK + 0.5)


def groove_points(rig: Rig, sprocket_angle: float, groove: int, points) -> np.ndarray:
    """Transform points of the frame of groove ``groove`` (1 to m; Eq. 12) to the inertial frame, m."""
    beta = (2 * groove - 1) * pi / rig.sprocket.teeth - pi / 2
    return placed(points, sprocket_centre(rig), sprocket_angle + beta)


def draw_sprocket(ax: Axes, rig: Rig, angle: float, ring: float | None, number_areas_of: int | None = None) -> None:
    """Draw the sprocket, turned by an angle (rad), with its grooves, and the rubber ring (radius in m) behind it.

    ``number_areas_of`` is a groove (1 to m) whose ten areas are numbered and parted by dots; for close views.
    """
    centre, profile = sprocket_centre(rig), rig.groove_profile.profile(POINTS_AN_ARC)
    # a groove runs clockwise from tip to tip, so the grooves follow each other in falling order
    outline = np.vstack([groove_points(rig, angle, k, profile) for k in range(rig.sprocket.teeth, 0, -1)])
    if ring is not None:
        _draw_disc(ax, *centre, ring, RUBBER, BLACK)
    # artists, not patches: the limits of the axes are given, and a patch would have them worked out from its outline
    ax.add_artist(Polygon(outline, facecolor=STEEL, edgecolor=STEEL_EDGE, linewidth=0.9, zorder=Z_SPROCKET))
    if ring is not None:  # the stretch of its edge that teeth hide
        look = {"fill": False, "edgecolor": RUBBER, "linestyle": (0, (4, 2)), "linewidth": 0.7}
        ax.add_artist(Circle(centre, ring, **look, zorder=Z_SPROCKET + 0.1))
    _draw_hub(ax, *centre, Z_SPROCKET, rig.groove_profile.addendum)
    axis = placed([[HUB, 0.0], [0.7 * rig.groove_profile.addendum, 0.0]], centre, angle)
    ax.plot(*axis.T, color=STEEL_EDGE, linestyle="-", linewidth=0.6, zorder=Z_SPROCKET + 0.1)
    if number_areas_of is not None:
        _number_areas(ax, rig, angle, number_areas_of)


def _number_areas(ax: Axes, rig: Rig, sprocket_angle: float, groove: int) -> None:
    """Draw the groove's outline on top, its joints, and a row of numbers in the steel below it."""
    shape = rig.groove_profile
    outline = groove_points(rig, sprocket_angle, groove, shape.profile(POINTS_AN_ARC))
    ax.plot(*outline.T, color=STEEL_EDGE, linestyle=(0, (3, 1.5)), linewidth=0.8, zorder=Z_MARK - 0.2)
    below = np.hypot(*shape.profile(POINTS_AN_ARC).T).min() - NUMBERS_BELOW
    spread = NUMBERS_SPREAD * 2 * pi / rig.sprocket.teeth
    halo = [withStroke(linewidth=1.5, foreground="white")]
    for area, angle in zip(range(1, 11), np.linspace(-spread / 2, spread / 2, 10), strict=True):
        # areas run from the tip at negative x of the groove's frame to that at positive x
        point = groove_points(rig, sprocket_angle, groove, [[below * sin(angle), below * cos(angle)]])[0]
        position = groove_points(rig, sprocket_angle, groove, [shape.arc(area, 3)[1]])[0]
        end = position + 0.8 * (point - position)
        ax.plot(*np.transpose([position, end]), color=STEEL_EDGE, linestyle="-", linewidth=0.5, zorder=Z_MARK - 0.1)
        text = ax.text(*point, str(area), ha="center", va="center", fontsize=SMALL, clip_on=True, zorder=Z_MARK)
        text.set_path_effects(halo)
    ax.plot(*groove_points(rig, sprocket_angle, groove, shape.joints()).T, **JOINT, markeredgewidth=0.7, zorder=Z_MARK)


def draw_discs(ax: Axes, circles) -> None:
    """Draw wheels with tyres: centres and radii (w, 3), m."""
    for x, y, radius in circles:
        _draw_disc(ax, x, y, radius, RUBBER, BLACK)
        _draw_disc(ax, x, y, 0.9 * radius, STEEL, STEEL_EDGE)
        _draw_hub(ax, x, y, Z_RING, radius)


def draw_loop(ax: Axes, rig: Rig, frame, shift: float, ring: float | None, **chain) -> None:
    """Draw wheels (the tensioner ``shift`` m along), sprocket and chain (:func:`draw_chain`)."""
    draw_discs(ax, wheel_circles(rig, shift, surface=True)[1:])
    draw_sprocket(ax, rig, frame[-1], ring)
    draw_chain(ax, rig, frame, **chain)


def view(ax: Axes, middle, half) -> None:
    """Set the limits of the axes: ``half`` of a width (m) around a point, or half of a width and of a height."""
    (x, y), (dx, dy) = middle, np.broadcast_to(half, 2)
    ax.set(xlim=(x - dx, x + dx), ylim=(y - dy, y + dy))


def force_arrow(force: float, bar: float) -> float:
    """Return the length of the arrow of a force (N) for a scale bar of length ``bar``, m."""
    return bar * min(force / FORCE_BAR, FORCE_MOST)


def draw_force_bar(ax: Axes, bar: float, begin: float = 0.03) -> None:
    """Draw the scale bar of the forces, ``bar`` (m) long, at the foot of the view from a fraction of its width on."""
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    x, y = left + begin * (right - left), low + 0.03 * (high - low)
    look = {"color": BLACK, "zorder": Z_MARK + 3, "path_effects": [withStroke(linewidth=3, foreground="white")]}
    ax.plot([x, x + bar], [y, y], linestyle="-", marker="|", markersize=6, linewidth=1.4, **look)
    position = {"xytext": (0, 3), "textcoords": "offset points", "ha": "center", "va": "bottom"}
    ax.annotate(f"{FORCE_BAR / 1000:g} kN", (x + 0.5 * bar, y), fontsize=7, **position, **look)


def _draw_hub(ax: Axes, x: float, y: float, zorder: float, radius: float = 1.0) -> None:
    _draw_disc(ax, x, y, min(HUB, 0.2 * radius), "white", STEEL_EDGE, zorder + 0.1)
    ax.plot([x], [y], linestyle="none", marker="+", markersize=5, color=BLACK, zorder=zorder + 0.2)


def _draw_disc(ax: Axes, x: float, y: float, radius: float, face: str, edge: str, zorder: float = Z_RING) -> None:
    ax.add_artist(Circle((x, y), radius, facecolor=face, edgecolor=edge, linewidth=0.6, zorder=zorder))


@styled
def draw_rig(rig: Rig, frame, wheels) -> Figure:
    """Return a figure of the loop in a configuration with its wheels, (w, 3) centres and radii, m."""
    pins, _, angle = chain_points(rig, frame)
    middle, half = (pins.max(axis=0) + pins.min(axis=0)) / 2, np.ptp(pins, axis=0) / 2
    half += 0.06 * half.max() + rig.chain.link_thickness
    figure = new_figure(min(max(6.4 * half[1] / half[0], 1.6), 6.4) + 0.7, 7.2)
    ax = figure.add_subplot()
    draw_discs(ax, wheels[1:])
    draw_sprocket(ax, rig, angle, rig.ring_radius)
    draw_chain(ax, rig, frame)
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}
    label = {"ha": "center", "va": "center", "fontsize": SMALL, "color": BLACK, "bbox": box, "zorder": Z_MARK + 1}
    for name, (x, y, radius) in zip(wheel_names(rig), wheels, strict=True):
        suspension = None if name == "sprocket" else rig.wheels[name].suspension
        if isinstance(suspension, Arm):
            look = {"color": BLUE, "zorder": Z_MARK}
            ax.plot([suspension.x, x], [suspension.y, y], linestyle="-", linewidth=2.0, solid_capstyle="round", **look)
            ax.plot([suspension.x], [suspension.y], marker="o", markersize=4, **look)
        if name == rig.tension.wheel or (suspension is not None and not isinstance(suspension, Arm)):
            direction = np.radians(rig.tension.direction if name == rig.tension.wheel else suspension.direction)
            along = 0.35 * radius * np.array([np.cos(direction), np.sin(direction)])
            ax.annotate("", (x + along[0], y + along[1]), (x - along[0], y - along[1]), zorder=Z_MARK,
                        arrowprops={"arrowstyle": "<->", "color": VERMILION, "linewidth": 1.4})  # fmt: skip
        words = name.replace("_", " ") + (", tensioner" if name == rig.tension.wheel else "")
        ax.text(x, y - 0.5 * radius, words, **label)
    view(ax, middle, half)
    ax.set(aspect="equal", xlabel="x (m)", ylabel="y (m)")
    return figure

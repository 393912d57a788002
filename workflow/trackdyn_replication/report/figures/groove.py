"""Figures 5 to 8, in the frame of a groove: y_k outward through its lowest point, the sprocket's centre the origin."""

from dataclasses import replace
from math import atan2, degrees, dist, pi

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Polygon, Wedge

from trackdyn.contact.laws import find_area
from trackdyn.plots import drawing
from trackdyn.plots.style import BLACK, BLUE, GREEN, PURPLE, SMALL, VERMILION, new_figure, styled
from trackdyn.rig.layout import BeltPath, belt_around
from trackdyn.rig.rig import Rig
from trackdyn.rig.roots import root
from trackdyn.scene.build import make_tooth
from trackdyn_replication.report import marks

# convex and concave areas: colour and dashes of their arcs, face and hatch of their sectors
CONVEX_ARC = {"color": BLUE, "linestyle": "-", "linewidth": 2.6}
CONCAVE_ARC = {"color": VERMILION, "linestyle": (0, (3, 1)), "linewidth": 2.6}
CONVEX_SECTOR = {"facecolor": "#cfe3f1", "edgecolor": BLUE, "hatch": "////"}
CONCAVE_SECTOR = {"facecolor": "#fbe3d3", "edgecolor": VERMILION, "hatch": ".."}
TRAJECTORY = {"color": BLACK, "linestyle": (0, (1, 1)), "linewidth": 1.8}
ROLLING = {"color": "0.3", "linestyle": (0, (5, 2)), "linewidth": 0.8}
WHITE = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
POINTS = 60  # on an arc
NARROW = 0.01  # areas and sectors narrower than this have their number next to them, m
PINS = {
    "left": {"color": GREEN, "linestyle": "-", "linewidth": 1.4},
    "right": {"color": BLACK, "linestyle": (0, (6, 1.5, 1, 1.5)), "linewidth": 1.4},
}
SOLID = {"facecolor": drawing.CONNECTOR, "edgecolor": BLACK, "zorder": drawing.Z_CONNECTOR}
FLANK = (1, 2)  # areas behind the left arc, which drive
LARGEST_PHASE = 0.05  # phase of the chain on the sprocket, rad


def centre_trajectory(rig: Rig) -> np.ndarray:
    """Return (10 POINTS, 2) centres of an arc that rolls over the groove, m: its profile with other radii."""
    groove, rc = rig.groove_profile, rig.chain.connector_radius
    return replace(groove, radius=groove.radius + np.where(groove.convex, rc, -rc)).profile(POINTS)


def sector_radii(rig: Rig, area: int) -> tuple[float, float]:
    """Return inner and outer radius of the annular sector of an area (Eq. 21), m."""
    rc, r = rig.chain.connector_radius, float(rig.groove_profile.radius[area - 1])
    return (r, r + rc) if rig.groove_profile.convex[area - 1] else (r - rc, r)


def sector_patch(rig: Rig, area: int) -> Wedge:
    """Draw the annular sector of an area in the style of its kind."""
    groove = rig.groove_profile
    inner, outer = sector_radii(rig, area)
    middle = atan2(*groove.direction[area - 1][::-1])
    ends = (degrees(middle + sign * groove.half_angle[area - 1]) for sign in (-1, 1))
    look = (CONVEX_SECTOR if groove.convex[area - 1] else CONCAVE_SECTOR) | {"label": f"sector {area}"}
    look |= {"linewidth": 0.8, "zorder": drawing.Z_CONNECTOR}
    return Wedge(groove.centre[area - 1], outer, *ends, width=outer - inner, **look)


def draw_groove(ax: Axes, rig: Rig, depth: float, emphasized=range(1, 11)) -> None:
    """Draw the steel of a groove and its neighbours, ``depth`` (m) below the bottom; arcs styled by their kind."""
    groove = rig.groove_profile
    profile = groove.profile(POINTS)
    floor = profile[:, 1].min() - depth
    cuts = [end * floor / end[1] for end in (profile[-1], profile[0])]  # along the middles of the teeth
    steel = np.vstack([profile, cuts])
    z = drawing.Z_SPROCKET
    for k in (-1, 0, 1):
        angle = 2 * pi * k / groove.teeth
        body, edge = (drawing.placed(points, (0.0, 0.0), angle) for points in (steel, profile))
        look = {"facecolor": drawing.STEEL, "edgecolor": drawing.STEEL, "linewidth": 0.5}
        ax.add_patch(Polygon(body, **look, zorder=z))
        marks.line(ax, *edge, color=drawing.STEEL_EDGE, linewidth=1.0, zorder=z + 0.4)
    for area in emphasized:
        look = CONVEX_ARC if groove.convex[area - 1] else CONCAVE_ARC
        ax.plot(*groove.arc(area, POINTS).T, **look, zorder=z + 0.5)
    if len(emphasized):
        ends = np.vstack([profile[:1], groove.joints(), profile[-1:]])
        ax.plot(*ends.T, linestyle="none", marker="|", color=BLACK, markersize=7, zorder=z + 0.6)


def kinds() -> list[Line2D]:
    """Return handles of a legend: convex and concave areas."""
    return [marks.handle("convex area", **CONVEX_ARC), marks.handle("concave area", **CONCAVE_ARC)]


@styled
def section_figure(rig: Rig) -> Figure:
    """Draw Figure 5: sections of connector (a) and groove (b) with arcs, centres, radii and numbers."""
    figure = new_figure(6.0)
    connector, section = figure.subplots(2, 1, height_ratios=(0.62, 1.0))
    _draw_connector_section(connector, rig)
    groove = rig.groove_profile
    draw_groove(section, rig, 0.034)
    free_side = groove.direction * np.where(groove.convex, 1.0, -1.0)[:, None]  # unit normals, away from the steel
    for area in range(1, 11):  # numbers below the middles of the areas; of short ones deeper, those of the tips above
        short = 2 * groove.half_angle[area - 1] * groove.radius[area - 1] < 0.5 * NARROW
        at = groove.arc(area, 3)[1]
        depth = -0.0055 if area in (1, 10) else (2.8 if short else 1.0) * 0.0055
        end = at - depth * free_side[area - 1]
        if short:
            marks.line(section, at, end, linewidth=0.5, zorder=drawing.Z_SPROCKET + 0.7)
        marks.write_mark(section, end, str(area), fontsize=9)
    for area, (comparison, points) in {
        1: ("below", 2), 2: ("above left", 4), 3: ("right", 1), 4: ("below", 7), 5: ("right", 4),
    }.items():  # fmt: skip
        # radii of arcs from nearly one centre end apart
        centre, end = groove.centre[area - 1], groove.arc(area, 9)[points]
        text = f"$r_{area}$ = {1e3 * groove.radius[area - 1]:.1f}"
        marks.point(section, centre, "$O_5, O_6$" if area == 5 else f"$O_{area}$", comparison, gap=4)
        if area in (1, 4):  # too short for their texts
            beyond = [0.002, groove.radius[0] + 0.011] if area == 1 else [-0.03, 0.006]
            marks.arrow(section, centre, end, linewidth=0.9)
            marks.leader(section, 0.5 * (centre + end), text, centre + beyond)
        else:
            side = -1 if area == 3 else 1
            marks.radius(section, centre, end, text, 0.55, side, fontsize=SMALL)
    for area, side in {7: "below", 8: "right", 9: "right", 10: "below"}.items():
        marks.point(section, groove.centre[area - 1], f"$O_{{{area}}}$", side, gap=4)
    ends = (pi / 2 + sign * 1.15 * pi / rig.sprocket.teeth for sign in (-1, 1))
    addendum = drawing.circle_points((0.0, 0.0), groove.addendum, *ends, 80)
    section.plot(*addendum.T, linestyle=(0, (8, 2, 1, 2)), color="0.35", linewidth=0.8)
    marks.leader(section, addendum[12], f"$r_a$ = {1e3 * groove.addendum:.1f}", addendum[12] + [0.0, 0.02])
    floor = groove.profile()[:, 1].min() - 0.034
    marks.arrow(section, (0.0, floor + 0.018), (0.0, floor + 0.004))
    marks.write_mark(section, (0.003, floor + 0.011), "to $O_S$", ha="left")
    section.set(xlim=(-0.095, 0.095), ylim=(floor, groove.centre[:, 1].max() + 0.014))
    marks.frame_axes(section)
    figure.legend(handles=kinds(), loc="outside lower center", ncols=2)
    section.set_title("(b) groove, radii in mm")
    return figure


def _draw_connector_section(ax: Axes, rig: Rig) -> None:
    rc, length = rig.chain.connector_radius, rig.connector_length
    look = {"facecolor": drawing.CONNECTOR, "edgecolor": "none"}
    ax.add_patch(Polygon(drawing.connector_outline(rig), **look))
    for k, (name, dashes) in enumerate((("left arc", "-"), ("right arc", (0, (5, 1.5))))):
        centre, flip = np.array([k * length, 0.0]), 1 - 2 * k
        arc = centre + drawing.circle_points((0.0, 0.0), rc, pi / 2, 3 * pi / 2, POINTS) * [flip, 1]
        ax.plot(*arc.T, color=BLACK, linestyle=dashes, linewidth=2.2)
        marks.leader(ax, arc[18], name, centre + 1.5 * rc * np.array([-flip, 0.75]))
        end = centre + rc * marks.polar(pi / 2 + flip * 0.75 * pi)
        marks.radius(ax, centre, end, "$r_C$")
        marks.point(ax, centre, "$C$", "left above" if k == 0 else "right above", gap=3)
    marks.dimension(ax, (0, 0), (length, 0), f"$L_C$ = {marks.millimetres(length)}", offset=1.2 * rc)
    ax.set(xlim=(length / 2 - 0.095, length / 2 + 0.095), ylim=(-1.12 * rc, 1.6 * rc))
    marks.bare(ax)
    ax.set_title(f"(a) connector, both arcs of radius $r_C$ = {marks.millimetres(rc)}")


@styled
def detection_figure(rig: Rig) -> Figure:
    """Draw Figure 8: test of an arc's centre C against annular sector j, for a convex (a) and a concave area (b)."""
    groove = rig.groove_profile
    figure = new_figure(3.3)
    for ax, letter, area in zip(figure.subplots(1, 2), "ab", (1, 2), strict=True):
        convex = bool(groove.convex[area - 1])
        centre, u, theta = groove.centre[area - 1], groove.direction[area - 1], groove.half_angle[area - 1]
        inner, outer = sector_radii(rig, area)
        draw_groove(ax, rig, 0.02, emphasized=(area,))
        ax.add_patch(sector_patch(rig, area))
        middle, size = atan2(u[1], u[0]), 1.12 * outer
        point = centre + (inner + 0.7 * (outer - inner)) * marks.polar(middle + 0.55 * theta)
        for sign in (-1, 1):
            edge = centre + 1.2 * outer * marks.polar(middle + sign * theta)
            marks.line(ax, centre, edge, color="0.35", linewidth=0.7)
            marks.angle(ax, centre, size, middle, middle + sign * theta, rf"$\theta_{area}$", spread=1.1)
        marks.arrow(ax, centre, centre + 1.3 * outer * u, linestyle=(0, (5, 1.5)), linewidth=1.3)
        marks.write_mark(ax, centre + 1.38 * outer * u, f"$u_{area}$", fontsize=9)
        marks.vector(ax, centre, point, f"$e_{area}$", linewidth=1.6)
        box = np.array([centre - 0.3 * outer, centre + 0.3 * outer, centre + 1.45 * outer * u])
        half = 0.5 * max(np.ptp(box, axis=0).max(), 2.8 * outer * np.sin(theta))
        low = 0.5 * (box.min(axis=0) + box.max(axis=0)) - half
        for end, name in ((centre, f"$l_{{O_{area}}}$"), (point, "$l_C$")):
            start = end * low[1] / end[1]  # on its way from O_S, at the edge of the picture
            marks.vector(ax, start, end, name, at=0.2, side=-1, color="0.25", linestyle=(0, (5, 2)), linewidth=0.9)
        marks.point(ax, point, "$C$", "above" if convex else "left")
        marks.point(ax, centre, f"$O_{area}$", "below left" if convex else "right")
        ax.set(xlim=(low[0], low[0] + 2 * half), ylim=(low[1], low[1] + 2 * half))
        marks.frame_axes(ax)
        kind, bounds = "concave", r"$r_j - r_C \leq |e_j| \leq r_j$"
        if convex:
            kind, bounds = "convex", r"$r_j \leq |e_j| \leq r_j + r_C$"
        turned = r"and $e_j \cdot u_j \geq |e_j| \cos\theta_j$"
        ax.set_title(f"({letter}) {kind}, area $j$ = {area}:\n{bounds}\n{turned}")
    return figure


def passage(rig: Rig, points: int = 121) -> tuple[np.ndarray, np.ndarray]:
    """Return the (t,) angle of the sprocket from mid-wrap (rad) and the (t, 2, 2) pins of a connector, m."""
    path, _ = belt_around(rig)  # the way is kinematic: links lie on the ring, a pitch follows each groove
    wrap, r = path.wrap[0], path.circles[0, 2]
    chords = np.array([rig.chain.link_length, rig.connector_length])
    pitch = 2 * r * np.arcsin(chords / (2 * r)).sum()  # length of a pitch on the path round the sprocket
    angle = np.linspace(-1, 1, points) * (0.5 * wrap + 1.6 * pi / rig.sprocket.teeth)
    bearing = path.heading[0] + 0.5 * wrap + pi / 2 - angle  # direction of the groove
    pins = np.zeros((points, 2, 2))
    for i in range(points):
        middle = 0.5 * wrap * r + angle[i] * pitch * rig.sprocket.teeth / (2 * pi)
        both = _pins_around(path, middle, rig.connector_length) - path.circles[0, :2]
        pins[i] = drawing.placed(both, (0.0, 0.0), pi / 2 - bearing[i])
    tooth = make_tooth(rig.groove_profile, rig.chain.connector_radius, 0)
    free, touching = -LARGEST_PHASE, LARGEST_PHASE
    for _ in range(24):
        phase = 0.5 * (free + touching)
        left = drawing.placed(pins[:, 0], (0.0, 0.0), phase)
        touched = any(find_area(tooth, float(x), float(y))[0] in FLANK for x, y in left)
        free, touching = (free, phase) if touched else (phase, touching)
    return angle, drawing.placed(pins.reshape(-1, 2), (0.0, 0.0), free).reshape(pins.shape)


def _pins_around(path: BeltPath, s: float, chord: float) -> np.ndarray:
    """Return the (2, 2) pins of a body of a length in m whose middle is at arc length ``s`` of the path."""
    half = root(lambda half: dist(*path.along([s - half, s + half])[0]) - chord, 0.25 * chord, chord)
    return path.along([s - half, s + half])[0]


def seated_pins(rig: Rig) -> np.ndarray:
    """Return the (2, 2) pins of a connector that rests symmetrically in the groove, m."""
    half = 0.5 * rig.connector_length
    height = np.interp(-half, *centre_trajectory(rig).T)
    return np.array([[-half, height], [half, height]])


@styled
def engagement_figure(rig: Rig) -> Figure:
    """Draw Figure 6: frames of sprocket and groove (a), a connector entering the groove (b)."""
    figure = new_figure(7.0)
    complete, close = figure.subplots(2, 1, height_ratios=(1.2, 1.0))
    angle, path = passage(rig)
    _draw_frames(complete, rig, path[0])
    draw_groove(close, rig, 0.012, emphasized=())
    places = (-1.0, "-", "approaching"), (-0.8, (0, (5, 1.5)), "entering"), (0.0, (0, (1, 1)), "on the ring")
    for share, dashes, name in places:
        pins = path[np.argmin(np.abs(angle - share * angle[-1]))]
        look = {"edgecolor": BLACK, "linestyle": dashes, "linewidth": 1.1, "zorder": drawing.Z_CONNECTOR + 0.1}
        close.add_patch(drawing.connector_patch(rig, pins, **look, facecolor="none", label=name))
        marks.point(close, pins[0])
    close.add_patch(drawing.connector_patch(rig, seated_pins(rig), **SOLID, linewidth=0.5, label="at rest on the seat"))
    for k, (name, look) in enumerate(PINS.items()):
        close.plot(*path[angle <= 0, k].T, **look, zorder=drawing.Z_MARK, label=f"path of the {name} pin")
    heights = path[0, :, 1]
    close.set(xlim=(-0.095, 0.095), ylim=(heights.min() - 0.065, heights.max() + 0.045))
    marks.frame_axes(close)
    figure.legend(handles=close.get_legend_handles_labels()[0], loc="outside lower center", ncols=2)
    close.set_title("(b) a connector enters its groove")
    return figure


def _draw_frames(ax: Axes, rig: Rig, pins) -> None:
    """Draw the sprocket, frames of Eqs. 12 to 20 and a connector with its pins in the groove's frame."""
    teeth, reach, k = rig.sprocket.teeth, rig.groove_profile.addendum, 2
    beta = (2 * k - 1) * pi / teeth - pi / 2  # Eq. 12; the groove points up
    drawing.draw_sprocket(ax, rig.changed(sprocket__x=0.0, sprocket__y=0.0), -beta, None)
    ax.add_patch(drawing.connector_patch(rig, pins, **SOLID, linewidth=0.8))
    centre, corner, left = np.zeros(2), np.array([-1.5, -1.4]) * reach, pins[0]
    marks.axes_cross(ax, centre, 1.45 * reach, -beta, ("$x_S$", "$y_S$"), color=BLUE, linestyle=(0, (5, 2)))
    marks.axes_cross(ax, centre, 1.45 * reach, 0.0, ("$x_k$", "$y_k$"), color=VERMILION)
    marks.axes_cross(ax, corner, 0.4 * reach, 0.0, ("$X$", "$Y$"))
    marks.angle(ax, centre, 0.75 * reach, -beta, 0.0, r"$\beta_k$", spread=1.13)
    marks.angle(ax, centre, 0.5 * reach, -beta, atan2(left[1], left[0]), r"$\gamma$", spread=1.2)
    dotted = {"linestyle": (0, (1, 1)), "linewidth": 1.2}
    marks.vector(ax, corner, centre, "$R_{O_S}$", 0.4, side=-1, **dotted)
    marks.vector(ax, corner, left, "$R_C$", 0.4, **dotted)
    marks.vector(ax, centre, left, "$l_{O_S C}$", 0.55, color=PURPLE, linewidth=1.4)
    marks.point(ax, left, "$C$", "above left", gap=4)
    marks.point(ax, centre, "$O_S$", "below right", gap=4)
    marks.point(ax, corner, "$O$", "below left", gap=3)
    drawing.view(ax, centre, 1.75 * reach)
    marks.bare(ax)
    ax.set_title(f"(a) frames, groove $k$ = {k} of {teeth}")


@styled
def sector_figure(rig: Rig) -> Figure:
    """Draw Figure 7: trajectory of a rolling arc's centre (a), the ten annular sectors of contact (b)."""
    groove, rc = rig.groove_profile, rig.chain.connector_radius
    path = centre_trajectory(rig)
    figure = new_figure(5.9)
    rolling, sectors = figure.subplots(2, 1, sharex=True, sharey=True)
    for ax in (rolling, sectors):
        draw_groove(ax, rig, 0.012)
        ax.plot(*path.T, **TRAJECTORY, zorder=drawing.Z_MARK)
        marks.frame_axes(ax)
    for area in (1, 2, 5, 9):
        centre = path[(area - 1) * POINTS + POINTS // 2]
        foot = centre - rc * groove.direction[area - 1] * (1.0 if groove.convex[area - 1] else -1.0)
        rolling.add_patch(Circle(centre, rc, fill=False, **ROLLING))
        marks.line(rolling, centre, foot, **ROLLING | {"linestyle": "-", "zorder": 2})
        marks.point(rolling, centre)
        if area == 9:
            marks.radius(rolling, centre, foot, "$r_C$")
    centre_line = marks.handle("centre of a rolling arc", **TRAJECTORY)
    handles = [*kinds(), centre_line, marks.handle("arc of a connector", **ROLLING)]
    rolling.set(xlabel="", title="(a) trajectory of the centre of an arc that rolls over the groove")
    for area in range(1, 11):
        sectors.add_patch(sector_patch(rig, area))
        inner, outer = sector_radii(rig, area)
        centre, u = groove.centre[area - 1], groove.direction[area - 1]
        if groove.half_angle[area - 1] * (inner + outer) > NARROW:
            marks.write_mark(sectors, centre + 0.5 * (inner + outer) * u, str(area), fontsize=10, bbox=WHITE)
        else:
            end = centre + (outer + 0.008) * u
            marks.leader(sectors, centre + (outer - 0.3 * rc) * u, str(area), end, fontsize=10)
    pins = passage(rig)[1]
    for k, look in enumerate(PINS.values()):
        sectors.plot(*pins[:, k].T, **look, zorder=drawing.Z_MARK + 1)
    looks = {"convex": CONVEX_SECTOR, "concave": CONCAVE_SECTOR}
    faces = [Patch(**look, linewidth=0.8, label=f"sector of a {kind} area") for kind, look in looks.items()]
    paths = [marks.handle(f"way of the {name} arc's centre", **look) for name, look in PINS.items()]
    figure.legend(handles=[*handles, *faces, *paths], loc="outside lower center", ncols=2)
    sectors.set_title("(b) ten annular sectors: where the centre of an arc in contact is")
    sectors.set(xlim=(-0.098, 0.098), ylim=(groove.profile()[:, 1].min() - 0.012, groove.addendum + rc + 0.006))
    return figure

"""Figures 6 and 7: a connector entering its groove, and the trajectory of the centre of an arc in contact.

The way is kinematic: the chain as it lies around the wheels, moved along its path. No recording is needed.
"""

from math import atan2, dist, pi

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch

from trackdyn.contact.laws import find_area
from trackdyn.plots import drawing
from trackdyn.plots.style import BLACK, BLUE, GREEN, PURPLE, VERMILION, new_figure, styled
from trackdyn.rig.layout import BeltPath, belt_around
from trackdyn.rig.rig import Rig
from trackdyn.rig.roots import root
from trackdyn.scene.build import make_tooth
from trackdyn_replication.report import marks
from trackdyn_replication.report.figures import groove as section

PINS = {
    "left": {"color": GREEN, "linestyle": "-", "linewidth": 1.4},
    "right": {"color": BLACK, "linestyle": (0, (6, 1.5, 1, 1.5)), "linewidth": 1.4},
}
SOLID = {"facecolor": drawing.CONNECTOR, "edgecolor": BLACK, "zorder": drawing.Z_CONNECTOR}
FLANK = (1, 2)  # areas behind the left arc, which drive
LARGEST_PHASE = 0.05  # phase of the chain on the sprocket, rad


def passage(rig: Rig, points: int = 121) -> tuple[np.ndarray, np.ndarray]:
    """Return the kinematic passage of a connector through its groove.

    The links lie on the ring, the runs are straight, and one pitch follows each groove. The phase of the chain on the
    sprocket is that at which the left arc just touches its flank once.

    Returns
    -------
    angle : (t,) array
        Angle of the sprocket since the groove was in the middle of the wrap, rad.
    pins : (t, 2, 2) array
        Input (left) and output pin of the connector in the groove's frame, m.
    """
    path, _ = belt_around(rig)
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
    height = np.interp(-half, *section.centre_trajectory(rig).T)
    return np.array([[-half, height], [half, height]])


@styled
def engagement_figure(rig: Rig) -> Figure:
    """Draw Figure 6: frames of sprocket and groove (a), a connector entering the groove (b)."""
    figure = new_figure(7.0)
    complete, close = figure.subplots(2, 1, height_ratios=(1.2, 1.0))
    angle, path = passage(rig)
    _draw_frames(complete, rig, path[0])
    section.draw_groove(close, rig, 0.012, emphasized=())
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
    path = section.centre_trajectory(rig)
    figure = new_figure(5.9)
    rolling, sectors = figure.subplots(2, 1, sharex=True, sharey=True)
    for ax in (rolling, sectors):
        section.draw_groove(ax, rig, 0.012)
        ax.plot(*path.T, **section.TRAJECTORY, zorder=drawing.Z_MARK)
        marks.frame_axes(ax)
    for area in (1, 2, 5, 9):
        centre = path[(area - 1) * section.POINTS + section.POINTS // 2]
        foot = centre - rc * groove.direction[area - 1] * (1.0 if groove.convex[area - 1] else -1.0)
        rolling.add_patch(Circle(centre, rc, fill=False, **section.ROLLING))
        marks.line(rolling, centre, foot, **section.ROLLING | {"linestyle": "-", "zorder": 2})
        marks.point(rolling, centre)
        if area == 9:
            marks.radius(rolling, centre, foot, "$r_C$")
    centre_line = marks.handle("centre of a rolling arc", **section.TRAJECTORY)
    handles = [*section.kinds(), centre_line, marks.handle("arc of a connector", **section.ROLLING)]
    rolling.set_xlabel("")
    rolling.set_title("(a) trajectory of the centre of an arc that rolls over the groove")
    for area in range(1, 11):
        sectors.add_patch(section.sector_patch(rig, area))
        inner, outer = section.sector_radii(rig, area)
        centre, u = groove.centre[area - 1], groove.direction[area - 1]
        if groove.half_angle[area - 1] * (inner + outer) > section.NARROW:
            marks.write_mark(sectors, centre + 0.5 * (inner + outer) * u, str(area), fontsize=10, bbox=section.WHITE)
        else:
            end = centre + (outer + 0.008) * u
            marks.leader(sectors, centre + (outer - 0.3 * rc) * u, str(area), end, fontsize=10)
    pins = passage(rig)[1]
    for k, look in enumerate(PINS.values()):
        sectors.plot(*pins[:, k].T, **look, zorder=drawing.Z_MARK + 1)
    looks = {"convex": section.CONVEX_SECTOR, "concave": section.CONCAVE_SECTOR}
    faces = [Patch(**look, linewidth=0.8, label=f"sector of a {kind} area") for kind, look in looks.items()]
    paths = [marks.handle(f"way of the {name} arc's centre", **look) for name, look in PINS.items()]
    figure.legend(handles=[*handles, *faces, *paths], loc="outside lower center", ncols=2)
    sectors.set_title("(b) ten annular sectors: where the centre of an arc in contact is")
    sectors.set(xlim=(-0.098, 0.098), ylim=(groove.profile()[:, 1].min() - 0.012, groove.addendum + rc + 0.006))
    return figure

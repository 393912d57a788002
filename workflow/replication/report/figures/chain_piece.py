"""Figure 2: a piece of the chain with its dimensions."""

from math import pi

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from replication.report import marks
from trackdyn.plots import drawing
from trackdyn.plots.style import BLACK, new_figure, styled
from trackdyn.rig.rig import Rig

# radii of a pin and of the hole with its bushing, in parts of the link's half thickness; for the eye only
PIN, HOLE = 0.4, 0.65
ENLARGED = 5  # the free angle of the bushings, which would hardly be seen


@styled
def piece_figure(rig: Rig) -> Figure:
    """Figure 2: a stretched piece of the chain with its dimensions (a), the same with its bushings unloaded (b)."""
    a, b, half = rig.chain.link_length, rig.connector_length, rig.chain.link_thickness / 2
    figure = new_figure(4.2)
    stretched, free = figure.subplots(2, 1)
    pins = _draw_piece(stretched, rig, 0.0)
    low, high = -rig.chain.connector_radius, half
    marks.dimension(stretched, pins[0], pins[1], f"link {marks.millimetres(a)}", offset=low - 0.012, side=-1)
    marks.dimension(stretched, pins[3], pins[4], f"$L_C$ = {marks.millimetres(b)}", offset=low - 0.012, side=-1)
    marks.dimension(stretched, pins[0], pins[2], f"pitch {marks.millimetres(a + b)}", offset=low - 0.042, side=-1)
    edge = pins[5] + [0.02, 0.0]
    marks.dimension(stretched, edge + [0, -half], edge + [0, half], "", turned=False)
    marks.write_mark(stretched, edge + [0.004, 0.0], f"$D$ = {marks.millimetres(2 * half)}", ha="left")
    tip = pins[2] + rig.chain.connector_radius * marks.polar(0.35 * pi)
    marks.arrow(stretched, pins[2], tip)
    name = f"$r_C$ = {marks.millimetres(rig.chain.connector_radius)}"
    marks.leader(stretched, tip, name, (tip[0] - 0.062, high + 0.045))
    chain = rig.chain
    link = f"track link\n{chain.link_mass:.3g} kg\n{chain.link_inertia:.3g} kg m²"
    connector = f"connector\n{chain.connector_mass:.3g} kg\n{chain.connector_inertia:.3g} kg m²"
    for point, name, up in (
        (0.5 * (pins[2] + pins[3]) - [0.012, 0.0], link, 0.05),
        (0.5 * (pins[3] + pins[4]) + [0.012, 0.0], connector, 0.05),
        (pins[5] + [0.0, HOLE * half * 0.85], "bushing", 0.045),
        (pins[0] + [0, 0.15 * half], "pin", 0.045),
    ):
        marks.leader(stretched, point, name, (point[0] + 0.003, high + up))
    for body in (2, 3):
        stretched.plot(*(0.5 * (pins[body] + pins[body + 1])), marker="+", color=BLACK, zorder=drawing.Z_MARK)
    stretched.set_ylim(low - 0.064, high + 0.075)
    stretched.set_title("(a) stretched piece")
    stretched_end = pins[-1, 0]
    phi = ENLARGED * rig.bushing.free_angle
    pins = _draw_piece(free, rig, phi)
    joint, reach = pins[3], 0.095
    for heading, dashes in ((2 * phi, (0, (5, 2))), (3 * phi, "-")):  # link before, connector
        marks.line(free, joint, joint + 1.05 * reach * marks.polar(heading), linestyle=dashes, linewidth=0.8)
    marks.angle(free, joint, reach, 2 * phi, 3 * phi, "")
    angle = rig.bushing.free_angle
    text = rf"$\varphi_0$ = {angle:g} rad ({np.degrees(angle):.1f}°), drawn {ENLARGED} times larger"
    point = joint + reach * marks.polar(2.5 * phi)
    marks.leader(free, point, text.replace("-", "\N{MINUS SIGN}"), (0.5 * pins[-1, 0] + 0.1, high + 0.035))
    free.set_ylim(pins[:, 1].min() - 0.035, high + 0.05)
    free.set_title("(b) the same piece with its bushings unloaded")
    for ax in (stretched, free):
        ax.set_xlim(-0.02, stretched_end + 0.125)
        marks.bare(ax)
    return figure


def _draw_piece(ax: Axes, rig: Rig, joint_angle: float) -> np.ndarray:
    """Three links and two connectors, every joint turned by an angle (rad); returns their pins, m."""
    pins, heading, half = [np.zeros(2)], 0.0, rig.chain.link_thickness / 2
    for body in range(5):
        connector = body % 2
        outline = drawing.connector_outline(rig) if connector else drawing.link_outline(rig)
        face, z = (drawing.CONNECTOR, drawing.Z_CONNECTOR) if connector else (drawing.LINK, drawing.Z_LINK)
        look = {"facecolor": face, "edgecolor": drawing.EDGE, "linewidth": 0.8, "zorder": z}
        ax.add_patch(Polygon(drawing.placed(outline, pins[-1], heading), **look, alpha=0.9))
        length = rig.connector_length if connector else rig.chain.link_length
        pins.append(pins[-1] + length * marks.polar(heading))
        heading += joint_angle
    for pin in pins:
        look = {"linewidth": 0.6, "zorder": drawing.Z_LINK + 0.5}
        ax.add_patch(Circle(pin, HOLE * half, facecolor="white", edgecolor=drawing.RUBBER, hatch="xxxx", **look))
        ax.add_patch(Circle(pin, PIN * half, facecolor=drawing.STEEL, edgecolor=drawing.STEEL_EDGE, **look))
    return np.array(pins)

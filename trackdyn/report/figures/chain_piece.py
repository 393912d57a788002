"""Figure 2: a piece of the chain with its dimensions."""

from math import pi

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from trackdyn.parameters.rig import Rig
from trackdyn.report import drawing, marks
from trackdyn.report.style import BLACK, new_figure, styled

# radii of a pin and of the hole with its bushing, in parts of the link's half thickness; for the eye only
PIN, HOLE = 0.4, 0.65


@styled
def piece_figure(rig: Rig) -> Figure:
    """Figure 2: a stretched piece of the chain with its dimensions (a), the same with its bushings unloaded (b)."""
    a, b, half = rig.chain.link_length, rig.connector_length, rig.chain.link_thickness / 2
    figure = new_figure(5.2)
    stretched, free = figure.subplots(2, 1)
    pins = _draw_piece(stretched, rig, 0.0)
    low, high = -rig.chain.connector_radius, half
    marks.dimension(stretched, pins[0], pins[1], f"link {marks.millimetres(a)}", offset=low - 0.012, side=-1)
    marks.dimension(stretched, pins[1], pins[2], f"$L_C$ = {marks.millimetres(b)}", offset=low - 0.012, side=-1)
    marks.dimension(stretched, pins[0], pins[2], f"pitch {marks.millimetres(a + b)}", offset=low - 0.034, side=-1)
    edge = pins[5] + [0.02, 0.0]
    marks.dimension(stretched, edge + [0, -half], edge + [0, half], "", turned=False)
    marks.write(stretched, edge + [0.004, 0.0], f"$D$ = {marks.millimetres(2 * half)}", ha="left")
    tip = pins[2] + rig.chain.connector_radius * marks.polar(0.35 * pi)
    marks.arrow(stretched, pins[2], tip)
    name = f"$r_C$ = {marks.millimetres(rig.chain.connector_radius)}"
    marks.leader(stretched, tip, name, (tip[0] - 0.012, high + 0.05))
    for place, name, up in (
        (0.4 * pins[2] + 0.6 * pins[3] + [0, 0.6 * half], "track link", 0.045),
        (0.5 * (pins[3] + pins[4]) + [0, 0.5 * half], "connector", 0.045),
        (pins[4] + [0.0, HOLE * half * 0.85], "bushing", 0.055),
        (pins[1] + [0, 0.15 * half], "pin", 0.045),
    ):
        marks.leader(stretched, place, name, (place[0] + 0.012, high + up))
    chain = rig.chain
    weights = ((chain.link_mass, chain.link_inertia), (chain.connector_mass, chain.connector_inertia))
    for body, (mass, inertia) in enumerate(weights):
        middle = 0.5 * (pins[body] + pins[body + 1])
        stretched.plot(*middle, marker="+", color=BLACK, markersize=6, zorder=drawing.Z_MARK)
        marks.write(stretched, middle + [0.0, -0.55 * half], f"{mass:g} kg\n{inertia:g} kg m²", fontsize=6.5)
    stretched.set_ylim(low - 0.052, high + 0.068)
    stretched.set_title("(a) stretched piece")
    phi = rig.bushing.free_angle
    pins = _draw_piece(free, rig, phi)
    joint, reach = pins[3], 0.095
    for heading, dashes in ((2 * phi, (0, (5, 2))), (3 * phi, "-")):  # of the link before and the connector
        marks.line(free, joint, joint + 1.05 * reach * marks.polar(heading), linestyle=dashes, linewidth=0.8)
    marks.angle(free, joint, reach, 2 * phi, 3 * phi, "")
    text = rf"$\varphi_0$ = {phi:g} rad ({np.degrees(phi):.1f}°)".replace("-", "\N{MINUS SIGN}")
    marks.leader(free, joint + reach * marks.polar(2.5 * phi), text, joint + [reach, 0.055])
    free.set_ylim(pins[:, 1].min() - 0.04, high + 0.045)
    free.set_title("(b) the same piece with its bushings unloaded")
    for ax in (stretched, free):
        ax.set_xlim(-0.03, pins[-1, 0] + 0.1)
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

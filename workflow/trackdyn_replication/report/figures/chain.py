"""Figures 2 and 3: a piece of the chain with its dimensions, and its elements in the transfer matrix method."""

from math import pi

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from trackdyn.plots import drawing
from trackdyn.plots.style import BLACK, SMALL, VERMILION, new_figure, styled
from trackdyn.rig.layout import belt_path
from trackdyn.rig.rig import Rig
from trackdyn.scene.build import build_chain
from trackdyn_replication.report import marks

# radii of a pin and of the hole with its bushing, in parts of the link's half thickness; for the eye only
PIN, HOLE = 0.4, 0.65
ENLARGED = 5  # the free angle of the bushings, which would hardly be seen
# face of a body in the topology, its name in the legend
KINDS = {
    "link": (drawing.LINK, "link"), "connector": (drawing.CONNECTOR, "connector with two pins"),
    "pitch": ("#d9e7d3", "one body per pitch"),
}  # fmt: skip
EVERY = 10  # every tenth element of a long chain is numbered


@styled
def piece_figure(rig: Rig) -> Figure:
    """Draw Figure 2: a stretched piece of the chain with its dimensions (a), and with its bushings unloaded (b)."""
    chain, b, half = rig.chain, rig.connector_length, rig.chain.link_thickness / 2
    low, high = -chain.connector_radius, half
    figure = new_figure(4.2)
    stretched, free = figure.subplots(2, 1)
    pins = _draw_piece(stretched, rig, 0.0)
    for first, last, name, length, below in (
        (0, 1, "link", chain.link_length, 0.012), (3, 4, "$L_C$ =", b, 0.012),
        (0, 2, "pitch", chain.link_length + b, 0.042),
    ):  # fmt: skip
        text = f"{name} {marks.millimetres(length)}"
        marks.dimension(stretched, pins[first], pins[last], text, offset=low - below, side=-1)
    edge = pins[5] + [0.02, 0.0]
    marks.dimension(stretched, edge + [0, -half], edge + [0, half], "", turned=False)
    marks.write_mark(stretched, edge + [0.004, 0.0], f"$D$ = {marks.millimetres(2 * half)}", ha="left")
    tip = pins[2] + chain.connector_radius * marks.polar(0.35 * pi)
    marks.arrow(stretched, pins[2], tip)
    name = f"$r_C$ = {marks.millimetres(chain.connector_radius)}"
    marks.leader(stretched, tip, name, (tip[0] - 0.062, high + 0.045))
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
    stretched.set(ylim=(low - 0.064, high + 0.075), xlim=(-0.02, pins[-1, 0] + 0.125))
    stretched.set_title("(a) stretched piece")
    angle = rig.bushing.free_angle
    phi = ENLARGED * angle
    pins = _draw_piece(free, rig, phi)
    joint, reach = pins[3], 0.095
    for heading, dashes in ((2 * phi, (0, (5, 2))), (3 * phi, "-")):  # link before, connector
        marks.line(free, joint, joint + 1.05 * reach * marks.polar(heading), linestyle=dashes, linewidth=0.8)
    marks.angle(free, joint, reach, 2 * phi, 3 * phi, "")
    text = rf"$\varphi_0$ = {angle:g} rad ({np.degrees(angle):.1f}°), drawn {ENLARGED} times larger"
    point = joint + reach * marks.polar(2.5 * phi)
    marks.leader(free, point, text.replace("-", "\N{MINUS SIGN}"), (0.5 * pins[-1, 0] + 0.1, high + 0.035))
    free.set(xlim=stretched.get_xlim(), ylim=(pins[:, 1].min() - 0.035, high + 0.05))
    free.set_title("(b) the same piece with its bushings unloaded")
    for ax in (stretched, free):
        marks.bare(ax)
    return figure


def _draw_piece(ax: Axes, rig: Rig, joint_angle: float) -> np.ndarray:
    """Draw three links and two connectors, every joint rotated by an angle (rad); return their pins, m."""
    pins, heading, half = [np.zeros(2)], 0.0, rig.chain.link_thickness / 2
    kinds = (
        (drawing.link_outline(rig), drawing.LINK, drawing.Z_LINK, rig.chain.link_length),
        (drawing.connector_outline(rig), drawing.CONNECTOR, drawing.Z_CONNECTOR, rig.connector_length),
    )
    for body in range(5):
        outline, face, z, length = kinds[body % 2]
        look = {"facecolor": face, "edgecolor": drawing.EDGE, "linewidth": 0.8, "zorder": z}
        ax.add_patch(Polygon(drawing.placed(outline, pins[-1], heading), **look, alpha=0.9))
        pins.append(pins[-1] + length * marks.polar(heading))
        heading += joint_angle
    for pin in pins:
        look = {"linewidth": 0.6, "zorder": drawing.Z_LINK + 0.5}
        ax.add_patch(Circle(pin, HOLE * half, facecolor="white", edgecolor=drawing.RUBBER, hatch="xxxx", **look))
        ax.add_patch(Circle(pin, PIN * half, facecolor=drawing.STEEL, edgecolor=drawing.STEEL_EDGE, **look))
    return np.array(pins)


@styled
def topology_figure(rig: Rig) -> Figure:
    """Draw Figure 3: elements of the loop as simulated (a) and as the paper counts them (b)."""
    figure = new_figure(6.0)
    single = build_chain(rig, "single_pin")
    chains = (("(a) links and connectors", build_chain(rig)), ("(b) one body per pitch", single))
    for ax, (title, chain) in zip(figure.subplots(2, 1), chains, strict=True):
        bodies = len(chain.length)
        links = np.isclose(chain.length, rig.chain.link_length)
        kinds = ["pitch"] * bodies if bodies == rig.chain.pitches else np.where(links, "link", "connector").tolist()
        _draw_loop(ax, kinds)
        ax.set_title(f"{title}: {bodies} bodies, {bodies - 1} joints in the tree, joint {2 * bodies} cut")
    return figure


def _draw_loop(ax: Axes, kinds: list[str]) -> None:
    """Draw bodies as circles and squares, joints as arrows in the transfer direction, the cut joint crossed out.

    Bodies are odd as in the paper, each before its output joint. They lie on a stadium, clockwise from the middle of
    its lower side.
    """
    straight, r, count = 3.4, 1.5, 2 * len(kinds)
    path = belt_path([[-straight / 2, 0.0, r], [straight / 2, 0.0, r]])  # which begins where it meets the left circle
    places = path.along(np.arange(count) * path.length / count - straight / 2)[0]
    spacing = np.hypot(*(places[2] - places[0]))
    half = 0.34 * spacing
    square = 0.9 * half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for number, kind in zip(range(1, count, 2), kinds, strict=True):
        body, joint, outboard = places[number - 1], places[number], places[(number + 1) % count]
        look = {"facecolor": KINDS[kind][0], "edgecolor": drawing.EDGE, "linewidth": 0.7, "zorder": drawing.Z_MARK}
        ax.add_patch(Polygon(body + square, **look) if kind == "connector" else Circle(body, half, **look))
        if spacing > 0.3:
            ax.text(*body, str(number), ha="center", va="center", fontsize=SMALL, zorder=drawing.Z_MARK + 2)
        elif number % EVERY == 1:
            outward = marks.directions(places[number - 2], joint)[1]
            marks.write_mark(ax, body + 0.28 * outward, str(number), fontsize=SMALL)
        step, left = marks.directions(body, outboard)
        marks.arrow(ax, body + half * step, outboard - half * step, linewidth=0.8, mutation_scale=6)
    ends = [joint + 0.45 * spacing * left, joint - 0.45 * spacing * left]
    marks.line(ax, *ends, color=VERMILION, linewidth=2.2, zorder=drawing.Z_MARK + 1)
    marks.leader(ax, ends[1], f"joint {count}, cut", joint - 0.42 * left)
    handles = []
    for kind in dict.fromkeys(kinds):
        face, words = KINDS[kind]
        look = {"marker": "s" if kind == "connector" else "o", "markersize": 8, "markerfacecolor": face}
        handles.append(marks.handle(words, linestyle="none", markeredgecolor=drawing.EDGE, **look))
    look = {"color": BLACK, "marker": ">", "markersize": 4, "linewidth": 0.8}
    handles.append(marks.handle("revolute joint (even number), transfer direction", **look))
    ax.legend(handles=handles, loc="center")
    drawing.view(ax, (0.0, 0.0), (straight / 2 + r + 0.45, r + 0.5))
    marks.bare(ax)

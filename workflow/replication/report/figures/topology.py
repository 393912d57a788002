"""Figure 3: the chain as elements of the transfer matrix method, made from the chains that can be simulated."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from replication.report import marks
from trackdyn.model.constants import Chain
from trackdyn.plots.drawing import CONNECTOR, EDGE, LINK, Z_MARK, view
from trackdyn.plots.style import BLACK, SMALL, VERMILION, new_figure, styled
from trackdyn.rig.layout import belt_path
from trackdyn.rig.rig import Rig
from trackdyn.scene.build import build_chain

# face of a body in the topology, its name in the legend
FACES = {"link": LINK, "connector": CONNECTOR, "pitch": "#d9e7d3"}
KINDS = {"link": "link", "connector": "connector with two pins", "pitch": "one body a pitch"}
EVERY = 10  # every tenth element of a long chain is numbered


def body_kinds(rig: Rig, chain: Chain) -> list[str]:
    """Kind of every body of a simulated chain, told by its length."""
    if len(chain.length) == rig.chain.pitches:
        return ["pitch"] * rig.chain.pitches
    return ["link" if np.isclose(length, rig.chain.link_length) else "connector" for length in chain.length]


@styled
def topology_figure(rig: Rig) -> Figure:
    """Figure 3: elements of the loop as simulated (a) and as the paper counts them (b)."""
    physical, printed = body_kinds(rig, build_chain(rig)), body_kinds(rig, build_chain(rig, "single_pin"))
    figure = new_figure(6.0)
    chains = (("(a) links and connectors", physical), ("(b) one body a pitch", printed))
    for ax, (what, kinds) in zip(figure.subplots(2, 1), chains, strict=True):
        _draw_loop(ax, kinds)
        bodies = len(kinds)
        ax.set_title(f"{what}: {bodies} bodies, {bodies - 1} joints in the tree, joint {2 * bodies} cut")
    return figure


def _stadium(parts: int, straight: float, r: float) -> np.ndarray:
    """Equally spaced places on a stadium, clockwise from the middle of its lower side."""
    path = belt_path([[-straight / 2, 0.0, r], [straight / 2, 0.0, r]])
    # the path begins where it meets the left circle
    return path.along(np.arange(parts) * path.length / parts - straight / 2)[0]


def _draw_loop(ax: Axes, kinds: list[str]) -> None:
    """Bodies as circles and squares, joints as arrows in the transfer direction, the cut joint crossed out.

    Elements are numbered as in the paper: odd bodies, each before its output joint, of which the last is cut.
    """
    straight, r, count = 3.4, 1.5, 2 * len(kinds)
    places = _stadium(count, straight, r)
    spacing = np.hypot(*(places[2] - places[0]))
    half, roomy = 0.34 * spacing, spacing > 0.3
    square = 0.9 * half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for number, kind in zip(range(1, count, 2), kinds, strict=True):
        body, joint, outboard = places[number - 1], places[number], places[(number + 1) % count]
        look = {"facecolor": FACES[kind], "edgecolor": EDGE, "linewidth": 0.7, "zorder": Z_MARK}
        look["label"] = f"{kind} {number}"
        ax.add_patch(Polygon(body + square, **look) if kind == "connector" else Circle(body, half, **look))
        if roomy:
            ax.text(*body, str(number), ha="center", va="center", fontsize=SMALL, zorder=Z_MARK + 2)
        elif number % EVERY == 1:
            along = joint - places[number - 2]
            outward = np.array([-along[1], along[0]]) / np.hypot(*along)
            marks.write_mark(ax, body + 0.28 * outward, str(number), fontsize=SMALL)
        step = (outboard - body) / np.hypot(*(outboard - body))
        inward = np.array([step[1], -step[0]])
        marks.arrow(ax, body + half * step, outboard - half * step, linewidth=0.8, mutation_scale=6)
        if number + 1 == count:
            ends = [joint - 0.45 * spacing * inward, joint + 0.45 * spacing * inward]
            marks.line(ax, *ends, color=VERMILION, linewidth=2.2, zorder=Z_MARK + 1, label="cut")
            marks.leader(ax, ends[1], f"joint {count}, cut", joint + 0.42 * inward)
    handles = []
    for kind in dict.fromkeys(kinds):
        look = {"marker": "s" if kind == "connector" else "o", "markersize": 8, "markerfacecolor": FACES[kind]}
        handles.append(marks.handle(KINDS[kind], linestyle="none", markeredgecolor=EDGE, **look))
    look = {"color": BLACK, "marker": ">", "markersize": 4, "linewidth": 0.8}
    handles.append(marks.handle("revolute joint (even number), transfer direction", **look))
    ax.legend(handles=handles, loc="center")
    view(ax, (0.0, 0.0), (straight / 2 + r + 0.45, r + 0.5))
    marks.bare(ax)

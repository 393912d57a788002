"""Figure 3: the chain as elements of the transfer matrix method, made from the chains that can be simulated."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from replication.report import marks
from trackdyn.model.constants import Chain
from trackdyn.parameters.layout import belt_path
from trackdyn.parameters.rig import Rig
from trackdyn.plots.drawing import CONNECTOR, EDGE, LINK, Z_MARK, view
from trackdyn.plots.style import BLACK, SMALL, VERMILION, new_figure, styled
from trackdyn.scene.build import build_chain

# face of a body in the topology, its name in the legend
FACES = {"link": LINK, "connector": CONNECTOR, "pitch": "#d9e7d3"}
KINDS = {"link": "link", "connector": "connector with two pins", "pitch": "one body a pitch"}
EVERY = 10  # of the elements of a long chain is numbered


@dataclass(frozen=True)
class Element:
    """A body or a joint of the chain, numbered along it as in the paper: odd bodies, even joints."""

    number: int  # 1 to 2 n
    kind: str  # ``link``, ``connector``, ``pitch`` or ``joint``
    outboard: int  # number of the element at its output
    cut: bool = False  # the joint that is cut to make a tree of the loop


def elements(kinds: list[str]) -> list[Element]:
    """Elements of a closed chain of the bodies ``kinds``: every body is followed by its output joint.

    The last joint is cut: it leads back to the input of the first body.
    """
    count, chain = 2 * len(kinds), []
    for joint, kind in zip(range(2, count + 1, 2), kinds, strict=True):
        chain += [Element(joint - 1, kind, joint), Element(joint, "joint", joint % count + 1, joint == count)]
    return chain


def body_kinds(rig: Rig, chain: Chain) -> list[str]:
    """Kind of every body of a simulated chain, told by its length."""
    if len(chain.length) == rig.chain.pitches:
        return ["pitch"] * rig.chain.pitches
    return ["link" if np.isclose(length, rig.chain.link_length) else "connector" for length in chain.length]


@styled
def topology_figure(rig: Rig) -> Figure:
    """Figure 3: elements of the loop as simulated (a) and as the paper counts them (b)."""
    physical = elements(body_kinds(rig, build_chain(rig)))
    printed = elements(body_kinds(rig, build_chain(rig, "single_pin")))
    figure = new_figure(6.0)
    chains = (("(a) links and connectors", physical), ("(b) one body a pitch", printed))
    for ax, (what, chain) in zip(figure.subplots(2, 1), chains, strict=True):
        _draw_loop(ax, chain)
        bodies = len(chain) // 2
        ax.set_title(f"{what}: {bodies} bodies, {bodies - 1} joints in the tree, joint {chain[-1].number} cut")
    return figure


def _stadium(parts: int, straight: float, r: float) -> np.ndarray:
    """Equally spaced places on a stadium, clockwise from the middle of its lower side."""
    path = belt_path([[-straight / 2, 0.0, r], [straight / 2, 0.0, r]])
    # the path begins where it meets the left circle
    return path.along(np.arange(parts) * path.length / parts - straight / 2)[0]


def _draw_loop(ax: Axes, chain: list[Element]) -> None:
    """Bodies as circles and squares, joints as arrows in the transfer direction, the cut joint crossed out."""
    straight, r = 3.4, 1.5
    places = _stadium(len(chain), straight, r)
    spacing = np.hypot(*(places[2] - places[0]))
    half, roomy = 0.34 * spacing, spacing > 0.3
    square = 0.9 * half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for element, position in zip(chain, places, strict=True):
        if element.kind != "joint":
            look = {"facecolor": FACES[element.kind], "edgecolor": EDGE, "linewidth": 0.7, "zorder": Z_MARK}
            look["label"] = f"{element.kind} {element.number}"
            corners = position + square
            ax.add_patch(Polygon(corners, **look) if element.kind == "connector" else Circle(position, half, **look))
            if roomy:
                ax.text(*position, str(element.number), ha="center", va="center", fontsize=SMALL, zorder=Z_MARK + 2)
            elif element.number % EVERY == 1:
                comparison = places[element.number % len(chain)] - places[element.number - 2]
                outward = np.array([-comparison[1], comparison[0]]) / np.hypot(*comparison)
                marks.write_mark(ax, position + 0.28 * outward, str(element.number), fontsize=SMALL)
            continue
        inboard, outboard = places[element.number - 2], places[element.outboard - 1]
        step = (outboard - inboard) / np.hypot(*(outboard - inboard))
        inward = np.array([step[1], -step[0]])
        marks.arrow(ax, inboard + half * step, outboard - half * step, linewidth=0.8, mutation_scale=6)
        if element.cut:
            ends = [position - 0.45 * spacing * inward, position + 0.45 * spacing * inward]
            marks.line(ax, *ends, color=VERMILION, linewidth=2.2, zorder=Z_MARK + 1, label="cut")
            marks.leader(ax, ends[1], f"joint {element.number}, cut", position + 0.42 * inward)
    handles = []
    for kind in dict.fromkeys(element.kind for element in chain if element.kind != "joint"):
        look = {"marker": "s" if kind == "connector" else "o", "markersize": 8, "markerfacecolor": FACES[kind]}
        handles.append(marks.handle(KINDS[kind], linestyle="none", markeredgecolor=EDGE, **look))
    look = {"color": BLACK, "marker": ">", "markersize": 4, "linewidth": 0.8}
    handles.append(marks.handle("revolute joint (even number), transfer direction", **look))
    ax.legend(handles=handles, loc="center")
    view(ax, (0.0, 0.0), (straight / 2 + r + 0.45, r + 0.5))
    marks.bare(ax)

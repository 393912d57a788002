"""Figure 3: the chain as elements of the transfer matrix method, made from the chains that can be simulated."""

from dataclasses import dataclass
from math import pi

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon

from trackdyn.build import build_chain
from trackdyn.model.constants import Chain
from trackdyn.parameters.rig import Rig
from trackdyn.report import marks
from trackdyn.report.drawing import CONNECTOR, EDGE, LINK, Z_MARK
from trackdyn.report.style import BLACK, VERMILION, new_figure, styled

# face of a body in the topology, its name in the legend
FACES = {"link": LINK, "connector": CONNECTOR, "pitch": "#d9e7d3"}
KINDS = {"link": "link", "connector": "connector with two pins", "pitch": "one body a pitch"}


@dataclass(frozen=True)
class Element:
    """A body or a joint of the chain, numbered along it as in the paper: odd bodies, even joints.

    Attributes
    ----------
    number : int
        1 to 2 n.
    kind : str
        ``link``, ``connector``, ``pitch`` or ``joint``.
    outboard : int
        Number of the element at its output.
    cut : bool
        The joint that is cut to make a tree of the loop.
    """

    number: int
    kind: str
    outboard: int
    cut: bool = False


def elements(kinds: list[str]) -> list[Element]:
    """Elements of a closed chain of the bodies ``kinds``: every body is followed by its output joint.

    The last joint is cut: it leads back to the input of the first body.
    """
    count = 2 * len(kinds)
    found = []
    for i, kind in enumerate(kinds):
        body, joint = 2 * i + 1, 2 * i + 2
        found.append(Element(body, kind, joint))
        found.append(Element(joint, "joint", joint % count + 1, joint == count))
    return found


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
    figure = new_figure(6.2)
    for ax, letter, what, found in zip(
        figure.subplots(2, 1), "ab", ("links and connectors", "one body a pitch"), (physical, printed), strict=True
    ):
        _draw_loop(ax, found)
        bodies = len(found) // 2
        ax.set_title(
            f"({letter}) {what}: {bodies} bodies, {bodies - 1} joints in the tree, joint {found[-1].number} cut"
        )
    return figure


def _stadium(parts: int, straight: float, r: float) -> np.ndarray:
    """Equally spaced places on a stadium, clockwise from the middle of its lower side."""
    places = []
    length = 2 * straight + 2 * pi * r
    for s in np.arange(parts) * length / parts:
        s = (s - straight / 2) % length  # from where the left end begins
        turn = (s - straight * (s > pi * r + straight)) / r
        if s < pi * r:
            places.append([-straight / 2 - r * np.sin(turn), -r * np.cos(turn)])
        elif s < pi * r + straight:
            places.append([s - pi * r - straight / 2, r])
        elif s < 2 * pi * r + straight:
            places.append([straight / 2 - r * np.sin(turn), -r * np.cos(turn)])
        else:
            places.append([1.5 * straight - (s - 2 * pi * r), -r])
    return np.array(places)


def _draw_loop(ax: Axes, found: list[Element]) -> None:
    """Bodies as circles and squares, joints as arrows in the transfer direction, the cut joint crossed out."""
    straight, r = 4.6, 1.1
    places = _stadium(len(found), straight, r)
    spacing = np.hypot(*(places[2] - places[0]))
    half, roomy = 0.34 * spacing, spacing > 0.3
    square = 0.9 * half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for element, place in zip(found, places, strict=True):
        if element.kind != "joint":
            look = {"facecolor": FACES[element.kind], "edgecolor": EDGE, "linewidth": 0.7, "zorder": Z_MARK}
            look["label"] = f"{element.kind} {element.number}"
            corners = place + square
            ax.add_patch(Polygon(corners, **look) if element.kind == "connector" else Circle(place, half, **look))
            ax.text(
                *place, str(element.number), ha="center", va="center", fontsize=7 if roomy else 5, zorder=Z_MARK + 2
            )
            continue
        inboard, outboard = places[element.number - 2], places[element.outboard - 1]
        step = (outboard - inboard) / np.hypot(*(outboard - inboard))
        inward = np.array([step[1], -step[0]])
        marks.arrow(ax, inboard + half * step, outboard - half * step, linewidth=0.8, mutation_scale=6)
        if element.cut:
            ends = [place - 0.45 * spacing * inward, place + 0.45 * spacing * inward]
            ax.plot(*np.transpose(ends), "-", color=VERMILION, linewidth=2.2, zorder=Z_MARK + 1, label="cut")
            marks.leader(ax, ends[1], f"joint {element.number}, cut", place + 0.42 * inward)
        elif roomy:
            marks.write(ax, place + 0.13 * inward, str(element.number), fontsize=5.5)
    handles = [
        Line2D([], [], linestyle="none", marker="s" if kind == "connector" else "o", markersize=8, markerfacecolor=FACES[kind],
               markeredgecolor=EDGE, label=KINDS[kind])
        for kind in dict.fromkeys(element.kind for element in found if element.kind != "joint")
    ]  # fmt: skip
    handles.append(
        Line2D(
            [],
            [],
            color=BLACK,
            marker=">",
            markersize=4,
            linewidth=0.8,
            label="revolute joint (even number), transfer direction",
        )
    )
    ax.legend(handles=handles, loc="center")
    ax.set_xlim(-straight / 2 - r - 0.25, straight / 2 + r + 0.25)
    ax.set_ylim(-r - 0.25, r + 0.25)
    marks.bare(ax)

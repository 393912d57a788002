"""Figures 19 and 21: contact forces and areas of one connector on its way around the sprocket."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackdyn.errors import InputError
from trackdyn.measure.meshing import passages, spells, timing
from trackdyn.paper import printed
from trackdyn.recording import Recording
from trackdyn.report.drawing import ring_words
from trackdyn.report.style import BLACK, BLUE, GREEN, PRINTED, PURPLE, new_figure, styled

LOOKS = {
    "left": {"color": BLUE, "linestyle": "-", "marker": "o"},
    "right": {"color": PURPLE, "linestyle": (0, (5, 1.5)), "marker": "s"},
    "ring": {"color": GREEN, "linestyle": (0, (6, 1.5, 1, 1.5)), "marker": "^"},
}
NAMES = {"left": "left arc", "right": "right arc", "ring": "link ahead on the ring"}
BEFORE, AFTER = 0.05, 0.05  # shown before the first and after the last contact, turns
NEAR = 0.012  # printed events closer than this share one label, turns
BEYOND = 1.25  # of the highest point of the curves: larger single steps are written, not drawn


@dataclass(frozen=True)
class Selected:
    """The passage that is shown.

    Attributes
    ----------
    connector : int
        1-based.
    groove : int
        Its groove, 1 to m.
    number : int
        Of the passage in the record.
    first, last : float
        First and last contact, s since the beginning of the record.
    turn : float
        Time of a sprocket turn, s.
    sides : DataFrame
        Rows of :func:`trackdyn.measure.meshing.passages`, by side.
    force : (s, 3) array
        Left arc, right arc, link ahead on the ring, N.
    area : (s, 2) array
        Areas of the arcs, 0 without contact.
    time : (s,) array
        s since the first contact.
    """

    connector: int
    groove: int
    number: int
    first: float
    last: float
    turn: float
    sides: pd.DataFrame
    force: np.ndarray
    area: np.ndarray
    time: np.ndarray


def select_passage(recording: Recording) -> Selected:
    """The complete passage nearest to the middle of the record whose contacts are all recorded.

    Raises
    ------
    InputError
        If there is none: the record is too short, or the link ahead of the connector is not recorded.
    """
    count = timing(recording).pitches
    columns = {int(pitch): i for i, pitch in enumerate(recording.pitches)}
    ring = recording.meta["scene"]["ring_radius"] is not None
    connectors = [pitch for pitch in columns if not ring or pitch % count + 1 in columns]
    if not connectors:
        pitch = int(recording.pitches[0])
        raise InputError(
            f"the recording lacks the ring force of link {pitch % count + 1}, which runs ahead of connector "
            f"{pitch}; simulate with pitches ({pitch}, {pitch % count + 1})"
        )
    table = passages(recording)
    table = table[table["connector"].isin(connectors)]
    if table.empty:
        found = "the record holds no complete passage over the sprocket"
        raise InputError(f"{found}; simulate two loop revolutions or more")
    groups = table.groupby("passage")
    start, end = groups["start_s"].min(), groups["end_s"].max()
    number = int((start + end - timing(recording).record).abs().idxmin())
    sides = groups.get_group(number).set_index("side")
    first, last, connector = float(start[number]), float(end[number]), int(sides["connector"].iloc[0])
    force = recording.force[:, columns[connector]].copy()
    if ring:
        force[:, 2] = recording.force[:, columns[connector % count + 1], 2]
    grooves = spells(recording).query("passage == @number and groove > 0")["groove"]
    groove = int(grooves.iloc[0]) if len(grooves) else 0
    area, time, turn = recording.area[:, columns[connector]], recording.time - first, timing(recording).turn
    return Selected(connector, groove, number, first, last, turn, sides, force, area, time)


def printed_times(ring: bool, turn: float) -> dict[str, float]:
    """Printed events after the first printed contact, s; stretched if the sprocket turns at another speed."""
    times = (printed.EVENTS_WITH_RING if ring else printed.EVENTS_WITHOUT_RING).value
    first = min(time for event, time in times.items() if "first" in event)
    scale = turn * 115 / (60 * printed.TRANSMISSION_RATIO.value)
    return {event: (time - first) * scale for event, time in times.items()}


@styled
def passage_figure(recording: Recording) -> Figure:
    """Normal forces (a) and areas (b) of one connector over one passage: Figure 19, with a ring Figure 21.

    Thin dashed lines stand where the paper prints its events, counted from its own first contact. Single
    marks are the largest force of all time steps; one far above the curves is written at the upper edge.

    Raises
    ------
    InputError
        If the recording does not hold such a passage; see :func:`select_passage`.
    """
    shown = select_passage(recording)
    scene = recording.meta["scene"]
    ring = scene["ring_radius"] is not None
    low, high = -BEFORE * shown.turn, shown.last - shown.first + AFTER * shown.turn
    inside = (shown.time >= low) & (shown.time <= high)
    time = shown.time[inside]
    figure = new_figure(5.4)
    forces, areas = figure.subplots(2, 1, sharex=True, height_ratios=(1.7, 1.0))
    sides = ("left", "right", "ring") if ring else ("left", "right")
    highest = max(shown.force[inside, : len(sides)].max(), 1.0)
    for i, side in enumerate(sides):
        look, row = LOOKS[side], shown.sides.loc[side]
        label = NAMES[side] if row["count"] else f"{NAMES[side]} (no contact)"
        forces.plot(time, shown.force[inside, i], **look | {"marker": ""}, label=label, zorder=3)
        if row["count"]:
            _mark_peak(forces, row["peak_s"] - shown.first, row["peak_n"], look, BEYOND * highest)
        if side != "ring" and row["count"]:
            area, look = shown.area[inside, i], look | {"linestyle": "none", "markersize": 2.5}
            areas.plot(time[area > 0], area[area > 0], **look, label=NAMES[side])
    # entries for what the single marks and the dashed lines mean
    forces.plot([], [], color="0.3", linestyle="none", marker="D", label="largest of all time steps")
    forces.plot([], [], **PRINTED, marker="", linewidth=0.6, label="printed event")
    _mark_printed(forces, areas, printed_times(ring, shown.turn))
    what = f"Connector {shown.connector} in groove {shown.groove}, {ring_words(scene['ring_radius'])}"
    text = f"{what}, {scene['motor_rpm']:g} rpm; a turn of the sprocket takes {shown.turn:.3f} s"
    figure.suptitle(text, x=0.01, ha="left")
    for ax, letter in ((forces, "(a)"), (areas, "(b)")):
        ax.text(-0.085, 1.0, letter, transform=ax.transAxes, va="top")
    forces.set(ylabel="normal force (N)", ylim=(-0.03 * highest, 1.55 * highest))  # room for the legend
    areas.set(ylabel="number of the\ntouched area", yticks=range(1, 11), ylim=(0.3, 10.7))
    areas.set(xlabel="time since the first contact (s)", xlim=(low, high))
    forces.legend(loc="upper center", ncols=3)
    if areas.get_legend_handles_labels()[0]:
        areas.legend(loc="upper center", ncols=2, markerscale=2)
    return figure


def _mark_peak(ax: Axes, time: float, force: float, look: dict, limit: float) -> None:
    """The largest force of all time steps: a mark, or above the limit an arrow at the edge with its value."""
    if force <= limit:
        mark = {"linestyle": "none", "markersize": 6, "markeredgecolor": "white", "markeredgewidth": 0.6}
        ax.plot(time, force, **look | mark, zorder=4)
        return
    box = {"boxstyle": "square,pad=0.25", "facecolor": "white", "edgecolor": look["color"], "linewidth": 0.8}
    place = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points", "zorder": 5}
    arrow = {"arrowstyle": "-|>", "color": look["color"], "linewidth": 1.4}
    label = f"{force:.0f} N\nat {time:.3f} s".replace("-", "\N{MINUS SIGN}")
    text = ax.annotate(label, (time, 1.0), (8, -27), **place, bbox=box, color=BLACK, fontsize=7, va="center")
    ax.annotate("", (0.1, 1.95), (0.1, 1.1), xycoords=text, zorder=5, arrowprops=arrow | {"shrinkA": 0, "shrinkB": 0})


def _joined(names: list[str]) -> str:
    """Names of simultaneous events: in one line if they differ in one word, else one under the other."""
    words = [name.split() for name in names]
    if len(words) == 2 and len(words[0]) == len(words[1]):
        pairs = list(zip(*words, strict=True))
        if sum(one != other for one, other in pairs) == 1:
            return " ".join(one if one == other else f"{one} and {other}" for one, other in pairs)
    return ",\n".join(names)


def _mark_printed(top: Axes, bottom: Axes, times: dict[str, float]) -> None:
    """Dashed lines in both axes, their names on a slant above the upper one."""
    turn = 60 * printed.TRANSMISSION_RATIO.value / 115
    groups: list[tuple[float, list[str]]] = []
    for event, time in sorted(times.items(), key=lambda item: item[1]):
        if groups and time - groups[-1][0] < NEAR * turn:
            groups[-1][1].append(event)
        else:
            groups.append((time, [event]))
        for ax in (top, bottom):
            ax.axvline(time, **PRINTED, linewidth=0.6, zorder=2)
    look = {"rotation": 42, "rotation_mode": "anchor", "ha": "left", "va": "center", "fontsize": 7, "linespacing": 1.3}
    for time, names in groups:
        text = _joined(names)
        place = {"xycoords": ("data", "axes fraction"), "xytext": (2, 9 if "\n" in text else 5)}
        top.annotate(text, (time, 1.0), **place, textcoords="offset points", **look)

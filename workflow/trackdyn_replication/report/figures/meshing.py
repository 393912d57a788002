"""Figures 19 and 21: contact forces and areas of one connector on its way around the sprocket."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D

from trackdyn.inputs.errors import InputError
from trackdyn.measure.contacts import contacts, passages
from trackdyn.measure.events import mean_events
from trackdyn.model.arrays import SIDE_WORDS, SIDES
from trackdyn.plots.drawing import ring_words
from trackdyn.plots.style import BLACK, BLUE, GREEN, PRINTED, PURPLE, SMALL, new_figure, styled
from trackdyn.simulation.recording import Recording
from trackdyn_replication.paper import published
from trackdyn_replication.paper.measures import MAXIMUM
from trackdyn_replication.report.marks import HALO

LOOKS = {
    "left": {"color": BLUE, "linestyle": "-", "marker": "o"},
    "right": {"color": PURPLE, "linestyle": (0, (5, 1.5)), "marker": "s"},
    "ring": {"color": GREEN, "linestyle": (0, (6, 1.5, 1, 1.5)), "marker": "^"},
}
NAMES = dict(zip(SIDES, SIDE_WORDS, strict=True)) | {"ring": "link ahead on the ring"}
BEFORE, AFTER = 0.05, 0.05  # shown before the first and after the last contact, turns
# printed event: the measured one; maxima are defined as in claims
MEASURED = {
    "first contact of the right arc": "first right", "first contact of the left arc": "first left",
    "right contact gone": "right gone", "out of engagement": "out", "ring first touched": "ring touched",
    "ring left": "ring left",
}  # fmt: skip
HERE = {"color": BLACK, "linestyle": "none", "marker": "o", "markersize": 4.5}
STEP = HERE | {"marker": "x", "markersize": 4}
IN_PRINT = HERE | {"marker": "D", "markerfacecolor": "white", "markersize": 5.5}
BARE_BOX = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
EVENTS = "(c) events: printed / here (/ largest single step), s"
BEYOND = 1.25  # times the highest point of the curves: larger single steps are written, not drawn


@dataclass(frozen=True)
class Selected:
    """Passage of a connector over the sprocket."""

    connector: int  # 1-based
    groove: int  # its groove, 1 to m
    number: int  # index of the passage in the record
    first: float  # first contact, s since the beginning of the record
    last: float  # last contact, s since the beginning of the record
    turn_s: float  # time of a sprocket turn, s
    sides: pd.DataFrame  # rows of :func:`trackdyn.measure.contacts.passages`, by side
    force: np.ndarray  # (s, 3) left arc, right arc, link ahead on the ring, N
    area: np.ndarray  # (s, 2) areas of the arcs, 0 without contact
    time: np.ndarray  # (s,) s since the first contact


def select_passage(recording: Recording) -> Selected:
    """Select the complete passage nearest to the middle of the record whose contacts are all recorded.

    Raises `InputError`: the record holds no such passage.
    """
    columns = {int(pitch): i for i, pitch in enumerate(recording.pitches)}
    ahead = {pitch: recording.scene.rig.link_ahead(pitch) for pitch in columns}  # the link, of a connector
    ring = recording.scene.ring_radius is not None
    # one whose link ahead is recorded, too: the same connector with a ring and without one
    connectors = [pitch for pitch in columns if ahead[pitch] in columns] or ([] if ring else list(columns))
    table = passages(recording)
    table = table[table["connector"].isin(connectors)]
    if table.empty:
        reason = "the record holds no complete passage over the sprocket"
        raise InputError(f"{reason}; simulate two loop revolutions or more")
    groups = table.groupby("passage")
    start, end = groups["start_s"].min(), groups["end_s"].max()
    number = int((start + end - recording.seconds).abs().idxmin())
    sides = groups.get_group(number).set_index("side")
    first, last, connector = float(start[number]), float(end[number]), int(sides["connector"].iloc[0])
    force = recording.force[:, columns[connector]].copy()
    if ring:
        force[:, 2] = recording.force[:, columns[ahead[connector]], 2]
    touching = contacts(recording)
    grooves = touching["groove"][(touching["passage"] == number) & (touching["groove"] > 0)]
    groove = int(grooves[0]) if len(grooves) else 0
    area, time, turn_s = recording.area[:, columns[connector]], recording.time - first, recording.periods.turn
    return Selected(connector, groove, number, first, last, turn_s, sides, force, area, time)


def printed_times(ring: bool, turn_s: float) -> dict[str, float]:
    """Return printed times of events after the first printed contact, s, scaled to the speed of the sprocket."""
    times = published.EVENTS_WITH_RING if ring else published.EVENTS_WITHOUT_RING
    first = min(time for event, time in times.items() if "first" in event)
    scale = turn_s * 115 / (60 * published.TRANSMISSION_RATIO)
    return {event: (time - first) * scale for event, time in times.items()}


def printed_and_measured_times(recording: Recording) -> pd.DataFrame:
    """Return the printed and the measured times of the paper's events, in its order; C16 and C17 are judged by them.

    ``printed, here, step`` are s since the first contact, medians over all passages. A maximum is that of the mean over
    0.01 s, and of the largest single step in ``step``. NaN: none.
    """
    ring = recording.scene.ring_radius is not None
    times = mean_events(recording).set_index("event")["median_s"]
    rows = {}
    for event, time in printed_times(ring, recording.periods.turn).items():
        name = "left touches" if ring and event == "first contact of the left arc" else MEASURED.get(event, event)
        step = times.get(name, np.nan) if name.endswith("maximum") else np.nan
        rows[event] = {"printed": time, "here": times.get(name.replace("maximum", MAXIMUM), np.nan), "step": step}
    return pd.DataFrame(rows).T


@styled
def passage_figure(recording: Recording) -> Figure:
    """Draw forces (a), areas (b) and events (c) of a connector over a passage: Figure 19, with a ring Figure 21.

    Measured and printed events (c) are counted from the first contact. Single marks in (a) are the largest
    force of all time steps; one far above the curves is an arrow at the upper edge with its value.
    """
    shown = select_passage(recording)
    scene = recording.scene
    ring = scene.ring_radius is not None
    low, high = -BEFORE * shown.turn_s, shown.last - shown.first + AFTER * shown.turn_s
    inside = (shown.time >= low) & (shown.time <= high)
    time = shown.time[inside]
    figure = new_figure(6.2)
    forces, areas, times = figure.subplots(3, 1, sharex=True, height_ratios=(1.8, 0.8, 1.3))
    sides = SIDES if ring else SIDES[:2]
    highest = max(shown.force[inside, : len(sides)].max(), 1.0)
    peaks: list[Line2D] = []
    beyond = 0  # arrows, whose labels stand below each other
    for i, side in enumerate(sides):
        look, row = LOOKS[side], shown.sides.loc[side]
        label = NAMES[side] if row["count"] else f"{NAMES[side]} (no contact)"
        forces.plot(time, shown.force[inside, i], **look | {"marker": ""}, label=label, zorder=3)
        if row["count"]:
            mark = {"linestyle": "none", "markersize": 6, "markeredgecolor": "white", "markeredgewidth": 0.6}
            if row["peak_n"] > BEYOND * highest:
                _point_at(forces, NAMES[side], row["highest_s"] - shown.first, row["peak_n"], look, beyond)
                beyond += 1
            else:
                peaks.append(Line2D([], [], **look | mark))
                forces.plot(row["highest_s"] - shown.first, row["peak_n"], **look | mark, zorder=4)
        if side != "ring" and row["count"]:
            area = shown.area[inside, i]
            areas.plot(time[area > 0], area[area > 0], **look | {"linestyle": "none", "markersize": 2.5})
    times.set_xlim(low, high)
    _draw_events(times, printed_and_measured_times(recording), (forces, areas))
    title = f"Connector {shown.connector} in groove {shown.groove}, {ring_words(scene.ring_radius)}"
    figure.suptitle(f"{title}, {scene.motor_rpm:g} rpm; a sprocket turn takes {shown.turn_s:.3f} s", x=0.01, ha="left")
    for ax, title in ((forces, "(a) forces"), (areas, "(b) areas of the groove"), (times, EVENTS)):
        ax.set_title(title)
    forces.set(ylabel="normal force (N)", ylim=(-0.03 * highest, 1.45 * highest))
    areas.set(ylabel="area\n(1 to 10)", yticks=sorted({*map(int, np.unique(shown.area[inside]))} - {0}), ylim=(0, 11))
    times.set_xlabel("time since the first contact (s)")
    curves, labels = forces.get_legend_handles_labels()
    handles, names = times.get_legend_handles_labels()
    handles = [*curves, *([tuple(peaks)] if peaks else []), *handles]
    labels += [*(["largest of all time steps"] if peaks else []), *names]
    spread = {tuple: HandlerTuple(ndivide=None, pad=0.6)}
    figure.legend(handles, labels, handler_map=spread, loc="outside lower center", ncols=2)
    return figure


def _point_at(ax: Axes, name: str, time: float, force: float, look: dict, line: int) -> None:
    """Draw an arrow at the upper edge for a single time step that is far above the curves, with its value."""
    arrow = {"arrowstyle": "-|>", "color": look["color"], "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0}
    edge = ("data", "axes fraction")
    ax.annotate("", (time, 1.0), (time, 0.84), xycoords=edge, textcoords=edge, arrowprops=arrow, zorder=5)
    label = f"{name}: {force:.0f} N in one step"
    text = {"textcoords": "offset points", "va": "center", "fontsize": SMALL, "color": look["color"]}
    ax.annotate(label, (time, 0.94 - 0.09 * line), (6, 0), xycoords=edge, **text, path_effects=HALO, zorder=5)


def _draw_events(ax: Axes, times: pd.DataFrame, others) -> None:
    """Draw a row per event: printed and measured time on one line, with numbers where there is room."""
    for y, (_, row) in enumerate(times.iterrows()):
        known = row.dropna()
        ax.plot([known.min(), known.max()], [y, y], color="0.6", linestyle="-", linewidth=1.0)
        for name, look in (("printed", IN_PRINT), ("here", HERE), ("step", STEP)):
            ax.plot(row[name], y, **look, zorder=4)
        for other in others:
            other.axvline(row["printed"], **PRINTED, linewidth=0.5, zorder=2)
        text = " / ".join(f"{value:.{digits}f}" for value, digits in zip(known, (2, 3, 3), strict=False))
        places = np.array([ax.get_xlim()[0], *sorted(known), ax.get_xlim()[1]])
        widest = int(np.argmax(np.diff(places)))
        end = {0: (places[1], -7, "right"), len(known): (places[-2], 7, "left")}
        position, gap, side = end.get(widest, (places[widest : widest + 2].mean(), 0, "center"))
        look = {"textcoords": "offset points", "va": "center", "ha": side, "fontsize": SMALL, "bbox": BARE_BOX}
        ax.annotate(text.replace("-", "\N{MINUS SIGN}"), (position, y), (gap, 0), **look)
    names = [event.replace("first contact of the", "first contact,") for event in times.index]
    ax.set_yticks(range(len(times)), names)
    ax.set_ylim(len(times) - 0.4, -0.6)
    ax.grid(False)
    labels = ("printed event", "event here (maximum: of the mean over 0.01 s)", "maximum: largest single step")
    for look, label in zip((IN_PRINT | PRINTED | {"linewidth": 0.5}, HERE, STEP), labels, strict=True):
        ax.plot([], [], **look, label=label)

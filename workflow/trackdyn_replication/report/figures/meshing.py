"""Figures 19 to 22: forces and areas of one connector on its way around the sprocket, and drawings of its events."""

from trackdyn.sweeps.snakemake_job import run_job

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
import scipy
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch
from matplotlib.patheffects import withStroke

from trackdyn.inputs.errors import InputError
from trackdyn.measure.contacts import contacts, passages
from trackdyn.measure.events import RESOLUTION, mean_events, passage_events
from trackdyn.model.arrays import SIDE_WORDS, SIDES
from trackdyn.plots import drawing
from trackdyn.plots.style import BLACK, BLUE, GREEN, PAGE, PRINTED, PURPLE, SMALL, new_figure, save, styled
from trackdyn.rig.rig import Rig
from trackdyn.simulation.recording import Recording, load_recording
from trackdyn_replication.paper import published
from trackdyn_replication.paper.measures import MAXIMUM
from trackdyn_replication.report import marks

LOOKS = {
    "left": {"color": BLUE, "linestyle": "-", "marker": "o"},
    "right": {"color": PURPLE, "linestyle": (0, (5, 1.5)), "marker": "s"},
    "ring": {"color": GREEN, "linestyle": (0, (6, 1.5, 1, 1.5)), "marker": "^"},
}
NAMES = dict(zip(SIDES, SIDE_WORDS, strict=True)) | {"ring": "link ahead on the ring"}
AROUND = 0.05  # shown before the first and after the last contact, turns
LEFT_ARC = "first contact of the left arc"
# printed event: the measured one; maxima are defined as in claims
MEASURED = {
    "first contact of the right arc": "first right", LEFT_ARC: "first left",
    "right contact gone": "right gone", "out of engagement": "out", "ring first touched": "ring touched",
    "ring left": "ring left",
}  # fmt: skip
HERE = {"color": BLACK, "linestyle": "none", "marker": "o", "markersize": 4.5}
STEP = HERE | {"marker": "x", "markersize": 4}
IN_PRINT = HERE | {"marker": "D", "markerfacecolor": "white", "markersize": 5.5}
BARE_BOX = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
EVENTS = "(c) events: printed / here (/ largest single step), s"
BEYOND = 1.25  # times the highest point of the curves: larger single steps are written, not drawn
# screenshots
HALF = 0.13  # half the side of a panel, m
BAR = 0.085  # scale bar of the forces, m
LABEL = np.array([0.025, 0.009])  # half of the width and of the height of a force in figures, m
# panels in the order of the paper: title, event of the passage, printed event
ENGAGE, BOTH = "about to engage", "both arcs in contact"
WITHOUT_RING = (
    (ENGAGE, None, ENGAGE), (BOTH, None, LEFT_ARC), ("left maximum", None, "left maximum"),
    ("right maximum", None, "right maximum"), ("only the left arc", "right gone", "right contact gone"),
    ("out of engagement", "out", "out of engagement"),
)  # fmt: skip
WITH_RING = (
    ("link ahead on the ring", "ring touched", "ring first touched"), ("ring maximum", None, "ring maximum"),
    ("left arc touches", "left touches", LEFT_ARC), ("left maximum", None, "left maximum"),
    ("ring left", "ring left", "ring left"), ("out of engagement", "out", "out of engagement"),
)  # fmt: skip


@dataclass(frozen=True)
class Selected:
    """Passage of a connector over the sprocket."""

    connector: int  # 1-based
    groove: int  # its groove, 1 to m
    number: int  # index of the passage in the record
    first: float  # first contact, s since the beginning of the record
    last: float  # last contact, s since the beginning of the record
    sides: pd.DataFrame  # rows of :func:`trackdyn.measure.contacts.passages`, by side
    force: np.ndarray  # (s, 3) left arc, right arc, link ahead on the ring, N
    area: np.ndarray  # (s, 2) areas of the arcs, 0 without contact
    time: np.ndarray  # (s,) s since the first contact


def select_passage(recording: Recording) -> Selected:
    """Select the complete passage nearest to the middle of the record whose contacts are all recorded."""
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
    area, time = recording.area[:, columns[connector]], recording.time - first
    return Selected(connector, groove, number, first, last, sides, force, area, time)


def printed_times(recording: Recording) -> dict[str, float]:
    """Return printed times of events after the first printed contact, s, scaled to the speed of the sprocket."""
    ring = recording.scene.ring_radius is not None
    times = published.EVENTS_WITH_RING if ring else published.EVENTS_WITHOUT_RING
    first = min(time for event, time in times.items() if "first" in event)
    scale = recording.periods.turn * 115 / (60 * published.TRANSMISSION_RATIO)
    return {event: (time - first) * scale for event, time in times.items()}


def printed_and_measured_times(recording: Recording) -> pd.DataFrame:
    """Return times of events, s: ``printed``, ``here`` (a maximum: of a mean), and of the largest single ``step``."""
    times = mean_events(recording).set_index("event")["median_s"]
    names = MEASURED if recording.scene.ring_radius is None else MEASURED | {LEFT_ARC: "left touches"}
    rows = {}
    for event, time in printed_times(recording).items():
        name = names.get(event, event)
        step = times.get(name, np.nan) if name.endswith("maximum") else np.nan
        rows[event] = {"printed": time, "here": times.get(name.replace("maximum", MAXIMUM), np.nan), "step": step}
    return pd.DataFrame(rows).T


@styled
def passage_figure(recording: Recording) -> Figure:
    """Draw forces (a), areas (b) and events (c) of a connector over a passage: Figure 19, with a ring Figure 21."""
    shown, scene, turn = select_passage(recording), recording.scene, recording.periods.turn
    low, high = -AROUND * turn, shown.last - shown.first + AROUND * turn
    inside = (shown.time >= low) & (shown.time <= high)
    time = shown.time[inside]
    figure = new_figure(6.2)
    forces, areas, times = figure.subplots(3, 1, sharex=True, height_ratios=(1.8, 0.8, 1.3))
    sides = SIDES[:2] if scene.ring_radius is None else SIDES
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
    times.set(xlim=(low, high), xlabel="time since the first contact (s)")
    _draw_events(times, printed_and_measured_times(recording), (forces, areas))
    title = f"Connector {shown.connector} in groove {shown.groove}, {drawing.ring_words(scene.ring_radius)}"
    figure.suptitle(f"{title}, {scene.motor_rpm:g} rpm; a sprocket turn takes {turn:.3f} s", x=0.01, ha="left")
    for ax, title in ((forces, "(a) forces"), (areas, "(b) areas of the groove"), (times, EVENTS)):
        ax.set_title(title)
    forces.set(ylabel="normal force (N)", ylim=(-0.03 * highest, 1.45 * highest))
    areas.set(ylabel="area\n(1 to 10)", yticks=sorted({*map(int, np.unique(shown.area[inside]))} - {0}), ylim=(0, 11))
    curves, labels = forces.get_legend_handles_labels()
    if peaks:
        curves.append(tuple(peaks))
        labels.append("largest of all time steps")
    handles, names = times.get_legend_handles_labels()
    spread = {tuple: HandlerTuple(ndivide=None, pad=0.6)}
    figure.legend([*curves, *handles], [*labels, *names], handler_map=spread, loc="outside lower center", ncols=2)
    return figure


def _point_at(ax: Axes, name: str, time: float, force: float, look: dict, line: int) -> None:
    """Draw an arrow at the upper edge for a single time step that is far above the curves, with its value."""
    arrow = {"arrowstyle": "-|>", "color": look["color"], "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0}
    edge = ("data", "axes fraction")
    ax.annotate("", (time, 1.0), (time, 0.84), xycoords=edge, textcoords=edge, arrowprops=arrow, zorder=5)
    label = f"{name}: {force:.0f} N in one step"
    text = {"textcoords": "offset points", "va": "center", "fontsize": SMALL, "color": look["color"]}
    ax.annotate(label, (time, 0.94 - 0.09 * line), (6, 0), xycoords=edge, **text, path_effects=marks.HALO, zorder=5)


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


class Moment(NamedTuple):
    """Content of a panel; times in s since the first contact."""

    title: str  # name of the event
    time: float  # here
    printed: float  # in the paper
    frame: int  # the configuration drawn
    sample: int  # of the same instant
    peak: str  # at a maximum: the largest force of all time steps with its time


def moments(recording: Recording, selected: Selected) -> list[Moment]:
    """Return the events of a passage that occur, in the order of the paper."""
    ring = recording.scene.ring_radius is not None
    printed = printed_times(recording)
    # a configuration is of the end of its interval, as a sample is
    frames = recording.frame_time - selected.first
    measured = passage_events(recording).loc[selected.number]
    both = max(measured.get("first left", 0.0), measured.get("first right", 0.0))
    special = {ENGAGE: printed.get(ENGAGE), BOTH: both}
    inside, chosen = (selected.time >= 0) & (selected.time <= selected.last - selected.first), []
    for title, event, index in WITH_RING if ring else WITHOUT_RING:
        side, _, phase = title.partition(" ")
        if phase == "maximum":
            row = selected.sides.loc[side]
            if not row["count"]:
                continue
            width = max(round(RESOLUTION * recording.rate), 1)
            force = scipy.ndimage.uniform_filter1d(selected.force[:, SIDES.index(side)], width)
            time = float(selected.time[inside][np.argmax(force[inside])])
            frame = int(np.argmin(np.abs(frames - time)))
            peak = f"largest {row['peak_n']:.0f} N at {row['highest_s'] - selected.first:.3f} s"
        else:
            time, peak = special[title] if event is None else measured[event], ""
            # the first at or after it: a contact that begins is there, one that ends is gone
            frame = min(int(np.searchsorted(frames, time - 1e-9)), len(frames) - 1)
        if np.isfinite(time):
            sample = round(recording.frame_time[frame] * recording.rate) - 1
            chosen.append(Moment(title, time, printed[index], frame, sample, peak))
    return chosen


@styled
def screenshot_figure(recording: Recording) -> Figure:
    """Draw six recorded configurations at the events of a passage: Figure 20, with a ring Figure 22."""
    selected = select_passage(recording)
    panels = moments(recording, selected)
    figure = new_figure(6.6, PAGE)
    axes = figure.subplots(2, 3).ravel()
    for ax in axes:
        ax.set_axis_off()
    for ax, letter, moment in zip(axes, "abcdef", panels, strict=False):
        _draw_panel(ax, recording, selected, moment)
        text = f"({letter}) {moment.title}\n{moment.time:.3f} s (printed {moment.printed:.2f} s)\n{moment.peak}"
        ax.set_title(text.replace("-", "\N{MINUS SIGN}"), fontsize=8)
    ring, rpm = recording.scene.ring_radius, recording.scene.motor_rpm
    late = max(abs(recording.frame_time[m.frame] - selected.first - m.time) for m in panels)
    text = (
        f"Connector {selected.connector}, {drawing.ring_words(ring)}, {rpm:g} rpm; times since the first contact. "
        f"Panels are {2 * HALF:.2f} m wide.\nMaxima: of the mean over {RESOLUTION:g} s. "
        f"Arrows: forces at the instant drawn, at most {1000 * late:.1f} ms from the event.\n "
    )
    figure.suptitle(text, x=0.01, ha="left", fontsize=8)
    handles: list = [Patch(**drawing.MARKED, label=f"connector {selected.connector}")]
    if ring is not None:
        ahead = recording.scene.rig.link_ahead(selected.connector)
        handles.append(Patch(**drawing.MARKED_TOO, label=f"link {ahead}, ahead of it"))
    for side in SIDES[: 2 if ring is None else 3]:
        if selected.sides.loc[side, "count"]:
            look = LOOKS[side] | {"linestyle": "-", "markersize": 4, "linewidth": 1.6}
            handles.append(marks.handle(f"force, {NAMES[side]}", **look))
    handles.append(marks.handle("joint of two areas", **drawing.JOINT))
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=7.5)
    return figure


def _draw_panel(ax: Axes, recording: Recording, selected: Selected, moment: Moment) -> None:
    frame, rig, ring = recording.frame[moment.frame], recording.scene.rig, recording.scene.ring_radius
    pins, _, sprocket_angle = chain = drawing.chain_points(rig, frame)
    connector, link = 2 * selected.connector - 1, 2 * selected.connector % (2 * rig.chain.pitches)
    bodies = [connector] if ring is None else [connector, link]
    middle = np.mean([pins[body + end] for body in bodies for end in (0, 1)], axis=0)
    # the small picture is in the corner away from the sprocket and from the arrows
    up = middle[1] > rig.sprocket.y
    right = middle[0] > rig.sprocket.x + 0.5 * rig.groove_profile.addendum * up
    inset = ax.inset_axes((0.74 * right, 0.74 * up, 0.26, 0.26), zorder=drawing.Z_MARK + 2)
    for area, groove in ((ax, selected.groove), (inset, None)):
        drawing.draw_sprocket(area, rig, sprocket_angle, ring, groove)
        marked = dict(zip(bodies, (drawing.MARKED, drawing.MARKED_TOO), strict=False))
        drawing.draw_chain(area, rig, frame, highlight=marked)
        area.set(aspect="equal", xticks=[], yticks=[])
        area.grid(False)
    ax.set_axis_on()
    drawing.view(ax, middle, HALF)
    drawing.draw_force_bar(ax, BAR, 0.03 if right or up else 0.97 - 0.5 * BAR / HALF)
    grooves = (selected.groove, selected.groove)
    bodies_at = (None if ring is None else link, selected.force[moment.sample], selected.area[moment.sample], grooves)
    for side, force, point, normal in contacts_at(rig, chain, connector, *bodies_at):
        end = point + drawing.force_arrow(force, BAR) * normal
        draw_force(ax, side, point, end)
        box = {"boxstyle": "square,pad=0.15", "facecolor": "white", "edgecolor": LOOKS[side]["color"], "linewidth": 0.8}
        beyond = end + (np.abs(normal) @ LABEL + 0.004) * normal
        position = np.clip(beyond, middle - HALF + LABEL, middle + HALF - LABEL)
        look = {"ha": "center", "va": "center", "fontsize": 7, "bbox": box, "clip_on": True}
        ax.text(*position, f"{force:.0f} N", **look, zorder=drawing.Z_MARK + 1.5)
    drawing.view(inset, drawing.sprocket_centre(rig), 1.35 * rig.groove_profile.addendum)
    inset.add_patch(Circle(middle, 0.09, fill=False, edgecolor=BLACK, linewidth=1.2, zorder=drawing.Z_MARK))


def contacts_at(rig: Rig, chain: tuple, connector: int, link: int | None, force, area, groove) -> Iterator[tuple]:
    """Yield side, force (N), point (m) and normal of contacts of a connector with teeth, of a link with the ring."""
    (pins, angles, sprocket_angle), shape = chain, rig.groove_profile
    for i, side in enumerate(("left", "right")):
        if area[i]:
            touched = int(area[i]) - 1
            centre = drawing.groove_points(rig, sprocket_angle, int(groove[i]), [shape.centre[touched]])[0]
            outward = marks.directions(centre, pins[connector + i])[0]
            normal = outward if shape.convex[touched] else -outward
            yield side, force[i], centre + shape.radius[touched] * outward, normal
    if link is not None and force[2] > 0:  # at the point of the link that is closest to the sprocket's centre
        centre = drawing.sprocket_centre(rig)
        along = float((centre - pins[link]) @ marks.polar(angles[link]))
        foot = [[np.clip(along, 0.0, rig.chain.link_length), -rig.chain.link_thickness / 2]]
        point = drawing.placed(foot, pins[link], angles[link])[0]
        yield "ring", force[2], point, marks.directions(centre, point)[0]


def draw_force(ax: Axes, side: str, point, end, linewidth=1.6, head=7.0, halo=3.0, mark=4.0) -> None:
    """Draw the arrow of a normal force from its point of contact, which has the mark of the side."""
    colour, effects = LOOKS[side]["color"], [withStroke(linewidth=halo, foreground="white")]
    look = {"color": colour, "linewidth": linewidth, "mutation_scale": head, "zorder": drawing.Z_MARK + 1}
    marks.arrow(ax, point, end, **look, path_effects=effects)
    edge = {"markersize": mark, "markeredgecolor": "white", "markeredgewidth": 0.5}
    ax.plot(*point, marker=LOOKS[side]["marker"], color=colour, zorder=drawing.Z_MARK + 1.2, **edge)


@run_job
def main(job) -> None:
    """Rule `meshing_figures`."""
    inputs, out = job.input, job.output
    for path, passage, screenshots in ((inputs.no_ring, out.fig19, out.fig20), (inputs.ring, out.fig21, out.fig22)):
        recording = load_recording(path)
        save(passage_figure(recording), passage[0])
        save(screenshot_figure(recording), screenshots[0])

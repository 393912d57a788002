"""Figures 20 and 22: drawings of a connector and its link ahead at the events of one passage."""

from trackdyn.sweeps.snakemake_job import run_job

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch
from matplotlib.patheffects import withStroke
from scipy.ndimage import uniform_filter1d

from trackdyn.measure.events import RESOLUTION, passage_events
from trackdyn.model.arrays import SIDES
from trackdyn.plots import drawing
from trackdyn.plots.style import BLACK, PAGE, new_figure, save, styled
from trackdyn.rig.rig import Rig
from trackdyn.simulation.recording import Recording, load_recording
from trackdyn_replication.report import marks
from trackdyn_replication.report.figures.meshing import (
    LOOKS,
    NAMES,
    Selected,
    passage_figure,
    printed_times,
    select_passage,
)

HALF = 0.13  # half the side of a panel, m
BAR = 0.085  # scale bar of the forces, m
LABEL = np.array([0.025, 0.009])  # half of the width and of the height of a force in figures, m
# panels in the order of the paper: title, event of the passage, printed event
ENGAGE, BOTH = "about to engage", "both arcs in contact"
WITHOUT_RING = (
    (ENGAGE, None, ENGAGE), (BOTH, None, "first contact of the left arc"), ("left maximum", None, "left maximum"),
    ("right maximum", None, "right maximum"), ("only the left arc", "right gone", "right contact gone"),
    ("out of engagement", "out", "out of engagement"),
)  # fmt: skip
WITH_RING = (
    ("link ahead on the ring", "ring touched", "ring first touched"), ("ring maximum", None, "ring maximum"),
    ("left arc touches", "left touches", "first contact of the left arc"), ("left maximum", None, "left maximum"),
    ("ring left", "ring left", "ring left"), ("out of engagement", "out", "out of engagement"),
)  # fmt: skip


class Moment(NamedTuple):
    """Content of a panel; times in s since the first contact."""

    title: str  # name of the event
    time: float  # here
    printed: float  # in the paper
    frame: int  # the configuration drawn
    sample: int  # of the same instant
    peak: str  # at a maximum: the largest force of all time steps with its time


def moments(recording: Recording, selected: Selected) -> list[Moment]:
    """Return the events of a passage that occur, in the order of the paper.

    A maximum is that of the force after a mean over 0.01 s, and its configuration the nearest one; of other
    events it is the first at or after it, so that a contact that begins is there and one that ends is gone.
    """
    ring = recording.scene.ring_radius is not None
    printed = printed_times(ring, selected.turn_s)
    # a configuration is of the end of its interval, as a sample is
    frames = recording.frame_time - selected.first
    measured = passage_events(recording).loc[selected.number]
    both = max(measured.get("first left", 0.0), measured.get("first right", 0.0))
    special = {ENGAGE: printed.get(ENGAGE), BOTH: both}
    inside, chosen = (selected.time >= 0) & (selected.time <= selected.last - selected.first), []
    for title, event, index in WITH_RING if ring else WITHOUT_RING:
        side, _, phase = title.partition(" ")
        maximum = phase == "maximum" and side in SIDES
        if maximum and not selected.sides.loc[side, "count"]:
            continue
        if maximum:
            force = uniform_filter1d(selected.force[:, SIDES.index(side)], max(round(RESOLUTION * recording.rate), 1))
            time = float(selected.time[inside][np.argmax(force[inside])])
        else:
            time = special[title] if event is None else measured[event]
        if not np.isfinite(time):
            continue
        peak, frame = "", min(int(np.searchsorted(frames, time - 1e-9)), len(frames) - 1)
        if maximum:
            row, frame = selected.sides.loc[side], int(np.argmin(np.abs(frames - time)))
            peak = f"largest {row['peak_n']:.0f} N at {row['highest_s'] - selected.first:.3f} s"
        sample = round(recording.frame_time[frame] * recording.rate) - 1
        chosen.append(Moment(title, time, printed[index], frame, sample, peak))
    return chosen


@styled
def screenshot_figure(rig: Rig, recording: Recording) -> Figure:
    """Draw six recorded configurations at the events of a passage: Figure 20, with a ring Figure 22.

    Every panel follows the connector; the small picture shows where on the sprocket it is. Arrows are the
    normal forces on connector and link at the instant drawn, on the scale of the bars; the ten areas of the connector's
    groove carry their numbers. Panels are in the order of the paper (:func:`moments`).
    """
    selected = select_passage(recording)
    panels = moments(recording, selected)
    figure = new_figure(6.6, PAGE)
    axes = figure.subplots(2, 3).ravel()
    for ax in axes:
        ax.set_axis_off()
    for ax, letter, moment in zip(axes, "abcdef", panels, strict=False):
        _draw_panel(ax, rig, recording, selected, moment)
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
        ahead = rig.link_ahead(selected.connector)
        handles.append(Patch(**drawing.MARKED_TOO, label=f"link {ahead}, ahead of it"))
    for side in SIDES[: 2 if ring is None else 3]:
        if selected.sides.loc[side, "count"]:
            look = LOOKS[side] | {"linestyle": "-", "markersize": 4, "linewidth": 1.6}
            handles.append(marks.handle(f"force, {NAMES[side]}", **look))
    handles.append(marks.handle("joint of two areas", **drawing.JOINT))
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=7.5)
    return figure


def _draw_panel(ax: Axes, rig: Rig, recording: Recording, selected: Selected, moment: Moment) -> None:
    frame, ring = recording.frame[moment.frame], recording.scene.ring_radius
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
    """Yield side, force (N), point (m) and normal of contacts of a connector with the teeth, of a link with the ring.

    ``chain`` is of :func:`chain_points`, bodies count from 0; forces, areas and grooves are those of left and right
    arc, and the ring's force is the third.
    """
    pins, angles, sprocket_angle = chain
    for i, side in enumerate(("left", "right")):
        if area[i]:
            yield side, force[i], *tooth_contact(rig, sprocket_angle, int(groove[i]), int(area[i]), pins[connector + i])
    if link is not None and force[2] > 0:
        yield "ring", force[2], *ring_contact(rig, pins[link], angles[link])


def tooth_contact(rig: Rig, sprocket_angle: float, groove: int, area: int, pin) -> tuple[np.ndarray, np.ndarray]:
    """Return the point where an area (1 to 10) touches the arc around a pin (m), and the normal of the force on it."""
    shape = rig.groove_profile
    centre = drawing.groove_points(rig, sprocket_angle, groove, [shape.centre[area - 1]])[0]
    outward = marks.directions(centre, pin)[0]
    return centre + shape.radius[area - 1] * outward, outward if shape.convex[area - 1] else -outward


def ring_contact(rig: Rig, pin, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the closest point of a link to the sprocket's centre (m), and the direction from the centre to it."""
    centre = drawing.sprocket_centre(rig)
    along = float((centre - pin) @ marks.polar(angle))
    foot = [[np.clip(along, 0.0, rig.chain.link_length), -rig.chain.link_thickness / 2]]
    point = drawing.placed(foot, pin, angle)[0]
    return point, marks.directions(centre, point)[0]


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
        save(screenshot_figure(recording.scene.rig, recording), screenshots[0])

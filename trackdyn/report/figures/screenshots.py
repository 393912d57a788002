"""Figures 20 and 22: drawings of a connector and its link ahead at the events of one passage."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch, Patch
from matplotlib.patheffects import withStroke
from scipy.ndimage import uniform_filter1d

from trackdyn.errors import InputError
from trackdyn.measure.meshing import SIDES, events
from trackdyn.parameters.rig import Rig
from trackdyn.recording import Recording
from trackdyn.report.drawing import (
    JOINT,
    MARKED,
    MARKED_TOO,
    Z_MARK,
    chain_points,
    draw_chain,
    draw_sprocket,
    groove_points,
    placed,
)
from trackdyn.report.figures.meshing import LOOKS, NAMES, Selected, printed_times, select_passage
from trackdyn.report.style import BLACK, new_figure, styled

HALF = 0.13  # of the side of a panel, m
LONGEST_ARROW = 0.085  # of the largest force in the figure, m
WINDOW = 0.01  # a maximum is of the force after a mean over it, as the paper prints its times, s
# panels: title, event of the passage, printed event
ENGAGE, BOTH = "about to engage", "both arcs in contact"
WITHOUT_RING = (
    (ENGAGE, None, ENGAGE),
    (BOTH, None, "first contact of the left arc"),
    ("left maximum", None, "left maximum"),
    ("right maximum", None, "right maximum"),
    ("only the left arc", "right gone", "right contact gone"),
    ("out of engagement", "out", "out of engagement"),
)
WITH_RING = (
    ("link ahead on the ring", "ring touched", "ring first touched"),
    ("ring maximum", None, "ring maximum"),
    ("left arc touches", "left touches", "first contact of the left arc"),
    ("left maximum", None, "left maximum"),
    ("ring left", "ring left", "ring left"),
    ("out of engagement", "out", "out of engagement"),
)


@dataclass(frozen=True)
class Moment:
    """What a panel shows.

    Attributes
    ----------
    title : str
        Name of the event.
    time, printed : float
        When it happens here and in the paper, s since the first contact.
    frame, sample : int
        The configuration drawn, and the sample of the same instant.
    peak : str
        Largest force of all time steps and its time, of a maximum.
    """

    title: str
    time: float
    printed: float
    frame: int
    sample: int
    peak: str


def moments(recording: Recording, shown: Selected) -> list[Moment]:
    """The events of a passage that happen, in order of time.

    A maximum is that of the force after a mean over 0.01 s, and its configuration the nearest one; of other
    events it is the first at or after it, so that a contact that begins is there and one that ends is gone.
    """
    ring = recording.meta["scene"]["ring_radius"] is not None
    printed = printed_times(ring, shown.turn)
    measured = events(recording, shown.number)
    own = {ENGAGE: printed.get(ENGAGE), BOTH: max(measured.get("first left", 0.0), measured.get("first right", 0.0))}
    found = []
    for title, event, place in WITH_RING if ring else WITHOUT_RING:
        side, _, what = title.partition(" ")
        maximum = what == "maximum" and side in SIDES
        if maximum and not shown.sides.loc[side, "count"]:
            continue
        time = _maximum(recording, shown, side) if maximum else own[title] if event is None else measured[event]
        if not np.isfinite(time):
            continue
        peak = ""
        if maximum:
            row = shown.sides.loc[side]
            peak = f"largest step {row['peak_n']:.0f} N at {row['peak_s'] - shown.first:.3f} s"
        frame = _frame_at(recording, shown, time, nearest=maximum)
        found.append(Moment(title, time, printed[place], frame, _sample(recording, frame), peak))
    return sorted(found, key=lambda moment: moment.time)


@styled
def screenshot_figure(rig: Rig, recording: Recording) -> Figure:
    """Six recorded configurations at the events of a passage: Figure 20, with a ring Figure 22.

    Every panel follows the connector; the small picture shows where on the sprocket it is. Arrows are the
    normal forces on connector and link at the instant drawn, on one scale; the ten areas of the connector's
    groove carry their numbers. Panels are in order of time (:func:`moments`).

    Parameters
    ----------
    rig : Rig
        Parameters; ``Rig.model_validate(recording.meta["rig"])``.
    recording : Recording
        Run with configurations, logged contacts and, with a ring, the link ahead recorded.

    Raises
    ------
    InputError
        If the recording holds no configurations or no such passage.
    """
    if len(recording.frame) == 0:
        raise InputError("the recording holds no configurations: simulate with a frame interval above 0")
    shown = select_passage(recording)
    panels = moments(recording, shown)
    largest = max(shown.force[moment.sample].max() for moment in panels)
    figure = new_figure(6.6)
    axes = figure.subplots(2, 3).ravel()
    for ax, letter in zip(axes, "abcdef", strict=True):
        ax.set_axis_off()
        ax.set_label(letter)
    for ax, moment in zip(axes, panels, strict=False):
        _draw_panel(ax, rig, recording, shown, moment, LONGEST_ARROW / max(largest, 1.0))
        text = f"({ax.get_label()}) {moment.title}\n{moment.time:.3f} s (printed {moment.printed:.2f} s)\n{moment.peak}"
        ax.set_title(text.replace("-", "\N{MINUS SIGN}"), fontsize=8)
    ring, rpm = (recording.meta["scene"][name] for name in ("ring_radius", "motor_rpm"))
    what = "no ring" if ring is None else f"ring {ring:.3f} m"
    late = max(abs(recording.frame_time[m.frame] - shown.first - m.time) for m in panels)
    text = (
        f"Connector {shown.connector}, {what}, {rpm:g} rpm; times since the first contact. "
        f"Panels are {2 * HALF:.2f} m wide.\nMaxima: of the mean over {WINDOW:g} s. "
        f"Arrows: forces at the instant drawn, at most {1000 * late:.1f} ms from the event.\n "
    )
    figure.suptitle(text, x=0.01, ha="left", fontsize=8)
    figure.legend(handles=_handles(rig, shown, ring), loc="outside lower center", ncols=3, fontsize=7.5)
    return figure


def _handles(rig: Rig, shown: Selected, ring: float | None) -> list:
    """Legend: the marked bodies, the forces, the joints."""
    handles: list = [Patch(**MARKED, label=f"connector {shown.connector}")]
    if ring is not None:
        handles.append(Patch(**MARKED_TOO, label=f"link {shown.connector % rig.chain.pitches + 1}, ahead of it"))
    for side in SIDES[: 2 if ring is None else 3]:
        if shown.sides.loc[side, "count"]:
            look = LOOKS[side] | {"linestyle": "-"}
            handles.append(Line2D([], [], **look, markersize=4, linewidth=1.6, label=f"force, {NAMES[side]}"))
    return [*handles, Line2D([], [], **JOINT, label="joint of two areas")]


def _maximum(recording: Recording, shown: Selected, side: str) -> float:
    """When the mean over ``WINDOW`` of a side's force is largest, s since the first contact."""
    force = uniform_filter1d(shown.force[:, SIDES.index(side)], max(round(WINDOW * recording.rate), 1))
    inside = (shown.time >= 0) & (shown.time <= shown.last - shown.first)
    return float(shown.time[inside][np.argmax(force[inside])])


def _frame_at(recording: Recording, shown: Selected, time: float, nearest: bool = False) -> int:
    """First configuration at or after a time since the first contact, or the nearest; the last if none is."""
    # like a sample, a configuration is of the end of its interval
    frame_time = recording.frame_time - shown.first
    if nearest:
        return int(np.argmin(np.abs(frame_time - time)))
    return int(min(np.searchsorted(frame_time, time - 1e-9), len(frame_time) - 1))


def _sample(recording: Recording, frame: int) -> int:
    return round(recording.frame_time[frame] * recording.rate) - 1


def _draw_panel(ax: Axes, rig: Rig, recording: Recording, shown: Selected, moment: Moment, scale: float) -> None:
    frame, ring = recording.frame[moment.frame], recording.meta["scene"]["ring_radius"]
    pins, _, sprocket_angle = chain_points(rig, frame)
    bodies = [2 * shown.connector - 1]
    if ring is not None:
        bodies.append(2 * shown.connector % (2 * rig.chain.pitches))
    middle = np.mean([pins[body + end] for body in bodies for end in (0, 1)], axis=0)
    # the small picture stands in the corner away from the sprocket and from the arrows
    up = middle[1] > rig.sprocket.y
    right = middle[0] > rig.sprocket.x + 0.5 * rig.groove_profile.addendum * up
    inset = ax.inset_axes((0.74 * right, 0.74 * up, 0.26, 0.26), zorder=Z_MARK + 2)
    for area, groove in ((ax, shown.groove), (inset, None)):
        draw_sprocket(area, rig, sprocket_angle, ring, groove)
        draw_chain(area, rig, frame, highlight=dict(zip(bodies, (MARKED, MARKED_TOO), strict=False)))
        area.set_aspect("equal")
        area.set_xticks([])
        area.set_yticks([])
        area.grid(False)
    ax.set_axis_on()
    ax.set_xlim(middle[0] - HALF, middle[0] + HALF)
    ax.set_ylim(middle[1] - HALF, middle[1] + HALF)
    _draw_forces(ax, rig, frame, shown, moment.sample, bodies, scale)
    centre, reach = np.array([rig.sprocket.x, rig.sprocket.y]), 1.35 * rig.groove_profile.addendum
    inset.set_xlim(centre[0] - reach, centre[0] + reach)
    inset.set_ylim(centre[1] - reach, centre[1] + reach)
    inset.add_patch(Circle(middle, 0.09, fill=False, edgecolor=BLACK, linewidth=1.2, zorder=Z_MARK))


def _draw_forces(ax: Axes, rig: Rig, frame, shown: Selected, sample: int, bodies: list[int], scale: float) -> None:
    """Arrows of the normal forces of a sample, from the point of contact."""
    pins, angles, sprocket_angle = chain_points(rig, frame)
    force, area = shown.force[sample], shown.area[sample]
    for i, side in enumerate(("left", "right")):
        if area[i]:
            contact = tooth_contact(rig, sprocket_angle, shown.groove, area[i], pins[bodies[0] + i])
            _arrow(ax, *contact, force[i], scale, side)
    if len(bodies) > 1 and force[2] > 0:
        _arrow(ax, *ring_contact(rig, pins[bodies[1]], angles[bodies[1]]), force[2], scale, "ring")


def tooth_contact(rig: Rig, sprocket_angle: float, groove: int, area: int, pin) -> tuple[np.ndarray, np.ndarray]:
    """Point where an area touches the arc around a pin, and the normal of the force on the arc.

    Parameters
    ----------
    rig : Rig
        Parameters.
    sprocket_angle : float
        rad.
    groove, area : int
        1 to m, 1 to 10.
    pin : (2,) array
        Centre of the connector's arc, m.
    """
    shape = rig.groove_profile
    centre = groove_points(rig, sprocket_angle, groove, [shape.centre[area - 1]])[0]
    outward = np.asarray(pin) - centre
    outward = outward / np.hypot(*outward)
    return centre + shape.radius[area - 1] * outward, outward if shape.convex[area - 1] else -outward


def ring_contact(rig: Rig, pin, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Point of a link nearest to the sprocket's centre, and the direction from that centre to it.

    Parameters
    ----------
    rig : Rig
        Parameters.
    pin : (2,) array
        Input pin of the link, m.
    angle : float
        Orientation of the link, rad.
    """
    centre = np.array([rig.sprocket.x, rig.sprocket.y])
    along = float((centre - pin) @ [np.cos(angle), np.sin(angle)])
    foot = [[np.clip(along, 0.0, rig.chain.link_length), -rig.chain.link_thickness / 2]]
    point = placed(foot, pin, angle)[0]
    return point, (point - centre) / np.hypot(*(point - centre))


def _arrow(ax: Axes, point, normal, force: float, scale: float, side: str) -> None:
    end = point + force * scale * normal
    colour = LOOKS[side]["color"]
    look = {"arrowstyle": "-|>", "mutation_scale": 7, "shrinkA": 0, "shrinkB": 0, "linewidth": 1.6}
    outline = [withStroke(linewidth=3, foreground="white")]
    ax.add_patch(FancyArrowPatch(point, end, color=colour, **look, zorder=Z_MARK + 1, path_effects=outline))
    mark = {"marker": LOOKS[side]["marker"], "markersize": 4, "markeredgecolor": "white", "markeredgewidth": 0.5}
    ax.plot(*point, **mark, color=colour, zorder=Z_MARK + 1.2)
    box = {"boxstyle": "square,pad=0.15", "facecolor": "white", "edgecolor": colour, "linewidth": 0.8}
    low, high = np.transpose([ax.get_xlim(), ax.get_ylim()])
    place = np.clip(end + 0.014 * np.asarray(normal), low + [0.026, 0.01], high - [0.026, 0.01])
    look = {"fontsize": 7, "ha": "center", "va": "center", "bbox": box, "zorder": Z_MARK + 1.5, "clip_on": True}
    ax.text(*place, f"{force:.0f} N", **look)

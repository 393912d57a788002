"""Figures 20 and 22: drawings of a connector and its link ahead at the events of one passage."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrowPatch
from matplotlib.patheffects import withStroke

from trackdyn.errors import InputError
from trackdyn.measure.meshing import events
from trackdyn.parameters.rig import Rig
from trackdyn.recording import Recording
from trackdyn.report.drawing import Z_MARK, chain_points, draw_chain, draw_sprocket, groove_points, placed
from trackdyn.report.figures.meshing import LOOKS, Selected, printed_times, select_passage
from trackdyn.report.style import VERMILION, new_figure, styled

HALF = 0.115  # of the side of a panel, m
LONGEST_ARROW = 0.07  # of the largest force in the figure, m
# panels: title, event of the passage, printed event
ENGAGE = "about to engage"
WITHOUT_RING = (
    (ENGAGE, None, ENGAGE),
    ("both arcs in contact", "first left", "first contact of the left arc"),
    ("left maximum", "left maximum", "left maximum"),
    ("right maximum", "right maximum", "right maximum"),
    ("only the left arc", "right gone", "right contact gone"),
    ("out of engagement", "out", "out of engagement"),
)
WITH_RING = (
    ("link ahead on the ring", "ring touched", "ring first touched"),
    ("ring maximum", "ring maximum", "ring maximum"),
    ("left arc touches", "left touches", "first contact of the left arc"),
    ("left maximum", "left maximum", "left maximum"),
    ("ring left", "ring left", "ring left"),
    ("out of engagement", "out", "out of engagement"),
)


@styled
def screenshot_figure(rig: Rig, recording: Recording) -> Figure:
    """Six recorded configurations nearest after the events of a passage: Figure 20, with a ring Figure 22.

    Every panel follows the connector; the small picture shows where on the sprocket it is. Arrows are the
    normal forces on connector and link, on one scale; the ten areas of the connector's groove carry
    their numbers.

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
    ring = recording.meta["scene"]["ring_radius"]
    printed = printed_times(ring is not None, shown.turn)
    measured = events(recording, shown.number)
    panels = []
    for title, event, place in WITHOUT_RING if ring is None else WITH_RING:
        time = printed[place] if event is None else measured[event]
        if np.isfinite(time):
            side, _, what = title.partition(" ")
            peak = f", {shown.sides.loc[side, 'peak_n']:.0f} N" if what == "maximum" else ""
            panels.append((title + peak, time, printed[place], _frame_at(recording, shown, time)))
    largest = max(shown.force[_sample(recording, frame)].max() for *_, frame in panels)
    figure = new_figure(5.6)
    axes = figure.subplots(2, 3).ravel()
    for ax, letter in zip(axes, "abcdef", strict=True):
        ax.set_axis_off()
        ax.set_label(letter)
    for ax, (title, time, place, frame) in zip(axes, panels, strict=False):
        _draw_panel(ax, rig, recording, shown, frame, LONGEST_ARROW / max(largest, 1.0))
        text = f"({ax.get_label()}) {title}\n{time:.3f} s (printed {place:.2f} s)"
        ax.set_title(text.replace("-", "\N{MINUS SIGN}"))
    what = "no ring" if ring is None else f"ring {ring:.3f} m"
    rpm = recording.meta["scene"]["motor_rpm"]
    text = (
        f"Connector {shown.connector}, {what}, {rpm:g} rpm; times since the first contact.\n"
        f"Panels are {2 * HALF:.2f} m wide, first recorded after the event; arrows: forces at that instant."
    )
    figure.suptitle(text, x=0.01, ha="left", fontsize=9)
    return figure


def _frame_at(recording: Recording, shown: Selected, time: float) -> int:
    """First configuration at or after a time since the first contact, the last one if none is."""
    # like a sample, a configuration is of the end of its interval
    frame_time = recording.frame_time - shown.first
    return int(min(np.searchsorted(frame_time, time - 1e-9), len(frame_time) - 1))


def _sample(recording: Recording, frame: int) -> int:
    return round(recording.frame_time[frame] * recording.rate) - 1


def _draw_panel(ax: Axes, rig: Rig, recording: Recording, shown: Selected, index: int, scale: float) -> None:
    frame, ring = recording.frame[index], recording.meta["scene"]["ring_radius"]
    pins, _, sprocket_angle = chain_points(rig, frame)
    bodies = [2 * shown.connector - 1]
    if ring is not None:
        bodies.append(2 * shown.connector % (2 * rig.chain.pitches))
    middle = 0.5 * (pins[bodies[0]] + pins[bodies[0] + 1])
    # the small picture stands in the corner away from the sprocket
    right, up = middle > [rig.sprocket.x, rig.sprocket.y]
    inset = ax.inset_axes((0.72 * right, 0.72 * up, 0.28, 0.28), zorder=Z_MARK + 2)
    for area, groove in ((ax, shown.groove), (inset, None)):
        draw_sprocket(area, rig, sprocket_angle, ring, groove)
        draw_chain(area, rig, frame, highlight=bodies)
        area.set_aspect("equal")
        area.set_xticks([])
        area.set_yticks([])
    ax.set_axis_on()
    ax.grid(False)
    ax.set_xlim(middle[0] - HALF, middle[0] + HALF)
    ax.set_ylim(middle[1] - HALF, middle[1] + HALF)
    _draw_forces(ax, rig, recording, shown, index, bodies, scale)
    centre, reach = np.array([rig.sprocket.x, rig.sprocket.y]), 1.35 * rig.groove_profile.addendum
    inset.grid(False)
    inset.set_xlim(centre[0] - reach, centre[0] + reach)
    inset.set_ylim(centre[1] - reach, centre[1] + reach)
    inset.add_patch(Circle(middle, 0.07, fill=False, edgecolor=VERMILION, linewidth=1.2, zorder=Z_MARK))


def _draw_forces(ax, rig, recording, shown, index, bodies, scale):
    """Arrows of the normal forces, from the point of contact."""
    pins, angles, sprocket_angle = chain_points(rig, recording.frame[index])
    sample = _sample(recording, index)
    force, area = shown.force[sample], shown.area[sample]
    connector = bodies[0]
    for i, side in enumerate(("left", "right")):
        if area[i]:
            point, normal = tooth_contact(rig, sprocket_angle, shown.groove, area[i], pins[connector + i])
            _arrow(ax, point, normal, force[i], scale, side)
    if len(bodies) > 1 and force[2] > 0:
        point, normal = ring_contact(rig, pins[bodies[1]], angles[bodies[1]])
        _arrow(ax, point, normal, force[2], scale, "ring")


def tooth_contact(
    rig: Rig, sprocket_angle: float, groove: int, area: int, pin
) -> tuple[np.ndarray, np.ndarray]:
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
    look = {"arrowstyle": "-|>", "mutation_scale": 9, "shrinkA": 0, "shrinkB": 0, "linewidth": 1.6}
    outline = [withStroke(linewidth=3, foreground="white")]
    ax.add_patch(FancyArrowPatch(point, end, color=colour, **look, zorder=Z_MARK + 1, path_effects=outline))
    ax.plot(*point, marker="o", markersize=3, color=colour, zorder=Z_MARK + 1)
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.6}
    low, high = np.transpose([ax.get_xlim(), ax.get_ylim()])
    place = np.clip(end + 0.012 * np.asarray(normal), low + 0.018, high - 0.018)
    ax.text(
        *place,
        f"{force:.0f} N",
        color=colour,
        fontsize=7,
        ha="center",
        va="center",
        bbox=box,
        zorder=Z_MARK + 1.5,
        clip_on=True,
    )

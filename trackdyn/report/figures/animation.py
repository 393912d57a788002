"""The loop in motion as a small GIF, and still pictures of it, with the normal forces on every pitch."""

import os
from pathlib import Path

import numpy as np
from matplotlib.animation import PillowWriter
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch
from matplotlib.patheffects import withStroke

from trackdyn.errors import InputError
from trackdyn.parameters.rig import Rig
from trackdyn.recording import Recording
from trackdyn.report.drawing import Z_MARK, chain_points, draw_chain, draw_sprocket, draw_wheels
from trackdyn.report.figures.meshing import LOOKS
from trackdyn.report.figures.screenshots import ring_contact, tooth_contact
from trackdyn.report.style import styled

WIDTH, HEIGHT, DPI = 4.8, 6.4, 100  # of the GIF, inch and dots an inch: fits a phone held upright
INTERVAL = 0.04  # between pictures, s of the run
PACE = 2.0  # the GIF is slower than the run by this factor
LONGEST_ARROW, LONGEST_IN_LOOP = 0.12, 0.2  # in pictures of the sprocket and of the whole loop, m
NAMES = {"left": "left arc", "right": "right arc", "ring": "ring on link"}


def _rig(recording: Recording) -> Rig:
    if len(recording.frame) == 0:
        raise InputError("the recording holds no configurations: simulate with a frame interval above 0")
    rig = Rig.model_validate(recording.meta["rig"])
    if len(recording.pitches) < rig.chain.pitches:
        raise InputError(
            f"the recording holds the forces of {len(recording.pitches)} pitches: simulate with pitches 1 to "
            f"{rig.chain.pitches}"
        )
    return rig


def arrow_scale(recording: Recording, longest: float = LONGEST_ARROW) -> float:
    """Length of an arrow a newton, m/N: the same in a whole run, set by all but its rarest forces."""
    force = recording.force[recording.force > 0]
    return longest / max(float(np.quantile(force, 0.999)), 1.0) if force.size else 0.0


def draw_moment(
    ax: Axes, rig: Rig, recording: Recording, index: int, highlight=(), longest: float = LONGEST_ARROW
) -> None:
    """Wheels, chain and forces at one recorded configuration.

    Parameters
    ----------
    ax : Axes
        Where.
    rig : Rig
        Parameters.
    recording : Recording
        Run with configurations and all pitches recorded.
    index : int
        Which configuration.
    highlight : iterable of int
        Bodies drawn in a darker colour and hatched.
    longest : float
        Length of the arrow of the largest usual force, m.
    """
    frame = recording.frame[index]
    pins, angles, sprocket_angle = chain_points(rig, frame)
    draw_wheels(ax, rig, recording.meta["layout"]["tensioner_shift_m"])
    draw_sprocket(ax, rig, sprocket_angle, recording.meta["scene"]["ring_radius"])
    draw_chain(ax, rig, frame, highlight=highlight)
    # a configuration and a sample are both taken at the end of their interval
    sample = int(np.clip(round(recording.frame_time[index] * recording.rate) - 1, 0, len(recording.time) - 1))
    scale = arrow_scale(recording, longest)
    for column, pitch in enumerate(recording.pitches):
        link = 2 * (int(pitch) - 1)
        force = recording.force[sample, column]
        for i, side in enumerate(("left", "right")):
            area, groove = int(recording.area[sample, column, i]), int(recording.groove[sample, column, i])
            if area:
                contact = tooth_contact(rig, sprocket_angle, groove, area, pins[link + 1 + i])
                _draw_force(ax, *contact, min(force[i] * scale, 1.5 * longest), side)
        if force[2] > 0:
            _draw_force(ax, *ring_contact(rig, pins[link], angles[link]), min(force[2] * scale, 1.5 * longest), "ring")
    ax.set_aspect("equal")
    ax.set_axis_off()


def _draw_force(ax: Axes, point, normal, length: float, side: str, width: float = 1.5) -> None:
    colour, marker = LOOKS[side]["color"], LOOKS[side]["marker"]
    end = point + length * normal
    look = {"arrowstyle": "-|>", "mutation_scale": 5 * width, "shrinkA": 0, "shrinkB": 0, "linewidth": width}
    halo = [withStroke(linewidth=2.2 * width, foreground="white")]
    ax.add_patch(FancyArrowPatch(point, end, color=colour, zorder=Z_MARK + 1, path_effects=halo, **look))
    size = {"markersize": 2.6 * width, "markeredgecolor": "white", "markeredgewidth": 0.5}
    ax.plot(*point, marker=marker, color=colour, zorder=Z_MARK + 1.2, **size)


def _window(ax: Axes, low, high) -> None:
    """Limits that hold the box from ``low`` to ``high`` (m) and fill the axes at equal scales."""
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    box, paper = ax.get_position(original=True), ax.figure.get_size_inches()
    ratio = box.width * paper[0] / (box.height * paper[1])
    half = np.maximum(half, [half[1] * ratio, half[0] / ratio])
    ax.set_xlim(middle[0] - half[0], middle[0] + half[0])
    ax.set_ylim(middle[1] - half[1], middle[1] + half[1])


def _frame_loop(ax: Axes, rig: Rig, recording: Recording) -> None:
    pins = chain_points(rig, recording.frame[0])[0]
    margin = 0.2  # room for the arrows
    _window(ax, pins.min(axis=0) - margin, pins.max(axis=0) + margin)


def _frame_sprocket(ax: Axes, rig: Rig, recording: Recording) -> None:
    reach = 1.42 * rig.groove_profile.addendum
    _window(ax, [rig.sprocket.x - reach, rig.sprocket.y - reach], [rig.sprocket.x + reach, rig.sprocket.y + reach])


def _say(figure: Figure, recording: Recording) -> None:
    scene = recording.meta["scene"]
    ring = "no ring" if scene["ring_radius"] is None else f"ring {scene['ring_radius']:.3f} m"
    figure.suptitle(f"{scene['motor_rpm']:g} rpm, {ring}", x=0.02, ha="left", fontsize=9)
    present = [i for i in range(3) if (recording.force[:, :, i] > 0).any()]
    handles = [
        Line2D([], [], color=LOOKS[side]["color"], marker=LOOKS[side]["marker"], markersize=4, label=NAMES[side])
        for i, side in enumerate(NAMES)
        if i in present
    ]
    if handles:
        where = {"loc": "upper right", "bbox_to_anchor": (0.995, 0.995), "ncols": len(handles), "frameon": False}
        figure.legend(handles=handles, fontsize=7, handlelength=1.0, columnspacing=1.0, **where)


def _canvas(width: float, height: float) -> Figure:
    # axes are placed by hand; the style's layout engine has to be put aside, or saving would bring it back
    figure = Figure(figsize=(width, height), layout="constrained")
    figure.set_layout_engine("none")
    FigureCanvasAgg(figure)
    return figure


@styled
def still_loop(recording: Recording, index: int = 0) -> Figure:
    """The whole loop at one recorded configuration."""
    rig = _rig(recording)
    figure = _canvas(7.2, 4.1)
    ax = figure.add_axes((0.0, 0.0, 1.0, 0.93))
    draw_moment(ax, rig, recording, index, highlight=(2 * (rig.sensor.pitch - 1),), longest=LONGEST_IN_LOOP)
    _frame_loop(ax, rig, recording)
    _say(figure, recording)
    return figure


@styled
def still_sprocket(recording: Recording, index: int = 0) -> Figure:
    """The sprocket and the chain on it at one recorded configuration."""
    rig = _rig(recording)
    figure = _canvas(4.8, 5.1)
    ax = figure.add_axes((0.0, 0.0, 1.0, 0.94))
    draw_moment(ax, rig, recording, index)
    _frame_sprocket(ax, rig, recording)
    _say(figure, recording)
    return figure


@styled
def write_animation(recording: Recording, path: Path | str) -> int:
    """Write one turn of the sprocket as a GIF: the sprocket above, the whole loop below.

    After a turn every body stands where another of its kind stood, so the GIF repeats without a jump.

    Parameters
    ----------
    recording : Recording
        Run of at least one turn of the sprocket, with configurations and all pitches recorded.
    path : path-like
        The GIF.

    Returns
    -------
    int
        Number of pictures.
    """
    rig = _rig(recording)
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    turn = 60 * rig.sprocket.transmission_ratio / recording.meta["scene"]["motor_rpm"]
    stride = max(1, round(INTERVAL / recording.meta["scene"]["frame_interval"]))
    step = stride * recording.meta["scene"]["frame_interval"]
    indices = [i * stride for i in range(round(turn / step)) if i * stride < len(recording.frame)]
    figure = _canvas(WIDTH, HEIGHT)
    near = figure.add_axes((0.0, 0.35, 1.0, 0.615))
    whole = figure.add_axes((0.0, 0.0, 1.0, 0.36))
    _say(figure, recording)
    part = path.with_name(f".{path.stem}.{os.getpid()}.part.gif")
    writer = PillowWriter(fps=round(1 / (step * PACE)))
    try:
        with writer.saving(figure, part, dpi=DPI):
            for index in indices:
                for ax, frame in ((near, _frame_sprocket), (whole, _frame_loop)):
                    ax.clear()
                    draw_moment(ax, rig, recording, index, longest=LONGEST_ARROW if ax is near else LONGEST_IN_LOOP)
                    frame(ax, rig, recording)
                writer.grab_frame()
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
    return len(indices)

"""The loop on its wheels, from a recorded configuration."""

from math import atan2, pi

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch

from trackdyn.errors import InputError
from trackdyn.parameters.layout import wheel_circles
from trackdyn.parameters.rig import Rig
from trackdyn.recording import Recording
from trackdyn.report.drawing import Z_MARK, chain_points, draw_chain, draw_sprocket, draw_wheels, placed
from trackdyn.report.style import BLACK, VERMILION, new_figure, styled


@styled
def loop_figure(rig: Rig, recording: Recording, index: int = 0) -> Figure:
    """The whole loop (a), its sprocket (b) and one groove with the numbers of its areas (c).

    Parameters
    ----------
    rig : Rig
        Parameters; ``Rig.model_validate(recording.meta["rig"])``.
    recording : Recording
        Run with recorded configurations.
    index : int
        Which configuration.

    Raises
    ------
    InputError
        If the recording holds no configurations.
    """
    if len(recording.frame) == 0:
        raise InputError("the recording holds no configurations: simulate with a frame interval above 0")
    frame = recording.frame[index]
    shift = recording.meta["layout"]["tensioner_shift_m"]
    ring_radius = recording.meta["scene"]["ring_radius"]
    circles = wheel_circles(rig, shift, surface=True)
    sensor_body = 2 * (rig.sensor.pitch - 1)
    pins, _, sprocket_angle = chain_points(rig, frame)
    groove = _seated_groove(rig, pins, sprocket_angle)

    figure = new_figure(7.0)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.15, 1.0))
    whole, sprocket, close = figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1])
    for ax in (whole, sprocket, close):
        draw_wheels(ax, rig, shift)
        draw_sprocket(ax, rig, sprocket_angle, ring_radius, groove if ax is close else None)
        draw_chain(ax, rig, frame, highlight=(sensor_body,))
        ax.set_aspect("equal")
        ax.set_xlabel("x (m)")
        ax.set_ylabel("y (m)")

    margin = 0.12
    whole.set_xlim(pins[:, 0].min() - margin, pins[:, 0].max() + margin)
    whole.set_ylim(pins[:, 1].min() - margin, pins[:, 1].max() + 1.5 * margin)
    whole.set_title(f"(a) the loop at {recording.frame_time[index]:.2f} s of the record")
    ring = "no ring" if ring_radius is None else f"ring {ring_radius:.3f} m"
    for name, (x, y, radius) in zip((f"sprocket, {ring}", "idler", "road wheel"), circles, strict=True):
        _label(whole, x, y - 0.45 * radius, name)
    _mark_sensor(whole, rig, frame, sensor_body)
    _mark_rotation(whole, *circles[0], rate=recording.wheel_rate[0, 0])
    _mark_running(whole, pins, recording.wheel_rate[0, 0])

    reach = 1.25 * rig.groove_profile.addendum
    x, y = circles[0, :2]
    sprocket.set_xlim(x - reach, x + reach)
    sprocket.set_ylim(y - reach, y + reach)
    sprocket.set_title("(b) sprocket, ring and chain")

    middle = _groove_middle(rig, sprocket_angle, groove)
    half = 0.085
    close.set_xlim(middle[0] - half, middle[0] + half)
    close.set_ylim(middle[1] - half, middle[1] + half)
    close.set_title(f"(c) groove {groove} and its ten areas")
    return figure


def _groove_middle(rig: Rig, sprocket_angle: float, groove: int) -> np.ndarray:
    beta = (2 * groove - 1) * pi / rig.sprocket.teeth - pi / 2
    return placed([[0.0, rig.groove_profile.addendum]], (rig.sprocket.x, rig.sprocket.y), sprocket_angle + beta)[0]


def _seated_groove(rig: Rig, pins: np.ndarray, sprocket_angle: float) -> int:
    """The groove whose middle is nearest to that of a connector."""
    middles = 0.5 * (pins[1:-1:2] + pins[2::2])
    grooves = range(1, rig.sprocket.teeth + 1)
    places = np.array([_groove_middle(rig, sprocket_angle, k) for k in grooves])
    distance = np.hypot(*(places[:, None] - middles[None]).transpose(2, 0, 1)).min(axis=1)
    return int(np.argmin(distance)) + 1


def _label(ax: Axes, x: float, y: float, text: str) -> None:
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.5}
    ax.text(x, y, text, ha="center", va="center", fontsize=8, bbox=box, zorder=Z_MARK, clip_on=True)


def _mark_sensor(ax: Axes, rig: Rig, frame, body: int) -> None:
    pins, angles, _ = chain_points(rig, frame)
    place = placed([[rig.sensor.x, rig.sensor.y]], pins[body], angles[body])[0]
    outward = np.array([-np.sin(angles[body]), np.cos(angles[body])])
    ax.plot(*place, marker="o", markersize=4, color=VERMILION, markeredgecolor=BLACK, zorder=Z_MARK)
    ax.annotate(
        "link with the sensor", place, place + 0.12 * outward, fontsize=8, ha="center", va="center", zorder=Z_MARK,
        arrowprops={"arrowstyle": "-", "linewidth": 0.6},
    )  # fmt: skip


def _mark_rotation(ax: Axes, x: float, y: float, radius: float, rate: float) -> None:
    """Bent arrow in the sense of rotation (``rate`` < 0: clockwise)."""
    r = 0.6 * radius
    ends = np.array([[x - r, y], [x + r, y]])
    if rate > 0:
        ends = ends[::-1]
    arrow = FancyArrowPatch(
        *ends, connectionstyle=f"arc3,rad={-0.6 if rate <= 0 else 0.6}", arrowstyle="-|>", mutation_scale=12,
        color=BLACK, zorder=Z_MARK,
    )  # fmt: skip
    ax.add_patch(arrow)


def _mark_running(ax: Axes, pins: np.ndarray, rate: float) -> None:
    """Arrow beside the upper strand in the direction of travel."""
    top = int(np.argmin(np.abs(pins[:, 0] - 0.5 * (pins[:, 0].min() + pins[:, 0].max())) - 10 * pins[:, 1]))
    x, y = pins[top]
    step = (pins[top + 1] - pins[top]) if top + 1 < len(pins) else pins[top] - pins[top - 1]
    angle = atan2(step[1], step[0])
    direction = np.array([np.cos(angle), np.sin(angle)]) * (1 if rate <= 0 else -1)
    start = np.array([x, y]) + 0.07 * np.array([-np.sin(angle), np.cos(angle)])
    ax.add_patch(FancyArrowPatch(start, start + 0.25 * direction, arrowstyle="-|>", mutation_scale=12, color=BLACK, zorder=Z_MARK))

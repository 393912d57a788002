"""The loop on its wheels, from a recorded configuration."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Patch
from matplotlib.ticker import MaxNLocator

from trackdyn.errors import InputError
from trackdyn.parameters.layout import wheel_circles
from trackdyn.parameters.rig import Rig
from trackdyn.recording import Recording
from trackdyn.report import drawing
from trackdyn.report.style import BLACK, new_figure, styled

SENSOR_PLACE = {"linestyle": "none", "marker": "D", "markersize": 5, "color": BLACK, "markeredgecolor": "white"}


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
    pins, _, sprocket_angle = drawing.chain_points(rig, frame)
    groove = _tightest_groove(rig, pins, sprocket_angle)

    figure = new_figure(7.0)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.15, 1.0))
    whole, sprocket, close = (figure.add_subplot(place) for place in (grid[0, :], grid[1, 0], grid[1, 1]))
    for ax in (whole, sprocket, close):
        drawing.draw_wheels(ax, rig, shift)
        drawing.draw_sprocket(ax, rig, sprocket_angle, ring_radius, groove if ax is close else None)
        drawing.draw_chain(ax, rig, frame, highlight=(sensor_body,), opacity=0.6 if ax is close else 1.0)
        ax.set_aspect("equal")
        ax.set_xlabel("x (m)")
        ax.set_ylabel("y (m)")

    margin = 0.12
    whole.set_xlim(pins[:, 0].min() - margin, pins[:, 0].max() + margin)
    whole.set_ylim(pins[:, 1].min() - margin, pins[:, 1].max() + 2.5 * margin)  # room for the legend
    rpm = recording.meta["scene"]["motor_rpm"]
    ring = "no ring" if ring_radius is None else f"ring {ring_radius:.3f} m"
    whole.set_title(f"(a) the loop at {recording.frame_time[index]:.2f} s of the record: {rpm:g} rpm, {ring}")
    for name, (x, y, radius) in zip(("sprocket", "idler", "road wheel"), circles, strict=True):
        _label(whole, x, y - 0.45 * radius, name)
    kinds = {
        "link": {"facecolor": drawing.LINK, "edgecolor": BLACK},
        "connector": {"facecolor": drawing.CONNECTOR, "edgecolor": BLACK},
        "link with the sensor": drawing.MARKED,
        "rubber": {"facecolor": drawing.RUBBER, "edgecolor": BLACK},
    }
    handles = [Patch(**look, linewidth=0.6, label=kind) for kind, look in kinds.items()]
    handles.insert(3, Line2D([], [], **SENSOR_PLACE, label="sensor"))
    whole.legend(handles=handles, loc="upper center", ncols=len(handles), fontsize=7.5, columnspacing=1.2)
    close.legend(handles=[Line2D([], [], **drawing.JOINT, label="joint of two areas")], loc="upper left", fontsize=7)
    _mark_sensor(whole, rig, frame, sensor_body)
    _mark_rotation(whole, *circles[0], rate=recording.wheel_rate[0, 0])
    _mark_running(whole, pins, recording.wheel_rate[0, 0])

    reach = 1.25 * rig.groove_profile.addendum
    x, y = circles[0, :2]
    sprocket.set_xlim(x - reach, x + reach)
    sprocket.set_ylim(y - reach, y + reach)
    sprocket.set_title("(b) sprocket and chain")

    middle = drawing.groove_points(rig, sprocket_angle, groove, [[0.0, rig.groove_profile.addendum - 0.02]])[0]
    half = 0.6 * rig.chain.link_length + 0.035
    close.set_xlim(middle[0] - half, middle[0] + half)
    close.set_ylim(middle[1] - half, middle[1] + half)
    close.xaxis.set_major_locator(MaxNLocator(5))
    close.set_title(f"(c) groove {groove} and its ten areas")
    return figure


def _tightest_groove(rig: Rig, pins: np.ndarray, sprocket_angle: float) -> int:
    """The groove whose flanks come nearest to an arc of a connector, or are pressed most by it."""
    profile = rig.groove_profile.profile()
    clearance = []
    for groove in range(1, rig.sprocket.teeth + 1):
        points = drawing.groove_points(rig, sprocket_angle, groove, profile)
        clearance.append(np.hypot(*(points[:, None] - pins[None]).transpose(2, 0, 1)).min())
    return int(np.argmin(clearance)) + 1


def _label(ax: Axes, x: float, y: float, text: str) -> None:
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.5}
    ax.text(x, y, text, ha="center", va="center", fontsize=8, bbox=box, zorder=drawing.Z_MARK, clip_on=True)


def _mark_sensor(ax: Axes, rig: Rig, frame, body: int) -> None:
    pins, angles, _ = drawing.chain_points(rig, frame)
    x, y = drawing.placed([[rig.sensor.x, rig.sensor.y]], pins[body], angles[body])[0]
    ax.plot(x, y, **SENSOR_PLACE, zorder=drawing.Z_MARK)


def _mark_rotation(ax: Axes, x: float, y: float, radius: float, rate: float) -> None:
    """Bent arrow in the sense of rotation (``rate`` < 0: clockwise)."""
    sense = -1 if rate <= 0 else 1
    ends = np.array([[x + sense * 0.6 * radius, y], [x - sense * 0.6 * radius, y]])
    _draw_arrow(ax, *ends, connectionstyle=f"arc3,rad={0.6 * sense}")


def _mark_running(ax: Axes, pins: np.ndarray, rate: float) -> None:
    """Arrow beside the upper strand in the direction of travel."""
    sense = -1 if rate <= 0 else 1
    top = int(np.argmax(pins[1:-1, 1])) + 1
    step = pins[top + 1] - pins[top - 1]
    along = step / np.hypot(*step)
    start = pins[top] + 0.07 * np.array([-along[1], along[0]])
    _draw_arrow(ax, start, start - 0.25 * sense * along)


def _draw_arrow(ax: Axes, start, end, **look) -> None:
    arrow = FancyArrowPatch(start, end, arrowstyle="-|>", mutation_scale=12, color=BLACK, zorder=drawing.Z_MARK, **look)
    ax.add_patch(arrow)

"""The loop on its wheels, from a recorded configuration."""

from trackdyn.sweeps.job import run_job

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Patch
from matplotlib.ticker import MaxNLocator

from trackdyn.measure.columns import words
from trackdyn.parameters.layout import wheel_circles, wheel_names
from trackdyn.parameters.rig import Rig
from trackdyn.plots import drawing
from trackdyn.plots.style import BLACK, new_figure, save, styled
from trackdyn.simulation.recording import Recording, load_recording

SENSOR_PLACE = {"linestyle": "none", "marker": "D", "markersize": 5, "color": BLACK, "markeredgecolor": "white"}


@styled
def loop_figure(rig: Rig, recording: Recording, index: int = 0) -> Figure:
    """The whole loop (a), its sprocket (b) and one groove with the numbers of its areas (c).

    ``rig`` is that of the recording, ``index`` says which of its configurations.
    """
    drawing.require_frames(recording)
    frame = recording.frame[index]
    shift = recording.meta["layout"]["tensioner_shift_m"]
    ring_radius = recording.scene.ring_radius
    circles = wheel_circles(rig, shift, surface=True)
    sensor_body = 2 * (rig.sensor.pitch - 1)
    pins, angles, sprocket_angle = drawing.chain_points(rig, frame)
    groove = _tightest_groove(rig, pins, sprocket_angle)

    figure = new_figure(5.4)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.15, 1.0))
    complete, sprocket, close = (figure.add_subplot(cell) for cell in (grid[0, :], grid[1, 0], grid[1, 1]))
    for ax in (complete, sprocket, close):
        look = {"highlight": (sensor_body,), "opacity": 0.6 if ax is close else 1.0}
        drawing.draw_loop(ax, rig, frame, shift, ring_radius, groove if ax is close else None, **look)
        ax.set(aspect="equal", xlabel="x (m)", ylabel="y (m)")

    low, high = pins.min(axis=0) - 0.12, pins.max(axis=0) + 0.12
    complete.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    rpm, ring = recording.scene.motor_rpm, drawing.ring_words(ring_radius)
    complete.set_title(f"(a) the loop at {recording.frame_time[index]:.2f} s: {rpm:g} rpm, {ring}")
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.5}
    for name, (x, y, radius) in zip(wheel_names(rig), circles, strict=True):
        look = {"ha": "center", "va": "center", "fontsize": 8, "bbox": box, "zorder": drawing.Z_MARK, "clip_on": True}
        complete.text(x, y - 0.45 * radius, words(name), **look)
    kinds = {
        "link": {"facecolor": drawing.LINK, "edgecolor": BLACK},
        "connector": {"facecolor": drawing.CONNECTOR, "edgecolor": BLACK},
        "link with the sensor": drawing.MARKED,
        "rubber": {"facecolor": drawing.RUBBER, "edgecolor": BLACK},
    }
    handles = [Patch(**look, linewidth=0.6, label=kind) for kind, look in kinds.items()]
    handles.insert(3, Line2D([], [], **SENSOR_PLACE, label="sensor"))
    handles.append(Line2D([], [], **drawing.JOINT, label="joint of two areas"))
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    sensor = drawing.placed([[rig.sensor.x, rig.sensor.y]], pins[sensor_body], angles[sensor_body])[0]
    complete.plot(*sensor, **SENSOR_PLACE, zorder=drawing.Z_MARK)
    _mark_motion(complete, circles[0], pins, -1 if recording.wheel_rate[0, 0] <= 0 else 1)

    drawing.view(sprocket, circles[0, :2], 1.25 * rig.groove_profile.addendum)
    sprocket.set_title("(b) sprocket and chain")

    middle = drawing.groove_points(rig, sprocket_angle, groove, [[0.0, rig.groove_profile.addendum - 0.02]])[0]
    drawing.view(close, middle, 0.6 * rig.chain.link_length + 0.035)
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


def _mark_motion(ax: Axes, circle: np.ndarray, pins: np.ndarray, sense: int) -> None:
    """Bent arrow in the sense of the sprocket's rotation (-1: clockwise), straight one beside the upper strand."""
    x, y, radius = circle
    look = {"arrowstyle": "-|>", "mutation_scale": 12, "color": BLACK, "zorder": drawing.Z_MARK}
    ends = (x + sense * 0.6 * radius, y), (x - sense * 0.6 * radius, y)
    ax.add_patch(FancyArrowPatch(*ends, connectionstyle=f"arc3,rad={0.6 * sense}", **look))
    top = int(np.argmax(pins[1:-1, 1])) + 1
    step = pins[top + 1] - pins[top - 1]
    along = step / np.hypot(*step)
    start = pins[top] + 0.07 * np.array([-along[1], along[0]])
    ax.add_patch(FancyArrowPatch(start, start - 0.25 * sense * along, **look))


def main(job) -> None:
    """Rule `loop_figure`."""
    recording = load_recording(job.input.recording)
    save(loop_figure(recording.scene.rig, recording), job.output[0])


if __name__ == "__main__":
    run_job(main)

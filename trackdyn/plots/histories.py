"""The link's y acceleration over two revolutions of the loop, simulation and sensor."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackdyn.measure.sensor import own_loop_hz, sense
from trackdyn.plots.style import BLACK, SENSOR, SIMULATION, new_figure, styled
from trackdyn.sensor.sensor_csv import SensorRecord
from trackdyn.simulation.recording import Recording

REVOLUTIONS = 2.0
CENTRAL = 0.999  # fraction of a sensor's samples that is always in view; the rest may be cut off


def first_crest(ay, rate: float, hz: float) -> int:
    """Sample at which the oscillation of frequency ``hz`` first has its crest.

    Its phase is taken from the first two of its periods, mean removed, not from the whole record: the
    speed of a real track drifts.
    """
    begin = np.asarray(ay)[: round(REVOLUTIONS * rate / hz)]
    turn = 2 * np.pi * hz / rate * np.arange(len(begin))
    phase = np.angle(np.sum((begin - begin.mean()) * np.exp(-1j * turn)))
    return round((-phase % (2 * np.pi)) / (2 * np.pi) * rate / hz)


@styled
def history_figure(
    recording: Recording, record: SensorRecord | None, title="", sensor_label="synthetic sensor"
) -> Figure:
    """The y acceleration of simulation (above) and sensor (below) of one motor speed over about two revolutions.

    Both curves begin where the fundamental of their own first has its crest, and both run for two revolutions of the
    simulated loop. The loops turn at slightly different rates, so they agree in phase at the start and drift apart. The
    view holds all of the simulation and nearly all samples of the sensor; triangles stand where its curve is cut off,
    and its extremes are written. ``sensor_label`` says what the record is, and must say so if it is synthetic; without
    a record the panel of the simulation has it instead of the other one.
    """
    figure = new_figure(4.0)
    figure.set_layout_engine("none")  # margins that do not depend on the numbers at the ticks: panels are alike
    margins = {"left": 0.11, "right": 0.97, "bottom": 0.11, "top": 0.93, "hspace": 0.22}
    axes = figure.subplots(2 if record else 1, 1, sharex=True, sharey=True, squeeze=False, gridspec_kw=margins)[:, 0]
    draw_histories(axes, recording, record, sensor_label)
    axes[0].set_title(title)
    return figure


def draw_histories(axes: Sequence[Axes], recording: Recording, record: SensorRecord | None, sensor_label: str) -> None:
    """The panels of `history_figure`; axes of a figure share theirs."""
    loop_hz = recording.periods.loop_hz
    name = "simulation" if record else f"simulation; {sensor_label}"
    curves = [(sense(recording).ay, recording.rate, loop_hz, name, SIMULATION)]
    if record:
        own_hz = own_loop_hz(record.ay_g, record.rate_hz, loop_hz)
        curves.append((record.ay_g, record.rate_hz, own_hz, sensor_label, SENSOR))
    span = REVOLUTIONS / loop_hz
    shown = []
    for ax, (ay, rate, hz, label, look) in zip(axes, curves, strict=True):
        start = first_crest(ay, rate, hz)
        shown.append(ay[start : start + round(span * rate) + 1])
        ax.plot(np.arange(len(shown[-1])) / rate, shown[-1], linewidth=0.6, **look)
        ax.set_ylabel("y acceleration (g)")
        ax.set_title(label, loc="right")
    tail = (1 - CENTRAL) / 2
    low = min(shown[0].min(), np.quantile(shown[-1], tail))
    high = max(shown[0].max(), np.quantile(shown[-1], 1 - tail))
    axes[0].set_xlim(0, span)
    axes[0].set_ylim(low - 0.08 * (high - low), high + 0.08 * (high - low))
    if record:
        _mark_cut(axes[1], np.arange(len(shown[1])) / record.rate_hz, shown[1])
    axes[-1].set_xlabel("time since a crest of each curve's own fundamental (s)")


def _mark_cut(ax: Axes, time: np.ndarray, ay: np.ndarray) -> None:
    """Triangles where a curve leaves the view, and its extremes in words."""
    low, high = ax.get_ylim()
    look = {"linestyle": "none", "color": BLACK, "markersize": 3.5, "clip_on": False, "zorder": 4}
    for beyond, edge, marker in ((ay > high, high, "^"), (ay < low, low, "v")):
        ax.plot(time[beyond], np.full(beyond.sum(), edge), **look, marker=marker)
    if ay.max() > high or ay.min() < low:
        text = f"{ax.get_title('right')}; cut off at the triangles: extremes {ay.max():+.1f} and {ay.min():+.1f} g"
        ax.set_title(text.replace("-", "\N{MINUS SIGN}"), loc="right")

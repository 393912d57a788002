"""Figure 17: the link's y acceleration over two revolutions of the loop, simulation and sensor."""

import numpy as np
from matplotlib.figure import Figure

from trackdyn.measure.metrics import loop_frequency
from trackdyn.measure.sensor import sense
from trackdyn.measure.sensor_csv import SensorRecord
from trackdyn.measure.signals import main_line, main_line_binfree
from trackdyn.recording import Recording
from trackdyn.report.style import SENSOR, SIMULATION, new_figure, styled

REVOLUTIONS = 2.0


def first_crest(ay, rate: float, hz: float) -> int:
    """Sample at which the oscillation of frequency ``hz`` first has its crest.

    Its phase is taken from the first two of its periods, mean removed, not from the whole record: the
    speed of a real track drifts.

    Parameters
    ----------
    ay : (s,) array
        Signal.
    rate, hz : float
        Sampling rate and frequency, Hz.
    """
    part = np.asarray(ay)[: round(REVOLUTIONS * rate / hz)]
    turn = 2 * np.pi * hz / rate * np.arange(len(part))
    phase = np.angle(np.sum((part - part.mean()) * np.exp(-1j * turn)))
    return round((-phase % (2 * np.pi)) / (2 * np.pi) * rate / hz)


@styled
def history_figure(
    recording: Recording, record: SensorRecord, title: str = "", sensor_label: str = "synthetic sensor"
) -> Figure:
    """The y acceleration of simulation (above) and sensor (below) over about two revolutions.

    Both curves begin where the fundamental of their own first has its crest, and both run for two
    revolutions of the simulated loop. The loops turn at slightly different rates, so they agree in
    phase at the start and part slowly.

    Parameters
    ----------
    recording : Recording
        Run.
    record : SensorRecord
        Record of the same motor speed.
    title : str
        Such as ``(a) 115 rpm``.
    sensor_label : str
        What the record is; must say so if it is synthetic.
    """
    loop_hz = loop_frequency(recording)
    signal = sense(recording).ay
    curves = (
        (signal, recording.rate, loop_hz, "simulation", SIMULATION),
        (record.ay_g, record.rate_hz, _line(record), sensor_label, SENSOR),
    )
    span = REVOLUTIONS / loop_hz
    figure = new_figure(4.2)
    axes = figure.subplots(2, 1, sharex=True, sharey=True)
    for ax, (ay, rate, hz, label, look) in zip(axes, curves, strict=True):
        start = first_crest(ay, rate, hz)
        shown = ay[start : start + round(span * rate) + 1]
        ax.plot(np.arange(len(shown)) / rate, shown, linewidth=0.6, **look)
        ax.set_ylabel("y acceleration (g)")
        ax.set_title(label, loc="right")
    axes[0].set_xlim(0, span)
    axes[0].set_title(title)
    axes[1].set_xlabel("time since a crest of each curve's own fundamental (s)")
    return figure


def _line(record: SensorRecord) -> float:
    """Loop frequency that the record shows, Hz."""
    return main_line_binfree(record.ay_g, record.rate_hz, main_line(record.ay_g, record.rate_hz)[0])[0]

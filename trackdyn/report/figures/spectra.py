"""Figure 18: amplitude spectra of the link's y acceleration, simulation and sensor."""

from dataclasses import dataclass

import numpy as np
import scipy.signal
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackdyn.measure.metrics import loop_frequency
from trackdyn.measure.sensor import sense
from trackdyn.measure.sensor_csv import SensorRecord
from trackdyn.measure.signals import main_line, main_line_binfree, picket_fence, spectrum
from trackdyn.recording import Recording
from trackdyn.report.style import BLACK, SENSOR, SIMULATION, new_figure, styled, thin

LOW_RANGE_HZ = 2.0
INSET_BINS = 4.5  # to both sides of the loop frequency
LEAST_G = 1e-6


@dataclass(frozen=True)
class _Curve:
    """A spectrum with its main line: as the FFT shows it, and free of the picket fence."""

    label: str
    ay: np.ndarray
    rate: float
    line: tuple[float, float]
    free: tuple[float, float]
    look: dict
    marker: str

    @property
    def spectrum(self):
        return spectrum(self.ay, self.rate)


def _curve(label, ay, rate, expected_hz, look, marker) -> _Curve:
    line = main_line(ay, rate)
    free = main_line_binfree(ay, rate, expected_hz=expected_hz)[:2]
    return _Curve(label, ay, rate, line, free, look, marker)


@styled
def spectrum_figure(
    recording: Recording, record: SensorRecord, title: str = "", sensor_label: str = "synthetic sensor"
) -> Figure:
    """Single-sided amplitude spectra of the whole records.

    Upper panel: 0 to 2 Hz, with the main line as the paper takes it (highest line of the FFT, filled
    marker) and its value free of the picket fence (hollow marker); its inset shows the lines around the
    loop frequency on the curve that they sample. Lower panel: the whole range, on a logarithmic axis.

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
    simulated = _curve("simulation", sense(recording).ay, recording.rate, loop_hz, SIMULATION, "o")
    measured = _curve(sensor_label, record.ay_g, record.rate_hz, None, SENSOR, "s")
    figure = new_figure(5.6)
    low, whole = figure.subplots(2, 1, height_ratios=(1.35, 1.0))
    for curve in (measured, simulated):
        _draw_low(low, curve)
        freq, amplitude = thin(*curve.spectrum)
        whole.plot(
            freq[1:], np.maximum(amplitude[1:], LEAST_G), marker="", linewidth=0.5, label=curve.label,
            alpha=0.85, **curve.look,
        )  # fmt: skip
    top = max(curve.free[1] for curve in (simulated, measured))
    low.set_xlim(0, LOW_RANGE_HZ)
    low.set_ylim(0, 1.25 * max(top, simulated.line[1], measured.line[1]))
    low.set_xlabel("frequency (Hz)")
    low.set_ylabel("amplitude (g)")
    low.set_title(title)
    _draw_inset(low, simulated, measured, loop_hz)
    whole.set_yscale("log")
    whole.set_xlim(0, 0.5 * recording.rate)
    whole.set_xlabel("frequency (Hz)")
    whole.set_ylabel("amplitude (g)")
    whole.legend(loc="upper right")
    return figure


def _draw_low(ax: Axes, curve: _Curve) -> None:
    freq, amplitude = curve.spectrum
    inside = (freq > 0) & (freq <= 1.05 * LOW_RANGE_HZ)
    ax.plot(freq[inside], amplitude[inside], marker="", linewidth=0.9, **curve.look)
    colour = curve.look["color"]
    ax.plot(
        *curve.line, marker=curve.marker, color=colour, markeredgecolor=BLACK, markeredgewidth=0.6, linestyle="none",
        markersize=5, zorder=4, label=f"{curve.label}, FFT: {curve.line[0]:.4f} Hz, {curve.line[1]:.3f} g",
    )  # fmt: skip
    ax.plot(
        *curve.free, marker=curve.marker, color=colour, markerfacecolor="none", markeredgewidth=1.2, linestyle="none",
        markersize=8, zorder=4, label=f"{curve.label}, bin-free: {curve.free[0]:.4f} Hz, {curve.free[1]:.3f} g",
    )  # fmt: skip


def _draw_inset(ax: Axes, simulated: _Curve, measured: _Curve, loop_hz: float) -> None:
    """Lines of the FFT around the loop frequency, and the continuous spectrum that they sample."""
    inset = ax.inset_axes((0.60, 0.36, 0.385, 0.60))
    position, factor = picket_fence(loop_hz, simulated.rate, len(simulated.ay))
    inset.axvline(loop_hz, color=BLACK, linestyle=(0, (2, 1.5)), linewidth=0.8)
    bin_hz = simulated.rate / len(simulated.ay)
    near = (max(loop_hz - INSET_BINS * bin_hz, 0.1 * bin_hz), max(loop_hz, measured.free[0]) + INSET_BINS * bin_hz)
    for curve in (measured, simulated):
        n = len(curve.ay)
        dense = np.linspace(*near, 500)
        amplitude = 2 / n * np.abs(scipy.signal.zoom_fft(curve.ay - np.mean(curve.ay), near, m=500, fs=curve.rate, endpoint=True))
        inset.plot(dense, amplitude, marker="", linewidth=0.8, alpha=0.7, **curve.look)
        freq, lines = curve.spectrum
        inside = (freq >= near[0]) & (freq <= near[1]) & (freq > 0)
        inset.vlines(freq[inside], 0, lines[inside], color=curve.look["color"], linewidth=0.6)
        inset.plot(freq[inside], lines[inside], linestyle="none", marker=curve.marker, markersize=3.5, color=curve.look["color"])
    inset.set_xlim(near)
    inset.set_ylim(0, ax.get_ylim()[1])
    inset.tick_params(labelsize=7)
    inset.set_xlabel("frequency (Hz)", fontsize=7)
    inset.set_title(
        f"loop {loop_hz:.5f} Hz = line {position:.2f} of the FFT:\na single sine would show at {100 * factor:.0f} %", fontsize=7
    )

"""Figure 18: amplitude spectra of the link's y acceleration, simulation and sensor."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.signal
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackdyn.measure.metrics import loop_frequency
from trackdyn.measure.sensor import sense
from trackdyn.measure.sensor_csv import SensorRecord
from trackdyn.measure.signals import main_line, main_line_binfree, picket_fence, spectrum
from trackdyn.recording import Recording
from trackdyn.report.figures.histories import lettered
from trackdyn.report.style import BLACK, SENSOR, SIMULATION, new_figure, styled, thin

LOW_RANGE_HZ = 2.0
INSET_BINS = 4.5  # to both sides of the main lines
DENSE = 500  # points of the continuous spectrum in the inset
BAND_HZ = 2.0  # of the smoothed curves over the whole range
LEAST_G = 1e-6  # lower end of the logarithmic axis
MARK_EVERY_HZ = 25.0  # on the smoothed curves


@dataclass(frozen=True)
class _Curve:
    """A spectrum with its main line: as the FFT shows it, and free of the picket fence."""

    label: str
    ay: np.ndarray
    rate: float
    expected_hz: float | None
    look: dict
    marker: str
    hollow_size: float  # of different sizes, so that one hollow mark may stand within the other

    @cached_property
    def line(self):
        return main_line(self.ay, self.rate)

    @cached_property
    def free(self):
        return main_line_binfree(self.ay, self.rate, expected_hz=self.expected_hz)[:2]

    @cached_property
    def spectrum(self):
        return spectrum(self.ay, self.rate)


def in_bands(freq: np.ndarray, amplitude: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middle frequencies (Hz) of bands of 2 Hz and the root mean square of the lines of a spectrum in them."""
    first = np.arange(0, len(freq), max(1, round(BAND_HZ / freq[0])))
    count = np.diff(np.append(first, len(freq)))
    return np.add.reduceat(freq, first) / count, np.sqrt(np.add.reduceat(amplitude**2, first) / count)


@styled
def spectrum_figure(recording: Recording, record: SensorRecord, title="", sensor_label="synthetic sensor") -> Figure:
    """Single-sided amplitude spectra of the whole records.

    Upper panel: 0 to 2 Hz, with the main line as the paper takes it (highest line of the FFT, filled
    marker) and its value free of the picket fence (hollow marker); its inset shows the lines around the
    loop frequency on the curve that they sample. Lower panel: the whole range on a logarithmic axis, the
    single lines pale and their root mean square in bands of 2 Hz in full colour. Parameters are those of
    :func:`trackdyn.report.figures.histories.history_figure`.
    """
    loop_hz = loop_frequency(recording)
    simulated = _Curve("simulation", sense(recording).ay, recording.rate, loop_hz, SIMULATION, "o", 13)
    dashed = SENSOR | {"linestyle": (0, (4, 1.2))}
    measured = _Curve(sensor_label, record.ay_g, record.rate_hz, None, dashed, "s", 8)
    figure = new_figure(5.6)
    low, whole = figure.subplots(2, 1, height_ratios=(1.35, 1.0))
    for curve in (simulated, measured):
        _draw_low(low, curve)
        _draw_whole(whole, curve)
    low.set(xlim=(0, LOW_RANGE_HZ), xlabel="frequency (Hz)", ylabel="amplitude (g)")
    low.set_ylim(0, 1.2 * max(amplitude for c in (simulated, measured) for amplitude in (c.line[1], c.free[1])))
    low.set_title(lettered(title, recording))
    low.legend(loc="upper left", bbox_to_anchor=(0.145, 1.0), fontsize=7)
    _draw_inset(low, simulated, measured, loop_hz)
    whole.set(yscale="log", xlim=(0, 0.5 * recording.rate), xlabel="frequency (Hz)", ylabel="amplitude (g)")
    whole.set_ylim(bottom=LEAST_G)
    whole.legend(loc="upper right")
    return figure


def _draw_low(ax: Axes, curve: _Curve) -> None:
    freq, amplitude = curve.spectrum
    inside = (freq > 0) & (freq <= 1.05 * LOW_RANGE_HZ)
    ax.plot(freq[inside], amplitude[inside], linewidth=0.9, **curve.look)
    filled = {"markersize": 4.5, "markeredgecolor": BLACK, "markeredgewidth": 0.6}
    hollow = {"markersize": curve.hollow_size, "markerfacecolor": "none", "markeredgewidth": 1.2}
    common = {"linestyle": "none", "marker": curve.marker, "color": curve.look["color"], "zorder": 4}
    for name, (hz, g), look in (("FFT", curve.line, filled), ("bin-free", curve.free, hollow)):
        ax.plot(hz, g, **common, **look, label=f"{curve.label}, {name}: {hz:.4f} Hz, {g:.3f} g")


def _draw_whole(ax: Axes, curve: _Curve) -> None:
    freq, amplitude = (part[1:] for part in curve.spectrum)
    ax.plot(*thin(freq, np.maximum(amplitude, LEAST_G)), linewidth=0.4, alpha=0.25, color=curve.look["color"])
    middle, smooth = in_bands(freq, amplitude)
    every = max(1, round(MARK_EVERY_HZ / BAND_HZ))
    begin = 0 if curve.marker == "o" else every // 2  # marks of the two curves stand beside each other
    mark = {"marker": curve.marker, "markersize": 4, "markeredgecolor": BLACK, "markeredgewidth": 0.5}
    look = curve.look | mark | {"linewidth": 1.1, "zorder": 3, "label": curve.label}
    ax.plot(middle, np.maximum(smooth, LEAST_G), **look, markevery=(begin, every))


def _draw_inset(ax: Axes, simulated: _Curve, measured: _Curve, loop_hz: float) -> None:
    """Lines of the FFT around the loop frequency, and the continuous spectrum that they sample."""
    inset = ax.inset_axes((0.635, 0.38, 0.345, 0.48))
    position, factor = picket_fence(loop_hz, simulated.rate, len(simulated.ay))
    inset.axvline(loop_hz, color=BLACK, linestyle=(0, (2, 1.5)), linewidth=0.8)
    bin_hz = simulated.rate / len(simulated.ay)
    frequencies = (loop_hz, simulated.free[0], measured.free[0])
    near = max(min(frequencies) - INSET_BINS * bin_hz, 0.1 * bin_hz), max(frequencies) + INSET_BINS * bin_hz
    for curve in (measured, simulated):
        ay = curve.ay - np.mean(curve.ay)
        sums = scipy.signal.zoom_fft(ay, near, m=DENSE, fs=curve.rate, endpoint=True)
        inset.plot(np.linspace(*near, DENSE), 2 / len(ay) * np.abs(sums), linewidth=0.8, alpha=0.7, **curve.look)
        freq, lines = curve.spectrum
        inside = (freq >= near[0]) & (freq <= near[1])
        colour = curve.look["color"]
        inset.vlines(freq[inside], 0, lines[inside], color=colour, linewidth=0.6)
        inset.plot(freq[inside], lines[inside], linestyle="none", marker=curve.marker, markersize=3.5, color=colour)
    inset.set_xlim(near)
    inset.set_ylim(0, ax.get_ylim()[1])
    inset.tick_params(labelsize=7)
    inset.set_xlabel("frequency (Hz)", fontsize=7)
    shown = f"the FFT shows a sine there at {100 * factor:.0f} %"
    inset.set_title(f"loop {loop_hz:.5f} Hz is at line {position:.2f}:\n{shown}", fontsize=7)

"""Figures of the y acceleration over two revolutions of the loop and of its spectra, simulation and sensor."""

from collections.abc import Sequence
from itertools import zip_longest
from typing import NamedTuple

import numpy as np
import scipy  # its modules are loaded where they are used
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackdyn.fieldtest.sensor_csv import SensorRecord
from trackdyn.inputs.errors import InputError
from trackdyn.measure.sensor import measured_loop_hz, sense, whole_revolutions
from trackdyn.measure.spectra import BAND_HZ, LOW_RANGE_HZ, in_bands, main_line, main_line_binfree, spectrum
from trackdyn.plots.style import BLACK, SENSOR, SIMULATION, new_figure, styled
from trackdyn.simulation.recording import Recording

REVOLUTIONS = 2.0
CENTRAL = 0.999  # fraction of a sensor's samples that is always in view; the rest may be cut off
BINS = 4.5  # lines of the FFT that are drawn on both sides of the dominant peaks
DENSE = 500  # points of the continuous spectrum
MARK_EVERY = round(25.0 / BAND_HZ)  # bands between marks on the smoothed curves


class _Curve(NamedTuple):
    """Y acceleration of a simulation or a sensor, and its style."""

    label: str
    ay: np.ndarray  # (samples,), g
    rate: float  # samples per second, Hz
    hz: float  # frequency of its loop, Hz
    look: dict
    marker: str
    hollow_size: float  # sizes differ, so that one hollow mark fits into the other


def _curves(recording: Recording, record: SensorRecord | None, sensor_label: str) -> list[_Curve]:
    """Return the curve of the simulation, and that of the sensor if there is a record."""
    loop_hz, dashed = recording.periods.loop_hz, SENSOR | {"linestyle": (0, (4, 1.2))}
    name = "simulation" if record else f"simulation; {sensor_label}"
    curves = [_Curve(name, sense(recording).ay, recording.rate, loop_hz, SIMULATION, "o", 11)]
    if record:
        own_hz = measured_loop_hz(record.ay, record.rate, loop_hz)
        curves.append(_Curve(sensor_label, record.ay, record.rate, own_hz, dashed, "s", 7))
    return curves


def first_crest(ay, rate: float, hz: float) -> int:
    """Return the first crest of ``hz`` Hz, by its first two periods only: the speed of a real track drifts."""
    begin = np.asarray(ay)[: round(REVOLUTIONS * rate / hz)]
    angle = 2 * np.pi * hz / rate * np.arange(len(begin))
    phase = np.angle(np.sum((begin - begin.mean()) * np.exp(-1j * angle)))
    return round((-phase % (2 * np.pi)) / (2 * np.pi) * rate / hz)


@styled
def history_figure(
    recording: Recording, record: SensorRecord | None, title="", sensor_label="synthetic sensor"
) -> Figure:
    """Draw the y acceleration of simulation (above) and sensor (below) of one motor speed over about two revolutions.

    Each curve begins at the first crest of its own fundamental: loops of slightly different rates drift apart. All of
    the simulation and nearly all samples of the sensor are in view; triangles mark where its curve is cut off.
    """
    figure = new_figure(4.0)
    figure.set_layout_engine("none")  # margins that do not depend on the numbers at the ticks: panels are alike
    margins = {"left": 0.11, "right": 0.97, "bottom": 0.11, "top": 0.93, "hspace": 0.22}
    axes = figure.subplots(2 if record else 1, 1, sharex=True, sharey=True, squeeze=False, gridspec_kw=margins)[:, 0]
    _draw_histories(axes, _curves(recording, record, sensor_label))
    axes[0].set_title(title)
    return figure


def _draw_histories(axes: Sequence[Axes], curves: list[_Curve]) -> None:
    """Draw the panels of `history_figure`, whose axes are shared."""
    span = REVOLUTIONS / curves[0].hz
    drawn = []
    for ax, curve in zip(axes, curves, strict=True):
        start = first_crest(curve.ay, curve.rate, curve.hz)
        drawn.append(curve.ay[start : start + round(span * curve.rate) + 1])
        ax.plot(np.arange(len(drawn[-1])) / curve.rate, drawn[-1], linewidth=0.6, **curve.look | {"linestyle": "-"})
        ax.set_ylabel("y acceleration (g)")
        ax.set_title(curve.label, loc="right")
    tail = (1 - CENTRAL) / 2
    low = min(drawn[0].min(), np.quantile(drawn[-1], tail))
    high = max(drawn[0].max(), np.quantile(drawn[-1], 1 - tail))
    axes[0].set(xlim=(0, span), ylim=(low - 0.08 * (high - low), high + 0.08 * (high - low)))
    axes[-1].set_xlabel("time since a crest of each curve's own fundamental (s)")
    if len(curves) == 1:
        return
    ax, ay, (low, high) = axes[1], drawn[1], axes[1].get_ylim()
    look = {"linestyle": "none", "color": BLACK, "markersize": 3.5, "clip_on": False, "zorder": 4}
    for beyond, edge, marker in ((ay > high, high, "^"), (ay < low, low, "v")):
        ax.plot(np.flatnonzero(beyond) / curves[1].rate, np.full(beyond.sum(), edge), **look, marker=marker)
    if ay.max() > high or ay.min() < low:
        text = f"{curves[1].label}; cut off at the triangles: extremes {ay.max():+.1f} and {ay.min():+.1f} g"
        ax.set_title(text.replace("-", "\N{MINUS SIGN}"), loc="right")


@styled
def spectrum_figure(
    recording: Recording, record: SensorRecord | None, title="", sensor_label="synthetic sensor", others=()
) -> Figure:
    """Draw single-sided amplitude spectra of the whole records.

    Above: lines around the loop frequency on the curve that they sample, with the dominant peak as in the paper
    (highest line of the FFT, filled mark), its value free of scalloping loss (hollow) and ``others``: label, frequency
    (Hz), amplitude (g), marker. Middle and below: `_draw_ranges`.
    """
    loop_hz = recording.periods.loop_hz
    curves = _curves(recording, record, sensor_label)
    peaks = [main_line_binfree(curve.ay, curve.rate, expected_hz=curve.hz)[:2] for curve in curves]
    figure = new_figure(6.4)
    main, low, complete = figure.subplots(3, 1, height_ratios=(1.3, 1.0, 1.0))
    bin_hz = recording.rate / len(curves[0].ay)
    position = loop_hz / bin_hz
    factor = np.abs(np.sinc(position - np.rint(position)))
    fence = f"Loop frequency {loop_hz:.5f} Hz, bin {position:.2f} of the\nFFT, which shows a sine there with"
    main.set_title(f"{title}. {fence} {100 * factor:.0f} % of its amplitude")
    main.axvline(loop_hz, color=BLACK, linestyle=(0, (1, 1)), linewidth=0.8)
    frequencies = (loop_hz, *(hz for hz, _ in peaks))
    near = max(min(frequencies) - BINS * bin_hz, 0.1 * bin_hz), max(frequencies) + BINS * bin_hz
    look = {"linestyle": "none", "color": BLACK, "markerfacecolor": "none", "markersize": 6, "zorder": 5}
    for curve, peak, other in zip_longest(curves, peaks, others):
        if curve:
            _draw_main(main, curve, near, peak)
        if other:
            source, hz, g, mark = other
            main.plot(hz, g, **look, marker=mark, label=f"{source}: {hz:.4g} Hz, {g:.4g} g")
    _draw_ranges(low, complete, curves)
    main.set(xlim=near, ymargin=0.13, xlabel="frequency (Hz)", ylabel="amplitude (g)")
    main.set_ylim(bottom=0)
    figure.legend(*main.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    figure.align_ylabels()
    return figure


@styled
def comparison_figure(recording: Recording, record: SensorRecord, sensor_label="sensor") -> Figure:
    """Draw histories of two revolutions, spectra up to 2 Hz and of the whole range; `InputError` for a loop at rest."""
    if not recording.periods.loop_hz:
        rest = "the loop of the recording is at rest, and a figure shows two of its turns"
        raise InputError(f"figure: {rest}; leave it out")
    figure = new_figure(7.2)
    figure.set_layout_engine("none")  # triangles outside of the axes lead the constrained one astray
    margins = {"left": 0.12, "right": 0.97, "bottom": 0.06, "top": 0.96, "hspace": 0.55}
    upper, lower, low, complete = figure.subplots(4, 1, gridspec_kw=margins)
    lower.sharex(upper)
    lower.sharey(upper)
    curves = _curves(recording, record, sensor_label)
    _draw_histories((upper, lower), curves)
    upper.set_title(f"{recording.scene.motor_rpm:g} rpm")
    _draw_ranges(low, complete, curves)
    low.legend()
    figure.align_ylabels()
    return figure


def _draw_ranges(low: Axes, complete: Axes, curves: list[_Curve]) -> None:
    """Draw spectra of the curves up to 2 Hz, and their root mean square in bands over the whole range of the first."""
    # over equally many turns equal signals look equal, whatever the lengths of their records
    turns = int(min(len(curve.ay) / curve.rate * curve.hz for curve in curves) + 1e-6)
    for curve in curves:
        count = whole_revolutions(len(curve.ay), curve.rate, curve.hz)
        equal = round(turns / curve.hz * curve.rate) if turns else count
        freq, amplitude = spectrum(curve.ay[:equal], curve.rate)
        inside = (freq > 0) & (freq <= 1.05 * LOW_RANGE_HZ)
        low.plot(freq[inside], amplitude[inside], linewidth=0.9, label=curve.label, **curve.look)
        begin = 0 if curve.marker == "o" else MARK_EVERY // 2  # marks of the two curves alternate
        mark = {"marker": curve.marker, "markersize": 4, "markeredgecolor": BLACK, "markeredgewidth": 0.5}
        look = curve.look | mark | {"linewidth": 1.1, "zorder": 3, "label": curve.label}
        complete.plot(*in_bands(curve.ay[:count], curve.rate, curve.hz), **look, markevery=(begin, MARK_EVERY))
    words = {"xlabel": "frequency (Hz)", "ylabel": "amplitude (g)"}
    low.set(**words, xlim=(0, LOW_RANGE_HZ), title="lines of equally many whole turns of the loop")
    low.set_ylim(bottom=0)
    title = f"root mean square in bands of {BAND_HZ:g} Hz"
    complete.set(**words, yscale="log", xlim=(0, 0.5 * curves[0].rate), title=title)


def _draw_main(ax: Axes, curve: _Curve, near: tuple[float, float], free: tuple[float, float]) -> None:
    """Draw lines of the FFT, the continuous spectrum that they sample, and the dominant peak, also bin-free (Hz, g)."""
    ay, colour = curve.ay - np.mean(curve.ay), curve.look["color"]
    sums = scipy.signal.zoom_fft(ay, near, m=DENSE, fs=curve.rate, endpoint=True)
    look = curve.look | {"marker": curve.marker, "markersize": 3.5, "linewidth": 0.8, "label": curve.label}
    ax.plot(np.linspace(*near, DENSE), 2 / len(ay) * np.abs(sums), **look, markevery=[])
    freq, lines = spectrum(curve.ay, curve.rate)
    inside = (freq >= near[0]) & (freq <= near[1])
    ax.vlines(freq[inside], 0, lines[inside], color=colour, linewidth=0.6)
    ax.plot(freq[inside], lines[inside], linestyle="none", marker=curve.marker, markersize=3.5, color=colour)
    filled = {"markersize": 5, "markeredgecolor": BLACK, "markeredgewidth": 0.6}
    hollow = {"markersize": curve.hollow_size, "markerfacecolor": "none", "markeredgewidth": 1.2}
    common = {"linestyle": "none", "marker": curve.marker, "color": colour, "zorder": 4}
    line = main_line(curve.ay, curve.rate, curve.hz)
    for name, (hz, g), look in (("FFT", line, filled), ("bin-free", free, hollow)):
        ax.plot(hz, g, **common, **look, label=f"{name}: {hz:.4f} Hz, {g:.3f} g")

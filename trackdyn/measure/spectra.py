"""Statistics and spectra of an evenly sampled signal of any unit; `InputError` for less than two finite samples."""

import numpy as np
import scipy  # subpackages are loaded at first use: together they take half a second

from trackdyn.inputs.errors import InputError, shown

LEAST_PERIODS = 2.0  # periods of a line in its record
LOW_RANGE_HZ = 2.0  # range that is drawn line by line
BAND_HZ = 2.0  # width of the bands over the whole range, to half a turn of the loop
HIGH_HZ = 20.0  # above the lines of the loop and of the pitches: content of impacts
_HARMONICS = 8
# fundamentals times samples, some ten minutes at 1 kHz, beyond which scipy.signal is faster in spite of its import
MOST_TERMS = 100_000_000
_GRID_PER_LOBE = 4  # grid points in one bin's width of the highest harmonic


def rms(a) -> float:
    """Return the root mean square of a signal (N,) (Sect. 5)."""
    return float(np.sqrt(np.mean(_signal(a) ** 2)))


def standard_deviation(a) -> float:
    """Return the standard deviation about the mean, with 1/N, of a signal (N,) (Sect. 5)."""
    return float(np.std(_signal(a)))


def spectrum(a, rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the single-sided amplitude spectrum of a signal (N,) with a rectangular window.

    It has (N // 2 + 1,) frequencies, Hz, and amplitudes: ``|X0|/N`` for the mean and ``2|Xk|/N`` for ``1 <= k < N/2``.
    The Nyquist bin of an even N has no mirror image: ``|X|/N``.
    """
    a = _signal(a)
    amplitude = np.abs(np.fft.rfft(a)) * (2.0 / a.size)
    amplitude[0] *= 0.5
    if a.size % 2 == 0:
        amplitude[-1] *= 0.5
    return np.fft.rfftfreq(a.size, 1.0 / rate_hz), amplitude


def in_bands(a, rate_hz: float, loop_hz: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the centre frequencies (Hz) of bands of 2 Hz, and the RMS of a signal in each, without its mean.

    Unlike the number and heights of lines, the RMS of a band does not depend on the length of the record. Bands end
    half way between two harmonics of ``loop_hz`` (Hz), where whole turns of the loop have no line; frequencies above
    the last whole band are left out.
    """
    freq, amplitude = spectrum(a, rate_hz)
    width = max(BAND_HZ, freq[1])  # of a short record one line
    if loop_hz:
        width = max(round(width / loop_hz), 1) * loop_hz
    edges = np.arange(0.5 * loop_hz, freq[-1], width)
    power, _ = np.histogram(freq[1:], edges, weights=0.5 * amplitude[1:] ** 2)
    return edges[:-1] + 0.5 * width, np.sqrt(power)


def holds_line(samples: int, rate_hz: float, hz: float) -> bool:
    """Return whether a number of samples contains two periods of ``hz`` (Hz), which a line needs."""
    return samples / rate_hz * hz >= LEAST_PERIODS - 1e-6


def main_line(a, rate_hz: float, loop_hz: float) -> tuple[float, float]:
    """Return frequency (Hz) and amplitude of the highest bin of `spectrum` within half of ``loop_hz`` (Hz) around it.

    Both have a scalloping loss; see `main_line_binfree`. The bins on both sides of ``loop_hz`` are included.
    """
    half = max(0.5 * loop_hz, rate_hz / _signal(a).size)
    return highest_line(a, rate_hz, loop_hz - half, loop_hz + half)


def highest_line(a, rate_hz: float, low_hz: float, high_hz: float) -> tuple[float, float]:
    """Return frequency (Hz) and amplitude of the highest bin of `spectrum` in a band (else `InputError`) but 0 Hz."""
    freq, amplitude = spectrum(a, rate_hz)
    inside = np.flatnonzero((freq >= low_hz) & (freq <= high_hz) & (freq > 0.0))
    if inside.size == 0:
        remedy = f"(the lines are {freq[1]:g} Hz apart): widen the band or use a longer record."
        raise InputError(f"no line of the spectrum lies between {low_hz:g} and {high_hz:g} Hz {remedy}")
    k = inside[np.argmax(amplitude[inside])]
    return float(freq[k]), float(amplitude[k])


def main_line_binfree(a, rate_hz: float, expected_hz: float) -> tuple[float, float, float]:
    """Return frequency, amplitude and phase of the dominant peak, free of scalloping loss and leakage.

    They are a least-squares fit of an offset, a sine and its harmonics up to the eighth; the frequency is searched on a
    fine grid around ``expected_hz`` first, since the harmonics give the misfit many local minima, and then refined. The
    line is ``amplitude cos(2 pi hz t + phase)`` with t = 0 at the first sample; phase in (-pi, pi], rad. Raises
    `InputError`: the signal is constant, has fewer than two periods, or too few samples per period.
    """
    a = _signal(a)
    a = a - np.mean(a)
    if np.max(np.abs(a)) == 0.0:
        raise InputError("the signal is constant and has no line: use a record of the moving track.")
    bin_hz, seconds = rate_hz / a.size, a.size / rate_hz
    if not holds_line(a.size, rate_hz, expected_hz):
        few = f"has fewer than two periods of {expected_hz:g} Hz"
        raise InputError(f"the record of {seconds:g} s {few}: use a longer record.")
    # above half of the line, whose harmonics would fit the signal as well
    half_width = min(max(bin_hz, 0.05 * expected_hz), expected_hz / 3)
    highest = expected_hz + half_width
    harmonics = min(_HARMONICS, int(np.ceil(0.5 * rate_hz / highest)) - 1)
    if harmonics < 1 or 2 * harmonics + 1 >= a.size:
        raise InputError(f"{expected_hz:g} Hz is too high for a sampling rate of {rate_hz:g} Hz: sample faster.")

    def fitted(hz, sums=_fourier_sums):
        return _fit_harmonics(sums(a, hz, rate_hz, harmonics), hz, rate_hz, a.size)

    points = 2 * int(np.ceil(half_width / bin_hz * harmonics * _GRID_PER_LOBE)) + 1
    grid = np.linspace(expected_hz - half_width, highest, points)
    # vertices of parabolas through three points that approach each other; `scipy.optimize` takes 0.2 s to import
    hz, step = grid[np.argmax(fitted(grid, _grid_sums)[0])], grid[1] - grid[0]
    while step > 1e-7 * bin_hz:
        below, middle, above = fitted(hz + step * np.array([-1.0, 0.0, 1.0]))[0]
        bend = 2.0 * middle - below - above
        hz += 0.5 * step * (np.clip((above - below) / bend, -2.0, 2.0) if bend > 0.0 else np.sign(above - below))
        step *= 0.1
    first, middle_s = fitted(np.array([hz]))[1][0, harmonics + 1], 0.5 * (a.size - 1) / rate_hz
    phase = np.angle(first * np.exp(-2j * np.pi * hz * middle_s))
    return float(hz), float(2.0 * np.abs(first)), float(phase)


def high_passed(a, rate_hz: float) -> np.ndarray:
    """Return (n, ...) signals without their mean and their content below 20 Hz; whole periods are not needed.

    If the end of a record differs from its beginning, its periodic continuation has a jump with content at all
    frequencies. The signals are therefore extended at both ends by their reflection in the end point, which keeps value
    and slope, with a fade-out (Hann). Content of 10 to 28 pitch passages cut from a long record agrees with that of the
    same passages within it to 0.3 %; without the extension it is up to 9 % too high.
    """
    a = np.asarray(a, dtype=float)
    a = a - a.mean(axis=0)
    n, ramp = len(a), np.expand_dims(np.hanning(2 * len(a) + 1)[: len(a) - 1], tuple(range(1, a.ndim)))
    before, after = (2 * a[:1] - a[:0:-1]) * ramp, (2 * a[-1:] - a[-2::-1]) * ramp[::-1]
    extended = np.concatenate([before, a, after])
    lines = np.fft.rfft(extended, axis=0)
    lines[np.fft.rfftfreq(len(extended), 1.0 / rate_hz) < HIGH_HZ] = 0.0
    return np.fft.irfft(lines, len(extended), axis=0)[n - 1 : 2 * n - 1]


def high_frequency_rms(a, rate_hz: float) -> float:
    """Return the RMS of whole periods at and above 20 Hz, by Parseval's sum over the spectrum."""
    a = _signal(a)
    freq, amplitude = spectrum(a, rate_hz)
    power = 0.5 * amplitude**2  # of a sine; the Nyquist line of an amplitude A carries A^2
    if a.size % 2 == 0:
        power[-1] *= 2.0
    return float(np.sqrt(np.sum(power[freq >= HIGH_HZ])))


def _signal(a):
    """Return the signal as a float array; `InputError` if it is none."""
    try:
        values = np.asarray(a)
        real = values.dtype.kind in "iufb" and values.ndim == 1 and values.size > 1 and np.isfinite(values).all()
    except ValueError:  # rows of different lengths
        real = False
    if not real:
        raise InputError(f"the signal, {shown(a)}, is not a series of finite numbers: use two or more, one per sample.")
    return values.astype(float)


def _grid_sums(a, grid, rate_hz, harmonics):
    """Return `_fourier_sums` at equally spaced fundamentals (m,); of long records by the chirp z-transform."""
    if grid.size * a.size <= MOST_TERMS:
        return _fourier_sums(a, grid, rate_hz, harmonics)
    ends = np.multiply.outer(np.arange(1, harmonics + 1), grid[[0, -1]])
    return np.stack([scipy.signal.zoom_fft(a, end, m=grid.size, fs=rate_hz, endpoint=True) for end in ends], axis=1)


def _fourier_sums(a, hz, rate_hz, harmonics):
    """Return the (m, harmonics) Fourier sums of ``a`` at fundamentals (m,), with phases from the first sample."""
    # the phase of a sample is that of its block plus that in the block: twice the root of N exponentials suffice
    block = int(np.ceil(np.sqrt(a.size)))
    rows = np.pad(a, (0, -a.size % block)).reshape(-1, block)
    phase_step = -2j * np.pi / rate_hz * np.multiply.outer(hz, np.arange(1, harmonics + 1))[..., None]
    # BLAS would start a thread per core every time
    within = np.einsum("bw,mhw->mhb", rows, np.exp(phase_step * np.arange(block)))
    return (within * np.exp(phase_step * (block * np.arange(len(rows))))).sum(-1)


def _fit_harmonics(correlation, hz, rate_hz, n):
    """Fit offset and harmonics to a mean-free signal by least squares, at fundamentals ``hz`` (m,), from Fourier sums.

    Return the (m,) sums of squares, and (m, 2 H + 1) coefficients with time zero in the middle of the record.
    """
    order = np.arange(1, correlation.shape[1] + 1)
    # With time counted from the middle the normal matrix is real: Dirichlet kernels.
    centred = correlation * np.exp(1j * np.pi * (n - 1) / rate_hz * np.outer(hz, order))
    rhs = np.concatenate([centred.conj()[:, ::-1], np.zeros((len(hz), 1)), centred], axis=1)
    all_orders = np.arange(-order[-1], order[-1] + 1)
    difference = all_orders[None, :] - all_orders[:, None]
    half = np.pi * difference * (hz / rate_hz)[:, None, None]  # below pi: the sine is 0 only on the diagonal
    normal = np.divide(np.sin(n * half), np.sin(half), out=np.full(half.shape, float(n)), where=difference != 0)
    coefficient = np.linalg.solve(normal, rhs[:, :, None])[:, :, 0]
    return np.real(np.sum(rhs.conj() * coefficient, axis=1)), coefficient

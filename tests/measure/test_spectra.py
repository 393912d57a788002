"""Statistics and spectra against closed forms."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.conftest import refused
from trackdyn.measure import spectra

RATE = 1000.0
RECORD = 90_000


def sine(hz, n=RECORD, amplitude=1.0, phase=0.0, offset=0.0):
    return offset + amplitude * np.cos(2.0 * np.pi * hz * np.arange(n) / RATE + phase)


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])  # a busy machine is no failure
@given(arrays(float, st.integers(2, 300), elements=st.floats(-100.0, 100.0)))
def test_parseval(a):
    assert spectra.rms(a) == pytest.approx(np.hypot(spectra.standard_deviation(a), np.mean(a)), rel=1e-9, abs=1e-12)
    above_mean = spectra.high_frequency_rms(a, spectra.HIGH_HZ * a.size)  # the first line is at the corner
    assert above_mean == pytest.approx(spectra.standard_deviation(a), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("n", [500, 501])
def test_spectrum_of_a_sine_on_a_bin(n):
    freq, amplitude = spectra.spectrum(sine(40.0 * RATE / n, n=n, amplitude=1.7, offset=-0.6), RATE)
    assert len(freq) == n // 2 + 1 and freq[40] == pytest.approx(40.0 * RATE / n)
    expected = np.zeros(n // 2 + 1)
    expected[0], expected[40] = 0.6, 1.7
    np.testing.assert_allclose(amplitude, expected, atol=1e-12)


def test_sine_half_way_between_bins_falls_to_two_over_pi_and_is_recovered():
    hz = 11.5 * RATE / RECORD
    a = sine(hz, amplitude=1.2, phase=0.4, offset=0.9)
    bin_hz, bin_amplitude = spectra.main_line(a, RATE, 0.8 * hz)
    assert round(bin_hz * RECORD / RATE) in (11, 12)
    assert bin_amplitude / 1.2 == pytest.approx(2.0 / np.pi, abs=0.03)
    assert spectra.main_line_binfree(a, RATE, 1.03 * hz) == pytest.approx((hz, 1.2, 0.4), rel=1e-6)


@pytest.mark.parametrize("bins", [5.5, 15.004, 21.5])
def test_bin_free_estimate_of_a_periodic_signal_with_harmonics(bins, phase=3.0):
    """The loop signal: a fundamental and eight harmonics with noise that the chain's contacts add."""
    hz = bins * RATE / RECORD
    a = sine(hz, amplitude=1.1, phase=phase, offset=1.0)
    for h, amplitude in enumerate((0.3, 0.7, 0.1, 0.4, 0.2, 0.25, 0.05), start=2):
        a += sine(h * hz, amplitude=amplitude, phase=h * 1.3)
    *line, line_phase = spectra.main_line_binfree(a, RATE, 1.02 * hz)
    assert line == [pytest.approx(hz, rel=1e-6), pytest.approx(1.1, rel=1e-5)]
    assert np.angle(np.exp(1j * (line_phase - phase))) == pytest.approx(0.0, abs=1e-4)
    noisy = a + np.random.default_rng(5).normal(0.0, 3.0, RECORD)
    assert spectra.main_line_binfree(noisy, RATE, 1.02 * hz)[0] == pytest.approx(hz, rel=1e-3)


def test_bin_free_estimate_survives_the_local_minima_of_strong_harmonics():
    n, bin_hz = 9000, RATE / 9000
    for seed in range(40):
        rng = np.random.default_rng(seed)
        hz = rng.uniform(5.0, 24.0) * bin_hz
        a = sine(hz, n=n, amplitude=1.1, phase=0.7)
        for h in range(2, 9):
            a += sine(h * hz, n=n, amplitude=6.0, phase=rng.uniform(-3.0, 3.0))
        line = spectra.main_line_binfree(a, RATE, expected_hz=hz + rng.uniform(-0.9, 0.9) * bin_hz)
        assert line == pytest.approx((hz, 1.1, 0.7), rel=1e-5), seed


def test_long_records_take_the_chirp_transform_to_the_same_line(monkeypatch):
    """Fourier sums as they are defined are the reference of both."""
    hz = 0.12781
    a = sine(hz, n=90_000, amplitude=1.2, phase=0.4) + sine(3 * hz, n=90_000, amplitude=0.7)
    a += np.random.default_rng(3).normal(0.0, 2.0, len(a))
    grid = np.linspace(0.12, 0.135, 7)
    turns = np.exp(-2j * np.pi * np.arange(len(a)) / RATE * grid[:, None, None] * np.arange(1, 4)[:, None])
    defined = (a * turns).sum(-1)
    lines = {}
    for most in (0, 10**12):
        monkeypatch.setattr(spectra, "MOST_TERMS", most)
        assert spectra._grid_sums(a, grid, RATE, 3) == pytest.approx(defined, rel=0, abs=1e-9 * np.abs(a).sum())
        lines[most] = spectra.main_line_binfree(a, RATE, 0.1275)
    # the search begins at the same point of the grid
    assert lines[0] == lines[10**12]


@pytest.mark.parametrize("hz", [0.5, 1.5, 6.0])  # slow loops and fast ones
def test_main_line_is_that_around_the_frequency_of_the_loop(hz):
    a = sine(hz, amplitude=1.0, offset=50.0) + sine(4 * hz, amplitude=9.0)
    assert spectra.main_line(a, RATE, 1.1 * hz) == pytest.approx((hz, 1.0))
    assert spectra.highest_line(a, RATE, 0.0, 25.0) == pytest.approx((4 * hz, 9.0))
    # the bins on both sides of the loop's frequency are looked at, however short the record
    assert spectra.main_line(sine(0.5, n=3000), RATE, 0.5)[0] in (pytest.approx(1 / 3), pytest.approx(2 / 3))


ARGUMENTS = {
    spectra.rms: (), spectra.standard_deviation: (), spectra.spectrum: (RATE,), spectra.main_line: (RATE, 0.5),
    spectra.main_line_binfree: (RATE, 0.5), spectra.high_frequency_rms: (RATE,),
}  # fmt: skip


@pytest.mark.parametrize("function", ARGUMENTS)
@pytest.mark.parametrize("a", [[], [1.0, np.nan, 2.0], np.zeros((3, 2)), ["a", "b"], [[1.0, 2.0], [3.0]]], ids=str)
def test_unusable_signals_are_refused_in_one_sentence(function, a):
    refused(function, a, *ARGUMENTS[function], words=["not a series of finite numbers: use two or more"])


@pytest.mark.parametrize(("function", "a", "hz", "word"), [
    (spectra.highest_line, sine(10.0, n=1000), (0.1, 0.2), "longer record"),
    (spectra.main_line_binfree, np.ones(RECORD), (0.5,), "constant"),
    (spectra.main_line_binfree, sine(10.0, n=1000), (1.5,), "fewer than two periods"),
    (spectra.main_line_binfree, sine(10.0, n=1000), (499.9,), "too high"),
    (spectra.main_line_binfree, sine(10.0, n=1000), (0.0,), "fewer than two periods of 0 Hz"),
])  # fmt: skip
def test_unusable_arguments_are_refused(function, a, hz, word):
    refused(function, a, RATE, *hz, words=[word])


def test_high_frequency_rms_counts_from_the_corner_on():
    slow, fast = sine(5.0, amplitude=2.0, offset=1.0), sine(100.0, amplitude=0.5)
    at_corner, below_it = (spectra.high_frequency_rms(slow + sine(hz) + fast, RATE) for hz in (20.0, 19.5))
    assert at_corner == pytest.approx(np.sqrt(0.5 + 0.125), rel=1e-9)
    assert below_it == pytest.approx(np.sqrt(0.125), rel=1e-9)


@pytest.mark.parametrize("hz", [0.3, 3.0])
def test_content_above_the_corner_does_not_depend_on_where_a_record_ends(hz):
    """Slow lines of 1 g, cut anywhere, leave 0.3 % of content of 0.14 g; a spectrum of the record has 2 % and more."""
    leaked = []
    for n in range(2000, 3000, 37):
        slow = sine(hz, n=n, amplitude=1.2, phase=0.3) + sine(2 * hz, n=n, amplitude=0.4, phase=1.0)
        fast = sine(47.3, n=n, amplitude=0.2)
        a, content = slow + fast, spectra.rms(fast)
        assert spectra.rms(spectra.high_passed(a, RATE)) == pytest.approx(content, rel=3e-3), n
        leaked.append(spectra.high_frequency_rms(a, RATE) / content - 1)
    assert max(leaked) > 0.02


@pytest.mark.parametrize(("periods", "held"), [(1.8, False), (1.999, False), (2.0, True), (2.2, True)])
def test_a_line_needs_two_periods(periods, held):
    assert spectra.holds_line(round(1000 * periods), 1000.0, 1.0) == held

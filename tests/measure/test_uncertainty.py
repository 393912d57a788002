"""Standard errors against independent replicas of processes whose truth is known.

Ranges of coverage were written before the first run: of 400 intervals of 95 % 90 to 98 % shall hold the truth (three
standard errors of the count are 3.3 %, and batches are a little too sure), of those of correlated passages 85 to 99 %.
"""

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter
from scipy.stats import t as student

from trackdyn.measure import uncertainty
from trackdyn.measure.columns import METRIC_COLUMNS
from trackdyn.measure.estimators import sensor_metrics
from trackdyn.measure.uncertainty import batch_degrees, batch_error, line_error, ratio_values, turn_error

RATE, SAMPLES, TURNS, REPLICAS = 250.0, 500.37, 12, 400  # samples of a revolution, not a whole number
LOOP_HZ = RATE / SAMPLES


def memory(rng, count, share):
    """``count`` values of unit variance, each ``share`` of the one before."""
    before = [share * rng.standard_normal()]
    return lfilter([np.sqrt(1 - share**2)], [1, -share], rng.standard_normal(count), zi=before)[0]


def test_errors_cover_the_truth_of_correlated_passages():
    rng, covered, naive = np.random.default_rng(5), 0, 0
    for _ in range(REPLICAS):
        values = memory(rng, 400, 0.5)
        covered += abs(values.mean()) <= batch_error(values)[1]
        naive += abs(values.mean()) <= 1.96 * values.std(ddof=1) / np.sqrt(len(values))
    assert 0.85 <= covered / REPLICAS <= 0.99
    assert naive / REPLICAS < 0.8  # coverage if the memory were left out


def test_an_interval_of_any_number_of_batches_is_student_s():
    degrees = [*range(1, 60), 999, 1000]
    for confidence in (0.68, 0.95):
        widths = [uncertainty.student(count, confidence) for count in degrees]
        np.testing.assert_allclose(widths, student.ppf(0.5 + confidence / 2, degrees), rtol=1e-11)
    assert np.isnan(uncertainty.student(0)) and uncertainty.student(10**9) == pytest.approx(1.96, rel=2e-3)


def test_errors_of_a_ratio_cover_the_truth():
    """Squares over times that grow together, as a longer contact does: their ratio is 3."""
    rng, rows = np.random.default_rng(6), []
    for _ in range(REPLICAS):
        times = 1 + 0.2 * memory(rng, 400, 0.3)
        squares = 3 * times + 0.1 * memory(rng, 400, 0.3)
        values = ratio_values(squares, times)
        assert values.mean() == pytest.approx(squares.sum() / times.sum())
        error, half_width = batch_error(values)
        rows.append((abs(values.mean() - 3) <= half_width, error < 0.5 * batch_error(squares)[0]))
    covered, apart = np.mean(rows, axis=0)
    assert 0.85 <= covered <= 0.99 and apart > 0.95  # scatter that both have in common does not count


@pytest.mark.parametrize(("count", "degrees"), [(2, 1), (3, 2), (4, 2), (6, 3), (16, 5), (100, 13)])
def test_batches_overlap_and_their_degrees_are_those_of_the_scatter_of_errors(count, degrees):
    """Batches of the root of the number; mean square and variance of 3,000 errors of independent values."""
    rows = np.random.default_rng(1).standard_normal((3000, count))
    size = int(np.sqrt(count))
    means = np.array([rows[0, first : first + size].mean() for first in range(count - size + 1)])
    off = ((means - rows[0].mean()) ** 2).sum() * size / ((count - size + 1) * (count - size))
    assert batch_error(rows[0])[0] == pytest.approx(np.sqrt(off))
    assert batch_error(rows[0])[1] == pytest.approx(student.ppf(0.975, degrees) * np.sqrt(off))
    squared = np.array([batch_error(row)[0] ** 2 for row in rows])
    assert batch_degrees(count) == degrees == pytest.approx(2 * squared.mean() ** 2 / squared.var(), rel=0.2)
    # the variance of a mean of independent values; of chi-square with one degree sqrt(2 / 3000) is 2.6 %
    assert count * squared.mean() == pytest.approx(1.0, abs=0.08)


@pytest.mark.parametrize(("period", "ratio", "batched"), [(2.0, 0.12, 1.0), (7.0, 1.2, 0.95), (11.0, 2.3, 1.85)])
def test_errors_of_four_turns_are_those_of_their_pairs(period, ratio, batched):
    """A vibration with a period of some turns: scatter over the error of independent turns, and over ours."""
    rng = np.random.default_rng(2)
    windows = np.cos(2 * np.pi * np.arange(4) / period + rng.uniform(0, 2 * np.pi, (2000, 1)))
    windows += 0.1 * rng.standard_normal(windows.shape)
    scatter = windows.mean(axis=1).std()
    assert scatter / np.sqrt(windows.var(axis=1, ddof=1).mean() / 4) == pytest.approx(ratio, rel=0.05)
    errors = [batch_error(row)[0] for row in windows]
    assert scatter / np.sqrt(np.mean(np.square(errors))) == pytest.approx(batched, rel=0.05)


def square_ratio(values, errors):
    """Mean square of errors that are said, over the variance of the values."""
    return np.square(errors).mean() / np.var(values, ddof=1)


@pytest.mark.parametrize("turns", [2, 3, 4])
def test_errors_over_turns_have_the_size_of_the_scatter_of_many_windows(turns):
    """The mean square of what is said is the variance of 3,000 windows: with one degree too many it is 1/2 to 3/4."""
    rng, samples = np.random.default_rng(12), 16
    signals = 1.0 + 0.1 * np.repeat(rng.standard_normal((3000, turns)), samples, axis=1)
    ratio = square_ratio(signals.mean(axis=1), [turn_error(row, samples, np.mean) for row in signals])
    assert ratio == pytest.approx(1.0, abs=0.12)  # of chi-square with one degree: sqrt(2 / 3000) is 2.6 %


@pytest.mark.parametrize("turns", [3, 4])
def test_errors_of_the_line_have_the_size_of_the_scatter_of_many_windows(turns):
    """Amplitude and phase of turns scatter on their own; three turns leave the frequency one degree of freedom."""
    rng, samples, rate = np.random.default_rng(13), 32, 32.0
    angle = 2 * np.pi * np.arange(samples * turns) / samples
    rows = []
    for _ in range(2000):
        size, late = (np.repeat(0.01 * rng.standard_normal(turns), samples) for _ in range(2))
        a = (1 + size) * np.cos(angle + late)
        error = line_error(a, rate, 1.0, 1.0)
        amplitude = 2 * abs((a * np.exp(-1j * angle)).reshape(turns, -1).mean(axis=1)).mean()
        rows.append((amplitude, error.amplitude, error.beyond_hz, error.hz))
    amplitudes, their_errors, slopes, slope_errors = np.transpose(rows)
    assert square_ratio(amplitudes, their_errors) == pytest.approx(1.0, abs=0.15)
    assert square_ratio(slopes, slope_errors) == pytest.approx(1.0, abs=0.15)


def record(rng, partial=0.4):
    """Twelve revolutions and a fraction of a line and a harmonic at 25 Hz, which scatter by revolution, and noise."""
    time = np.arange(round((TURNS + partial) * SAMPLES)) / RATE
    size, late, sharp = (rng.standard_normal(TURNS + 1)[(time * LOOP_HZ).astype(int)] for _ in range(3))
    line = (1 + 0.02 * size) * np.cos(2 * np.pi * LOOP_HZ * time + 0.3 + 0.01 * late)
    return line + (0.2 + 0.01 * sharp) * np.cos(2 * np.pi * 50 * LOOP_HZ * time) + 0.01 * rng.standard_normal(len(time))


@pytest.fixture(scope="module")
def replicas():
    """Measures of independent records."""
    rng = np.random.default_rng(7)
    return pd.DataFrame([sensor_metrics(record(rng), RATE, LOOP_HZ) for _ in range(REPLICAS)])


@pytest.mark.parametrize("name", ["rms_g", "sd_g", "line_g", "line_hz_binfree", "line_g_binfree", "high_frequency_g"])
def test_intervals_of_the_sensors_measures_hold_the_truth(replicas, name):
    """The truth is the mean of all replicas, twenty times closer to it than one of them."""
    values, errors = replicas[name], replicas[METRIC_COLUMNS[name][3]]
    degrees = TURNS - 2 if "hz" in name else batch_degrees(TURNS)
    assert 0.90 <= np.mean(np.abs(values - values.mean()) <= student.ppf(0.975, degrees) * errors) <= 0.98


def test_the_line_of_a_record_that_repeats_has_next_to_no_error():
    time = np.arange(round(12.4 * SAMPLES)) / RATE
    row = sensor_metrics(np.cos(2 * np.pi * LOOP_HZ * time), RATE, LOOP_HZ)
    # revolutions end within half a sample, of which the line turns by 2 pi / 1000
    for name in ("rms_error_g", "line_error_g", "line_error_g_binfree"):
        assert row[name] < np.pi / SAMPLES
    assert row["line_error_hz_binfree"] < 1e-3 * row["line_error_hz"]
    assert row["line_error_hz"] == pytest.approx(RATE / len(time) / np.sqrt(12))
    assert abs(row["line_hz"] - LOOP_HZ) < np.sqrt(3) * row["line_error_hz"]


def test_a_bin_of_a_harmonic_has_the_error_of_that_harmonic():
    """The second line is the highest and scatters by 5 %, the first one does not."""
    time = np.arange(round((TURNS + 0.1) * SAMPLES)) / RATE
    size, line = 1 + 0.05 * np.random.default_rng(3).standard_normal(TURNS + 1), 2 * np.pi * LOOP_HZ * time
    a = 0.1 * np.cos(line) + size[(time * LOOP_HZ).astype(int)] * np.cos(2 * line)
    error = line_error(a, RATE, 2 * LOOP_HZ, LOOP_HZ)
    assert error.bin_amplitude == pytest.approx(batch_error(size[:TURNS])[0], rel=0.02)
    assert error.amplitude < 0.1 * error.bin_amplitude


def test_too_few_revolutions_have_no_error():
    a = np.cos(2 * np.pi * LOOP_HZ * np.arange(round(2.4 * SAMPLES)) / RATE)
    error = line_error(a, RATE, LOOP_HZ, LOOP_HZ)
    assert np.isnan(error.hz) and np.isfinite(error.amplitude)
    assert np.isnan(line_error(a[: round(1.5 * SAMPLES)], RATE, LOOP_HZ, LOOP_HZ).amplitude)
    assert np.isnan(batch_error([1.0])).all()

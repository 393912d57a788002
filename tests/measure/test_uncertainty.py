"""Standard errors against independent replicas of processes whose truth is known.

The ranges of coverage were written before the first run: of 400 intervals of 95 % between 90 and 98 % shall hold the
truth (three standard errors of the count are 3.3 %, and batches of finite length are a little too sure). Correlated
passages have 85 to 99 %.
"""

import numpy as np
import pytest
from scipy.stats import t as student

from trackdyn.measure import uncertainty
from trackdyn.measure.taken import sensor_metrics
from trackdyn.measure.uncertainty import batch_error, line_error, ratio_values

RATE, SAMPLES, TURNS, REPLICAS = 250.0, 500.37, 12, 400  # samples of a revolution, not a whole number
LOOP_HZ = RATE / SAMPLES


def memory(rng, count, share):
    """``count`` values of unit variance, each ``share`` of the one before."""
    values, last = np.empty(count), rng.standard_normal()
    for i, noise in enumerate(rng.standard_normal(count)):
        last = values[i] = share * last + np.sqrt(1 - share**2) * noise
    return values


def test_errors_cover_the_truth_of_correlated_passages():
    rng, covered, naive = np.random.default_rng(5), 0, 0
    for _ in range(REPLICAS):
        values = memory(rng, 400, 0.5)
        covered += abs(values.mean()) <= batch_error(values)[1]
        naive += abs(values.mean()) <= 1.96 * values.std(ddof=1) / np.sqrt(len(values))
    assert 0.85 <= covered / REPLICAS <= 0.99
    assert naive / REPLICAS < 0.8  # coverage if the memory were left out


def test_an_interval_of_any_number_of_batches_is_student_s():
    batches = [*range(2, 60), 1000, 1001]
    widths = [uncertainty.student(count) for count in batches]
    np.testing.assert_allclose(widths, student.ppf(0.975, np.array(batches) - 1), rtol=1e-11)


def test_errors_of_a_ratio_cover_the_truth():
    """Squares over times that grow together, as a longer contact does: their ratio is 3."""
    rng, covered, apart = np.random.default_rng(6), 0, 0
    for _ in range(REPLICAS):
        times = 1 + 0.2 * memory(rng, 400, 0.3)
        squares = 3 * times + 0.1 * memory(rng, 400, 0.3)
        values = ratio_values(squares, times)
        assert values.mean() == pytest.approx(squares.sum() / times.sum())
        error, half_width = batch_error(values)
        covered += abs(values.mean() - 3) <= half_width
        apart += error < 0.5 * batch_error(squares)[0]
    assert 0.85 <= covered / REPLICAS <= 0.99
    assert apart > 0.95 * REPLICAS  # scatter that both have in common does not count


def record(rng, partial=0.4):
    """Twelve revolutions and a fraction: a line and a harmonic at 25 Hz.

    The line's amplitude and phase and the content at 25 Hz scatter from revolution to revolution; noise is added.
    """
    time = np.arange(round((TURNS + partial) * SAMPLES)) / RATE
    revolution = (time * LOOP_HZ).astype(int)
    size, late, sharp = (rng.standard_normal(TURNS + 1)[revolution] for _ in range(3))
    line = (1 + 0.02 * size) * np.cos(2 * np.pi * LOOP_HZ * time + 0.3 + 0.01 * late)
    return line + (0.2 + 0.01 * sharp) * np.cos(2 * np.pi * 50 * LOOP_HZ * time) + 0.01 * rng.standard_normal(len(time))


@pytest.fixture(scope="module")
def replicas():
    """Rows of measures of independent records."""
    rng = np.random.default_rng(7)
    return [sensor_metrics(record(rng), RATE, LOOP_HZ) for _ in range(REPLICAS)]


@pytest.mark.parametrize(
    ("name", "error"),
    [("rms_g", "rms_error_g"), ("sd_g", "sd_error_g"),
     ("line_g", "line_error_g"), ("line_hz_binfree", "line_error_hz_binfree"),
     ("line_g_binfree", "line_error_g_binfree"), ("high_frequency_g", "high_frequency_error_g")],
)  # fmt: skip
def test_intervals_of_the_sensors_measures_hold_the_truth(replicas, name, error):
    """The truth is the mean of all replicas, twenty times closer to it than one of them."""
    values, errors = (np.array([row[column] for row in replicas]) for column in (name, error))
    degrees = TURNS - (2 if "hz" in name else 1)
    covered = np.abs(values - values.mean()) <= student.ppf(0.975, degrees) * errors
    assert 0.90 <= covered.mean() <= 0.98


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
    rng = np.random.default_rng(3)
    time = np.arange(round((TURNS + 0.1) * SAMPLES)) / RATE
    size = 1 + 0.05 * rng.standard_normal(TURNS + 1)
    each = size[(time * LOOP_HZ).astype(int)]
    a = 0.1 * np.cos(2 * np.pi * LOOP_HZ * time) + each * np.cos(4 * np.pi * LOOP_HZ * time)
    error = line_error(a, RATE, 2 * LOOP_HZ, LOOP_HZ)
    assert error.bin_amplitude == pytest.approx(size[:TURNS].std(ddof=1) / np.sqrt(TURNS), rel=0.02)
    assert error.amplitude < 0.1 * error.bin_amplitude


def test_too_few_revolutions_have_no_error():
    time = np.arange(round(2.4 * SAMPLES)) / RATE
    a = np.cos(2 * np.pi * LOOP_HZ * time)
    assert np.isnan(line_error(a, RATE, LOOP_HZ, LOOP_HZ).hz)
    assert np.isfinite(line_error(a, RATE, LOOP_HZ, LOOP_HZ).amplitude)
    assert np.isnan(line_error(a[: round(1.5 * SAMPLES)], RATE, LOOP_HZ, LOOP_HZ).amplitude)
    assert np.isnan(batch_error([1.0])).all()

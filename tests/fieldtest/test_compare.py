"""Comparison with a sensor's record whose loop turns faster, as that of the synthetic one of 210 rpm does."""

import re
from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pandas as pd
import pytest
from scipy.signal import butter, sosfilt

from tests.conftest import refused, run_command
from trackdyn import load_rig, read_sensor, sense, simulate
from trackdyn.fieldtest.axes import judge_axes, require_axes
from trackdyn.fieldtest.compare import compare_with_sensor, doubts_of, in_words, other_speed, sensed_at
from trackdyn.fieldtest.figures import comparison_figure
from trackdyn.fieldtest.sensor_csv import SensorRecord
from trackdyn.fieldtest.sensor_mapping import load_mapping
from trackdyn.measure.estimators import sensor_metrics
from trackdyn.measure.metrics import shown_measures
from trackdyn.measure.sensor import measured_loop_hz
from trackdyn.measure.spectra import rms
from trackdyn.measure.uncertainty import MANY_DEGREES, student, welch_degrees
from trackdyn.plots.style import save


def sensed(ay, ax=None, rate=1000.0, **fields):
    return SensorRecord("sensor.csv", np.arange(len(ay)) / rate, ax, ay, None, rate, 0, **fields)


def waved(hz=0.253, seconds=30.0, amplitude=0.77):
    return sensed(amplitude * np.cos(2 * np.pi * hz * np.arange(round(seconds * 1000)) / 1000))


@pytest.fixture(scope="module")
def recording(make_scene):
    return simulate(make_scene(210.0, duration=10.0, lead_in=1.0))


@pytest.mark.parametrize("rate", [100, 400, 625, 800])
def test_a_sensor_of_any_rate_is_what_the_simulation_would_have_recorded(recording, make_scene, rate):
    """From the run at 1000 Hz, also where that is no multiple, and in runs of their own; signals of 0.5 g."""
    scene = make_scene(210.0, duration=0.4, lead_in=0.1)
    own = sense(simulate(scene.with_(rig=scene.rig.changed(sensor__rate=rate))))
    taken = sensed_at(simulate(scene), rate)
    np.testing.assert_allclose(taken.time, own.time, rtol=1e-12)
    difference = taken.ay - own.ay
    # sums of the same numbers in another order; otherwise content near half of the rate is between samples of 1 ms
    assert np.abs(difference).max() < 1e-6 if rate == 100 else rms(difference) < 0.03 * own.ay.std()
    assert rms(taken.ay[1:] - own.ay[:-1]) > 0.3 * own.ay.std()


@pytest.mark.parametrize("rate", [418.2, 833.0, 1344.0, 2048.0])
def test_a_record_of_any_rate_does_not_differ_from_its_simulation(recording, rate):
    """The sensor's record holds means over its own samples of a signal of lines below 100 Hz."""
    waves = [(0.8, recording.periods.loop_hz, 0.3), (0.3, 27.0, 1.0), (0.05, 90.0, 2.0)]

    def means_of(rate, count):
        edges = np.arange(count + 1) / rate
        return sum(a * np.diff(np.sin(2 * np.pi * f * edges + p)) * rate / (2 * np.pi * f) for a, f, p in waves)

    mean = np.zeros_like(recording.mean)
    mean[:, 0, 1], mean[:, 0, 2] = 9.81 * means_of(1000.0, len(mean)), np.pi / 2
    sensor = sensed(means_of(rate, int(len(mean) / 1000 * rate)), rate=rate)
    table = compare_with_sensor(replace(recording, mean=mean), sensor).set_index("measure")
    assert table.sensor.rate_hz == table.simulation.rate_hz == min(rate, 1000.0)
    assert (table.difference_pct[["rms_g", "sd_g", "high_frequency_g"]].abs() < 0.1).all()
    assert table.sensor.rms_g == pytest.approx(np.sqrt(0.5 * sum(a**2 for a, *_ in waves)), rel=0.01)


def test_a_record_shorter_than_a_turn_or_without_a_line_is_refused_by_name(recording):
    words = ["the record of 3 s ", f" at least {1 / recording.periods.loop_hz:.4g} s"]
    refused(compare_with_sensor, recording, waved(seconds=3.0), start="sensor.csv: ", words=words)
    short = replace(recording, **{name: getattr(recording, name)[:3000] for name in ("time", "mean", "raw")})
    refused(compare_with_sensor, short, waved(), "run.npz", start="run.npz: ", words=words)
    refused(compare_with_sensor, recording, waved(amplitude=0.0), start="sensor.csv: the signal is constant")


def test_a_record_of_two_turns_and_more_has_its_speed_whatever_its_length():
    hz, rate, loop = 0.12781, 100.0, 100.0 / 0.12781
    t = np.arange(3 * round(loop)) / rate
    ay = 1.2 * np.sin(2 * np.pi * hz * t) + 0.3 * np.sin(6 * np.pi * hz * t + 1)
    for n in [*range(round(1.98 * loop), round(2.5 * loop), 3), *range(round(2 * loop) - 5, round(2 * loop) + 5)]:
        measured = measured_loop_hz(ay[:n], rate, hz)
        metrics = sensor_metrics(ay[:n], rate, measured)
        if n >= 2 * loop:
            assert measured == pytest.approx(hz, rel=1e-4), n
        assert np.isfinite(metrics["line_g_binfree"]) == (n >= 2 * loop - 1e-3), n


@pytest.fixture(scope="module")
def synthetic():
    return read_sensor("data/synthetic/210rpm.csv")


@pytest.mark.parametrize(("read", "fits"), [
    ({"ax": "ax", "ay": "ay", "az": "az"}, ""),
    ({"ax": "ax", "ay": "-ay", "az": "az"}, "`axes: {ay: ay_g}` "),
    ({"ax": "-ax", "ay": "-ay"}, "`axes: {ay: ay_g, ax: ax_g}` "),
    ({"ax": "ay", "ay": "ax", "az": "az"}, "`axes: {ay: ay_g, ax: ax_g}` "),
    ({"ax": "ax", "ay": "az", "az": "ay"}, "`axes: {ay: ay_g}` "),
    ({"ay": "ay"}, ""), ({"ay": "-ay"}, "`axes: {ay: ay_g}` "),
    ({"ay": "ax"}, "check its column and sign (`axes: {ay: NAME}`, `axes: {ay: -NAME}`)"),
])  # fmt: skip
def test_a_flipped_or_exchanged_axis_is_noticed(recording, synthetic, read, fits):
    compared = dict.fromkeys(("ax", "ay", "az"))
    for axis, name in read.items():
        compared[axis] = getattr(synthetic, name.strip("-")) * (-1 if name.startswith("-") else 1)
    sensor = replace(synthetic, **compared, columns={axis: f"{name}_g" for axis, name in read.items()})
    doubt = judge_axes(recording, sensor)[0]
    assert fits in doubt if fits else not doubt, doubt
    # without a run, a belt turns through gravity as the chain does
    if fits:
        refused(require_axes, sensor, load_rig(), 210, words=[fits])
    else:
        require_axes(sensor, load_rig(), 210)


@pytest.mark.parametrize("axes", [2, 1])
@pytest.mark.parametrize(("hz", "order"), [(0.3, 1), (0.5, 2), (12.0, 1)])
def test_missing_gravity_is_named_and_only_what_compares_is_compared(recording, hz, order, axes):
    signal, rng = sense(recording), np.random.default_rng(3)
    sections = butter(order, hz, "high", fs=1000, output="sos")
    # behind a high-pass filter that has settled
    passed = sosfilt(sections, np.tile([signal.ax, signal.ay], 2))[:, len(signal.ay) :]
    ax, ay = passed + 0.01 * rng.normal(size=passed.shape)
    sensor = sensed(ay, ax if axes == 2 else None)
    sentence = judge_axes(recording, sensor)[0]
    assert "gravity is missing" in sentence and "AC-coupled" in sentence and "check its column" not in sentence
    table = compare_with_sensor(recording, sensor)
    assert list(table.measure) == ["rate_hz", "clipped", "high_frequency_g"]
    assert abs(table.difference_pct[2]) < 10 and "content from 20 Hz on" in in_words(table)
    assert other_speed(recording, sensor, table) is None
    refused(require_axes, sensor, load_rig(), 210, match="gravity is missing")


@pytest.mark.parametrize("shift", [0.4, -0.5, 7.5])
def test_a_zero_that_is_not_0_is_named(recording, shift):
    signal = sense(recording)
    sensor = sensed(signal.ay + shift, signal.ax)
    for zero, factor in ((0.0, 1.0), (100.0, 1 / 68)):
        sentence = judge_axes(recording, replace(sensor, scales={"ay": (zero, factor)}))[0]
        named = float(sentence.partition("zero: {ay: ")[2].strip("}`"))
        assert named == pytest.approx(zero + shift / factor, abs=0.001 / factor)
    assert not judge_axes(recording, replace(sensor, ay=signal.ay))[0]


@pytest.mark.parametrize(("angle", "size", "words"), [
    (0, 0.5, "gravity turns with 0.5 of its size .* `scale: 4096`"),
    (0, 2, "gravity turns with 2 of its size .* `scale: 16384`"),
    (45, 1, "turned by 45 deg about z .* `turn: 45deg`"),
    (-30, 2, "turned by 30 deg about z and gravity turns with 2 .* `turn: -30deg`.* `scale: 16384`"),
])  # fmt: skip
def test_a_wrong_scale_and_a_turned_sensor_are_named(recording, angle, size, words):
    signal = sense(recording)
    turned = (signal.ax + 1j * signal.ay) * np.exp(1j * np.radians(angle))
    sensor = sensed(size * turned.imag, size * turned.real, scales={"ay": (0.0, 1 / 8192)})
    for at_its_rate in (sensor, sensor.averaged(125.0)):
        assert re.search(words, judge_axes(recording, at_its_rate)[0])
    if angle:
        table = pd.DataFrame({"t_s": signal.time, "ax_g": turned.real, "ay_g": turned.imag})
        for turn in (angle, f"{angle}deg", f"{angle} deg"):
            record = read_sensor(table, load_mapping(turn=turn))
            np.testing.assert_allclose([record.ax, record.ay], [signal.ax, signal.ay], atol=1e-12)
        assert not judge_axes(recording, record)[0]
        half = judge_axes(recording, read_sensor(table, load_mapping(turn=angle - 20)))[0]
        assert f"`turn: {angle}deg`" in half
        words = ["ax must be read, too; name its column"]
        refused(read_sensor, table[["t_s", "ay_g"]], load_mapping(turn=angle), words=words)


def test_the_size_of_the_acceleration_is_no_axis(recording):
    signal = sense(recording)
    size, offset = (sensed(ay, signal.ax) for ay in (np.hypot(signal.ax, signal.ay), signal.ay + 20))
    assert "never below 0, as the size of the acceleration" in judge_axes(recording, size)[0]
    assert "never below 0" not in judge_axes(recording, offset)[0]


@pytest.mark.parametrize("doubt", [None, "ay wraps at the end of its range"])
def test_no_speed_is_advised_where_a_record_is_doubted(recording, doubt):
    """The line of noise is no speed; that of a record which wraps tells nothing, nor do its axes."""
    noise = sensed(np.random.default_rng(0).normal(size=30000))
    marked = replace(noise, doubts=(doubt,) if doubt else ())
    table = compare_with_sensor(recording, marked)
    (sentence,) = doubts_of(recording, marked, table)
    assert "rpm" not in sentence and (doubt or "does not turn through gravity") in sentence
    assert "rpm" in (other_speed(recording, noise, table) or "")


@pytest.mark.parametrize(("seconds", "faster", "seen"), [(30.0, 0.9, True), (12.0, 1.03, True), (30.0, 1.005, False)])
def test_a_record_at_another_speed_is_noticed(recording, seconds, faster, seen):
    sensor = waved(faster * recording.periods.loop_hz, seconds)
    warning = other_speed(recording, sensor, compare_with_sensor(recording, sensor))
    assert (f"compare with a run at {210 * faster:.4g} rpm" in (warning or "")) == seen, warning


def test_differences_have_a_sign_and_their_standard_errors(recording, synthetic):
    table = compare_with_sensor(recording, synthetic).set_index("measure")
    excess = table.simulation.rms_g - table.sensor.rms_g
    errors = np.hypot(table.simulation_error.rms_g, table.sensor_error.rms_g)
    assert table.difference_pct.rms_g == pytest.approx(100 * excess / table.sensor.rms_g)
    assert table.standard_errors.rms_g == pytest.approx(excess / errors) and np.isnan(table.standard_errors.clipped)
    # the errors that are printed, with a thousandth of the RMS by the step, which two turns that repeat do not show
    (printed,) = (row["error"] for row in shown_measures(recording) if row["name"] == "rms_g")
    assert table.simulation_error.rms_g == printed > 1e-4
    # the highest bin depends on the part of a turn with which a record ends
    assert not {"line_hz", "line_g"} & set(table.index) and np.isfinite(table.difference_pct.line_g_binfree)
    words = in_words(table.assign(standard_errors=8.0).reset_index())
    sides = ["above", "below"] if excess > 0 else ["below", "above"]
    assert f"RMS of the simulation {abs(table.difference_pct.rms_g):.3g} % {sides[0]}" in words
    assert "differs by 8 standard errors" in words
    swapped = table.assign(difference_pct=-table.difference_pct, standard_errors=0.5).reset_index()
    assert f"% {sides[1]} the sensor's, within 2 standard errors" in in_words(swapped)


def test_a_difference_of_few_turns_is_judged_by_student_s_factor():
    """Two turns each: one degree of freedom, or two by Welch where the errors are alike; the step's has any number."""
    assert student(welch_degrees(1.0, (1.0, 1))) == pytest.approx(12.706, rel=1e-4)
    assert student(welch_degrees(2**0.5, (1.0, 1), (1.0, 1))) == pytest.approx(4.303, rel=1e-3)
    assert student(welch_degrees(2**0.5, (1.0, 9), (1.0, 9))) == pytest.approx(2.101, rel=1e-3)
    assert welch_degrees(1.0, (0.1, 1)) == welch_degrees(1.0) == welch_degrees(np.nan, (np.nan, 1)) == MANY_DEGREES


def test_a_record_does_not_differ_from_any_part_of_itself(make_scene):
    """Cuts of one turn and more, begun and ended anywhere: of 100 cuts 95 are within four of the errors printed."""
    long = simulate(make_scene(210.0, duration=26.0, lead_in=1.0))
    signal, rng, turn = sense(long), np.random.default_rng(0), long.periods.loop
    assert 5 < long.seconds / turn < 7
    differences, free = [], []
    for _ in range(100):
        count = rng.integers(round(1.02 * turn * long.rate), len(signal.ay) - 100)
        first = rng.integers(0, len(signal.ay) - count)
        ay, ax = (values[first : first + count] for values in (signal.ay, signal.ax))
        table = compare_with_sensor(long, sensed(ay, ax, long.rate)).set_index("measure")
        differences.append(table.standard_errors.abs())
        free.append(rms(ay) / rms(signal.ay) - 1)
    differences = pd.DataFrame(differences)
    names = ["mean_g", "rms_g", "sd_g", "line_hz_binfree", "line_g_binfree", "high_frequency_g"]
    assert ((differences[names] > 4).mean() <= 0.05).all(), differences.describe().loc["max"]
    assert (differences[names].notna().sum() > 50).all()
    assert np.ptp(free) > 0.01  # over all samples, from one cut to another


def test_equal_signals_look_equal_whatever_their_lengths(recording):
    """A line at the third harmonic and one at 90 Hz: twice the record, by a part of a turn more."""
    hz, mean = recording.periods.loop_hz, np.zeros_like(recording.mean)
    phase = 2 * np.pi * hz * np.arange(round(4700 / hz)) / 1000
    ay = sum(a * np.sin(n * phase) for a, n in ((1.0, 1), (0.5, 3), (0.02, 90 // hz)))
    mean[:, 0, 1], mean[:, 0, 2] = 9.81 * ay[: len(mean)], np.pi / 2
    figure = comparison_figure(replace(recording, mean=mean), sensed(ay), "sensor")
    for ax in figure.axes[2:]:
        simulated, measured = (line.get_ydata() for line in ax.lines)
        # the turn of 4 s ends between two samples
        np.testing.assert_allclose(measured, simulated, atol=2e-3 * simulated.max())
    middle, bands = figure.axes[3].lines[0].get_data()
    assert bands[np.argmin(abs(middle - 90))] == pytest.approx(0.02 / 2**0.5, rel=0.01)


def test_the_command_draws_and_writes_the_comparison(recording, tmp_path, monkeypatch):
    recording.save(tmp_path / "run.npz")
    monkeypatch.setattr("trackdyn.plots.style.save", drawing := Mock(wraps=save))
    line = "compare", tmp_path / "run.npz", "data/synthetic/210rpm.csv"
    run = run_command(*line, "--figure", tmp_path / "a.svg", "--out", tmp_path / "a.csv")
    assert run.code == 0 and run.err.count("warning") == 1, run.err
    assert "% slower; compare with a run at 230 rpm" in run.err and "standard errors" in run.out
    assert "+-: standard error (68 %), with the error of the step" in run.out
    assert b"<svg" in (tmp_path / "a.svg").read_bytes()
    table = pd.read_csv(tmp_path / "a.csv").set_index("measure")
    assert table.sensor["mean_g"] == pytest.approx(-0.215, abs=0.005)  # towards the inside of the bends
    _, lower, low, _ = drawing.call_args.args[0].axes
    assert lower.get_title("right").startswith("synthetic sensor")
    assert [text.get_text() for text in low.get_legend().get_texts()] == ["simulation", "synthetic sensor"]
    for option, value, words in (
        ("--figure", "both.pdf", ".png or .svg"), ("--zero", "y=1", "--zero y=1: must be a number"),
        ("--zero", "az=x", "--zero = 'x': must be a number, or one of an axis, such as 512 or ay=512"),
        ("--turn", "x", "turn = 'x': must be an angle in deg, such as 44deg"),
    ):  # fmt: skip
        run = run_command(*line, option, value)
        assert run.code == 1 and words in run.err

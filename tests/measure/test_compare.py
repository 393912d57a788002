"""A record beside a sensor's whose loop turns faster, as the synthetic one of 210 rpm does."""

import re
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from trackdyn.commands.cli import app
from trackdyn.errors import InputError
from trackdyn.measure.compare import compare_with_sensor
from trackdyn.measure.metrics import loop_frequency
from trackdyn.measure.sensor import sense
from trackdyn.sensor.sensor_csv import SensorRecord
from trackdyn.simulation.simulate import simulate


def record(rate=1000.0, hz=0.253, seconds=30.0, amplitude=0.77):
    t = np.arange(round(seconds * rate)) / rate
    wave = amplitude * np.cos(2 * np.pi * hz * t)
    return SensorRecord("sensor.csv", t, wave, wave, wave, rate, 0)


@pytest.fixture(scope="module")
def recording(make_scene):
    return simulate(make_scene(210.0, duration=10.0, lead_in=1.0))


def test_the_sensors_line_is_searched_at_its_own_speed(recording):
    table = compare_with_sensor(recording, record()).set_index("measure")
    # a pure sine: the bin-free estimate is exact, 8 % above the frequency that the motor asks for
    assert table.loc["line_hz_binfree", "sensor"] == pytest.approx(0.253, rel=1e-4)
    assert table.loc["line_g_binfree", "sensor"] == pytest.approx(0.77, rel=1e-3)
    assert table.loc["line_hz_binfree", "simulation"] == pytest.approx(0.2334, rel=5e-3)
    rms = table.loc["rms_g"]
    assert rms["sensor"] == pytest.approx(0.77 / 2**0.5, rel=0.01)  # not quite whole periods
    assert rms["difference_pct"] == pytest.approx(100 * abs(rms["simulation"] / rms["sensor"] - 1))


@pytest.mark.parametrize("rate", [992.0, 1009.0, 100.4, 5000.0])
def test_rates_that_divide_one_another_are_compared(recording, rate):
    table = compare_with_sensor(recording, record(rate)).set_index("measure")
    fast, slow = max(rate, 1000.0), min(rate, 1000.0)
    count = round(fast / slow)
    assert table.loc["rate_hz", "sensor"] == pytest.approx(rate / (count if rate == fast else 1))
    assert table.loc["rate_hz", "simulation"] == pytest.approx(1000.0 / (1 if rate == fast else count))
    assert table.loc["line_hz_binfree", "sensor"] == pytest.approx(0.253, rel=1e-4)
    assert table.loc["line_g_binfree", "simulation"] == pytest.approx(1.1725, rel=0.05)


@pytest.mark.parametrize(("rate", "remedy"), [(2048.0, 2048), (418.2, 418), (980.0, 980), (1480.0, 1480)])
def test_a_rate_that_does_not_fit_is_refused_with_the_command_that_helps(recording, rate, remedy):
    with pytest.raises(InputError, match=rf"sensor\.csv: has .* simulate --rate {remedy}`"):
        compare_with_sensor(recording, record(rate))


def test_a_slower_sensor_is_what_the_simulation_would_have_recorded_at_its_rate(recording, make_scene):
    """The same steps, averaged in the kernel over 10 ms or afterwards over ten samples of 1 ms."""
    scene = make_scene(210.0, duration=0.3, lead_in=0.1)
    slow = sense(simulate(scene.with_(rig=scene.rig.changed(sensor__rate=100))))
    fast = sense(simulate(scene), every=10)
    np.testing.assert_allclose(fast.time, slow.time, rtol=1e-12)
    # sums of the same numbers in another order, and cosines made anew in every sample
    np.testing.assert_allclose(fast.ay, slow.ay, atol=1e-6)
    np.testing.assert_allclose(fast.raw_ay, slow.raw_ay, atol=1e-6)
    assert np.abs(sense(simulate(scene)).ay[9::10] - slow.ay).max() > 0.01


@pytest.mark.parametrize(("rate", "stride"), [(2048, 5), (100, 100), (20_000, 1), (833, 13)])
def test_a_scene_is_sampled_at_the_sensors_rate(make_scene, rate, stride):
    scene = make_scene(frame_interval=0.05).sampled(rate)
    assert scene.stride == stride and scene.step <= 1e-4 * (1 + 1e-9)
    assert scene.step * stride * rate == pytest.approx(1.0, rel=1e-12)
    assert scene.frame_interval <= 0.05 * (1 + 1e-9)
    recording = simulate(scene.with_(duration=0.1))
    assert recording.rate == rate and len(recording.time) == round(0.1 * rate)


def test_a_record_shorter_than_a_turn_is_refused_by_name(recording):
    turn = 1 / loop_frequency(recording)
    with pytest.raises(InputError, match=rf"^sensor\.csv: the record of 3 s .* at least {turn:.4g} s"):
        compare_with_sensor(recording, record(seconds=3.0))
    short = replace(recording, **{name: getattr(recording, name)[:3000] for name in ("time", "mean", "raw")})
    with pytest.raises(InputError, match=rf"^run\.npz: the record of 3 s .* at least {turn:.4g} s"):
        compare_with_sensor(short, record(), "run.npz")


def test_a_line_that_neither_record_can_have_is_left_out(recording):
    table = compare_with_sensor(recording, record(seconds=6.0)).set_index("measure")
    assert list(table.index) == ["rate_hz", "clipped", "rms_g", "sd_g", "high_frequency_g"]
    assert table[["simulation", "sensor"]].notna().all().all()


def test_the_command_says_what_reading_did(recording, tmp_path):
    recording.save(tmp_path / "run.npz")
    ours = record()
    rows = "".join(f"{t:.3f};{-9.81 * y:.5f}\n" for t, y in zip(ours.t_s, ours.ay_g, strict=True))
    (tmp_path / "mine.csv").write_text("# logger 7\nt;Channel 3\n" + rows.replace(".", ","), encoding="utf-8")
    files = [str(tmp_path / name) for name in ("run.npz", "mine.csv")]
    run = CliRunner().invoke(app, ["compare", *files, "--axis", "ay=-channel 3", "--unit", "m/s2", "--to", "20"])
    assert run.exit_code == 0, run.output
    for words in (
        "30000, from line 3 on",
        "ay = -'Channel 3' in m/s2",
        "1000 Hz, found",
        "9999 rows outside",
        "0 of 20001 rows at",
    ):
        assert words in run.output, words
    rms = float(re.search(r"rms_g +[\d.]+ +[\de.-]+ +([\d.]+)", run.output)[1])
    assert rms == pytest.approx(0.77 / 2**0.5, rel=0.02)
    for bad in (["--axis", "ay"], ["--rate", "0"], ["--unit", "ft"], ["--mapping", str(tmp_path / "absent.yaml")]):
        run = CliRunner().invoke(app, ["compare", *files, *bad])
        assert isinstance(run.exception, InputError), run.output

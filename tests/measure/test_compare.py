"""A record beside a sensor's whose loop turns faster, as the synthetic one of 210 rpm does."""

import numpy as np
import pytest

from trackdyn.errors import InputError
from trackdyn.measure.compare import compare_with_sensor
from trackdyn.measure.sensor_csv import SensorRecord
from trackdyn.simulate import simulate


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


def test_another_rate_is_refused(recording):
    with pytest.raises(InputError, match=r"sensor\.csv: has 990 samples a second, the recording 1000"):
        compare_with_sensor(recording, record(rate=990.0))

"""Records as they are identified from: their speed, their rate, what simulation fits them."""

import numpy as np
import pytest

from laboratory.inference.identification.experiment import MeasuredSpeed
from laboratory.inference.identification.features import features_of
from laboratory.inference.identification.measured import read_records
from trackdyn.errors import InputError
from trackdyn.scene.scene import Periods
from trackdyn.sensor.sensor_csv import write_sensor_csv
from trackdyn.sensor.sensor_mapping import SensorMapping


@pytest.fixture
def written(tmp_path, rig, closed_form):
    """Function that writes a record of the closed form and gives its path."""

    def write(name="one.csv", rpm=210.0, rate=1000, turns=6):
        ay = closed_form(rig, MeasuredSpeed(rpm, 0.308, rate), turns)
        ay += 0.002 * np.random.default_rng(0).standard_normal(ay.size)
        write_sensor_csv(tmp_path / name, np.arange(ay.size) / rate, None, ay, None)
        return tmp_path / name

    return write


def read(rig, *paths, rpm=()):
    return read_records(paths, rig, SensorMapping(), rpm, 0.308, "standard")


def test_a_speed_is_that_of_the_main_line(rig, written):
    (measured,) = read(rig, written(rpm=187.0))
    # a noise of 2 mg on a line of 1.1 g over 6 turns: far below a ten-thousandth of its frequency
    assert measured.speed.rpm == pytest.approx(187.0, rel=1e-4)
    assert measured.turn_s == pytest.approx(Periods.at(rig, 187.0).loop, rel=1e-4)
    assert len(measured.statistics) in (5, 6)  # the last turn may lack a sample


@pytest.mark.parametrize(
    ("rate", "simulated", "every", "rate_hz"), [(2000, 1000, 1, 1000), (500, 1000, 2, 500), (1024, 1024, 1, 1024)]
)
def test_rates_that_do_not_fit_are_simulated(rig, written, rate, simulated, every, rate_hz):
    (measured,) = read(rig, written(rate=rate))
    assert (measured.speed.rate, measured.speed.every) == (simulated, every)
    assert measured.record.rate_hz == pytest.approx(rate_hz)
    assert measured.statistics.shape[1] == len(features_of(rate_hz))


@pytest.mark.parametrize("rpm", [0.0, -5.0, float("nan")])
def test_a_speed_that_is_none_is_refused(rig, written, rpm):
    with pytest.raises(InputError, match="must be a motor speed above 0 rev/min"):
        read(rig, written(), rpm=[rpm])

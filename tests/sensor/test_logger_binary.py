"""Records as MDF 4 and TDMS, written by the formats' own libraries, are those that a CSV of the same samples gives."""

import numpy as np
import pytest

from trackdyn.errors import InputError
from trackdyn.sensor.sensor_csv import read_sensor_csv, write_sensor_csv
from trackdyn.sensor.sensor_mapping import SensorMapping

asammdf = pytest.importorskip("asammdf", reason="asammdf is not installed")
nptdms = pytest.importorskip("nptdms", reason="npTDMS is not installed")
RATE = 1000.0
TIME = np.arange(400) / RATE
AY = 1.0 + 0.5 * np.sin(40.0 * TIME)  # g
AX = 0.1 * np.cos(40.0 * TIME)


def write_mdf(path, unit="g", scale=1.0, ay=AY, names=("acc_x", "acc_y"), groups=1):
    file = asammdf.MDF(version="4.10")
    for _ in range(groups):
        file.append(
            [
                asammdf.Signal(scale * samples, TIME[: samples.size], unit=unit, name=name)
                for name, samples in zip(names, (AX[: ay.size], ay), strict=True)
            ]
        )
    file.append([asammdf.Signal(np.arange(7.0), np.arange(7.0), unit="V", name="battery")])
    file.save(path, overwrite=True)
    file.close()
    return path


def write_tdms(path, unit="g", scale=1.0, ay=AY, timed=True):
    properties = {"unit_string": unit} | ({"wf_increment": 1.0 / RATE, "wf_samples": ay.size} if timed else {})
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("plate 3", "acc_x", scale * AX[: ay.size], properties),
                nptdms.ChannelObject("plate 3", "acc_y", scale * ay, properties),
                nptdms.ChannelObject("other", "battery", np.arange(7.0), {"unit_string": "V"}),
            ]
        )
    return path


@pytest.fixture
def of_text(tmp_path):
    write_sensor_csv(tmp_path / "record.csv", TIME, AX, AY, None)
    return read_sensor_csv(tmp_path / "record.csv")


@pytest.mark.parametrize(("write", "name"), [(write_mdf, "record.mf4"), (write_tdms, "record.tdms")])
@pytest.mark.parametrize(("unit", "scale"), [("g", 1.0), ("m/s^2", 9.81), ("mg", 1000.0)])
def test_a_record_is_that_of_the_text(tmp_path, of_text, write, name, unit, scale):
    record = read_sensor_csv(write(tmp_path / name, unit, scale))
    assert record.rate_hz == pytest.approx(of_text.rate_hz, rel=1e-9)
    for axis in ("t_s", "ax_g", "ay_g"):
        # the text has four decimals
        np.testing.assert_allclose(getattr(record, axis), getattr(of_text, axis), atol=6e-5)
    assert record.az_g is None


def test_a_channel_goes_by_its_name(tmp_path, of_text):
    path = write_mdf(tmp_path / "record.mf4", names=("front", "rear"))
    with pytest.raises(InputError, match=r"no column for ay; there are 'time', 'front', 'rear'"):
        read_sensor_csv(path)
    record = read_sensor_csv(path, SensorMapping(axes={"ay": "-rear"}))
    np.testing.assert_allclose(record.ay_g, -of_text.ay_g, atol=6e-5)


def test_a_record_without_time_needs_a_rate(tmp_path, of_text):
    path = write_tdms(tmp_path / "record.tdms", timed=False)
    with pytest.raises(InputError, match="--rate"):
        read_sensor_csv(path)
    record = read_sensor_csv(path, SensorMapping(time="none", rate=RATE))
    np.testing.assert_allclose(record.ay_g, of_text.ay_g, atol=6e-5)


@pytest.mark.parametrize("name", ["record.mf4", "record.tdms"])
@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"no such format",
        b"TDSm" + bytes(60),
        b"MDF     4.10" + bytes(80),
        b"MDF     4.10    " + bytes(48) + b"##HD" + bytes(200),
    ],
)
def test_a_damaged_file_is_refused_in_a_sentence(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_sensor_csv(tmp_path / name)
    assert name in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(("write", "name"), [(write_mdf, "record.mf4"), (write_tdms, "record.tdms")])
def test_what_would_move_the_record_is_refused(tmp_path, write, name):
    hole = AY.copy()
    hole[7] = np.nan
    with pytest.raises(InputError, match="channel 'acc_y' is nan in sample 8"):
        read_sensor_csv(write(tmp_path / name, ay=hole))
    with pytest.raises(InputError, match="'acc_y' does not say its unit"):
        read_sensor_csv(write(tmp_path / name, unit=""))

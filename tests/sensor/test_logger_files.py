"""Records in the loggers' own formats, written by the formats' libraries, are those that a CSV of the samples gives."""

import gzip
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.io

from trackdyn.errors import InputError
from trackdyn.sensor.sensor_csv import read_sensor_csv, write_sensor_csv
from trackdyn.sensor.sensor_mapping import SensorMapping

asammdf = pytest.importorskip("asammdf", reason="asammdf is not installed")
h5py = pytest.importorskip("h5py", reason="h5py is not installed")
nptdms = pytest.importorskip("nptdms", reason="npTDMS is not installed")
pyuff = pytest.importorskip("pyuff", reason="pyuff is not installed")
pytest.importorskip("lvm_read", reason="lvm-read is not installed")
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


def write_lvm(path, unit="g", scale=1.0, ay=AY, decimal=",", separator="\t", x_columns="One"):
    def row(*fields):
        return separator.join(str(value).replace(".", decimal) for value in fields)

    words = {"\t": "Tab", ";": "Semicolon"}[separator]
    begin = [f"Separator{separator}{words}", f"Decimal_Separator{separator}{decimal}"]
    lines = ["LabVIEW Measurement", *begin, f"X_Columns{separator}{x_columns}", "***End_of_Header***", ""]
    lines += [row("Channels", 2, "", ""), row("Samples", ay.size, ay.size), row("Y_Unit_Label", unit, unit)]
    lines += [row("X_Dimension", "Time", "Time"), row("X0", "0.0E+0", "0.0E+0"), row("Delta_X", 1 / RATE, 1 / RATE)]
    lines += ["***End_of_Header***", row("X_Value", "acc_x", "acc_y", "Comment")]
    time = TIME if x_columns == "One" else [""] * ay.size
    lines += [row(t, x, y) for t, x, y in zip(time, scale * AX, scale * ay, strict=False)]
    lines[-3] += f"{separator}knock"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def write_uff(path, unit="g", scale=1.0, ay=AY, binary=0, names=("acc_x", "acc_y"), func_type=1):
    sets = [
        pyuff.prepare_58(
            binary=binary, func_type=func_type, rsp_node=3, rsp_dir=k + 1, ref_dir=0, ref_node=0, data=scale * samples,
            x=TIME[: ay.size], id1=name, abscissa_spacing=1, abscissa_min=0.0, abscissa_inc=1 / RATE,
            abscissa_spec_data_type=17, ordinate_spec_data_type=12, ordinate_axis_units_lab=unit,
            orddenom_spec_data_type=0, z_axis_spec_data_type=0, ver_num=0, load_case_id=0, rsp_ent_name="NONE",
            ref_ent_name="NONE", z_axis_value=0.0, id2="NONE", id3="NONE", id4="NONE", id5="NONE",
        )
        for k, (name, samples) in enumerate(zip(names, (AX[: ay.size], ay), strict=True))
    ]  # fmt: skip
    path.unlink(missing_ok=True)
    pyuff.UFF(str(path)).write_sets(sets, "add")
    return path


def write_hdf5(path, unit="g", scale=1.0, ay=AY, matlab=False):
    with h5py.File(path, "w", userblock_size=512 * matlab) as file:
        group = file.create_group("plate 3")
        group.attrs["sampling_rate"] = RATE
        group["table"] = scale * np.c_[AX[: ay.size], ay]
        group["table"].attrs.update({"columns": ["acc_x", "acc_y"], "unit": unit})
        file["remark"] = "bench"
    if matlab:
        content = path.read_bytes()
        path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(512) + content[512:])
    return path


def write_parquet(path, unit="g", scale=1.0, ay=AY, dated=False):
    time = {"time": pd.Timestamp("2024-05-01", tz="UTC") + pd.to_timedelta(TIME, "s")} if dated else {"t_s": TIME}
    columns = {f"acc_x ({unit})": scale * AX, f"acc_y ({unit})": scale * ay, "remark": "bench"}
    pd.DataFrame({**time, **columns}).set_index(next(iter(time))).to_parquet(path)
    return path


def write_gzip(path, unit="g", scale=1.0, ay=AY):
    text = pd.DataFrame({"t_s": TIME, f"ax ({unit})": scale * AX, f"ay ({unit})": scale * ay}).to_csv(index=False)
    path.write_bytes(gzip.compress(text.encode()))
    return path


def with_options(write, **options):
    def call(path, *arguments, **more):
        return write(path, *arguments, **more, **options)

    return call


WRITERS = {
    "record.mf4": write_mdf,
    "record.tdms": write_tdms,
    "record.lvm": write_lvm,
    "points.lvm": with_options(write_lvm, decimal=".", separator=";"),
    "untimed.lvm": with_options(write_lvm, x_columns="No"),
    "record.uff": write_uff,
    "binary.unv": with_options(write_uff, binary=1),
    "record.h5": write_hdf5,
    "v73.mat": with_options(write_hdf5, matlab=True),
    "record.parquet": write_parquet,
    "dated.pq": with_options(write_parquet, dated=True),
    "record.csv.gz": write_gzip,
}


@pytest.fixture
def of_text(tmp_path):
    write_sensor_csv(tmp_path / "of_text.csv", TIME, AX, AY, None)
    return read_sensor_csv(tmp_path / "of_text.csv")


@pytest.mark.parametrize(
    ("name", "unit", "scale"),
    [*((name, "m/s^2", 9.81) for name in WRITERS), ("record.mf4", "g", 1.0), ("record.mf4", "mm/s2", 9810.0)],
)
def test_a_record_is_that_of_the_text(tmp_path, of_text, name, unit, scale):
    record = read_sensor_csv(WRITERS[name](tmp_path / name, unit, scale))
    assert record.rate_hz == pytest.approx(of_text.rate_hz, rel=1e-9)
    for axis in ("t_s", "ax_g", "ay_g"):
        # the text has four decimals
        np.testing.assert_allclose(getattr(record, axis), getattr(of_text, axis), atol=6e-5)
    assert record.az_g is None


def tables(path):
    """The same samples where a file has a table and no names."""
    rows = np.c_[TIME, AX, AY]
    np.save(path / "rows.npy", rows)
    np.save(path / "fields.npy", np.rec.fromarrays(rows.T, names="t,ax,ay"))
    scipy.io.savemat(path / "rows.mat", {"fs": RATE, "acc": rows.T[1:], "gain": 3.0, "remark": "bench"})
    scipy.io.savemat(path / "struct.mat", {"data": {"dt": 1 / RATE, "ax": AX[:, None], "ay": AY}, "speed": np.ones(7)})
    scipy.io.wavfile.write(path / "float.wav", int(RATE), rows[:, 1:].astype(np.float32))
    scipy.io.wavfile.write(path / "int.wav", int(RATE), np.round(4096 * rows[:, 1:]).astype(np.int16))


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("rows.npy", {"time": "1", "axes": {"ay": "3", "ax": "2"}, "unit": "g"}),
        ("rows.npy", {"time": "none", "rate": RATE, "axes": {"ay": "#3", "ax": "2"}, "unit": "g"}),
        ("fields.npy", {"unit": "g"}),
        ("rows.mat", {"axes": {"ay": "2", "ax": "1"}, "unit": "g"}),
        ("rows.mat", {"axes": {"ay": "acc 2", "ax": "acc 1"}, "scale": 1}),
        ("struct.mat", {"axes": {"ay": "data.ay", "ax": "data.ax"}, "unit": "g"}),
        ("float.wav", {"axes": {"ay": "2", "ax": "1"}, "unit": "g"}),
        ("int.wav", {"axes": {"ay": "2", "ax": "1"}, "scale": 4096}),
        ("int.wav", {"axes": {"ay": "2", "ax": "1"}, "range": 8, "bits": 16}),
    ],
)
def test_a_table_without_names_goes_by_numbers(tmp_path, of_text, name, options):
    tables(tmp_path)
    record = read_sensor_csv(tmp_path / name, SensorMapping(**options))
    assert record.rate_hz == pytest.approx(RATE, rel=1e-9)
    np.testing.assert_allclose(record.ay_g, of_text.ay_g, atol=2e-4)
    np.testing.assert_allclose(record.ax_g, of_text.ax_g, atol=2e-4)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("rows.npy", ("no column for ay; there are '1', '2', '3'", "--axis ay=NAME or by its number", "--time NAME")),
        ("rows.mat", ("'acc 1', 'acc 2'", "ay=-NAME,")),
        ("float.wav", ("no column for ay",)),
        ("fields.npy", ("'ay' does not say its unit",)),
    ],
)
def test_what_a_table_does_not_say_is_asked_for(tmp_path, name, words):
    tables(tmp_path)
    with pytest.raises(InputError) as caught:
        read_sensor_csv(tmp_path / name)
    assert all(word in str(caught.value) for word in words), caught.value


def test_a_rate_that_is_stated_wins_over_that_of_the_file(tmp_path):
    tables(tmp_path)
    axes = {"axes": {"ay": "2"}, "unit": "g"}
    record = read_sensor_csv(tmp_path / "float.wav", SensorMapping(rate=1010, **axes))
    assert record.done["rate"] == "1010 Hz, given, not 1000 Hz as the file states"
    scipy.io.savemat(tmp_path / "two.mat", {"fs": RATE, "audio_rate": 8000.0, "acc": np.c_[AX, AY]})
    with pytest.raises(InputError, match="no column of time"):
        read_sensor_csv(tmp_path / "two.mat", SensorMapping(**axes))


def test_a_channel_goes_by_its_name(tmp_path, of_text):
    path = write_mdf(tmp_path / "record.mf4", names=("front", "rear"))
    with pytest.raises(InputError, match=r"no column for ay; there are 'front', 'rear', 'time'"):
        read_sensor_csv(path)
    record = read_sensor_csv(path, SensorMapping(axes={"ay": "-rear"}))
    np.testing.assert_allclose(record.ay_g, -of_text.ay_g, atol=6e-5)
    path = write_uff(tmp_path / "record.uff", names=("bench", "bench"))
    with pytest.raises(InputError, match=r"'node 3 \+X', 'node 3 \+Y'; name it with --axis ay=NAME"):
        read_sensor_csv(path)
    record = read_sensor_csv(path, SensorMapping(axes={"ay": "2"}))
    np.testing.assert_allclose(record.ay_g, of_text.ay_g, atol=6e-5)


def test_a_record_without_time_needs_a_rate(tmp_path, of_text):
    path = write_tdms(tmp_path / "record.tdms", timed=False)
    with pytest.raises(InputError, match="--rate"):
        read_sensor_csv(path)
    record = read_sensor_csv(path, SensorMapping(time="none", rate=RATE))
    np.testing.assert_allclose(record.ay_g, of_text.ay_g, atol=6e-5)


CONTENTS = [
    b"", b"\0no such format", b"TDSm" + bytes(60), b"MDF     4.10" + bytes(80),
    b"MDF     4.10    " + bytes(48) + b"##HD" + bytes(200), b"RIFF" + bytes(60), b"\x93NUMPY\1\0" + bytes(60),
    b"\x89HDF\r\n\x1a\n" + bytes(60), b"PAR1" + bytes(60), b"MATLAB 5.0 MAT-file" + bytes(200), b"\x1f\x8b" + bytes(60),
    b"LabVIEW Measurement\nSeparator\tTab\n", b"    -1\n    58\nbench\n    -1\n",
]  # fmt: skip


@pytest.mark.parametrize("content", CONTENTS)
def test_a_damaged_file_is_refused_in_a_sentence(tmp_path, content):
    """By what a file holds, or by its ending where that says nothing."""
    for name in ("record.csv", *(("record.mf4", "record.mat") if len(content) < 20 else ())):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError) as caught:
            read_sensor_csv(tmp_path / name)
        assert name in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_that_was_cut_off_is_refused_or_shorter(tmp_path, name):
    content = WRITERS[name](tmp_path / name).read_bytes()
    for share in (0.5, 0.97):
        (tmp_path / name).write_bytes(content[: int(share * len(content))])
        try:
            record = read_sensor_csv(tmp_path / name)
        except InputError as error:
            assert name in str(error) and "\n" not in str(error)
        else:
            assert record.ay_g.size < AY.size
            np.testing.assert_allclose(record.ay_g[:-1], AY[: record.ay_g.size - 1], atol=6e-5)


@pytest.mark.parametrize("name", ["record.mf4", "record.tdms", "record.lvm", "record.h5", "record.parquet"])
def test_what_would_move_the_record_is_refused(tmp_path, of_text, name):
    hole = AY.copy()
    hole[7] = np.nan
    path = WRITERS[name](tmp_path / name, ay=hole)
    with pytest.raises(InputError, match=r"channel 'acc_y.*' is nan in sample 8; .*--gaps bridge"):
        read_sensor_csv(path)
    record = read_sensor_csv(path, SensorMapping(gaps="bridge"))
    np.testing.assert_allclose(record.ay_g, of_text.ay_g, atol=1e-4)
    assert record.done["gaps"].startswith("1 samples in 1 gaps interpolated")
    with pytest.raises(InputError, match="does not say its unit"):
        read_sensor_csv(WRITERS[name](tmp_path / name, unit=""))


def test_two_groups_with_the_same_channel_and_spectra_are_refused(tmp_path):
    with pytest.raises(InputError, match="2 groups of channels have a column for ay"):
        read_sensor_csv(write_mdf(tmp_path / "record.mf4", groups=2))
    with pytest.raises(InputError, match="there are no channels"):
        read_sensor_csv(write_uff(tmp_path / "record.uff", func_type=4))


def test_no_file_beside_a_record_is_opened(tmp_path):
    """The library of LVM files would read a pickle of the same name."""
    path = write_lvm(tmp_path / "record.lvm")
    beside = Path(f"{path}.pkl")
    beside.write_bytes(b"cos\nsystem\n(S'touch ran'\ntR.")
    read_sensor_csv(path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["record.lvm", "record.lvm.pkl"]

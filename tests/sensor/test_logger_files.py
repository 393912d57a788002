"""Records in the loggers' own formats, written by the formats' libraries, have the samples that were written."""

import wave
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.io

from trackdyn.errors import InputError
from trackdyn.sensor import formats, logger_files
from trackdyn.sensor.sensor_csv import read_sensor_csv
from trackdyn.sensor.sensor_mapping import SensorMapping, load_mapping

asammdf = pytest.importorskip("asammdf", reason="asammdf is not installed")
h5py = pytest.importorskip("h5py", reason="h5py is not installed")
nptdms = pytest.importorskip("nptdms", reason="npTDMS is not installed")
pyuff = pytest.importorskip("pyuff", reason="pyuff is not installed")
pytest.importorskip("lvm_read", reason="lvm-read is not installed")
RATE = 1000.0
TIME = np.arange(400) / RATE
AY = 1.0 + 0.5 * np.sin(40.0 * TIME)  # g
AX = 0.1 * np.cos(40.0 * TIME)


def write_mdf(path, unit="g", scale=1.0, ay=AY, time=TIME, names=("acc_x", "acc_y"), groups=1):
    file = asammdf.MDF(version="4.10")
    for _ in range(groups):
        file.append(
            [
                asammdf.Signal(scale * samples, time[: samples.size], unit=unit, name=name)
                for name, samples in zip(names, (np.resize(AX, ay.size), ay), strict=True)
            ]
        )
    file.append([asammdf.Signal(np.arange(7.0), np.arange(7.0), unit="V", name="battery")])
    file.save(path, overwrite=True)
    file.close()
    return path


def write_tdms(path, unit="g", scale=1.0, ay=AY):
    properties = {"unit_string": unit, "wf_increment": 1.0 / RATE, "wf_samples": ay.size}
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("plate 3", "acc_x", scale * AX[: ay.size], properties),
                nptdms.ChannelObject("plate 3", "acc_y", scale * ay, properties),
                nptdms.ChannelObject("other", "battery", np.arange(7.0), {"unit_string": "V"}),
            ]
        )
    return path


def write_lvm(
    path, unit="g", scale=1.0, ay=AY, time=TIME, decimal=",", separator="\t", x_columns="One", rows=None,
    steps=(1 / RATE, 1 / RATE),
):  # fmt: skip
    def row(*fields):
        return separator.join(str(value).replace(".", decimal) for value in fields)

    words = {"\t": "Tab", ";": "Semicolon"}[separator]
    begin = [f"Separator{separator}{words}", f"Decimal_Separator{separator}{decimal}"]
    lines = ["LabVIEW Measurement", *begin, f"X_Columns{separator}{x_columns}", "***End_of_Header***", ""]
    lines += [row("Channels", 2, "", ""), row("Samples", *[rows or ay.size] * 2), row("Y_Unit_Label", unit, unit)]
    lines += [row("X_Dimension", "Time", "Time"), row("X0", "0.0E+0", "0.0E+0"), row("Delta_X", *steps)]
    lines += ["***End_of_Header***", row("X_Value", "acc_x", "acc_y", "Comment")]
    stamps = time if x_columns == "One" else [""] * ay.size
    lines += [row(t, x, y) for t, x, y in zip(stamps, scale * np.resize(AX, ay.size), scale * ay, strict=False)]
    lines[-3] += f"{separator}knock"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def write_uff(path, unit="g", scale=1.0, ay=AY, time=None, binary=0, names=("acc_x", "acc_y"), func_type=1):
    sets = [
        pyuff.prepare_58(
            binary=binary, func_type=func_type, rsp_node=3, rsp_dir=k + 1, ref_dir=0, ref_node=0, data=scale * samples,
            x=TIME[: ay.size] if time is None else time, id1=name, abscissa_spacing=int(time is None), abscissa_min=0.0,
            abscissa_inc=1 / RATE if time is None else 0.0,
            abscissa_spec_data_type=17, ordinate_spec_data_type=12, ordinate_axis_units_lab=unit,
            orddenom_spec_data_type=0, z_axis_spec_data_type=0, ver_num=0, load_case_id=0, rsp_ent_name="NONE",
            ref_ent_name="NONE", z_axis_value=0.0, id2="NONE", id3="NONE", id4="NONE", id5="NONE",
        )
        for k, (name, samples) in enumerate(zip(names, (np.resize(AX, ay.size), ay), strict=True))
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


def write_parquet(path, unit="g", scale=1.0, ay=AY, time=TIME, dated=False):
    stamps = {"time": pd.Timestamp("2024-05-01", tz="UTC") + pd.to_timedelta(time, "s")} if dated else {"t_s": time}
    columns = {f"acc_x ({unit})": scale * np.resize(AX, ay.size), f"acc_y ({unit})": scale * ay, "remark": "bench"}
    pd.DataFrame(stamps | columns).set_index(next(iter(stamps))).to_parquet(path)
    return path


def write_gzip(path, unit="g", scale=1.0, ay=AY):
    table = pd.DataFrame({"t_s": TIME, f"ax ({unit})": scale * AX, f"ay ({unit})": scale * ay})
    table.to_csv(path, index=False, compression="gzip")
    return path


def with_options(write, **options):
    return lambda path, *arguments, **more: write(path, *arguments, **more, **options)


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


def hdf5(datasets, **attributes):
    """Writer of datasets by name, each with attributes, and of attributes of the file."""

    def write(path):
        with h5py.File(path, "w") as file:
            file.attrs.update(attributes)
            for name, (values, own) in datasets.items():
                file[name] = values
                file[name].attrs.update(own)

    return write


def mat(**content):
    return lambda path: scipy.io.savemat(path, content)


def npy(array):
    return lambda path: np.save(path, array)


def wav(samples, rate=int(RATE)):
    return lambda path: scipy.io.wavfile.write(path, rate, samples)


def wav_of(bits, range_g=8):
    """Writer of one channel in whole numbers of some bits."""
    counts = np.round(AY / range_g * 2 ** (bits - 1)).astype("<i4") + 128 * (bits == 8)

    def write(path):
        with wave.open(str(path), "wb") as file:
            file.setnchannels(1), file.setsampwidth(bits // 8), file.setframerate(int(RATE))
            file.writeframes(counts.view(np.uint8).reshape(-1, 4)[:, : bits // 8].tobytes())

    return write


def tdms(*channels):
    """Writer of channels: group, name, samples, and their step in s, 0 if it is not stated."""

    def write(path):
        with nptdms.TdmsWriter(path) as writer:
            for group, name, samples, step in channels:
                properties = {"unit_string": "g", "wf_increment": step} if step else {}
                writer.write_segment([nptdms.ChannelObject(group, name, samples, properties)])

    return write


def parquet(path):
    """A table with two columns of a name and odd metadata."""
    arrow = pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    columns = [arrow.array(values) for values in (TIME, AX, AY, AY > 1, AY)]
    table = arrow.table(columns, names=["t_s", "ax_g", "ay_g", "on", "ay_g"])
    pytest.importorskip("pyarrow.parquet").write_table(table.replace_schema_metadata({"pandas": "odd"}), path)


def deep(path):
    with h5py.File(path, "w") as file:
        file["/".join(map(str, range(300)))] = AY


ROWS = np.c_[TIME, AX, AY]
BOTH = {"axes": {"ay": "2", "ax": "1"}, "unit": "g"}
ONE = {"axes": {"ay": "1"}, "unit": "g"}
COUNTS = np.round(4096 * ROWS[:, 1:]).astype(np.int16)
RUNS = tdms(("run 1", "ay", 0.5 * AY, 1 / RATE), ("run 2", "ay", AY, 1 / RATE))
TABLES = hdf5({f"run {k}/table": (np.c_[TIME, k / 2 * AY], {"columns": ["t_s", "ay_g"]}) for k in (1, 2)})
PACKED = {"scale_factor": 1e-3, "add_offset": 1.0, "unit": "g", "_FillValue": np.int16(-999)}
PACKED_AY = np.round((AY - 1) * 1000).astype(np.int16)
OWN_RATES = hdf5({
    "acc/ay": (AY, {"sample_rate": RATE}), "temp": (np.ones(40), {"sample_rate": 10.0}),
    "acc/ax": (AX, {"sample_rate": 2 * RATE}),
})  # fmt: skip
TWO_TIMES = {"X1_DE_time": AY, "X1_FE_time": AX}
# one name for files of MATLAB: a process of its own reads each of them
RATES = ("fs", "Fs", "sr", "SampleRate", "sampling_rate", "sampling_frequency", "fs_Hz")
OTHER_RATES = {
    "rate": 125.0, "shaft_rate": 125.0, "frame_rate": 250.0, "refresh_rate_hz": 144.0, "dt": 0.004, "line_freq": 400.0,
    "bit_rate": 9600.0, "control_period": 0.002, "fs": 48.0, "audio_fs": 8000.0,
}  # fmt: skip


def beside(rate, number):
    """Writer of a number at the channel, beside others at another one and at the file."""
    return hdf5({"acc/ay": (AY, {rate: number})}, frame_rate=250.0, shaft_rate=400.0)


# by name of a file, its writer and the options with which it is the record of AX and AY, or of AY alone
READ = {
    "rows.npy": (npy(ROWS), {"time": "1", "axes": {"ay": "3", "ax": "2"}, "unit": "g"}),
    "untimed.npy": (npy(ROWS), {"time": "none", "rate": RATE, "axes": {"ay": "#3", "ax": "2"}, "unit": "g"}),
    "fields.npy": (npy(np.rec.fromarrays(ROWS.T, names="t,ax,ay")), {"unit": "g"}),
    "rows.mat": (
        mat(fs=RATE, acc=ROWS.T[1:], gain=3.0, remark="b"),
        {"axes": {"ay": "acc 2", "ax": "acc 1"}, "scale": 1},
    ),
    "struct.mat": (
        mat(data={"sample_time": 1 / RATE, "ax": AX[:, None], "ay": AY}, speed=np.ones(7)),
        {"axes": {"ay": "data.ay", "ax": "data.ax"}, "unit": "g"},
    ),
    "rate.mat": (mat(acc={"ay": AY, "Fs": RATE, "rate": 125.0}, fs=400.0), ONE),
    "signals.mat": (mat(**TWO_TIMES), {"time": "none", "rate": RATE, "axes": {"ay": "X1_DE_time"}, "unit": "g"}),
    "float.wav": (wav(ROWS[:, 1:].astype(np.float32)), BOTH),
    "scaled.wav": (wav(COUNTS), {"axes": {"ay": "2", "ax": "1"}, "scale": 4096}),
    "int.wav": (wav(COUNTS), {"axes": {"ay": "2", "ax": "1"}, "range": 8, "bits": 16}),
    **{f"{bits}.wav": (wav_of(bits), {"axes": {"ay": "1"}, "range": 8, "bits": bits}) for bits in (8, 24)},
    **{f"{rate}.h5": (beside(rate, RATE), ONE) for rate in RATES},
    "dt.h5": (beside("dt", 0.004), ONE | {"rate": RATE}),
    "own.h5": (OWN_RATES, {"axes": {"ay": "acc/ay"}, "unit": "g"}),
    "group.tdms": (RUNS, {"axes": {"ay": "run 2/ay"}}),
    "number.tdms": (RUNS, {"axes": {"ay": "run 2/#1"}}),
    "group.h5": (TABLES, {"axes": {"ay": "run 2/table/ay_g"}, "time": "run 2/table/t_s", "unit": "g"}),
    "packed.h5": (hdf5({"ay": (PACKED_AY, PACKED)}, fs=RATE), {}),
    "equal.parquet": (parquet, {"axes": {"ay": "#4"}}),
    "nodes.uff": (with_options(write_uff, names=("bench", "bench")), {"axes": {"ay": "2"}}),
    "named.mf4": (with_options(write_mdf, names=("front", "rear")), {"axes": {"ay": "rear"}}),
}


@pytest.mark.parametrize(
    ("name", "unit", "scale"),
    [*((name, "m/s^2", 9.81) for name in WRITERS), ("record.mf4", "g", 1.0), ("record.mf4", "mm/s2", 9810.0)],
)
def test_samples_of_every_format_are_read(tmp_path, name, unit, scale):
    record = read_sensor_csv(WRITERS[name](tmp_path / name, unit, scale))
    assert record.rate_hz == pytest.approx(RATE, rel=1e-9) and record.az_g is None
    for values, expected in ((record.t_s, TIME), (record.ax_g, AX), (record.ay_g, AY)):
        np.testing.assert_allclose(values, expected, atol=1e-6)


@pytest.mark.parametrize("name", READ)
def test_options_supply_what_a_file_does_not_say(tmp_path, name):
    write, options = READ[name]
    write(tmp_path / name)
    record = read_sensor_csv(tmp_path / name, SensorMapping(**options))
    assert record.rate_hz == pytest.approx(RATE, rel=1e-9)
    np.testing.assert_allclose(record.ay_g, AY, atol=8 / 2**8 if name == "8.wav" else 6e-4)
    if "ax" in options.get("axes", {}):
        np.testing.assert_allclose(record.ax_g, AX, atol=2e-4)


REFUSED = {
    "rows.npy": (npy(ROWS), {}, "no column for ay; there are '1', '2', '3'; .* --axis ay=NAME or by its number"),
    "one.npy": (npy(AY), {}, "no column for ay; there are '1'; name it"),
    "fields.npy": (npy(np.rec.fromarrays(ROWS.T, names="t,ax,ay")), {}, "'ay' does not say its unit"),
    "rows.mat": (mat(fs=RATE, acc=ROWS.T[1:]), {}, "'acc 1', 'acc 2'.*ay=-NAME,"),
    "two.mat": (
        mat(fs=RATE, sample_rate=8000.0, acc=ROWS[:, 1:]), BOTH, r"\(fs = 1000, sample_rate = 8000\); .* give its rate",
    ),
    "rate.mat": (mat(acc={"ay": AY, "rate": 125.0}), ONE, r"acc/rate = 125\).*--rate HZ"),
    "cells.mat": (
        mat(remark="bench", names=np.array(["a", "b"], dtype=object)), {}, "no arrays of numbers but 'remark', 'names'",
    ),
    "signals.mat": (mat(**TWO_TIMES), {"axes": {"ay": "X1_DE_time"}, "unit": "g"}, "no column of time .* --rate HZ"),
    "time.mat": (
        mat(**TWO_TIMES | {"X1_FE_time": TIME}), {"axes": {"ay": "X1_DE_time"}, "unit": "g"},
        "the time may be in column 2 'X1_FE_time'; say so with --time '#2'",
    ),
    **{
        f"{rate}.h5": (beside(rate, number), ONE, rf"acc/ay/{rate} = {number:g}\b.*--rate HZ")
        for rate, number in OTHER_RATES.items()
    },
    "own.h5": (
        OWN_RATES, {"axes": {"ay": "acc/ay", "ax": "acc/ax"}, "unit": "g"}, "'acc/ax' has 2000 samples a second and ay",
    ),
    "deep.h5": (deep, {"unit": "g"}, "20 within each other; export the channels"),
    "filled.h5": (
        hdf5({"ay": (np.where(np.arange(400) == 7, -999, PACKED_AY), PACKED)}, fs=RATE), {}, "'ay' is nan in sample 8",
    ),
    "equal.parquet": (parquet, {}, r"columns 3 \('ay_g'\) and 4 \('ay_g'\) may all be ay; .*#3"),
    "24.wav": (wav_of(24), {"axes": {"ay": "1"}, "range": 8, "bits": 32}, "has 24 bits a sample; give --bits 24"),
    "nodes.uff": (
        with_options(write_uff, names=("bench", "bench")), {}, r"'node 3 \+X', 'node 3 \+Y'; name it with --axis ay=",
    ),
    "spectra.uff": (with_options(write_uff, func_type=4), {}, "there are no channels"),
    "named.mf4": (with_options(write_mdf, names=("front", "rear")), {}, "there are 'front', 'rear', 'time'"),
    "two.mf4": (
        with_options(write_mdf, groups=2), {}, "2 groups of channels have a column for ay .* --axis ay='group 2/acc_y'",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_file_does_not_say_is_asked_for(tmp_path, name):
    write, options, words = REFUSED[name]
    write(tmp_path / name)
    with pytest.raises(InputError, match=words) as caught:
        read_sensor_csv(tmp_path / name, SensorMapping(**options))
    assert "\n" not in str(caught.value)


def test_a_rate_that_is_given_wins_over_that_of_the_file(tmp_path):
    wav(COUNTS)(tmp_path / "a.wav")
    record = read_sensor_csv(tmp_path / "a.wav", SensorMapping(axes={"ay": "2"}, scale=4096, rate=1010))
    assert record.done["rate"] == "1010 Hz, as given, not 1000 Hz, as the file states (sample rate)"


# rows of a record of 4 s with a line at 6 Hz, in which some are lost, or whose time is uneven
LONG = np.arange(4000) / RATE
LINE = np.sin(2 * np.pi * 6 * LONG)
LOST = {
    "every 2nd": np.arange(0, 4000, 2),
    "every 10th lost": np.flatnonzero(np.arange(4000) % 10),
    "a quarter lost": np.r_[0:1500, 2500:4000],
    "backwards": np.r_[2000:4000, 0:2000],
}


def stamped(write, **options):
    """A writer of these stamps and samples."""
    return lambda path, t, y, **more: write(path, ay=y, time=t, **options, **more)


stamped_lvm = stamped(write_lvm, decimal=".", separator=";")


STAMPED = {
    "r.lvm": stamped_lvm, "r.uff": stamped(write_uff), "r.mf4": stamped(write_mdf),
    "r.parquet": stamped(write_parquet),
    "r.h5": lambda path, t, y: hdf5({"t": (t, {}), "ay": (y, {"unit": "g", "sample_rate": RATE})})(path),
    "r.tdms": lambda path, t, y: tdms(("g", "Time", t, 0), ("g", "acc_y", y, 1 / RATE))(path),
    "r.mat": lambda path, t, y: mat(t_s=t, ay_g=y, fs=RATE)(path),
}  # fmt: skip


@pytest.mark.parametrize("name", STAMPED)
@pytest.mark.parametrize("rows", LOST)
def test_stamps_of_every_format_are_judged(tmp_path, name, rows):
    """A line of 6 Hz is read as one, or the file is refused, as the same rows of text are."""
    path = tmp_path / name
    STAMPED[name](path, LONG[LOST[rows]], LINE[LOST[rows]])
    try:
        record = read_sensor_csv(path)
    except InputError as error:
        assert "--" in str(error) and "\n" not in str(error)
    else:
        spectrum = np.abs(np.fft.rfft(record.ay_g))
        assert np.argmax(spectrum) * record.rate_hz / record.ay_g.size == pytest.approx(6.0, rel=1e-3)


@pytest.mark.parametrize("name", STAMPED)
def test_jitter_needs_leave_in_every_format(tmp_path, name):
    rng = np.random.default_rng(2)
    t = LONG + rng.uniform(-4e-4, 4e-4, LONG.size)
    path = tmp_path / name
    STAMPED[name](path, t - t[0], np.sin(2 * np.pi * 6 * t))
    with pytest.raises(InputError, match="--resample"):
        read_sensor_csv(path)
    record = read_sensor_csv(path, SensorMapping(resample=True))
    # stamps of UFF have six digits
    np.testing.assert_allclose(record.ay_g, np.sin(2 * np.pi * 6 * (record.t_s + t[0])), atol=3e-3)


def test_what_a_file_states_against_its_stamps_is_asked(tmp_path):
    path = stamped_lvm(tmp_path / "r.lvm", LONG, LINE, steps=(0.01, 0.01))
    with pytest.raises(InputError, match=r"stamps run at 1000 Hz, not at 100 Hz, as the file states .*--rate 1000"):
        read_sensor_csv(path)
    assert read_sensor_csv(path, SensorMapping(rate=1000)).rate_hz == 1000


@pytest.mark.parametrize("x_columns", ["One", "No", "TDMS"])
def test_two_rates_in_a_file(tmp_path, x_columns):
    """ay has 2 kHz, ax before it 1 kHz."""
    path = tmp_path / "record"
    if x_columns == "TDMS":
        tdms(("g", "acc_x", LINE, 1e-3), ("g", "acc_y", LINE, 5e-4))(path)
    else:
        stamped_lvm(path, LONG, LINE, steps=(1 / RATE, 0.5 / RATE), x_columns=x_columns)
    record = read_sensor_csv(path)
    assert record.rate_hz == pytest.approx(2 * RATE) and record.ax_g is None
    np.testing.assert_allclose(record.ay_g, LINE, atol=1e-8)


def test_what_a_library_remarks_is_a_doubt(tmp_path, capfd):
    content = write_tdms(tmp_path / "a.tdms").read_bytes()
    (tmp_path / "a.tdms").write_bytes(content[: len(content) - 400])
    scipy.io.wavfile.write(tmp_path / "a.wav", int(RATE), AY.astype(np.float32))
    content = (tmp_path / "a.wav").read_bytes()
    (tmp_path / "a.wav").write_bytes(content[:1200])
    for name in ("a.tdms", "a.wav"):
        record = read_sensor_csv(
            tmp_path / name, SensorMapping(axes={"ay": "acc_y" if name == "a.tdms" else "1"}, unit="g")
        )
        assert record.ay_g.size < AY.size and "the library that reads it says: " in record.doubts[0]
    assert capfd.readouterr().err == ""


def test_every_channel_has_its_own_stamps(tmp_path):
    """A column of time before each channel: those of ay run at 2 kHz, or miss a quarter."""
    path = tmp_path / "r.lvm"
    for t, right in ((LONG / 2, 12.0), (np.r_[LONG[:1500], LONG[2500:], LONG[:1000] + 4], None)):
        lines = ["LabVIEW Measurement", "Separator;Semicolon", "Decimal_Separator;.", "X_Columns;Multi"]
        lines += ["***End_of_Header***", "", "Channels;2;;;", "Samples;4000;;4000;", "Y_Unit_Label;g;;g;"]
        lines += ["X_Dimension;Time;;Time;", "X0;0.0;;0.0;", f"Delta_X;0.001;;{t[1]};", "***End_of_Header***"]
        lines += ["X_Value;acc_x;X_Value;acc_y;Comment"]
        lines += [f"{x};0.1;{stamp};{value}" for x, stamp, value in zip(LONG, t, LINE, strict=True)]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        if right is None:
            with pytest.raises(InputError, match="a gap from"):
                read_sensor_csv(path)
        else:
            record = read_sensor_csv(path)
            assert record.rate_hz == pytest.approx(2 * RATE) and record.ax_g is None


def test_a_file_that_is_not_what_it_states_is_refused(tmp_path):
    path = stamped_lvm(tmp_path / "short.lvm", LONG[:7], LINE[:7], rows=400)
    with pytest.raises(InputError, match="states 400 samples of 'acc_x' and holds 7"):
        read_sensor_csv(path)
    path = stamped_lvm(tmp_path / "long.lvm", LONG, LINE)
    lines = path.read_text("utf-8").splitlines()
    for row in ("0.007;0.1;1.37;1.138", "0.007;0.1;1.37;knock;1.1"):
        path.write_text("\n".join([*lines[:21], row, *lines[22:]]), "utf-8")
        with pytest.raises(InputError, match=r"line 22 .* has a field too many"):
            read_sensor_csv(path)
    path = write_uff(tmp_path / "short.uff")
    path.write_text(path.read_text("utf-8").replace("       400 ", "       900 "), "utf-8")
    with pytest.raises(InputError, match="states 900 samples of 'acc_x' and holds 400"):
        read_sensor_csv(path)


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
def test_what_would_move_the_record_is_refused(tmp_path, name):
    hole = AY.copy()
    hole[7] = np.nan
    path = WRITERS[name](tmp_path / name, ay=hole)
    with pytest.raises(InputError, match=r"channel 'acc_y.*' is nan in sample 8; .*--gaps bridge"):
        read_sensor_csv(path)
    record = read_sensor_csv(path, SensorMapping(gaps="bridge"))
    np.testing.assert_allclose(record.ay_g, AY, atol=1e-4)
    assert record.done["gaps"].startswith("1 samples in 1 gaps interpolated")
    with pytest.raises(InputError, match="does not say its unit"):
        read_sensor_csv(WRITERS[name](tmp_path / name, unit=""))


def test_a_rate_above_the_limit_is_decimated(tmp_path):
    """A line of 5 Hz stays, one of 15 kHz that would turn up at 5 kHz does not."""
    t = np.arange(96_000) / 48_000
    samples = 1 + np.sin(2 * np.pi * 5 * t) + 0.5 * np.sin(2 * np.pi * 15_000 * t)
    scipy.io.wavfile.write(tmp_path / "fast.wav", 48_000, samples.astype(np.float32))
    for rate in (None, 48_000):
        record = read_sensor_csv(tmp_path / "fast.wav", SensorMapping(axes={"ay": "1"}, unit="g", rate=rate))
        assert record.rate_hz == 20_000 and record.ay_g.size == 40_000
        inside = slice(100, -100)
        np.testing.assert_allclose(record.ay_g[inside], (1 + np.sin(2 * np.pi * 5 * record.t_s))[inside], atol=2e-3)
    with pytest.raises(InputError, match="rate = 2000000"):
        load_mapping(rate=2_000_000.0)


def test_one_wrong_bit_of_a_matlab_file_ends_in_a_sentence(tmp_path):
    """With this one the library ends the process that calls it."""
    scipy.io.savemat(tmp_path / "a.mat", {"t": TIME, "ay": AY, "ax": AX})
    content = bytearray((tmp_path / "a.mat").read_bytes())
    for at in (128 + 48, 128 + 24, 128 + 40):
        damaged = content.copy()
        damaged[at] ^= 1
        (tmp_path / "a.mat").write_bytes(damaged)
        try:
            read_sensor_csv(tmp_path / "a.mat", SensorMapping(unit="g"))
        except InputError as error:
            assert "\n" not in str(error)


@pytest.mark.parametrize("name", ["a.npy", "a.h5", "a.parquet", "a.mat", "declared.h5"])
def test_what_is_too_large_is_refused_before_it_is_read(tmp_path, name, monkeypatch):
    monkeypatch.setattr(formats, "MOST_BYTES", 20_000)
    monkeypatch.setattr(logger_files, "MOST_NUMBERS", 5_000)
    many = np.zeros(60_000)
    if name == "a.npy":
        np.save(tmp_path / name, np.c_[many, many])
    elif name == "a.mat":
        scipy.io.savemat(tmp_path / name, {"a": {"ay": many}}, do_compression=True)
    elif name == "a.parquet":
        pd.DataFrame({"t": many, "ay": many}).to_parquet(tmp_path / name, compression="zstd")
    else:
        with h5py.File(tmp_path / name, "w") as file:
            count = 2_000_000_000 if name == "declared.h5" else many.size
            file.create_dataset("ay", (count,), "f8", chunks=(1000,), compression="gzip")
    mapping = SensorMapping(axes={"ay": "1"}, unit="g", time="none", rate=RATE)
    with pytest.raises(InputError, match=r"million numbers; give a part|more than 0 MB; give a part"):
        read_sensor_csv(tmp_path / name, mapping)


def test_only_the_columns_in_use_are_read(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"], file["ay"] = TIME, AY
        file.create_dataset("image", (2_000_000_000,), "f8", chunks=(1000,), compression="gzip")
        file.create_dataset("switch", data=AY > 1)
        external = file.create_dataset("ax", (400,), "u1", external=[(str(tmp_path / "a.bin"), 0, 400)])
        assert external.external
    record = read_sensor_csv(tmp_path / "a.h5", SensorMapping(unit="g"))
    np.testing.assert_allclose(record.ay_g, AY, atol=6e-5)
    assert record.ax_g is None and "not used" not in record.done["columns"]


def test_no_file_beside_a_record_is_opened(tmp_path):
    """The library of LVM files would read a pickle of the same name."""
    path = write_lvm(tmp_path / "record.lvm")
    beside = Path(f"{path}.pkl")
    beside.write_bytes(b"cos\nsystem\n(S'touch ran'\ntR.")
    read_sensor_csv(path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["record.lvm", "record.lvm.pkl"]

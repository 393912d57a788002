"""One signal in the forms of many loggers, from files and DataFrames: each is read as this signal, or refused."""

import io

import numpy as np
import pandas as pd
import pytest

from tests.conftest import refused, written
from trackdyn.commands.options import as_options
from trackdyn.fieldtest.sensor_csv import read_sensor
from trackdyn.fieldtest.sensor_mapping import load_mapping

T = np.arange(400) / 125
AY = np.round(np.sin(7 * T) + 0.2 * np.cos(150 * T), 4)


def table(header, row):
    return header + "\n" + "".join(row(k, T[k], AY[k]) + "\n" for k in range(T.size))


def form(header, row, **options):
    return table(header, row), options


# packets of ten rows, of two sensors in turn
PACKETS = "t_s,ay_g,box\n" + "".join(
    f"{T[first + k]:.3f},{ay[first + k]},{box}\n"
    for first in range(0, T.size, 10)
    for box, ay in (("a", AY), ("b", np.roll(AY, 177)))
    for k in range(10)
)
LONGEST = load_mapping(gaps="longest")
GROUPED = table("t_ms;ay_mg", lambda k, t, a: f"{8 * k:,.1f};{1000 * a:,.2f}")
UNITS_IN_CELLS = table("t_ms;ay", lambda k, t, a: f"{8 * k};{1000 * a:,.1f} mg")
NODES = table("t_ms,range_g,node,ay_g", lambda k, t, a: f"{8 * k},2,1,{-a}\n{8 * k},4,2,{a}")
FAST = np.sin(7 * np.arange(4000) / 1000) + 0.2 * np.cos(150 * np.arange(4000) / 1000)
NOISE = np.random.default_rng(5).integers(-12, 13, T.size)
FORMS = {
    "plain": form("t_s,ay_g", lambda k, t, a: f"{t:.3f},{a}"),
    "past the hour": form("time,ay_g", lambda k, t, a: f"{'59:' if t < 1.5 else '00:'}{(58.5 + t) % 60:06.3f},{a}"),
    "blank lines": form("t_s,ay_g", lambda k, t, a: f"{t:.3f},{a}\n"),
    "units in cells": form("t_s,ay", lambda k, t, a: f"{t:.3f},{a} g"),
    "units with raised signs": form("t_s,ay", lambda k, t, a: f"{t:.3f},{9.81 * a:.5f} m/s\N{SUPERSCRIPT TWO}"),
    "commas and a point": (GROUPED, {}),
    "points and a comma": (GROUPED.translate(str.maketrans(",.", ".,")), {}),
    "apostrophes": (GROUPED.replace(",", "'"), {}),
    "blanks in thousands": (UNITS_IN_CELLS.replace(",", "\N{NO-BREAK SPACE}"), {}),
    "stamps in brackets": form("time;ay_g", lambda k, t, a: f"[10:00:{t:06.3f}];{a}"),
    "quoted lines": form('"t_s,ay_g"', lambda k, t, a: f'"{t:.3f},{a}"'),
    "secs and nsecs": form("secs,nsecs,ay_g", lambda k, t, a: f"{int(17 + t)},{round(t % 1 * 1e9)},{a}"),
    "a row of another sensor": form("t_s,ay_g,temp", lambda k, t, a: f"{t:.3f},{a},\n{t + 0.004:.3f},,20"),
    "one of two": form("t_s,kind,ay_g", lambda k, t, a: f"{t:.3f},ACC,{a}\n{t:.3f},GYR,{9 * a:.4f}", group="ACC"),
    "the range of a node": (NODES, {"group": "node=2"}),  # that of one is the number of the other
    "a kind within a node": form(
        "t_ms,node,kind,y",
        lambda k, t, a: f"{8 * k},1,ACC,{-a}\n{8 * k},1,GYR,{9 * a}\n{8 * k},2,ACC,{a}\n{8 * k},2,GYR,{-9 * a}",
        group="node=2,kind=ACC", axes={"ay": "y"}, unit="g",
    ),
    "nodes as pandas writes them": (NODES.replace(",1,", ",1.0,").replace(",4,2,", ",4,2.0,"), {"group": "node=2"}),
    "a node that is a stamp, too": (NODES.replace(",4,2,", ",4,8,"), {"group": "8"}),
    # whole numbers and words that are of no other sensor
    "counts of other axes": form(
        "t_ms,X,Y,Z", lambda k, t, a: f"{8 * k},{NOISE[k]},{a},{NOISE[-k] // 4}", axes={"ay": "Y"}, unit="g"
    ),
    "a rate of turn": form("t_ms,gz_dps,ay_g", lambda k, t, a: f"{8 * k},{round(5 * a) + NOISE[k] // 8},{a}"),
    "a counter that begins again": form("t_s,n,ay_g", lambda k, t, a: f"{t:.3f},{k % 16},{a}"),
    "a counter and coarse stamps": form(
        "t_s,n,ay_g", lambda k, t, a: f"{k // 3 * 0.024:.3f},{k % 16},{a}", time="none", rate=125
    ),
    "buffers in turn": form("t_s,buffer,ay_g", lambda k, t, a: f"{t:.3f},{'AB'[k % 2]},{a}"),
    "laps": form("t_s,lap,ay_g", lambda k, t, a: f"{t:.3f},{1 + k // 150},{a}"),
    "two states by chance": form("t_s,state,ay_g", lambda k, t, a: f"{t:.3f},{NOISE[k] > 0:d},{a}"),
    "buffers that jump": form("t_s,buffer,ay_g", lambda k, t, a: f"{t:.3f},{'AB'[k % 2]},{a}", group="none"),
    "a counter of 32 bits": form("t_us,ay_g", lambda k, t, a: f"{(4293967295 + 8000 * k) % 2**32},{a}"),
    "a counter of 16 bits": form("Millis,ay_g", lambda k, t, a: f"{(65000 + 8 * k) % 2**16},{a}", time="Millis"),
    "micros in s": form("t_s,ay_g", lambda k, t, a: f"{(4294.9 + t) % 4294.967296:.6f},{a}"),
    "every row twice": form("t_s,ay_g", lambda k, t, a: f"{t:.3f},{a}\n{t:.3f},{a}"),
    "twice, without stamps": form("t_s,ay_g", lambda k, t, a: f"{t:.3f},{a}\n" * 2, time="none", rate=125),
    "counts without a sign": form("t_s,ay", lambda k, t, a: f"{t:.3f},{round(8192 * a) % 65536}", scale=8192),
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_a_form_holds_the_signal(form, tmp_path):
    text, options = FORMS[form]
    record = read_sensor(written(tmp_path / "record.csv", text), load_mapping(**options))
    np.testing.assert_allclose(record.ay, AY, atol=7e-5)  # half a count
    assert record.rate == pytest.approx(125, rel=1e-4) and not record.doubts


@pytest.mark.parametrize("form", ["plain", "one of two", "counts without a sign"])
def test_a_dataframe_is_read_as_its_file(form):
    text, options = FORMS[form]
    frame = pd.read_csv(io.StringIO(text))
    for same in (frame, frame.set_index("t_s"), frame.assign(t_s=pd.to_timedelta(frame.t_s, "s"))):
        record = read_sensor(same, load_mapping(**options))
        np.testing.assert_allclose(record.ay, AY, atol=7e-5)
        assert record.rate == pytest.approx(125, rel=1e-4)


def test_a_message_among_the_rows_is_a_gap(tmp_path):
    lines = FORMS["plain"][0].splitlines()
    path = written(tmp_path / "record.csv", "\n".join([*lines[:301], "FIFO overflow!", *lines[301:]]))
    refused(read_sensor, path, words=["line 302 ", "`gaps: longest`"])
    np.testing.assert_allclose(read_sensor(path, LONGEST).ay, AY[:300])


COUNTED = "may be the row number; .*`time: none, rate: HZ`"
WRONG_STAMPS = "stamps are wrong, such as 0.8 for 0.008, read them without, `time: none, rate: HZ`; else sort the rows"
TWO_MEANINGS = [
    ("t_s,kind,ay_g", lambda k, t, a: f"{t:.3f},ACC,{a}\n{t:.3f},GYR,{a}", "`group: kind=ACC`, or, .*`group: none`"),
    ("t_s,id,ay_g", lambda k, t, a: f"{t:.3f},1.0,{a}\n{t + 0.004:.3f},2.0,{-a}", "`group: id=1.0`"),
    ("Time,ay_g", lambda k, t, a: f"{k},{a}", COUNTED + ".*`rate: 1000`"),
    ("Time,ay_g", lambda k, t, a: f"{(65400 + k) % 2**16},{a}", "may be the row number"),
    ("Time,ay_g", lambda k, t, a: f"{k},{a}" if k not in (50, 51, 99) else "", COUNTED),
    (",ay_g", lambda k, t, a: f"{5 * k},{a}", "the time may be in column 1 '.*`time: none, rate: HZ`"),
    ("t_s,ay_g", lambda k, t, a: f"{int(t)}.{round(t % 1 * 1000)},{a}", WRONG_STAMPS),
    ("t_ms,ay_g", lambda k, t, a: f"{8 * k},{a - 0.7:.4f}".replace(".", ","), "decimal commas among commas"),
    ("t_s,ay", lambda k, t, a: f"{t:.3f}," + (f"{a} g" if k % 9 else f"{1000 * a:.1f} mg"), "number .* in mg"),
    ("t_s,ay_mg", lambda k, t, a: f"{t:.3f},{a} g", "the unit 'mg and g'"),
    ("t:0.000,ay:0", lambda k, t, a: f"t:{t:.3f},ay:{a}", "no column for ay among 't:0.000'"),
    ("t_s,ay_g", lambda k, t, a: f"{T[-1] - t:.3f},{a}", "newest row is first; sort the rows"),
    ("t_s,ay_g", lambda k, t, a: f"{T[k ^ 1]:.3f},{AY[k ^ 1]}", "sort the rows"),
    ("t_s,channel", lambda k, t, a: f"{t:.3f},{a}", "axes: {ay: NAME}`.*`unit: g`"),
]
TWO_GROUPS = [(PACKETS, "`group: box=a`"), (NODES, "`group: range_g=2`")]


@pytest.mark.parametrize(("text", "words"), [*((table(*row), words) for *row, words in TWO_MEANINGS), *TWO_GROUPS])
def test_what_has_two_meanings_is_refused(text, words, tmp_path):
    refused(read_sensor, written(tmp_path / "record.csv", text), match=words)


def test_a_code_of_two_columns_is_asked_for(tmp_path):
    path = written(tmp_path / "record.csv", NODES)
    words = ["2 ('range_g') and 3 ('node') have '2'", "`group: range_g=2` or `group: node=2`"]
    refused(read_sensor, path, load_mapping(group="2"), words=words)
    np.testing.assert_allclose(read_sensor(path, load_mapping(group="1")).ay, -AY)
    refused(read_sensor, path, load_mapping(group="node=3"), words=["no row has it"])
    # a group within a group is named in full
    path = written(path, FORMS["a kind within a node"][0].replace(",y\n", ",ay_g\n"))
    refused(read_sensor, path, load_mapping(group="node=2"), words=["`group: 'node=2,kind=ACC'`, or"])


@pytest.mark.parametrize(("value", "zero"), [(0, 0), (-1, 0), (0, 512)])
@pytest.mark.parametrize("every", [20, 90])
def test_errors_of_a_bus_within_the_range_are_doubted(value, zero, every):
    rng, options = np.random.default_rng(6), {"scale": 256, "zero": float(zero)}
    clean = pd.DataFrame({"t_s": np.arange(4000) / 1000, "ay": np.round(256 * FAST) + zero})
    assert not read_sensor(clean, load_mapping(**options)).doubts
    frame = clean.assign(ay=clean.ay.where(rng.random(4000) >= 1 / every, value))
    (doubt,) = read_sensor(frame, load_mapping(**options)).doubts
    assert f"{(frame.ay == value).sum()} of 4000 rows" in doubt and f"are {value} and off their neighbours" in doubt
    record = read_sensor(frame, load_mapping(**options, gaps="longest"))
    assert not record.doubts and record.ay.size < 4000


def test_an_index_of_rows_is_no_time_and_stamps_in_ms_are():
    """A table of every fifth row keeps their numbers; one whose index is also a column has it once."""
    t = np.round(np.arange(5000) / 0.9989)
    record = read_sensor(pd.DataFrame({"time": t, "ay_g": np.sin(0.007 * t)}))
    assert record.rate == pytest.approx(998.9, rel=1e-5)
    frame = pd.DataFrame({"t_s": T, "ay_g": AY})
    assert read_sensor(frame.set_index("t_s", drop=False)).rate == pytest.approx(125)
    frame.index = 5.0 * np.arange(T.size)
    np.testing.assert_array_equal(read_sensor(frame).ay, AY)
    refused(read_sensor, frame[["ay_g"]], match="no column of time")
    assert read_sensor(frame[["ay_g"]], load_mapping(rate=400)).rate == 400


@pytest.mark.parametrize("rows", [[30], [60, 61, 200], [30, 90, 150, 151]])
@pytest.mark.parametrize(("mark", "unit", "options"), [
    (-32768, 1 / 2048, {"range": 16, "bits": 16}), (32767, 1 / 2048, {"scale": 2048}),
    (-9999, 1e-3, {"unit": "mg"}), (65535, 1 / 512, {"scale": 512, "zero": 2048}), (-9999, 1.0, {"unit": "g"}),
])  # fmt: skip
def test_values_far_from_all_others_are_no_samples(mark, unit, options, rows, tmp_path):
    values = np.round(AY / unit + options.get("zero", 0), 4 if unit == 1 else 0)
    values[rows] = mark
    path = written(tmp_path / "record.csv", table("t_s,ay", lambda k, t, a: f"{t:.3f},{values[k]:g}"))
    words = [f"line {rows[0] + 2} ", f"is {mark}, far from all ", "`gaps: bridge`"]
    refused(read_sensor, path, load_mapping(**options), words=words)
    record = read_sensor(path, load_mapping(**options, gaps="bridge"))
    np.testing.assert_allclose(record.ay, AY, atol=0.4)  # between samples of a wave of 0.2 g and 24 Hz
    assert record.done["gaps"].startswith(f"{len(rows)} samples")
    np.testing.assert_allclose(np.delete(record.ay, rows), np.delete(AY, rows), atol=unit)


@pytest.mark.parametrize("wild", [{}, {9: -45.0, 200: 1e6}])
def test_few_values_beyond_the_range_may_be_left_out(wild):
    values, bridge = pd.Series(wild).combine_first(pd.Series(AY)), load_mapping(gaps="bridge")
    record = read_sensor(pd.DataFrame({"t_s": T, "ay_g": values}), bridge)
    assert record.done["gaps"].startswith(f"{len(wild)} samples") and np.abs(record.ay - AY).max() < 0.4
    words = ["beyond the sensor's range ", " check the unit, `unit: m/s2`"]
    refused(read_sensor, pd.DataFrame({"t_s": T, "ay_g": 981 * AY}), bridge, words=words)


def test_several_marks_are_none_of_the_signal():
    ay = np.round(1000 * AY)
    ay[[30, 80, 200]], ay[[90, 120]], ay[[50, 51]] = -9999, -8888, 9999
    frame = pd.DataFrame({"t_s": T, "ay_mg": ay})
    refused(read_sensor, frame, match="row 30 and 6 more is -9999")
    assert np.abs(read_sensor(frame.assign(ay_mg=np.where(np.abs(ay) > 5000, np.nan, ay)), LONGEST).ay).max() < 2


def test_a_signal_that_wraps_is_doubted_and_one_of_equal_values_is_not():
    """In steps of 4 mg a slow wave keeps its value for tens of rows of 25.6 kHz, which last 3 ms."""
    (doubt,) = read_sensor(pd.DataFrame({"t_s": T, "ay_g": np.round((AY + 0.6) % 1.2 - 0.6, 4)})).doubts
    assert "wraps at the end of its range" in doubt
    t = np.arange(60_000) / 25_600
    ay = np.round(np.sin(7 * t) / 0.004) * 0.004 + 0.004 * (np.arange(t.size) % 2) * (np.abs(np.cos(7 * t)) > 0.05)
    assert not read_sensor(pd.DataFrame({"t_s": t, "ay_g": ay})).doubts


@pytest.mark.parametrize("names", [None, "y[{}]", "ay_{} (g)"])
@pytest.mark.parametrize("count", [2, 5, 8])
def test_several_samples_a_row_are_no_channels(names, count, tmp_path):
    frame = pd.DataFrame(FAST.reshape(-1, count), columns=[(names or "{}").format(k) for k in range(count)])
    (path := tmp_path / "record.csv").write_text(frame.to_csv(index=False, header=bool(names)) + "0.5\n" * (not names))
    ay = "#1" if names is None else frame.columns[count - 1]
    words = ["column 1", f" to column {count}", f" each row has {count} samples"]
    for axes in ({"ay": ay}, {}) if names == "y[{}]" else ({"ay": ay},):
        refused(read_sensor, path, load_mapping(time="none", rate=1000, axes=axes, unit="g"), words=words)
    if names is None:  # each with its time
        pairs = np.column_stack([np.arange(4000) / 1000, FAST]).reshape(-1, 2 * count)
        path.write_text(pd.DataFrame(pairs).to_csv(index=False, header=False))
        words = [f"column 2 to column {2 * count} ", f" each row has {count} samples"]
        refused(read_sensor, path, load_mapping(time="1", axes={"ay": "2"}, unit="g"), words=words)
    # two sensors of one place, and one of another, are channels
    noise = np.random.default_rng(1).normal(0, 0.01, (2000, 3))
    frame = pd.DataFrame(noise + FAST.reshape(2, -1)[[0, 0, 1]].T, columns=["ay_1", "ay_2", "ay_3"])
    record = read_sensor(frame, load_mapping(time="none", rate=1000, axes={"ay": "ay_1"}, unit="g"))
    np.testing.assert_array_equal(record.ay, frame["ay_1"])


@pytest.mark.parametrize("before", [0, 2.5, 8])
@pytest.mark.parametrize("after", [0, 4])
@pytest.mark.parametrize("noise", [0.003, 0.03])
def test_a_record_that_begins_or_ends_at_rest_names_the_option_that_leaves_it_out(before, after, noise, tmp_path):
    rng, rate = np.random.default_rng(2), 250
    t = np.arange(3000) / rate
    moving = np.sin(1.6 * t) + 0.4 * np.sin(150 * t) * (1 + np.cos(1.6 * t)) + 0.1 * rng.normal(size=t.size)
    ay = np.r_[np.full(round(before * rate), 0.97), moving, np.full(round(after * rate), -0.4)]
    ay += noise * rng.normal(size=ay.size)
    frame = pd.DataFrame({"t_s": np.arange(ay.size) / rate, "ay_g": ay})
    doubts = read_sensor(frame).doubts
    options = {}
    for key, side, at in (("from", "begins", before), ("to", "ends", before + 12.0)):
        cut = [doubt for doubt in doubts if f"{side} at rest" in doubt]
        assert len(cut) == bool(before if key == "from" else after), doubts
        if cut:
            options[key] = float(cut[0].split(f"`{key}: ")[1].split("`")[0])
            assert options[key] == pytest.approx(at, abs=0.8)
    record = read_sensor(frame, load_mapping(**options))
    assert not record.doubts and record.ay.std() == pytest.approx(moving.std(), rel=0.02)


@pytest.mark.parametrize(("still", "start", "words"), [
    (T < 1, 0, ("125 rows from line 2 to line 126", "`from: 1`")),
    ((T < 1) | (T > 2.9), 1, ("37 rows from line 365 to line 401", "`to: 2.896`")),
    ((T > 1.5) & (T < 2), 0, ("62 rows from line 190", "`from: 2` or `to: 1.496`")),
])  # fmt: skip
def test_rows_of_a_sensor_that_hung_are_named(still, start, words, tmp_path):
    text = table("t_s,ay_g,ax_g", lambda k, t, a: f"{t:.3f},{0.0 if still[k] else a},{t % 0.3:.3f}")
    (doubt,) = read_sensor(written(tmp_path / "record.csv", text), load_mapping(start=start)).doubts
    assert all(word in doubt for word in words), doubt


@pytest.mark.parametrize(("fields", "options"), {
    "`time: none, rate: HZ`": "--time none --rate HZ", "`axes: {ay: -NAME}`": "--axis ay=-NAME",
    "`axes: {ay: '#2'}`": "--axis 'ay=#2'", "`zero: {ay: 512, ax: 3}`": "--zero ay=512 --zero ax=3",
    "`resample: true`": "--resample", "`from: S`": "--from S", "`trackdyn simulate`": "`trackdyn simulate`",
    "`a: [`": "`a: [`",
}.items())  # fmt: skip
def test_fields_become_options(fields, options):
    assert as_options(f"give {fields}.") == f"give {options}."

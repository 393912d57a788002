"""Sensor files: a form with one meaning is read, every defect is named."""

import numpy as np
import pandas as pd
import pytest

from tests import conftest
from tests.conftest import written
from trackdyn.fieldtest import text_file
from trackdyn.fieldtest.logger_text import NUMBER
from trackdyn.fieldtest.sensor_csv import read_sensor
from trackdyn.fieldtest.sensor_mapping import SensorMapping, _column, load_mapping
from trackdyn.fieldtest.stamps import lost_rows
from trackdyn.rig import rig_file

HEADER = "t_s,ax_g,ay_g,az_g"


def rows(n=6, step=0.001):
    return [f"{k * step:.3f},0.1000,{1.0 + 0.01 * k:.4f},-0.2000" for k in range(n)]


def changed(number, text):
    """The clean file with the line of this number (the header is line 1) replaced."""
    lines = [HEADER, *rows()]
    lines[number - 1] = text
    return "\n".join(lines) + "\n"


CLEAN = "\n".join([HEADER, *rows()]) + "\n"
BARE = "\n".join(rows()) + "\n"
AY = [1.0, 1.01, 1.02, 1.03, 1.04, 1.05]


def raw(header, values):
    return header + "\n" + "".join(f"{k / 1000:.3f},0,{value},7\n" for k, value in enumerate(values))


def each(count, row, header=""):
    return header + "\n" * bool(header) + "".join(row(k) + "\n" for k in range(count))


def by(time, ay, **more):
    return {"time": time, "axes": {"ay": ay}, "unit": "g"} | more


NOON = each(6, lambda k: f"noon {k},{k}")
DATED = each(6, lambda k: f"2024-05-01 10:00:00.{k:03d},0.1,{1 + 0.01 * k:.2f}")
COARSE = each(16, lambda k: f"{0.001 * (k // 4):.3f},0,{k},0", HEADER)
# contents, words of the sentence that refuses them, and the options with which they are read
DEFECTS = {
    "empty": ("", ("empty", HEADER)),
    "comments only": ("# made by hand\n", ("only comments", HEADER)),
    "one row": (HEADER + "\n0.000,0,1,0\n", ("1 data rows", "at least 2")),
    "a quote within quoted lines": ("".join(f'"{line}"\n' for line in changed(5, '0.003,"0.1",1.03,0').splitlines()),
        ("no column for ay",)),
    "no header": (BARE, ("line 1", "numbers", "axes: {ay: 3}")),
    "one name too few": (CLEAN.replace(",az_g", ""), ("line 2", "4 fields", "3 names", "'ay_g'")),
    "no unit": (changed(1, "t_s,ax_g,ay,az_g"), ("'ay'", "states no unit", "m/s2")),
    "another unit of time": (changed(1, "t (min),ax_g,ay_g,az_g"), ("'t (min)'", "'min'", "time: none, rate: HZ")),
    "counts": (raw("t_s,ax,ay (counts),az", [1, 2, 3]), ("the unit 'counts'", "scale: N", "range: G, bits: N")),
    "no gravity": (changed(1, "t_s,ax_g,Linear Acceleration y (g),az_g"), ("no column for ay", "axes: {ay: NAME}")),
    "two of a name": (changed(1, "t_s,ax_g,ay_g,AY (g)"), ("columns 3 ('ay_g') and 4 ('AY (g)')", "axes: {ay: '#3'}")),
    "no time": (changed(1, "n,ax_g,ay_g,az_g"), ("no column of time", "'n'", "time: none, rate: HZ")),
    "time in a form that is not read": (each(6, lambda k: f"{k};1,00{k}", "ay_g;TimeOfDay"),
        ("the time may be in column 2",), {"rate": 1e3}),
    "truncated last line": (changed(7, "0.005,0.1"), ("line 7", "2 fields", "ay_g")),
    "two bad lines": (changed(4, "0.002,0.1,1.0").replace("0.003,", "0.003,0.1,"), ("line 4", "3 fields", "has 4")),
    "no names": (each(6, lambda k: f"0.00{k},1.{k}", ","), ("no column for ay among columns without names",)),
    "empty line": (changed(4, ""), ("line 5", "0.002 s apart")),
    "text": (changed(5, "0.003,0.1,abc,0.0"), ("ay_g", "line 5", "'abc'", "finite number")),
    "comment among the rows": (changed(5, "# 0.003: shock"), ("line 5", "comment", "remove")),
    "overflow": (changed(5, "0.003,1e999,1.0,0.0"), ("ax_g", "line 5", "'1e999'", "finite")),
    "semicolons below a good header": (changed(2, "0.000;0.1;1.0;0.0"), ("line 2", "1 fields between commas")),
    "points among decimal commas": (CLEAN.replace(",", ";").replace(".", ",").replace("0,003;0,1000", "0,003;0.1"),
        ("ax_g", "line 5", "'0.1'", "decimal comma")),
    "thousands or decimals": (each(6, lambda k: f"{k};12;1,0{k}0;7", "t_ms;ax_mg;ay_mg;az_mg"), ("'1,000'", "thous")),
    "gap": ("\n".join([HEADER, *rows()[:3], *rows()[4:]]), ("line 5", "0.002 s apart", "missing", "from: S")),
    "step too short": (changed(5, "0.0023,0.1,1.0,0.0"), ("line 6", "apart", "resample: true")),
    "too slow": ("\n".join([HEADER, *rows(step=0.02)]), ("t_s", "50 rows per second", "100 to 1,000,000", "rate: HZ")),
    "too coarse": (COARSE, ("0.001 s", "coarse", "time: none")),
    "equal stamps in the window": (COARSE, ("all 4 rows are equal", "time: none"), {"start": 0.003}),
    "drifting rate": (each(900, lambda k: f"{0.001 * k + 4e-8 * k * k:.7f},0,{k % 9},0", HEADER), ("s apart", "mean")),
    "equal stamps": (changed(5, "0.002,0.1,1.0,0.0"), ("line 5", "0 s apart", "no two are equal")),
    "just beyond the range": (changed(5, "0.003,0.1,1.0,20.0021"), ("az_g", "line 5", "20.0021", "20 g", "range: G")),
    "constant": (raw(HEADER, [0.98] * 9), ("'ay_g'", "0.98 in every row")),
    "clipped": (raw(HEADER, [20, -20] * 5), ("10 of 10 rows", "range: G")),
    "late bad byte": (CLEAN.encode() + b"\x80", ("line 8", "1 fields")),
    "half of a double byte": (CLEAN.encode("utf-16")[:-1], ("axes: {ay: NAME}",)),
    "a spreadsheet": (b"PK\x03\x04" + bytes(100), ("an archive or a spreadsheet",)),
    "a database": (b"SQLite format 3\0", ("SQLite", "docs/your-loggers-file.md")),
    "EDF": (b"0".ljust(8) + b"X X X X".ljust(1000) + bytes(900), ("EDF", "docs/your-loggers-file.md")),
    "binary data": (np.arange(500, dtype="<i2").tobytes(), ("binary data",)),
    # columns by number
    "two named 3": ("t,1,2,3\n" + BARE, ("columns 3 ('2') and 4 ('3')", "axes: {ay: '#3'}"), by("1", "3")),
    "numbers above": ("0,1,2,3\n" + BARE, ("line 1 ('0,1,2,3')", "remove it"), by("1", "3")),
    "numbers above names": ("1,2,3,4\nt,x,y,z\n" + BARE, ("field 3 in line 2 is 'y'", "remove"), by("1", "3")),
    "rows above names": (BARE[:28] + CLEAN, ("line 1 has numbers", "line 2"), by("t_s", "ay_g")),
    "text in the first row": (BARE.replace("1.0000", "abc"), ("field 3 in line 1 is 'abc'",), by("1", "3")),
    "a number in a preamble": (each(9, lambda k: f"{k};{1 + 0.01 * k}", "Device;7"),
        ("line 1 ('Device;7')", "text"), by("none", "2", rate=1000)),
    "no such number": (BARE, ("no column 9", "4 fields"), by("1", "9")),
    "a number twice": (BARE, ("'1' is named for ay and time",), by("1", "1")),
    "a name and a number": (BARE, ("line 1 has numbers", "all columns by number"), by("t_s", "3")),
    "stamps of no form": (NOON, ("column 1 and 2", "time: none, rate: HZ"), by("1", "2")),
    "stamps of no form below names": ("t,y\n" + NOON, ("or a date and time as",), by("t", "y")),
    "dates for ay": (DATED, ("field 1 in line 1", "finite number"), by("3", "1")),
    # units and zeros
    "counts beyond the range": (raw("t_s,ax,ay,az", [1, 40000, 3]), ("19.5312 g", "counts of 1/2048 g", "scale: N"),
        {"range": 16, "bits": 16}),
    "another zero": (raw("t_s,ax,ay,az", [1948, 2148] * 20),
        ("21.48 g", "where 0 g is not 0, perhaps `zero: 2048`"), by("t_s", "ay", unit=None, scale=100)),
    "half of the counts": (raw("t_s,ax,ay,az", [30768, 35168] * 20),
        ("where 0 g is not 0, perhaps `zero: 32768`",), by("t_s", "ay", unit=None, scale=1024)),
    "all missing": (each(9, lambda k: f"{k}0,{k},1,{k}.5,{k}0,{k}.7", ",Box 1,,Box 2,\nTime,Clock,y,ay,time,ay"),
        ("columns 1 ('Time') and 5 ('time') may all be time, 4 ('ay') and 6 ('ay') may all be ay",
         "`time: '#1', axes: {ay: '#4'}`", "column 'ay' states no unit")),
    "names below a title": (
        "Made by an app v9.1 ( http://app.example/ ).\nFormat,3\nDriver name,\n\nstamp,lap,speed,acc_1\nunix,,m/s,G\n"
        + "".join(f"{k / 1000:.3f},,{k % 3},{k % 7}.5\n" for k in range(9)),
        ("no column for ay among 'stamp', 'lap', 'speed', 'acc_1'", "`time: '#1'`"),
    ),
    "a row of a preamble": (each(30, lambda k: f" {k % 7}.25 {k % 5}.5 {k % 3}.75", "POINTS 90  AT 1000 HZ"),
        ("no column for ay among '1', '2', '3'",)),
    "a checksum": (each(9, lambda k: f"{k / 1000:.3f},{k % 7}.5*{k + 16:02X}"),
        ("no rows with numbers in column 1 and 2", "line 9 has '1.5*18'"), by("1", "2")),
    "messages": (b"header: \n  seq: 0\nlinear_acceleration: \n  y: -2.3927\n---\n", ("messages in YAML", "echo -p")),
}  # fmt: skip


def refused(path, words, **options):
    text = conftest.refused(read_sensor, path, words=words, start=path, **options)
    assert text.endswith(".") and ". " not in text


@pytest.mark.parametrize("name", DEFECTS)
def test_defect_is_refused_in_one_sentence(name, tmp_path):
    content, words, *options = DEFECTS[name]
    refused(written(tmp_path / "record.csv", content), words, mapping=load_mapping(**dict(*options)))


@pytest.mark.parametrize(("name", "line"), [("text", 5), ("gap", 5), ("truncated last line", 7)])
def test_line_numbers_count_comments_and_survive_foreign_newlines(name, line, tmp_path):
    content = "# made by hand\n# for a test\n" + DEFECTS[name][0]
    for text in (content, content.replace("\n", "\r\n")):
        refused(written(tmp_path / "record.csv", text), [f"line {line + 2}"])


def test_senseless_options_and_a_large_file_are_refused_at_once(tmp_path, monkeypatch):
    path = written(tmp_path / "record.csv", CLEAN)
    for options in ({"range_g": -1.0}, {"gravity": np.nan}):
        refused(path, list(options), **options)
    monkeypatch.setattr(text_file, "MAX_TEXT_BYTES", 100)
    refused(path, ["more than 0 MB"])


@pytest.mark.parametrize("content", [
    CLEAN + "\n\n", "# one\n# two, with commas; and more\n" + CLEAN,
    CLEAN.replace("\n", "\r"), CLEAN.replace("\n", ",\n"), CLEAN.replace(",", ";"), CLEAN.replace(",", " "),
    *(CLEAN.encode(encoding) for encoding in ("utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32")),
    CLEAN + ",,,\n,,,\n", CLEAN + "# end of record\n\n#\n", CLEAN + "\x1a",
    CLEAN.replace(HEADER, HEADER + "\n" + "-" * 20), CLEAN.replace(HEADER, HEADER + "\nlogger ready"),
    b"# B\xfcro\n" + CLEAN.encode(), CLEAN.replace("0.003,0.1000", '0.003,"0.1"'),
    CLEAN.replace(HEADER, "T_s, AX_G ,'ay_g',\"Az_g\""), CLEAN.replace(HEADER, "# " + HEADER),
    CLEAN.replace(HEADER, "Device;7\nRate;1000\n\n" + HEADER), CLEAN.replace(HEADER, "t,ax,ay,az\ns,g,g,g"),
    CLEAN.replace(HEADER, "Time (s),Acceleration x (g),Acceleration y (g),Acceleration z (g)"),
    CLEAN.replace(",", ";").replace(".", ","), CLEAN.replace(",", "\t").replace(".", ","),
    HEADER + "\n" + "".join('"' + r.replace(",", '","').replace(".", ",") + '"\n' for r in rows()),
    "\n".join(",".join((f := r.split(","))[k] for k in (2, 0, 3, 1)) for r in [HEADER, *rows()]),
    "\n".join([f"{HEADER},note", *(f"{row},shock" for row in rows())]),
    "\n".join(f"{k}\t{r}" for k, r in zip(["", *range(6)], CLEAN.replace(",", "\t").splitlines(), strict=True)),
    each(6, lambda k: f"{k},0.981,{9.81 + 0.0981 * k:.6f},-200", "t_ms,ax_m/s^2,ay [m/s\N{SUPERSCRIPT TWO}],az_mg"),
    CLEAN.replace("0.1000", "1e-1").replace("-0.2000", "-.2"),
])  # fmt: skip
def test_harmless_variants_are_read(content, tmp_path):
    record = read_sensor(written(tmp_path / "record.csv", content))
    np.testing.assert_array_equal(record.time, np.arange(6) / 1000)
    np.testing.assert_allclose([record.ax, record.ay, record.az], [[0.1] * 6, AY, [-0.2] * 6], rtol=1e-15)
    assert (record.rate, record.clipped, record.path) == (1000.0, 0, tmp_path / "record.csv")


def test_columns_are_chosen_with_a_sign(tmp_path):
    path = written(tmp_path / "record.csv", CLEAN.replace(HEADER, "Clock,ch1,ch2 (g),ch3 (m/s2)"))
    mapping = SensorMapping(time="clock", axes={"ay": "-CH2", "az": "ch3 (m/s2)"})
    record = read_sensor(path, mapping)
    np.testing.assert_array_equal(-record.ay, AY)
    np.testing.assert_allclose(record.az, -0.2 / 9.81)
    assert record.ax is None
    read = "ay = -column 3 'ch2 (g)' in g, first value 1; az = column 4 'ch3 (m/s2)' in m/s2, first value -0.2"
    assert record.done["columns"] == read + "; not used: 'ch1'"
    for axis in ("ay", "ax"):
        absent = SensorMapping(axes={"ay": "ch2"} | {axis: "ch9"})
        refused(path, [f"no column 'ch9' for {axis}", "'ch1'"], mapping=absent)
    # a stated unit wins over the header, and is noted
    record = read_sensor(path, mapping.model_copy(update={"unit": "m/s2"}))
    np.testing.assert_allclose(record.ay[:2] * 9.81, [-1.0, -1.01])
    assert "ay = -column 3 'ch2 (g)' in m/s2 as stated, not in g as in the file" in record.done["columns"]
    record = read_sensor(written(path, CLEAN.replace("ay_g", "ay (mV)")), SensorMapping(scale=100))
    np.testing.assert_allclose(record.ay[:2], [0.01, 0.0101])
    np.testing.assert_array_equal(record.az, -0.2)  # its header states g, and no option another unit of az
    assert "in counts of 1/100 g as stated, not in mv as in the file" in record.done["columns"]


LEVELS = each(6, lambda k: f"{k},{512 + round(68 * (1 + 0.01 * k))},{500 + k}")
COMMENTED = each(6, lambda k: f"{k / 1000:.3f},{1 + k / 100}{',begun' * (k == 0)}", "X_Value,y,Comment")
MONITOR = each(6, lambda k: f"10:00:00.{k:03d} -> {1 + k / 100},{k}")
UNITS = {
    "gn": ("g", 1.0), "mg": ("mg", 1e3), "m/(s^2)": ("m/s2", 9.81), "Gal": ("cm/s2", 981.0), "mm/s2": ("mm/s2", 9810.0),
    "m\N{MIDDLE DOT}s\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT TWO}": ("m/s2", 9.81),
}  # fmt: skip
BY_UNIT = {unit: each(6, lambda k, of_g=of_g: f"{k},{(1 + 0.01 * k) * of_g:.6f}") for unit, (_, of_g) in UNITS.items()}
# files of AY, the options that they need, and words on how they are read
FORMS = {
    **{f"in {unit}": (f"t_ms,ay ({unit})\n{text}", {}) for unit, text in BY_UNIT.items()},
    **{f"stated {unit}": (f"t_ms,ay\n{text}", {"unit": UNITS[unit][0]}) for unit, text in BY_UNIT.items()},
    # columns by number, whichever rows hold the number itself
    "a row that holds the numbers": (BARE.replace("0.1000", "3", 4), by("1", "3"), "column 3 in g, first value 1"),
    "sequence numbers": (each(6, lambda k: f"{k},{3 - k},{1 + 0.01 * k:.2f}"), by("1", "3", rate=1e3)),
    "exponents": (each(6, lambda k: f"{k / 1000:.3E} -1E-1 {1 + 0.01 * k:.3E}"), by("1", "3")),
    "blanks and decimal commas": (BARE.replace(",", " ").replace(".", ","), by("1", "3")),
    "dates": (DATED, by("1", "3")),
    # no time, though temps is one in French
    "temperature": (each(6, lambda k: f"{1 + k / 100},{20 + k}", "ay_g,TempSensor"), {"rate": 1000}, "rows counted"),
    "dates that are not used": (DATED, by("none", "3", rate=1000), "rows counted"),
    "names below a preamble of numbers": ("1000\n4 8\nt,x,y,z\n" + BARE, by("1", "3"), "column 3 'y'"),
    "a header with more names": (";Headers,t,x,y,z\n" + BARE, by("1", "3"), "column 3 in g"),
    "names": ("t,x,y,z\n" + BARE, by("1", "3"), "column 3 'y'"),
    "a name and a number": ("a,b,c,d\nClock,x,y,z\n" + BARE, by("clock", "3"), "column 3 'y'"),
    "names that are numbers": ("t,1,2,3\n" + BARE, by("#1", "#3"), "column 3 '2'"),
    "names of a table of pandas": (",0,1,2\n" + BARE, by("#1", "#3"), "column 3 '1'"),
    "two sensors": ("".join(f"{row},9,{row}\n" for row in rows()), by("6", "8")),
    "remarks": ("".join(f"{row},{'shock' * (k == 2)}\n" for k, row in enumerate(rows())), by("1", "3")),
    "a defect in a column that is not used": (BARE.replace("-0.2000", "ERR", 1), by("1", "3")),
    "two lines of names": ("x-axis,1,2\nsecond,Volt,Volt\n" + BARE, by("#1", "#3")),
    "zero of an axis": ("t_ms,ay,ax\n" + LEVELS, {"scale": 68, "zero": {"ay": 512}}),
    "zero of bits": ("t_ms,ay,ax\n" + LEVELS, {"bits": 10, "range": 512 / 68, "zero": 512}),
    "zero, turned": ("t_ms,up,x\n" + LEVELS.replace(",5", ",-5"), {"axes": {"ay": "-up"}, "scale": 68, "zero": -512}),
    "zero in g": (each(6, lambda k: f"{k},{1.5 + 0.01 * k}", "t_ms,ay (g)"), {"zero": 0.5}),
    "exponents with D": (each(6, lambda k: f"{k}.D-3,{100 + k}.d-2", "t_s,ay_g"), {}),
    "sections": ("[names]\nt_s ax_g ay_g az_g\n\n[data]\n" + BARE.replace(",", " "), {}),
    "a serial monitor": (MONITOR, by("3", "1")),
    "monitor, brackets": (each(6, lambda k: f"[10:00:00.{k:03d}] {1 + k / 100}\t{k}"), by("none", "1", rate=1e3)),
    "a monitor with names": ("10:00:00.000 -> ay_g,t_ms\n" + MONITOR, {}),
    "words below a blank line": (CLEAN + "\n\nSamples recorded: six; device off\n", {}, "left out: 'Samples"),
    "a last column for comments": (COMMENTED, {"axes": {"ay": "y"}, "unit": "g"}),
    "comments by number": (COMMENTED.replace(",", ";"), by("1", "2")),
    "checksums": (each(6, lambda k: f"$PIMU,{k / 1000:.3f},0.1,{1 + k / 100}*{k + 9:02X}"), by("2", "4")),
    "comments behind semicolons": (CLEAN.replace(HEADER, ";A logger\n;Headers, t_s,ax_g,ay_g,az_g"), {}),
    "Japanese": (("\u6642\u9593(s),X(g),\u52a0\u901f\u5ea6Y(g),Z(g)\n" + BARE).encode("cp932"),
        {"time": "#1", "axes": {"ay": "#3"}}),
}  # fmt: skip


@pytest.mark.parametrize("name", FORMS)
def test_other_forms_are_read(name, tmp_path):
    text, options, *words = FORMS[name]
    record = read_sensor(written(tmp_path / "record.csv", text), load_mapping(**options))
    np.testing.assert_allclose(record.ay, AY, atol=0.5 / 68 if "zero" in name else 1e-6)
    assert record.rate == pytest.approx(1000)
    notes = "; ".join(record.done.values())
    assert all(word in notes for word in words) and ("left out" in notes) == ("words below" in name), notes


def stamped(path, t, decimals=None):
    """A file whose ay is a sine of 7 Hz at the true times, with stamps of some decimals or in single precision."""
    text = [str(x) for x in t.astype(np.float32)] if decimals is None else [f"{x:.{decimals}f}" for x in t]
    return written(path, each(t.size, lambda k: f"{text[k]},{np.sin(2 * np.pi * 7 * t[k]):.6f}", "t_s,ay_g"))


@pytest.mark.parametrize(("rate", "start", "decimals"), [
    (998.9, 0, 6), (1000.9, 0, 3), (999.5, 0, 3), (1000.9, 0, 5), (1000, 3600, None), (2048, 3600, 4), (100, 0, 2),
    (20000, 7, 6),
])  # fmt: skip
def test_the_rate_is_found_from_rounded_stamps(rate, start, decimals, tmp_path):
    t = start + np.arange(60_000 if rate > 500 else 3000) / rate
    record = read_sensor(stamped(tmp_path / "record.csv", t, decimals))
    assert record.rate == pytest.approx(rate, rel=2e-6) and record.ay.size == t.size


def test_jitter_is_resampled_on_request_and_its_size_noted(tmp_path):
    t = np.arange(5000) / 1000 + np.random.default_rng(3).uniform(-2e-4, 2e-4, 5000)
    path = stamped(tmp_path / "record.csv", t - t[0], 6)
    refused(path, ["resample: true", "0.001 s is the mean"])
    record = read_sensor(path, SensorMapping(resample=True))
    assert record.done["resampled"].startswith("5000 rows onto")
    assert "steps 0.606 to 1.393 ms, 0.16 ms rms" in record.done["time"]
    # stamps rounded to 1 us twice, at 44 rad/s; taken as even, 0.2 ms would be 9e-3
    assert np.abs(record.ay - np.sin(2 * np.pi * 7 * record.time)).max() < 5e-5


@pytest.mark.parametrize(("text", "words"), [
    ("unit: ft/s2", ("unit = 'ft/s2'", "'m/s2'")), ("rate: 50", ("rate = 50", "100")),
    ("axis: {ay: 1}", ("axis", "spelling")), ("axes: {y: ch1}", ("axes.y",)), ("time: none", ("rate",)),
    ("from: 5\nto: 5", ("to = 5", "after")), ("- 1", ("mapping",)), ("axes: [ay]", ("axes",)),
    ("bits: 16", ("needs the range",)), ("{bits: 16, range: 16, scale: 2048}", ("give one of them",)),
    ("{scale: 2048, unit: g}", ("give one of them",)), ("{bits: 99, range: 16}", ("bits = 99",)),
    ("zero: {a: 1.0}", ("zero",)), ("zero: .inf", ("zero",)), ("axes: {ay: #3}\nunit: g", ("line", '"#3"')),
])  # fmt: skip
def test_a_mapping_is_refused_in_one_sentence(text, words, tmp_path):
    path = written(tmp_path / "logger.yaml", text + "\n")
    conftest.refused(load_mapping, path, words=words, start=path)


@pytest.mark.parametrize("options", [{"scale": 2048}, {"range": 16, "bits": 16}])
def test_raw_counts_are_read(options, tmp_path):
    header = "t_s,ax,ay,az" if "scale" in options else "t_s,ax,ay [LSB],az (g)"
    path = written(tmp_path / "raw.csv", raw(header, [2048, -1024, 32767, -32768, 0]))
    record = read_sensor(path, load_mapping(**options))
    np.testing.assert_allclose(record.ay, [1, -0.5, 32767 / 2048, -16, 0])
    assert "counts of 1/2048 g" in record.done["columns"] and record.clipped == (2 if "bits" in options else 0)


STAMPS = {
    "ISO, over the end of a year": ("%Y-%m-%dT%H:%M:%S.%fZ", "2023-12-31T23:59:57"),
    "ISO with a comma and a zone": ("%Y-%m-%dT%H:%M:%S,%f+02:00", "2024-05-01T10:00:00"),
    "a zone by name": ("%Y-%m-%d %H:%M:%S.%f CEST", "2024-05-01T23:59:57"),
    "ISO without signs": ("%Y%m%dT%H%M%S.%fZ", "2024-05-01T23:59:57"),
    "day of the week": ("%A %d %B %Y %H:%M:%S.%f", "2024-05-01T23:59:57"),
    "a dash before the hour": ("%Y/%m/%d-%H:%M:%S.%f", "2024-05-01T23:59:57"),
    "days and a point": ("1.%H:%M:%S.%f", "2024-05-01T20:00:00"),
    "ISO in quotes": ('"%Y-%m-%dT%H:%M:%S.%fZ"', "2024-05-01T10:00:00"),
    "American, short": ("%-m/%-d/%Y %H:%M:%S.%f", "2024-05-01T10:00:00"),
    "half a day": ("%m/%d/%Y %I:%M:%S.%f %p", "2024-05-01T11:59:57"),
    "two digits": ("%d.%m.%y %H:%M:%S.%f", "2024-05-30T10:00:00"),
    "over the end of a month": ("%d/%m/%Y %H:%M:%S.%f", "2024-05-31T23:59:57"),
    "month by name": ("%d-%b-%Y %H:%M:%S.%f", "2024-04-30T23:59:57"),
    "over midnight": ("%H:%M:%S.%f", "2024-05-01T23:59:57"),
    "half a day without date": ("%I:%M:%S.%f %p", "2024-05-01T11:59:57"),
}


@pytest.mark.parametrize("name", STAMPS)
def test_dates_of_any_form_are_stamps(name, tmp_path):
    form, begin = STAMPS[name]
    t = np.datetime64(begin) + np.arange(6000).astype("m8[ms]")
    texts = [stamp.item().strftime(form.replace("%f", f"{k % 1000:03d}")) for k, stamp in enumerate(t)]
    record = read_sensor(written(tmp_path / "a.csv", each(6000, lambda k: f"{texts[k]};{k % 7}", "Time;ay (g)")))
    assert record.rate == pytest.approx(1000.0, rel=1e-9) and record.ay.size == 6000
    assert record.done["time"].startswith("column 1 'Time' in s, to ")
    texts[4] = "x" + texts[4]
    path = written(tmp_path / "b.csv", each(6000, lambda k: f"{texts[k]};{k % 7}", "Time;ay (g)"))
    refused(path, ["Time in line 6", "date and time"])


@pytest.mark.parametrize("form", ["%d.%m.%Y %H:%M:%S.%f", "%m/%d/%Y %H:%M:%S.%f"])
@pytest.mark.parametrize("begin", ["2024-01-04", "2024-11-11", "2024-01-12", "2024-03-31"])
def test_the_order_of_day_and_month_follows_from_midnight(form, begin, tmp_path):
    """The 5th of January or the 1st of May, and the day after; the other order has a gap of a month."""
    t = np.datetime64(f"{begin}T23:59:59.5") + np.arange(1000).astype("m8[ms]")
    record = read_sensor(pd.DataFrame({"Time": [f"{stamp.item():{form}}" for stamp in t], "ay_g": np.arange(1000) % 7}))
    assert record.rate == pytest.approx(1000.0) and record.time[-1] == pytest.approx(0.999)


def holed(missing, mark="NaN"):
    """Rows of a slow wave at 1 kHz, of which some are missing, or there with a mark."""
    values = [mark if k in missing else f"{1 + 0.5 * np.sin(0.02 * k):.5f}" for k in range(2000)]
    return "t_s,ay_g\n" + "".join(f"{k / 1000:.4f},{value}\n" for k, value in enumerate(values) if value)


@pytest.mark.parametrize("mark", ["NaN", "", "OVLD", "\N{INFINITY}"])
@pytest.mark.parametrize(("missing", "groups"), [([3, 4, 5, 900], 2), ([*range(1500, 1510)], 1)])
def test_a_gap_is_bridged_or_the_longest_part_taken(missing, groups, mark, tmp_path):
    path = written(tmp_path / "record.csv", holed(missing, mark))
    refused(path, [mark, "gaps: longest"])
    record = read_sensor(path, SensorMapping(gaps="bridge"))
    np.testing.assert_allclose(record.ay, 1 + 0.5 * np.sin(0.02 * np.arange(2000)), atol=1e-3)
    assert record.done["gaps"].startswith(f"{len(missing)} samples in {groups} gaps interpolated")
    assert record.rate == pytest.approx(1000.0, rel=1e-9)
    record = read_sensor(path, SensorMapping(gaps="longest"))
    there = np.setdiff1d(np.arange(2000), missing)
    longest = max(np.split(there, np.flatnonzero(np.diff(there) > 1) + 1), key=len)
    np.testing.assert_allclose(record.ay, 1 + 0.5 * np.sin(0.02 * longest), atol=1e-5)
    assert record.time[0] == 0.0 and "the longest part without a gap" in record.done["gaps"]


@pytest.mark.parametrize("missing", [range(1500, 1511), range(0, 2000, 60)])
def test_too_much_is_not_bridged(missing, tmp_path):
    path = written(tmp_path / "record.csv", holed(missing))
    refused(path, ["at most 10 in a row and 1% are bridged", "gaps: longest"], mapping=SensorMapping(gaps="bridge"))
    assert read_sensor(path, SensorMapping(gaps="longest")).ay.size >= 59


@pytest.mark.parametrize("lost", [[5000], [2000, 2001], [100, 2000, 4000, 6500]])
@pytest.mark.parametrize(("rate", "decimals"), [(1000, 3), (1000.9, 6)])
def test_lost_rows_are_not_taken_for_rounding(lost, rate, decimals, tmp_path):
    t = np.delete(np.arange(9000), lost) / rate
    for mapping in (SensorMapping(), SensorMapping(rate=1000)):
        refused(stamped(tmp_path / "record.csv", t, decimals), ["`"], mapping=mapping)


@pytest.mark.parametrize(("unit", "scale"), [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
@pytest.mark.parametrize("named", [True, False])
@pytest.mark.parametrize("rate", [100, 20000])
def test_the_unit_of_time_follows_from_the_rate(unit, scale, named, rate, tmp_path):
    header = f"time{f' ({unit})' * named},ay_g"
    text = each(40, lambda k: f"{1.7e9 * (unit == 'ns') + k / rate * scale:.9g},{k % 7}", header)
    assert read_sensor(written(tmp_path / "record.csv", text)).rate == pytest.approx(rate, rel=1e-3)


@pytest.mark.parametrize(("low", "high"), [(-1.0, 1.0), (-9.0, 1.2)])
@pytest.mark.parametrize("levels", [1e5, 68])
def test_a_saturated_record_has_a_doubt(low, high, levels):
    rng = np.random.default_rng(4)
    t = np.arange(5000) / 1000
    ay = np.round(levels * (1.3 * np.sin(2 * np.pi * t) + 0.1 * rng.normal(size=t.size))) / levels
    whole, record = (read_sensor(pd.DataFrame({"t_s": t, "ay_g": values})) for values in (ay, np.clip(ay, low, high)))
    assert whole.clipped == 0 and not whole.doubts
    assert record.clipped == pytest.approx(np.sum((ay >= high) | (ay <= low)), abs=40 if levels == 68 else 1)
    assert len(record.doubts) == 1 and "the sensor is saturated there" in record.doubts[0]
    assert f"{record.clipped} of 5000 rows" in record.done["clipped"] and "extreme of ay" in record.done["clipped"]


@pytest.mark.parametrize("character", ["1", "_", " ", "(", "1.", "a_", "- "])
def test_a_long_field_is_refused_in_no_more_than_linear_time(character, tmp_path):
    """Where time grew with the square of the length, these did not end within minutes."""
    path = written(tmp_path / "a.csv", f"t_s,ay_g\n0.001,{character * 1_000_000}\n0.002,1\n")
    refused(path, ["characters", "export"])
    long = character * 200_000 + "x"
    assert _column(0, long, "").position == 0 and not any(form.fullmatch(long) for form in NUMBER.values())
    assert not rig_file.QUANTITY.fullmatch(long)


@pytest.mark.parametrize(("late", "gap"), [(2.4, False), (2.6, True)])
def test_a_step_of_more_than_two_and_a_half_intervals_is_a_gap(late, gap):
    """Stamps in s of 100 Hz; less is jitter, which may be resampled."""
    t = np.arange(1000) / 100 + (np.arange(1000) >= 500) * (late - 1) / 100
    assert bool(lost_rows(t, None, True).any()) == gap


@pytest.mark.parametrize(("largest", "asked"), [("99.125", True), ("500.125", True), ("1000.125", False)])
def test_points_that_may_group_thousands_are_asked_about(largest, asked, tmp_path):
    """Among whole numbers, and without a number between 0 and 1, up to a thousand: 1.234 may be 1234."""
    values, mapping = ("1.234", "7", largest, "2.345"), SensorMapping(unit="m/s2", range=1000.0)
    path = written(tmp_path / "a.csv", each(200, lambda k: f"{k / 100:.2f},{values[k % 4]}", "t_s,ay"))
    if asked:
        refused(path, ["decimals or thousands"], mapping=mapping)
    else:
        assert read_sensor(path, mapping).ay.size == 200

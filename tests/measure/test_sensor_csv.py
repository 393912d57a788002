"""Sensor files: what is written comes back, and every defect is named."""

import time

import numpy as np
import pytest

from trackdyn.errors import InputError
from trackdyn.measure.sensor_csv import read_sensor_csv, write_sensor_csv

HEADER = "t_s,ax_g,ay_g,az_g"


def rows(n=6, step=0.001):
    return [f"{k * step:.3f},0.1000,{1.0 + 0.01 * k:.4f},-0.2000" for k in range(n)]


def changed(number, text):
    """The clean file with the line of this number (the header is line 1) replaced."""
    lines = [HEADER, *rows()]
    lines[number - 1] = text
    return "\n".join(lines) + "\n"


def write(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
    return path


CLEAN = "\n".join([HEADER, *rows()]) + "\n"

DEFECTS = {
    "empty": ("", ("empty", HEADER)),
    "blank": ("\n\n", ("empty", HEADER)),
    "comments only": ("# made by hand\n", ("without a header", HEADER)),
    "no rows": (HEADER + "\n", ("0 data rows", "at least 2")),
    "one row": (HEADER + "\n0.000,0,1,0\n", ("1 data rows", "at least 2")),
    "no header": ("\n".join(rows()) + "\n", ("line 1", "numbers", HEADER)),
    "missing column": (CLEAN.replace(",az_g", ""), ("'az_g'", "missing", "line 1")),
    "extra column": (changed(1, HEADER + ",temp_c"), ("'temp_c'", "line 1", "remove")),
    "misspelt column": (changed(1, "t_s,ax_g,ay,az_g"), ("'ay'", "misspelt", "'ay_g'")),
    "capitals": (changed(1, "t_s,AX_g,ay_g,az_g"), ("'AX_g'", "misspelt", "'ax_g'")),
    "space in header": (changed(1, "t_s, ax_g,ay_g,az_g"), ("' ax_g'", "misspelt", "'ax_g'")),
    "swapped columns": (changed(1, "t_s,ay_g,ax_g,az_g"), ("out of order", HEADER)),
    "repeated column": (changed(1, HEADER + ",az_g"), ("repeated", HEADER)),
    "truncated last line": (changed(7, "0.005,0.1"), ("line 7", "2 of 4 fields", "truncated", "ay_g")),
    "short line inside": (changed(4, "0.002,0.1,1.0"), ("line 4", "3 of 4 fields", "incomplete", "az_g")),
    "short and long line": (
        changed(4, "0.002,0.1,1.0").replace("0.003,", "0.003,0.1,"), ("line 4", "3 of 4 fields", "incomplete"),
    ),
    "long line": (changed(4, "0.002,0.1,1.0,0.0,7"), ("line 4", "5 fields")),
    "empty line": (changed(4, ""), ("line 4", "empty", "t_s")),
    "empty field": (changed(4, "0.002,,1.0,0.0"), ("ax_g", "line 4", "empty")),
    "text": (changed(5, "0.003,0.1,abc,0.0"), ("ay_g", "line 5", "'abc'", "not a number")),
    "two points": (changed(5, "0.003,0.1.2,1.0,0.0"), ("ax_g", "line 5", "'0.1.2'")),
    "exponent without digits": (changed(5, "0.003,1e,1.0,0.0"), ("ax_g", "line 5", "'1e'")),
    "hexadecimal": (changed(5, "0.003,0x1,1.0,0.0"), ("ax_g", "line 5", "'0x1'")),
    "quoted": (changed(5, '0.003,"0.1",1.0,0.0'), ("ax_g", "line 5", "not a number")),
    "zero byte": (changed(5, "0.003,0.1\x00,1.0,0.0"), ("ax_g", "line 5", "not a number")),
    "comment behind a row": (changed(5, "0.003,0.1,1.0,0.0 # shock"), ("az_g", "line 5", "not a number")),
    "not available": (changed(5, "0.003,0.1,NA,0.0"), ("ay_g", "line 5", "'NA'")),
    "nan": (changed(5, "0.003,0.1,1.0,NaN"), ("az_g", "line 5", "'NaN'", "finite")),
    "inf": (changed(5, "0.003,-inf,1.0,0.0"), ("ax_g", "line 5", "'-inf'", "finite")),
    "overflow": (changed(5, "0.003,1e999,1.0,0.0"), ("ax_g", "line 5", "'1e999'", "too large")),
    "semicolons": (CLEAN.replace(",", ";"), ("semicolons", "line 1", HEADER)),
    "semicolons, decimal commas": (
        CLEAN.replace(",", ";").replace(".", ","), ("semicolons and decimal commas", "decimal points"),
    ),
    "tabs": (CLEAN.replace(",", "\t"), ("tabs", "line 1", HEADER)),
    "semicolons below a good header": (
        changed(2, "0.000;0.1;1.0;0.0"), ("semicolons", "line 2", HEADER),
    ),
    "decimal commas": (
        HEADER + "\n" + "".join(r.replace(".", ",") + "\n" for r in rows()), ("line 2", "8 fields", "decimal commas"),
    ),
    "gap": (HEADER + "\n" + "\n".join(rows()[:3] + rows()[4:]) + "\n", ("t_s", "line 5", "gap", "0.002", "0.004")),
    "step too short": (changed(5, "0.0023,0.1,1.0,0.0"), ("t_s", "line 5", "too short", "0.0023")),
    "wrong rate": ("\n".join([HEADER, *rows(step=0.002)]) + "\n", ("t_s", "runs at 500 Hz", "1000 Hz", "rate_hz=500")),
    "drifting rate": (
        HEADER + "\n" + "".join(f"{0.001 * k + 0.0004 * (k // 3):.4f},0,1,0\n" for k in range(30)),
        ("t_s", "1000 Hz is required", "Hz"),
    ),
    "time stands": (changed(5, "0.002,0.1,1.0,0.0"), ("t_s", "line 5", "increase", "0.002")),
    "time falls": (changed(5, "0.001,0.1,1.0,0.0"), ("t_s", "line 5", "increase", "0.001")),
    "beyond the range": (changed(5, "0.003,0.1,-20.5,0.0"), ("ay_g", "line 5", "-20.5", "20 g")),
    "just beyond the range": (changed(5, "0.003,0.1,1.0,20.0021"), ("az_g", "line 5", "20.0021", "20 g")),
    "latin-1": (b"# B\xfcro\n" + CLEAN.encode(), ("0xfc", "line 1", "UTF-8")),
    "utf-16": (CLEAN.encode("utf-16"), ("0xff", "line 1", "UTF-8")),
    "late bad byte": (CLEAN.encode() + b"\x80", ("0x80", "line 8", "UTF-8")),
}


def refused(path, words, **options):
    with pytest.raises(InputError) as caught:
        read_sensor_csv(path, **options)
    text = str(caught.value)
    assert text.startswith(str(path))
    assert text.endswith(".") and ". " not in text and "\n" not in text
    for word in words:
        assert word in text
    return text


@pytest.mark.parametrize("name", DEFECTS)
def test_defect_is_refused_in_one_sentence(name, tmp_path):
    content, words = DEFECTS[name]
    refused(write(tmp_path / "record.csv", content), words)


@pytest.mark.parametrize("name", ["text", "nan", "gap", "beyond the range", "truncated last line"])
def test_line_numbers_count_comments_and_survive_foreign_newlines(name, tmp_path):
    content, words = DEFECTS[name]
    number = next(word for word in words if word.startswith("line"))
    below = f"line {int(number.split()[1]) + 2}"
    words = [below if word == number else word for word in words]
    content = "# made by hand\n# for a test\n" + content
    refused(write(tmp_path / "unix.csv", content), words)
    refused(write(tmp_path / "windows.csv", content.replace("\n", "\r\n")), words)


def test_missing_file_and_folder_are_refused(tmp_path):
    refused(tmp_path / "absent.csv", ["does not exist"])
    refused(tmp_path, ["folder"])


@pytest.mark.parametrize("options", [{"rate_hz": 0.0}, {"rate_hz": np.nan}, {"range_g": -1.0}])
def test_senseless_options_are_refused(options, tmp_path):
    refused(write(tmp_path / "record.csv", CLEAN), list(options), **options)


@pytest.mark.parametrize(
    "content",
    [
        CLEAN,
        CLEAN.rstrip("\n"),
        CLEAN + "\n\n",
        CLEAN.replace("\n", "\r\n"),
        CLEAN.replace("\n", "\r"),
        "# one\n# two, with commas; and more\n" + CLEAN,
        b"\xef\xbb\xbf" + CLEAN.encode(),
        CLEAN.replace("\n0.003,", "\n 0.003, "),
        CLEAN.replace("0.1000", "1e-1").replace("-0.2000", "-.2"),
    ],
)
def test_harmless_variants_are_read(content, tmp_path):
    record = read_sensor_csv(write(tmp_path / "record.csv", content))
    np.testing.assert_array_equal(record.t_s, [0.0, 0.001, 0.002, 0.003, 0.004, 0.005])
    np.testing.assert_array_equal(record.ax_g, [0.1] * 6)
    np.testing.assert_array_equal(record.ay_g, [1.0, 1.01, 1.02, 1.03, 1.04, 1.05])
    np.testing.assert_array_equal(record.az_g, [-0.2] * 6)
    assert (record.rate_hz, record.clipped) == (1000.0, 0)
    assert record.path == tmp_path / "record.csv"


def test_clipped_rows_are_counted_and_kept(tmp_path):
    lines = CLEAN.replace("0.001,0.1000", "0.001,20.0000").replace("0.004,0.1000,1.0400", "0.004,-20.0,20.0")
    record = read_sensor_csv(write(tmp_path / "record.csv", lines))
    assert record.clipped == 2
    assert record.ax_g[1] == 20.0
    assert read_sensor_csv(tmp_path / "record.csv", range_g=50.0).clipped == 0


def test_round_trip_is_exact_and_deterministic(tmp_path):
    rng = np.random.default_rng(11)
    t = np.arange(5000) / 1000.0
    axes = np.round(rng.uniform(-20.0, 20.0, (3, t.size)), 4)
    comments = ["synthetic", "two\nlines", ""]
    first, second = tmp_path / "a.csv", tmp_path / "b.csv"
    write_sensor_csv(first, t, *axes, comments=comments)
    write_sensor_csv(second, t, *axes, comments=comments)
    assert first.read_bytes() == second.read_bytes()
    lines = first.read_bytes().decode().split("\n")
    first_row = ",".join(["0.000", *(f"{a:.4f}" for a in axes[:, 0])])
    assert lines[:6] == ["# synthetic", "# two", "# lines", "#", HEADER, first_row]
    assert lines[-1] == "" and "\r" not in "".join(lines)

    record = read_sensor_csv(first)
    np.testing.assert_array_equal(record.t_s, t)
    np.testing.assert_array_equal([record.ax_g, record.ay_g, record.az_g], axes)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.csv", "b.csv"]


@pytest.mark.parametrize(("rate", "decimals"), [(1000.0, 3), (100.0, 3), (10_000.0, 4), (1024.0, 9), (990.0, 9)])
def test_time_has_as_many_digits_as_the_rate_needs(rate, decimals, tmp_path):
    t = np.arange(3000) / rate
    path = tmp_path / "record.csv"
    write_sensor_csv(path, t, 0 * t, 0 * t + 1, 0 * t)
    assert len(path.read_text().splitlines()[2].split(",")[0].split(".")[1]) == decimals
    record = read_sensor_csv(path, rate_hz=rate)
    np.testing.assert_allclose(record.t_s, t, atol=1e-9)
    if rate != 1000.0:
        refused(path, ["t_s", f"{rate:g} Hz", "1000 Hz"])


@pytest.mark.parametrize(
    ("columns", "word"),
    [
        (([0.0, 0.001], [0.0], [1.0, 1.0], [0.0, 0.0]), "ax_g"),
        (([0.0], [0.0], [1.0], [0.0]), "t_s"),
        (([0.0, 0.001], [0.0, 0.0], [1.0, np.nan], [0.0, 0.0]), "ay_g is nan in sample 1"),
        (([0.0, 0.0], [0.0, 0.0], [1.0, 1.0], [0.0, 0.0]), "t_s does not increase in sample 1"),
    ],
)
def test_unusable_arrays_are_not_written(columns, word, tmp_path):
    with pytest.raises(InputError, match=word):
        write_sensor_csv(tmp_path / "record.csv", *columns)
    assert list(tmp_path.iterdir()) == []


def test_failed_write_keeps_the_old_file_and_leaves_no_other(tmp_path, monkeypatch):
    path = write(tmp_path / "record.csv", CLEAN)

    def full_disk(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full_disk)
    with pytest.raises(InputError, match="No space left"):
        write_sensor_csv(path, [0.0, 0.001], [0, 0], [1, 1], [0, 0])
    assert path.read_text() == CLEAN
    assert [p.name for p in tmp_path.iterdir()] == ["record.csv"]


def test_missing_folder_is_refused_on_writing(tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        write_sensor_csv(tmp_path / "absent" / "record.csv", [0.0, 0.001], [0, 0], [1, 1], [0, 0])


def test_record_of_90_s_is_read_in_well_under_a_second(tmp_path):
    t = np.arange(90_000) / 1000.0
    path = tmp_path / "record.csv"
    write_sensor_csv(path, t, np.sin(t), np.cos(t), 0 * t)
    start = time.perf_counter()
    record = read_sensor_csv(path)
    assert time.perf_counter() - start < 1.0
    assert len(record.t_s) == 90_000

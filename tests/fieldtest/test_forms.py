"""One signal in the forms of many loggers: each is read as what it is, from a file and as a DataFrame, or refused."""

import io

import numpy as np
import pandas as pd
import pytest

from fieldtest.sensor_csv import read_sensor
from fieldtest.sensor_mapping import load_mapping
from trackdyn.commands.options import as_options
from trackdyn.inputs.errors import InputError

T = np.arange(400) / 125
AY = np.round(np.sin(7 * T) + 0.2 * np.cos(150 * T), 4)


def table(header, row):
    return header + "\n" + "".join(row(k, T[k], AY[k]) + "\n" for k in range(T.size))


def clock(t, hours=True):
    minutes, seconds = divmod(t, 60)
    return (
        f"{int(minutes) // 60:02d}:{int(minutes) % 60:02d}:{seconds:06.3f}"
        if hours
        else f"{int(minutes) % 60:02d}:{seconds:06.3f}"
    )


# packets of ten rows, of two sensors in turn
PACKETS = "t_s,ay_g,box\n" + "".join(
    f"{T[first + k]:.3f},{ay[first + k]},{box}\n"
    for first in range(0, T.size, 10)
    for box, ay in (("a", AY), ("b", np.roll(AY, 177)))
    for k in range(10)
)
FORMS = {
    "plain": (table("t_s,ay_g", lambda k, t, a: f"{t:.3f},{a}"), {}),
    "afternoon": (
        table("time,ay_g", lambda k, t, a: f"05/13/2024 0{1 + (t > 1)}:{clock(t, False)} PM,{a}").replace(
            " 02:", " 01:"
        ),
        {},
    ),
    "past the hour": (table("time,ay_g", lambda k, t, a: f"{clock(3598.5 + t, False)},{a}"), {}),
    "blank lines": (table("t_s,ay_g", lambda k, t, a: f"{t:.3f},{a}\n"), {}),
    "units in cells": (table("t_s,ay", lambda k, t, a: f"{t:.3f},{a} g"), {}),
    "units with raised signs": (table("t_s,ay", lambda k, t, a: f"{t:.3f},{9.81 * a:.5f} m/s\N{SUPERSCRIPT TWO}"), {}),
    "commas and a point": (table("t_ms;ay_mg", lambda k, t, a: f"{8 * k:,.1f};{1000 * a:,.2f}"), {}),
    "points and a comma": (
        table("t_ms;ay_mg", lambda k, t, a: f"{8 * k:,.1f};{1000 * a:,.2f}".translate(str.maketrans(",.", ".,"))),
        {},
    ),
    "apostrophes": (table("t_ms;ay_mg", lambda k, t, a: f"{8 * k};{1000 * a:,.1f}".replace(",", "'")), {}),
    "blanks in thousands": (
        table("t_ms;ay", lambda k, t, a: f"{8 * k};{1000 * a:,.1f} mg".replace(",", "\N{NO-BREAK SPACE}")),
        {},
    ),
    "stamps in brackets": (table("time;ay_g", lambda k, t, a: f"[10:00:{t:06.3f}];{a}"), {}),
    "quoted lines": (table('"t_s,ay_g"', lambda k, t, a: f'"{t:.3f},{a}"'), {}),
    "secs and nsecs": (table("secs,nsecs,ay_g", lambda k, t, a: f"{int(17 + t)},{round(t % 1 * 1e9)},{a}"), {}),
    "a row of another sensor": (table("t_s,ay_g,temp", lambda k, t, a: f"{t:.3f},{a},\n{t + 0.004:.3f},,20"), {}),
    "one of two sensors": (
        table("t_s,kind,ay_g", lambda k, t, a: f"{t:.3f},ACC,{a}\n{t:.3f},GYR,{9 * a:.4f}"),
        {"group": "ACC"},
    ),
    "counts without a sign": (table("t_s,ay", lambda k, t, a: f"{t:.3f},{round(8192 * a) % 65536}"), {"scale": 8192}),
}


@pytest.mark.parametrize("form", FORMS)
def test_a_form_holds_the_signal(form, tmp_path):
    text, options = FORMS[form]
    (tmp_path / "record.csv").write_text(text)
    record = read_sensor(tmp_path / "record.csv", load_mapping(**options))
    np.testing.assert_allclose(record.ay, AY, atol=7e-5)  # half a count
    assert record.rate == pytest.approx(125, rel=1e-4) and not record.doubts


@pytest.mark.parametrize("form", ["plain", "one of two sensors", "counts without a sign"])
def test_a_dataframe_is_read_as_its_file(form):
    text, options = FORMS[form]
    frame = pd.read_csv(io.StringIO(text))
    for same in (frame, frame.set_index("t_s"), frame.assign(t_s=pd.to_timedelta(frame.t_s, "s"))):
        record = read_sensor(same, load_mapping(**options))
        np.testing.assert_allclose(record.ay, AY, atol=7e-5)
        assert record.rate == pytest.approx(125, rel=1e-4)


def test_a_message_among_the_rows_is_a_gap(tmp_path):
    lines = FORMS["plain"][0].splitlines()
    (tmp_path / "record.csv").write_text("\n".join([*lines[:301], "FIFO overflow!", *lines[301:]]))
    with pytest.raises(InputError, match=r"line 302 .*`gaps: longest`"):
        read_sensor(tmp_path / "record.csv")
    record = read_sensor(tmp_path / "record.csv", load_mapping(gaps="longest"))
    np.testing.assert_allclose(record.ay, AY[:300])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (table("t_s,kind,ay_g", lambda k, t, a: f"{t:.3f},ACC,{a}\n{t:.3f},GYR,{a}"), "`group: ACC`"),
        (table("t_s,id,ay_g", lambda k, t, a: f"{t:.3f},1.0,{a}\n{t + 0.004:.3f},2.0,{-a}"), "`group: 1.0`"),
        (PACKETS, "`group: a`"),
        (table("t_ms,ay_g", lambda k, t, a: f"{8 * k},{a - 0.7:.4f}".replace(".", ",")), "decimal commas among commas"),
        (table("t_ms,ay_mg", lambda k, t, a: f"{8 * k},{1000 * a:.1f}".replace(".", ",")), "decimal commas among"),
        (
            table("t_s,ay", lambda k, t, a: f"{t:.3f},{a} g" if k % 9 else f"{t:.3f},{1000 * a:.1f} mg"),
            "number .* in mg",
        ),
        (table("t_s,ay_mg", lambda k, t, a: f"{t:.3f},{a} g"), "the unit 'mg and g'"),
        (table("", lambda k, t, a: f"t:{t:.3f},ay:{a}")[1:], "no column for ay among 't:0.000'"),
        (table("t_s,ay_g", lambda k, t, a: f"{T[-1] - t:.3f},{a}"), "sort the rows"),
        (table("t_s,ay_g", lambda k, t, a: f"{T[k ^ 1]:.3f},{AY[k ^ 1]}"), "sort the rows"),
        (
            table("t;ay_g", lambda k, t, a: f"{8 * k:,};{a}".replace(",", "*").replace(".", ",").replace("*", ".")),
            "thous",
        ),
        (table("t_s,channel", lambda k, t, a: f"{t:.3f},{a}"), "axes: {ay: NAME}`.*`unit: g`"),
    ],
)
def test_what_has_two_meanings_is_refused(text, words, tmp_path):
    (tmp_path / "record.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        read_sensor(tmp_path / "record.csv")


@pytest.mark.parametrize(
    ("still", "start", "words"),
    [
        (T < 1, 0, ("125 rows from line 2 to line 126", "`from: 1`")),
        ((T < 1) | (T > 2.9), 1, ("37 rows from line 365 to line 401", "`to: 2.896`")),
        ((T > 1.5) & (T < 2), 0, ("62 rows from line 190", "`from: 2` or `to: 1.496`")),
    ],
)
def test_rows_that_stand_still_are_named(still, start, words, tmp_path):
    rows = zip(T, np.where(still, 0.0, AY), strict=True)
    (tmp_path / "record.csv").write_text("t_s,ay_g,ax_g\n" + "".join(f"{t:.3f},{a},{t % 0.3:.3f}\n" for t, a in rows))
    (doubt,) = read_sensor(tmp_path / "record.csv", load_mapping(start=start)).doubts
    assert all(word in doubt for word in words), doubt


@pytest.mark.parametrize(
    ("fields", "options"),
    [
        ("`time: none, rate: HZ`", "--time none --rate HZ"),
        ("`axes: {ay: -NAME}`", "--axis ay=-NAME"),
        ("`axes: {ay: '#2'}`", "--axis 'ay=#2'"),
        ("`zero: {ay: 512, ax: 3}`", "--zero ay=512 --zero ax=3"),
        ("`resample: true`", "--resample"),
        ("`from: S`", "--from S"),
        ("`trackdyn simulate`", "`trackdyn simulate`"),
        ("`a: [`", "`a: [`"),
    ],
)
def test_fields_become_options(fields, options):
    assert as_options(f"give {fields}.") == f"give {options}."

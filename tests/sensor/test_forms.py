"""One signal in the forms of many loggers: each is read as what it is, from a file and as a DataFrame, or refused."""

import io

import numpy as np
import pandas as pd
import pytest

from trackdyn.commands.options import as_options
from trackdyn.inputs.errors import InputError
from trackdyn.sensor.sensor_csv import read_sensor
from trackdyn.sensor.sensor_mapping import load_mapping

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
        (table("t_ms,ay_g", lambda k, t, a: f"{8 * k},{a - 0.7:.4f}".replace(".", ",")), "decimal commas among commas"),
        (table("t_s,channel", lambda k, t, a: f"{t:.3f},{a}"), "axes: {ay: NAME}`.*`unit: g`"),
    ],
)
def test_what_has_two_meanings_is_refused(text, words, tmp_path):
    (tmp_path / "record.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        read_sensor(tmp_path / "record.csv")


def test_rows_that_stand_still_are_named(tmp_path):
    ay = np.where(T < 1, 0.0, AY)
    (tmp_path / "record.csv").write_text("t_s,ay_g\n" + "".join(f"{t:.3f},{a}\n" for t, a in zip(T, ay, strict=True)))
    (doubt,) = read_sensor(tmp_path / "record.csv").doubts
    assert "the 125 rows from line 2 to line 126 are all the same" in doubt and "`from: 1`" in doubt


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

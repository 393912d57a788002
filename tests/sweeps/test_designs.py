"""Designs: how they are read and refused."""

import sys

import numpy as np
import pandas as pd
import pytest

from trackdyn.errors import InputError
from trackdyn.sweeps.design import read_table, write_table
from trackdyn.sweeps.sweep import COLUMNS, check_columns, requested_rows, sweep


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty; a header"),
        ("motor_rpm,\n1,2\n", "a column without a name"),
        ("motor_rpm,motor_rpm\n1,2\n", "has the column 'motor_rpm' twice"),
        ("motor_rpm,ramp\n1,2\n3\n", "line 3 has 1 cells and the header 2"),
        ('motor_rpm\n"1\n', "is no CSV"),
        ("motor_rpm\n\xff\n".encode("latin-1"), "byte 0xff in line 2"),
    ],
)
def test_a_file_that_is_no_table_is_refused(tmp_path, text, said):
    path = tmp_path / "d.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InputError, match=said):
        read_table(path)


def test_a_damaged_parquet_file_is_refused(tmp_path):
    path = tmp_path / "d.parquet"
    write_table(pd.DataFrame({"motor_rpm": [1.0, 2.0]}), path)
    whole = path.read_bytes()
    for content in (b"", b"PAR1", whole[: len(whole) // 2], b"x" * len(whole)):
        path.write_bytes(content)
        with pytest.raises(InputError, match="not a Parquet file, or damaged"):
            read_table(path)
    with pytest.raises(InputError, match="no such file"):
        read_table(tmp_path / "no.parquet")
    with pytest.raises(InputError, match=r"end in \.csv or \.parquet"):
        read_table(tmp_path / "d.xlsx")


def test_columns_are_known_or_refused():
    assert {"motor_rpm", "every_link", "stop_rule.force", "preset", "name"} <= set(COLUMNS)
    of_rigs = ("sprocket.ring_radius", "gravity", "drive.kind", "road_1.bearing_drag", "road_1.arm.stiffness")
    check_columns(pd.DataFrame({name: [1] for name in ("motor_rpm", *of_rigs)}), "d.csv")
    for table, said in (
        ({"motor_rpm": [1], "speed": [2]}, "'speed' is not a column of a design"),
        ({"motor_rpm": [1], "sprocket.radius": [2]}, "'sprocket.radius' is not a column"),
        ({"motor_rpm": [1], "road_1.arm": [2]}, "'road_1.arm' is not a column"),
        ({"ramp": [1]}, "no column motor_rpm"),
        ({"motor_rpm": []}, "has no rows"),
    ):
        with pytest.raises(InputError, match=said):
            check_columns(pd.DataFrame(table), "d.csv")


def only(cells, rig_path):
    """The row that a design of these cells asks for."""
    return requested_rows(pd.DataFrame([cells]), str(rig_path))[0]


def test_cells_mean_what_they_say(rig_path):
    row = only(
        {
            "motor_rpm": "115",
            "ring_radius": "none",
            "pitches": "1 2",
            "contact_log": "False",
            "friction": "none",
            "ramp": "",
            "tension.wheel": "idler",
            "gravity": "9.8",
            "preset": "fast",
            "name": "a",
        },
        rig_path,
    )
    assert row.reason == ""
    assert row.scene == {
        "preset": "fast",
        "motor_rpm": 115.0,
        "ring_radius": None,
        "pitches": [1, 2],
        "contact_log": False,
        "friction": "none",
    }
    assert row.changes == {"tension__wheel": "idler", "gravity": 9.8}


@pytest.mark.parametrize("rpm", [0, "0", "0.0"])
def test_a_row_of_a_track_that_stands_is_refused(rig_path, rpm):
    assert only({"motor_rpm": rpm}, rig_path).reason.startswith("motor_rpm = 0: must be above 0")


def test_a_key_is_what_is_asked_and_not_how_it_is_said(rig_path, monkeypatch):
    one = only({"motor_rpm": 115, "duration": 2.0}, rig_path).key
    for same in (
        {"duration": "2", "motor_rpm": "115.0"},
        {"motor_rpm": "115", "duration": "2", "ramp": "", "name": "other"},
        {"motor_rpm": 115.0, "duration": 2, "ramp": 1.0, "friction": "auto"},
    ):
        assert only(same, rig_path).key == one
    for other in (
        {"motor_rpm": 116, "duration": 2},
        {"motor_rpm": 115, "duration": 2, "gravity": 9.0},
        {"motor_rpm": 115, "duration": 2, "every_link": "true"},
    ):
        assert only(other, rig_path).key != one
    monkeypatch.setattr("trackdyn.sweeps.sweep.module_hash", lambda module: "edited")
    assert only({"motor_rpm": 115, "duration": 2.0}, rig_path).key != one


@pytest.mark.parametrize(
    ("cells", "said"),
    [
        ({"motor_rpm": "115", "ring_radius": ""}, "ring_radius is empty"),
        ({"motor_rpm": 115, "ring_radius": np.nan}, "ring_radius is empty"),
        ({"motor_rpm": " "}, "motor_rpm is empty; a speed in rev/min is needed"),
        ({"motor_rpm": "115", "step": "abc 1e-4"}, "step = 'abc': must be a finite number"),
        ({"motor_rpm": "115", "step": "-1e-4; 1e-4"}, "step = -0.0001: must be between"),
        ({"motor_rpm": "115", "step": [1e-4, "1_0"]}, "step = '1_0': must be a finite number"),
        ({"motor_rpm": "115", "preset": "quick"}, "preset = 'quick':"),
        ({"motor_rpm": "115", "rig": "no.yaml"}, "no.yaml: no such file"),
        ({"motor_rpm": "115", "stop_rule.force": "-0.01"}, "stop_rule: force = -0.01"),
        (
            {"motor_rpm": "115", "stop_rule.share_pct": 1, "stop_rule.force": "x", "stop_rule.passages": 13},
            "stop_rule: force = 'x':",
        ),
    ],
)
def test_a_cell_that_says_nothing_is_the_rows_reason(cells, said, rig_path):
    assert said in only(cells, rig_path).reason


def test_a_table_that_cannot_be_written_is_refused_before_a_row_runs(tmp_path, rig_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    monkeypatch.setattr("trackdyn.sweeps.sweep.computed", None)
    with pytest.raises(InputError, match="pyarrow is not installed"):
        sweep(pd.DataFrame([{"motor_rpm": 115}]), tmp_path / "o.parquet", rig_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("text", ["1_15", "\u0661\u0661\u0665"])
def test_what_only_python_reads_as_a_number_is_none(rig_path, text):
    row = only({"motor_rpm": text, "pitches": text, "gravity": text}, rig_path)
    assert row.scene == {"motor_rpm": text, "pitches": text} and row.changes == {"gravity": text}

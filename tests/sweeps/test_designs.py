"""Designs: how they are read and refused."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.conftest import RIG, refused, written
from trackdyn.sweeps.sweep import DESIGN_COLUMNS, content_key, read_design, requested_rows


@pytest.mark.parametrize(("text", "message"), [
    ("", "is empty; a header"), ("motor_rpm,\n1,2\n", "a column without a name"), ('motor_rpm\n"1\n', "is not CSV"),
    ("motor_rpm,motor_rpm\n1,2\n", "has the column 'motor_rpm' twice"), ("motor_rpm\n", "has no rows"),
    ("motor_rpm,ramp\n1,2\n3\n", "line 3 has 1 cells and the header 2"), ("ramp\n1\n", "no column motor_rpm"),
    ("motor_rpm,speed\n1,2\n", "'speed' is not a column of a design"),
    ("motor_rpm,road_1.arm\n1,2\n", "'road_1.arm' is not a column"),
])  # fmt: skip
def test_a_file_that_is_no_design_is_refused(tmp_path, text, message):
    refused(read_design, written(tmp_path / "d.csv", text), words=[message])


def test_every_field_of_a_scene_and_of_a_rig_can_be_a_column():
    assert {"motor_rpm", "every_link", "stop_rule.force", "preset", "name"} <= set(DESIGN_COLUMNS)
    of_rigs = ("sprocket.ring_radius", "gravity", "profile.arcs", "road_1.bearing_drag", "road_1.arm.stiffness")
    read_design(pd.DataFrame({name: [1] for name in ("motor_rpm", *of_rigs)}))


def only(cells, rig=RIG):
    """The row that a design of these cells asks for."""
    return requested_rows(pd.DataFrame([cells]), str(rig))[0]


def test_cells_are_read_as_numbers_lists_and_names():
    """Of numbers that only Python reads as such, the text goes on, to be refused by its field."""
    cells = {
        "motor_rpm": "115", "ring_radius": "none", "pitches": "1 2", "contact_log": "False", "friction": "none",
        "ramp": "", "duration": "1_15", "lead_in": "\u0661", "tension.wheel": "idler", "gravity": "9.8",
        "preset": "fast", "name": "a", "step": "1e-4; 5e-5",
    }  # fmt: skip
    row = only(cells)
    assert row.reason == "" and row.task["scene"] == {
        "preset": "fast", "motor_rpm": 115.0, "ring_radius": None, "pitches": [1, 2], "contact_log": False,
        "friction": "none", "duration": "1_15", "lead_in": "\u0661", "step": [1e-4, 5e-5],
    }  # fmt: skip
    assert row.task["changes"] == {"tension__wheel": "idler", "gravity": 9.8}
    assert only({"motor_rpm": 115.0, "pitches": "3"}).task["scene"]["pitches"] == [3]


def test_a_key_depends_on_values_and_not_on_their_spelling(monkeypatch):
    one = only({"motor_rpm": 115, "duration": 2.0}).key
    for same in (
        {"duration": "2", "motor_rpm": "115.0"},
        {"motor_rpm": "115", "duration": "2", "ramp": "", "name": "other"},
        {"motor_rpm": 115.0, "duration": 2, "ramp": 1.0, "friction": "auto"},
    ):
        assert only(same).key == one
    for other in ({"motor_rpm": 116}, {"gravity": 9.0}, {"every_link": "true"}, {"stop_rule.force": 0.1}):
        assert only({"motor_rpm": 115, "duration": 2} | other).key != one
    monkeypatch.setattr("trackdyn.sweeps.sweep.module_hash", lambda module: "edited")
    assert only({"motor_rpm": 115, "duration": 2.0}).key != one


def test_a_default_and_the_same_value_stated_have_other_keys_where_a_rig_decides():
    """A row without a tensioner's setting has its rig's, and another key than one that locks it."""
    keys = {only({"motor_rpm": 115.0} | more, "parts").key for more in ({}, {"tension": "locked"}, {"step": 1e-4})}
    assert len(keys) == 3


@pytest.mark.parametrize(("column", "value", "message"), [
    ("ring_radius", "", "ring_radius is empty"), ("ring_radius", np.nan, "ring_radius is empty"),
    ("motor_rpm", " ", "motor_rpm is empty; a speed in rev/min is needed"), ("step", ";", "step has no number"),
    ("motor_rpm", "0.0", "motor_rpm = 0: must be above 0"), ("rig", "no.yaml", "no.yaml: no such file"),
    ("step", "abc 1e-4", "step = 'abc': must be a finite number"),
    ("step", [1e-4, -1e-4], "step = -0.0001: must be between"),
])  # fmt: skip
def test_a_cell_without_a_value_is_the_rows_reason(column, value, message):
    assert message in only({"motor_rpm": "115"} | {column: value}).reason


def test_the_content_of_a_design_is_also_that_of_its_rigs(tmp_path, monkeypatch):
    """Of the table, of the rig of its rows, of one that a row names, and of the file that this one is like."""
    monkeypatch.chdir(tmp_path)

    def key(base="", mine="like: base.yaml\n", rpm=1):
        texts = {"base.yaml": f"like: {RIG}\n{base}", "mine.yaml": mine, "d.csv": f"motor_rpm,rig\n{rpm},mine.yaml\n"}
        for name, text in texts.items():
            written(Path(name), text)
        return content_key("d.csv", "bench")

    heavier = key("chain: {source: assumed, link_mass: 12 kg}\n")
    assert len({key(), heavier, key(mine="like: bench\n"), key(mine="like: no_such_rig\n"), key(rpm=2)}) == 5
    assert key("# a comment\n") == key()

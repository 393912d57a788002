"""A command replaces the files that it wrote from the same inputs, each by itself, and no other."""

import os
import shutil
from pathlib import Path

import pandas as pd
import pytest

from tests.conftest import run_command, written
from trackdyn.commands.own_files import is_own, noting
from trackdyn.commands.studies import PICTURE_FILES
from trackdyn.inputs.errors import InputError
from trackdyn.inputs.files import write_text
from trackdyn.rig.rig_file import shipped_rigs

RING = ["ring", "a.yaml", "--rpm", "115,210", "--radii", "0.302,0.304", "--out", "f", "-q"]
SWEEP = ["sweep", "d.csv", "--out", "r.csv", "--rig", "a.yaml", "-q"]
CHECK = ["check", "a.yaml", "--no-settle", "--out", "a.svg"]
FILES = ["ring.csv", *PICTURE_FILES, "ring.html"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with two rigs and a design, a cache of its own, and studies that write their settings at once."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TRACKDYN_CACHE", str(tmp_path / "cache"))
    rig = shipped_rigs()["bench"].read_text(encoding="utf-8")
    for name in ("a.yaml", "b.yaml"):
        written(Path(name), f"{rig}# {name}\n")
    written(Path("d.csv"), "motor_rpm\n115\n")
    row = {"rpm": 115.0, "load_n": 0.0, "ring_radius_m": 0.302, "state": "done", "reason": "", "motor_power_w": 300.0}
    done = pd.DataFrame([row])

    def write_study(out, *_, rig_name, **__):
        for name in FILES:
            write_text(out / name, f"{name} of {rig_name}")

    def sweep(design, out, rig, *_, **__):
        write_text(out, f"{Path(design).read_text(encoding='utf-8')}{Path(rig).resolve()}")
        return done

    for name in (
        "measure.ring_rule.advice", "measure.ring_rule.compared", "commands.studies._comparison_rows",
        "commands.studies._notes", "commands.studies._check_meshing",
    ):  # fmt: skip
        monkeypatch.setattr(f"trackdyn.{name}", lambda *_: [])
    monkeypatch.setattr("trackdyn.sweeps.ring.ring_study", lambda *_: done)
    monkeypatch.setattr("trackdyn.commands.studies._write_study", write_study)
    monkeypatch.setattr("trackdyn.sweeps.sweep.sweep", sweep)
    return tmp_path


@pytest.mark.parametrize("name", FILES)
def test_no_file_of_a_ring_study_that_was_edited_is_replaced(folder, name):
    for _ in range(2):
        assert run_command(*RING).code == 0
    edited = written(Path("f", name), "notes of mine")
    before = {path: path.read_bytes() for path in Path("f").iterdir()}
    done = run_command(*RING)
    assert done.code == 1 and f"f/{name} exists; give another name, or --overwrite" in done.err
    assert before == {path: path.read_bytes() for path in Path("f").iterdir()}
    assert run_command(*RING, "--overwrite").code == 0 and edited.read_text(encoding="utf-8") != "notes of mine"


@pytest.mark.parametrize("written", range(len(FILES)))
def test_a_study_that_was_stopped_while_it_wrote_is_resumed(folder, monkeypatch, written):
    def stopped(out, *_, **__):
        for name in FILES[:written]:
            write_text(out / name, name)
        raise InputError("no space left")

    with monkeypatch.context() as patch:
        patch.setattr("trackdyn.commands.studies._write_study", stopped)
        assert "no space left" in run_command(*RING).err
    assert run_command(*RING).code == 0 and Path("f/ring.html").exists()


def test_a_file_belongs_to_its_command_also_where_it_is_killed_while_it_takes_its_name(folder, monkeypatch):
    write_text("f.csv", "first")
    with noting(["d.csv"], Path("f.csv")):
        write_text("f.csv", "second")
        assert is_own(Path("f.csv"), ["d.csv"])
        replace = os.replace
        killed = lambda old, new: pytest.fail("killed") if Path(new).name == "f.csv" else replace(old, new)  # noqa: E731
        monkeypatch.setattr(os, "replace", killed)
        with pytest.raises(pytest.fail.Exception):
            write_text("f.csv", "third")
    assert Path("f.csv").read_text(encoding="utf-8") == "second" and is_own(Path("f.csv"), ["d.csv"])
    assert not is_own(written(Path("f.csv"), "edited"), ["d.csv"])


# words of a command and others in their place, and whether its files may be replaced by those
OTHER_RINGS = [
    ("a.yaml", "b.yaml", False), ("115,210", "115", False), ("115,210", "115,211", False),
    ("0.302,0.304", "0.302", False), ("0.302,0.304", "0.302,0.305", False), ("-q", "--step=1e-4", False),
    ("115,210", "210,115.0", True), ("115,210", "115:210:2", True), ("115,210", "1.15e2,210,210", True),
    ("0.302,0.304", "0.304,0.3020", True), ("f", "./f/../f/", True), ("f", "{folder}/f", True), ("f", "link", True),
    ("a.yaml", "./a.yaml", True), ("a.yaml", "{folder}/a.yaml", True), ("a.yaml", "copy.yaml", True),
]  # fmt: skip
OTHER_SWEEPS = [
    ("a.yaml", "b.yaml", False), ("d.csv", "e.csv", False), ("a.yaml", "{folder}/a.yaml", True),
    ("d.csv", "{folder}/d.csv", True), ("r.csv", "../{folder.name}/r.csv", True), ("d.csv", "moved.csv", True),
]  # fmt: skip
OTHER_CHECKS = [("a.yaml", "b.yaml", False), ("a.yaml", "./a.yaml", True)]
OTHERS = (RING, "f/ring.csv", OTHER_RINGS), (SWEEP, "r.csv", OTHER_SWEEPS), (CHECK, "a.svg", OTHER_CHECKS)
ROWS = [(words, Path(name), *row) for words, name, rows in OTHERS for row in rows]


@pytest.mark.parametrize(("words", "results", "old", "new", "same"), ROWS)
def test_results_belong_to_their_command_however_it_is_spelled(folder, words, results, old, new, same):
    """A study of another rig, or with fewer radii, took the place of a study without a word."""
    assert run_command(*words).code == 0
    Path("link").symlink_to("f")
    written(Path("e.csv"), "motor_rpm\n210\n")
    for name, other in (("a.yaml", "copy.yaml"), ("d.csv", "moved.csv")):
        shutil.copy(name, other)
    before = results.read_bytes()
    done = run_command(*[new.format(folder=folder) if word == old else word for word in words])
    assert (done.code == 0) == same, done.err
    if not same:
        assert f"{results.name} exists; give another name, or --overwrite" in done.err
        assert results.read_bytes() == before


def test_default_radii_are_the_study_of_the_same_radii_and_of_the_rig_once_it_is_edited(folder):
    assert run_command(*RING[:4], *RING[6:]).code == 0
    with Path("a.yaml").open("a", encoding="utf-8") as rig:
        rig.write("# edited\n")
    assert run_command(*RING[:4], *RING[6:]).code == 0
    assert run_command(*RING).code == 1


def test_an_edited_design_replaces_its_own_results_and_nothing_is_replaced_without_a_note(folder):
    assert run_command(*SWEEP).code == 0
    written(Path("d.csv"), "motor_rpm\n210\n")
    assert run_command(*SWEEP).code == 0 and "210" in Path("r.csv").read_text(encoding="utf-8")
    for damage in ("", "[]", '{"contents": 1}', '{"contents": [], "inputs": null}', "\udcff"):
        for note in Path("cache/written").iterdir():
            note.write_bytes(damage.encode("utf-8", "surrogateescape"))
        assert "r.csv exists" in run_command(*SWEEP).err, damage
    shutil.rmtree("cache")
    assert "r.csv exists" in run_command(*SWEEP).err
    assert run_command(*SWEEP, "--overwrite").code == 0

"""A command that is refused ends with one line and code 1, and writes nothing."""

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import BELT, refused, run_command, written
from trackdyn import Scene, load_recording, load_rig, simulate
from trackdyn.rig.rig_file import shipped_rigs


@pytest.mark.parametrize("row", [
    ("", "Missing command"),
    ("nope", "No such command 'nope'"),
    ("simulate", "Missing argument"),
    ("simulate run.npz --rpm 1_15", "--rpm = '1_15': must be a finite number"),
    ("simulate run.npz --ring-radius big", "--ring-radius = 'big': must be a radius in m, such as 0.308, or none"),
    ("simulate run.npz --preset best", "preset = 'best'", "standard"),
    ("simulate run.npz --choose solver=multipliers", "--choose = 'solver=multipliers': expected", "integrator"),
    ("simulate run.npz --tolerance 1% --measure speed", "measure = 'speed': choose rms, sd"),
    ("simulate run.npz --tolerance 1% --longest 1e-3", "longest = 0.001: must be between"),
    ("simulate run.npz --measure rms", "--measure needs --tolerance"),
    ("simulate run.npz --setp 1e-4", "No such option: --setp", "--step", "see trackdyn simulate --help"),
    ("sweep d.parquet --out r.csv", "table = 'd.parquet': the name must end in .csv"),
    ("sweep plain --out r.parquet", "--out = 'r.parquet': the name must end in .csv"),
    ("simulate run.csv", "OUT = 'run.csv': the name must end in .npz"),
    ("simulate /proc/run.npz", "/proc/run.npz: cannot be written"),
    ("simulate folder.npz", "folder.npz: cannot be written (Is a directory)"),
    (f"simulate {'x' * 300}.npz", "cannot be written (File name too long)"),
    ("compare short.npz plain", "plain: no column for ay", "--axis ay=NAME"),
    ("compare short.npz short.npz", "short.npz: this is a recording, not a table in text; give the sensor's file"),
    ("show short.npz --out run.pdf", "the name must end in .html"),
    ("export short.npz run.txt", "OUT = 'run.txt': the name must end in .csv or .mat"),
    ("export short.npz run.csv --pitch 1", "pitch = 1: was not recorded; the recording has none; a belt has no"),
    ("export short.npz run.csv --sensor rear", "sensor = 'rear': the recording has 'sensor'"),
    ("export short.npz run.csv --contacts", "contacts: the recording has no log of them"),
    ("export short.npz run.mat --contacts --sensor sensor", "--sensor sensor: contacts are of pitches"),
    ("simulate run.npz --tolerance 2", "tolerance = '2': must be between 0 and 1"),
    ("simulate run.npz --tolerance 2% --rpm 0", "motor_rpm = 0: passages need a loop that turns"),
    ("ring bench --rpm 115,x", "--rpm = 'x': must be finite numbers"),
    ("ring bench --rpm 210 --radii 0.305:0.307", "--radii = '0.305:0.307': must be low:high:count"),
    ("ring bench --rpm 210 --radii 0.307:0.305:3", "must be low:high:count"),
    # of a variable of the shell that is not set
    *[(f"ring bench --rpm 210 --{name}=", f"--{name} = '': must be finite numbers") for name in ("radii", "step")],
    ("compare sensor.csv short.npz", "sensor.csv: not a trackdyn recording, or damaged; give the path of a whole one"),
], ids=lambda row: row[0][:60])  # fmt: skip
def test_a_command_ends_with_one_line_and_code_1(folder, row):
    line, *words = row
    written(Path("sensor.csv"), "time,ay\n0,1\n")
    before = sorted(folder.rglob("*"))
    done = run_command(*line.split())
    assert done.code == 1 and done.err.startswith("trackdyn: ") and len(done.err.splitlines()) == 1, done.err[:2000]
    assert all(word in done.err for word in words), done.err
    assert done.out == "" and sorted(folder.rglob("*")) == before


def test_a_command_replaces_what_it_wrote_itself_and_no_edited_file(folder, rig):
    sensor = "turn.npz mine.csv --unit g --time t_s"
    simulate(Scene(rig, 115.0, **BELT, duration=8.5)).save("turn.npz")
    written(Path("mine.csv"), "t_s,ay\n" + "".join(f"{k / 1000},{k % 7 / 10}\n" for k in range(8500)))
    commands = {
        "new mine.yaml": "mine.yaml", "export turn.npz t.csv": "t.csv", "show short.npz -q": "short.html",
        f"compare {sensor} --figure c.png": "c.png", f"compare {sensor} --out c.csv": "c.csv",
    }  # fmt: skip
    for line, name in commands.items():
        for _ in range(2):
            done = run_command(*line.split())
            assert done.code == 0, done.err
        (file := Path(name)).write_bytes(edited := file.read_bytes().replace(b"a", b"A").replace(b"trackdyn", b""))
        done = run_command(*line.split())
        assert done.code == 1 and f"{name} exists; give another name, or --overwrite" in done.err, line
        assert file.read_bytes() == edited


def test_a_folder_of_the_name_of_a_rig_is_no_rig(folder):
    for name in ("paper", "mine"):
        Path(name).mkdir()
    like = written(Path("like.yaml"), "like: paper\n")
    assert load_rig("paper") == load_rig(like) == load_rig(shipped_rigs()["paper"])
    assert run_command("rigs").code == run_command("check", "paper", "--no-settle").code == 0
    assert "mine: is a folder" in run_command("check", "mine").err


@pytest.mark.parametrize(("line", "name"), {
    "check paper": "paper.png", "check paper --out mine.svg": "mine.svg", "show short.npz": "short.html",
    "show short.npz --out mine.html": "mine.html", "export short.npz mine.csv": "mine.csv",
    "new mine.yaml": "mine.yaml", "sweep mine.csv --out other.csv": "other.csv",
    **{f"{line} --out {name} --overwrite": name
       for line in ("compare short.npz mine.csv", "sweep mine.csv") for name in ("mine.csv", "link.csv")},
}.items())  # fmt: skip
def test_no_command_replaces_a_file_unasked_nor_its_input(folder, line, name):
    Path("link.csv").symlink_to("mine.csv")
    for existing in {name, "mine.csv"}:
        written(Path(existing), "mine")
    done = run_command(*line.split())
    reason = "is an input of this" if "--overwrite" in line else "exists; give another name, or --overwrite to replace"
    assert done.code == 1 and f"trackdyn: {name} {reason}" in done.err
    assert Path(name).read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize("closed", ["", " >&-"])
@pytest.mark.parametrize(("line", "error"), [("rigs", ""), ("show \udcff.npz", "trackdyn: \\udcff.npz: no such file")])
def test_a_closed_output_a_name_of_no_letters_and_a_broken_plug_in(tmp_path, closed, line, error):
    """A plug-in that cannot be imported is named; its commands are missing, all others work."""
    (folder := tmp_path / "broken-1.dist-info").mkdir()
    written(folder / "METADATA", "Metadata-Version: 2.1\nName: broken\nVersion: 1\n")
    written(folder / "entry_points.txt", "[trackdyn.commands]\nbroken = broken_commands:COMMANDS\n")
    written(tmp_path / "broken_commands.py", "1 / 0\n")
    command, places = f"exec {sys.executable} -m trackdyn {line}{closed}", {"PYTHONPATH": str(tmp_path)}
    run = subprocess.run(["sh", "-c", command], env=os.environ | places, capture_output=True, text=True, timeout=100)
    assert run.returncode == bool(error) and bool(run.stdout) == ("paper" in run.stdout) == (not error and not closed)
    warning, *rest = run.stderr.splitlines()
    assert warning.startswith("trackdyn: warning: commands of broken_commands:COMMANDS cannot be loaded (ZeroDivision")
    assert "".join(rest).startswith(error) and len(rest) == bool(error), run.stderr


def test_a_full_disk_names_the_file_and_changes_none(folder, belt_file, monkeypatch):
    recording, old, before = load_recording(belt_file), Path("short.npz").read_bytes(), sorted(folder.rglob("*"))
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        refused(recording.save, "short.npz", words=["short.npz: cannot be written (File too large)", "free disk space"])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert Path("short.npz").read_bytes() == old and sorted(folder.rglob("*")) == before
    monkeypatch.setattr("trackdyn.inputs.files.disk_usage", lambda path: type("Usage", (), {"free": 1000}))
    assert run_command("simulate", "run.npz").code == 1
    assert sorted(folder.rglob("*")) == before

"""A command that is refused ends with one line and code 1, and writes nothing."""

import resource
import sys
from pathlib import Path

import pytest
from sentences import one_sentence

from trackdyn.commands import cli
from trackdyn.errors import InputError
from trackdyn.simulation.recording import load_recording

COMMANDS = [
    ("", "Missing command"),
    ("--nope", "No such option: --nope"),
    ("nope", "No such command 'nope'"),
    ("simulate", "Missing argument"),
    ("simulate run.npz more.npz", "unexpected extra argument"),
    ("simulate run.npz --rpm", "--rpm"),
    ("simulate run.npz --rpm fast", "--rpm = 'fast': must be a finite number"),
    ("simulate run.npz --rpm nan", "--rpm = 'nan':"),
    ("simulate run.npz --rpm 1e999", "--rpm = '1e999':"),
    ("simulate run.npz --duration 1e9", "between 0.001 and 36000 s"),
    ("simulate run.npz --lead-in 1e9", "lead_in = 1000000000.0"),
    ("simulate run.npz --step 1e-300", "step = 1e-300"),
    ("simulate run.npz --step x", "--step = 'x':"),
    ("simulate run.npz --frame-interval 1e308", "frame_interval = 1e+308"),
    ("simulate run.npz --ring-radius big", "--ring-radius = 'big': must be a radius in m, or none"),
    ("simulate run.npz --ring-radius inf", "--ring-radius = 'inf':"),
    ("simulate run.npz --preset best", "preset = 'best'", "standard"),
    ("simulate run.npz --choose chain", "--choose = 'chain': expected name=setting"),
    ("simulate run.npz --choose chain=rope", "chain = 'rope'", "double_pin"),
    ("simulate run.npz --step 1e6 -q", "step = 1000000.0"),
    ("simulate run.npz --choose solver=multipliers", "--choose = 'solver=multipliers': expected", "integrator"),
    ("simulate run.npz --choose chain=belt --rpm 1e300", "motor_rpm = 1e+300"),
    ("simulate run.npz --tolerance much", "--tolerance = 'much': must be"),
    ("simulate run.npz --tolerance 1% --measure speed", "--measure = 'speed': choose rms, sd"),
    ("simulate run.npz --tolerance 1% --longest 1e-3", "longest = 0.001 s:"),
    ("simulate run.npz --measure rms", "--measure needs --tolerance"),
    ("simulate run.npz --tolerance 1% --checkpoint kept", "--checkpoint cannot be combined with --tolerance"),
    ("simulate run.npz --speed 115", "No such option: --speed, --rpm may be meant; see trackdyn simulate --help"),
    ("simulate run.npz --setp 1e-4", "--step may be meant"),
    ("simulate run.csv", "OUT = 'run.csv': the name must end in .npz"),
    ("simulate /proc/run.npz", "/proc/run.npz: cannot be written"),
    ("simulate plain/run.npz", "plain/run.npz: cannot be written (Not a directory)"),
    ("simulate folder.npz", "folder.npz: cannot be written (Is a directory)"),
    (f"simulate {'x' * 300}.npz", "cannot be written (File name too long)"),
    ("simulate run.npz --checkpoint /proc/state", "/proc/state: cannot be written"),
    ("simulate run.npz --rig /dev/zero", "/dev/zero: is no plain file"),
    ("simulate run.npz --rig plain", "plain: must hold sections"),
    ("compare plain plain", "plain: not a trackdyn recording, or damaged"),
    ("compare absent.npz plain", "absent.npz: no such file"),
    ("compare short.npz plain", "plain: no column for ay", "--axis ay=NAME"),
    ("compare short.npz short.npz", "short.npz: this is a recording, not a sensor's file"),
    ("show .", ".: is a folder"),
    ("show /", "/: is a folder"),
    ("plan", "Missing option"),
    ("plan --tolerance 2", "tolerance = '2': must be between 0 and 1"),
    ("plan --tolerance much", "tolerance = 'much': must be between 0 and 1"),
    ("plan --tolerance 2% --measure speed", "measure = 'speed':"),
    ("plan --tolerance 2% --rpm nan", "--rpm = 'nan'"),
]


def run_command(monkeypatch, *arguments):
    """Exit code of the command, run within this process."""
    monkeypatch.setattr(sys, "argv", ["trackdyn", *arguments])
    try:
        cli.main()
    except SystemExit as end:
        return end.code
    return 0


@pytest.mark.parametrize("row", COMMANDS, ids=lambda row: row[0][:60])
def test_a_command_ends_with_one_line_and_code_1(folder, monkeypatch, capsys, row):
    line, *words = row
    before = sorted(folder.rglob("*"))
    assert run_command(monkeypatch, *line.split()) == 1
    out, err = capsys.readouterr()
    assert err.startswith("trackdyn: ") and len(err.splitlines()) == 1, err
    for word in words:
        assert word in err
    assert out == "" and sorted(folder.rglob("*")) == before


@pytest.mark.parametrize(
    ("line", "named", "reason"),
    [
        ("check paper", "paper.png", "exists; give another name, or --overwrite to replace it"),
        ("check paper --out mine.png", "mine.svg", "exists; give another name"),
        ("show short.npz", "short.html", "exists; give another name"),
        ("show short.npz --out mine.html", "mine.html", "exists; give another name"),
        ("fmu paper", "track.fmu", "exists; give another name"),
        ("crate . --out mine.zip", "mine.zip", "exists; give another name"),
        ("new mine.yaml", "mine.yaml", "exists; give another name"),
        ("compare short.npz mine.csv --out mine.csv --overwrite", "mine.csv", "is an input of this command"),
        ("compare short.npz mine.csv --out link.csv --overwrite", "link.csv", "is an input of this command"),
        ("simulate mine.npz --checkpoint mine.npz", "mine.npz", "is an input of this command"),
    ],
)
def test_no_command_replaces_a_file_unasked_nor_its_input(folder, monkeypatch, capsys, line, named, reason):
    Path("link.csv").symlink_to("mine.csv")
    for name in {named, "mine.csv"}:
        Path(name).write_text("mine", encoding="utf-8")
    assert run_command(monkeypatch, *line.split()) == 1
    assert f"trackdyn: {named} {reason}" in capsys.readouterr().err
    assert Path(named).read_text(encoding="utf-8") == "mine"


def test_an_interruption_is_one_line(folder, monkeypatch, capsys):
    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(sys.modules["trackdyn.simulation.simulate"], "simulate", stop)
    assert run_command(monkeypatch, "simulate", "run.npz", "-q") == 130
    assert capsys.readouterr().err.strip() == "trackdyn: interrupted; no file is left half-written"


def test_a_full_disk_names_the_file_and_leaves_what_was_there(folder, belt_file, monkeypatch):
    """Whether that is found before the run or while the file is written."""
    recording = load_recording(belt_file)
    old = Path("short.npz").read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = sorted(folder.rglob("*"))
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        with pytest.raises(InputError) as caught:
            recording.save("short.npz")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    one_sentence(caught, "short.npz: cannot be written (File too large)", "free disk space")
    assert Path("short.npz").read_bytes() == old and sorted(folder.rglob("*")) == before
    monkeypatch.setattr("trackdyn.files.disk_usage", lambda place: type("Usage", (), {"free": 1000}))
    assert run_command(monkeypatch, "simulate", "run.npz") == 1
    assert sorted(folder.rglob("*")) == before

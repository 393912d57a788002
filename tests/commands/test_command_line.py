"""The command line: its help, the libraries that commands load, and the numbers that options take."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
import typer.main
from typer.testing import CliRunner

from tests.conftest import ROOT
from trackdyn.commands import options
from trackdyn.commands.cli import app
from trackdyn.inputs.errors import InputError
from trackdyn.rig import rig_file
from trackdyn.scene import choices

ENTRY = "from trackdyn.__main__ import main; main()"
HEAVY = ("numba", "pandas", "matplotlib", "scipy")
COMMANDS = typer.main.get_command(app).commands


def run(*words, code=ENTRY, **environment):
    """The command in a process of its own, which knows no terminal."""
    return subprocess.run(
        [sys.executable, "-c", code, *words],
        env=os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "100"} | environment,
        capture_output=True,
        text=True,
    )


def loaded(code, *words):
    """Libraries that are loaded when the code has run, and its output."""
    done = run(*words, code=f"import sys; {code}; print(); print(*sys.modules)")
    assert done.returncode == 0, done.stderr
    *printed, modules = done.stdout.splitlines()
    return {name.partition(".")[0] for name in modules.split()}, "\n".join(printed)


@pytest.mark.parametrize("words", [("--help",), ("simulate", "--help"), ("rigs",), ("--version",)])
def test_help_and_lists_load_no_numerical_library(words):
    modules, printed = loaded(ENTRY, *words)
    assert not modules & {*HEAVY, "numpy"} and printed.strip()


BELT = "--choose chain=belt --ring-radius none --duration 12 --quiet"


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("new {0}/rig.yaml", 0),
        (f"simulate {{0}}/run.npz {BELT}", 0),
        ("simulate {0}/run.npz --rpm 1e9", 1),
        ("simulate {0}/run.npz --step 1e-2", 1),
        ("simulate {0}/run.txt", 1),
        ("simulate {0}/run.npz --rig nothing", 1),
        ("check nothing", 1),
        ("show {0}/nothing.npz", 1),
        ("sweep {0}/nothing.csv --out {0}/out.csv", 1),
        ("ring {0} --rpm x", 1),
        ("compare {0}/nothing.npz {0}/nothing.csv", 1),
    ],
)
def test_a_command_without_kernels_loads_no_compiler(tmp_path, line, code):
    words = line.format(tmp_path).split()
    ended = f"try: exec({ENTRY!r})\nexcept SystemExit as end: code = end.code or 0\nelse: code = 0"
    modules, _ = loaded(f"exec({ended!r}); assert code == {code}", *words)
    assert "numpy" in modules or code
    assert not modules & {"numba", "llvmlite"}


def test_the_package_is_imported_without_its_libraries():
    modules, _ = loaded("import trackdyn; assert {'Scene', 'ring_study'} < {*dir(trackdyn)} == {*trackdyn.__all__}")
    assert not modules & {*HEAVY, "numpy", "pydantic", "yaml"}
    modules, _ = loaded("from trackdyn import InputError")
    assert not modules & {*HEAVY, "numpy", "pydantic", "yaml"}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_help_has_types_in_words_and_an_example_that_the_command_takes(name):
    assert all(param.metavar or getattr(param, "is_flag", False) for param in COMMANDS[name].params)
    example = re.search(r"Example: `trackdyn ([^`]+)` (?=\w)", " ".join(COMMANDS[name].help.split()))
    words = example[1].split()
    assert words[0] == name
    COMMANDS[name].make_context(name, words[1:])  # reads the words, and runs nothing


def test_defaults_that_help_repeats_are_those_of_the_simulator():
    """A help is printed without them: importing them takes a second."""
    assert rig_file.DEFAULT == options.DEFAULT_RIG
    text = " ".join(CliRunner().invoke(app, ["simulate", "--help"]).output.split())
    assert f"{', '.join([*choices.PRESETS][:-1])} or {[*choices.PRESETS][-1]};" in text


NUMBERS = [
    (name, option)
    for name, command in COMMANDS.items()
    for param in command.params
    for option in param.opts
    if (param.metavar or "").startswith("NUMBER")
]


@pytest.mark.parametrize("text", ["nan", "inf", "fast", "1e999"])
@pytest.mark.parametrize(("name", "option"), NUMBERS)
def test_every_number_is_finite_and_named_by_its_option(name, option, text):
    result = CliRunner().invoke(app, [name, option, text])
    assert isinstance(result.exception, InputError), result.output
    assert str(result.exception).startswith(f"{option} = {text!r}: ")


def test_a_sweep_replaces_nothing_but_its_own_results(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    short = dict.fromkeys(("duration", "lead_in", "ramp"), 0.05)
    pd.DataFrame({"motor_rpm": [115, 210]}).assign(preset="fast", **short).to_csv("d.csv", index=False)
    asked = Path("d.csv").read_bytes()

    def swept(*words):
        return CliRunner().invoke(app, ["sweep", "d.csv", "-j1", "-q", *words])

    for words in (("--out", "d.csv"), ("--out", "d.csv", "--overwrite"), ("--out", "../" + tmp_path.name + "/d.csv")):
        assert isinstance(swept(*words).exception, InputError) and Path("d.csv").read_bytes() == asked
    Path("r.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    assert "r.csv exists; give another name, or --overwrite" in str(swept("--out", "r.csv").exception)
    assert Path("r.csv").read_text(encoding="utf-8") == "a,b\n1,2\n" and not Path("r.rows").exists()
    assert swept("--out", "r.csv", "--overwrite").exit_code == 0
    first = Path("r.csv").read_bytes()
    Path("d.csv").write_bytes(asked.replace(b"210", b"200"))  # another design, on one store: nothing is lost
    assert swept("--out", "r.csv").exit_code == 0 and Path("r.csv").read_bytes() != first
    Path("r.csv").write_bytes(first.replace(b"done", b"DONE"))
    assert "r.csv exists" in str(swept("--out", "r.csv").exception) and b"DONE" in Path("r.csv").read_bytes()

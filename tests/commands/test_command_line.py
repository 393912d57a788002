"""The command line as a whole: how commands are listed, what they load, and that they name things alike."""

import ast
import math
import os
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
import typer.main
from typer.testing import CliRunner

import trackdyn
from trackdyn.commands.cli import app
from trackdyn.errors import InputError
from trackdyn.measure.metrics import needed_lengths, run_metrics
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.rig_file import shipped_rigs, shipped_summaries
from trackdyn.scene.fidelity import preset
from trackdyn.simulation.simulate import simulate

ROOT = Path(__file__).parents[2]
ENTRY = "from trackdyn_command import main; main()"
ORDER = (
    "simulate", "compare", "show", "check", "new", "rigs", "plan", "sweep", "design", "wear", "identify", "fmu",
    "verify", "crate", "choose-ring", "benchmark",
)  # fmt: skip
HEAVY = ("numba", "pandas", "matplotlib", "scipy")
COMMANDS = typer.main.get_command(app).commands


def run(*words, code=ENTRY, **environment):
    """The command in a process of its own, which knows no terminal."""
    return subprocess.run(
        [sys.executable, "-c", code, *words],
        env=os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "100"} | environment,
        capture_output=True,
        text=True,
        timeout=120,
    )


def loaded(code, *words):
    """Libraries that are loaded when the code has run, and what it printed."""
    done = run(*words, code=f"import sys; {code}; print(); print(*sys.modules)")
    assert done.returncode == 0, done.stderr
    *said, modules = done.stdout.splitlines()
    return {name.partition(".")[0] for name in modules.split()}, "\n".join(said)


def test_help_lists_commands_in_the_order_of_use():
    text = run("--help").stdout
    places = [text.index(f"│ {name} ") for name in ORDER]
    assert places == sorted(places) and set(COMMANDS) == set(ORDER)
    assert run("-h").stdout == text
    assert run("plan", "-h").stdout == run("plan", "--help").stdout != text


@pytest.mark.parametrize("words", [("--help",), ("simulate", "--help"), ("rigs",), ("--version",)])
def test_what_only_prints_loads_no_library_that_computes(words):
    modules, said = loaded(ENTRY, *words)
    assert not modules & {*HEAVY, "numpy", "pydantic"} and said.strip()


def test_the_package_is_imported_without_its_libraries():
    modules, _ = loaded("import trackdyn; assert 'Scene' in dir(trackdyn)")
    assert not modules & {*HEAVY, "numpy", "pydantic", "yaml"}
    modules, _ = loaded("from trackdyn import InputError")
    assert not modules & {*HEAVY, "numpy", "pydantic", "yaml"}


def test_editors_see_the_names_that_the_package_hands_out():
    tree = ast.parse((ROOT / "trackdyn/__init__.py").read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))  # what type checkers see
    seen = {alias.name: node.module for node in block.body for alias in node.names}
    assert seen == {name: f"trackdyn.{module}" for name, module in trackdyn._MODULES.items()}
    assert sorted(seen) == trackdyn.__all__ and set(seen) <= set(dir(trackdyn))
    assert all(getattr(trackdyn, name) is getattr(sys.modules[module], name) for name, module in seen.items())
    with pytest.raises(AttributeError, match="'trackdyn' has no attribute 'simulation_of_all'"):
        _ = trackdyn.simulation_of_all


def test_the_version_is_printed():
    assert run("--version").stdout.strip() == f"trackdyn {trackdyn.__version__}"


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_shell_completes(shell):
    done = run("--show-completion", shell, _TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION="1")
    assert done.returncode == 0 and "_TRACKDYN_COMPLETE" in done.stdout, done.stderr
    words = {
        "COMP_WORDS": "trackdyn simulate --ring",
        "COMP_CWORD": "2",
        "_TYPER_COMPLETE_ARGS": "trackdyn simulate --ring",
    }
    found = run(_TRACKDYN_COMPLETE=f"complete_{shell}", _TYPER_COMPLETE_FISH_ACTION="get-args", **words)
    assert "--ring-radius" in found.stdout and "--rpm" not in found.stdout, found.stderr


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


def test_rigs_rings_and_speeds_are_the_same_in_every_command():
    asked = {(name, param.name): param for name, command in COMMANDS.items() for param in command.params}
    assert len([option for _, option in NUMBERS if option == "--ring-radius"]) == 5
    assert {name for name, option in NUMBERS if option == "--rpm"} == {
        name for name, param in asked if param == "rpm"
    } == {"simulate", "check", "plan", "identify", "fmu", "choose-ring", "wear"}  # fmt: skip
    rigs = [param for (_, name), param in asked.items() if name == "rig" and "--rig" in param.opts]
    assert len(rigs) == 3 and {param.default for param in rigs} == {"paper"}
    for _, param in asked.items():
        if "--out" in param.opts:
            assert param.metavar == "FILE" or isinstance(param.default, Path), param.name


def test_a_listed_rig_is_what_its_file_amounts_to():
    found = shipped_summaries()
    assert found.keys() == shipped_rigs().keys()
    for name, (counts, about) in found.items():
        rig = load_rig(name)
        kind = rig.chain.kind.replace("_", "-")
        assert counts == (
            f"{rig.chain.pitches} pitches ({kind}), {rig.sprocket.teeth} teeth, {1 + len(rig.rollers)} wheels"
        )
        assert about


def test_what_a_short_run_lacks_a_run_of_the_length_that_is_said_has(make_scene):
    """Wherever the sensor's pitch stands when the record begins."""
    fields = {"lead_in": 0.1, "frame_interval": 0.0, **preset("fast")}
    short = simulate(make_scene(250.0, duration=1.0, **fields))
    needed = needed_lengths(short)
    assert len(needed) == 2 and math.isnan(run_metrics("", short)["line_hz"])
    for what, name in (
        ("dominant peak and standard errors", "line_hz"),
        ("contacts of the recorded pitches", "ring_rms_n"),
    ):
        seconds = math.ceil(1000 * needed[what]) / 1000
        whole = simulate(make_scene(250.0, duration=seconds, **fields))
        assert what not in needed_lengths(whole) and not math.isnan(run_metrics("", whole)[name]), what


def test_only_what_the_scene_left_open_is_explained(tmp_path):
    words = [
        "simulate",
        str(tmp_path / "run.npz"),
        "--choose",
        "chain=belt",
        "--frame-interval",
        "0",
        "--duration",
        "1",
    ]
    said = CliRunner().invoke(app, words).output.splitlines()
    (asked,) = (line for line in said if "as the scene asks" in line)
    assert "chain belt" in asked and "friction" not in asked
    assert any(line.strip().startswith("friction  none: a kinematic path") for line in said)


def design(path, *words):
    return CliRunner().invoke(app, ["design", str(path), "--vary", "motor_rpm=115:210:2", "--method", "grid", *words])


def test_a_design_replaces_no_file_unasked(tmp_path):
    path = tmp_path / "d.csv"
    path.write_text("mine", encoding="utf-8")
    assert f"{path} exists; give another name, or --overwrite" in str(design(path).exception)
    assert path.read_text(encoding="utf-8") == "mine"
    assert design(path, "--overwrite").exit_code == 0 and len(pd.read_csv(path)) == 2


def test_a_sweep_replaces_nothing_but_its_own_results(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    short = [word for name in ("duration", "lead_in", "ramp") for word in ("--set", f"{name}=0.05")]
    assert design("d.csv", "--set", "preset=fast", *short).exit_code == 0
    asked = Path("d.csv").read_bytes()

    def swept(*words):
        return CliRunner().invoke(app, ["sweep", "d.csv", "-j1", "-q", *words])

    for words in (("--out", "d.csv"), ("--out", "d.csv", "--overwrite"), ("--out", "../" + tmp_path.name + "/d.csv")):
        assert isinstance(swept(*words).exception, InputError) and Path("d.csv").read_bytes() == asked
    Path("r.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    assert "r.csv exists and is no result of a sweep" in str(swept("--out", "r.csv").exception)
    assert Path("r.csv").read_text(encoding="utf-8") == "a,b\n1,2\n" and not Path("r.rows").exists()
    assert swept("--out", "r.csv", "--overwrite").exit_code == 0
    first = Path("r.csv").read_bytes()
    Path("r.csv").write_bytes(first.replace(b"done", b"DONE"))  # which its own store makes good
    assert swept("--out", "r.csv").exit_code == 0 and Path("r.csv").read_bytes() == first
    refusal = swept("--out", "r.csv", "--store", "elsewhere").exception
    assert "elsewhere does not hold 2 of its rows" in str(refusal) and not Path("elsewhere").exists()
    Path("d.csv").write_bytes(asked.replace(b"210", b"200"))  # another design, on one store: nothing is lost
    assert swept("--out", "r.csv").exit_code == 0 and Path("r.csv").read_bytes() != first

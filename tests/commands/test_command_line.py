"""The command line: its help, the libraries that commands load, and the numbers that options take."""

import re

import pytest
import typer.main

from tests.conftest import python, run_command
from trackdyn.commands import options
from trackdyn.commands.cli import app
from trackdyn.rig import rig_file
from trackdyn.scene import choices

ENTRY = "from trackdyn.__main__ import main; main()"
HEAVY = ("numba", "pandas", "matplotlib", "scipy")
LIBRARIES = {"pydantic", "yaml"}
COMMANDS = typer.main.get_command(app).commands


def loaded(code, *words):
    *printed, modules = python(f"import sys; {code}; print(); print(*sys.modules)", *words).out.splitlines()
    return {name.partition(".")[0] for name in modules.split()}, "\n".join(printed)


@pytest.mark.parametrize(("code", "line", "others"), [
    *((ENTRY, line, set()) for line in ("--help", "simulate --help", "rigs", "--version")),
    ("import trackdyn; assert {'Scene', 'ring_study'} < {*dir(trackdyn)} == {*trackdyn.__all__}", "", LIBRARIES),
    ("from trackdyn import InputError", "", LIBRARIES),
])  # fmt: skip
def test_help_lists_and_the_package_load_no_numerical_library(code, line, others):
    modules, printed = loaded(code, *line.split())
    assert not modules & {*HEAVY, "numpy", *others} and bool(printed.strip()) == bool(line)


@pytest.mark.parametrize(("begin", "after"), [
    ("pass", []), ("atexit.register(print, 'handled')", ["handled"]),
    ("end = threading.Event(); threading.Thread(target=lambda: end.wait() and print('joined')).start()",
     ["after", "joined"]),
])  # fmt: skip
def test_a_command_ends_its_process_unless_a_thread_is_waited_for(begin, after):
    code = f"import atexit, threading; from trackdyn.__main__ import command; {begin}; command(); print('after')"
    printed = python(f"{code}; end.set()", "--version").out.splitlines()
    assert printed[0].startswith("trackdyn ") and printed[1:] == after


@pytest.mark.parametrize(("line", "code"), [
    ("new rig.yaml", 0), ("simulate run.npz --choose chain=belt --ring-radius none --duration 12 --quiet", 0),
    ("simulate run.npz --rpm 1e9", 1), ("simulate run.npz --step 1e-2", 1), ("simulate run.txt", 1),
    ("simulate run.npz --rig nothing", 1), ("check nothing", 1),
    ("show nothing.npz", 1), ("sweep nothing.csv --out out.csv", 1), ("ring . --rpm x", 1),
    ("compare nothing.npz nothing.csv", 1),
])  # fmt: skip
def test_a_command_without_kernels_loads_no_compiler(tmp_path, monkeypatch, line, code):
    monkeypatch.chdir(tmp_path)
    ended = f"try: exec({ENTRY!r})\nexcept SystemExit as end: code = end.code or 0\nelse: code = 0"
    modules, _ = loaded(f"exec({ended!r}); assert code == {code}", *line.split())
    assert "numpy" in modules or code
    assert not modules & {"numba", "llvmlite"}


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
    *presets, last = choices.PRESETS
    assert f"{', '.join(presets)} or {last};" in " ".join(run_command("simulate", "--help").out.split())


@pytest.mark.parametrize("text", ["nan", "inf", "fast", "1e999"])
@pytest.mark.parametrize("name", COMMANDS)
def test_every_number_is_finite_and_named_by_its_option(name, text):
    for param in COMMANDS[name].params:
        for option in param.opts if (param.metavar or "").startswith("NUMBER") else ():
            ended = run_command(name, option, text)
            assert ended.code == 1 and ended.err.startswith(f"trackdyn: {option} = {text!r}: ")

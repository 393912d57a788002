"""A command that is stopped, or cannot write, leaves no half file and ends in one sentence."""

import os
import signal
import subprocess
import sys

import pytest

from tests.conftest import ROOT

ENTRY = "from trackdyn.__main__ import main; main()"
BELT = ("--choose", "chain=belt", "--duration", "30", "--quiet")


def start(folder, *arguments, prelude="", environment=os.environ):
    return subprocess.Popen(
        [sys.executable, "-c", f"{prelude}\n{ENTRY}", *map(str, arguments)], cwd=folder, text=True,
        env=environment | {"PYTHONPATH": str(ROOT)}, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
    )  # fmt: skip


def ended(process):
    try:
        _, err = process.communicate(timeout=240)
    finally:
        process.kill()
    return process.returncode, err


@pytest.mark.parametrize(("number", "word"), [(signal.SIGINT, "interrupted"), (signal.SIGTERM, "stopped")])
def test_the_first_compilation_is_reported_and_can_be_stopped(tmp_path, number, word):
    folder, empty = tmp_path / "out", os.environ | {"TRACKDYN_CACHE": str(tmp_path / "k")}
    process = start(tmp_path, "simulate", folder / "run.npz", environment=empty)
    report = next(line for line in process.stderr if "compiling" in line)
    assert report.endswith("trackdyn: compiling kernels, about 10 s; the next run finds them\n")
    process.send_signal(number)
    code, err = ended(process)
    assert (code, err.splitlines()[-1]) == (128 + number, f"trackdyn: {word}; no file is left half-written")
    assert "compiling" not in err and not folder.exists()


def test_a_short_command_ends_in_one_line(tmp_path):
    prelude = """
import os, signal, sys, threading, time
def strike():
    while "pandas" not in sys.modules:
        time.sleep(0.001)
    os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=strike, daemon=True).start()
"""
    code, err = ended(start(tmp_path, "compare", "run.npz", "sensor.csv", prelude=prelude))
    assert (code, err.lstrip()) == (130, "trackdyn: interrupted; no file is left half-written\n")


def test_a_file_is_replaced_after_a_warning_at_the_end(tmp_path):
    (tmp_path / "run.npz").write_bytes(b"mine")
    process = start(tmp_path, "simulate", "run.npz", "--duration", "3000", "-q")
    warning = "run.npz exists and is replaced when the run is done; until then Ctrl-C keeps it"
    assert process.stderr.readline() == f"trackdyn: warning: {warning}\n"
    process.send_signal(signal.SIGINT)
    assert ended(process)[0] == 130
    assert (tmp_path / "run.npz").read_bytes() == b"mine"
    assert ended(start(tmp_path, "simulate", "run.npz", *BELT))[0] == 0
    assert (tmp_path / "run.npz").read_bytes() != b"mine"


def test_names_with_accents_and_blanks_and_no_home(tmp_path):
    homes = "HOME", "TRACKDYN_CACHE", "XDG_CACHE_HOME"
    environment = {name: value for name, value in os.environ.items() if name not in homes}
    path = tmp_path / "un été à Zürich" / "línk 1.npz"
    assert ended(start(tmp_path, "simulate", path, *BELT, environment=environment)) == (0, "")
    assert path.stat().st_size > 10_000

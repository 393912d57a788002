"""`workflow/run.py`: a second run waits its turn, a killed one is gone on from, configurations are read first."""

import fcntl
import os
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "workflow"))
import run

from trackdyn.errors import InputError


@pytest.fixture
def started(tmp_path, monkeypatch):
    """A folder in the place of the project; what would be started in it, in order."""
    calls = []
    monkeypatch.setattr(run, "ROOT", tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TRACKDYN_RUN", "")
    monkeypatch.setattr(subprocess, "run", lambda command, **_: calls.append(command[3:]))
    monkeypatch.setattr(os, "set_inheritable", lambda lock, _: os.close(lock))  # as the end of the run would
    monkeypatch.setattr(os, "execv", lambda program, command: calls.append(command[3:]))
    return calls


def test_configurations_are_found_among_the_arguments():
    assert run.configurations(["-j2", "--configfile", "a.yaml", "b.yaml", "--", "x"]) == ["a.yaml", "b.yaml"]
    assert run.configurations(["--configfile=a.yaml", "x", "-n"]) == ["a.yaml"]
    assert run.configurations(["x", "-j", "2"]) == []


def test_a_killed_run_is_unlocked_and_another_one_is_not(started, tmp_path):
    run.main(["-j2"])
    assert started == [["-j2"]]
    locks = tmp_path / ".snakemake" / "locks"
    locks.mkdir()
    (locks / "0.input.lock").touch()
    with (tmp_path / ".snakemake" / "running").open() as held:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        with pytest.raises(SystemExit, match="another run is going on in this folder; wait for its end"):
            run.main(["-j2"])
    run.main(["-j2"])
    assert started[1:] == [["--unlock", "--quiet", "all"], ["-j2"]]


def test_a_configuration_that_would_be_run_is_refused_before_it_is(started, tmp_path):
    (tmp_path / "mine.yaml").write_text("__use_yte__: true\n", encoding="utf-8")
    with pytest.raises(InputError, match="__use_yte__ is not a known parameter"):
        run.main(["-j2", "--configfile", "mine.yaml"])
    assert started == []

"""`workflow/run.py`: a second run waits its turn, a killed one is gone on from, configurations are read first."""

import fcntl
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "workflow"))

import run
from trackdyn.errors import InputError
from trackdyn.sweeps import job


@pytest.fixture
def started(tmp_path, monkeypatch):
    """A folder in the place of the project; what would be started in it, in order."""
    calls = []
    monkeypatch.setattr(run, "ROOT", tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TRACKDYN_RUN", "")
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
        assert locks.exists()
    run.main(["-j2"])
    assert started[1:] == [["-j2"]] and not locks.exists()


HOLDER = """
import fcntl, os, sys, time
fcntl.flock(os.open(sys.argv[1], os.O_RDWR | os.O_CREAT), fcntl.LOCK_SH)
print("held", flush=True)
sys.stdin.read()
"""


def test_jobs_of_a_killed_run_are_waited_for(started, tmp_path, capsys):
    """They go on when only the driver was killed, and would write over what the next run makes."""
    (tmp_path / ".snakemake").mkdir()
    jobs = tmp_path / ".snakemake" / "jobs"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", HOLDER, jobs], text=True, **pipes) as job:
        assert job.stdout.readline() == "held\n"
        running = threading.Thread(target=run.main, args=(["-j2"],))
        running.start()
        running.join(0.5)
        assert running.is_alive() and started == []
        job.stdin.close()
        running.join(60)
    assert started == [["-j2"]]
    assert capsys.readouterr().err == "jobs of another run still go on; waiting for their end\n"


def test_a_job_that_begins_after_its_run_was_killed_ends_by_itself(started, tmp_path, monkeypatch):
    monkeypatch.setattr(job.fcntl, "flock", lambda *_: None)  # these jobs live as long as the test
    run.main(["-j2"])
    first = os.environ["TRACKDYN_RUN"]
    job._join()  # of this run
    run.main(["-j2"])
    assert first != os.environ["TRACKDYN_RUN"]
    monkeypatch.setenv("TRACKDYN_RUN", first)
    with pytest.raises(SystemExit, match="the run that began this job was killed, and another one goes on"):
        job._join()
    monkeypatch.delenv("TRACKDYN_RUN")
    job._join()  # of a plain snakemake


def test_a_configuration_that_would_be_run_is_refused_before_it_is(started, tmp_path):
    (tmp_path / "mine.yaml").write_text("__use_yte__: true\n", encoding="utf-8")
    with pytest.raises(InputError, match="__use_yte__ is not a known parameter"):
        run.main(["-j2", "--configfile", "mine.yaml"])
    assert started == []


STOPPED = "interrupted; nothing had begun\n"


@pytest.mark.parametrize(
    ("code", "module", "exit_code", "said"),
    [
        ("import runpy; runpy.run_path('workflow/run.py', run_name='__main__')", "trackdyn.errors", 1, STOPPED),
        ("import run; exec(run.SNAKEMAKE)", "snakemake.cli", 1, STOPPED),
        ("snakemake = 1; from trackdyn.sweeps.job import logged; import trackdyn.errors", "trackdyn.errors", 130, ""),
    ],
)
def test_an_interruption_of_imports_leaves_no_traceback(code, module, exit_code, said):
    """Ctrl-C while a run or one of its jobs still imports."""
    find = f"""
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # also where the tests run in the background
sys.path[:0] = ["workflow", "."]
class Struck:
    def find_spec(self, name, *_):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Struck())
"""
    done = subprocess.run(
        [sys.executable, "-c", find + code], cwd=Path(__file__).parents[2], capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (exit_code, said)

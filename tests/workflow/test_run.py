"""`workflow/run.py` and the locks of a folder: one Snakemake at a time, and one that was killed is gone on from."""

import os
import re
import subprocess
import sys
import time

import pytest

import run
from tests.conftest import ROOT, refused, run_python, written

PATH = {"PYTHONPATH": f"{ROOT}{os.pathsep}{ROOT / 'workflow'}"}


def test_configurations_are_found_among_the_arguments(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "p").mkdir()
    written(tmp_path / "p" / "config.yaml", "configfile: c.yaml\n")
    for arguments, files in (
        ("-j2 --configfile a.yaml b.yaml -- x", ["a.yaml", "b.yaml"]),
        ("x -np --configfile=a.yaml", ["a.yaml"]),
        ("x --profile p", ["c.yaml"]),
        ("x -j 2", []),
        ("x --no-such-option", []),  # as Snakemake will say
    ):
        assert [str(file) for file in run.configurations(arguments.split())] == files
    assert capsys.readouterr() == ("", "")


def test_a_configuration_that_would_be_run_is_refused_before_it_is(tmp_path, monkeypatch):
    mine = written(tmp_path / "mine.yaml", "__use_yte__: true\n")
    monkeypatch.setattr("snakemake.cli.main", lambda arguments: pytest.fail("was started"))
    refused(run.main, ["-j2", "--configfile", str(mine)], words=["__use_yte__ is not a known parameter"])


SNAKEFILE = """
import sys
from trackdyn.sweeps.snakemake_job import drive
drive(workflow)
rule one:
    output: "one.txt"
    log: "logs/one.log"
    script: "one.py"
"""
SCRIPT = """
from trackdyn.sweeps.snakemake_job import run_job
import os, time
def main(job):
    with open("begun.txt", "a") as begun:
        print(os.getpid(), file=begun)
    while not os.path.exists("go"):
        time.sleep(0.05)
    open(job.output[0], "w").write(str(os.getpid()))
run_job(main)
"""


@pytest.fixture
def folder(tmp_path):
    """A workflow of one job that waits for a file; its processes end with the test."""
    (tmp_path / "Snakefile").write_text(SNAKEFILE)
    (tmp_path / "one.py").write_text(SCRIPT)
    yield tmp_path
    (tmp_path / "go").touch()


def snakemake(folder, *arguments):
    """A plain Snakemake, in a session of its own."""
    command = [sys.executable, "-m", "snakemake", "-j1", "--rerun-incomplete", *arguments]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    return subprocess.Popen(command, cwd=folder, env=os.environ | PATH, start_new_session=True, **pipes)


def jobs(folder, count):
    """Processes of the jobs that have begun, once there are ``count``."""
    begun, end = folder / "begun.txt", time.monotonic() + 200
    while time.monotonic() < end:
        if begun.exists() and len(processes := begun.read_text().split()) >= count:
            return [int(job) for job in processes]
        time.sleep(0.05)
    raise AssertionError("no job began")


def test_a_second_run_is_refused_and_the_job_that_a_killed_one_left_is_waited_for(folder):
    """It goes on; the job of the next run waits for it, then replaces its result. A dry run leaves the locks."""
    first = snakemake(folder)
    jobs(folder, 1)
    locks = sorted((folder / ".snakemake" / "locks").iterdir())
    second = snakemake(folder)
    assert "LockException" in second.communicate()[0] and second.returncode == 1
    first.kill()
    first.wait()
    assert snakemake(folder, "-n").wait() == 0
    assert locks and sorted((folder / ".snakemake" / "locks").iterdir()) == locks
    third = snakemake(folder)
    for line in third.stdout:
        if "another process writes these results; waiting until it ends" in line:
            break
    assert len(jobs(folder, 1)) == 1
    (folder / "go").touch()
    assert third.wait() == 0
    assert int((folder / "one.txt").read_text()) == jobs(folder, 2)[1]


def run_script(folder, script, *options):
    """The job with another script, which need not wait, run by `run.main`."""
    (folder / "one.py").write_text(script)
    (folder / "go").touch()
    code = "import run, sys; run.ROOT = run.Path.cwd(); run.main(['-j1', *sys.argv[1:]])"
    return run_python("-c", code, *options, cwd=folder, **PATH)


KERNELS = """
from trackdyn.jit import kernel
@kernel
def once(x):
    return x
@kernel
def twice(x):
    return once(x) + once(x)
"""
COMPILES = KERNELS + SCRIPT.replace("    open(job", "    twice(1), twice(2), twice(1.0), open(job")
FAILS = SCRIPT.replace("open(job", "from trackdyn import InputError; raise InputError('no')\n    open(job")


@pytest.mark.parametrize(("script", "code"), [(SCRIPT, 0), (FAILS, 1)], ids=["done", "failed"])
def test_a_log_ends_with_the_time_of_its_job_and_a_run_with_those_that_took_most(folder, script, code):
    done = run_script(folder, script)
    assert done.code == code, done.err
    seconds = re.fullmatch(r"(\d+\.\d) CPU s", (folder / "logs/one.log").read_text().splitlines()[-1])[1]
    words = [line.split() for line in done.out.splitlines()]
    assert words[-2][:2] == ["1", "jobs"] and words[-1] == [seconds, "logs/one.log"]
    assert f"logs/one.log: {seconds} CPU s" in done.err and "the last time" not in done.err
    assert f"logs/one.log: {seconds} CPU s the last time" in run_script(folder, script, "--forceall").err


def test_kernels_that_a_job_compiles_are_in_its_log_and_at_the_end_of_a_run(folder):
    done = run_script(folder, COMPILES)
    assert done.code == 0, done.err
    lines = (folder / "logs/one.log").read_text().splitlines()[:-1]
    pattern = r"\d+\.\d CPU s to compile __main__\.twice, (\w+)"  # its part `once` is counted with it
    assert len({re.fullmatch(pattern, line)[1] for line in lines}) == len(lines) == 2  # arguments of two types
    assert "2 compilations, 2 of them different, took " in done.out


def test_a_job_whose_run_was_killed_does_not_begin():
    code = "from trackdyn.sweeps import snakemake_job; snakemake_job._join('logs/one.log')"
    gone = run_python("-c", "import os; print(os.getpid())").out.strip()
    for driver, end in ((gone, "the run that began this job was killed\n"), (os.getpid(), "")):
        assert run_python("-c", code, **PATH, TRACKDYN_DRIVER=driver) == (int(bool(end)), "", end)


STRUCK = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # also where the tests run in the background
sys.path[:0] = ["workflow", "."]
class Struck:
    def find_spec(self, name, *_):
        if name == "trackdyn.inputs.errors":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Struck())
"""


@pytest.mark.parametrize(("code", "exit_code", "message"), [
    ("import runpy; runpy.run_path('workflow/run.py', run_name='__main__')", 1,
     "interrupted; the same command goes on\n"),
    ("snakemake = 1; from trackdyn.sweeps.snakemake_job import run_job; import trackdyn.inputs.errors", 130, ""),
], ids=["a run", "a job"])  # fmt: skip
def test_an_interruption_of_imports_leaves_no_traceback(code, exit_code, message):
    """Ctrl-C while a run or one of its jobs still imports."""
    done = run_python("-c", STRUCK + code)
    assert (done.code, done.err) == (exit_code, message)

"""A pipeline that was killed goes on by the same command, and ends in the bytes of a run that nobody disturbed."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from tests.conftest import ROOT
from tests.workflow.test_workflow import copy_project

TINY = Path("tests", "workflow", "tiny.yaml")
TARGETS = tuple(f"results/{name}" for name in ("measured/ring.csv", "figures/fig24.png", "sensor/210rpm.csv"))


def copied(folder):
    """A copy of the project with results of its own."""
    (folder / TINY).parent.mkdir(parents=True)
    shutil.copy(ROOT / TINY, folder / TINY)
    return copy_project(folder)


def start(root):
    """The command of a user, in a session of its own."""
    command = [sys.executable, "workflow/run.py", "-j2", *TARGETS, "--configfile", str(TINY)]
    # jobs load one package: the cache of kernels has a folder for each
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}
    with (root / "log.txt").open("ab") as log:
        return subprocess.Popen(command, cwd=root, env=environment, stdout=log, stderr=log, start_new_session=True)


def written(root):
    """Recordings and tables, also those that are half written."""
    return {path for path in (root / "results").rglob("*") if path.suffix in (".npz", ".csv")}


def complete(root):
    """Run to the end; contents of every file that holds no times, by name."""
    process = start(root)
    try:
        assert process.wait(1800) == 0, (root / "log.txt").read_text(encoding="utf-8")[-3000:]
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
    results = root / "results"
    # a file that a killed job left half written has a dot in front
    files = (path.relative_to(results) for path in results.rglob("[!.]*") if path.is_file())
    return {name.as_posix(): (results / name).read_bytes() for name in files if name.parts[0] != "logs"}


def test_a_killed_run_goes_on_and_ends_in_the_same_bytes(tmp_path):
    expected = complete(copied(tmp_path / "whole"))
    assert {"measured/ring.csv", "figures/fig24.png", "figures/fig24.svg", "runs/ring/210rpm_0.308.npz"} <= {*expected}
    root = copied(tmp_path / "killed")

    def killed(after, kill=os.killpg, number=signal.SIGKILL):
        """The command, killed once ``after()`` is true."""
        process = start(root)
        while not after():
            assert process.poll() is None, (root / "log.txt").read_text(encoding="utf-8")[-3000:]
            time.sleep(0.02)
        kill(process.pid, number)
        process.wait(300)

    # everybody, as where memory runs out; the driver, whose jobs go on; everybody is asked to end, as by a batch system
    for how in ((os.killpg, signal.SIGKILL), (os.kill, signal.SIGKILL), (os.killpg, signal.SIGTERM)):
        killed(lambda before=written(root): written(root) != before, *how)
    results = complete(root)
    assert [name for name in expected.keys() | results.keys() if expected.get(name) != results.get(name)] == []
    # killed once more while a recording is made anew whose table and figure lie there already
    recording, tiny = root / "results/runs/ring/210rpm_0.308.npz", root / TINY
    config = tiny.read_text(encoding="utf-8")
    assert "without_ring: false, steps_s: [[0.308, 1.0e-4]]" in config
    tiny.write_text(config.replace("[[0.308, 1.0e-4]]", "[[0.308, 5.0e-5]]"), encoding="utf-8")
    killed(lambda: not recording.exists())
    tiny.write_text(config, encoding="utf-8")
    assert not recording.exists() and (root / TARGETS[1]).exists()
    assert complete(root) == expected

"""A pipeline that was killed at random moments goes on by the same command, and ends in the bytes of a run that nobody
disturbed.
"""

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil

ROOT = Path(__file__).parents[2]
TINY = Path("tests", "workflow", "tiny.yaml")
TARGETS = tuple(f"results/{name}" for name in ("measured/ring.csv", "figures/fig24.png", "sensor/210rpm.csv"))
LONGEST_RUN = 1800  # s, of a graph that nobody disturbs, on a busy machine
# who is killed: everybody, the driver (its jobs go on), or one of its processes, which is then a job that failed; or
# everybody is asked to end (SIGTERM), as a batch system does, and must
WHOM = ("all", "driver", "one", "asked")


class Copy:
    """A copy of the project with results of its own."""

    def __init__(self, folder):
        self.root, self.folder = folder, folder / "results"
        for name in ("config", "data", "profiles", "trackdyn", "workflow"):
            shutil.copytree(ROOT / name, self.root / name, ignore=shutil.ignore_patterns("__pycache__"))
        for name in ("Snakefile", TINY):
            (self.root / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, self.root / name)

    def start(self):
        """The command of a user, in a session of its own."""
        command = [sys.executable, "workflow/run.py", "-j2", *TARGETS, "--configfile", str(TINY)]
        # jobs load one package: the cache of kernels has a folder for each
        environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}
        with (self.root / "log.txt").open("ab") as log:
            return subprocess.Popen(
                command, cwd=self.root, env=environment, stdout=log, stderr=log, start_new_session=True
            )

    def require_end(self, process):
        """Refuse a run that failed."""
        assert process.returncode == 0, (self.root / "log.txt").read_text(encoding="utf-8")[-3000:]

    def complete(self):
        """Run to the end; contents of every file that holds no times, by name.

        A file that a killed job left half written has a dot in front.
        """
        process = self.start()
        try:
            process.wait(LONGEST_RUN)
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
        self.require_end(process)
        files = [path for path in self.folder.rglob("*") if path.is_file() and not path.name.startswith(".")]
        names = {path.relative_to(self.folder).as_posix(): path.read_bytes() for path in files}
        return {name: data for name, data in names.items() if not name.startswith("logs/")}


def kill(process, whom, chance):
    """Kill without a warning, as the system does when memory runs out."""
    if whom == "one" and (others := psutil.Process(process.pid).children(recursive=True)):
        chance.choice(others).kill()
        process.wait(300)
    elif whom == "asked":
        os.killpg(process.pid, signal.SIGTERM)
        process.wait(300)
    else:
        if whom == "all":
            os.killpg(process.pid, signal.SIGKILL)
        process.kill()
        process.wait()


def disturb(copy, longest, seed):
    """Start and kill everybody of `WHOM` once; begins anew after a run that ended before. Returns a line a round."""
    chance, done = random.Random(seed), []
    for whom in WHOM:
        process, moment = copy.start(), chance.uniform(0.1, longest)
        begin = time.monotonic()
        while process.poll() is None and time.monotonic() - begin < moment:
            time.sleep(0.02)
        done.append(f"{whom} after {moment:.1f} s")
        if process.poll() is None:
            kill(process, whom, chance)
        else:
            copy.require_end(process)
            shutil.rmtree(copy.folder)
    return done


def test_a_killed_run_goes_on_and_ends_in_the_same_bytes(tmp_path):
    expected = Copy(tmp_path / "whole").complete()
    assert {"measured/ring.csv", "figures/fig24.png", "figures/fig24.svg", "runs/ring/210rpm_0.308.npz"} <= {*expected}
    copy = Copy(tmp_path / "killed")
    done, results = disturb(copy, longest=8.0, seed=3), copy.complete()
    assert [name for name in expected.keys() | results.keys() if expected.get(name) != results.get(name)] == [], done

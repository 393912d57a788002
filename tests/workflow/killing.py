"""Kills the pipeline at random moments and lets the same command go on, until it has run through.

The results must be those of a run that nobody disturbed, byte for byte, times of computing apart.
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

from replication.certify import BYTES, EQUAL, compare_files, describe

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

    def complete(self):
        """Run to the end; returns the results."""
        process = self.start()
        try:
            code = process.wait(LONGEST_RUN)
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
        assert code == 0, (self.root / "log.txt").read_text(encoding="utf-8")[-3000:]
        return self.results()

    def results(self):
        """Contents of every file that holds no times, by name; what a killed job left half written has a dot
        in front.
        """
        folder = self.root / "results"
        files = [path for path in folder.rglob("*") if path.is_file() and not path.name.startswith(".")]
        names = {path.relative_to(folder).as_posix(): path for path in files}
        return {name: path.read_bytes() for name, path in sorted(names.items()) if not holds_times(name)}


def holds_times(name):
    """Whether equal runs may differ in a file."""
    return name.startswith(("benchmarks/", "logs/"))


def differences(copy, whole):
    """Differences of two copies' results, a line a file, as `trackdyn verify --exact` sees it: columns of times left
    out.

    Of a page that shows times its table decides.
    """
    findings = compare_files(copy.folder, describe(whole.folder))
    shown = {finding.name.replace(".csv", ".md") for finding in findings if finding.status == EQUAL}
    differ = [
        finding
        for finding in findings
        if finding.status != EQUAL and not (finding.status == BYTES and finding.name in shown)
    ]
    return [f"{finding.status}: {finding.name} {finding.text}" for finding in differ]


def kill(process, whom, chance):
    """Kill without a warning, as the system does when memory runs out."""
    if whom == "one":
        others = psutil.Process(process.pid).children(recursive=True)
        if others:
            chance.choice(others).kill()
            process.wait(300)
            return
    if whom == "asked":
        os.killpg(process.pid, signal.SIGTERM)
        process.wait(300)
        return
    if whom == "all":
        os.killpg(process.pid, signal.SIGKILL)
    process.kill()
    process.wait()


def disturb(copy, rounds, longest, seed):
    """Start and kill, a number of times; begins anew if it ran through in between. Returns what was done, a line a
    round.
    """
    chance, done = random.Random(seed), []
    for k in range(rounds):
        process, moment = copy.start(), chance.uniform(0.1, longest)
        whom = WHOM[k % len(WHOM)]
        begin = time.monotonic()
        while process.poll() is None and time.monotonic() - begin < moment:
            time.sleep(0.02)
        if process.poll() is None:
            kill(process, whom, chance)
            done.append(f"{whom} killed after {moment:.1f} s")
        else:
            assert process.returncode == 0, (copy.root / "log.txt").read_text(encoding="utf-8")[-3000:]
            done.append(f"had run through after {moment:.1f} s, begins anew")
            shutil.rmtree(copy.root / "results")
    return done

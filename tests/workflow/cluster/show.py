"""A sweep on a real SLURM of one node, against the same on this machine, and what faults do to it.

`python tests/workflow/cluster/show.py` takes some minutes on two cores. Everything lies in a folder of its own, which
is removed at the end unless something went wrong.
"""

import filecmp
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
from slurm import Slurm, missing, wait_until

ROOT = Path(__file__).parents[3]
ROWS = 24  # rows of the sweep: a batch of 12 takes seconds beyond those that a fault waits for
SCENE = {"preset": "fast", "ramp": 0.1, "lead_in": 0, "duration": 1}
# without one, or with smaller ones, so quick a start is too much for this step
RINGS = (0.308, 0.309, 0.31, 0.311, 0.312, 0.313)
PATIENCE = 1800.0  # s for any one command
# Polling every ten seconds is for one node; the profile's own is kinder to a cluster.
EAGER = ("--slurm-init-seconds-before-status-checks", "10")


class Show:
    """A folder, a SLURM beside it, and what came out."""

    def __init__(self, folder: Path, slurm: Slurm, cores: int):
        self.folder, self.slurm, self.cores, self.failed = folder, slurm, cores, 0

    def say(self, text: str, good: bool = True) -> None:
        """A line of the report; one that is not good fails the whole."""
        self.failed += not good
        print(f"{'' if good else 'FAILED: '}{text}", flush=True)

    def start(self, name: str, *command: str) -> subprocess.Popen:
        """A command of Python, its words in a file."""
        with (self.folder / f"{name}.log").open("ab") as log:
            return subprocess.Popen(
                [sys.executable, "-P", *command], cwd=self.folder,
                env=self.slurm.environment | {"PYTHONPATH": str(ROOT)}, stdout=log, stderr=log,
            )  # fmt: skip

    def run(self, name: str, *command: str) -> int:
        """Run a command of Python to its end; returns its exit code."""
        process = self.start(name, *command)
        try:
            return process.wait(PATIENCE)
        finally:
            process.kill()
            process.wait()

    def driver(self, name: str) -> tuple[str, ...]:
        """The plain command of a sweep on SLURM, a batch a core."""
        profile = ("--workflow-profile", f"{ROOT}/profiles/slurm", *EAGER)
        config = {"design": "design.parquet", "out": f"{name}/results.parquet", "batches": self.cores}
        words = [f"{key}={value}" for key, value in {"rig": f"{ROOT}/config/rigs/paper.yaml", **config}.items()]
        return ("-m", "snakemake", "-s", f"{ROOT}/workflow/sweep.smk", *profile, "--config", *words)

    def same(self, name: str) -> bool:
        """Whether a sweep on SLURM gave the bytes that this machine gives."""
        files = [self.folder / path / "results.parquet" for path in (name, "local")]
        return all(file.exists() for file in files) and filecmp.cmp(*files, shallow=False)

    def stored(self, name: str) -> int:
        """Rows that are computed so far."""
        return len(list((self.folder / name / "results.rows").glob("*.json")))

    def design(self) -> None:
        """A design of short scenes, and what this machine makes of it."""
        trackdyn = ("-c", "from trackdyn.__main__ import main; main()")
        file, began = "design.parquet", time.monotonic()
        speeds, rings = np.linspace(100, 210, ROWS), np.resize(RINGS, ROWS)
        pd.DataFrame({"motor_rpm": speeds, "ring_radius": rings}).assign(**SCENE).to_parquet(self.folder / file)
        out = self.folder / "local" / "results.parquet"
        how = ("--out", str(out), "-q", f"-j{self.cores}", "--rig", f"{ROOT}/config/rigs/paper.yaml")
        code = self.run("local", *trackdyn, "sweep", file, *how)
        states = pd.read_parquet(out).state.value_counts().to_dict() if out.exists() else {}
        good = code == 0 and sum(states.values()) == ROWS
        self.say(f"{ROWS} rows here in {time.monotonic() - began:.0f} s: {states}", good)

    def fault(self, strike: Callable[[str, subprocess.Popen], None], code: int = 0) -> None:
        """A driver that meets a fault, then the plain command again.

        Parameters
        ----------
        strike : function
            Called with the name of the sweep and its running driver; does the harm.
        code : int
            With which the first driver ends.
        """
        name = strike.__name__
        command, began = self.driver(name), time.monotonic()
        process = self.start(name, *command)
        try:
            strike(name, process)
            rows = self.stored(name)
            ended = process.wait(PATIENCE)
        except (RuntimeError, subprocess.TimeoutExpired) as error:
            self.say(f"{name}: {' '.join(str(error).split())[:300]}", False)
            return
        finally:
            process.kill()
            process.wait()
        self.say(f"{name}: {rows} rows kept; the driver ended with {ended}", ended == code)
        ended = self.run(name, *command)
        took = f"{time.monotonic() - began:.0f} s in all"
        self.say(f"{name}: the plain command again, byte for byte; {took}", ended == 0 and self.same(name))

    def batch(self, name: str) -> str:
        """A batch that is running and has rows; its id."""
        batches: list[str] = []

        def running() -> bool:
            batches[:] = [line.split()[0] for line in self.slurm.jobs("%i %k", "RUNNING") if "rule_batch" in line]
            return bool(batches) and self.stored(name) > 2

        wait_until(running, 600, "a batch that runs")
        return batches[0]

    # -- faults --------------------------------------------------------------------------------------------------------

    def scancel(self, name: str, process: subprocess.Popen) -> None:
        """A batch is cancelled."""
        self.slurm.out("scancel", self.batch(name))

    def driver_killed(self, name: str, process: subprocess.Popen) -> None:
        """The driver is killed; its jobs go on."""
        self.batch(name)
        process.kill()


def main() -> int:
    """Everything, and how many parts of it failed."""
    cores = len(os.sched_getaffinity(0))
    folder = Path(tempfile.mkdtemp(prefix="trackdyn-cluster-"))
    began, failed = time.monotonic(), 1
    try:
        with Slurm(folder / "slurm", cores, 4000 * cores) as slurm:
            show = Show(folder, slurm, cores)
            show.say(f"SLURM is up with {cores} cores; load of the machine {os.getloadavg()[0]:.2f}; {folder}")
            show.design()
            show.fault(show.scancel)
            show.fault(show.driver_killed, code=-signal.SIGKILL)
            failed = show.failed
    finally:
        outcome = f"{failed} parts failed, see {folder}" if failed else "all as it should be"
        print(f"{time.monotonic() - began:.0f} s; {outcome}")
        if not failed:
            shutil.rmtree(folder, ignore_errors=True)
    return failed


if __name__ == "__main__":
    if lacking := missing():
        sys.exit(f"no SLURM can be brought up: {lacking}")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # the daemons end with it
    sys.exit(bool(main()))

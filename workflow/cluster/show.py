"""The sweep and the pipeline on a real SLURM of one node, against the same on this machine, and what faults do to them.

`python workflow/cluster/show.py` takes about half an hour on two cores, with ``--small`` some minutes. Everything lies
in a folder of its own and works on a copy of the project; it is removed at the end unless something went wrong.
"""

import contextlib
import filecmp
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pandas as pd
from slurm import Slurm, missing

ROOT = Path(__file__).parents[2]
NOT_COPIED = ("results", ".venv", ".git", ".snakemake", ".pytest_cache", ".ruff_cache", ".hypothesis", "__pycache__")
# the rows of the sweep, their jobs a core, the rows of a fault, the pipeline's targets
FULL = (10_000, 1, 400, ["metrics.csv", "events.csv"])
SMALL = (120, 1, 60, [])
SCENE = ("preset=fast", "ramp=0.1", "lead_in=0", "duration=1")
# without one, or with smaller ones, so quick a start is too much for this step
RINGS = "0.308,0.309,0.31,0.311,0.312,0.313"
EFFICIENCY = 0.9  # of the cores' time, computing rows; asked for before it was measured
PATIENCE = 1800.0  # s for any one command
# Polling every ten seconds is for one node; the profile's own is kinder to a cluster.
EAGER = ("--slurm-init-seconds-before-status-checks", "10")


class Show:
    """A folder with a copy of the project, a SLURM beside it, and what came out."""

    def __init__(self, folder: Path, slurm: Slurm, cores: int):
        self.folder, self.slurm, self.cores = folder, slurm, cores
        self.failed = 0
        self.started: list[subprocess.Popen] = []
        self.environment = slurm.environment | {"PYTHONPATH": str(ROOT)}
        (folder / "work").mkdir()

    def say(self, text: str, good: bool = True) -> None:
        """A line of the report; one that is not good fails the whole."""
        self.failed += not good
        print(f"{'' if good else 'FAILED: '}{text}", flush=True)

    def start(self, name: str, *command: str, place: str = "work") -> subprocess.Popen:
        """A command of Python, its words in a file."""
        with (self.folder / f"{name}.log").open("ab") as log:
            process = subprocess.Popen(
                [sys.executable, "-P", *command], cwd=self.folder / place, env=self.environment, stdout=log, stderr=log
            )
        self.started.append(process)
        return process

    def __enter__(self) -> "Show":
        return self

    def __exit__(self, *_) -> None:
        for process in self.started:
            if process.poll() is None:
                process.kill()
                process.wait()

    def run(self, name: str, *command: str, place: str = "work") -> int:
        """The same to its end."""
        process = self.start(name, *command, place=place)
        try:
            return process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            return process.wait()

    def trackdyn(self, name: str, *arguments: str) -> int:
        """The project's command."""
        return self.run(name, "-c", "from trackdyn_command import main; main()", *arguments)

    def driver(self, name: str, design: str, batches: int, *more: str) -> tuple[str, ...]:
        """The plain command of a sweep on SLURM."""
        return (
            "-m",
            "snakemake",
            "-s",
            f"{ROOT}/workflow/sweep.smk",
            "--workflow-profile",
            f"{ROOT}/profiles/slurm",
            *EAGER,
            "--config",
            f"rig={ROOT}/config/rig.yaml",
            f"design={self.folder}/{design}.parquet",
            f"out={self.folder}/{name}/results.parquet",
            f"batches={batches}",
            *more,
        )

    def same(self, name: str, design: str) -> bool:
        """Whether a sweep on SLURM gave the bytes that this machine gives."""
        files = [self.folder / path / "results.parquet" for path in (name, f"local_{design}")]
        return all(file.exists() for file in files) and filecmp.cmp(*files, shallow=False)

    def kept(self, name: str) -> int:
        """Rows that are computed so far."""
        return sum(path.read_bytes().count(b"\n") for path in (self.folder / name / "results.rows").glob("*.jsonl"))

    # -- the sweep, the pipeline ---------------------------------------------------------------------------------------

    def design(self, name: str, rows: int) -> None:
        """A design of short scenes, and what this machine makes of it."""
        fixed = [part for field in SCENE for part in ("--set", field)]
        self.trackdyn("design", "design", f"{self.folder}/{name}.parquet", "--method", "latin", "--rows", str(rows),
                      "--vary", "motor_rpm=100:210", "--vary", f"ring_radius={RINGS}", *fixed)  # fmt: skip
        began = time.monotonic()
        out = self.folder / f"local_{name}" / "results.parquet"
        code = self.trackdyn(
            "local",
            "sweep",
            f"{self.folder}/{name}.parquet",
            "--out",
            str(out),
            "-q",
            f"-j{self.cores}",
            "--rig",
            f"{ROOT}/config/rig.yaml",
        )
        wall = time.monotonic() - began
        states = pd.read_parquet(out).state.value_counts().to_dict() if out.exists() else {}
        cpu = pd.read_csv(out.with_suffix(".costs.csv")).cpu_s.sum() if out.exists() else 0.0
        self.say(
            f"{name}: {rows} rows here in {wall:.0f} s, {cpu / wall / self.cores:.3f} of the cores' "
            f"time in rows: {states}",
            code == 0 and sum(states.values()) == rows,
        )

    def sweep(self, batches: int) -> None:
        """The same on SLURM: bytes, and the part of the cores' time that went into rows."""
        before, began = self._newest_job(), time.time()
        code = self.run("sweep", *self.driver("sweep", "long", batches))
        self.say(f"sweep on SLURM in {time.time() - began:.0f} s and {self._newest_job() - before} jobs", code == 0)
        self.say("sweep: byte for byte what this machine gives", self.same("sweep", "long"))
        with contextlib.suppress(OSError):
            cpu = pd.read_csv(self.folder / "sweep/results.costs.csv").cpu_s.sum()
            times = pd.DataFrame([self._times(job) for job in self._batches(before)]).sort_values("start")
            span = times["end"].max() - times["start"].min()
            share = cpu / span / self.cores
            met = "at least" if share >= EFFICIENCY else "NOT"
            self.say(
                f"sweep: {share:.3f} of the cores' time in rows from the first batch's start to the "
                f"last one's end ({span:.0f} s by "
                f"SLURM), {met} the {EFFICIENCY} asked for"
            )

    def _batches(self, after: int) -> list[str]:
        """Jobs of batches, as long as SLURM remembers them."""
        lines = self.slurm.out("squeue", "--noheader", "--format=%i %k", "--states=all").splitlines()
        return [line.split()[0] for line in lines if "rule_batch" in line and int(line.split()[0]) > after]

    def _times(self, job: str) -> dict[str, float]:
        """When a job began and ended, s."""
        start, end = self.slurm.out("squeue", "--noheader", "--format=%S %e", "--states=all", f"--jobs={job}").split()
        return {"start": pd.Timestamp(start).timestamp(), "end": pd.Timestamp(end).timestamp()}

    def _newest_job(self) -> int:
        ids = [int(job) for job in self.slurm.out("squeue", "--noheader", "--format=%i", "--states=all").split()]
        return max(ids, default=0)

    def pipeline(self, targets: list[str]) -> None:
        """Part of the quick graph on SLURM and here: recordings and tables are the same, but for what they cost."""
        shutil.copytree(ROOT, self.folder / "project", ignore=shutil.ignore_patterns(*NOT_COPIED))
        self.environment["PYTHONPATH"] = str(self.folder / "project")
        results = self.folder / "project" / "results" / "quick"
        wanted = [f"results/quick/{target}" for target in targets]
        for name, how in (("slurm", ("--workflow-profile", "profiles/slurm", *EAGER)), ("here", (f"-j{self.cores}",))):
            began = time.monotonic()
            code = self.run(
                f"pipeline_{name}",
                "workflow/run.py",
                *how,
                "--configfile",
                "config/quick.yaml",
                "--",
                *wanted,
                place="project",
            )
            self.say(
                f"pipeline: quick graph to {', '.join(targets)}, {name}, in {time.monotonic() - began:.0f} s", code == 0
            )
            if results.exists():
                results.rename(self.folder / f"quick_{name}")
        one, other = (self.folder / f"quick_{name}" for name in ("slurm", "here"))
        files = [path.relative_to(one) for path in one.rglob("*.npz")]
        differ = [
            str(file)
            for file in files
            if not (other / file).exists() or not filecmp.cmp(one / file, other / file, shallow=False)
        ]
        self.say(
            f"pipeline: {len(files)} recordings, {len(differ)} differ {' '.join(differ[:3])}",
            bool(files) and not differ,
        )
        for target in targets:
            with contextlib.suppress(OSError):
                tables = [
                    pd.read_csv(folder / target, dtype=str).drop(columns="wall_s", errors="ignore")
                    for folder in (one, other)
                ]
                self.say(f"pipeline: {target} the same but for its costs", tables[0].equals(tables[1]))

    # -- faults --------------------------------------------------------------------------------------------------------

    def fault(self, name: str, strike, *more: str, expected: bool = True) -> None:
        """A driver that meets a fault, then the plain command again.

        Parameters
        ----------
        strike : function
            Called with the running driver; returns what it did, in words.
        more : str
            Added to the first command only.
        expected : bool
            Whether the first driver comes to an end by itself and well.
        """
        command = self.driver(name, "short", self.cores)
        began = time.monotonic()
        process = self.start(name, *command, *more)
        try:
            did = strike(name, process)
            code = process.wait(PATIENCE)
        except (RuntimeError, subprocess.TimeoutExpired) as error:
            process.kill()
            self.say(f"{name}: {' '.join(str(error).split())[:300]}", False)
            process.wait()
            return
        self.say(f"{name}: {did}; the driver ended with {code}", (code == 0) == expected)
        self.run(name, *command, "--unlock")  # a driver that was killed leaves its lock
        code = self.run(name, *command)
        twice = self.kept(name) - pd.read_parquet(self.folder / "short.parquet").shape[0]
        self.say(
            f"{name}: the plain command again: {code}, byte for byte, {twice} rows computed twice, "
            f"{time.monotonic() - began:.0f} s in all",
            code == 0 and self.same(name, "short"),
        )

    def running(self, name: str, process: subprocess.Popen) -> str:
        """A batch that is running and has rows; its id."""
        end = time.monotonic() + 240
        while time.monotonic() < end and process.poll() is None:
            lines = self.slurm.out("squeue", "--noheader", "--format=%i %k", "--states=RUNNING").splitlines()
            batches = [line.split()[0] for line in lines if "rule_batch" in line]
            if batches and self.kept(name) > 2:
                return batches[0]
            time.sleep(0.05)
        raise RuntimeError("no batch came to run")

    def cancel(self, name: str, process: subprocess.Popen) -> str:
        job = self.running(name, process)
        self.slurm.run("scancel", job)
        return f"scancel of a batch with {self.kept(name)} rows kept"

    def overtime(self, name: str, process: subprocess.Popen) -> str:
        """Limits of time are looked at twice a minute, by when a short batch would be done: it is stopped
        until then.
        """
        job = self.running(name, process)
        self.slurm.run("scancel", "--signal=STOP", job)
        self.slurm.run("scontrol", "update", f"JobId={job}", "EndTime=now")
        end, state = time.monotonic() + 120, "RUNNING"
        while state in ("RUNNING", "STOPPED", "COMPLETING") and time.monotonic() < end:
            time.sleep(0.5)
            state = self.slurm.out("squeue", "--noheader", "--format=%T", "--states=all", f"--jobs={job}").strip()
        if state != "TIMEOUT":
            raise RuntimeError(f"the batch is {state}, not over its time")
        return f"a batch over its time with {self.kept(name)} rows kept"

    def overmemory(self, name: str, process: subprocess.Popen) -> str:
        process.wait(PATIENCE)
        killed = any("exceeded memory limit" in path.read_text(errors="replace") for path in self.slurm_logs())
        if not killed:
            raise RuntimeError("no job was killed for its memory")
        return "jobs over their memory"

    def slurm_logs(self):
        return (self.folder / "work" / ".snakemake" / "slurm_logs").rglob("*.log")

    def node(self, name: str, process: subprocess.Popen) -> str:
        self.running(name, process)
        self.slurm.stop("slurmd", signal.SIGKILL)
        time.sleep(2)
        self.slurm.start("slurmd", "-D")
        return "slurmd killed and started again"

    def kill(self, name: str, process: subprocess.Popen) -> str:
        self.running(name, process)
        process.kill()
        return f"the driver killed with {self.kept(name)} rows kept"


def main(small: bool) -> int:
    """Everything, and how many parts of it failed."""
    rows, jobs_a_core, few, targets = SMALL if small else FULL
    cores = len(os.sched_getaffinity(0))
    folder = Path(tempfile.mkdtemp(prefix="trackdyn-cluster-"))
    began, failed = time.monotonic(), 1
    try:
        with Slurm(folder / "slurm", cores, 4000 * cores) as slurm, Show(folder, slurm, cores) as show:
            show.say(f"SLURM is up with {cores} cores; load of the machine {os.getloadavg()[0]:.2f}; {folder}")
            show.design("long", rows)
            show.sweep(jobs_a_core * cores)
            show.design("short", few)
            show.fault("scancel", show.cancel)
            show.fault("driver", show.kill, expected=False)
            if not small:
                show.fault("overtime", show.overtime)
                show.fault("overmemory", show.overmemory, "mem_mb=300")
                show.fault("slurmd", show.node)
                show.pipeline(targets)
            failed = show.failed
    finally:
        print(
            f"{time.monotonic() - began:.0f} s; "
            f"{f'{failed} parts failed, see {folder}' if failed else 'all as it should be'}"
        )
        if not failed:
            shutil.rmtree(folder, ignore_errors=True)
    return failed


if __name__ == "__main__":
    if lacking := missing():
        sys.exit(f"no SLURM can be brought up: {lacking}")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # the daemons end with it
    sys.exit(bool(main("--small" in sys.argv[1:])))

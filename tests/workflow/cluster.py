"""A sweep and the quick pipeline on a real SLURM of one node give the results that this machine gives."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

ROOT = Path(__file__).parents[2]
RIG = ROOT / "trackdyn" / "rigs" / "paper.yaml"
PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "srun", "squeue", "scontrol", "scancel")
UP, PATIENCE = 30.0, 1800.0  # s until a daemon answers, and for any one command
PROFILE = ("--workflow-profile", ROOT / "profiles" / "slurm", "--slurm-init-seconds-before-status-checks", 10)
LITTLE = 200  # MB, which the interpreters of a batch exceed; then it gets eight times as much
CONF = """\
ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
MailProg=/bin/true
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherFrequency=task=1
JobAcctGatherParams=OverMemoryKill
MinJobAge=3600
KillWait=3
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory={memory} State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def executable(program: str) -> str | None:
    """Path of a program, of which daemons lie where users do not look."""
    return shutil.which(program, path=f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin")


def wait_until(true, seconds: float, event: str) -> None:
    """Wait for a condition. Raises `SystemExit`: it did not come true."""
    end = time.monotonic() + seconds
    while not true():
        if time.monotonic() > end:
            sys.exit(f"{event}: not within {seconds:g} s")
        time.sleep(0.1)


class Slurm:
    """Daemons of one node in a folder, as a context; all of them end with it. ``environment`` is for its commands."""

    def __init__(self, folder: Path, cores: int):
        self.folder, self.daemons = folder, []
        for name in ("bin", "state", "spool"):
            (folder / name).mkdir(parents=True)
        conf, srun, key = folder / "slurm.conf", folder / "bin" / "srun", folder / "munge.key"
        # within a job the plugin hands no SLURM_CONF on to srun, as if every SLURM had its file in /etc
        srun.write_text(f'#!/bin/sh\nSLURM_CONF={conf} exec {executable("srun")} "$@"\n', encoding="utf-8")
        srun.chmod(0o755)
        key.write_bytes(os.urandom(1024))
        key.chmod(0o400)
        self.environment = os.environ | {"SLURM_CONF": str(conf), "PATH": f"{srun.parent}:{os.environ['PATH']}"}
        host = socket.gethostname().split(".")[0]
        anywhere = ("127.0.0.1", 0)
        with socket.create_server(anywhere) as first, socket.create_server(anywhere) as second:
            ports = first.getsockname()[1], second.getsockname()[1]  # on which nobody listens
        text = CONF.format(folder=folder, host=host, ports=ports, cores=cores, memory=4000 * cores)
        conf.write_text(text, encoding="utf-8")

    def __enter__(self):
        munge = {"socket": "munge.socket", "key-file": "munge.key", "pid-file": "munged.pid"}
        munge |= {"log-file": "munged.log", "seed-file": "munged.seed"}
        files = [f"--{name}={self.folder / file}" for name, file in munge.items()]
        try:
            self.start("munged", (self.folder / "munge.socket").exists, "--foreground", "--force", *files)
            self.start("slurmctld", lambda: "is UP" in self.out("scontrol", "ping"), "-D")
            self.start("slurmd", lambda: "idle" in self.out("sinfo", "--noheader", "--format=%T"), "-D")
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        self.out("scancel", "--user=root")  # jobs would go on without their daemon
        wait_until(lambda: not self.out("squeue", "--noheader", "--states=PENDING,RUNNING,COMPLETING"), UP, "their end")
        for daemon in reversed(self.daemons):
            daemon.kill()
            daemon.wait()

    def start(self, name: str, up, *arguments: str) -> None:
        """Start a daemon in the foreground and wait until it is up."""
        with (self.folder / f"{name}.out").open("ab") as out:
            command, quiet = [executable(name), *arguments], subprocess.DEVNULL
            self.daemons.append(subprocess.Popen(command, env=self.environment, stdout=out, stderr=out, stdin=quiet))
        wait_until(up, UP, f"{name} is up")

    def jobs(self, rule: str, states: str) -> list[tuple[str, str, int]]:
        """Jobs of a rule, in any of its states if that is ``all``: number, state and memory, MB."""
        lines = self.out("squeue", "--noheader", "--format=%i|%T|%m|%k", f"--states={states}").splitlines()
        jobs = [line.split("|") for line in lines if f"rule_{rule}" in line]
        return [(job, state, int(memory.removesuffix("M"))) for job, state, memory, _ in jobs]

    def out(self, *command: str) -> str:
        """Output of a command of SLURM, empty if it fails."""
        return subprocess.run(command, env=self.environment, capture_output=True, text=True).stdout


def swept(folder: Path, slurm: Slurm, cores: int) -> None:
    """Sweep a design here and on SLURM, where batches lack memory, and one is killed. `SystemExit`: they differ."""
    rows = {"motor_rpm": np.linspace(100, 210, 24), "ring_radius": np.resize([0.308, 0.31, 0.312], 24)}
    scene = {"preset": "fast", "ramp": 0.1, "lead_in": 0, "duration": 4}
    pd.DataFrame(rows).assign(**scene).to_csv(folder / "design.csv", index=False)
    environment = slurm.environment | {"PYTHONPATH": str(ROOT)}

    def start(*words) -> subprocess.Popen:
        return subprocess.Popen([sys.executable, "-P", "-m", *map(str, words)], cwd=folder, env=environment)

    if start("trackdyn", "sweep", "design.csv", "--out", "here.csv", "-q", "--rig", RIG).wait(PATIENCE):
        sys.exit("the sweep on this machine failed")
    config = ("--config", "design=design.csv", "out=there.csv", f"rig={RIG}", f"batches={cores}")
    little = ("--set-resources", f"batch:mem_mb={LITTLE} * attempt**3")
    driver = start("snakemake", "-s", ROOT / "workflow" / "sweep.smk", *PROFILE, *little, *config)
    batches: list[str] = []

    def running() -> bool:
        """Whether a batch with enough memory has stored rows."""
        batches[:] = [job for job, _, memory in slurm.jobs("batch", "RUNNING") if memory > LITTLE]
        return bool(batches) and len(list(folder.glob("there.rows/*.json"))) > 2

    try:
        wait_until(running, 900, "a batch that runs")
        slurm.out("scancel", batches[0])
        if driver.wait(PATIENCE):
            sys.exit("the sweep on SLURM failed")
    finally:
        driver.kill()
    # without control groups the reason of a failure is only in SLURM's log
    log, ends = (slurm.folder / "slurmd.log").read_text(encoding="utf-8"), {}
    for job, state, memory in slurm.jobs("batch", "all"):
        state = "OUT_OF_MEMORY" if f"StepId={job}.batch exceeded memory limit" in log else state
        ends.setdefault(state, set()).add(memory)
    print(f"batches ended so, with MB of memory: {ends}", flush=True)
    if ends.keys() != {"OUT_OF_MEMORY", "CANCELLED", "COMPLETED"} or ends["OUT_OF_MEMORY"] != {LITTLE}:
        sys.exit("no batch ran out of memory, or none was killed, and tried again with more")
    if (folder / "here.csv").read_bytes() != (folder / "there.csv").read_bytes():
        sys.exit("the sweeps differ")
    print("sweep: the same bytes", flush=True)


def replicated(folder: Path, slurm: Slurm) -> None:
    """Run the quick pipeline on SLURM. Raises `SystemExit`: it fails, or differs from one of this machine."""
    root, here = folder / "copy", ROOT / "results" / "quick" / "manifest.json"
    left_out = shutil.ignore_patterns(".git", ".venv", ".snakemake", "__pycache__", "results", "_site")
    shutil.copytree(ROOT, root, ignore=left_out)
    environment = slurm.environment | {"PYTHONPATH": f"{root}{os.pathsep}{root / 'workflow'}"}

    def run(*words) -> None:
        command = [sys.executable, "-P", *map(str, words)]
        if subprocess.run(command, cwd=root, env=environment, timeout=2 * PATIENCE).returncode:
            sys.exit(f"failed: {' '.join(command)}")

    run("workflow/run.py", *PROFILE, "--configfile", "config/quick.yaml")
    run("-m", "trackdyn", "verify", "results/quick", "--exact", *(["--against", here] if here.exists() else []))
    count = len([state for _, state, _ in slurm.jobs("", "all") if state == "COMPLETED"])
    print(f"quick pipeline: {'the same bytes' if here.exists() else 'complete'}; {count} jobs of SLURM", flush=True)


def main() -> None:
    """Run the sweeps and the pipeline as root, in a quarter of an hour on two cores, and say whether they agree."""
    lacking = [program for program in PROGRAMS if not executable(program)]
    if lacking or os.geteuid():
        sys.exit(f"needs {', '.join(lacking) or 'root'}; on Debian: apt-get install slurm-wlm munge")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # the daemons end with it
    cores, folder = len(os.sched_getaffinity(0)), Path(tempfile.mkdtemp(prefix="trackdyn-cluster-"))
    with Slurm(folder / "slurm", cores) as slurm:
        print(f"{folder}: {slurm.out('sbatch', '--version').strip()}", flush=True)
        swept(folder, slurm, cores)
        replicated(folder, slurm)
    shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()

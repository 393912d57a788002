"""A sweep on a real SLURM of one node, one of whose batches is cancelled, gives the bytes that this machine gives.

`make cluster` runs it in some minutes on two cores, as root. Everything lies in a folder of its own, which is removed
at the end unless something went wrong.
"""

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
MinJobAge=600
KillWait=3
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory={memory} State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def executable(program: str) -> str | None:
    """Path of a program, of which daemons lie where users do not look."""
    return shutil.which(program, path=f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin")


def wait_until(true, seconds: float, what: str) -> None:
    """Wait for a condition. Raises `SystemExit`: it did not come true."""
    end = time.monotonic() + seconds
    while not true():
        if time.monotonic() > end:
            sys.exit(f"{what}: not within {seconds:g} s")
        time.sleep(0.1)


def free_ports(count: int) -> list[int]:
    """Ports on which nobody listens."""
    sockets = [socket.socket() for _ in range(count)]
    for each in sockets:
        each.bind(("127.0.0.1", 0))
    ports = [each.getsockname()[1] for each in sockets]
    for each in sockets:
        each.close()
    return ports


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
        conf.write_text(
            CONF.format(folder=folder, host=host, ports=free_ports(2), cores=cores, memory=4000 * cores), "utf-8"
        )

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

    def out(self, *command: str) -> str:
        """Output of a command of SLURM, empty if it fails."""
        return subprocess.run(command, env=self.environment, capture_output=True, text=True).stdout


def swept(folder: Path, slurm: Slurm, cores: int) -> bool:
    """Sweep a design here and on SLURM, where a batch is cancelled; whether both gave the same bytes."""
    rows = {"motor_rpm": np.linspace(100, 210, 24), "ring_radius": np.resize([0.308, 0.31, 0.312], 24)}
    scene = {"preset": "fast", "ramp": 0.1, "lead_in": 0, "duration": 1}
    pd.DataFrame(rows).assign(**scene).to_csv(folder / "design.csv", index=False)
    environment = slurm.environment | {"PYTHONPATH": str(ROOT)}

    def start(*words) -> subprocess.Popen:
        return subprocess.Popen([sys.executable, "-P", "-m", *map(str, words)], cwd=folder, env=environment)

    here = start("trackdyn", "sweep", "design.csv", "--out", "here.csv", "-q", "--rig", RIG)
    profile = ("--workflow-profile", ROOT / "profiles" / "slurm", "--slurm-init-seconds-before-status-checks", 10)
    config = ("--config", "design=design.csv", "out=there.csv", f"rig={RIG}", f"batches={cores}")
    driver = start("snakemake", "-s", ROOT / "workflow" / "sweep.smk", *profile, *config) if not here.wait() else here
    batches: list[str] = []

    def running() -> bool:
        jobs = slurm.out("squeue", "--noheader", "--format=%i %k", "--states=RUNNING").splitlines()
        batches[:] = [job.split()[0] for job in jobs if "rule_batch" in job]
        return bool(batches) and len(list(folder.glob("there.rows/*.json"))) > 2

    try:
        wait_until(running, 600, "a batch that runs")
        slurm.out("scancel", batches[0])
        code = driver.wait(PATIENCE)
    finally:
        driver.kill()
    tables = [(folder / name).read_bytes() for name in ("here.csv", "there.csv")] if not code else ["", None]
    return tables[0] == tables[1]


def main() -> None:
    """Run the sweeps, and say whether they agree."""
    lacking = [program for program in PROGRAMS if not executable(program)]
    if lacking or os.geteuid():
        sys.exit(f"needs {', '.join(lacking) or 'root'}; on Debian: apt-get install slurm-wlm munge")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # the daemons end with it
    cores, folder = len(os.sched_getaffinity(0)), Path(tempfile.mkdtemp(prefix="trackdyn-cluster-"))
    with Slurm(folder / "slurm", cores) as slurm:
        same = swept(folder, slurm, cores)
    if not same:
        sys.exit(f"the sweeps differ, see {folder}")
    shutil.rmtree(folder, ignore_errors=True)
    print("the same bytes")


if __name__ == "__main__":
    main()

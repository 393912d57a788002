"""A SLURM of one node in a folder of its own, on this machine and its loopback alone."""

import os
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "srun", "squeue", "scontrol", "scancel")
UP = 30.0  # s until a daemon answers, and until its jobs have ended
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
# the memory of jobs is watched, so that no control group is needed
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherFrequency=task=1
JobAcctGatherParams=OverMemoryKill
AccountingStorageType=accounting_storage/none
# squeue remembers a job that ended for so long
MinJobAge=600
KillWait=3
OverTimeLimit=0
InactiveLimit=0
ReturnToService=2
SlurmdTimeout=600
SchedulerParameters=sched_min_interval=100000
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory={memory} State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def missing() -> str | None:
    """Say in a sentence what a SLURM here lacks."""
    if lacking := [program for program in PROGRAMS if not _executable(program)]:
        return f"{', '.join(lacking)} not installed; on Debian: apt-get install slurm-wlm munge"
    if os.geteuid():
        return "the daemons of SLURM start jobs as their users, for which they must be root"
    return None


def _executable(program: str) -> str | None:
    return shutil.which(program, path=f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin")


def wait_until(true: Callable[[], object], seconds: float, what: str) -> None:
    """Wait for a condition.

    Raises
    ------
    RuntimeError
        It did not come true.
    """
    end = time.monotonic() + seconds
    while not true():
        if time.monotonic() > end:
            raise RuntimeError(f"{what}: not within {seconds:g} s")
        time.sleep(0.1)


class Slurm:
    """Daemons of one node, as a context; all of them end with it.

    Parameters
    ----------
    folder : path
        For keys, state and logs; its name must be short, sockets lie in it.
    cores, memory : int
        What the node offers; MB.

    Attributes
    ----------
    environment : dict
        For everything that talks to this SLURM.
    """

    def __init__(self, folder: Path, cores: int, memory: int):
        self.folder = folder
        conf = folder / "slurm.conf"
        for name in ("bin", "state", "spool"):
            (folder / name).mkdir(parents=True)
        # within a job the plugin hands no SLURM_CONF on to srun, as if every SLURM had its file in /etc
        srun = folder / "bin" / "srun"
        srun.write_text(f'#!/bin/sh\nSLURM_CONF={conf} exec {_executable("srun")} "$@"\n', encoding="utf-8")
        srun.chmod(0o755)
        self.environment = os.environ | {"SLURM_CONF": str(conf), "PATH": f"{srun.parent}:{os.environ['PATH']}"}
        self.daemons: dict[str, subprocess.Popen] = {}
        key = folder / "munge.key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o400)
        with socket.socket() as first, socket.socket() as second:  # ports that nobody listens on
            for free in (first, second):
                free.bind(("127.0.0.1", 0))
            ports = first.getsockname()[1], second.getsockname()[1]
        host = socket.gethostname().split(".")[0]
        conf.write_text(CONF.format(folder=folder, host=host, ports=ports, cores=cores, memory=memory), "utf-8")

    def __enter__(self) -> "Slurm":
        munge = {"socket": "munge.socket", "key-file": "munge.key", "pid-file": "munged.pid"}
        munge |= {"log-file": "munged.log", "seed-file": "munged.seed"}
        places = [f"--{name}={self.folder / file}" for name, file in munge.items()]
        try:
            self.start("munged", (self.folder / "munge.socket").exists, "--foreground", "--force", *places)
            self.start("slurmctld", lambda: "is UP" in self.out("scontrol", "ping"), "-D")
            self.start("slurmd", lambda: "idle" in self.out("sinfo", "--noheader", "--format=%T"), "-D")
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_) -> None:
        if "slurmd" in self.daemons:  # its jobs would go on without it
            self.out("scancel", "--user=root")
            wait_until(lambda: not self.jobs("%i", "PENDING,RUNNING,COMPLETING"), UP, "an end of all jobs")
        for name in [*reversed(self.daemons)]:
            self.stop(name)

    def start(self, name: str, up: Callable[[], object], *arguments: str) -> None:
        """Start a daemon in the foreground and wait until it is up; it also ends with this process."""
        leash = ["setpriv", "--pdeathsig", "KILL"] if shutil.which("setpriv") else []
        command, quiet = [*leash, _executable(name), *arguments], subprocess.DEVNULL
        with (self.folder / f"{name}.out").open("ab") as out:
            self.daemons[name] = subprocess.Popen(command, env=self.environment, stdout=out, stderr=out, stdin=quiet)
        try:
            wait_until(up, UP, f"{name} is up")
        except RuntimeError as error:
            logs = [path.read_text(errors="replace") for path in self.folder.glob(f"{name}.[lo]*")]
            raise RuntimeError(f"{error}: {' '.join(' '.join(logs).split())[-600:]}") from None

    def stop(self, name: str, how: int = signal.SIGTERM) -> None:
        """End a daemon that was started here."""
        process = self.daemons.pop(name)
        process.send_signal(how)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def out(self, *command: str) -> str:
        """Output of a command of SLURM, empty if it fails."""
        return subprocess.run(command, env=self.environment, capture_output=True, text=True).stdout

    def jobs(self, form: str, states: str = "all") -> list[str]:
        """Jobs in some states, a line each (`squeue --format`)."""
        return self.out("squeue", "--noheader", f"--format={form}", f"--states={states}").splitlines()

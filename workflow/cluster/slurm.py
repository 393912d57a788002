"""A SLURM of one node in a folder of its own, on this machine and its loopback alone."""

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import time
from pathlib import Path

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "srun", "squeue", "scontrol", "scancel")
UP = 30.0  # s until every daemon answers
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
    """What a SLURM here lacks, in one sentence."""
    if lacking := [program for program in PROGRAMS if not _found(program)]:
        return f"{', '.join(lacking)} not installed; on Debian: apt-get install slurm-wlm munge"
    if os.geteuid():
        return "the daemons of SLURM start jobs as their users, for which they must be root"
    return None


def _found(program: str) -> str | None:
    return shutil.which(program, path=f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin")


def _free_ports(count: int) -> list[int]:
    """Ports that nobody listens on."""
    with contextlib.ExitStack() as held:
        sockets = [held.enter_context(socket.socket()) for _ in range(count)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]


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
        conf = str(folder / "slurm.conf")
        # within a job the plugin hands no SLURM_CONF on to srun, as if every SLURM had its file in /etc
        (folder / "bin").mkdir(parents=True)
        srun = folder / "bin" / "srun"
        srun.write_text(f'#!/bin/sh\nSLURM_CONF={conf} exec {_found("srun")} "$@"\n', encoding="utf-8")
        srun.chmod(0o755)
        self.environment = os.environ | {"SLURM_CONF": conf, "PATH": f"{srun.parent}:{os.environ['PATH']}"}
        self.daemons: dict[str, subprocess.Popen] = {}
        for name in ("state", "spool"):
            (folder / name).mkdir(parents=True)
        key = folder / "munge.key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o400)
        host = socket.gethostname().split(".")[0]
        (folder / "slurm.conf").write_text(
            CONF.format(folder=folder, host=host, ports=_free_ports(2), cores=cores, memory=memory), encoding="utf-8"
        )

    def __enter__(self) -> "Slurm":
        try:
            f = self.folder
            self.start(
                "munged",
                "--foreground",
                "--force",
                f"--socket={f}/munge.socket",
                f"--key-file={f}/munge.key",
                f"--pid-file={f}/munged.pid",
                f"--log-file={f}/munged.log",
                f"--seed-file={f}/munged.seed",
            )
            self._wait(lambda: (f / "munge.socket").exists(), "munged")
            self.start("slurmctld", "-D")
            self._wait(lambda: not self.run("scontrol", "ping", check=False).returncode, "slurmctld")
            self.start("slurmd", "-D")
            self._wait(lambda: "idle" in self.out("sinfo", "--noheader", "--format=%T"), "slurmd")
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_) -> None:
        if "slurmd" in self.daemons:  # its jobs would go on without it
            self.run("scancel", "--user=root", check=False)
            self._settled()
        for name in [*reversed(self.daemons)]:
            self.stop(name)

    def _settled(self) -> None:
        """Wait until no job is left, as long as it takes to kill one."""
        for _ in range(100):
            if not self.jobs():
                return
            time.sleep(0.1)

    def start(self, name: str, *arguments: str) -> None:
        """Start a daemon in the foreground, so that its end can be seen to; it also ends with this process."""
        leash = ["setpriv", "--pdeathsig", "KILL"] if shutil.which("setpriv") else []
        with (self.folder / f"{name}.out").open("ab") as out:
            self.daemons[name] = subprocess.Popen(
                [*leash, _found(name), *arguments],
                env=self.environment,
                stdout=out,
                stderr=out,
                stdin=subprocess.DEVNULL,
            )

    def stop(self, name: str, how: int = signal.SIGTERM) -> None:
        """End a daemon that was started here."""
        process = self.daemons.pop(name)
        process.send_signal(how)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def run(self, *command: str, check: bool = True) -> subprocess.CompletedProcess:
        """A command of SLURM."""
        return subprocess.run(command, env=self.environment, check=check, capture_output=True, text=True)

    def out(self, *command: str) -> str:
        """What a command of SLURM prints, nothing if it fails."""
        return self.run(*command, check=False).stdout

    def jobs(self, states: str = "PENDING,RUNNING,COMPLETING") -> list[str]:
        """Ids of the jobs in some states."""
        return self.out("squeue", "--noheader", "--format=%i", f"--states={states}").split()

    def _wait(self, up, name: str) -> None:
        end = time.monotonic() + UP
        while not up():
            process = self.daemons[name]
            if process.poll() is not None or time.monotonic() > end:
                words = "".join(
                    path.read_text(errors="replace")
                    for path in self.folder.glob(f"{name}.*")
                    if path.suffix in (".log", ".out")
                )
                raise RuntimeError(f"{name} does not come up: {' '.join(words.split())[-600:]}")
            time.sleep(0.1)

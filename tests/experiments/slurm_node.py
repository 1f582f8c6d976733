"""A SLURM of one node on this machine, in a folder of its own: for trials of the cluster's workers.

Debian's packages slurm-wlm and munge are needed, and rights to start daemons. No service of the machine is
touched: configuration, keys, logs and state lie in the folder, the daemons end with the block.
"""

import getpass
import os
import secrets
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from experiments.io.files import write_text

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch")
"""Programs that must be there."""

PATIENCE = 60.0
"""Time in which the node must be ready [s]."""

CONFIGURATION = """\
ClusterName=one
SlurmctldHost={host}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
# no cgroups: a container often has none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SwitchType=switch/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
ReturnToService=2
JobRequeue=1
KillWait=5
NodeName={host} CPUs={cpus} RealMemory=16000 State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def is_installed() -> bool:
    """Tell that the daemons are there."""
    return all(_program(name) for name in PROGRAMS)


@contextmanager
def one_node(folder: Path, cpus: int = 4) -> Iterator[dict[str, str]]:
    """Start SLURM with one node in an empty folder; yield the environment that its commands need."""
    folder = folder.resolve()
    for name in ("state", "spool", "munge"):
        (folder / name).mkdir(parents=True)
    (folder / "munge").chmod(0o700)
    key = folder / "munge" / "key"
    key.write_bytes(secrets.token_bytes(1024))
    key.chmod(0o400)
    host = socket.gethostname().partition(".")[0]
    words = {"host": host, "user": getpass.getuser(), "folder": folder, "cpus": cpus, "ports": _free_ports()}
    write_text(folder / "slurm.conf", CONFIGURATION.format(**words))
    environment = os.environ | {"SLURM_CONF": str(folder / "slurm.conf")}
    munge = [f"--{name}={folder}/munge/{name}" for name in ("pid-file", "log-file", "seed-file")]
    orders = (
        ["munged", "--foreground", "--force", f"--key-file={key}", f"--socket={folder}/munge.socket", *munge],
        ["slurmctld", "-D"],
        ["slurmd", "-D"],
    )
    with ExitStack() as stack:
        for order in orders:
            stack.enter_context(_daemon(order, environment))
        _await_node(environment)
        yield environment
        command(environment, "scancel", "--user", getpass.getuser())


def command(environment: dict[str, str], *words: str) -> str:
    """Run a command of SLURM and return what it says; empty where it fails."""
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=False)
    return done.stdout if done.returncode == 0 else ""


@contextmanager
def _daemon(order: list[str], environment: dict[str, str]) -> Iterator[None]:
    program = _program(order[0])
    if program is None:
        raise RuntimeError(f"{order[0]} must be installed (Debian: slurm-wlm, munge)")
    process = subprocess.Popen(
        [program, *order[1:]],
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        yield
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(timeout=20.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _await_node(environment: dict[str, str]) -> None:
    deadline = time.monotonic() + PATIENCE
    while "idle" not in (said := command(environment, "sinfo", "--noheader", "--format=%T")):
        if time.monotonic() > deadline:
            raise RuntimeError(f"the node was not ready in {PATIENCE:g} s: {said.strip() or 'no answer'}")
        time.sleep(0.2)


def _program(name: str) -> str | None:
    return shutil.which(name, path=f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin")


def _free_ports() -> tuple[int, int]:
    with socket.socket() as first, socket.socket() as second:
        for each in (first, second):
            each.bind(("", 0))
        return first.getsockname()[1], second.getsockname()[1]

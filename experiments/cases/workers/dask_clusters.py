"""Clusters that are started for a run; their connections are encrypted, with keys made for them."""

from __future__ import annotations

import itertools
import logging
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.studyfile.cluster_section import ClusterSection

if TYPE_CHECKING:
    from dask_jobqueue import JobQueueCluster
    from distributed import SpecCluster

SYSTEMS = {
    "slurm": "SLURMCluster",
    "pbs": "PBSCluster",
    "lsf": "LSFCluster",
    "sge": "SGECluster",
    "oar": "OARCluster",
    "htcondor": "HTCondorCluster",
}
"""Classes of dask-jobqueue by the kinds of `ClusterSection`."""


def start_processes(gpus: list[str], count: int) -> SpecCluster:
    """Start so many workers on this machine: dealt out to GPUs, each sees one, or without them sees none."""
    from distributed import Nanny, Scheduler, Security, SpecCluster

    common = {"host": "127.0.0.1", "protocol": "tls://", "security": Security.temporary()}
    common |= {"dashboard": False}
    options = common | {"nthreads": 1, "memory_limit": 0, "silence_logs": logging.CRITICAL}
    workers = {
        number: {"cls": Nanny, "options": options | {"env": {"CUDA_VISIBLE_DEVICES": seen}}}
        for number, seen in zip(range(count), itertools.cycle(visible(gpus) or [""]), strict=False)
    }
    scheduler = {"cls": Scheduler, "options": common}
    return SpecCluster(workers, scheduler, security=common["security"], silence_logs=logging.CRITICAL)


def visible(gpus: list[str]) -> list[str]:
    """Value of CUDA_VISIBLE_DEVICES for each GPU, where this process may see some only."""
    seen = [name for name in os.environ.get("CUDA_VISIBLE_DEVICES", "").split(",") if name]
    numbers = [int(name.removeprefix("cuda:")) for name in gpus]
    return [seen[number] if seen else str(number) for number in numbers]


def start_jobs(section: ClusterSection, count: int) -> JobQueueCluster:
    """Submit jobs that are workers; one that is ended while there is work is submitted again."""
    import dask_jobqueue
    from distributed import Security

    cluster = getattr(dask_jobqueue, SYSTEMS[section.kind])(
        **job_options(section), security=Security.temporary()
    )
    cluster.adapt(minimum=count, maximum=count)
    return cluster


def job_options(section: ClusterSection) -> dict[str, Any]:
    """Options of dask-jobqueue for jobs of a section; their folder is made."""
    from dask.utils import format_bytes, parse_bytes

    shared, each = Path(section.shared).expanduser(), section.workers_per_job
    shared.mkdir(parents=True, exist_ok=True, mode=0o700)
    directives = list(section.directives)
    if section.gpu and section.kind == "slurm" and not any("--g" in line for line in directives):
        directives.append(f"--gres=gpu:{each}")
    minutes, seconds = divmod(round(section.walltime), 60)
    walltime = f"{minutes // 60:02d}:{minutes % 60:02d}"
    options: dict[str, Any] = {
        "cores": each,
        "processes": each,
        "memory": format_bytes(parse_bytes(section.memory) * each),
        "job_extra_directives": directives,
        "job_script_prologue": list(section.prologue),
        "worker_extra_args": ["--memory-limit", "0", "--no-dashboard"],
        "log_directory": str(shared / "logs"),
        "shared_temp_directory": str(shared),
        "interface": section.interface,
        "python": section.python,
        "job_name": "dem-warp",
        "scheduler_options": {"dashboard": False, "dashboard_address": None},
    }
    own: dict[str, Any] = {}
    match section.kind:
        case "slurm" | "pbs":
            own = {"queue": section.queue, "account": section.account}
            own |= {"walltime": f"{walltime}:{seconds:02d}"}
        case "lsf":
            own = {"queue": section.queue, "project": section.account, "walltime": walltime}
        case "sge" | "oar":
            own = {"queue": section.queue, "project": section.account}
            own |= {"walltime": f"{walltime}:{seconds:02d}"}
    if section.kind == "slurm":
        own["job_cpu"] = each * section.cores
    return options | own

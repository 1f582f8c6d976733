"""Clusters that are started for a run, with encrypted connections."""

from __future__ import annotations

import itertools
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.cases.workers.submissions import (
    Submissions,
    cluster_class,
    noted_jobs,
    require_submit_command,
    submit_command,
)
from experiments.cases.workers.workers import WorkersLostError
from experiments.io.errors import InputError
from experiments.studyfile.cluster_section import ClusterSection

if TYPE_CHECKING:
    from dask_jobqueue import JobQueueCluster
    from distributed import SpecCluster

LOOK = 0.5
"""Time between two checks of a cluster whose jobs are being submitted [s]."""

_log = logging.getLogger(__name__)


def start_processes(gpus: list[str], count: int) -> SpecCluster:
    """Start `count` workers on this machine; each sees one of the GPUs, or no GPU if there are none."""
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
    """Return the value of CUDA_VISIBLE_DEVICES for each GPU; this process may see only some."""
    seen = [name for name in os.environ.get("CUDA_VISIBLE_DEVICES", "").split(",") if name]
    numbers = [int(name.removeprefix("cuda:")) for name in gpus]
    return [seen[number] if seen else str(number) for number in numbers]


@contextmanager
def submitted_jobs(section: ClusterSection, count: int) -> Iterator[tuple[JobQueueCluster, Submissions]]:
    """Submit jobs that are workers, and end them; a job that is ended during the work is submitted again.

    Raise InputError when the command that submits them is missing, or the batch system refuses all of them.
    """
    require_submit_command(section)
    from distributed import Security

    submissions = Submissions(count // section.workers_per_job)
    kind = cluster_class(section.kind)
    started = kind(
        **job_options(section),
        job_cls=noted_jobs(kind.job_cls, submissions, partial(_log.warning, "a job was refused: %s")),
        security=Security.temporary(),
    )
    with started as cluster:
        cluster.adapt(minimum=count, maximum=count)
        _await_an_answer(cluster, submissions)
        if refusal := submissions.refusal:
            problem = f"{submit_command(section.kind)} refuses the jobs: {refusal}"
            value = f"kind {section.kind}, queue {section.queue or 'default'}"
            raise InputError("cluster", problem, value)
        yield cluster, submissions


def _await_an_answer(cluster: JobQueueCluster, submissions: Submissions) -> None:
    """Wait until the batch system has taken a job or refused all."""
    from distributed import Status

    while not submissions.decided.wait(LOOK):
        if cluster.status != Status.running:
            raise WorkersLostError("the cluster ended before its jobs were submitted.")


def job_options(section: ClusterSection) -> dict[str, Any]:
    """Return the options of dask-jobqueue for the jobs of a section, and make their folder."""
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

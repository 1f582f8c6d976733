"""Resources that a person asks for, checked against the machine: devices, number of workers, its name."""

from __future__ import annotations

import platform
import re
from collections.abc import Sequence
from dataclasses import dataclass

import warp as wp

from dem_warp import Case
from dem_warp.cores import cores
from dem_warp.device import resolve_device
from experiments.cases.forecast.work import work_of
from experiments.cases.workers.batches import GPU_WORKERS, device_bytes, rounds_of
from experiments.io.errors import InputError
from experiments.studyfile.cluster_section import ClusterSection

_ADDRESS = re.compile(r"((tcp|tls|wss?|ucxx?)://)?([\w.-]+|\[[\da-fA-F:.]+(%[\w.-]+)?\]):(?P<port>\d{1,5})")
"""Address of a scheduler, as Dask takes it: a name or number of a host, and a port."""

PROCESS_BYTES = 450e6
"""Memory of a process that simulates or measures [bytes]."""

MOST_PER_CORE = 8
"""Processes a core of this machine; more gain nothing."""


@dataclass(frozen=True)
class Resources:
    """Workers that a person asks for; default: this machine's own."""

    device: str | None = None
    """``"cpu"``, ``"cuda"``, ``"cuda:1"``, or several GPUs between commas; None: the GPU if there is one."""
    workers: int | None = None
    """Processes on the CPU, GPUs, or workers of a cluster elsewhere; None: one a core, one GPU, its own."""
    scheduler: str | None = None
    """Address of a Dask scheduler whose workers are used."""
    cluster: ClusterSection | None = None
    """Workers that are started for the run."""
    gpu_workers: int | None = None
    """Processes a GPU of this machine; None: `GPU_WORKERS`, or this process for one GPU without a cluster."""

    def __post_init__(self) -> None:
        """Refuse what cannot be an address; Dask finds it late, with a traceback."""
        found = _ADDRESS.fullmatch(self.scheduler or "")
        if self.scheduler is not None and not (found and 0 < int(found["port"]) < 65536):
            hint = "An example is tcp://HOST:8786."
            raise InputError("--scheduler", "must be the address of a Dask scheduler", self.scheduler, hint)

    @property
    def is_cluster(self) -> bool:
        """True if the workers are those of a cluster."""
        return self.scheduler is not None or self.cluster is not None

    @property
    def submits_jobs(self) -> bool:
        """True if the workers are jobs of a batch system."""
        return self.scheduler is None and self.cluster is not None and self.cluster.kind != "local"

    @property
    def gpus(self) -> list[str]:
        """Names of the GPUs of this machine that are used; empty: the CPU.

        Raise InputError when a device is missing, or more GPUs are asked for than there are.
        """
        if self.cluster is not None and self.cluster.gpu is False:
            return []
        devices = resolve_devices(self.device)
        if devices == ["cpu"]:
            if self.cluster is not None and self.cluster.gpu:
                raise InputError("cluster.gpu", "this machine has no GPU")
            return []
        there = devices if self.device else [gpu.alias for gpu in wp.get_cuda_devices()]
        wanted = self.workers or (self.cluster.workers or len(there) if self.cluster else len(devices))
        if wanted > len(there):
            hint = "With --device cpu it counts processes."
            raise InputError("--workers", f"must be at most the {len(there)} GPUs", wanted, hint)
        return there[:wanted]

    @property
    def sharing(self) -> int:
        """Workers of a GPU, as far as is known before they start; workers of a job have one each."""
        if self.scheduler is not None or self.submits_jobs or not self.gpus:
            return 1
        alone = self.cluster is None and len(self.gpus) == 1
        return self.gpu_workers or (1 if alone else GPU_WORKERS)

    @property
    def count(self) -> int:
        """Number of workers, as far as is known before they start.

        Raise InputError when a device is missing, more processes are asked for than this machine's cores can
        serve, or a job would not be filled.
        """
        asked = self.workers or (self.cluster.workers if self.cluster else None)
        if self.scheduler is not None:
            return asked or 1
        if self.submits_jobs and self.cluster is not None:
            each = self.cluster.workers_per_job
            # Dask would end the surplus with all of its job, and submit that job again, for ever
            if (asked or each) % each:
                raise InputError(self._place_of_workers, f"must fill whole jobs of {each} workers", asked)
            return asked or each
        if self.gpus:
            return len(self.gpus) * self.sharing
        here = cores()
        if asked and asked > MOST_PER_CORE * here:
            problem = f"must be at most {MOST_PER_CORE} processes a core, {MOST_PER_CORE * here} here"
            raise InputError(self._place_of_workers, problem, asked)
        return asked or here

    def memory(self, cases: Sequence[Case], most: int) -> float:
        """Predict the memory of this machine, or of each GPU, for at most `most` such cases [bytes]."""
        if not cases:
            return 0.0
        largest = max(cases, key=lambda case: work_of(case).spheres)
        each = device_bytes(largest)
        if not self.on_gpu:
            return (each + PROCESS_BYTES) * min(self.count, most) + PROCESS_BYTES
        rounds = rounds_of(most, most * work_of(largest).grains, self.count, sharing=self.sharing)
        return each * self.sharing * -(-most // (self.count * rounds))

    @property
    def _place_of_workers(self) -> str:
        return "--workers" if self.workers else "cluster.workers"

    @property
    def on_gpu(self) -> bool:
        """True if the workers have GPUs, as far as is known before they start."""
        if self.submits_jobs:
            return bool(self.cluster and self.cluster.gpu)
        return self.scheduler is None and bool(self.gpus)

    @property
    def machine(self) -> str:
        """Name under which their speed is stored."""
        if self.scheduler is not None:
            return f"workers of {self.scheduler}"
        if self.submits_jobs and self.cluster is not None:
            what = "GPU" if self.on_gpu else "CPU"
            return f"{self.cluster.kind}, queue {self.cluster.queue or 'default'}, {what}"
        return str(wp.get_device(self.gpus[0]).name) if self.gpus else cpu_name(self.count)

    def __str__(self) -> str:
        """Name the place where cases are simulated."""
        number = f"{self.count} {'worker' if self.count == 1 else 'workers'}"
        if self.scheduler is not None:
            return f"the workers of {self.scheduler}"
        if self.submits_jobs and self.cluster is not None:
            return f"{number} of {self.cluster.kind}"
        each = f", {self.sharing} workers each" if self.sharing > 1 else ""
        return ",".join(self.gpus) + each or (f"cpu, {number}" if self.cluster else "cpu")


def cpu_name(workers: int) -> str:
    """Return the name of this machine's CPU with a number of workers."""
    return f"{platform.node()}, CPU, {workers} {'worker' if workers == 1 else 'workers'}"


def resolve_devices(names: str | None) -> list[str]:
    """Return the devices to run on: those asked for, e.g. ``"cuda:0,cuda:1"``, or the engine's choice.

    Raise InputError when one is missing or named twice, or the CPU is combined with a GPU.
    """
    asked = [None] if names is None else [name.strip() for name in names.split(",")]
    try:
        found = [resolve_device(name) for name in asked]
    except ValueError as error:
        raise InputError("--device", str(error), names) from None
    if len(set(found)) < len(found):
        raise InputError("--device", "must name each device once", names)
    if len(found) > 1 and "cpu" in found:
        raise InputError("--device", "must be the CPU alone or GPUs only", names)
    return found

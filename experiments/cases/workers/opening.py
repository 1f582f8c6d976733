"""Workers that are ready, from what a person asks for."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from importlib.util import find_spec
from typing import TYPE_CHECKING

from dem_warp import Processes
from experiments.cases.workers.own import OwnWorkers
from experiments.cases.workers.resources import Resources
from experiments.cases.workers.workers import Workers
from experiments.io.errors import InputError
from experiments.studyfile.cluster_section import ClusterSection

if TYPE_CHECKING:
    from distributed import Client

EXTRA = "pip install 'dem-warp[cluster]'"
"""Command that installs what a cluster needs."""

ANSWER = 15.0
"""Time in which a scheduler must answer [s]."""

SETTINGS = {
    # batch systems end jobs many times in a campaign; a batch whose worker is lost goes to another one
    "distributed.scheduler.allowed-failures": 10,
    "distributed.worker.multiprocessing-method": "spawn",
    # Dask's monitors, up to a hundred calls a second, take 5 % of the time of cores that all simulate
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "10s",
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "10s",
}
"""Settings of the clusters that are started here."""


@contextmanager
def open_workers(resources: Resources) -> Iterator[Workers]:
    """Make workers ready; what was started for them ends with the block.

    Raise InputError when a device is missing, Dask is needed and not installed, a scheduler does not answer,
    or a batch system is missing or refuses all jobs.
    """
    gpus = [] if resources.is_cluster else resources.gpus
    if not resources.is_cluster and len(gpus) * resources.sharing < 2:
        own = OwnWorkers(gpus[0] if gpus else "cpu", None if gpus else resources.workers)
        with Processes(own.count) as processes:
            yield replace(own, processes=processes)
        return
    require_dask()
    import dask
    import distributed

    with ExitStack() as stack, dask.config.set(SETTINGS), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name in (distributed.__name__, distributed.client.__name__):  # each has a level of its own
            logging.getLogger(name).setLevel(logging.CRITICAL)
        yield _opened(resources, stack)


def require_dask() -> None:
    """Raise InputError with the command that installs Dask, if it is missing."""
    if missing := missing_libraries():
        problem = f"several workers need Dask; not installed: {', '.join(missing)}"
        raise InputError("workers", problem, hint=f"Install it: {EXTRA}")


def missing_libraries() -> list[str]:
    """Return the libraries that clusters need and that are not installed."""
    needed = ("distributed", "dask_jobqueue", "cryptography")
    return [name for name in needed if find_spec(name) is None]


def _opened(resources: Resources, stack: ExitStack) -> Workers:
    from distributed import Client

    from experiments.cases.workers.dask_clusters import start_processes, submitted_jobs
    from experiments.cases.workers.dask_workers import DaskWorkers

    described = {"device": str(resources)}
    if resources.scheduler is not None:
        client = stack.enter_context(_connected(resources.scheduler))
        return DaskWorkers(client, described, resources.machine, resources.workers)
    section = resources.cluster or ClusterSection()
    submissions = None
    if resources.submits_jobs:
        cluster, submissions = stack.enter_context(submitted_jobs(section, resources.count))
    else:
        cluster = stack.enter_context(start_processes(resources.gpus, resources.count))
    client = stack.enter_context(Client(cluster, set_as_default=False))
    return DaskWorkers(client, described, resources.machine, resources.count, submissions)


def _connected(address: str) -> Client:
    from distributed import Client

    try:
        return Client(address, timeout=ANSWER, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        problem = f"must be the address of a Dask scheduler that answers ({type(error).__name__})"
        raise InputError("--scheduler", problem, address, "An example is tcp://HOST:8786.") from None

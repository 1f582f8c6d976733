"""From what a person asks for to workers that are ready."""

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
    # A batch whose worker is lost goes to another one, and batch systems end jobs many times in a campaign.
    "distributed.scheduler.allowed-failures": 10,
    "distributed.worker.multiprocessing-method": "spawn",
    # Looks of Dask at itself, up to a hundred a second, take 5 % of the time of cores that all simulate.
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "10s",
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "10s",
}
"""Settings of the clusters that are started here."""


@contextmanager
def open_workers(resources: Resources) -> Iterator[Workers]:
    """Make workers ready, and end what was started for them when the block ends.

    Raises
    ------
    InputError
        When a device is not there, Dask is needed and is not installed, a scheduler does not answer, or a
        batch system is not here or refuses all jobs.
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
    """Refuse what needs Dask where it is not installed.

    Raises
    ------
    InputError
        With the command that installs it.
    """
    if missing := missing_libraries():
        names = ", ".join(missing)
        raise InputError("workers", f"several workers need Dask: {EXTRA}", f"not installed: {names}")


def missing_libraries() -> list[str]:
    """Name what clusters need and is not installed."""
    needed = ("distributed", "dask_jobqueue", "cryptography")
    return [name for name in needed if find_spec(name) is None]


def _opened(resources: Resources, stack: ExitStack) -> Workers:
    from distributed import Client

    from experiments.cases.workers.dask_clusters import start_processes, submitted_jobs
    from experiments.cases.workers.dask_workers import DaskWorkers

    told = {"device": str(resources)}
    if resources.scheduler is not None:
        client = stack.enter_context(_connected(resources.scheduler))
        return DaskWorkers(client, told, resources.machine, resources.workers)
    section = resources.cluster or ClusterSection()
    submissions = None
    if resources.submits_jobs:
        cluster, submissions = stack.enter_context(submitted_jobs(section, resources.count))
    else:
        cluster = stack.enter_context(start_processes(resources.gpus, resources.count))
    client = stack.enter_context(Client(cluster, set_as_default=False))
    return DaskWorkers(client, told, resources.machine, resources.count, submissions)


def _connected(address: str) -> Client:
    from distributed import Client

    try:
        return Client(address, timeout=ANSWER, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        rule = "must be the address of a Dask scheduler that answers, as tcp://HOST:8786"
        raise InputError("--scheduler", f"expected {rule} ({type(error).__name__})", address) from None

"""Submissions of jobs that are workers: the command, and the answers of the batch system."""

from __future__ import annotations

import re
import shlex
import shutil
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from experiments.io.errors import InputError
from experiments.studyfile.cluster_section import ClusterSection

SYSTEMS = {
    "slurm": "SLURMCluster",
    "pbs": "PBSCluster",
    "lsf": "LSFCluster",
    "sge": "SGECluster",
    "oar": "OARCluster",
    "htcondor": "HTCondorCluster",
}
"""Classes of dask-jobqueue by the kinds of `ClusterSection`."""

_SAID = re.compile(r"\nstdout:\n(.*)\nstderr:\n(.*)", re.DOTALL)
"""Output of a command, in dask-jobqueue's error about its exit code."""


def cluster_class(kind: str) -> Any:
    """Return the class of dask-jobqueue for a kind of `ClusterSection`."""
    with _ctrl_c_kept():
        import dask_jobqueue

    return getattr(dask_jobqueue, SYSTEMS[kind])


@contextmanager
def _ctrl_c_kept() -> Iterator[None]:
    """Keep the handler of Ctrl-C: loading dask-jobqueue installs one that exits with code 0."""
    before = signal.getsignal(signal.SIGINT)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def submit_command(kind: str) -> str:
    """Return the name of the program that submits jobs of a kind."""
    return shlex.split(cluster_class(kind).job_cls.submit_command)[0]


def require_submit_command(section: ClusterSection) -> None:
    """Raise InputError if the command that submits jobs is missing."""
    command = submit_command(section.kind)
    if shutil.which(command) is None:
        problem = f"needs the command {command}, which is not on the PATH"
        raise InputError("cluster.kind", problem, section.kind, "Run this where jobs are submitted.")


def message_of(error: Exception) -> str:
    """Return the message of a batch system about a job that it refused, on one line."""
    said = _SAID.search(str(error))
    printed, complained = said.groups() if said else ("", "")
    words = complained.strip() or printed.strip() or str(error) or type(error).__name__
    return " ".join(words.split())


class Submissions:
    """Fate of the jobs that were submitted: threads of Dask note it, and the run reads it.

    Parameters
    ----------
    jobs
        Jobs that are wanted.
    """

    def __init__(self, jobs: int) -> None:
        self._jobs, self._lock = jobs, threading.Lock()
        self._taken: set[str] = set()
        self._refused: dict[str, str] = {}
        self.decided = threading.Event()
        """Set once a job was taken or all were refused."""

    @property
    def refusal(self) -> str | None:
        """Message of the batch system if it refused all jobs and no accepted one is left, else None.

        A job that waits in the queue counts as taken.
        """
        with self._lock:
            if self._taken or len(self._refused) < self._jobs:
                return None
            return next(reversed(self._refused.values()))

    def take(self, name: str) -> None:
        """Note that a job is in the queue."""
        with self._lock:
            self._refused.pop(name, None)
            self._taken.add(name)
        self.decided.set()

    def refuse(self, name: str, error: Exception) -> str:
        """Note that a job was refused, and return the message."""
        words = message_of(error)  # the error itself would keep its job alive, which Dask then misses
        with self._lock:
            self._refused[name] = words
        if self.refusal is not None:
            self.decided.set()
        return words

    def end(self, name: str) -> None:
        """Note that a job has ended."""
        with self._lock:
            self._taken.discard(name)


def noted_jobs(job_class: Any, submissions: Submissions, warn: Any) -> Any:
    """Return a class of jobs whose refusals are noted; Dask would print a traceback and continue.

    `warn` is called with the message about a job that is refused while others are accepted.
    """
    from distributed import Status

    class NotedJob(job_class):
        async def start(self) -> None:
            try:
                await super().start()
            except Exception as error:
                words = submissions.refuse(str(self.name), error)
                if submissions.refusal is None:
                    warn(words)
                self.status = Status.running  # Dask expects this of a start
            else:
                submissions.take(str(self.name))

        async def close(self) -> None:
            submissions.end(str(self.name))
            await super().close()

    return NotedJob

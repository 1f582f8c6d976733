"""Submissions of jobs that are workers: whether their command is there, and what the batch system says."""

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
"""Words of a command, in the error that dask-jobqueue makes of its exit code."""


def cluster_class(kind: str) -> Any:
    """Class of dask-jobqueue for a kind of `ClusterSection`."""
    with _ctrl_c_kept():
        import dask_jobqueue

    return getattr(dask_jobqueue, SYSTEMS[kind])


@contextmanager
def _ctrl_c_kept() -> Iterator[None]:
    """Keep what Ctrl-C does: as dask-jobqueue is loaded, it lets it end Python with the exit code 0."""
    before = signal.getsignal(signal.SIGINT)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def submit_command(kind: str) -> str:
    """Name of the program that submits jobs of a kind."""
    return shlex.split(cluster_class(kind).job_cls.submit_command)[0]


def require_submit_command(section: ClusterSection) -> None:
    """Refuse a batch system whose command to submit jobs is not here.

    Raises
    ------
    InputError
        With the name of the command.
    """
    command = submit_command(section.kind)
    if shutil.which(command) is None:
        rule = f"needs the command {command}, which is not on the PATH: run this where jobs are submitted"
        raise InputError("cluster.kind", rule, section.kind)


def words_of(error: Exception) -> str:
    """Words of a batch system about a job that it refused, on one line."""
    said = _SAID.search(str(error))
    printed, complained = said.groups() if said else ("", "")
    words = complained.strip() or printed.strip() or str(error) or type(error).__name__
    return " ".join(words.split())


class Submissions:
    """Fate of the jobs that were submitted: threads of Dask note it, and the run looks.

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
        """Words of the batch system where it refused all jobs and none that it took is left, else None.

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
        """Note that a job was refused, and return what was said."""
        words = words_of(error)  # the error itself would keep its job alive, which Dask then misses
        with self._lock:
            self._refused[name] = words
        if self.refusal is not None:
            self.decided.set()
        return words

    def end(self, name: str) -> None:
        """Note that a job is gone."""
        with self._lock:
            self._taken.discard(name)


def noted_jobs(job_class: Any, submissions: Submissions, warn: Any) -> Any:
    """Class of jobs whose submissions are noted instead of raised: Dask would print a traceback and go on.

    Parameters
    ----------
    job_class
        Class of dask-jobqueue.
    submissions
        Taker of the notes.
    warn
        Called with what is said of a job that is refused while others are there.
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
                self.status = Status.running  # Dask asks for this of a start; without an id, nothing is there
            else:
                submissions.take(str(self.name))

        async def close(self) -> None:
            submissions.end(str(self.name))
            await super().close()

    return NotedJob

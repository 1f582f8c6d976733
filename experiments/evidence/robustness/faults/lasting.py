"""Processes that last while others are killed: one that runs command after command, and a Dask cluster."""

from __future__ import annotations

import os
import signal
import socket
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path

from experiments.evidence.robustness.faults.attempt import Attempt, Command, end_with_starter, exit_code

PATIENCE = 60.0
"""Time in which a scheduler must listen [s]."""


@dataclass(frozen=True)
class Size:
    """Size of a process."""

    process: str
    """Its part."""
    born: int
    """Its number in the system: another one is another process."""
    megabytes: float
    """Memory that it holds [MB]."""
    files: int
    """Files, pipes and connections that it has open."""
    threads: int


def size_of(part: str, process: int) -> Size:
    """Measure a process.

    Raises
    ------
    OSError
        When there is none.
    """
    told = Path(f"/proc/{process}/status").read_text(encoding="ascii", errors="replace")
    facts = dict(line.split(":", 1) for line in told.splitlines())
    files = len(os.listdir(f"/proc/{process}/fd"))
    return Size(part, process, int(facts["VmRSS"].split()[0]) / 1e3, files, int(facts["Threads"]))


class Resident:
    """A process that runs one command after another, as a script or a notebook does."""

    def __init__(self) -> None:
        self._line, theirs = Pipe()
        self.process = os.fork()
        if self.process == 0:
            end_with_starter()
            self._line.close()
            _serve(theirs)
        theirs.close()

    def run(self, arguments: Sequence[str], said: Path) -> Command:
        """Begin a command; the one before must have ended."""
        self._line.send((list(arguments), said))
        return _Ordered(self.process, said, self._line)

    def sizes(self) -> list[Size]:
        """Size of the process."""
        return [size_of("one process, command after command", self.process)]

    def end(self) -> None:
        """End the process."""
        self._line.close()
        os.waitpid(self.process, 0)


class _Ordered(Command):
    """A command that a `Resident` runs."""

    def __init__(self, process: int, said: Path, line: Connection) -> None:
        super().__init__(process, said)
        self._line = line

    def _look(self) -> int | None:
        try:
            return int(self._line.recv()) if self._line.poll() else None
        except EOFError:
            return -signal.SIGKILL


def _serve(line: Connection) -> None:
    """Run the commands that come by a line until it ends, and this process with it."""
    try:
        while True:
            arguments, said = line.recv()
            line.send(exit_code(arguments, said))
    except EOFError:
        os._exit(0)


class Cluster:
    """A scheduler of Dask and one worker, as a person starts them.

    Parameters
    ----------
    part
        Its name.
    folder
        Folder of what its processes say.
    """

    def __init__(self, part: str, folder: Path) -> None:
        self._part, self._folder, self._number = part, folder, 0
        self._port = _free_port()
        self.address = f"tcp://127.0.0.1:{self._port}"
        self.restart()

    def restart(self) -> None:
        """Start the scheduler at its address, and a worker; what is left of older ones is killed."""
        self.end()
        here = ["--host", "127.0.0.1", "--port", str(self._port), "--no-dashboard"]
        self.scheduler = self._begun(here, _scheduler)
        end = time.monotonic() + PATIENCE
        while not _listens(self._port):
            if time.monotonic() > end or self.scheduler.has_ended():
                raise RuntimeError(f"no scheduler listens at {self.address}")
            time.sleep(0.05)
        self.replace_worker()

    def replace_worker(self) -> None:
        """Start a worker, as a batch system does when a job of its was lost."""
        if (last := getattr(self, "worker", None)) is not None:
            last.wait()
        alone = ["--nthreads", "1", "--no-nanny", "--memory-limit", "0", "--no-dashboard"]
        self.worker = self._begun([self.address, *alone], _worker)

    def sizes(self) -> list[Size]:
        """Sizes of both processes."""
        pairs = (("scheduler", self.scheduler), ("worker", self.worker))
        return [size_of(f"{name} of {self._part}", each.process) for name, each in pairs]

    def end(self) -> None:
        """Kill both processes."""
        for each in (getattr(self, name, None) for name in ("worker", "scheduler")):
            if each is not None and not each.has_ended():
                each.kill()
                each.wait()

    def _begun(self, arguments: Sequence[str], command: Callable[[], object]) -> Attempt:
        self._number += 1
        return Attempt(arguments, self._folder / f"{self._part}-{self._number % 4}.txt", command)


def _scheduler() -> None:
    from distributed.cli.dask_scheduler import main

    main()


def _worker() -> None:
    from distributed.cli.dask_worker import main

    main()


def _free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def _listens(port: int) -> bool:
    with socket.socket() as caller:
        return caller.connect_ex(("127.0.0.1", port)) == 0

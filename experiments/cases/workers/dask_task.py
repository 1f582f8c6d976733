"""The task of a Dask worker: a batch of cases, each result sent to the client as it ends."""

from __future__ import annotations

import pickle
import tempfile
import threading
import time
import uuid
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import warp as wp
from filelock import FileLock, Timeout

from dem_warp import Case, CaseResult, Progress
from dem_warp.device import resolve_device
from dem_warp.provenance import engine_fingerprint
from experiments.cases.engines.engine import Engine
from experiments.cases.workers.own import OwnWorkers
from experiments.cases.workers.send_queue import SendQueue
from experiments.io.errors import InputError

PATIENCE = 120.0
"""Time that a worker waits for an answer before it gives up on the client [s]."""

REPORT_EVERY = 2.0
"""Time between two reports of a worker [s]."""

_one_at_a_time = threading.Lock()
"""Warp is driven by one thread of a process."""

_claiming = threading.Lock()

_own: list[tuple[str, FileLock | None]] = []
"""Device of this process, and the lock on it."""


class GoneError(Exception):
    """The client does not wait for the batch any more."""


@dataclass(frozen=True)
class Order:
    """A batch of cases."""

    channel: str
    """Name of the queue that the client listens to."""
    number: int
    """Number of the batch."""
    cases: tuple[Case, ...]
    engine: Engine | None
    """Engine that simulates; None: dem-warp's own."""
    checkpoint: str | None
    """Folder of checkpoints; one that this machine does not see is not used."""
    fingerprint: str
    """Fingerprint of the client's engine, which must be the worker's."""


@dataclass(frozen=True)
class Message:
    """Message of a worker about a batch."""

    number: int
    reply: str = ""
    """Name of the queue for the answer, the places of the cases still wanted; sent at the beginning."""
    index: int = 0
    result: CaseResult | None = None
    """After a case has ended: its place in the batch, and its result."""
    progress: Progress | None = None
    """Progress of the cases that were wanted."""


def simulate_batch(order: Order) -> None:
    """Simulate the cases of a batch that the client still wants, and send each result as it ends.

    Raises
    ------
    InputError
        When this worker has another version of dem-warp.
    GoneError
        When the client is gone.
    """
    from distributed import Queue, get_worker

    if fingerprint_of(order.cases) != order.fingerprint:
        problem = "each worker must have the dem-warp of this machine"
        raise InputError("the cluster", problem, f"another version on {get_worker().address}")
    with _one_at_a_time:
        client = _ToClient(order, Queue(order.channel), get_worker())
        wanted = client.ask()
        folder = order.checkpoint
        with client.outgoing:
            OwnWorkers(own_device(), 1, notes_speed=False).simulate(
                [order.cases[index] for index in wanted],
                order.engine,
                lambda number, result: client.send(index=wanted[number], result=result),
                client.report,
                folder if folder and Path(folder).is_dir() else None,
            )


def fingerprint_of(cases: Sequence[Case]) -> str:
    """Fingerprint of all code that simulates some cases."""
    return engine_fingerprint(*dict.fromkeys(kind for case in cases for kind in case.kinds))


class _ToClient:
    """Messages from a worker to the client.

    The scheduler takes some milliseconds for a message, in which a GPU would idle: a queue sends them while
    the simulation continues.
    """

    def __init__(self, order: Order, queue: Any, worker: Any) -> None:
        self._order, self._queue, self._worker = order, queue, worker
        self._task = worker.get_current_task()
        self._reported = time.monotonic()
        self.outgoing = SendQueue(self._put)

    def ask(self) -> list[int]:
        """Ask which cases are wanted: another worker may have sent some before it was lost."""
        from distributed import Queue

        reply = Queue(f"{self._order.channel}-{uuid.uuid4().hex}")
        try:
            self._put([Message(self._order.number, reply=reply.name)])
            return list(reply.get(timeout=PATIENCE))
        except TimeoutError:
            raise GoneError("the client gave no answer") from None
        finally:
            reply.close()

    def send(self, **content: Any) -> None:
        """Put a message into the queue; raise GoneError if the batch was cancelled."""
        task = self._worker.state.tasks.get(self._task)
        if task is None or task.state == "cancelled":
            raise GoneError("the batch was cancelled")
        self.outgoing.put(Message(self._order.number, **content))

    def _put(self, messages: list[Message]) -> None:
        """Send messages as one, and wait until the scheduler has them."""
        self._queue.put(pickle.dumps(messages))

    def report(self, progress: Progress) -> None:
        """Send the progress of the batch, if the last report is old enough."""
        if time.monotonic() - self._reported >= REPORT_EVERY:
            self._reported = time.monotonic()
            self.send(progress=progress)


def own_device() -> str:
    """Return the device of this process: a GPU that no other worker of this machine has, or the CPU."""
    with _claiming:
        if not _own:
            resolve_device(None)
            _own.append(_claimed((device.alias, str(device.uuid)) for device in wp.get_cuda_devices()))
        return _own[0][0]


def _claimed(gpus: Iterable[tuple[str, str]]) -> tuple[str, FileLock | None]:
    """Lock the first GPU that is free; if all are taken, the first is shared."""
    names = []
    for name, identity in gpus:
        names.append(name)
        lock = FileLock(Path(tempfile.gettempdir()) / f"dem-warp-{identity}.lock", timeout=0)
        try:
            lock.acquire()
        except (Timeout, OSError):
            continue
        return name, lock
    return (names[0] if names else "cpu"), None


def describe_worker() -> dict[str, Any]:
    """Describe the device of this worker: a GPU, which others may share, with its free memory [bytes]."""
    name = own_device()
    on_gpu = name != "cpu"
    device = wp.get_device(name)
    return {
        "on_gpu": on_gpu,
        "device": str(device.name) if on_gpu else "CPU",
        "identity": str(device.uuid) if on_gpu else None,
        "memory": float(device.free_memory) if on_gpu else None,
    }

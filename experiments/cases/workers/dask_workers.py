"""Workers of Dask: batches of cases as tasks, results stored here as they end, lost batches repeated."""

from __future__ import annotations

import logging
import pickle
import uuid
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from dem_warp import Case, CaseResult
from dem_warp.cores import cores
from dem_warp.result import OnProgress, OnResult
from experiments.cases.engines.engine import Engine
from experiments.cases.forecast.speed import expected_seconds, note_batch
from experiments.cases.workers.batches import plan_batches
from experiments.cases.workers.call_results import CallResults
from experiments.cases.workers.dask_task import (
    Message,
    Order,
    describe_worker,
    fingerprint_of,
    simulate_batch,
)
from experiments.cases.workers.submissions import Submissions
from experiments.cases.workers.workers import WorkersLostError
from experiments.io.errors import InputError

if TYPE_CHECKING:
    from distributed import Client, Future

LISTEN = 0.5
"""Time between two checks of the batches [s]."""

AHEAD = 4
"""Batches a worker that the scheduler holds at once; the others wait here and take no memory of it."""

GONE = "the connection to the scheduler was lost: check that it is still running."
"""Message about a scheduler that does not answer any more."""

_log = logging.getLogger(__name__)


@contextmanager
def _lost_scheduler() -> Iterator[None]:
    """Turn Dask's connection error into WorkersLostError."""
    from distributed.comm import CommClosedError

    try:
        yield
    except CommClosedError as error:
        raise WorkersLostError(GONE) from error


class DaskWorkers:
    """Workers of a Dask cluster, one thread each: one or several a GPU, or one a core.

    Parameters
    ----------
    client
        Connection to the scheduler.
    described
        Name of the cluster for the provenance of results.
    machine
        Name under which its speed is stored.
    expected : int, optional
        Workers that were asked for; default: those that are connected.
    submissions : Submissions, optional
        Fate of the jobs that are the workers.
    """

    def __init__(
        self,
        client: Client,
        described: dict[str, Any],
        machine: str,
        expected: int | None = None,
        submissions: Submissions | None = None,
    ) -> None:
        self._client, self._described, self._expected = client, described, expected
        self.machine, self._submissions = machine, submissions

    @property
    def count(self) -> int:
        """Workers that were asked for, or are connected."""
        return self._expected or max(len(self._connected()), 1)

    @property
    def on_gpu(self) -> bool:
        """True if the workers have GPUs."""
        return self._shares() is not None

    @property
    def sharing(self) -> int:
        """Most workers of a GPU; 1 on CPUs."""
        shares = self._shares()
        return 1 if shares is None else shares.workers

    @property
    def helpers(self) -> int:
        """Cores of the machine of the client."""
        return cores()

    @property
    def leaves_cores(self) -> bool:
        """True if the cores of this machine are free for measuring: yes."""
        return True

    @property
    def described(self) -> dict[str, Any]:
        """Kind, place and number of the workers."""
        return self._described | {"workers": self.count}

    @_lost_scheduler()
    def simulate(
        self,
        cases: Sequence[Case],
        engine: Engine | None = None,
        on_result: OnResult | None = None,
        on_progress: OnProgress | None = None,
        checkpoint: str | Path | None = None,
    ) -> list[CaseResult]:
        """Simulate cases, as `Workers.simulate` does.

        Checkpoints need a folder that the workers see under the same name.
        """
        if not cases:
            return []
        self._await_workers()
        expected = None if engine else expected_seconds(cases, self)
        results = CallResults(cases, on_result, on_progress, expected, self.count)
        shares = self._shares() if engine is None else None
        batches = plan_batches(cases, results.costs, self.count, *(shares or ()))
        if checkpoint is not None:
            Path(checkpoint).mkdir(parents=True, exist_ok=True)
        folder = None if checkpoint is None else str(Path(checkpoint).resolve())
        session = _Session(self._client, results, cases, engine, folder, self._submissions)
        try:
            session.run(batches, AHEAD * self.count)
        finally:
            session.close()
        if engine is None:
            note_batch(cases, self, *results.pace)
        return results.in_order()

    def _connected(self) -> dict[str, Any]:
        """Return what is known of the connected workers, by their addresses."""
        found = self._client.scheduler_info(n_workers=-1)
        if "workers" not in found:
            raise WorkersLostError(GONE)
        return dict(found["workers"])

    def _await_workers(self) -> None:
        """Wait for the first worker, and check that each has one thread."""
        if not self._connected():
            _log.warning("waiting for the first worker of the cluster")
        while not self._connected():  # jobs wait in a queue for as long as it takes
            _require_jobs(self._submissions)
            with suppress(TimeoutError):
                self._client.wait_for_workers(1, timeout=LISTEN)
        for address, facts in self._connected().items():
            if facts["nthreads"] != 1:
                hint = "Start them with dask worker --nthreads 1 --nworkers N."
                found = f"{facts['nthreads']} threads of {address}"
                raise InputError("the cluster", "each worker must have one thread", found, hint)

    def _shares(self) -> _Shares | None:
        """Return the shares that the workers have of their GPUs; None if one has no GPU."""
        found = list(self._client.run(describe_worker, on_error="ignore").values())
        if not found or any(facts["memory"] is None for facts in found):
            return None
        sharing = Counter(facts["identity"] for facts in found)
        memory = min(facts["memory"] / sharing[facts["identity"]] for facts in found)
        return _Shares(memory, max(sharing.values()))


def _require_jobs(submissions: Submissions | None) -> None:
    """Refuse to wait for jobs when none is left and the batch system takes no more."""
    if submissions is not None and (refusal := submissions.refusal):
        raise WorkersLostError(f"the batch system refuses the jobs: {refusal}.")


class _Shares(NamedTuple):
    """Share of a GPU that each worker has."""

    memory: float
    """Its part of the free memory, the smallest of all [bytes]."""
    workers: int
    """Workers of a GPU, the most of all."""


@dataclass
class _Session:
    """Batches of a call that are simulated."""

    client: Client
    results: CallResults
    cases: Sequence[Case]
    engine: Engine | None
    checkpoint: str | None
    submissions: Submissions | None = None
    name: str = field(default_factory=lambda: f"dem-warp-{uuid.uuid4().hex}")
    batches: list[list[int]] = field(default_factory=list)
    running: dict[int, Future] = field(default_factory=dict)
    wanted: dict[int, list[int]] = field(default_factory=dict)
    """Cases of a batch that were wanted when a worker began it."""

    def __post_init__(self) -> None:
        from distributed import Queue

        self._queue = Queue(self.name, client=self.client)
        self._fingerprint = fingerprint_of(self.cases)

    def run(self, batches: list[list[int]], most: int) -> None:
        """Run batches in their order; the scheduler holds `most` of them at once."""
        pile = batches[::-1]
        while pile or self.running:
            while pile and len(self.running) < most:
                self._submit(pile.pop())
            if self.results.is_complete:
                self._await_ends()
            else:
                self._listen()
            pile += self._collect()

    def close(self) -> None:
        """Cancel what still runs."""
        self.client.cancel(list(self.running.values()), force=True)
        self._queue.close()

    def _submit(self, members: list[int]) -> None:
        number = len(self.batches)
        self.batches.append(members)
        chosen = tuple(self.cases[index] for index in members)
        order = Order(self.name, number, chosen, self.engine, self.checkpoint, self._fingerprint)
        self.running[number] = self.client.submit(
            simulate_batch, order, key=f"{self.name}-{number}", priority=-number, pure=False
        )

    def _listen(self) -> None:
        """Take the messages of the workers, after a wait for the first."""
        try:
            sent = self._queue.get(timeout=LISTEN)
        except TimeoutError:
            _require_jobs(self.submissions)
            self.results.report()
        else:
            self._take(sent)
        self._take_all()

    def _await_ends(self) -> None:
        """Wait for batches that have sent everything; one that runs again asks what is wanted."""
        from distributed import wait

        with suppress(TimeoutError), self.client.as_current():
            wait(list(self.running.values()), timeout=LISTEN)
        self._take_all()

    def _take_all(self) -> None:
        """Take all messages that have come."""
        for sent in self._queue.get(batch=True):
            self._take(sent)

    def _take(self, sent: bytes) -> None:
        """Take messages that a worker sent as one."""
        for message in pickle.loads(sent):
            self._take_message(message)

    def _take_message(self, message: Message) -> None:
        from distributed import Queue

        members = self.batches[message.number]
        if message.reply:
            places = [place for place, index in enumerate(members) if index not in self.results.results]
            if message.number in self.wanted:
                _log.warning("a worker was lost: %d of its cases go to another one", len(places))
            self.wanted[message.number] = [members[place] for place in places]
            Queue(message.reply, client=self.client).put(places)
        elif message.result is not None:
            self.results.take(members[message.index], message.result)
        elif message.progress is not None:
            self.results.follow(message.number, self.wanted[message.number], message.progress)

    def _collect(self) -> list[list[int]]:
        """Remove finished batches; return those that must run once more."""
        again = []
        ended = [(number, future) for number, future in self.running.items() if future.done()]
        if ended:  # they sent their last message before they ended
            self._take_all()
        for number, future in ended:
            del self.running[number]
            members = self.batches[number]
            left = self.results.left(members)
            if left:
                again += self._divided(left, future)
            self.results.end(number)
        return again

    def _divided(self, left: list[int], future: Future) -> list[list[int]]:
        """Return the halves of a batch that killed its workers; raise any other error."""
        from distributed import KilledWorker

        error = future.exception() if future.status == "error" else None
        if isinstance(error, KilledWorker) and len(left) > 1:
            half = (len(left) + 1) // 2
            return [left[half:], left[:half]]
        if isinstance(error, KilledWorker):
            raise WorkersLostError("a case killed its worker repeatedly; it may need more memory.")
        if error is not None:
            raise error
        raise WorkersLostError("the scheduler lost its tasks: check that it is still running.")

"""Messages of a worker leave while it simulates: it never waits, all arrive in order, and a client may go."""

import pickle
import threading
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import distributed
import pytest

from dem_warp import Case, Progress
from experiments.cases.engines.program import empty_result
from experiments.cases.workers import dask_task
from experiments.cases.workers.dask_task import GoneError, Message, Order, fingerprint_of, simulate_batch
from experiments.cases.workers.send_queue import MOST, SendQueue
from experiments.studyfile import Study

PATIENCE = 10.0
"""Time after which a test takes a thread for stuck [s]."""


class Sent:
    """Messages as they were sent, each as slow as the test wants."""

    def __init__(self) -> None:
        self.packs: list[list[Any]] = []
        self.begun, self.free = threading.Event(), threading.Event()

    def put(self, messages: list[Any]) -> None:
        self.begun.set()
        assert self.free.wait(PATIENCE), "who puts messages waited until they were sent"
        self.packs.append(messages)

    @property
    def all(self) -> list[Any]:
        return [message for pack in self.packs for message in pack]


def test_what_gathers_while_a_message_is_sent_leaves_as_one() -> None:
    sent = Sent()
    with SendQueue(sent.put) as queue:
        queue.put(0)
        assert sent.begun.wait(PATIENCE)
        for number in range(1, MOST + 5):
            queue.put(number)
        sent.free.set()
    assert sent.all == list(range(MOST + 5))
    assert [len(pack) for pack in sent.packs] == [1, MOST, 4]


@pytest.mark.parametrize("error", [None, RuntimeError])
def test_all_has_been_sent_when_the_block_ends_however_it_ends(error: type[Exception] | None) -> None:
    sent = Sent()
    sent.free.set()
    try:
        with SendQueue(sent.put) as queue:
            for number in range(3 * MOST):
                queue.put(number)
            if error:
                raise error
    except RuntimeError:
        pass
    assert sent.all == list(range(3 * MOST))


def test_an_error_of_the_sending_reaches_who_gives_or_ends_next() -> None:
    tried = threading.Event()

    def put(messages: list[int]) -> None:
        tried.set()
        raise OSError("no connection")

    def puts(queue: SendQueue[int], error: Exception | None = None) -> None:
        with queue:
            queue.put(1)
            assert tried.wait(PATIENCE)
            if error:
                raise error

    queue = SendQueue(put)
    with pytest.raises(OSError, match="no connection"):
        puts(queue)
    with pytest.raises(OSError, match="no connection"):
        queue.put(2)
    with pytest.raises(KeyError):
        puts(SendQueue(put), KeyError("the error of the block comes first"))


class Cluster:
    """A scheduler that takes no result before the simulation is over, and a worker of it."""

    def __init__(self) -> None:
        self.task = SimpleNamespace(state="executing")
        self.over = threading.Event()
        self.packs: list[list[Message]] = []

    def queue(self, name: str) -> SimpleNamespace:
        def answer(timeout: float) -> list[int]:
            return [0, 2, 3]

        return SimpleNamespace(name=name, put=self.take, get=answer, close=lambda: None)

    def worker(self) -> SimpleNamespace:
        state = SimpleNamespace(tasks={"batch": self.task})
        return SimpleNamespace(state=state, get_current_task=lambda: "batch", address="here")

    def take(self, said: bytes) -> None:
        messages = pickle.loads(said)
        if not messages[0].reply:
            assert self.over.wait(PATIENCE), "the simulation waited for the scheduler"
        self.packs.append(messages)


@pytest.fixture
def cluster(monkeypatch: pytest.MonkeyPatch) -> Iterator[Cluster]:
    made = Cluster()
    monkeypatch.setattr(distributed, "Queue", made.queue)
    monkeypatch.setattr(distributed, "get_worker", made.worker)
    monkeypatch.setattr(dask_task, "own_device", lambda: "cpu")
    yield made
    made.over.set()


class Engine:
    """Results at once; the client may take the batch back after the first."""

    def __init__(self, cluster: Cluster, taken_back: bool = False) -> None:
        self._cluster, self._taken_back = cluster, taken_back

    def __call__(self, cases: list[Case], on_result: Any, on_progress: Any, **_: Any) -> list[Any]:
        results = [empty_result("finished", "", {}) for _ in cases]
        for number, result in enumerate(results):
            on_result(number, result)
            on_progress(Progress(number + 1, len(cases), (number + 1) / len(cases), {}, 1.0))
            if self._taken_back:
                self._cluster.task.state = "cancelled"
        self._cluster.over.set()
        return results


def ordered(study: Study, engine: Engine) -> Order:
    cases = tuple(study.case({}, seed) for seed in range(4))
    return Order("channel", 7, cases, engine, None, fingerprint_of(cases))


def test_a_simulation_does_not_wait_for_the_scheduler_and_every_result_is_sent(
    small_study: Study, cluster: Cluster
) -> None:
    simulate_batch(ordered(small_study, Engine(cluster)))
    [asked], *packs = cluster.packs
    sent = [message for pack in packs for message in pack]
    assert asked.reply
    assert [message.index for message in sent] == [0, 2, 3], "those that were wanted, by their places"
    assert all(message.number == 7 and message.result is not None for message in sent)


def test_a_batch_that_was_taken_back_ends_with_the_next_result(small_study: Study, cluster: Cluster) -> None:
    engine = Engine(cluster, taken_back=True)
    cluster.over.set()
    with pytest.raises(GoneError, match="cancelled"):
        simulate_batch(ordered(small_study, engine))
    assert [message.index for pack in cluster.packs[1:] for message in pack] == [0]

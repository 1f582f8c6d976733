"""An outbox: messages that a thread of its own sends, so that a simulation never waits for who takes them."""

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import SimpleQueue
from types import TracebackType
from typing import Generic, TypeVar

MOST = 64
"""Messages that are sent as one at the most: results of large cases together stay a message of some MB."""

Word = TypeVar("Word")


class Outbox(Generic[Word]):
    """Messages on their way: those that gather while others are being sent leave together, in their order.

    As a context it sends what is left when the block ends, however that ends; only then it lets go.

    Parameters
    ----------
    put
        Sends some messages; it may take its time. Once it has raised, nothing more is sent, and whoever
        gives or ends next has its error.
    """

    def __init__(self, put: Callable[[list[Word]], None]) -> None:
        self._put = put
        self._waiting: SimpleQueue[Word | None] = SimpleQueue()
        self._fault: BaseException | None = None
        self._thread = threading.Thread(target=self._send, daemon=True)

    def give(self, message: Word) -> None:
        """Leave a message to be sent."""
        if self._fault is not None:
            raise self._fault
        self._waiting.put(message)

    def __enter__(self) -> Outbox[Word]:
        """Begin to send."""
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Send what is left; an error of the block comes before one of the sending."""
        self._waiting.put(None)
        self._thread.join()
        if self._fault is not None and error is None:
            raise self._fault

    def _send(self) -> None:
        try:
            while gathered := self._gathered():
                self._put(gathered)
        except BaseException as error:
            self._fault = error

    def _gathered(self) -> list[Word]:
        """Messages that wait, at least one; none where the last has been sent."""
        found: list[Word] = []
        # nobody else takes, so one that is there stays there
        while len(found) < MOST and not (found and self._waiting.empty()):
            message = self._waiting.get()
            if message is None:
                self._waiting.put(None)
                break
            found.append(message)
        return found

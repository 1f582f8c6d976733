"""A queue of messages that a thread sends, so that a simulation never waits for the network."""

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Generic, TypeVar

MOST = 64
"""Messages that are sent as one at most: results of large cases then stay a message of some MB."""

Message = TypeVar("Message")


class SendQueue(Generic[Message]):
    """Messages to be sent, in their order; those that gather meanwhile are sent together.

    Use it as a context: what is left is sent when the block ends, however it ends.

    Parameters
    ----------
    send
        Sends some messages; may block. After it raises, nothing more is sent, and the next call re-raises its
        error.
    """

    def __init__(self, send: Callable[[list[Message]], None]) -> None:
        self._send = send
        self._waiting: SimpleQueue[Message | None] = SimpleQueue()
        self._fault: BaseException | None = None
        self._thread = threading.Thread(target=self._send_all, daemon=True)

    def put(self, message: Message) -> None:
        """Add a message."""
        if self._fault is not None:
            raise self._fault
        self._waiting.put(message)

    def __enter__(self) -> SendQueue[Message]:
        self._thread.start()
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        self._waiting.put(None)
        self._thread.join()
        if self._fault is not None and error is None:
            raise self._fault

    def _send_all(self) -> None:
        try:
            while gathered := self._gathered():
                self._send(gathered)
        except BaseException as error:
            self._fault = error

    def _gathered(self) -> list[Message]:
        """Wait for messages; empty after the last."""
        found: list[Message] = []
        # no other thread takes messages, so one that is there stays there
        while len(found) < MOST and not (found and self._waiting.empty()):
            message = self._waiting.get()
            if message is None:
                self._waiting.put(None)
                break
            found.append(message)
        return found

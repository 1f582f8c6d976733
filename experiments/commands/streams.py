"""Standard streams that are closed or full: the command goes on, since its results are files."""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from experiments.commands.console import FAILED_RUN, messages

STREAMS = ("stdout", "stderr")


class LastingStream(io.RawIOBase):
    """Writes to a stream until an error, then drops what it receives."""

    def __init__(self, text: io.TextIOWrapper) -> None:
        self._text = text  # it would close the stream when it is dropped
        self._stream: Any = getattr(text.buffer, "raw", text.buffer)
        self.error: OSError | None = None
        """First error of the stream."""

    def write(self, data: Any, /) -> int:
        """Write bytes, and return how many were taken."""
        if self.error is None:
            try:
                return int(self._stream.write(data))
            except OSError as error:
                self.error = error
        return memoryview(data).nbytes

    def writable(self) -> bool:
        """Return True."""
        return True

    def isatty(self) -> bool:
        """Return whether the stream is a terminal."""
        return self._stream.isatty()

    def fileno(self) -> int:
        """Return the descriptor of the stream."""
        return self._stream.fileno()


@contextmanager
def lasting_streams() -> Iterator[None]:
    """Run a command whose standard streams may be closed or full; exit with 1 if its output was lost.

    A console of another encoding than UTF-8 shows an escape for what it lacks.
    """
    _open_closed()
    output, _ = map(_lasting, STREAMS)
    code: object = 0
    try:
        yield
    except SystemExit as ended:
        code = ended.code
    with suppress(AttributeError):
        sys.stdout.flush()
    if output and output.error:
        if output.error.errno != errno.EPIPE:  # e.g. head, which has all that it wants
            messages.print(
                f"Error: standard output: {output.error.strerror}. Files are complete, the output is not."
            )
        code = code or FAILED_RUN
    sys.exit(code)  # type: ignore[arg-type]


def _open_closed() -> None:
    """Open the null device for each closed stream: the next file would take its number, and its output."""
    for number, name in enumerate(("stdin", *STREAMS)):
        try:
            os.fstat(number)
        except OSError:
            null = os.open(os.devnull, os.O_RDWR)
            if null != number:
                os.dup2(null, number)
            os.set_inheritable(number, True)
            setattr(sys, name, os.fdopen(number, "r+" if name == "stdin" else "w", encoding="utf-8"))


def _lasting(name: str) -> LastingStream | None:
    """Replace a standard stream; one that a program has put there stays."""
    stream = getattr(sys, name)
    if not isinstance(stream, io.TextIOWrapper):
        return None
    lasting = LastingStream(stream)
    setattr(sys, name, io.TextIOWrapper(
        io.BufferedWriter(lasting), encoding=stream.encoding, errors="backslashreplace", line_buffering=True
    ))  # fmt: skip
    return lasting

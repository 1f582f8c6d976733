"""Run a program, end it at its time limit or with its starter, and note how it ended.

A script of the standard library alone, run as ``python run_program.py LIMIT WORD...`` in the folder of a
case. Its standard input is a pipe that nothing is written to: when the starter has ended, even killed, the
pipe ends, and so does the program with all that it started.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

ENDING, OUTPUT, ERRORS = "ending.json", "output.txt", "errors.txt"
"""Files in the folder: the note of the program's end, and its two streams."""

POSIX = os.name == "posix"


def main(limit: str, *words: str) -> None:
    """Run a program of some words for at most ``limit`` seconds, ``inf`` for no limit."""
    started, seconds = time.monotonic(), float(limit)
    # several programs run at once: one thread each, unless the environment says otherwise
    environment = {"OMP_NUM_THREADS": "1"} | os.environ
    with Path(OUTPUT).open("wb") as output, Path(ERRORS).open("wb") as errors:
        try:
            program = subprocess.Popen(
                words,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=errors,
                env=environment,
                start_new_session=POSIX,
            )
        except OSError as error:
            _note({"code": None, "timed_out": False, "error": error.strerror or str(error)})
            return
        threading.Thread(target=_end_with_starter, args=(program,), daemon=True).start()
        try:
            code, timed_out = program.wait(None if seconds == float("inf") else seconds), False
        except subprocess.TimeoutExpired:
            code, timed_out = None, True
        _end(program)
    _note({"code": code, "timed_out": timed_out, "seconds": round(time.monotonic() - started, 3)})


def _end_with_starter(program: "subprocess.Popen[bytes]") -> None:
    os.read(0, 1)  # without sys.stdin, whose lock would delay this process's own end
    _end(program)
    os._exit(1)


def _end(program: "subprocess.Popen[bytes]") -> None:
    """End a program and all that it has started."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        if POSIX:
            os.killpg(program.pid, signal.SIGKILL)
        else:
            program.kill()
    program.wait()


def _note(ending: dict[str, object]) -> None:
    temporary = Path(f"{ENDING}.part")
    temporary.write_text(json.dumps(ending), encoding="utf-8")
    temporary.replace(ENDING)


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Standard streams that are full or closed, and files that are too large to be read."""

import errno
import gzip
import io
import subprocess
import sys
from pathlib import Path

import pytest
from commandline import refused

from experiments.commands.streams import lasting_streams
from experiments.studyfile import write_template

CLOSED = """
import os, sys
for name in {names}:
    os.close(dict(stdin=0, stdout=1, stderr=2)[name])
    setattr(sys, name, None)
from experiments.cli import main
main()
"""


class Full(io.RawIOBase):
    """A stream on a full disk."""

    def __init__(self, number: int) -> None:
        self.number = number

    def writable(self) -> bool:
        return True

    def write(self, data: object, /) -> int:
        raise OSError(self.number, "No space left on device")


def _print_and_end(code: int) -> None:
    with lasting_streams():
        print("angle 27.3")
        sys.exit(code)


def _run_on(monkeypatch: pytest.MonkeyPatch, number: int, code: int) -> tuple[object, str]:
    """Print to a full output and end with a code; return the exit code and what the error stream got."""
    heard = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BufferedWriter(Full(number)), encoding="utf-8"))
    monkeypatch.setattr(sys, "stderr", io.TextIOWrapper(heard, encoding="utf-8"))
    with pytest.raises(SystemExit) as ended:
        _print_and_end(code)
    sys.stderr.flush()
    return ended.value.code, heard.getvalue().decode()


@pytest.mark.parametrize(("code", "right"), [(0, 1), (2, 2), (130, 130)])
def test_a_full_output_is_one_sentence_and_keeps_the_code_of_an_error(
    code: int, right: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    ended, said = _run_on(monkeypatch, errno.ENOSPC, code)
    assert ended == right
    assert said.count("\n") == 1
    assert said.startswith("Error: standard output: No space left on device.")


def test_a_reader_that_has_enough_gets_no_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    assert _run_on(monkeypatch, errno.EPIPE, 0) == (1, "")


@pytest.mark.parametrize("names", [["stdout"], ["stderr"], ["stdin", "stdout", "stderr"]])
def test_a_closed_stream_costs_no_result(names: list[str], tmp_path: Path) -> None:
    command = [sys.executable, "-c", CLOSED.format(names=names), "new", "wheat"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0
    assert "Traceback" not in done.stderr
    # the file holds its own text alone: nothing that was printed took its number
    (tmp_path / "again").mkdir()
    written = write_template("wheat", tmp_path / "again")
    assert (tmp_path / "wheat.toml").read_bytes() == written.read_bytes()


def test_a_file_that_is_too_large_is_refused_by_its_size(tmp_path: Path) -> None:
    spheres = b"0 0 0 1\n" * 2_000_000
    (tmp_path / "many.txt").write_bytes(spheres)
    (tmp_path / "many.gz").write_bytes(gzip.compress(spheres, 1))
    (tmp_path / "many.toml").write_text("".join(f"key{n} = 1\n" for n in range(300_000)), encoding="utf-8")
    assert "must have at most 1,000,000 bytes, got 16,000,000" in refused("clump", tmp_path / "many.txt")
    assert "1,000,000 bytes when decompressed" in refused("clump", tmp_path / "many.gz")
    assert "must have at most 500,000 bytes" in refused("heap", tmp_path / "many.toml")

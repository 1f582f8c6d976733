"""Mutated files through every reader; ``FUZZ_INPUTS=100000 pytest THIS_FILE`` is a long run."""

import os
import resource
import time
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from experiments.evidence.robustness.fuzz.readers import CORPUS, READERS, Reader, accepted_change

INPUTS = int(os.environ.get("FUZZ_INPUTS", "40"))
"""Number of files for each reader."""

SECONDS, MEGABYTES = 2.0, 1000.0
"""Time of the processor and memory that one file may take."""


PIECES = (
    b"0", b"-1", b"1e308", b"1e999", b"nan", b"-inf", b"1e-320", b"-2147483649", b"18446744073709551616",
    b"1_000", b"0x7fffffff", b"1" * 400, b"9" * 5000, b"1e", b"--1", b"\0", b"\xff", b"\xef\xbb\xbf",
    b"\x1b[31m", b"\xe2\x80\xae", b"\xed\xa0\x80", b"\r", b"\n", b'"', b'"""', b"'", b",", b"[", b"]", b"{",
    b"}", b"=", b"#", b".", b"/dev/zero", b"../", b"true", b"[" * 300, b"a." * 300, b"\\u0000", b"%s",
    b"[a]\n", b"[[factor]]\n",
)  # fmt: skip
"""Numbers and pieces of text that mean something to a reader, a terminal or a file system."""


@st.composite
def mutated(draw: st.DrawFn, seeds: Sequence[bytes]) -> bytes:
    """Draw a file that differs from a seed by one to four mutations."""
    content = draw(st.sampled_from(seeds))
    for _ in range(draw(st.sampled_from((1, 1, 1, 2, 4)))):
        start = draw(st.integers(0, len(content)))
        width = draw(st.sampled_from((0, 1, 4, 64, len(content))))
        other = draw(st.sampled_from(seeds))
        piece = draw(
            st.sampled_from((b"", *PIECES))
            | st.binary(min_size=1, max_size=8)
            | st.sampled_from((30, 3, 2)).map(lambda count, part=content[start : start + 64]: part * count)
            | st.integers(0, len(other)).map(lambda place, other=other: other[place:])
        )
        content = content[:start] + piece + content[start + width :]
    return content


def megabytes() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def check(reader: Reader, path: Path, content: bytes) -> bool:
    """Read a file, and hold it to the rules; return whether it was read."""
    path.write_bytes(content)
    began, before, read, message = time.process_time(), megabytes(), False, ""
    try:
        assert accepted_change(reader, reader.read(path)) == ""
        read = True
    except reader.refusals as refused:
        message = str(refused)
    assert read or message
    assert time.process_time() - began < SECONDS
    assert megabytes() - before < MEGABYTES
    return read


@pytest.mark.parametrize("name", READERS)
def test_seeds_are_read_and_no_mutated_file_breaks_a_reader(name: str, tmp_path: Path) -> None:
    reader, refused = READERS[name](tmp_path), 0
    for file, content in reader.seeds.items():
        assert check(reader, tmp_path / (reader.name or file), content)
    # crossed with files of the same ending alone: an ending chooses the reader's format
    endings = sorted({Path(file).suffix for file in reader.seeds})

    @settings(
        max_examples=INPUTS,
        deadline=None,
        derandomize=True,
        suppress_health_check=list(HealthCheck),
        database=None,
    )
    @given(st.data())
    def run(data: st.DataObject) -> None:
        nonlocal refused
        ending = data.draw(st.sampled_from(endings))
        files = [file for file in sorted(reader.seeds) if Path(file).suffix == ending]
        file, others = data.draw(st.sampled_from(files)), [reader.seeds[each] for each in files]
        refused += not check(reader, tmp_path / (reader.name or file), data.draw(mutated(others)))

    run()
    assert refused


def test_a_change_that_checksums_should_find_is_named() -> None:
    reader = Reader({}, Path.read_bytes, checked=True, facts={"a": 1, "b": (2.0, "x")})
    assert accepted_change(reader, {"a": 1}) == ""
    assert accepted_change(reader, {"a": 1, "b": (2.0, "y")}) == "b"
    assert accepted_change(reader, {"c": 1}) == "c"


@pytest.mark.parametrize("path", sorted((CORPUS / "found").iterdir()), ids=lambda path: path.stem)
def test_what_once_broke_a_reader_is_refused(path: Path, tmp_path: Path) -> None:
    reader = READERS[path.name.partition(".")[0]](tmp_path)
    assert not check(reader, tmp_path / f"again{path.suffix}", path.read_bytes())

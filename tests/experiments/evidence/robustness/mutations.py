"""Mutations of a file as a strategy of hypothesis: pieces cut, put in, repeated or crossed with another."""

from __future__ import annotations

from collections.abc import Sequence

from hypothesis import strategies as st

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

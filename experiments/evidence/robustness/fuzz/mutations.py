"""Mutations of a file: bits, bytes, pieces, numbers, lines; each determined by a random generator."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Sequence

NUMBERS = (
    b"0",
    b"-1",
    b"1e308",
    b"-1e308",
    b"1e999",
    b"nan",
    b"inf",
    b"-inf",
    b"1e-320",
    b"2147483648",
    b"-2147483649",
    b"18446744073709551616",
    b"1000000000",
    b"1_000",
    b"0x7fffffff",
    b"1" * 400,
    b"9" * 5000,
    b".",
    b"1e",
    b"--1",
)
"""Numbers that readers may stumble over, and some that are none."""

PIECES = (
    b"\0",
    b"\xff",
    b"\xef\xbb\xbf",
    b"\x1b[31m",
    b"\x7f",
    b"\xe2\x80\xae",
    b"\xed\xa0\x80",
    b"\r",
    b"\n",
    b'"',
    b'"""',
    b"'",
    b",",
    b"[",
    b"]",
    b"[[",
    b"{",
    b"}",
    b"=",
    b"#",
    b".",
    b"..",
    b"/",
    b"/dev/zero",
    b"../",
    b"true",
    b"[" * 300,
    b"a." * 300,
    b"\\u0000",
    b"%s",
    b"[a]\n",
    b"[[factor]]\n",
)
"""Pieces of text that mean something to a reader, a terminal or a file system."""

_NUMBER = re.compile(rb"[-+]?\d[\d.eE+-]*")

Mutation = Callable[[bytes, random.Random], bytes]


def mutated(seed: bytes, others: Sequence[bytes], rng: random.Random) -> bytes:
    """Return a file that differs from the seed by one to four mutations, or is crossed with another seed."""
    content = seed
    if others and rng.random() < 0.1:
        other = rng.choice(others)
        content = content[: rng.randrange(len(content) + 1)] + other[rng.randrange(len(other) + 1) :]
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        content = rng.choice(MUTATIONS)(content, rng)
    return content


def _flip(content: bytes, rng: random.Random) -> bytes:
    if not content:
        return content
    changed = bytearray(content)
    changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _set(content: bytes, rng: random.Random) -> bytes:
    if not content:
        return content
    changed = bytearray(content)
    start = rng.randrange(len(changed))
    width = min(rng.choice((1, 2, 4, 8)), len(changed) - start)
    changed[start : start + width] = rng.choice((b"\0", b"\xff", b"\x7f", b"\x80")) * width
    return bytes(changed)


def _cut(content: bytes, rng: random.Random) -> bytes:
    start = rng.randrange(len(content) + 1)
    end = len(content) if rng.random() < 0.3 else min(start + rng.choice((1, 4, 64)), len(content))
    return content[:start] + content[end:]


def _insert(content: bytes, rng: random.Random) -> bytes:
    start = rng.randrange(len(content) + 1)
    return content[:start] + rng.choice((*PIECES, *NUMBERS)) + content[start:]


def _repeat(content: bytes, rng: random.Random) -> bytes:
    start = rng.randrange(len(content) + 1)
    piece = content[start : start + rng.choice((1, 8, 64, 512))]
    return content[:start] + piece * rng.choice((2, 3, 30)) + content[start:]


def _number(content: bytes, rng: random.Random) -> bytes:
    if not (found := list(_NUMBER.finditer(content))):
        return _flip(content, rng)
    place = rng.choice(found)
    return content[: place.start()] + rng.choice(NUMBERS) + content[place.end() :]


def _lines(content: bytes, rng: random.Random) -> bytes:
    lines = content.split(b"\n")
    first, second = rng.randrange(len(lines)), rng.randrange(len(lines))
    if rng.random() < 0.5:
        lines[first], lines[second] = lines[second], lines[first]
    else:
        lines.insert(first, lines[second])
    return b"\n".join(lines)


MUTATIONS: tuple[Mutation, ...] = (_flip, _flip, _set, _cut, _insert, _repeat, _number, _lines)
"""All of them; those that come twice are taken twice as often."""

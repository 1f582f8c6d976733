"""Bad input: each error has a place, a problem, the value received and a hint."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

LONGEST_VALUE, LONGEST_PROBLEM = 120, 600
"""Characters of a value and of a problem that a message shows: a value may be a file of megabytes."""
MOST_PROBLEMS = 20
"""Problems that a message lists."""


def shortened(text: str, most: int = LONGEST_VALUE) -> str:
    """Return a text on one line, without its end where it is long and without control characters."""
    line = "".join(character if character.isprintable() else " " for character in text[: 10 * most])
    if len(text) <= most:
        return line
    return f"{line[: most - 20]} ... ({len(text)} characters)"


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong: ``place: problem, got value. hint``."""

    place: str
    """File, line and key, or the name of the option."""
    problem: str
    """Rule that is broken, as a statement about the place."""
    value: str = ""
    """Value received; empty where the problem says it."""
    hint: str = ""
    """Advice, as a sentence."""

    def __str__(self) -> str:
        got = (
            f"{' Got' if self.problem.endswith('?') else ', got'} {shortened(self.value)}"
            if self.value
            else ""
        )
        hint = f". {self.hint}" if self.hint else ""
        return f"{self.place}: {shortened(self.problem, LONGEST_PROBLEM)}{got}{hint}"


class InputError(ValueError):
    """Bad input, found before anything runs; its attributes are those of its first problem."""

    def __init__(
        self, place: str, problem: str, value: object = "", hint: str = "", more: tuple[Problem, ...] = ()
    ) -> None:
        self.place, self.problem, self.hint = place, problem, hint
        self.value = value if isinstance(value, str) else repr(value)
        self.problems = (Problem(place, problem, self.value, hint), *more)
        lines = [str(problem) for problem in self.problems[:MOST_PROBLEMS]]
        if (left := len(self.problems) - len(lines)) > 0:
            lines.append(f"... and {left} more")
        super().__init__("\n".join(lines))

    @classmethod
    def of(cls, problems: Iterable[Problem]) -> Self:
        """Build the error of one problem or more."""
        first, *more = problems
        return cls(first.place, first.problem, first.value, first.hint, tuple(more))

    def __reduce__(self) -> tuple[type, tuple]:
        return type(self), (self.place, self.problem, self.value, self.hint, self.problems[1:])


class StudyError(InputError):
    """A study file breaks a rule."""


class StoreError(InputError):
    """An output folder cannot be used, or a stored case is damaged."""

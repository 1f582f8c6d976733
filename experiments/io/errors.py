"""Bad input: each error gives the rule, the value received and the place."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

LONGEST_VALUE, LONGEST_RULE = 120, 600
"""Characters of a value and of a rule that a message shows: a value may be a file of megabytes."""
MOST_PROBLEMS = 20
"""Problems that a message tells of."""
_DEMAND = re.compile(r"^(?:is|has|names|takes)\b|\b(?:must|needs?|required|unknown|never|only|not both)\b")
"""A rule in these words cannot be taken for what was found."""


def shortened(text: str, most: int = LONGEST_VALUE) -> str:
    """Text on one line, its middle left out where it is long, and without characters that move a cursor."""
    line = "".join(character if character.isprintable() else " " for character in text[: 10 * most])
    if len(text) <= most:
        return line
    return f"{line[: most - 20]} ... ({len(text)} characters)"


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong."""

    rule: str
    """Rule that must hold, in words."""
    value: str
    """Value received instead."""
    place: str
    """File, line and key, or the name of the option."""

    def __str__(self) -> str:
        rule = self.rule if _DEMAND.search(self.rule) else f"expected: {self.rule}"
        return f"{self.place}: {shortened(rule, LONGEST_RULE)} (received {shortened(self.value)})"


class InputError(ValueError):
    """Bad input, found before anything runs; rule, value and place are those of its first problem."""

    def __init__(self, rule: str, value: object, place: str, more: tuple[Problem, ...] = ()) -> None:
        self.rule, self.place = rule, place
        self.value = value if isinstance(value, str) else repr(value)
        self.problems = (Problem(rule, self.value, place), *more)
        told = [str(problem) for problem in self.problems[:MOST_PROBLEMS]]
        if (left := len(self.problems) - len(told)) > 0:
            told.append(f"... and {left} more")
        super().__init__("\n".join(told))

    @classmethod
    def of(cls, problems: Iterable[Problem]) -> Self:
        """Build the error of one problem or more."""
        first, *more = problems
        return cls(first.rule, first.value, first.place, tuple(more))

    def __reduce__(self) -> tuple[type, tuple]:
        return type(self), (self.rule, self.value, self.place, self.problems[1:])


class StudyError(InputError):
    """A study file breaks a rule."""


class StoreError(InputError):
    """An output folder cannot be used, or a stored case is not what it should be."""

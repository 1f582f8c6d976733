"""Bad input: each error gives the rule, the value received and the place."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

LONGEST = 500
"""Characters of a value that are shown."""


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
        return f"{self.place}: {self.rule} (received {self.value})"


class InputError(ValueError):
    """Bad input, found before anything runs; rule, value and place are those of its first problem."""

    def __init__(self, rule: str, value: object, place: str, more: tuple[Problem, ...] = ()) -> None:
        self.rule, self.place = rule, place
        text = value if isinstance(value, str) else repr(value)
        self.value = text if len(text) <= LONGEST else f"{text[:LONGEST]} ..."
        self.problems = (Problem(rule, self.value, place), *more)
        super().__init__("\n".join(str(problem) for problem in self.problems))

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

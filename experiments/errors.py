"""Bad input: each error gives the rule, the value received and the place."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong."""

    rule: str
    """What must hold, in words."""
    value: str
    """What was received instead."""
    place: str
    """File, line and key, or the name of the option."""

    def __str__(self) -> str:
        return f"{self.place}: {self.rule} (received {self.value})"


class InputError(ValueError):
    """Bad input, found before anything runs.

    Parameters
    ----------
    rule, value, place
        What must hold, what was received, and where.
    more
        Further problems of the same input.
    """

    def __init__(self, rule: str, value: object, place: str, more: tuple[Problem, ...] = ()) -> None:
        first = Problem(rule, value if isinstance(value, str) else repr(value), place)
        self.problems = (first, *more)
        super().__init__("\n".join(str(problem) for problem in self.problems))

    @property
    def rule(self) -> str:
        """What must hold (the first problem's)."""
        return self.problems[0].rule

    @property
    def value(self) -> str:
        """What was received (the first problem's)."""
        return self.problems[0].value

    @property
    def place(self) -> str:
        """Where (the first problem's)."""
        return self.problems[0].place

    def __reduce__(self) -> tuple[type, tuple]:
        return type(self), (self.rule, self.value, self.place, self.problems[1:])


class StudyError(InputError):
    """A study file breaks a rule."""


class StoreError(InputError):
    """An output folder cannot be used, or a stored case is not what it should be."""

"""Errors of this package: each message gives the rule, the value received and its place."""

from __future__ import annotations


class DesignError(ValueError):
    """A factor, a design or a response breaks a rule that its analysis needs."""


class TargetError(DesignError):
    """The target response is not reached anywhere in the region that was searched."""


class RuleError(DesignError):
    """An input breaks a rule; the message is made of the rule, the value received and its place.

    Parameters
    ----------
    rule, value, place
        What must hold, what was received, and where.
    """

    def __init__(self, rule: str, value: object, place: str) -> None:
        self.rule, self.place = rule, place
        self.value = value if isinstance(value, str) else repr(value)
        super().__init__(f"{place}: {rule} (received {self.value})")

    def __reduce__(self) -> tuple[type, tuple[str, str, str]]:
        return type(self), (self.rule, self.value, self.place)

"""Errors of this package: each message gives the rule, the value received and its place."""


class DesignError(ValueError):
    """A factor, a design or a response breaks a rule that its analysis needs."""


class TargetError(DesignError):
    """The target response is not reached anywhere in the region that was searched."""


class RuleError(DesignError):
    """An input breaks a rule: ``place: problem, got value``."""

    def __init__(self, place: str, problem: str, value: object) -> None:
        self.place, self.problem = place, problem
        self.value = value if isinstance(value, str) else repr(value)
        super().__init__(f"{place}: {problem}, got {self.value}")

    def __reduce__(self) -> tuple[type, tuple[str, str, str]]:
        return type(self), (self.place, self.problem, self.value)

"""Errors of this package: each message gives the rule, the value received and its place."""


class DesignError(ValueError):
    """A factor, a design or a response breaks a rule that its analysis needs."""


class TargetError(DesignError):
    """The target response is not reached anywhere in the region that was searched."""

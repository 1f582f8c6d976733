"""The one error of this package: a picture that cannot be measured, or a setting that makes no sense."""

from __future__ import annotations

LONGEST_VALUE = 300
"""Characters of a value that a message shows."""


def shortened(value: object) -> str:
    """Text of a value, its end left out where it is long."""
    text = str(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]} ... ({len(text)} characters)"


class PictureError(ValueError):
    """A picture without a measurable heap, or a wrong measurement setting: ``place: problem, got value``.

    Parameters
    ----------
    place : str
        Where: a file, a view of a heap, the name of an argument.
    problem : str
        What must hold.
    value : object
        What was received instead.
    """

    def __init__(self, place: str, problem: str, value: object) -> None:
        super().__init__(f"{place}: {problem}, got {shortened(value)}")
        self.place = place
        self.problem = problem
        self.value = value

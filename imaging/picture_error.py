"""The one error of this package: a picture that cannot be measured, or an invalid setting."""

from __future__ import annotations

LONGEST_VALUE = 300
"""Characters of a value that a message shows."""


class PictureError(ValueError):
    """A picture without a measurable heap, or an invalid setting: ``place: problem, got value``.

    Parameters
    ----------
    place : str
        File, view of a heap, or name of an argument.
    problem : str
        Statement about the place.
    value : object
        Value received; empty where the problem says it.
    """

    def __init__(self, place: str, problem: str, value: object = "") -> None:
        text = str(value)
        if len(text) > LONGEST_VALUE:
            text = f"{text[:LONGEST_VALUE]} ... ({len(text)} characters)"
        super().__init__(f"{place}: {problem}" + (f", got {text}" if text else ""))
        self.place = place
        self.problem = problem
        self.value = value

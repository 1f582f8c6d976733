"""Contact laws of a case in the words of another code, with the nearest one for each that it lacks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from dem_warp import Case, ContactLaws


@dataclass(frozen=True)
class Translated:
    """One thing that was translated: a row of the README."""

    subject: str
    """E.g. "filling", "tube", "time step"."""
    here: str
    """Its form in dem-warp."""
    there: str
    """Its form in the other code, with what is lost or changed on the way."""


@dataclass(frozen=True)
class LawsOfCode:
    """Choices that a code has for each contact law.

    Raises
    ------
    ValueError
        When the nearest for a choice is not one that it has.
    """

    code: str
    """Name of the code."""
    has: Mapping[str, Mapping[str, str]]
    """Choices that the code has for each law, with its words for each: empty where no word is needed. The
    first replaces whatever it lacks, unless `nearest` names another."""
    nearest: Mapping[str, str]
    """Replacement for a choice that the code lacks, within one law."""

    def __post_init__(self) -> None:
        known = {choice for choices in self.has.values() for choice in choices}
        if unknown := sorted(set(self.nearest.values()) - known):
            raise ValueError(f"LawsOfCode.nearest: must be choices that {self.code} has, got {unknown}")

    def taken(self, laws: ContactLaws) -> dict[str, str]:
        """Return the choice for each law of the input: the case's own, or the nearest."""
        own = laws.to_dict()
        return {law: self._taken(law, str(own[law])) for law in self.has}

    def nearest_laws(self, laws: ContactLaws) -> ContactLaws:
        """Return the laws of the input: the case's own, or the nearest."""
        taken: dict[str, Any] = dict(self.taken(laws))
        if taken.get("normal_damping", laws.normal_damping) == "tsuji":
            taken["damping_rate"] = None
        return replace(laws, **taken)

    def words(self, laws: ContactLaws) -> dict[str, str]:
        """Return the code's words for each of its laws."""
        return {law: self.has[law][choice] for law, choice in self.taken(laws).items()}

    def warnings(self, laws: ContactLaws) -> tuple[str, ...]:
        """Name every choice that the code lacks, and its replacement."""
        own = laws.to_dict()
        return tuple(
            f"law {law} = {own[law]!r}: {self.code} lacks it; using {choice!r}"
            for law, choice in self.taken(laws).items()
            if choice != own[law]
        )

    def translated(self, laws: ContactLaws) -> list[Translated]:
        """Return a row of the README for each law: its choice and the code's."""
        own, taken, words = laws.to_dict(), self.taken(laws), self.words(laws)
        return [
            Translated(
                law.replace("_", " "),
                str(own[law]),
                ("" if taken[law] == own[law] else f"{taken[law]} (the nearest) ")
                + f"`{words[law]}`" * bool(words[law]),
            )
            for law in self.has
        ]

    def _taken(self, law: str, choice: str) -> str:
        if choice in self.has[law]:
            return choice
        first = next(iter(self.has[law]))
        near = self.nearest.get(choice, first)
        return near if near in self.has[law] else first  # two laws may have choices of one name


def mechanism_warnings(case: Case[Any], code: str) -> tuple[str, ...]:
    """Name every mechanism of a case: other codes have different ones, so that all are left out."""
    return tuple(
        f"mechanism {mechanism.name!r} has no counterpart in the input for {code}: it is left out"
        for mechanism in case.mechanisms
    )

"""Conventions of a case against those that a code has: its words for them, and what stands for the others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from dem_warp import Case, ContactLaws
from experiments.export.translated import Translated


@dataclass(frozen=True)
class LawsOfCode:
    """Conventions that a code has, law by law.

    Raises
    ------
    ValueError
        When the nearest for a choice is none that it has.
    """

    code: str
    """Name of the code."""
    has: Mapping[str, Mapping[str, str]]
    """For each law, the choices that the code has and its words for each: empty words where there is nothing
    to say. The first is the nearest for whatever it lacks, unless `nearest` names another."""
    nearest: Mapping[str, str]
    """Choice that stands for one that the code lacks; both of one law."""

    def __post_init__(self) -> None:
        known = {choice for choices in self.has.values() for choice in choices}
        if strange := sorted(set(self.nearest.values()) - known):
            raise ValueError(f"LawsOfCode.nearest: must be choices that {self.code} has, got {strange}")

    def taken(self, laws: ContactLaws) -> dict[str, str]:
        """Choice that the input has, by law: the case's own, or the nearest."""
        own = laws.to_dict()
        return {law: self._taken(law, str(own[law])) for law in self.has}

    def nearest_laws(self, laws: ContactLaws) -> ContactLaws:
        """Laws that the input has: the case's own, or the nearest."""
        taken: dict[str, Any] = dict(self.taken(laws))
        if taken.get("normal_damping", laws.normal_damping) == "tsuji":
            taken["damping_rate"] = None
        return replace(laws, **taken)

    def words(self, laws: ContactLaws) -> dict[str, str]:
        """Words of the code for each of its laws."""
        return {law: self.has[law][choice] for law, choice in self.taken(laws).items()}

    def warnings(self, laws: ContactLaws) -> tuple[str, ...]:
        """Name every choice that the code lacks, and what stands for it."""
        own = laws.to_dict()
        return tuple(
            f"law {law} = {own[law]!r}: {self.code} has none such; {choice!r} stands for it"
            for law, choice in self.taken(laws).items()
            if choice != own[law]
        )

    def translated(self, laws: ContactLaws) -> list[Translated]:
        """Rows of the README: each law, its choice and the code's."""
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
    """Name every mechanism of a case: those of other codes are not the same, so that all are left out."""
    return tuple(
        f"mechanism {mechanism.name!r} has no counterpart in the input for {code}: it is left out"
        for mechanism in case.mechanisms
    )

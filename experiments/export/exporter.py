"""Exporters, the tests that they get and the translations that they return."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from dem_warp import Case, Material
from experiments.export.contact import Contact, Term
from experiments.export.laws import LawsOfCode, Translated
from experiments.io.errors import InputError
from experiments.io.texts import safe_text


@dataclass(frozen=True)
class ExportedTest:
    """One case to be exported, with its origin; each of its texts becomes a `safe_text`.

    Raises
    ------
    InputError
        When its walls are of several materials.
    """

    name: str
    """Name of the study or the card."""
    case: Case[Any]
    """Scene, grains, contacts, numerics and seed."""
    source: str
    """File that it was read from, with its scale."""
    settings: Mapping[str, str] = field(default_factory=dict)
    """Values of the factors with their units, by name."""
    estimator: str = "repose angle"
    """Description of how the angle is read."""

    def __post_init__(self) -> None:
        for text in ("name", "source", "estimator"):
            object.__setattr__(self, text, safe_text(getattr(self, text)))
        settings = {safe_text(name): safe_text(value) for name, value in self.settings.items()}
        object.__setattr__(self, "settings", settings)
        if parts := [part.name for part in self.case.wall_parts]:
            rule = f"all walls must be of one material, but {', '.join(parts)} have their own"
            raise InputError(self.source, rule)


@dataclass(frozen=True)
class Translation:
    """Input of another code: its files, and how each part of the test was translated.

    Raises
    ------
    ValueError
        When the main file is not one of the files.
    """

    files: Mapping[str, str]
    """Text of every file, by its name."""
    main: str
    """File that a person opens first; the warnings are written above its text."""
    command: tuple[str, ...]
    """Command that runs it in its folder; empty when there is none."""
    heap: str
    """File that a finished run writes: a LAMMPS dump of the spheres of the final heap, ``id type x y z
    radius`` in metres, the weighed discharge, or the looks at a drum; empty when there is none."""
    translated: tuple[Translated, ...]
    """Rows of the README, the most important first."""
    warnings: tuple[str, ...] = ()
    """Things that the code lacks, with their replacements; an error without ``--approximate``."""
    comment: str = "#"
    """Beginning of a comment in the main file."""

    def __post_init__(self) -> None:
        if self.main not in self.files:
            raise ValueError(f"Translation.main: must be one of {', '.join(self.files)}, got {self.main!r}")
        if isinstance(self.warnings, str):
            raise ValueError(f"Translation.warnings: must be a tuple of texts, got {self.warnings!r}")

    def to_dict(self) -> dict[str, Any]:
        """Return everything but the texts as data for JSON."""
        names = ("main", "command", "heap", "warnings")
        rows = [asdict(row) for row in self.translated]
        return {name: getattr(self, name) for name in names} | {"files": list(self.files), "translated": rows}


@dataclass(frozen=True)
class Exporter:
    """Translation of materials, contacts and tests into the terms of another code."""

    code: str
    """Name of the code."""
    laws: str
    """Its laws, which the terms belong to."""
    differs: str
    """Differences between those laws and ours."""
    material_terms: Callable[[Material], tuple[Term, ...]]
    """Terms of one material; empty when all belong to contacts."""
    contact_terms: Callable[[Contact], tuple[Term, ...]]
    """Terms of one contact."""
    translate: Callable[[ExportedTest], Translation] | None = None
    """Input of a test; None when only contacts can be translated. Raises `InputError` for a test that the
    code cannot have at all."""
    conventions: LawsOfCode | None = None
    """Contact laws that the code has."""
    unproven: str = ""
    """Warning for an input that nobody has run in the code yet; otherwise empty."""

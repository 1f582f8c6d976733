"""Exporters: the same test as the input of another code, and all that was translated on the way."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from dem_warp import Case, Material
from experiments.export.contact import Contact, Term
from experiments.export.laws import LawsOfCode
from experiments.export.translated import Translated
from experiments.io.errors import InputError


@dataclass(frozen=True)
class ExportedTest:
    """One case that leaves for another code, with what its reader must know of it."""

    name: str
    """Name of the study or the card, in words."""
    case: Case[Any]
    """Scene, grains, contacts, numerics and seed."""
    source: str
    """File that it was read from, with its scale."""
    settings: Mapping[str, str] = field(default_factory=dict)
    """Values of the factors with their units, by name."""
    estimator: str = "repose angle"
    """Reading of the result, in words."""

    def __post_init__(self) -> None:
        if parts := [part.name for part in self.case.wall_parts]:
            rule = "expected the walls of a test that leaves for another code are all of one material"
            raise InputError(self.source, rule, f"others for {', '.join(parts)}")


@dataclass(frozen=True)
class Translation:
    """Input of another code: its files, and what became of each part of the test.

    Raises
    ------
    ValueError
        When the main file is none of the files.
    """

    files: Mapping[str, str]
    """Text of every file, by its name."""
    main: str
    """File that a person opens first: a head with the warnings is written above its text."""
    command: tuple[str, ...]
    """Program and arguments that run it in its folder; empty where it cannot be run."""
    heap: str
    """File that the run leaves when it has finished, and only then: a LAMMPS dump of the spheres of the final
    heap, ``id type x y z radius`` in metres; empty where there is none."""
    translated: tuple[Translated, ...]
    """Everything that was translated, in the order of a reader's interest."""
    warnings: tuple[str, ...] = ()
    """Things that the code lacks, and what stands for them. The command refuses these by name unless it is
    told that the nearest will do."""
    comment: str = "#"
    """Beginning of a comment in the main file."""

    def __post_init__(self) -> None:
        if self.main not in self.files:
            raise ValueError(f"Translation.main: must be one of {', '.join(self.files)}, got {self.main!r}")

    def to_dict(self) -> dict[str, Any]:
        """Everything but the texts as JSON-able data."""
        told = ("main", "command", "heap", "warnings")
        rows = [asdict(row) for row in self.translated]
        return {name: getattr(self, name) for name in told} | {"files": list(self.files), "translated": rows}


@dataclass(frozen=True)
class Exporter:
    """Translation of materials, contacts and tests into the terms of another code."""

    code: str
    """Its name."""
    laws: str
    """Names of its laws that the terms are for."""
    differs: str
    """Differences between those laws and ours."""
    material_terms: Callable[[Material], tuple[Term, ...]]
    """Terms of one material; empty where all belong to contacts."""
    contact_terms: Callable[[Contact], tuple[Term, ...]]
    """Terms of one contact."""
    translate: Callable[[ExportedTest], Translation] | None = None
    """Input of a test; None where contacts alone can be translated. Raises `InputError` for a test that the
    code cannot have in any form."""
    conventions: LawsOfCode | None = None
    """Conventions that its input has."""
    unproven: str = ""
    """Words for an input that nobody has run in the code yet, and why; empty where it has been run."""

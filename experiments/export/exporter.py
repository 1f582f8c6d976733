"""What a translation into another code's terms consists of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from dem_warp import Material
from experiments.export.contact import Contact, Term


@dataclass(frozen=True)
class Exporter:
    """Translation of materials and contacts into the terms of another code."""

    code: str
    """Its name."""
    laws: str
    """Names of its laws that the terms are for."""
    differs: str
    """Where they differ from ours."""
    material_terms: Callable[[Material], tuple[Term, ...]]
    """Terms of one material; empty where all belong to contacts."""
    contact_terms: Callable[[Contact], tuple[Term, ...]]
    """Terms of one contact."""

"""Facts of a case that every input tells: its laws, and the mass properties of its grains."""

from __future__ import annotations

from typing import Any

from dem_warp import Case
from experiments.export.exporter import ExportedTest, Exporter
from experiments.export.translated import Translated


def laws_row(test: ExportedTest, exporter: Exporter) -> Translated:
    """Say which laws stand for which."""
    own = ", ".join(["Hertz-Mindlin", *(mechanism.name for mechanism in test.case.mechanisms)])
    return Translated("contact laws", own, f"{exporter.laws}. {exporter.differs}")


def grain_rows(case: Case[Any]) -> tuple[tuple[str, ...], list[tuple[object, ...]]]:
    """Tabulate mass and principal moments of each shape at size 1: of the union of its spheres, with no
    overlap counted twice.

    Returns
    -------
    head, rows
        Of the table.
    """
    density, mixture = case.grain_material.density, case.grains.mixture
    head = ("shape", "fraction", "spheres", "mass [kg]", "principal moments of inertia [kg m2]")
    rows: list[tuple[object, ...]] = []
    for number, (shape, fraction) in enumerate(zip(mixture.shapes, mixture.fractions, strict=True), 1):
        mass = density * shape.volume
        moments = ", ".join(f"{mass * moment:.6g}" for moment in shape.inertia_over_mass)
        rows.append((number, f"{fraction:.4g}", shape.sphere_count, f"{mass:.6g}", moments))
    return head, rows

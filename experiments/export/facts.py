"""Facts of a case that every input tells: its laws, and the mass properties of its grains."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from dem_warp import Case
from experiments.export.contact import Term, contacts_of
from experiments.export.exporter import ExportedTest, Exporter
from experiments.export.exporters import EXPORTERS
from experiments.export.laws import Translated, mechanism_warnings


def laws_row(test: ExportedTest, exporter: Exporter) -> Translated:
    """Say which laws stand for which."""
    named = f"the set `{test.case.laws.name}`"
    own = ", ".join([named, *(mechanism.name for mechanism in test.case.mechanisms)])
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


def case_terms(name: str, case: Case[Any]) -> list[tuple[str, Term]]:
    """Tabulate all terms of a case in the words of a code, by its name, each with what it is of.

    What the code lacks is the nearest that it has, see `term_warnings`.
    """
    exporter = EXPORTERS[name]
    laws = case.laws if exporter.conventions is None else exporter.conventions.nearest_laws(case.laws)
    base = replace(case, mechanisms=(), laws=laws)
    shapes, size = case.grains.mixture.shapes, case.grains.size_mean
    radius = max(float(shape.radii.max()) for shape in shapes) * size
    mass = case.grain_material.density * case.grains.mean(lambda shape: shape.volume) * size**3
    among, wall = contacts_of(base, radius, mass)
    rows = [
        *(("grain", term) for term in exporter.material_terms(among.first)),
        *(("wall", term) for term in exporter.material_terms(wall.second)),
    ]
    for subject, contact in (("grain with grain", among), ("grain with wall", wall)):
        rows += [(subject, term) for term in exporter.contact_terms(contact)]
    return rows


def term_warnings(name: str, case: Case[Any]) -> tuple[str, ...]:
    """Name what a code lacks of a case's laws and mechanisms."""
    exporter = EXPORTERS[name]
    laws = () if exporter.conventions is None else exporter.conventions.warnings(case.laws)
    return laws + mechanism_warnings(case, exporter.code)

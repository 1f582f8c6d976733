"""Registry of exporters: each code has one line here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from dem_warp import Case
from dem_warp.registry import Registry
from experiments.export.contact import Term, contacts_of
from experiments.export.deme_exporter import DEME
from experiments.export.exporter import Exporter
from experiments.export.lammps_exporter import LAMMPS
from experiments.export.laws import mechanism_warnings
from experiments.export.liggghts_exporter import LIGGGHTS
from experiments.export.mercury_exporter import MERCURY
from experiments.export.sheet import EDEM, ROCKY
from experiments.export.yade_exporter import YADE
from experiments.io.errors import InputError
from experiments.io.plug_ins import calling, made_in


def _check(name: str, exporter: object, known: object) -> None:
    if not isinstance(exporter, Exporter):
        raise TypeError(f"must be an Exporter, got {exporter!r}")


_ALL = {
    "liggghts": LIGGGHTS,
    "lammps": LAMMPS,
    "yade": YADE,
    "deme": DEME,
    "mercurydpm": MERCURY,
    "edem": EDEM,
    "rocky": ROCKY,
}

EXPORTERS: Registry[Exporter] = Registry("dem_warp.exporters", _ALL, _check)
"""Exporters by the name of their code on the command line."""


def case_terms(name: str, case: Case[Any]) -> list[tuple[str, Term]]:
    """Tabulate the terms of a case for a code, each with its subject; what the code lacks, it replaces."""
    exporter = EXPORTERS[name]
    laws = case.laws if exporter.conventions is None else exporter.conventions.nearest_laws(case.laws)
    base = replace(case, mechanisms=(), laws=laws)
    shapes, size = case.grains.mixture.shapes, case.grains.size_mean
    radius = max(float(shape.radii.max()) for shape in shapes) * size
    mass = case.grain_material.density * case.grains.mean(lambda shape: shape.volume) * size**3
    among, wall = contacts_of(base, radius, mass)
    parts = (
        ("grain", exporter.material_terms, among.first),
        ("wall", exporter.material_terms, wall.second),
        ("grain with grain", exporter.contact_terms, among),
        ("grain with wall", exporter.contact_terms, wall),
    )
    return [(subject, term) for subject, terms, of in parts for term in _terms(name, terms, of)]


def _terms(name: str, terms: Callable[[Any], tuple[Term, ...]], of: object) -> tuple[Term, ...]:
    """Call a function of an exporter; InputError if it raises, or does not return terms."""
    with calling(terms, place := f"exporter {name}"):
        found = terms(of)
    if not (isinstance(found, tuple) and all(isinstance(term, Term) for term in found)):
        raise InputError(place, f"{made_in(terms)} must return a tuple of Term", found)
    return found


def term_warnings(name: str, case: Case[Any]) -> tuple[str, ...]:
    """Name the laws and mechanisms of a case that a code lacks."""
    exporter = EXPORTERS[name]
    laws = () if exporter.conventions is None else exporter.conventions.warnings(case.laws)
    return laws + mechanism_warnings(case, exporter.code)

"""Codes by their tables: terms and laws of each are in ``codes/NAME.toml``, its input in a function."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from operator import attrgetter
from typing import Any

from dem_warp import LiftedCylinder, Material
from experiments.export.contact import Contact, Term, contacts_of, values
from experiments.export.exporter import ExportedTest, Exporter, Translation
from experiments.export.laws import LawsOfCode, Translated, mechanism_warnings
from experiments.export.lift import Lift
from experiments.export.lift_rows import lift_warnings

Numbers = Callable[[Contact], Mapping[str, float]]
"""Values of the terms of a contact that are no attribute of it, by their keys in the table."""


@dataclass(frozen=True)
class CodeTest:
    """A test with the contacts that a code can have."""

    lift: Lift
    exporter: Exporter
    """Exporter of the code."""
    contacts: tuple[Contact, Contact, Contact]
    """Contacts of grains with grains, the tube (bin) and the plate (floor) under the code's laws."""
    words: Mapping[str, str]
    """Words of the code for each law."""
    rows: tuple[Translated, ...]
    """Rows of the README about the laws."""
    notes: tuple[Translated, ...]
    """Rows of the README about forms of the code's own."""
    warnings: tuple[str, ...]
    """Laws and mechanisms that the code lacks."""

    @property
    def material_values(self) -> list[dict[str, float]]:
        """Terms of the materials of grains, tube and plate by name."""
        materials = (self.contacts[0].first, *(contact.second for contact in self.contacts[1:]))
        return [values(self.exporter.material_terms(material)) for material in materials]

    @property
    def contact_values(self) -> list[dict[str, float]]:
        """Terms of the contacts by name."""
        return [values(self.exporter.contact_terms(contact)) for contact in self.contacts]

    def script(
        self, program: str, files: Mapping[str, str], heap: str, rows: Iterable[Translated], *warnings: str
    ) -> Translation:
        """Return the translation whose first file a program runs; rows and warnings follow those of laws."""
        main, warned = next(iter(files)), (*self.warnings, *lift_warnings(self.lift), *warnings)
        translated = (*self.rows, *rows, *self.notes)
        return Translation(files, main, (program, "-in", main), heap, translated, warned)


def code_exporter(
    name: str,
    translate: Callable[[CodeTest], Translation],
    numbers: Numbers = lambda contact: {},
    kinds: tuple[type, ...] = (LiftedCylinder,),
) -> Exporter:
    """Make the exporter of the code with a table; `translate` writes the input of tests of these kinds."""
    table = code_table(name)
    code, source = table["code"], table["source"]
    laws = code_laws(name)

    def material_terms(material: Material) -> tuple[Term, ...]:
        return tuple(_terms(table.get("material", {}), material, {}, source))

    def contact_terms(contact: Contact) -> tuple[Term, ...]:
        return tuple(_terms(table["contact"], contact, numbers(contact), source))

    def translated(test: ExportedTest) -> Translation:
        return translate(_code_test(exporter, laws, Lift(test, code, kinds), table.get("notes", ())))

    exporter = Exporter(
        code,
        table["title"],
        table["differs"],
        material_terms,
        contact_terms,
        translated,
        laws,
        table.get("unproven", ""),
    )
    return exporter


@cache
def code_laws(name: str) -> LawsOfCode:
    """Return the contact laws of the code with a table."""
    table = code_table(name)
    return LawsOfCode(table["code"], table["laws"], table.get("nearest", {}))


@cache
def code_table(name: str) -> Mapping[str, Any]:
    """Read the table of a code."""
    return tomllib.loads((files("experiments.export") / "codes" / f"{name}.toml").read_text("utf-8"))


def _terms(
    rows: Mapping[str, Mapping[str, str]], of: object, numbers: Mapping[str, float], source: str
) -> Iterator[Term]:
    for key, row in rows.items():
        if "needs" in row and not attrgetter(row["needs"])(of):
            continue
        value = attrgetter(row["value"])(of) if "value" in row else numbers.get(key)
        if value is not None:
            name = row.get("name", key)
            yield Term(name, value, row.get("unit", "1"), row["formula"], row.get("source", source))


def _code_test(
    exporter: Exporter, laws: LawsOfCode, lift: Lift, notes: Sequence[Mapping[str, str]]
) -> CodeTest:
    own = lift.case.laws
    case = replace(lift.case, mechanisms=(), laws=laws.nearest_laws(own))
    heaviest = max(template.mass for template in lift.templates)
    among, tube = contacts_of(case, lift.largest_radius, heaviest)
    coefficients = lift.scene.contacts(case)[-1]
    surface = replace(tube.surface, static_friction=coefficients.static_friction)
    plate = replace(tube, surface=surface, coefficients=coefficients)
    warnings = laws.warnings(own) + mechanism_warnings(lift.case, exporter.code)
    return CodeTest(
        lift,
        exporter,
        (among, tube, plate),
        laws.words(own),
        tuple(laws.translated(own)),
        tuple(Translated(**note) for note in notes),
        warnings,
    )

"""Cards and tests for other codes: contacts in their words, and the same test as their input."""

from experiments.export.contact import Contact, Term, contacts_of, values
from experiments.export.exporter import ExportedTest, Exporter, Translation
from experiments.export.facts import case_terms, term_warnings
from experiments.export.folder import export_input, write_export
from experiments.export.library import EXPORTERS
from experiments.export.translated import Translated

__all__ = [
    "EXPORTERS",
    "Contact",
    "ExportedTest",
    "Exporter",
    "Term",
    "Translated",
    "Translation",
    "case_terms",
    "contacts_of",
    "export_input",
    "term_warnings",
    "values",
    "write_export",
]

"""The public names: each is loaded with its module when it is first used."""

from .contact import Contact, Term, contacts_of, values
from .export_folder import export_input, write_export
from .exporter import ExportedTest, Exporter, Translation
from .exporters import EXPORTERS, case_terms, term_warnings
from .laws import Translated

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

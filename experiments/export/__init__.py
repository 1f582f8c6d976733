"""Contact terms of other codes: materials and contacts of a case in their words, with formula and source."""

from experiments.export.contact import Contact, Exporter, Term, contacts_of, values
from experiments.export.library import EXPORTERS

__all__ = ["EXPORTERS", "Contact", "Exporter", "Term", "contacts_of", "values"]

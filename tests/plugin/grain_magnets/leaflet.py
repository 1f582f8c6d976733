"""An exporter: it writes nothing but the friction of the grains on a leaflet."""

from experiments.export.contact import Contact, Term
from experiments.export.exporter import ExportedTest, Exporter, Translation


def terms(contact: Contact) -> tuple[Term, ...]:
    """Friction of a contact."""
    return (Term("mu", contact.surface.static_friction, "1", "mu", "Leaflet, page 1"),)


def translate(test: ExportedTest) -> Translation:
    """Write the leaflet."""
    text = f"mu = {test.case.grain_grain.static_friction:g}\n"
    return Translation({"leaflet.txt": text}, "leaflet.txt", (), "", ())


LEAFLET = Exporter("Leaflet", "none", "in all", lambda material: (), terms, translate)

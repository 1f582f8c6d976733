"""An exporter: it writes the friction of the grains on a leaflet."""

from experiments.export.contact import Contact, Term
from experiments.export.exporter import ExportedTest, Exporter, Translation
from experiments.export.laws import Translated, mechanism_warnings


def terms(contact: Contact) -> tuple[Term, ...]:
    """Return the friction of a contact."""
    return (Term("mu", contact.surface.static_friction, "1", "mu", "Leaflet, page 1"),)


def translate(test: ExportedTest) -> Translation:
    """Write the leaflet."""
    friction = f"{test.case.grain_grain.static_friction:g}"
    rows = (Translated("friction", friction, "mu"), Translated("test", test.case.scene.name, "left out"))
    warnings = ("the leaflet lacks the test", *mechanism_warnings(test.case, "Leaflet"))
    return Translation({"leaflet.txt": f"mu = {friction}\n"}, "leaflet.txt", (), "", rows, warnings)


LEAFLET = Exporter("Leaflet", "none", "in all", lambda material: (), terms, translate)

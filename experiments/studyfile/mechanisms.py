"""``[mechanism.NAME]`` sections: physical effects of contacts in addition to the base law."""

from __future__ import annotations

from dem_warp import MECHANISMS, Mechanism
from dem_warp.laws.mechanism import clashes
from experiments.studyfile.generated import EngineSection, LibrarySection, library_section


class MechanismSection(EngineSection):
    """``[mechanism.NAME]``: parameters of a mechanism, and the contacts that have it."""

    plain_numbers = True


class MechanismsSection(LibrarySection):
    """``[mechanism]``: the mechanisms of a study, in the order of the library."""

    def mechanisms(self) -> tuple[Mechanism, ...]:
        """Build the engine's mechanisms; ValueError where two of them exclude each other."""
        built = tuple(section.build() for section in self.given.values())
        for kind in ("grains", "walls"):
            for name, other in clashes(tuple(one for one in built if one.acts_between(kind))):
                rule = f"mechanism.{name} and mechanism.{other} must not act in one contact"
                raise ValueError(f"{rule}, got both between {kind}")
        return built


def mechanisms_section() -> type[MechanismsSection]:
    """Generate the section of the mechanisms of the library, as it is now."""
    return library_section(MechanismsSection, MechanismSection, *MECHANISMS.items())

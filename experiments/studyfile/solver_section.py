"""``[solver]``: the conventions of the contact law, those of a code by name or law by law."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Self

from pydantic import Field, ValidationError, ValidationInfo, model_validator

from dem_warp import EDEM, PRESETS, ContactLaws
from experiments.io.errors import StudyError
from experiments.io.texts import nearest_name
from experiments.studyfile.generated import EngineSection, section_for
from experiments.studyfile.schema import Generated, Section, nested_error

BASE = "base"
"""Key of ``[solver.laws]`` that names the set of which its other keys change something."""

LAWS, CARD_LAWS = "laws", "card_laws"
CORRECTED_FOR, CARD_SOLVER = "corrected_for", "card_solver"
"""Keys of ``[solver]``."""

OWN_SOLVER = "dem-warp"
"""Name of the solver of a study without ``[engine]``."""

UNNAMED = "edem"
"""Set of a study, and of a card, that names no laws: the only one while laws had no names."""


class LawsSection(EngineSection):
    """``[solver.laws]``: a set of laws, changed law by law."""

    base: str = UNNAMED
    """Name of the set that holds for the other keys."""

    @model_validator(mode="after")
    def _can_be(self) -> Self:
        self.laws()
        return self

    def laws(self) -> ContactLaws:
        """Build the engine's laws; ValueError where the choices do not go together."""
        own = {name: getattr(self, name) for name in self.model_fields_set if name != BASE}
        return replace(_named(self.base), **own)


def laws_section() -> type[Section]:
    """Generate the section of laws law by law."""
    return section_for(ContactLaws, LawsSection)


@dataclass(frozen=True)
class _Laws(Generated):
    """Marks a field as a set of laws: its name, or a table law by law."""

    def read(self, value: object, info: ValidationInfo) -> Any:
        """Read a set of laws."""
        if isinstance(value, ContactLaws):
            return value
        if isinstance(value, str):
            return _named(value)
        if not isinstance(value, Mapping):
            raise ValueError('must name a set of laws, e.g. laws = "liggghts", or be a table law by law')
        try:
            return laws_section().model_validate(value, context=info.context).laws()  # type: ignore[attr-defined]
        except ValidationError as error:
            raise nested_error(error.errors()) from None


def _named(name: str) -> ContactLaws:
    if name not in PRESETS:
        raise ValueError(f"must be a set of laws, {nearest_name(name, list(PRESETS))}")
    return PRESETS[name]


class SolverSection(Section):
    """``[solver]``: the conventions that the coefficients hold for."""

    laws: Annotated[Any, _Laws(laws_section, UNNAMED)] = EDEM
    """Set of laws by the name of its code, or a table law by law. Default: the base law, ``"edem"``."""
    card_laws: str | None = Field(default=None)
    """Laws of the material card, where it was found with others than the study's; the report says so."""
    corrected_for: str | None = Field(default=None)
    """Solver that a bridge has corrected the values for; a study takes it from its material card."""
    card_solver: str | None = Field(default=None)
    """Solver of the correction, where the study runs in another one and takes the values as they are."""

    def check_solver(self, name: str, place: str) -> None:
        """Refuse to run values corrected for one solver in another, unless the study says so."""
        if self.corrected_for in (None, name, self.card_solver):
            return
        solver = self.corrected_for
        problem = f"the values of the card must run in {solver!r}, which a bridge has corrected them for"
        hint = f'Name it as [engine], or set {CARD_SOLVER} = "{solver}" to take the values as they are.'
        raise StudyError(place, problem, name, hint)


def laws_of(solver: Mapping[str, Any]) -> ContactLaws:
    """Return the laws that a ``[solver]`` names."""
    return SolverSection.model_validate(solver).laws  # type: ignore[no-any-return]


def written(laws: ContactLaws) -> str | dict[str, Any]:
    """Write laws as a study file does: the name of a set, or a table law by law."""
    if laws.name in PRESETS:
        return laws.name
    base, own = EDEM.to_dict(), laws.to_dict()
    return {BASE: UNNAMED} | {name: value for name, value in own.items() if value != base[name]}

"""``[mechanism.NAME]`` sections: physical effects of contacts beside those of the base law."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, Literal

from pydantic import Field, create_model

from dem_warp.laws.library import MECHANISMS
from dem_warp.laws.mechanism import Mechanism, clashes
from experiments.studyfile.schema import Number, Section


def _section(kind: type[Mechanism]) -> Any:
    """Build the section of a mechanism: its parameters in SI, and which contacts have it."""
    defaults = {field.name: field.default for field in fields(kind)}
    parameters: dict[str, Any] = {
        name: (Number, Field(default=defaults[name], ge=0.0)) for name in kind.parameter_names()
    }
    between: Any = (Literal["all", "grains", "walls"], defaults["between"])
    return create_model(f"{kind.__name__}Section", __base__=Section, between=between, **parameters)


class _Mechanisms(Section):
    """The mechanisms of a study, in the order of the library."""

    def mechanisms(self) -> tuple[Mechanism, ...]:
        """Build the engine's mechanisms: those that the study names.

        Raises
        ------
        ValueError
            When a parameter leaves what is physical, or two of them exclude each other.
        """
        named = [(kind, getattr(self, name)) for name, kind in MECHANISMS.items()]
        built = tuple(kind(**dict(section)) for kind, section in named if section is not None)
        for kind in ("grains", "walls"):
            for name, other in clashes(tuple(one for one in built if one.acts_between(kind))):
                rule = f"mechanism.{name} must not stand beside mechanism.{other} in one contact"
                raise ValueError(f"{rule}, got both between {kind}")
        return built


_SECTIONS: dict[str, Any] = {name: (_section(kind) | None, None) for name, kind in MECHANISMS.items()}

MechanismsSection: Any = create_model("MechanismsSection", __base__=_Mechanisms, **_SECTIONS)
"""``[mechanism]``: a section for each one of the library."""

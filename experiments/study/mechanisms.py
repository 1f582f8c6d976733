"""``[mechanism.NAME]`` sections: physical effects of contacts beside those of the base law."""

from __future__ import annotations

from dataclasses import fields
from itertools import permutations
from typing import Any, Literal

from pydantic import Field, create_model

from dem_warp.laws.library import MECHANISMS
from dem_warp.laws.mechanism import Mechanism
from experiments.study.schema import Number, Section


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
        for one, other in permutations(built, 2):
            if other.name in one.excludes and _meet(one, other):
                rule = f"mechanism.{one.name} must not stand beside mechanism.{other.name} in one contact"
                raise ValueError(f"{rule}, got {one.between!r} and {other.between!r}")
        return built


def _meet(one: Mechanism, other: Mechanism) -> bool:
    return any(one.acts_between(kind) and other.acts_between(kind) for kind in ("grains", "walls"))


_SECTIONS: dict[str, Any] = {name: (_section(kind) | None, None) for name, kind in MECHANISMS.items()}

MechanismsSection: Any = create_model("MechanismsSection", __base__=_Mechanisms, **_SECTIONS)
"""``[mechanism]``: a section for each one of the library."""

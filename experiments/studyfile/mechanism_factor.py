"""Physical effects that a study may lack: each is a factor with a null, in the units of the study."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from doe.discrepancy import MechanismRange
from experiments.io.units import Quantity
from experiments.studyfile.study import Study


@dataclass(frozen=True, kw_only=True)
class MechanismFactor(MechanismRange):
    """A physical effect that a study may lack, as a factor with a null.

    Its name is that in every table, and of the factor; if it has a direction, the study has it along x.
    """

    title: str
    sentence: str
    """Its name in physics, and an explanation in plain language."""
    kind: str
    """Place where it acts: in the contacts, in the test, or as a property of the grains."""
    parameters: tuple[str, ...]
    """Place, or places of one value, in the study."""
    unit: str
    """Unit of the sizes, ``1`` for a plain number."""
    source: str
    confirm: str
    """Source of law and range, and the further experiment that would show it."""
    companions: tuple[tuple[str, float | str], ...] = ()
    """Further settings that it needs in the study, by place."""

    def table(self, low: float, high: float) -> dict[str, Any]:
        """Return the ``[[factor]]`` of a study that has it, with this range."""
        unit = "" if self.unit == "1" else self.unit
        ends = {"low": Quantity(low, unit), "high": Quantity(high, unit)}
        return {"name": self.name, "label": self.title, "parameter": list(self.parameters), **ends}


def with_mechanisms(
    study: Study,
    mechanisms: Collection[MechanismFactor],
    ranges: Mapping[str, tuple[float, float]] | None = None,
) -> Study:
    """Add mechanisms of the study's library to it, each as one more factor.

    A mechanism without a range of its own in ``ranges`` goes from its null to its maximum. Raise StudyError
    when the study cannot have one, or two of them exclude each other.
    """
    chosen = {one.name: (one.null, one.maximum) for one in mechanisms} | dict(ranges or {})
    tables = [one.table(*chosen[one.name]) for one in mechanisms]
    return study.with_factors(tables, dict(pair for one in mechanisms for pair in one.companions))

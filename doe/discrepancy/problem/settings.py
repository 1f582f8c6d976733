"""Rules of an analysis, decided before the data are opened.

They are written to a file, and every result has the hash of that text: later changes would show.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from numbers import Integral
from pathlib import Path
from typing import Any

from doe.arguments import MOST
from doe.errors import RuleError


@dataclass(frozen=True)
class Settings:
    """Levels, margins and numbers of runs."""

    bank_points: int = 128
    bank_repeats: int = 2
    """Points of the bank without a mechanism, and runs of each (their scatter is the noise)."""
    bank_mechanism_points: int = 48
    """Points for each mechanism, one run each."""
    false_alarm: float = 0.025
    """Probability of a reported gap in a model that lacks nothing."""
    fit_level: float = 0.025
    """P value of a model's disagreement with the data below which it is rejected: the share of true models
    that are lost (``trials/record/README.md``)."""
    least_ratio: float = 3.0
    """Least size over standard error of a named mechanism."""
    pair_ratio: float = 5.0
    """The same for each of two mechanisms named together: pairs are many, and two wrong ones compensate each
    other."""
    tie_margin: float = 8.0
    """Distance from the best within which mechanisms are a tie: Q plus the logarithm of the determinant, less
    twice the held-out gain, which is minus twice a log-likelihood (`rivals.lag`, `rivals.is_open`)."""
    power: float = 0.8
    """Probability at which ``Power.detectable_size`` is stated."""
    systematic: float = 0.1
    """Standard deviation that instruments and numerics add to every mean, in units of that of one run."""
    draws: int = 4000
    """Draws of every bootstrap."""
    shortlist_share: float = 0.3
    """Error of the emulator as a share of the base's excess: models within it of the best, and of a fit, are
    simulated again."""
    shortlist: int = 3
    """Largest number of models that are simulated again at first; half as many in every next round."""
    refinement_points: int = 6
    refinement_repeats: int = 2
    """Fresh points around an optimum, and runs of each, in every condition."""
    refinement_rounds: int = 3
    """Largest number of times that the optima are simulated again."""
    finish_points: int = 12
    """Fresh points in the last round, around the leader's optimum and those of models that may overtake it.
    """
    pair_candidates: int = 12
    """Number of pairs that are tried: those whose members' residuals promise most."""
    direct_runs: int = 8
    """Fresh runs per model and condition at the final optimum."""
    resolvable: tuple[str, ...] | None = None
    """Mechanisms that may be named. None: all that the data distinguish from every other."""

    def __post_init__(self) -> None:
        for name in ("false_alarm", "fit_level", "power"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise RuleError(f"Settings.{name}", "must be between 0 and 1", getattr(self, name))
        least = {"bank_points": 10, "bank_repeats": 2, "bank_mechanism_points": 4, "draws": 100}
        least |= {"shortlist": 1, "refinement_points": 2, "refinement_repeats": 2, "refinement_rounds": 1}
        least |= {"finish_points": 0, "pair_candidates": 0, "direct_runs": 2}
        for name, value in least.items():
            number = getattr(self, name)
            if not isinstance(number, Integral) or not value <= int(number) <= MOST:
                rule = f"must be a whole number of at least {value} and at most {MOST:,}"
                raise RuleError(f"Settings.{name}", rule, number)
        for name in ("least_ratio", "pair_ratio", "tie_margin", "systematic", "shortlist_share"):
            if not getattr(self, name) >= 0.0:
                raise RuleError(f"Settings.{name}", "must not be negative", getattr(self, name))

    @property
    def text(self) -> str:
        """The settings as text."""
        return json.dumps(asdict(self), indent=2) + "\n"

    @property
    def sha256(self) -> str:
        """Hash of the text, hexadecimal."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    def write(self, path: Path) -> None:
        """Write the text to a file."""
        path.write_text(self.text, encoding="utf-8")


def settings_of(document: Mapping[str, Any], place: str) -> Settings:
    """Build settings from values by name; the others keep their defaults.

    Raises
    ------
    RuleError
        An unknown name or a value out of its range, with its place.
    """
    known = {field.name for field in fields(Settings)}
    for name in document:
        if name not in known:
            raise RuleError(place, f"must be one of {', '.join(sorted(known))}", name)
    named = document.get("resolvable")
    return Settings(**{**document, "resolvable": None if named is None else tuple(named)})

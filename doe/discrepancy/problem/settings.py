"""The rules of an analysis: everything that is decided before the data are opened.

They are written to a file, and the hash of that text stands in every result: rules that were bent
afterwards would show.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from numbers import Integral
from pathlib import Path
from typing import Any

from doe.errors import RuleError

MOST = 100_000
"""Most of whatever is counted: more fill memory and time before anything runs."""


@dataclass(frozen=True)
class Settings:
    """Levels, margins and numbers of runs."""

    bank_points: int = 128
    bank_repeats: int = 2
    """Points of the library waves without a mechanism, and runs of each (their scatter is the noise)."""
    bank_mechanism_points: int = 48
    """Points for each mechanism, one run each."""
    false_alarm: float = 0.025
    """Probability that a model that lacks nothing is said to lack something."""
    fit_level: float = 0.025
    """A model whose disagreement with the data has a smaller p value is not admitted. It is the share of true
    models that are lost; the larger it is, the more of what the library lacks is seen to lack. In five series
    of blind trials the hidden effect had a p value from here to 0.1 in 17 of 539, and where the library lacks
    it the closest had one in 3 of 253."""
    least_ratio: float = 3.0
    """Least size over standard error of a mechanism that is named."""
    pair_ratio: float = 5.0
    """The same for each of two mechanisms named together: there are many more pairs to choose among, and two
    wrong ones make up for much."""
    tie_margin: float = 8.0
    """Mechanisms within so much of the best are a tie: in Q plus the logarithm of the determinant, less twice
    the held-out gain, which is minus twice a log-likelihood; a prediction's being uncertain counts for half
    of it at most (`conclusion.lag`). Those that should look the same are one within somewhat more
    (`conclusion.is_open`)."""
    power: float = 0.8
    """Probability at which ``Power.detectable_size`` is stated."""
    systematic: float = 0.1
    """Standard deviation, in units of that of one run, of what instruments and numerics add to every
    mean."""
    draws: int = 4000
    """Draws of every bootstrap."""
    shortlist_share: float = 0.3
    """By so much of the base's excess the emulator may be wrong: models within it of the best, and of a fit,
    are simulated again."""
    shortlist: int = 3
    """Most models that are simulated again at first; half as many in every next round."""
    refinement_points: int = 6
    refinement_repeats: int = 2
    """Fresh points around an optimum, and runs of each, in every condition."""
    refinement_rounds: int = 3
    """Most times that the optima are simulated again."""
    finish_points: int = 12
    """Fresh points at last around the leader's optimum, and around those of models that might overtake it."""
    pair_candidates: int = 12
    """So many pairs are tried: those that the residuals of their members promise most of."""
    direct_runs: int = 8
    """Fresh runs a model and condition at the final optimum."""
    resolvable: tuple[str, ...] | None = None
    """Mechanisms that may be named. None: any that the data tell from every other."""

    def __post_init__(self) -> None:
        for name in ("false_alarm", "fit_level", "power"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise RuleError(f"Settings.{name}", "must lie between 0 and 1", getattr(self, name))
        least = {"bank_points": 10, "bank_repeats": 2, "bank_mechanism_points": 4, "draws": 100}
        least |= {"shortlist": 1, "refinement_points": 2, "refinement_repeats": 2, "refinement_rounds": 1}
        least |= {"finish_points": 0, "pair_candidates": 0, "direct_runs": 2}
        for name, value in least.items():
            if not isinstance(getattr(self, name), Integral):
                raise RuleError(f"Settings.{name}", "must be a whole number", getattr(self, name))
            if getattr(self, name) < value:
                raise RuleError(f"Settings.{name}", f"must be at least {value}", getattr(self, name))
            if getattr(self, name) > MOST:
                raise RuleError(f"Settings.{name}", f"must be at most {MOST:,}", getattr(self, name))
        for name in ("least_ratio", "pair_ratio", "tie_margin", "systematic", "shortlist_share"):
            if not getattr(self, name) >= 0.0:
                raise RuleError(f"Settings.{name}", "must not be negative", getattr(self, name))

    @property
    def text(self) -> str:
        """The settings as they are written and hashed."""
        return json.dumps(asdict(self), indent=2) + "\n"

    @property
    def sha256(self) -> str:
        """Hash of the text, hexadecimal."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    def write(self, path: Path) -> None:
        """Write the text to a file."""
        path.write_text(self.text, encoding="utf-8")


def settings_of(document: Mapping[str, Any], place: str) -> Settings:
    """Build settings from their values by name; what is left out has its default.

    Raises
    ------
    RuleError
        For an unknown name or a value out of its range, with its place.
    """
    known = {field.name for field in fields(Settings)}
    for name in document:
        if name not in known:
            raise RuleError(place, f"must be one of {', '.join(sorted(known))}", name)
    named = document.get("resolvable")
    return Settings(**{**document, "resolvable": None if named is None else tuple(named)})

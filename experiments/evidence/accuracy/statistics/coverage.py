"""One figure of the record: what is stated, how often it held, and in how many trials."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pandas as pd

SEED = 20240
"""Seed of every theme, joined with the number of the case: each case can be repeated alone."""

SLACK = 0.01
"""A figure of .95 holds from .94 to .96, "at least .95" from .94 on; a level of .05 from .04 to .06."""

ERRORS = 2.0
"""Standard errors by which a share may lie outside: by chance, not by a wrong figure."""

EXACT, AT_LEAST, AT_MOST = "exact", "at least", "at most"
PROMISES = (EXACT, AT_LEAST, AT_MOST)


@dataclass(frozen=True)
class Figure:
    """A stated probability and its share in a simulation."""

    figure: str
    """Statement that is tested, such as ``compatible_region``."""
    case: str
    stated: float
    promise: str
    """One of `PROMISES`: how the documentation states it."""
    found: float
    trials: int
    """Independent repetitions; each may hold several draws."""
    spread: float | None = None
    """Standard deviation of a trial's share, None where a trial is a yes or no."""

    def __post_init__(self) -> None:
        if self.promise not in PROMISES:
            raise ValueError(f"promise is one of {', '.join(PROMISES)}, got {self.promise!r}")
        for name in ("stated", "found"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} lies between 0 and 1, got {getattr(self, name)}")

    @property
    def se(self) -> float:
        """Standard error of the share, by the trials."""
        spread = math.sqrt(self.found * (1.0 - self.found)) if self.spread is None else self.spread
        return spread / math.sqrt(self.trials)

    @property
    def holds(self) -> bool:
        """The share keeps the promise within `SLACK`, or misses it by no more than `ERRORS` of its own."""
        slack = SLACK + ERRORS * self.se
        too_low = self.found < self.stated - slack and self.promise != AT_MOST
        too_high = self.found > self.stated + slack and self.promise != AT_LEAST
        return not (too_low or too_high)


CHECKED = 20
"""Trials of every case that go through `doe` itself, next to the vectorised computation of all."""


def require_same(figure: str, found: object, expected: object, near: float = 1e-6) -> None:
    """Raise unless the vectorised computation gives what `doe` gives (to rounding, or a search's end)."""
    ours, theirs = np.asarray(found, float), np.asarray(expected, float)
    if not np.allclose(ours, theirs, rtol=near, atol=1e-3 * near):
        raise ValueError(f"{figure}: the record computes {found}, doe gives {expected}")


def generator(theme: str, case: int) -> np.random.Generator:
    """Return the random numbers of one case of a theme."""
    return np.random.default_rng([SEED, *theme.encode(), case])


def figures_table(figures: Iterable[Figure]) -> pd.DataFrame:
    """Lay out figures, one a row, with the standard error of the share and whether it holds."""
    rows = [
        {
            "figure": f.figure,
            "case": f.case,
            "stated": f.stated,
            "promise": f.promise,
            "found": round(f.found, 4),
            "se": round(f.se, 4),
            "trials": f.trials,
            "holds": f.holds,
        }
        for f in figures
    ]
    return pd.DataFrame(rows)

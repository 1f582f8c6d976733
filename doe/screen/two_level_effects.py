"""Effects of a two-level design without error: main effects and interactions by Lenth's method."""

from dataclasses import dataclass
from functools import cache, cached_property
from itertools import combinations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from doe.arguments import checked_count, checked_flag, checked_kind, checked_level
from doe.design.anova import block_columns
from doe.design.design import Design, observations
from doe.design.families.aliases import two_level_runs
from doe.design.polynomial_terms import Term, parsed_terms, term_name
from doe.errors import DesignError

SMALL = 1e-9

LENTH_DRAWS = 100_000
"""Drawn sets of inert effects behind Lenth's limits: that of 8 runs and .05 is known to 0.4 % of itself."""

SEED = 1
"""Seed of the draws: equal effects give equal limits."""


@dataclass(frozen=True, eq=False)
class TwoLevelEffects:
    """Effects of a two-level design; made by ``two_level_effects``."""

    design: Design
    table: pd.DataFrame
    """Table by effect, largest first: effect, ratio (to the pseudo error), p, effects mixed with it."""
    pseudo_error: float
    """Lenth's pseudo standard error of an effect."""
    count: int
    """Number of effects behind the pseudo error."""

    def limit(self, alpha: float = 0.05, together: bool = False) -> float:
        """Return the size above which an effect is significant.

        ``alpha`` is the share of false alarms of each effect; with ``together`` of all of them (the
        simultaneous margin).
        """
        level = checked_level(alpha)
        if checked_flag("together", together):
            level = 1.0 - (1.0 - level) ** (1.0 / self.count)
        return self.pseudo_error * float(np.quantile(orthogonal_null(self.count), 1.0 - level))

    def significant(self, alpha: float = 0.05) -> list[str]:
        """Return the effects with p below alpha, largest first."""
        return list(self.table.index[self.table["p"] < checked_level(alpha)])

    @cached_property
    def effects(self) -> pd.Series:
        """Effects by name, in the order of the model."""
        return self.table["effect"].sort_index(
            key=lambda names: [len(str(name).split(":")) for name in names]
        )

    def __repr__(self) -> str:
        found = ", ".join(self.significant()) or "none"
        return f"{len(self.table)} effects, pseudo error {self.pseudo_error:.4g}; beyond it at 0.05: {found}"


def two_level_effects(design: Design, response: ArrayLike, order: int | None = None) -> TwoLevelEffects:
    """Return main effects and interactions of a two-level design, tested by Lenth's method.

    It is for a design whose effects take every degree of freedom: few of them are active, the others measure
    the noise (Lenth, Technometrics 31, 1989, p. 469). p and limits are shares of drawn sets of inert effects
    (Ye and Hamada, J. Qual. Technol. 32, 2000, p. 57), not of the t distribution that Lenth proposed, which
    is too strict with few effects. Effects that coincide are one row, under the name of the lowest order.
    Effects lost to blocks or dummies are left out. Center runs do not count.

    Parameters
    ----------
    design : Design
        Orthogonal two-level design.
    response : array-like, shape (runs,) or (runs, replicates)
        Replicates are averaged.
    order : int, optional
        Largest number of factors of an interaction. Default: all.

    Raises
    ------
    DesignError
        Effects that coincide partly (a Plackett-Burman design: ``screen`` it), or fewer than 5.
    """
    checked_kind("design", design, Design)
    _, values = observations(design, response)
    means = values.groupby(level=0, sort=False).mean()
    coded = two_level_runs(design)
    y = means.loc[coded.index].to_numpy()
    highest = len(design.names) if order is None else min(checked_count("order", order), len(design.names))
    rows, mixed = _distinct(coded, design.names, highest)
    columns = np.column_stack([coded[list(term)].prod(axis=1) for term in rows])
    blocks = None if design.blocks is None else design.blocks.loc[coded.index]
    lost = np.column_stack([np.ones(len(coded)), block_columns(blocks, coded.index).to_numpy()])
    free = np.abs(lost.T @ columns).max(axis=0) < SMALL * len(coded)
    columns, rows = columns[:, free], [term for term, kept in zip(rows, free, strict=True) if kept]
    products = columns.T @ columns / len(coded)
    if not np.allclose(products, np.eye(len(rows)), atol=SMALL):
        raise DesignError("effects coincide partly here: use screen, or fit_surface with some terms")
    if len(rows) < 5:
        raise DesignError(f"effects for Lenth's method must be five or more, got {len(rows)}")
    effects = 2.0 * columns.T @ y / len(coded)
    error = float(pseudo_error(effects[None, :])[0])
    if not error > 1e-12 * np.abs(effects).max():
        raise DesignError("effects for Lenth's error must not be zero: more than half of them are")
    ratio = effects / error
    drawn = orthogonal_null(len(rows))
    above = len(drawn) - np.searchsorted(drawn, np.abs(ratio), side="left")
    names = [term_name(term) for term in rows]
    table = pd.DataFrame(
        {
            "effect": effects,
            "ratio": ratio,
            "p": (above + 1.0) / (len(drawn) + 1.0),
            "mixed with": [", ".join(mixed[term]) for term in rows],
        },
        index=pd.Index(names, name="effect of"),
    )
    table = table.sort_values("effect", key=np.abs, ascending=False, kind="stable")
    return TwoLevelEffects(design, table, error, len(rows))


def _distinct(coded: pd.DataFrame, names: list[str], order: int) -> tuple[list[Term], dict[Term, list[str]]]:
    """Return the effects whose columns differ, lowest order first, and those mixed with each."""
    written = [":".join(chosen) for size in range(1, order + 1) for chosen in combinations(names, size)]
    found: dict[tuple[float, ...], Term] = {}
    mixed: dict[Term, list[str]] = {}
    for term in parsed_terms(written, names):
        column = coded[list(term)].prod(axis=1).to_numpy()
        if np.ptp(column) == 0.0:  # a word of the defining relation: the mean
            continue
        sign = column[0]
        key = tuple(sign * column)
        if key in found:
            first = found[key]
            same = sign == coded[list(first)].prod(axis=1).iloc[0]
            mixed[first].append(("" if same else "-") + term_name(term))
        else:
            found[key] = term
            mixed[term] = []
    return list(found.values()), mixed


def pseudo_error(effects: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Lenth's pseudo standard error of each row of effects."""
    size = np.abs(effects)
    limit = 2.5 * 1.5 * np.median(size, axis=1, keepdims=True)
    return np.asarray(1.5 * np.nanmedian(np.where(size <= limit, size, np.nan), axis=1))


@cache
def orthogonal_null(count: int) -> NDArray[np.float64]:
    """Return the absolute t of ``count`` inert effects of equal variance, drawn repeatedly, ascending."""
    effects = np.random.default_rng(SEED).standard_normal((LENTH_DRAWS, count))
    return np.sort(np.abs(effects) / pseudo_error(effects)[:, None], axis=None)

"""Aliases of a two-level design: inseparable effects, words and resolution."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from doe.arguments import checked_count, checked_kind
from doe.design.design import Design
from doe.design.polynomial_terms import Term, term_name
from doe.errors import DesignError

ROMAN = {3: "III", 4: "IV", 5: "V", 6: "VI", 7: "VII", 8: "VIII"}
LONGEST_WORD = 8
"""Longest word that is searched; a resolution above it no longer matters."""

SMALL = 1e-9


@dataclass(frozen=True, eq=False)
class AliasStructure:
    """Effects that a two-level design mixes up; made by ``alias_structure``. Its text describes them."""

    matrix: pd.DataFrame
    """Correlation of the columns of every two effects, from -1 to +1; +-1: inseparable."""
    word_length: float
    """Length of the shortest word; infinite without words (a full factorial)."""
    share: float
    """Largest share of an effect that such a word hides: 1 in a regular fraction."""
    words: tuple[str, ...]
    """Words of that length that hide an effect wholly, signed: ``-A:B:C`` is constantly -1."""

    @property
    def resolution(self) -> float:
        """Length of the shortest word, plus the share that a partial one leaves (Deng and Tang 1999)."""
        return self.word_length + (1.0 - self.share) if np.isfinite(self.word_length) else np.inf

    @property
    def resolution_text(self) -> str:
        """Resolution in Roman numerals: ``IV``; ``full`` without aliases, ``III, partly``."""
        if not np.isfinite(self.word_length):
            return "full"
        roman = ROMAN[int(self.word_length)]
        return roman if self.share > 1.0 - SMALL else f"{roman}, partly"

    def of(self, effect: str) -> pd.Series:
        """Return the effects mixed into an effect, with share and sign, largest first."""
        if effect not in self.matrix.index:
            raise DesignError(f"no effect {effect!r} here; there are {', '.join(self.matrix.index)}")
        row = self.matrix.loc[effect].drop(effect)
        return row[row.abs() > SMALL].sort_values(key=np.abs, ascending=False, kind="stable")

    @property
    def chains(self) -> list[str]:
        """Groups of inseparable effects: ``A = B:C = -D:E``."""
        values, names, seen, chains = self.matrix.to_numpy(), list(self.matrix.index), set(), []
        for place, name in enumerate(names):
            if place in seen:
                continue
            group = np.flatnonzero(np.abs(values[place]) > 1.0 - SMALL)
            seen.update(group.tolist())
            others = [("-" if values[place, k] < 0 else "") + names[k] for k in group if k != place]
            if others:
                chains.append(" = ".join([name, *others]))
        return chains

    def __str__(self) -> str:
        lines = [f"Resolution {self.resolution_text}."]
        if self.words:
            lines.append(f"Words of the defining relation of that length: {', '.join(self.words)}.")
        chains = self.chains
        lines += [f"Inseparable: {chain}." for chain in chains]
        mains = [name for name in self.matrix.index if ":" not in name]
        pairs = [name for name in self.matrix.index if name.count(":") == 1]
        cross = self.matrix.loc[mains, pairs].abs().to_numpy() if pairs else np.zeros((1, 1))
        if cross.max() <= SMALL:
            lines.append("No interaction of two factors falls onto a main effect.")
        elif cross.max() < 1.0 - SMALL:
            lines.append(
                "Interactions of two factors fall partly onto main effects: by up to "
                f"{100.0 * cross.max():.0f} % of their size."
            )
        if not chains:
            lines.append("No two of these effects fall wholly together.")
        return "\n".join(lines)


def alias_structure(design: Design, order: int = 2) -> AliasStructure:
    """Return the main effects and interactions that a two-level design mixes up.

    It works for regular fractions, whose effects coincide wholly, and for others (Plackett-Burman), where
    they coincide partly. Runs at the center do not count.

    Parameters
    ----------
    order : int
        Largest number of factors of a listed interaction.

    Raises
    ------
    DesignError
        A factor with other levels than -1 and +1.
    """
    checked_kind("design", design, Design)
    order = min(checked_count("order", order), len(design.names))
    coded = two_level_runs(design)
    names = design.names
    terms: list[Term] = [term for size in range(1, order + 1) for term in itertools.combinations(names, size)]
    columns = np.column_stack([coded[list(term)].prod(axis=1) for term in terms])
    columns = columns - columns.mean(axis=0)
    length = np.linalg.norm(columns, axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        matrix = np.nan_to_num((columns.T @ columns) / np.outer(length, length))
    np.fill_diagonal(matrix, 1.0)
    labels = [term_name(term) for term in terms]
    word_length, share, words = shortest_words(coded.to_numpy(), names)
    return AliasStructure(pd.DataFrame(matrix, labels, labels), word_length, share, words)


def two_level_runs(design: Design) -> pd.DataFrame:
    """Return coded runs without those at the center; raise DesignError for a factor of other levels."""
    points = design.points
    coded = points[~(points == 0.0).all(axis=1)]
    for name in coded:
        odd = coded.index[coded[name].abs() != 1.0]
        if len(odd):
            raise DesignError(
                f"aliases are those of a two-level design: factor {name!r} is {coded.loc[odd[0], name]:g} "
                f"(coded) in run {odd[0]}"
            )
    if coded.empty:
        raise DesignError("aliases are those of a two-level design: every run is at the center")
    return coded


def shortest_words(coded: NDArray[np.float64], names: list[str]) -> tuple[float, float, tuple[str, ...]]:
    """Return length and share of the shortest words of a two-level design, and the whole ones."""
    for size in range(1, min(LONGEST_WORD, len(names)) + 1):
        shares = [(term, float(np.mean(product))) for term, product in _products(coded, names, size)]
        largest = max(abs(mean) for _, mean in shares)
        if largest > SMALL:
            whole = [(term, mean) for term, mean in shares if abs(mean) > 1.0 - SMALL]
            words = tuple(("-" if mean < 0.0 else "") + term_name(term) for term, mean in whole)
            return float(size), largest, words
    return np.inf, 1.0, ()


def _products(
    coded: NDArray[np.float64], names: list[str], size: int
) -> Iterator[tuple[Term, NDArray[np.float64]]]:
    for places in itertools.combinations(range(len(names)), size):
        yield tuple(names[place] for place in places), coded[:, places].prod(axis=1)

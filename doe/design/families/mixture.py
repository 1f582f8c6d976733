"""Mixture designs: shares of components that add up to one."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from doe import arguments, errors
from doe.design.design import numbered

TOLERANCE = 1e-9

MOST_TRIED = 10_000_000
"""Largest number of combinations of shares that are tried."""


@dataclass(frozen=True, eq=False)
class Mixture:
    """Blends in standard order.

    Parameters
    ----------
    shares : DataFrame, one row per blend
        Share of each component; every row adds up to 1.
    lower : mapping of float by component
        Least shares, to which the design is scaled (pseudo-components). Default: 0.
    seed : int, optional
        Seed of ``run_order``.
    """

    shares: pd.DataFrame
    lower: Mapping[str, float]
    seed: int | None = None

    def __post_init__(self) -> None:
        arguments.checked_kind("shares", self.shares, pd.DataFrame)
        arguments.checked_seed(self.seed)
        arguments.checked_map("lower", self.lower)
        for name in self.shares.columns:
            arguments.real_array(f"the shares of {name!r}", self.shares[name])
        if self.shares.empty:
            raise errors.DesignError("a mixture must have at least one blend, got an empty table")
        totals = self.shares.sum(axis=1)
        off = totals.index[~((totals - 1.0).abs() <= TOLERANCE)]
        if len(off) or not (self.shares >= -TOLERANCE).all(axis=None):
            place = off[0] if len(off) else self.shares.index[(self.shares < -TOLERANCE).any(axis=1)][0]
            raise errors.DesignError(
                f"shares must not be negative and add up to 1; blend {place} adds up to {totals[place]}"
            )

    @property
    def names(self) -> list[str]:
        """Names of the components."""
        return list(self.shares.columns)

    @property
    def run_order(self) -> pd.Index:
        """Labels in the order of execution."""
        if self.seed is None:
            return self.shares.index
        return self.shares.index[np.random.default_rng(int(self.seed)).permutation(len(self.shares))]

    def __repr__(self) -> str:
        return f"Mixture of {len(self.shares)} blends of {', '.join(self.names)}"


def simplex_lattice(
    components: Sequence[str],
    degree: int,
    *,
    interior: bool = False,
    lower: Mapping[str, float] | None = None,
    seed: int | None = None,
) -> Mixture:
    """Return the lattice of shares 0, 1/m, ..., 1, for a model of degree m (Scheffe 1958).

    Parameters
    ----------
    degree : int
        m, 1 or more; the lattice of q components has C(q + m - 1, m) blends.
    interior : bool
        Add the blend of equal shares and those half way to the pure components, which show if the model holds
        inside.
    lower : mapping of float by component, optional
        Least shares.
    seed : int, optional
        Seed of the run order.
    """
    names = _checked(components)
    degree = arguments.checked_count("degree", degree)
    count = len(names)
    if math.comb(count + degree - 1, degree) > arguments.MOST or (degree + 1) ** count > MOST_TRIED:
        raise errors.DesignError(f"a lattice of {count} components and degree {degree} has too many blends")
    rows = [row for row in itertools.product(range(degree, -1, -1), repeat=count) if sum(row) == degree]
    shares = np.array(rows) / degree
    if arguments.checked_flag("interior", interior):
        equal = np.full((1, count), 1.0 / count)
        shares = np.vstack([shares, equal, 0.5 * (np.eye(count) + equal)])
    return _scaled(names, shares, lower, seed)


def simplex_centroid(
    components: Sequence[str], *, lower: Mapping[str, float] | None = None, seed: int | None = None
) -> Mixture:
    """Return the equal blends of one, two, ... and all components (Scheffe 1963): 2^q - 1 of them."""
    names = _checked(components)
    count = len(names)
    rows = []
    for size in range(1, count + 1):
        for chosen in itertools.combinations(range(count), size):
            row = np.zeros(count)
            row[list(chosen)] = 1.0 / size
            rows.append(row)
    return _scaled(names, np.array(rows), lower, seed)


def _checked(components: Sequence[str]) -> list[str]:
    names = arguments.checked_list("components", components)
    for name in names:
        if not isinstance(name, str):
            raise errors.DesignError(f"a component's name must be text, got {name!r}")
    if len(names) < 2 or len(set(names)) < len(names):
        raise errors.DesignError(f"components must be two or more, all different, got {components!r}")
    return names


def _scaled(
    names: list[str], shares: np.ndarray, lower: Mapping[str, float] | None, seed: int | None
) -> Mixture:
    lower = {} if lower is None else arguments.checked_map("lower", lower)
    unknown = [name for name in lower if name not in names]
    if unknown:
        raise errors.DesignError(f"lower names {unknown[0]!r}, which is no component of {', '.join(names)}")
    least = np.array(
        [
            arguments.checked_number(f"the least share of {name!r}", lower.get(name, 0.0), least=0.0)
            for name in names
        ]
    )
    if not least.sum() < 1.0:
        raise errors.DesignError(f"least shares must not be negative and add up to less than 1, got {lower}")
    table = pd.DataFrame(least + (1.0 - least.sum()) * shares, columns=names)
    return Mixture(numbered(table), lower, seed)

"""Tables of points, from coded values to natural ones and back."""

from collections.abc import Iterable

import pandas as pd

from doe.design.factors import Factor


def natural_points(factors: Iterable[Factor], coded: pd.DataFrame) -> pd.DataFrame:
    """Return the natural values of coded points: columns are the factors' names, same index."""
    return pd.DataFrame({f.name: f.to_natural(coded[f.name]) for f in factors}, index=coded.index)


def coded_points(factors: Iterable[Factor], natural: pd.DataFrame) -> pd.DataFrame:
    """Return the coded values of natural points: columns are the factors' names, same index."""
    return pd.DataFrame({f.name: f.to_coded(natural[f.name]) for f in factors}, index=natural.index)

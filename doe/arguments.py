"""Checks of arguments: numbers, levels, counts, lists, arrays."""

import math
import numbers
from collections.abc import Collection, Iterable, Mapping
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe.errors import DesignError


def checked_number(name: str, value: Any, above: float = -math.inf, least: float = -math.inf) -> float:
    """Return a finite real number as a float, above ``above`` and at least ``least``.

    Raises DesignError: anything else, with the rule and the value.
    """
    if not isinstance(value, numbers.Real) or isinstance(value, bool | np.bool_):
        raise DesignError(f"{name} must be a number, got {value!r}")
    number = float(value)
    if not math.isfinite(number) or not number > above or not number >= least:
        raise DesignError(f"{name} must be {_range(above, least)}, got {value}")
    return number


def _range(above: float, least: float) -> str:
    if math.isfinite(above):
        return "positive and finite" if above == 0.0 else f"finite and above {above:g}"
    if math.isfinite(least):
        return "finite and not negative" if least == 0.0 else f"finite and at least {least:g}"
    return "finite"


Kind = TypeVar("Kind")


def checked_kind(name: str, value: Any, kind: type[Kind]) -> Kind:
    """Return a value; raise DesignError unless it is of a kind, such as a Design or a Surface."""
    if not isinstance(value, kind):
        raise DesignError(f"{name} must be a {kind.__name__}, got {value!r}")
    return value


def checked_list(name: str, values: Any) -> list:
    """Return values as a list; raise DesignError for a text, a mapping, a table or no iterable."""
    # a table is recognised by its columns: pandas need not be loaded to read factors
    if (
        not isinstance(values, Iterable)
        or isinstance(values, str | bytes | Mapping)
        or hasattr(values, "columns")
    ):
        raise DesignError(f"{name} must be a list, got {values!r}")
    return list(values)


def checked_flag(name: str, value: Any) -> bool:
    """Return a truth value; raise DesignError for anything else."""
    if not isinstance(value, bool | np.bool_):
        raise DesignError(f"{name} must be True or False, got {value!r}")
    return bool(value)


def checked_choice(name: str, value: Any, choices: Collection[str]) -> str:
    """Return a name; raise DesignError unless it is one of the choices."""
    if not isinstance(value, str) or value not in choices:
        raise DesignError(f"{name} must be one of {', '.join(choices)}, got {value!r}")
    return value


def checked_map(name: str, value: Any) -> dict:
    """Return a mapping, or a Series, as a dict; raise DesignError for anything else."""
    import pandas as pd

    if not isinstance(value, Mapping | pd.Series):
        raise DesignError(f"{name} must be a mapping by name, got {value!r}")
    return dict(value)


def checked_seed(value: Any) -> int | None:
    """Return a seed: a whole number that is not negative, or None."""
    return None if value is None else checked_count("seed", value, least=0)


def checked_level(value: Any, name: str = "alpha") -> float:
    """Return a probability between 0 and 1, such as the level of a test."""
    if not isinstance(value, numbers.Real) or isinstance(value, bool) or not 0.0 < float(value) < 1.0:
        raise DesignError(f"{name} must be between 0 and 1, got {value!r}")
    return float(value)


MOST = 100_000
"""Limit on runs, levels, center runs and steps: more would fill the memory."""


def checked_count(name: str, value: Any, least: int = 1, most: float = math.inf) -> int:
    """Return a whole number that is at least ``least`` and at most ``most``."""
    whole = isinstance(value, numbers.Real) and not isinstance(value, bool | np.bool_)
    if not whole or not math.isfinite(value) or int(value) != value or int(value) < least:
        raise DesignError(f"{name} must be a whole number of at least {least}, got {value!r}")
    if value > most:
        raise DesignError(f"{name} must be at most {most}, got {value}")
    return int(value)


def checked_df(name: str, value: Any) -> float:
    """Return degrees of freedom: a positive number, which may be infinite."""
    if not isinstance(value, numbers.Real) or isinstance(value, bool) or not float(value) > 0.0:
        raise DesignError(f"{name} must be positive, got {value!r}")
    return float(value)


def real_array(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Return values as a float array; the caller checks that they are finite.

    Raises DesignError: masked values, dates, text, objects, complex numbers, truth values or rows of
    different lengths.
    """
    if isinstance(values, np.ma.MaskedArray) and np.ma.getmaskarray(values).any():
        place = tuple(int(i) + 1 for i in np.argwhere(np.ma.getmaskarray(values))[0])
        raise DesignError(f"{name} must have no masked value, got one at position {place}")
    if isinstance(values, str | bytes | dict | set) or values is None:
        raise DesignError(f"{name} must be numbers, got {values!r}")
    if getattr(getattr(values, "dtype", None), "name", "") == "category":
        raise DesignError(f"{name} must be real numbers, got categories")
    try:
        array = np.asarray(values)
        if array.dtype == object:  # pandas' missing values, Python's fractions and decimals, or no numbers
            import pandas as pd

            if any(isinstance(value, str | bytes | bool | complex) for value in array.ravel()):
                raise TypeError("text, truth values or complex numbers")
            array = np.asarray(pd.DataFrame(array.reshape(array.shape[0], -1)), dtype=np.float64).reshape(
                array.shape
            )
        if array.dtype.kind not in "iuf":
            raise TypeError(f"they are of type {array.dtype}")
        return np.array(array, dtype=np.float64)
    except (TypeError, ValueError, IndexError) as error:
        raise DesignError(f"{name} must be real numbers in equal rows: {error}") from None


def checked_points(coded: ArrayLike, factor_count: int) -> NDArray[np.float64]:
    """Return coded points, shape (points, factors); one point may be given as a row of its own."""
    points = np.atleast_2d(real_array("coded points", coded))
    if points.ndim != 2 or points.shape[1] != factor_count:
        raise DesignError(f"coded points must have shape (points, {factor_count}), got {points.shape}")
    if not np.isfinite(points).all():
        raise DesignError(f"coded points must be finite, got {points[~np.isfinite(points)][0]}")
    return points

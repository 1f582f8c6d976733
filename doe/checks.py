"""Rules that every number given to this package must keep: real, finite, a level, a count."""

import math
import numbers
from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from doe.errors import DesignError


def checked_number(name: str, value: Any, above: float = -math.inf, least: float = -math.inf) -> float:
    """Return a finite real number as a float.

    Parameters
    ----------
    name : str
        What the number is, for the error.
    value
        What was received.
    above, least : float
        It must be larger than ``above``, and at least ``least``.

    Raises
    ------
    DesignError
        Anything else, with the rule and what was received.
    """
    if not isinstance(value, numbers.Real) or isinstance(value, bool | np.bool_):
        raise DesignError(f"{name} must be a number, received {value!r}")
    number = float(value)
    if not math.isfinite(number) or not number > above or not number >= least:
        raise DesignError(f"{name} must be {_range(above, least)}, received {value}")
    return number


def _range(above: float, least: float) -> str:
    if math.isfinite(above):
        return "positive and finite" if above == 0.0 else f"finite and above {above:g}"
    if math.isfinite(least):
        return "finite and not negative" if least == 0.0 else f"finite and at least {least:g}"
    return "finite"


def checked_kind(name: str, value: Any, kind: type) -> None:
    """Raise DesignError unless a value is of a kind, such as a Design or a Surface."""
    if not isinstance(value, kind):
        raise DesignError(f"{name} must be a {kind.__name__}, received {value!r}")


def checked_list(name: str, values: Any) -> list:
    """Return values as a list; raise DesignError when they are none, or a text."""
    if not isinstance(values, Iterable) or isinstance(values, str | bytes):
        raise DesignError(f"{name} must be a list, received {values!r}")
    return list(values)


def checked_level(value: Any, name: str = "alpha") -> float:
    """Return a probability that lies between 0 and 1, such as the level of a test."""
    if not isinstance(value, numbers.Real) or isinstance(value, bool) or not 0.0 < float(value) < 1.0:
        raise DesignError(f"{name} lies between 0 and 1, received {value!r}")
    return float(value)


def checked_count(name: str, value: Any, least: int = 1) -> int:
    """Return a whole number that is at least ``least``."""
    whole = isinstance(value, numbers.Real) and not isinstance(value, bool | np.bool_)
    if not whole or not math.isfinite(value) or int(value) != value or int(value) < least:
        raise DesignError(f"{name} must be a whole number of at least {least}, received {value!r}")
    return int(value)


def checked_df(name: str, value: Any) -> float:
    """Return degrees of freedom: a positive number, which may be infinite."""
    if not isinstance(value, numbers.Real) or isinstance(value, bool) or not float(value) > 0.0:
        raise DesignError(f"{name} must be positive, received {value!r}")
    return float(value)


def real_array(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Return values as an array of float; whether they are finite is the caller's rule.

    Raises
    ------
    DesignError
        Masked values, dates, text, objects, complex numbers, truth values or rows of different lengths: none
        of them is a measurement.
    """
    if isinstance(values, np.ma.MaskedArray) and np.ma.getmaskarray(values).any():
        place = tuple(int(i) + 1 for i in np.argwhere(np.ma.getmaskarray(values))[0])
        raise DesignError(f"{name}: a masked value is no measurement, received one at position {place}")
    if isinstance(values, str | bytes | dict | set) or values is None:
        raise DesignError(f"{name} must be numbers, received {values!r}")
    if isinstance(getattr(values, "dtype", None), pd.CategoricalDtype):
        raise DesignError(f"{name} must be real numbers, received categories")
    try:
        array = np.asarray(values)
        if array.dtype == object:  # pandas' missing values, Python's fractions and decimals, or no numbers
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

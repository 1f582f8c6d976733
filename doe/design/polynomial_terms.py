"""Terms of a polynomial model: "E" (linear), "E:F" (interaction), "E^2" (square), and their columns."""

import itertools
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from doe.arguments import checked_choice, checked_count, checked_list
from doe.design.factors import Factor
from doe.errors import DesignError

Term = tuple[str, ...]
"""Names of the factors that are multiplied: () intercept, ("E",), ("E", "F"), ("E", "E")."""

INTERCEPT: Term = ()
HIGHEST_POWER = 4
MOST_DIGITS = 17
"""Largest number of digits of a written coefficient."""

MODELS = ("first-order", "interaction", "quadratic", "three-factor")


def model_terms(names: Sequence[str], model: str) -> tuple[Term, ...]:
    """Return the terms of a model without its intercept: linear, then interactions, then squares.

    ``three-factor`` has the interactions of two and of three factors, and no squares.
    """
    checked_choice("model", model, MODELS)
    terms: list[Term] = [(name,) for name in names]
    if model != "first-order":
        terms += itertools.combinations(names, 2)
    if model == "quadratic":
        terms += [(name, name) for name in names]
    if model == "three-factor":
        terms += itertools.combinations(names, 3)
    return tuple(terms)


def parsed_terms(written: Iterable[str], names: Sequence[str]) -> tuple[Term, ...]:
    """Return written terms, in the order of a polynomial: ``["A", "B", "A:B", "A^2", "A:B:C"]``.

    Raises DesignError: an unknown factor, a repeated term, or one whose parts are not all present: the model
    is hierarchical.
    """
    terms: list[Term] = []
    for text in checked_list("model, unless it is a name,", written):
        if not isinstance(text, str):
            raise DesignError(f"a term must be text such as 'A:B' or 'A^2', got {text!r}")
        base, power, degree = text.partition("^")
        parts = [part.strip() for part in base.split(":")]
        if power:
            if len(parts) > 1 or not degree.strip().isdigit() or not 2 <= int(degree) <= HIGHEST_POWER:
                raise DesignError(f"a term must be a product or one power, such as A:B or A^2, got {text!r}")
            parts *= int(degree)
        unknown = [part for part in parts if part not in names]
        if unknown:
            raise DesignError(
                f"term {text!r}: no factor is named {unknown[0]!r}; there are {', '.join(names)}"
            )
        term = tuple(sorted(parts, key=list(names).index))
        if term in terms:
            raise DesignError(f"term {text!r} comes twice")
        terms.append(term)
    for term in terms:
        for place in range(len(term)):
            part = term[:place] + term[place + 1 :]
            if part and part not in terms:
                raise DesignError(f"the model is hierarchical: {term_name(term)} needs {term_name(part)} too")
    return tuple(sorted(terms, key=lambda term: (len(term), len(set(term)) == 1)))


def term_name(term: Term) -> str:
    """Return the name of a term: ``intercept``, ``E``, ``E:F``, ``E^2`` or ``E:F:G``."""
    if term == INTERCEPT:
        return "intercept"
    return f"{term[0]}^{len(term)}" if len(term) > 1 and len(set(term)) == 1 else ":".join(term)


def find_term(name: str, terms: Iterable[Term]) -> Term:
    """Return the term of a name (interactions in either order); raise DesignError for an unknown name."""
    if not isinstance(name, str):
        raise DesignError(f"a term's name must be text such as 'E', 'E:F' or 'E^2', got {name!r}")
    for term in terms:
        if name == term_name(term) or sorted(str(name).split(":")) == sorted(term):
            return term
    raise DesignError(f"the model has no term {name!r}; it has {', '.join(map(term_name, terms))}")


def contains(term: Term, part: Term) -> bool:
    """Return True if a term is a multiple of another one: "E:F" and "E^2" contain "E"."""
    return term != part and all(term.count(name) >= part.count(name) for name in part)


def model_matrix(coded: pd.DataFrame, terms: Iterable[Term]) -> pd.DataFrame:
    """Return a column of ones and one a term (named so) at coded points; same index."""
    terms = tuple(terms)
    values = model_values(coded.to_numpy(dtype=np.float64), list(coded.columns), terms)
    return pd.DataFrame(values, coded.index, ["intercept", *map(term_name, terms)])


def model_values(
    points: NDArray[np.float64], names: Sequence[str], terms: Iterable[Term]
) -> NDArray[np.float64]:
    """Return the same numbers at points of shape (points, factors): (points, terms + 1), by columns."""
    columns = [points[:, [names.index(name) for name in term]].prod(axis=1) for term in terms]
    return np.array([np.ones(len(points)), *columns]).T


def natural_coefficients(coded: Mapping[Term, float], factors: Iterable[Factor]) -> dict[Term, float]:
    """Return a coded polynomial's coefficients in natural units.

    Each coded variable is (natural - center) / half range; every product is multiplied out. The terms keep
    the order of the coded ones; linear terms that the coded model lacks follow.
    """
    by_name = {factor.name: factor for factor in factors}
    natural: dict[Term, float] = defaultdict(float, dict.fromkeys(coded, 0.0))
    for term, coefficient in coded.items():
        for kept in itertools.product((True, False), repeat=len(term)):
            weight = coefficient
            for name, keep in zip(term, kept, strict=True):
                factor = by_name[name]
                weight *= (1.0 if keep else -factor.center) / factor.half_range
            natural[tuple(itertools.compress(term, kept))] += weight
    return dict(natural)


def equation_text(coefficients: Mapping[str, float], digits: int) -> str:
    """Return the polynomial as text: ``60.8 - 108.9 E + 121.2 E F + 72.1 E^2``."""
    digits = checked_count("digits", digits, least=0, most=MOST_DIGITS)
    parts = []
    for name, value in coefficients.items():
        sign = "-" if value < 0.0 else "+"
        factor = "" if name == "intercept" else " " + name.replace(":", " ")
        parts.append(f"{sign} {abs(value):.{digits}f}{factor}")
    return " ".join(parts).removeprefix("+ ").replace("- ", "-", 1 if parts[0].startswith("-") else 0)

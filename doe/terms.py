"""Terms of a polynomial model: "E" (linear), "E:F" (interaction), "E^2" (square), and their columns."""

import itertools
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pandas as pd

from doe.errors import DesignError
from doe.factors import Factor

Term = tuple[str, ...]
"""Names of the factors that are multiplied: () intercept, ("E",), ("E", "F"), ("E", "E")."""

INTERCEPT: Term = ()
MODELS = ("first-order", "interaction", "quadratic")


def model_terms(names: Sequence[str], model: str) -> tuple[Term, ...]:
    """Return the terms of a model without its intercept: linear, then interactions, then squares."""
    if model not in MODELS:
        raise DesignError(f"model is one of {', '.join(MODELS)}, received {model!r}")
    terms: list[Term] = [(name,) for name in names]
    if model != "first-order":
        terms += itertools.combinations(names, 2)
    if model == "quadratic":
        terms += [(name, name) for name in names]
    return tuple(terms)


def term_name(term: Term) -> str:
    """Return the written term: ``intercept``, ``E``, ``E:F`` or ``E^2``."""
    if term == INTERCEPT:
        return "intercept"
    return f"{term[0]}^2" if len(term) == 2 and term[0] == term[1] else ":".join(term)


def find_term(name: str, terms: Iterable[Term]) -> Term:
    """Return the term that a name writes (interactions in either order); raise DesignError when none does."""
    for term in terms:
        if name in (term_name(term), term_name(term[::-1])):
            return term
    raise DesignError(f"the model has no term {name!r}; it has {', '.join(map(term_name, terms))}")


def contains(term: Term, part: Term) -> bool:
    """Whether a term is a multiple of another one: "E:F" and "E^2" contain "E"."""
    return term != part and all(term.count(name) >= part.count(name) for name in part)


def model_matrix(coded: pd.DataFrame, terms: Iterable[Term]) -> pd.DataFrame:
    """Return a column of ones and one a term (named so) at coded points; same index."""
    columns = {"intercept": np.ones(len(coded))}
    for term in terms:
        columns[term_name(term)] = coded[list(term)].to_numpy().prod(axis=1)
    return pd.DataFrame(columns, index=coded.index)


def natural_coefficients(coded: Mapping[Term, float], factors: Iterable[Factor]) -> dict[Term, float]:
    """Return a coded polynomial's coefficients in natural units.

    Each coded variable is (natural - center) / half range; every product is multiplied out. The terms come in
    the order of the coded ones; a linear term that the coded model lacks may come in behind them.
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
    parts = []
    for name, value in coefficients.items():
        sign = "-" if value < 0.0 else "+"
        factor = "" if name == "intercept" else " " + name.replace(":", " ")
        parts.append(f"{sign} {abs(value):.{digits}f}{factor}")
    return " ".join(parts).removeprefix("+ ").replace("- ", "-", 1 if parts[0].startswith("-") else 0)

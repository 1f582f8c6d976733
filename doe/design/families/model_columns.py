"""Columns of a polynomial model of numbers and categories, for designs before their fit."""

import itertools
from collections.abc import Sequence

import numpy as np
import pandas as pd

from doe.arguments import checked_choice
from doe.design.factors import Category, Factor
from doe.design.polynomial_terms import MODELS

Columns = dict[str, np.ndarray]


def model_columns(coded: pd.DataFrame, factors: Sequence[Factor], model: str) -> pd.DataFrame:
    """Return the columns of a model: intercept, linear, interactions, squares (of the numbers).

    A category of k levels has k - 1 columns, each of which adds up to zero over the levels.
    """
    checked_choice("model", model, MODELS)
    linear = [_base(coded[factor.name].to_numpy(), factor) for factor in factors]
    columns: Columns = {"intercept": np.ones(len(coded))}
    for base in linear:
        columns |= base
    orders = {"first-order": 1, "interaction": 2, "quadratic": 2, "three-factor": 3}
    for size in range(2, orders[model] + 1):
        for bases in itertools.combinations(linear, size):
            for names in itertools.product(*bases):
                values = [base[name] for base, name in zip(bases, names, strict=True)]
                columns[":".join(names)] = np.prod(values, axis=0)
    if model == "quadratic":
        for factor in factors:
            if not isinstance(factor, Category):
                columns[f"{factor.name}^2"] = coded[factor.name].to_numpy() ** 2
    return pd.DataFrame(columns, index=coded.index)


def _base(values: np.ndarray, factor: Factor) -> Columns:
    if not isinstance(factor, Category) or len(factor.levels) == 2:
        return {factor.name: values}
    last = (values == len(factor.levels) - 1).astype(float)
    return {
        f"{factor.name}[{level}]": (values == code).astype(float) - last
        for level, code in zip(factor.levels[:-1], factor.codes, strict=False)
    }

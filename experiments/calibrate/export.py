"""Results as plain data: JSON-able values for results.json, tables with their index for CSV files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import singledispatch
from typing import Any

import numpy as np
import pandas as pd
from pydantic import BaseModel

from doe import Comparison, Design, JointFit, NoiseFloor, Region, Sample, ScreenResult, Surface

_PROPERTIES: dict[type, tuple[str, ...]] = {
    Sample: ("mean", "sd", "n", "se"),
    NoiseFloor: ("confidence", "mean_interval", "sd_interval"),
    Comparison: (
        "a", "b", "method", "difference", "se", "df", "t", "p", "interval", "alpha", "margin",
        "equivalence_p", "equivalent", "smallest_margin",
    ),
    Design: ("factors", "dummies", "coded", "natural"),
    ScreenResult: ("table", "anova", "error_rule", "error_df", "error_ms", "effects"),
    Surface: (
        "anova", "coefficients", "coded_coefficients", "dropped", "r2", "r2_adjusted", "r2_predicted",
        "cv_percent", "adequate_precision",
    ),
    Region: ("fraction", "ranges", "extent", "resolution"),
    JointFit: ("point", "alpha", "extent", "shrinkage", "directions"),
}  # fmt: skip
"""Properties of each result of `doe` that results.json tells."""


@singledispatch
def jsonable(value: Any) -> Any:
    """Turn a result into plain JSON data: text, finite numbers, lists, dicts; other numbers are None.

    Raises
    ------
    TypeError
        For a kind of value that has no plain form.
    """
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: jsonable(getattr(value, field.name)) for field in fields(value)}
    raise TypeError(f"a {type(value).__name__} has no plain form for results.json")


@jsonable.register(type(None))
@jsonable.register(bool)
@jsonable.register(int)
@jsonable.register(str)
def _plain(value: Any) -> Any:
    return value


@jsonable.register
def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


@jsonable.register
def _scalar(value: np.generic) -> Any:
    return jsonable(value.item())


@jsonable.register
def _enum(value: Enum) -> Any:
    return value.value


@jsonable.register
def _array(value: np.ndarray) -> Any:
    return jsonable(value.tolist())


@jsonable.register(list)
@jsonable.register(tuple)
def _sequence(value: Any) -> list[Any]:
    return [jsonable(item) for item in value]


@jsonable.register
def _mapping(value: Mapping) -> dict[str, Any]:
    return {str(key): jsonable(item) for key, item in value.items()}


@jsonable.register
def _model(value: BaseModel) -> Any:
    return value.model_dump(mode="json")


@jsonable.register
def _series(value: pd.Series) -> dict[str, Any]:
    return _mapping(value.to_dict())


@jsonable.register
def _frame(value: pd.DataFrame) -> list[dict[str, Any]]:
    return [_mapping(row) for row in indexed(value).to_dict("records")]


def _result(value: Any) -> dict[str, Any]:
    """Tell the properties of a result of `doe`."""
    told = {name: jsonable(getattr(value, name)) for name in _PROPERTIES[type(value)]}
    if isinstance(value, NoiseFloor):
        return jsonable(value.sample) | told
    if isinstance(value, Surface):
        return told | {"equation": value.equation("natural"), "equation_coded": value.equation("coded")}
    return told | ({"responses": jsonable(value.tests())} if isinstance(value, JointFit) else {})


for _kind in _PROPERTIES:
    jsonable.register(_kind)(_result)


def indexed(table: pd.DataFrame) -> pd.DataFrame:
    """Copy a table with its index as the first column where the index has a name."""
    return table.reset_index() if table.index.name is not None else table

"""Results as plain data: JSON-able values for results.json, tables with their index for CSV files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np
import pandas as pd
from pydantic import BaseModel

_PROPERTIES: dict[str, tuple[str, ...]] = {
    "Sample": ("mean", "sd", "n", "se"),
    "NoiseFloor": ("confidence", "mean_interval", "sd_interval"),
    "Comparison": (
        "a", "b", "method", "difference", "se", "df", "t", "p", "interval", "alpha", "margin",
        "equivalence_p", "equivalent", "smallest_margin",
    ),
    "Design": ("factors", "dummies", "coded", "natural"),
    "ScreenResult": ("table", "anova", "error_rule", "error_df", "error_ms", "effects"),
    "Surface": (
        "anova", "coefficients", "coded_coefficients", "dropped", "r2", "r2_adjusted", "r2_predicted",
        "cv_percent", "adequate_precision",
    ),
    "Transfer": ("level", "shift", "scale", "slope_values", "noise", "runs", "response"),
    "Region": ("fraction", "ranges", "open_ends", "extent", "resolution"),
    "JointFit": ("point", "alpha", "extent", "shrinkage", "intervals", "directions"),
}  # fmt: skip
"""Properties of each result of `doe` that results.json has, by class: naming a class loads statsmodels."""


def jsonable(value: Any) -> Any:
    """Turn a result into plain JSON data, numbers that are not finite into None."""
    match value:
        case Enum():
            return value.value
        case None | bool() | int() | str():
            return value
        case float():
            return float(value) if math.isfinite(value) else None
        case np.generic():
            return jsonable(value.item())
        case np.ndarray():
            return jsonable(value.tolist())
        case list() | tuple():
            return [jsonable(item) for item in value]
        case pd.DataFrame():
            return [jsonable(row) for row in indexed(value).to_dict("records")]
        case pd.Series():
            return jsonable(value.to_dict())
        case Mapping():
            return {str(key): jsonable(item) for key, item in value.items()}
        case BaseModel():
            return value.model_dump(mode="json")
    if type(value).__module__.startswith("doe.") and type(value).__name__ in _PROPERTIES:
        return _properties(value)
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: jsonable(getattr(value, field.name)) for field in fields(value)}
    raise TypeError(f"a {type(value).__name__} has no plain form for results.json")


def _properties(value: Any) -> dict[str, Any]:
    """Return the properties of a result of `doe`."""
    kind = type(value).__name__
    found = {name: jsonable(getattr(value, name)) for name in _PROPERTIES[kind]}
    match kind:
        case "NoiseFloor":
            return jsonable(value.sample) | found
        case "Surface":
            return found | {"equation": value.equation("natural"), "equation_coded": value.equation("coded")}
        case "Transfer":
            return found | {"intervals": jsonable(value.intervals())}
        case "JointFit":
            return found | {"responses": jsonable(value.tests())}
    return found


def indexed(table: pd.DataFrame) -> pd.DataFrame:
    """Copy a table with its index as the first column where the index has a name."""
    return table.reset_index() if table.index.name is not None else table

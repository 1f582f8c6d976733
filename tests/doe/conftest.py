"""The paper's printed tables as designs, and agreement with a printed number."""

from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from doe import Design, Factor, Sample, ScreenResult, Surface, fit_surface, screen

DATA = Path(__file__).parent / "data"


def read(name: str, **options) -> pd.DataFrame:
    return pd.read_csv(DATA / f"{name}.csv", comment="#", **options)


@pytest.fixture
def agrees() -> Callable[[float, str], bool]:
    """Tell if a value rounds to a printed number: half a unit of the last printed digit is the tolerance."""

    def check(value: float, printed: str) -> bool:
        digits = len(printed.partition(".")[2])
        return abs(value - float(printed)) <= 0.5000001 * 10.0**-digits

    return check


@pytest.fixture
def screening_factors() -> list[Factor]:
    return [Factor(row.symbol, row.low, row.high, row.unit) for row in read("factors").itertuples()]


@pytest.fixture
def screening(screening_factors: list[Factor]) -> ScreenResult:
    table = read("plackett_burman", index_col="run")
    angles = table.pop("repose_angle_deg")
    dummies = table.columns.drop([factor.name for factor in screening_factors])
    return screen(Design.from_table(table, screening_factors, dummies=dummies), angles)


@pytest.fixture
def composite() -> tuple[Design, pd.Series]:
    table = read("central_composite", index_col="run").rename(columns={"E_coded": "E", "F_coded": "F"})
    angles = table.pop("repose_angle_deg")
    factors = [Factor.around("E", 0.48, 0.06), Factor.around("F", 0.45, 0.10)]
    return Design.from_table(table, factors), angles


@pytest.fixture
def full(composite: tuple[Design, pd.Series]) -> Surface:
    return fit_surface(*composite, model="quadratic")


@pytest.fixture
def reduced(full: Surface) -> Surface:
    """Return the paper's second model: F^2 is removed, E^2 stays although it is not significant either."""
    return full.drop("F^2")


@pytest.fixture
def climb() -> pd.DataFrame:
    return read("steepest_climb", index_col="run")


@pytest.fixture
def simulated() -> list[float]:
    return read("verification")["repose_angle_deg"].to_list()


@pytest.fixture
def measured() -> Sample:
    row = read("measured").iloc[0]
    return Sample(row["mean"], row["standard_deviation"], row["replicates"])

"""The published numbers of the buckwheat study, the same numbers recomputed, and the misprints between them.

The paper is "Analysis and calibration of parameters of buckwheat grain based on the stacking experiment"; its
tables are in the folder ``paper`` here, digits as printed. What statistics can recompute, the
public functions of `doe` recompute here from the paper's own runs.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from doe import Design, Factor, Sample, ScreenResult, Surface, compare_means, fit_surface, screen

CLUMP = Path(__file__).with_name("clump.txt")
"""File of the reference clump, nine spheres."""

_FOLDER = Path(__file__).with_name("paper")
RESPONSE = "repose_angle_deg"
"""Column of the angles in the published tables."""

_MODELS = ("quadratic", "reduced")


@dataclass(frozen=True)
class Misprint:
    """One statement of the paper that its own numbers contradict."""

    place: str
    """Its place: table, equation or part of the text."""
    item: str
    """Row and column, or what is spoken of."""
    printed: str
    """Text as printed there."""
    recomputed: str
    """Value that follows from the paper's own numbers."""
    reason: str
    """Reason why the print is wrong."""


def printed(name: str) -> pd.DataFrame:
    """Return a published table as text, digits as printed, empty where nothing is; by its first column.

    Its name is that of a file of the folder ``paper`` without the ending, see the README there.

    Raises
    ------
    ValueError
        If there is no such table.
    """
    return _texts(name).copy()


def published(name: str) -> pd.DataFrame:
    """Return a published table with its numbers as numbers, nan where nothing is printed (see `printed`)."""
    return _numbers(name).copy()


@cache
def _texts(name: str) -> pd.DataFrame:
    """Table as it was read: whoever asks gets a copy, and may change it."""
    path = _FOLDER / f"{name}.csv"
    if not path.is_file():
        known = ", ".join(sorted(file.stem for file in _FOLDER.glob("*.csv")))
        raise ValueError(f"a published table is one of {known}, got {name!r}")
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    return table.set_index(table.columns[0])  # pandas 2 would make numbers of index_col


@cache
def _numbers(name: str) -> pd.DataFrame:
    table = _texts(name).replace("", np.nan)
    table.index = _numbers_where_all(table.index.to_series())
    return table.apply(_numbers_where_all)


def factors() -> list[Factor]:
    """Return the eight factors of the screening, named by their symbols A to H."""
    table = published("factors")
    return [Factor(str(row.Index), row.low, row.high, row.unit) for row in table.itertuples()]


def composite_factors() -> list[Factor]:
    """Return the two static frictions with the levels of the central composite design."""
    return [Factor.around("E", 0.48, 0.06), Factor.around("F", 0.45, 0.10)]


def measured() -> Sample:
    """Return the physical repose angle [deg]: mean, standard deviation, replicates."""
    row = published("measured").iloc[0]
    return Sample(float(row["mean"]), float(row["standard_deviation"]), int(row["replicates"]))


def verification() -> list[float]:
    """Return the three angles simulated at the published optimum [deg]."""
    return published("verification")[RESPONSE].tolist()


def screening_design() -> Design:
    """Return the Plackett-Burman design in printed order, its idle columns as dummies."""
    table = published("plackett_burman").drop(columns=RESPONSE)
    return Design.from_table(table, factors(), dummies=table.columns.drop([f.name for f in factors()]))


def composite_design() -> Design:
    """Return the central composite design in printed order, its star points at 1.414 half ranges."""
    coded = published("central_composite")[["E_coded", "F_coded"]].set_axis(["E", "F"], axis=1)
    return Design.from_table(coded, composite_factors())


@cache
def screening() -> ScreenResult:
    """Analyse the published Plackett-Burman runs, their three idle columns as error."""
    return screen(screening_design(), published("plackett_burman")[RESPONSE])


@cache
def surface(model: str = "quadratic") -> Surface:
    """Fit the published central composite runs, star points at 1.414 half ranges as the paper has them.

    The model is ``"quadratic"``, equation (8), or ``"reduced"``, equation (9), which lacks the square of F.

    Raises
    ------
    ValueError
        If the model is neither.
    """
    if model not in _MODELS:
        raise ValueError(f"a model of the paper is one of {', '.join(_MODELS)}, got {model!r}")
    full = fit_surface(composite_design(), published("central_composite")[RESPONSE])
    return full if model == "quadratic" else full.drop("F^2")


def comparison() -> pd.DataFrame:
    """Compare every recomputable number that the paper prints with its recomputed value.

    A row a printed number: place, item, printed (text), recomputed, slack (how far the recomputed value may
    move within the rounding of the printed numbers that it is made of; 0 where those are runs) and agrees
    (the two are the same within the last printed digit and the slack).
    """
    rows = [
        (place, f"{row}, {column}", text, value, 0.0)
        for place, name, values in _recomputed_tables()
        for row, column, text, value in _cells(printed(name), values)
    ]
    texts = printed("conclusions")["value"]
    rows += [("text", item, texts[item], value, slack) for item, value, slack in _conclusions()]
    table = pd.DataFrame(rows, columns=["place", "item", "printed", "recomputed", "slack"])
    # The last bits of both numbers must not decide: a billionth of a digit more.
    half_digits = table["printed"].map(lambda text: 0.500000001 * 10.0 ** -_decimals(text))
    gaps = (table["printed"].astype(float) - table["recomputed"]).abs()
    return table.assign(agrees=gaps <= half_digits + table["slack"])


def misprints() -> list[Misprint]:
    """List what the paper's own numbers contradict: printed numbers first, then formulas and statements."""
    table = comparison()
    wrong = table[~table["agrees"]]
    numbers = []
    for place, item, text, recomputed, *_ in wrong.itertuples(index=False):
        reason = _REASONS.get((place, item), "does not follow from the printed runs")
        numbers.append(Misprint(place, item, text, f"{recomputed:.{_decimals(text)}f}", reason))
    return [*numbers, _modulus_name(), _climb_step(), *_points_outside(), *_FORMULAS]


_TEST_KEPT = "mean square over that of the residual, 0.2354; the printed p belongs to the recomputed F"
_ORTHOGONAL = "the partial sum of squares is that of Table 7: the coded design is orthogonal"
_REASONS = {
    ("Table 5", "4, relative_error_pct"): "|29.766 - 30.148| / 30.148 is 1.267 %: cut off, not rounded",
    ("Table 7", "E, F"): "6.3129 over the residual's 0.2675; the printed p belongs to the recomputed F",
    ("Table 8", "model, mean_sq"): "the sum of squares 18.9413 over 4 degrees of freedom",
    ("Table 8", "model, F"): _TEST_KEPT,
    ("Table 8", "E, F"): _TEST_KEPT,
    ("Table 8", "F, mean_sq"): _ORTHOGONAL,
    ("Table 8", "F, F"): _TEST_KEPT,
    ("Table 8", "E:F, mean_sq"): _ORTHOGONAL,
    ("Table 8", "E:F, F"): _TEST_KEPT,
    ("text", "mean angle at the optimum"): "the mean of the three printed angles",
}

_FORMULAS = (
    Misprint(
        "equation (4)",
        "effective elastic modulus",
        "not the reciprocal of a sum of (1 - v^2)/E",
        "1/E* = (1 - v1^2)/E1 + (1 - v2^2)/E2",
        "Hertz contact of two elastic bodies",
    ),
    Misprint(
        "equation (6)",
        "effective shear modulus",
        "G* = (2 - v1)/G1 + (2 - v2)/G2",
        "1/G* = (2 - v1)/G1 + (2 - v2)/G2",
        "compliances add up, and the printed right side is an inverse pressure",
    ),
    Misprint(
        "Table 7",
        "title",
        "ANOVA of the steepest ascent test",
        "ANOVA of the central composite design",
        "its terms and its 12 degrees of freedom are those of Table 6",
    ),
)


def _modulus_name() -> Misprint:
    shear = factors()[1]
    return Misprint(
        "text, verification",
        "name of the modulus",
        "elastic modulus 34.325 MPa",
        f"shear modulus {shear.center:.3f} MPa",
        f"the middle of the shear modulus range {shear.low:g} to {shear.high:g} MPa",
    )


def _climb_step() -> Misprint:
    t = screening().table["t"]
    moves = published("steepest_climb")[["E", "F"]].diff().iloc[1]
    half_ranges = {factor.name: factor.half_range for factor in factors()}
    coded = (moves["F"] / half_ranges["F"]) / (moves["E"] / half_ranges["E"])
    return Misprint(
        "text, steepest climb",
        "step of F over step of E",
        f"by the t values of the effects; Table 5 moves by {moves['F'] / moves['E']:.3f} ({coded:.3f} coded)",
        f"{t['F'] / t['E']:.3f} coded",
        "the steps of Table 5 divide 0.30 to 0.60 and 0.15 to 0.65 into five equal parts",
    )


def _points_outside() -> Iterator[Misprint]:
    """Name the runs outside the ranges of Table 2."""
    climb = published("steepest_climb")[["E", "F"]]
    for place, table in (("Table 5", climb), ("Table 6", surface().design.natural)):
        for factor in (factor for factor in factors() if factor.name in table):
            # Coded values of a range's ends come back with rounding.
            for run, value in table[factor.name].items():
                if not factor.low - 1e-9 <= value <= factor.high + 1e-9:
                    stated = f"{factor.low:g} to {factor.high:g}"
                    reason = "outside the range that Tables 1 and 2 give"
                    yield Misprint(place, f"{run}, {factor.name}", f"{value:g}", stated, reason)


def _recomputed_tables() -> Iterator[tuple[str, str, pd.DataFrame]]:
    """Yield place, name of the published table and the recomputed values of some of its cells."""
    yield "Table 4", "screening_anova", screening().table[["sum_sq", "F", "p", "rank"]]
    angles, target = published("steepest_climb")[RESPONSE], measured().mean
    errors = 100.0 * (angles - target).abs() / target
    yield "Table 5", "steepest_climb", errors.to_frame("relative_error_pct")
    yield "Table 6", "central_composite", _composite_settings()
    surfaces = {model: surface(model) for model in _MODELS}
    coefficients = pd.DataFrame({model: fit.coefficients for model, fit in surfaces.items()})
    yield "equations (8) and (9)", "coefficients", coefficients
    for place, (model, fit) in zip(("Table 7", "Table 8"), surfaces.items(), strict=True):
        yield place, f"{model}_anova", fit.anova[["df", "mean_sq", "F", "p"]]
    statistics = printed("quality").index
    quality = {model: [getattr(fit, name) for name in statistics] for model, fit in surfaces.items()}
    yield "Tables 7 and 8", "quality", pd.DataFrame(quality, index=statistics)
    unvaried = [factor for factor in factors() if factor.name not in ("E", "F")]
    middles = {factor.name: factor.center for factor in unvaried}
    yield "text, verification", "settings", pd.DataFrame({"value": middles})


def _composite_settings() -> pd.DataFrame:
    """Calculate the natural settings of Table 6, its star points at the square root of two."""
    coded = published("central_composite")[["E_coded", "F_coded"]]
    coded = coded.mask(coded.abs() == 1.414, np.sign(coded) * math.sqrt(2.0))
    return pd.DataFrame({f.name: f.to_natural(coded[f"{f.name}_coded"]) for f in composite_factors()})


def _conclusions() -> Iterator[tuple[str, float, float]]:
    """Yield item, recomputed value and slack of the numbers in the running text."""
    angles, physical = verification(), measured()
    yield "mean angle at the optimum", float(np.mean(angles)), 0.0

    def p_value(mean: float, sd: float) -> float:
        return compare_means(angles, Sample(mean, sd, physical.n), method="pooled").p

    yield "p of the two-sample t-test", *_with_slack(p_value, physical.mean, physical.sd)

    def angle(static_e: float, static_f: float) -> float:
        return float(surface("reduced").predict({"E": static_e, "F": static_f})["mean"].iloc[0])

    optimum = published("settings")["value"]
    yield "angle that the reduced model gives at the optimum", *_with_slack(angle, optimum["E"], optimum["F"])
    gain = surface("reduced").adequate_precision / surface("quadratic").adequate_precision - 1.0
    yield "gain of adequate precision by the reduction in percent", 100.0 * gain, 0.0


def _with_slack(function: Callable[[float, float], float], *arguments: float) -> tuple[float, float]:
    """Return a function's value and its largest change when arguments move by half of the third decimal."""
    value = function(*arguments)
    corners = product(*[(argument - 0.0005, argument + 0.0005) for argument in arguments])
    return value, max(abs(function(*corner) - value) for corner in corners)


def _cells(table: pd.DataFrame, values: pd.DataFrame) -> Iterator[tuple[str, str, str, float]]:
    """Yield row, column, text and recomputed value of the cells that hold something."""
    for row, column in product(values.index, values.columns):
        text = table.loc[str(row), column]
        if text:
            yield str(row), column, text, float(values.loc[row, column])


def _decimals(text: str) -> int:
    return len(text.partition(".")[2])


def _numbers_where_all(column: pd.Series) -> pd.Series:
    try:
        return pd.to_numeric(column)
    except ValueError:
        return column

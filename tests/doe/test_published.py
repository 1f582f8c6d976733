"""The paper's statistics from its printed tables.

The expected numbers were computed twice, in Python and in R (lm, car, rsm), and are compared to their last
printed digit. Where the print differs, the computed number stands.
"""

import itertools

import numpy as np
import pandas as pd
import pytest

from doe import climb_table, compare_means, fit_surface, steepest_path

TARGET = 30.148

SCREENING = """
A -1.701500   8.68531  1.25302 1.11938 0.344521 5
B  1.647500   8.14277  1.17475 1.08386 0.357759 6
C  1.625833   7.93000  1.14405 1.06960 0.363210 7
D  1.780500   9.51054  1.37208 1.17136 0.326025 4
E  3.683500  40.70452  5.87240 2.42330 0.093891 2
F 14.535500 633.84228 91.44385 9.56263 0.002426 1
G  0.629167   1.18755  0.17133 0.41392 0.706747 8
H  1.916833  11.02275  1.59024 1.26105 0.296439 3
"""

FULL_ANOVA = """
model       5  3.790356 14.16946 0.001518
E           1  6.312876 23.59937 0.001840
F           1 10.037898 37.52460 0.000479
E:F         1  2.114116  7.90318 0.026099
E^2         1  0.450173  1.68288 0.235658
F^2         1  0.010521  0.03933 0.848434
residual    7  0.267502
lack_of_fit 3  0.225849  0.75600 0.573992
pure_error  4  0.298741
"""

REDUCED_ANOVA = """
model       4  4.735315 20.11782 0.000310
E           1  6.312876 26.82003 0.000844
F           1 10.037898 42.64565 0.000182
E:F         1  2.114116  8.98175 0.017151
E^2         1  0.476370  2.02384 0.192647
residual    8  0.235379
lack_of_fit 4  0.172017  0.57581 0.697017
pure_error  4  0.298741
"""


def rows(table: str) -> list[list[str]]:
    return [line.split() for line in table.strip().splitlines()]


@pytest.mark.parametrize("row", rows(SCREENING), ids=lambda row: row[0])
def test_screening_table(screening, agrees, row):
    name, effect, sum_sq, f, t, p, rank = row
    result = screening.table.loc[name]
    assert agrees(result["effect"], effect)
    assert agrees(result["sum_sq"], sum_sq)
    assert agrees(result["F"], f)
    assert agrees(abs(result["t"]), t)
    assert agrees(result["p"], p)
    assert result["rank"] == int(rank)
    assert result["percent"] == pytest.approx(100.0 * result["sum_sq"] / 741.820193, rel=1e-8)


def test_screening_error_is_what_the_dummies_hold(screening, agrees):
    dummies = 12.0 * (0.5 * screening.effects[["I1", "I2", "I3"]]) ** 2
    for sum_sq, printed in zip(dummies, ["10.4664", "2.6593", "7.6688"], strict=True):
        assert agrees(sum_sq, printed)
    assert screening.error_df == 3
    assert agrees(screening.error.sum_sq, "20.794475")
    assert agrees(screening.error_ms, "6.9314916")
    assert agrees(screening.anova.loc["total", "sum_sq"], "741.820193")


def test_screening_critical_values(screening, agrees):
    assert agrees(screening.critical_t(0.10), "2.35336")
    assert agrees(screening.critical_t(0.05), "3.18245")
    assert agrees(screening.critical_t(0.05, bonferroni=True), "7.70406")
    assert screening.significant(0.10) == ["F", "E"]
    assert screening.significant(0.05) == ["F"]


@pytest.mark.parametrize(("model", "table"), [("full", FULL_ANOVA), ("reduced", REDUCED_ANOVA)])
def test_surface_anova(request, agrees, model, table):
    anova = request.getfixturevalue(model).anova
    for source, df, mean_sq, *test in rows(table):
        row = anova.loc[source.replace("_", " ")]
        assert row["df"] == int(df)
        assert agrees(row["mean_sq"], mean_sq)
        if test:
            assert agrees(row["F"], test[0])
            assert agrees(row["p"], test[1])
        else:
            assert np.isnan(row["F"])
            assert np.isnan(row["p"])
    assert agrees(anova.loc["total", "sum_sq"], "20.824293")
    assert list(anova.index) == [row[0].replace("_", " ") for row in rows(table)] + ["total"]


@pytest.mark.parametrize(
    ("model", "natural", "coded"),
    [
        (
            "full",
            "59.714269 -107.569585 -43.456891 121.166667 70.678133 -3.889731",
            "30.193839 0.888385 1.120235 0.727 0.254441 -0.038897",
        ),
        (
            "reduced",
            "60.799227 -108.920994 -46.957648 121.166667 72.085852",
            "30.166788 0.888385 1.120235 0.727 0.259509",
        ),
    ],
)
def test_surface_coefficients(request, agrees, model, natural, coded):
    surface = request.getfixturevalue(model)
    names = ["intercept", "E", "F", "E:F", "E^2", "F^2"]
    for printed, values in ((natural, surface.coefficients), (coded, surface.coded_coefficients)):
        numbers = printed.split()
        assert list(values.index) == names[: len(numbers)]
        assert all(agrees(value, number) for value, number in zip(values, numbers, strict=True))


@pytest.mark.parametrize(
    ("model", "printed"),
    [
        ("full", "0.910080 0.845852 0.678969 1.70546 13.12838"),
        ("reduced", "0.909575 0.864363 0.757513 1.59979 15.21902"),
    ],
)
def test_surface_quality(request, agrees, model, printed):
    surface = request.getfixturevalue(model)
    quality = (
        surface.r2,
        surface.r2_adjusted,
        surface.r2_predicted,
        surface.cv_percent,
        surface.adequate_precision,
    )
    assert all(agrees(value, number) for value, number in zip(quality, printed.split(), strict=True))


def test_equations_are_written_in_both_units(reduced):
    assert reduced.equation(digits=3) == "60.799 - 108.921 E - 46.958 F + 121.167 E F + 72.086 E^2"
    assert reduced.equation("coded", digits=4) == "30.1668 + 0.8884 E + 1.1202 F + 0.7270 E F + 0.2595 E^2"


def test_contour_and_nearest_point_of_the_printed_equation(composite, agrees):
    """The published numbers of the contour come from equation (9) with its three printed decimals."""
    design, _ = composite
    e, f = design.natural["E"], design.natural["F"]
    printed = fit_surface(design, 60.799 - 108.921 * e - 46.958 * f + 121.167 * e * f + 72.086 * e**2)
    ends = printed.contour(TARGET).iloc[[0, -1]].sort_values("E").to_numpy()
    assert agrees(ends[0, 0], "0.431374")
    assert ends[0, 1] == pytest.approx(0.55, abs=1e-12)
    assert ends[1, 0] == pytest.approx(0.54, abs=1e-12)
    assert agrees(ends[1, 1], "0.386855")
    nearest = printed.nearest(TARGET)
    assert agrees(nearest["E"], "0.479518")
    assert agrees(nearest["F"], "0.448979")


def test_published_optimum_is_one_of_many(reduced):
    """The contour passes through the rounding cells of 274 three-decimal pairs inside the square."""
    e = np.round(np.arange(0.420, 0.5405, 0.001), 3)
    f = np.round(np.arange(0.350, 0.5505, 0.001), 3)
    pairs = np.stack(np.meshgrid(e, f, indexing="ij"), axis=-1).reshape(-1, 2)
    corners = []
    for offset in itertools.product((-0.0005, 0.0005), repeat=2):
        points = pd.DataFrame(pairs + offset, columns=["E", "F"])
        corners.append(reduced.predict(points)["mean"].to_numpy())
    crossed = (np.min(corners, axis=0) <= TARGET) & (np.max(corners, axis=0) >= TARGET)
    assert crossed.sum() == 274
    assert [0.482, 0.446] in pairs[crossed].tolist()


def test_prediction_at_the_published_point(reduced, agrees):
    row = reduced.predict({"E": 0.482, "F": 0.446}).iloc[0]
    assert agrees(row["mean"], "30.15091")
    assert agrees(row["confidence_low"], "29.7466")
    assert agrees(row["confidence_high"], "30.5552")
    assert agrees(row["prediction_low"], "28.9613")
    assert agrees(row["prediction_high"], "31.3405")


@pytest.mark.parametrize(
    ("method", "p"), [("pooled", "0.768591"), ("one-sample", "0.815172"), ("welch", "0.820823")]
)
def test_verification(simulated, measured, agrees, method, p):
    against = measured.mean if method == "one-sample" else measured
    comparison = compare_means(simulated, against, method=method)
    assert agrees(comparison.a.mean, "30.326")
    assert agrees(comparison.a.sd, "1.159176")
    assert agrees(comparison.p, p)


def test_climb(screening, climb, agrees):
    path = steepest_path(
        screening, 5, factors=["E", "F"], step={"E": 0.06, "F": 0.10}, start={"E": 0.30, "F": 0.15}
    )
    # Multiples of 0.06 and 0.10 in binary: rounding only.
    assert path.natural.to_numpy() == pytest.approx(climb[["E", "F"]].to_numpy(), abs=1e-12)
    table = climb_table(path, climb["repose_angle_deg"], TARGET)
    printed = ["68.99", "35.69", "6.80", "1.27", "4.82", "9.74"]  # row 4 is printed as 1.26
    assert all(agrees(value, number) for value, number in zip(table["error_percent"], printed, strict=True))
    assert table["error_percent"].idxmin() == 4
    assert agrees(screening.table.loc["F", "effect"] / screening.table.loc["E", "effect"], "3.946")

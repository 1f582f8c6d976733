"""Equality with R on published data sets.

``data/published`` holds the data with their sources, the R script and what it wrote; nothing here runs R.
Both sides solve least squares in double precision: 1e-8 relative is asked for, and kept where a number is not
itself the small difference of large ones (then the tolerance says so).
"""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import doe
from doe import Design, Factor, Surface, alias_structure, box_behnken, box_cox, canonical, fit_surface, screen
from doe.design.coefficients import coefficient_table
from doe.design.families.mixture import Mixture

FOLDER = Path(__file__).parent / "data" / "published"
REFERENCE = json.loads((FOLDER / "reference.json").read_text())
SAME = 1e-8

FACTORS = {
    "chemical": [Factor("time", 80, 90, "min"), Factor("temperature", 170, 180, "degF")],
    "cakes": [Factor("time", 33, 37, "min"), Factor("temperature", 340, 360, "degF")],
    "helicopter": [
        Factor.around("area", 12.4, 0.6), Factor.around("ratio", 2.52, 0.26),
        Factor.around("width", 1.25, 0.25), Factor.around("length", 2.0, 0.5),
    ],
    "carbon_monoxide": [Factor.around("ethanol", 0.2, 0.1), Factor("ratio", 14.0, 16.0)],
    "lathe": [Factor("feed", -1, 1), Factor("speed", -1, 1)],
    **{name: [Factor(letter, -1, 1) for letter in "ABC"] for name in ("cement", "trebuchet", "etch")},
    "reaction": [Factor(letter, -1, 1) for letter in "ABCD"],
    "injection": [Factor(letter, -1, 1) for letter in "ABCDEFG"],
    "fatigue": [Factor(letter, -1, 1) for letter in "ABCDEFG"],
}  # fmt: skip
SURFACES = ("chemical", "cakes", "helicopter", "cement", "carbon_monoxide", "trebuchet", "lathe")


def published(name: str) -> tuple[Design, pd.Series]:
    """Return design and response of a data set, in natural units where it has them."""
    table = pd.read_csv(FOLDER / f"{name}.csv", comment="#", index_col="run")
    response = table.pop("y")
    block = "block" if "block" in table else None
    return Design.from_table(table, FACTORS[name], coded=False, block=block), response


@pytest.fixture(scope="module")
def surfaces() -> dict[str, Surface]:
    return {name: fit_surface(*published(name)) for name in SURFACES}


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("column", ["estimate", "se", "t", "p", "vif"])
def test_coefficient_table(surfaces, name, column):
    expected = REFERENCE[name]["coefficients"]
    table = surfaces[name].coefficient_table
    # R writes the blocks behind the intercept, this package behind the terms.
    count = len(surfaces[name].terms)
    blocks = len(table) - 1 - count
    order = [0, *range(count + 1, count + 1 + blocks), *range(1, count + 1)]
    ours, theirs = table[column].to_numpy()[order], np.array(expected[column], dtype=float)
    if column == "vif":
        ours, theirs = ours[1:], theirs[1:]
    # A coefficient that is zero but for rounding has a t and an estimate of rounding alone.
    scale = np.abs(theirs).max() if column in ("estimate", "t") else 0.0
    # p of a very large t is the t to a power of some hundred: its relative error is that much larger.
    relative = 1e-6 if column == "p" else SAME
    assert ours == pytest.approx(theirs, rel=relative, abs=1e-12 * scale)


@pytest.mark.parametrize("name", SURFACES)
def test_anova_by_order(surfaces, name):
    expected = REFERENCE[name]["anova"]
    table = surfaces[name].anova_by_order.drop(index="total")
    names = {"block": "blocks", "FO": "first order", "TWI": "two-way interactions", "PQ": "pure quadratic",
             "Residuals": "residual", "Lack of fit": "lack of fit", "Pure error": "pure error"}  # fmt: skip
    rows = [names[row.split("(")[0]] for row in expected["names"]]
    assert list(table.index) == rows
    # F and p of rows without a test are missing on both sides.
    for column in ("df", "sum_sq", "mean_sq", "F", "p"):
        theirs = np.array(
            [np.nan if value in (None, "NA") else value for value in expected[column]], dtype=float
        )
        assert table[column].to_numpy() == pytest.approx(theirs, rel=SAME, nan_ok=True), column


@pytest.mark.parametrize("name", SURFACES)
def test_stationary_point_and_curvatures(surfaces, name):
    analysis = canonical(surfaces[name])
    expected = REFERENCE[name]
    assert analysis.stationary.coded.to_numpy() == pytest.approx(expected["stationary"], rel=SAME)
    assert sorted(analysis.table["curvature"]) == pytest.approx(sorted(expected["curvatures"]), rel=SAME)


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize(("key", "descend"), [("ridge", False), ("valley", True)])
def test_ridge_path(surfaces, name, key, descend):
    expected = REFERENCE[name][key]
    path = doe.ridge_path(surfaces[name], np.atleast_1d(expected["radii"]), descend=descend)
    coded = path.filter(like="coded ").to_numpy()
    assert coded == pytest.approx(np.array(expected["points"]), rel=SAME, abs=1e-10)


@pytest.mark.parametrize("name", SURFACES)
def test_influence_and_quality(surfaces, name):
    expected, surface = REFERENCE[name], surfaces[name]
    table = doe.influence(surface)
    for column in ("fitted", "leverage", "studentized", "deleted", "cook", "dffits"):
        # Residuals are differences: their rounding is that of the response.
        assert table[column].to_numpy() == pytest.approx(expected[column], rel=SAME, abs=1e-11), column
    assert surface.press == pytest.approx(expected["press"], rel=SAME)
    assert surface.r2 == pytest.approx(expected["r2"], rel=SAME)
    assert surface.r2_adjusted == pytest.approx(expected["r2_adjusted"], rel=SAME)
    assert np.sqrt(surface.residual_ms) == pytest.approx(expected["sigma"], rel=SAME)


def test_robust_errors_and_box_cox_of_the_lathe(surfaces):
    robust = doe.robust_coefficients(surfaces["lathe"])
    assert robust.table["se"].to_numpy() == pytest.approx(REFERENCE["lathe"]["hc3"], rel=SAME)
    found = box_cox(surfaces["lathe"])
    # R's answer lies on a grid of 1e-4.
    assert [found.power, found.low, found.high] == pytest.approx(REFERENCE["lathe"]["boxcox"], abs=1.1e-4)
    assert found.advice == "log(y)"


def test_interaction_of_three_factors():
    design, response = published("etch")
    surface = fit_surface(design, response, "three-factor")
    expected = REFERENCE["etch"]
    assert surface.coded_coefficients.to_numpy() == pytest.approx(
        expected["coefficients"]["estimate"], rel=SAME
    )
    assert surface.coefficient_table["p"].to_numpy() == pytest.approx(expected["coefficients"]["p"], rel=SAME)
    # The published effects (Montgomery, 6th ed., p. 211): A, C and A:C matter.
    effects = 2.0 * surface.coded_coefficients
    assert effects[["A", "C", "A:C", "A:B:C"]].to_list() == pytest.approx(
        [-101.625, 306.125, -153.625, 5.625]
    )


@pytest.mark.parametrize("name", ["reaction", "injection"])
def test_unreplicated_effects(name):
    design, response = published(name)
    result = doe.two_level_effects(design, response)
    expected = REFERENCE[name]
    ours = result.table["effect"][expected["names"]] if name == "reaction" else result.table["effect"]
    theirs = expected["effects"]
    assert sorted(np.abs(ours.head(len(theirs)))) == pytest.approx(sorted(np.abs(theirs)), rel=SAME)
    if name == "reaction":
        assert ours.to_numpy() == pytest.approx(theirs, rel=SAME)
        assert result.pseudo_error == pytest.approx(expected["pseudo_error"], rel=SAME)
        assert result.significant(0.05)[0] == "B"


def test_aliases_of_a_fraction():
    design, _ = published("injection")
    chains = alias_structure(design).chains
    theirs = [set(chain.split(" = ")) for chain in REFERENCE["injection"]["aliases"]]
    assert [set(chain.split(" = ")) for chain in chains] == [chain for chain in theirs if len(chain) > 1]


def test_screening_with_center_runs_and_plackett_burman():
    design, response = published("injection")
    result = screen(design, response, error="pooled")
    expected = REFERENCE["injection"]["coefficients"]
    ours = coefficient_table(result.fit)
    assert ours["estimate"].to_numpy() == pytest.approx(expected["estimate"], rel=SAME, abs=1e-12)
    assert ours.loc["curvature", "p"] == pytest.approx(expected["p"][-1], rel=SAME)
    design, response = published("fatigue")
    result = screen(design, response, error="pooled")
    expected = REFERENCE["fatigue"]["coefficients"]
    assert result.coded_coefficients.to_numpy() == pytest.approx(expected["estimate"], rel=SAME)
    assert result.table["p"].to_numpy() == pytest.approx(expected["p"][1:], rel=SAME)


def test_mixture():
    table = pd.read_csv(FOLDER / "polvoron.csv", comment="#", index_col="run")
    response = table.pop("y")
    fit = doe.fit_mixture(Mixture(table, {}), response)
    expected = REFERENCE["polvoron"]
    for column in ("estimate", "se", "t", "p"):
        assert fit.coefficient_table[column].to_numpy() == pytest.approx(expected[column], rel=SAME), column
    row = fit.predict({"x1": 0.5, "x2": 0.3, "x3": 0.2}).iloc[0]
    ours = [row["mean"], row["prediction_low"], row["prediction_high"]]
    assert ours == pytest.approx(list(np.ravel(expected["predicted"])), rel=SAME)


@pytest.mark.parametrize("count", [4, 5, 6, 7])
def test_box_behnken_and_its_blocks(count):
    expected = REFERENCE["box_behnken"][str(count)]
    factors = [Factor(f"x{number}", -1, 1) for number in range(count)]
    design = box_behnken(factors, center=0, blocks=count != 7)
    runs = [" ".join(f"{value:.0f}" for value in row) for row in design.coded.to_numpy() + 0.0]
    theirs = [run.replace("  ", " ").strip() for run in expected["runs"]]
    assert sorted(runs) == sorted(" ".join(run.split()) for run in theirs)
    if count < 6:
        ours = {
            frozenset(np.array(runs)[(design.blocks == label).to_numpy()]) for label in design.blocks.unique()
        }
        blocks = np.array(expected["blocks"])
        assert ours == {
            frozenset(" ".join(run.split()) for run in np.array(theirs)[blocks == label])
            for label in np.unique(blocks)
        }


@pytest.mark.parametrize("count", [2, 3, 4, 5])
@pytest.mark.parametrize(("ours", "theirs"), [("rotatable", "rotatable"), ("blocks", "orthogonal")])
def test_axial_distance(count, ours, theirs):
    factors = [Factor(f"x{number}", -1, 1) for number in range(count)]
    design = doe.central_composite(factors, ours, center=(3, 2), blocks=2, full=True)
    distance = REFERENCE["composite_alpha"][theirs][str(count)]
    assert design.coded.to_numpy().max() == pytest.approx(distance, rel=SAME)


@pytest.mark.parametrize("runs", [28, 36])
def test_published_screening_tables(runs):
    factors = [Factor(f"x{number}", -1, 1) for number in range(runs - 1)]
    design = doe.plackett_burman(factors, runs)
    signs = ["".join("+" if value > 0 else "-" for value in row) for row in design.coded.to_numpy()]
    assert signs == REFERENCE["plackett_burman"][str(runs)]

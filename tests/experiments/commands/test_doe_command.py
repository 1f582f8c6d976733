"""``dem-warp doe``: the numbers that R prints for the same tables, every kind of design, what is refused."""

import json
import re
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from commandline import dem_warp

from experiments.commands.tables.design_kinds import ADDITIONS, KINDS, MIXTURES

PUBLISHED = Path(__file__).parents[2] / "doe" / "data" / "published"
REFERENCE = json.loads((PUBLISHED / "reference.json").read_text(encoding="utf-8"))
FIVE_DIGITS = 1e-5
ORDERS = {
    "block": "blocks", "FO": "first order", "TWI": "two-way interactions", "PQ": "pure quadratic",
    "Residuals": "residual", "Lack of fit": "lack of fit", "Pure error": "pure error",
}  # fmt: skip


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def answered(*words: Any) -> dict[str, pd.DataFrame]:
    """Return the tables of an answer, the first column of each as its index."""
    code, out, problem = dem_warp("doe", *words, "--json")
    assert code == 0, problem
    tables = {name: pd.DataFrame(rows) for name, rows in json.loads(out)["tables"].items()}
    return {name: table.set_index(table.columns[0]) for name, table in tables.items()}


# The tables show by themselves which levels are coded -1 and +1.
@pytest.mark.parametrize(
    "name", ["chemical", "cakes", "helicopter", "cement", "carbon_monoxide", "trebuchet"]
)
def test_a_fit_prints_what_r_prints(name: str) -> None:
    """Analysis of variance with its lack of fit, predicted R2 and canonical analysis of R's rsm."""
    tables, expected = answered("fit", PUBLISHED / f"{name}.csv", "--response", "y"), REFERENCE[name]
    anova = tables["anova_by_order"].drop(index="total")
    assert list(anova.index) == [ORDERS[row.split("(")[0]] for row in expected["anova"]["names"]]
    for column in ("df", "sum_sq", "mean_sq", "F", "p"):
        theirs = pd.to_numeric(pd.Series(expected["anova"][column]), errors="coerce").to_numpy()
        assert anova[column].to_numpy(float) == pytest.approx(theirs, rel=FIVE_DIGITS, nan_ok=True), column
    quality = tables["quality"]["value"]
    assert quality["PRESS"] == pytest.approx(expected["press"], rel=FIVE_DIGITS)
    total = tables["anova"].loc["total", "sum_sq"] if "blocks" not in anova.index else None
    if total is not None:
        assert quality["R2 predicted"] == pytest.approx(1.0 - expected["press"] / total, rel=FIVE_DIGITS)
    assert tables["stationary"]["coded"].to_numpy() == pytest.approx(expected["stationary"], rel=FIVE_DIGITS)
    curvatures = sorted(tables["canonical"]["curvature"])
    assert curvatures == pytest.approx(sorted(expected["curvatures"]), rel=FIVE_DIGITS)


NEEDED = {
    "optimal": ["--runs", 12], "latin-hypercube": ["--runs", 8], "sobol": ["--runs", 8],
    "simplex-lattice": ["--degree", 2], "axial": ["--alpha", 1.5], "center": ["--center", 3],
}  # fmt: skip


@pytest.mark.parametrize("kind", [*KINDS, *MIXTURES, *ADDITIONS])
def test_every_kind_of_design_becomes_a_table_that_a_fit_reads(kind: str) -> None:
    if kind in MIXTURES:
        made_of = [word for name in "abc" for word in ("--component", name)]
    elif kind in ADDITIONS:
        answered("design", "full-factorial", *factors(3), "--out", "before")
        made_of = ["--table", filled(Path("before/tables/runs.csv"))]
    else:
        made_of = factors(3)
    answered("design", kind, *made_of, *NEEDED.get(kind, []), "--out", "made")
    words = ["--mixture"] if kind in MIXTURES else []
    model = "linear" if kind in MIXTURES else "first-order"
    tables = answered("fit", filled(Path("made/tables/runs.csv")), "--model", model, *words)
    assert len(tables["coefficients"]) >= 3
    assert not tables["coefficients"].index.str.contains("Q(", regex=False).any()
    assert Path("made/report.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")


def factors(count: int) -> list[str]:
    return [word for i in range(count) for word in ("--factor", f"x{i}=0.1..{0.5 + i} GPa")]


def filled(runs: Path) -> Path:
    """Write numbers into the empty column of a design's table."""
    table = pd.read_csv(runs)
    table["response"] = np.random.default_rng(1).normal(size=len(table))
    path = Path("filled.csv")
    table.to_csv(path, index=False)
    return path


def test_a_screening_names_the_effect_that_was_put_in() -> None:
    answered("design", "plackett-burman", *factors(5), "--out", "pb")
    table = pd.read_csv("pb/tables/runs.csv")
    table["response"] = 10.0 * (table["x1 [GPa]"] > 1.0) + 0.1 * np.random.default_rng(2).normal(size=12)
    table.to_csv("runs.csv", index=False)
    tables = answered("screen", "runs.csv", "--out", "screening")
    # The effect is 10 with a standard error of .1 * 2 / sqrt(12) = .06; six dummies give t(.975) = 2.4.
    assert tables["effects"]["effect"].iloc[0] == pytest.approx(10.0, abs=0.25)
    assert tables["effects"].index[0] == "x1"
    assert (tables["effects"]["p"].iloc[1:] > 1e-3).all()
    assert {path.stem for path in Path("screening/plots").iterdir()} >= {
        "pareto",
        "half_normal",
        "main_effects",
    }


def test_an_unreplicated_factorial_is_tested_with_its_interactions() -> None:
    """The filtration rate of Montgomery, Design and Analysis of Experiments, 2005, example 6-2."""
    rates = [45, 71, 48, 65, 68, 60, 80, 65, 43, 100, 45, 104, 75, 86, 70, 96]
    runs = [[*reversed(levels), rate] for levels, rate in zip(product((-1, 1), repeat=4), rates, strict=True)]
    table = pd.DataFrame(runs, columns=["A:Temp [C]", "B:Pressure", "C:Conc", "D:Stirring", "rate"])
    pattern = ["".join("-+"[level > 0] for level in row[:4]) for row in runs]
    table.assign(Pattern=pattern)[["Pattern", *table]].to_csv("runs.csv", index=False)
    code, said, notes = dem_warp("doe", "screen", "runs.csv", "--out", "screening")
    assert code == 0
    interactions = pd.read_csv("screening/tables/interactions.csv", index_col=0)["effect"]
    published = {
        "Temp": 21.625, "Temp:Conc": -18.125, "Temp:Stirring": 16.625, "Stirring": 14.625, "Conc": 9.875,
    }  # fmt: skip
    assert interactions.head(5).to_dict() == pytest.approx(published, rel=1e-12)  # rounding
    assert f"by Lenth's method: {', '.join(published)}." in " ".join(notes.split())
    assert re.search(r"^Temp:Conc +-18.12 ", said, re.MULTILINE)


def test_a_design_is_done_block_by_block_and_its_precision_is_drawn() -> None:
    words = ("--blocks", 2, "--seed", 5, "--out", "ccd")
    runs = answered("design", "central-composite", *factors(3), *words)["runs"]
    assert (runs["block"].diff() != 0).sum() == 2  # the first row, and the change
    assert list(runs.index) != sorted(runs.index)
    assert Path("ccd/plots/precision.png").is_file()


def test_noise_is_taken_out_of_a_comparison() -> None:
    """Differences of 1 that a noise of 1 explains leave nothing, and a perfect model ranks below 1."""
    pd.DataFrame({"a": range(20), "b": [n + (-1) ** n for n in range(20)]}).to_csv("runs.csv", index=False)
    words = ("--value", "a", "--reference", "b", "--reference-sd", 1)
    found = answered("compare", "runs.csv", *words)["agreement"]["value"]
    assert found["root mean square difference"] == pytest.approx(1.0, rel=1e-12)
    assert found["root mean square difference without noise"] < 0.2
    assert 0.9 < found["rank correlation of a perfect model"] < 1.0


def test_the_optimum_of_a_known_bowl() -> None:
    """Rounding alone: the responses are a quadratic and a plane."""
    answered("design", "central-composite", *factors(2), "--out", "ccd")
    table = pd.read_csv("ccd/tables/runs.csv").drop(columns="response")
    x, y = table["x0 [GPa]"], table["x1 [GPa]"]
    table = table.assign(bowl=30.0 - (x - 0.3) ** 2 - (y - 0.7) ** 2, plane=x + y)
    table.loc[3, "bowl"] += 1e-6  # a surface without residual has no intervals
    table.loc[3, "plane"] += 1e-6
    table.to_csv("runs.csv", index=False)
    best = answered("optimum", "runs.csv", "--wish", "bowl=max")["setting"]["natural"]
    assert best.to_list() == pytest.approx([0.3, 0.7], abs=1e-3)
    best = answered("optimum", "runs.csv", "--wish", "bowl=max:29..30", "--wish", "plane=1.2:0.5..2")
    assert best["responses"].loc["plane", "mean"] == pytest.approx(1.2, abs=0.3)
    names = ["--factor", "x0", "--factor", "x1"]
    near = answered("optimum", "runs.csv", "--wish", "plane=1.2", "--model", "first-order", *names)[
        "nearest"
    ]["natural"]
    assert near.sum() == pytest.approx(1.2, abs=1e-4)


def test_a_curve_gives_back_the_settings_that_made_it() -> None:
    """Edges of a made-up drum, with noise: steeper with friction, higher with the filling."""
    factor = ("--factor", "friction=0.2..0.8", "--factor", "fill=0.2..0.4")
    answered("design", "sobol", *factor, "--runs", 32, "--out", "sobol")
    runs, places = pd.read_csv("sobol/tables/runs.csv").drop(columns="response"), np.linspace(-40.0, 40.0, 17)
    rng = np.random.default_rng(3)

    def edge(friction: float, fill: float) -> np.ndarray:
        return -20.0 * np.tanh(places / (30.0 - 20.0 * friction)) + 60.0 * (fill - 0.3)

    rows = [edge(*row) + rng.normal(0.0, 0.1) for row in runs[["friction", "fill"]].to_numpy()]
    heights = pd.DataFrame(rows, columns=[f"{place:g}" for place in places])
    runs.join(heights).to_csv("runs.csv", index=False)
    seen = edge(0.55, 0.27) + rng.normal(0.0, 0.1, len(places))
    # half of the places, and from the other side
    pd.DataFrame({"x": places, "z": seen})[2:13][::-1].to_csv("edge.csv", index=False)
    words = ("--measured", "edge.csv", "--reading", 0.1, "--alpha", 0.01, "--out", "fit")
    found = answered("curve", "runs.csv", *words)
    settings = found["settings"].loc[["friction", "fill"]]
    assert (settings["low"] < [0.55, 0.27]).all()
    assert (settings["high"] > [0.55, 0.27]).all()
    assert (settings["part of the range"] < 0.25).all()
    # a further measurement beyond the places that were seen: 99 % of it
    curve = found["curve"]
    assert curve["measured"].notna().sum() == 11
    assert ((curve["low"] < edge(0.55, 0.27)) & (edge(0.55, 0.27) < curve["high"])).all()
    assert Path("fit/plots/curve.png").is_file()


def test_columns_of_other_programs_are_not_factors() -> None:
    """Minitab's and Design-Expert's columns of order, decimal commas, an empty response."""
    rows = ["Std;Run;Space Type;A (mm);B;angle"]
    rows += [f"{i};{9 - i};Factorial;{a},5;{b};{10 + a + 2 * b + 0.1 * (i % 3)}" for i, (a, b) in enumerate(
        [(1, 0), (2, 0), (1, 1), (2, 1), (1, 0), (2, 1)], start=1
    )]  # fmt: skip
    Path("runs.csv").write_text("\n".join([*rows, "7;1;Center;1,5;1;"]) + "\n", encoding="utf-8")
    tables = answered("fit", "runs.csv", "--model", "first-order", "--at", "A=1.5,B=0.5")
    assert list(tables["coefficients"].index) == ["intercept", "A", "B"]
    # Half of the differences 1 and 2, with scatter of .1.
    assert tables["coefficients"]["estimate"].to_list() == pytest.approx([12.6, 0.5, 1.0], abs=0.1)
    assert (
        tables["predictions"]["confidence_low"].iloc[0]
        < 12.1
        < tables["predictions"]["confidence_high"].iloc[0]
    )


@pytest.mark.parametrize("twist", [0.5, 0.0])  # without one the fit is exact, and no warning leaks
@pytest.mark.parametrize("head", ["Versuch", "Nr.", "Run No", "ID", "Essai"])
def test_a_number_of_the_run_is_not_a_factor(head: str, twist: float) -> None:
    corners = [(-1, -1), (1, -1), (-1, 1), (1, 1)]
    rows = [f"{i};{a};{b};{20 + a + 2 * b + twist * a * b}" for i, (a, b) in enumerate(corners)]
    Path("runs.csv").write_text("\n".join([f"{head};A;B;angle", *rows]) + "\n", encoding="utf-8")
    tables = answered("fit", "runs.csv", "--model", "first-order")
    assert tables["coefficients"]["estimate"].to_list() == pytest.approx([20.0, 1.0, 2.0])


def test_a_title_above_the_names_changes_nothing() -> None:
    text = "A (mm),B,angle\n1,0,11\n2,0,12\n1,1,13\n2,1,14.2\n"
    Path("runs.csv").write_text(text, encoding="utf-8")
    Path("titled.csv").write_text(f"Series 3 of March\n\n{text}", encoding="utf-8")
    plain, titled = (answered("fit", name, "--model", "first-order") for name in ("runs.csv", "titled.csv"))
    pd.testing.assert_frame_equal(plain["coefficients"], titled["coefficients"])


@pytest.mark.parametrize(
    ("text", "words", "message"),
    [
        ("A,y\n1,2\n2,three\n", ["fit"], "runs.csv:3: y: must be a number, or empty, got three"),
        ("A,B,y\n1,2,1\n2,,3\n", ["fit"], "runs.csv:3: B: must have a setting, got nothing"),
        ("A,y\n1,2\n1,3\n", ["fit"], "A: must have two levels or more"),
        ("A,y\n1,\n2,\n", ["fit"], "column 'y' has no value yet"),
        ("A,y\n", ["fit"], "has no rows below the names"),
        ("A,y\n1,2\n2,3\n", ["fit", "--response", "z"], "has no column 'z'; known: A, y"),
        ("A,y (deg),y (rad)\n1,2,3\n", ["fit", "--response", "y"], "has several columns 'y'"),
        ("A,y,y\n1,2,3\n2,3,4\n", ["fit"], "runs.csv:1: must have one column y, got y, y"),
        ('A,y\n1,"1,250"\n2,"2,500"\n', ["fit"], "runs.csv:2: y: may be thousands or a decimal number"),
        ("A;y\n1,5;1.250\n2,5;2.500\n", ["fit"], "runs.csv: may have marks of thousands"),
        ("A\ty\n1.5\t1,250\n2.5\t990\n", ["fit"], "write numbers without them, got 1"),
        ("A,y\n1,2\n2,3\n", ["fit", "--model", "cubic"], "no factor is named 'cubic'"),
        ("A,y\n1,2\n2,3\n", ["optimum", "--wish", "y=best"], "--wish: needs max, min or a number as its aim"),
        ("A,y\n1,2\n2,3\n", ["optimum", "--wish", "y=max:3..high"], "numbers as the ends of its scale"),
        ("A,y\n1,2\n2,3\n", ["fit", "--formula", "A", "--reduce"], "--reduce: needs a polynomial"),
        ("A,y\n1,2\n2,3\n", ["screen", "--error", "mine"], "error"),
        ("A,y\n1,2\n2,3\n", ["fit", "--alpha", "2"], "--alpha"),
        ("A,y\n1,2\n", ["compare", "--value", "y", "--reference", "y"], "needs different columns, got y, y"),
        ("A,y\n1,2\n", ["curve", "--measured", "runs.csv", "--reading", "1"], "needs the heights of a curve"),
        ("A,y\n1,2\n2,3\n3,5\n", ["fit", "--model", "A", "--out", "."], "must be a new or an empty folder"),
    ],
)  # fmt: skip
def test_bad_tables_and_options_are_refused(text: str, words: list[str], message: str) -> None:
    Path("runs.csv").write_text(text, encoding="utf-8")
    code, _, problem = dem_warp("doe", words[0], "runs.csv", *words[1:])
    assert code == 2
    assert message in problem
    assert "Traceback" not in problem


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["plackett"], "KIND: must be a kind of design; did you mean 'plackett-burman'?"),
        (["sobol", "--factor", "A=0..1"], "--runs: is needed by sobol"),
        (
            ["sobol", "--factor", "A=0..1", "--runs", "4", "--center", "2"],
            "--center: sobol has no such option",
        ),
        (["foldover"], "--table: is needed by foldover"),
        (["full-factorial", "--factor", "A"], "--factor: needs a name and its levels"),
        (["full-factorial", "--factor", "A=2..1"], "low must be below high"),
    ],
)
def test_bad_designs_are_refused(words: list[str], message: str) -> None:
    code, _, problem = dem_warp("doe", "design", *words)
    assert code == 2
    assert message in problem

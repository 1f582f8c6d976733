"""A campaign whose runs a person simulates: sheets out, numbers in, and what is refused."""

import json
import shutil
import sys
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import openpyxl
import pandas as pd
import pytest
from commandline import dem_warp
from cone_engine import cone_of
from emulated import EmulatedSimulator, emulated_heaps

from doe.discrepancy import Point, fit_emulator, load_bank
from experiments.calibrate.screening_stage import DESIGNS
from experiments.io.rows import Row
from experiments.runs import by_hand
from experiments.studies.buckwheat import paper
from experiments.studies.buckwheat.paper import published
from experiments.studyfile.observables import BY_NAME, PHOTOGRAPHED

STUDY = Path(__file__).parents[3] / "experiments" / "studies" / "buckwheat"
TRIAL = STUDY.with_name("trial")
MECHANISMS = {"plate_tilt": "plate_tilt [deg]", "rolling_torque": "rolling_torque [1]"}
"""Mechanisms of the search, and their columns in its sheets."""
PRINTED = "repose_angle_deg"
PAPER = {
    "# start = ": "start = ", "# step = ": "step = ", "# drop = ": "drop = ",
    'center_rule = "crossing"': 'center_rule = "smallest-error"', 'alpha = "rotatable"': "alpha = 1.414",
    "steps = 6\nreplicates = 2": "steps = 6\nreplicates = 1",
    "[campaign.screening]": '[campaign.screening]\ndesign = "paper"',
}  # fmt: skip
"""The paper's decisions, which its study has as comments, and its order of the screening's columns."""


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    made = paper.screening_design()
    monkeypatch.setattr(DESIGNS, "_outside", {"paper": lambda own, runs: replace(made, factors=tuple(own))})
    text = (STUDY / "study.toml").read_text(encoding="utf-8")
    for before, after in PAPER.items():
        assert before in text
        text = text.replace(before, after, 1)
    for name in ("clump.txt", "clumps"):
        (shutil.copytree if (STUDY / name).is_dir() else shutil.copy)(STUDY / name, name)
    path = Path("paper.toml")
    path.write_text(text, encoding="utf-8")
    return path


def step(study: Path, *words: str) -> tuple[int, str]:
    code, _, said = dem_warp("calibrate", study, "--scale", "paper", "--by-hand", "--out", "run", *words)
    return code, said


def last_sheet() -> Path:
    return max(Path("run/by-hand").glob("*.csv"))


def fill(sheet: Path) -> None:
    """Type in the printed angles; the centre, which the paper did not repeat, gets 20 degrees and a noise."""
    head = "".join(
        line for line in sheet.read_text(encoding="utf-8").splitlines(True) if line.startswith("#")
    )
    runs = pd.read_csv(sheet, comment="#", dtype=str)
    e, f = runs["E [1]"].astype(float), runs["F [1]"].astype(float)
    composite, climb = published("central_composite"), published("steepest_climb")
    around = 0.48 + 0.06 * composite["E_coded"], 0.45 + 0.10 * composite["F_coded"]
    printed = {
        "steepest": pairs(climb["E"], climb["F"], climb[PRINTED]),
        "surface": pairs(*around, composite[PRINTED]),
    }
    stage = runs["stage"].iloc[0]
    if stage == "noise_floor":  # in one sheet with the screening
        noise = 20.0 + np.random.default_rng(5).normal(0.0, 0.3, len(runs))
        screened = runs["run"].astype(int).map(published("plackett_burman")[PRINTED])
        angles = screened.where(runs["stage"] == "screening", noise)
    elif stage == "verification":
        angles = pd.Series(np.resize(published("verification")[PRINTED], len(runs)))
    else:
        left = printed["surface" if stage == "surface" else "steepest"]
        angles = pd.Series([left[round(x, 4), round(y, 4)].pop(0) for x, y in zip(e, f, strict=True)])
    sheet.write_text(head + runs.assign(**{"angle [deg]": angles}).to_csv(index=False), encoding="utf-8")


def pairs(e: pd.Series, f: pd.Series, angles: pd.Series) -> dict[tuple[float, float], list[float]]:
    found: dict[tuple[float, float], list[float]] = {}
    for x, y, angle in zip(e, f, angles, strict=True):
        found.setdefault((round(x, 4), round(y, 4)), []).append(float(angle))
    return found


def test_the_printed_angles_typed_in_give_the_papers_tables(study: Path) -> None:
    """Every stage waits with exit code 0; no simulator is asked for anything.

    A cell that the paper prints has half of its last digit; a sheet has ten digits of each setting.
    """
    code, said = step(study)
    for _ in range(9):
        assert code == 0, said
        if Path("run/report.html").is_file():
            break
        assert "fill in its last columns, and resume" in said
        fill(last_sheet())
        code, said = step(study, "--resume")
    results = json.loads(Path("run/results.json").read_text(encoding="utf-8"))["campaign"]
    surface = results["surface"]["responses"]["angle"]
    tables = {
        ("Table 4", "screening_anova"): results["screening"]["responses"]["angle"]["screen"]["table"],
        ("Table 7", "quadratic_anova"): surface["full"]["anova"],
        ("Table 8", "reduced_anova"): surface["reduced"]["anova"],
    }
    misprints = {(each.place, each.item) for each in paper.misprints()}
    for (place, name), rows in tables.items():
        found = {row.get("source", row.get("factor")): row for row in rows}
        printed = paper.printed(name)
        for row, column in product(printed.index, printed.columns):
            text = printed.loc[row, column]
            if text and (place, f"{row}, {column}") not in misprints:
                half = 0.500001 * 10.0 ** -len(text.partition(".")[2])
                assert found[row][column] == pytest.approx(float(text), abs=half), (place, row, column)
    assert (Path("run/by-hand/edem/values.csv")).is_file()
    assert "EDEM: E = Coefficient of Static Friction of grain with grain" in last_sheet().read_text(
        encoding="utf-8"
    )


def test_a_sheet_that_is_not_as_it_was_written_is_refused(study: Path) -> None:
    step(study)
    sheet = last_sheet()
    empty = sheet.read_text(encoding="utf-8")
    assert step(study, "--resume")[0] == 0  # nothing is filled in yet
    fill(sheet)
    filled = sheet.read_text(encoding="utf-8")
    lines = filled.splitlines()
    for wrong, message in [
        (
            "\n".join([*lines[:-1], empty.splitlines()[-1]]),
            "has no angle [deg] yet for screening run 12 ",
        ),
        (filled.replace(",0.29,", ",0.3,", 1), "A [1]: must stay as the campaign wrote it, 0.29, got 0.3"),
        ("\n".join([*lines[:-1], lines[-1].rsplit(",", 2)[0] + ",steep,"]), "must be a number, got steep"),
        ("\n".join([*lines[:-1], lines[-1].rsplit(",", 2)[0] + ",inf,"]), "must be a number, got inf"),
        (
            "\n".join([*lines[:-1], lines[-1].rsplit(",", 2)[0] + ",200,"]),
            "between 0 and 90 in this test",
        ),
        ("\n".join([*lines, lines[-1]]), "case: must be one row, but is in"),
        ("\n".join([*lines[:-1], lines[-1].rsplit(",", 2)[0] + ",,heap.png"]), "picture: shows no angle"),
    ]:
        sheet.write_text(wrong + "\n", encoding="utf-8")
        code, said = step(study, "--resume")
        assert code == 2
        assert message in said
        assert not Path("run/report.html").exists()


def test_a_sheet_of_excel_is_written_filled_and_read(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with study.open("a", encoding="utf-8") as file:
        file.write('\n[engine]\nby = "hand"\nsheet = "xlsx"\n')
    words = ("calibrate", study, "--scale", "paper", "--out", "run")
    assert dem_warp(*words)[0] == 0
    sheet = Path("run/by-hand/01-noise-floor-screening.xlsx")
    book = openpyxl.load_workbook(sheet)
    rows = [row for row in book.active if not str(row[0].value).startswith("#")]
    [place] = [cell.column - 1 for cell in rows[0] if cell.value == "angle [deg]"]
    for number, row in enumerate(rows[1:]):
        row[place].value = 20.0 + number
    rows[-1][place].value = "Failed"
    book.save(sheet)
    code, _, said = dem_warp(*words, "--resume")
    assert code == 0, said
    floor = np.std([20.0 + n for n, row in enumerate(rows[1:]) if row[1].value == "noise_floor"], ddof=1)
    assert f"A single case varies in angle by {floor:.2f} deg" in said
    assert "1 of 12 cases failed (1 failed)" in said
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    code, _, said = dem_warp(*words, "--resume")
    assert code == 2
    assert "Install it by pip install 'dem-warp[excel]'" in said


@pytest.mark.parametrize("fit", ["flank", "middle"])
def test_the_spheres_of_a_run_are_measured_as_the_study_measures(fit: str, tmp_path: Path) -> None:
    cone = cone_of(0.5)
    rows = np.column_stack([cone.sphere_centers, cone.sphere_radii])
    pd.DataFrame(rows, columns=list("xyzr")).to_csv(tmp_path / "cone.csv", index=False)
    found = by_hand._pictured(Row(tmp_path / "sheet.csv", 2, {by_hand.PICTURE: "cone.csv"}), fit)
    code, out, _ = dem_warp("angle", tmp_path / "cone.csv", "--fit", fit, "--json")
    assert code == 0
    assert found["angle"] == json.loads(out)["pictures"][0]["mean"]


def search(*words: str) -> tuple[int, str]:
    code, _, said = dem_warp(
        "discover", "study.toml", "measured.csv", "--scale", "bench", "--out", "found", *words
    )
    return code, said


def test_a_search_names_a_hidden_tilt_from_runs_that_a_person_typed_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The person's program is an emulator of the shipped bank; every batch waits with exit code 0."""
    monkeypatch.chdir(tmp_path)
    text = (TRIAL / "study.toml").read_text(encoding="utf-8").replace('companion = "trial"', "")
    few = text.replace('"contact_adhesion", "liquid_bridges", "plate_tilt",', '"plate_tilt",')
    few = few.replace(', "size_spread", "vibration"]', "]").replace("outline = true", "outline = false")
    Path("study.toml").write_text(few + '\n[engine]\nby = "hand"\n', encoding="utf-8")
    shutil.copy(TRIAL / "clump.txt", "clump.txt")
    person = EmulatedSimulator(fit_emulator(load_bank(TRIAL / "bank-bench.npz")))
    heaps = emulated_heaps(person, (0.6, 0.5, 0.3), {"plate_tilt": 5.0}, replicates=20, seed=1)
    cells = [
        (condition, replicate, name, value, BY_NAME[name].unit)
        for condition, table in dict(heaps.values).items()
        for replicate, row in enumerate(table, start=1)
        for name, value in zip(heaps.observables, row, strict=True)
        if name in PHOTOGRAPHED
    ]
    columns = ["condition", "replicate", "observable", "value", "unit"]
    pd.DataFrame(cells, columns=columns).to_csv("measured.csv", index=False)
    code, said = search()
    leave_a_column_out(Path("found/by-hand/01-bank.csv"))
    code, said = search("--resume")
    assert code == 2
    assert "01-bank.csv: has no concavity [1], height [m], r50 [m]" in said
    assert "yet for bank run 1 repeat 1 (line" in said
    shutil.rmtree("found")
    code, said = search()
    for _ in range(12):
        assert code == 0, said
        if Path("found/report.html").is_file():
            break
        assert "fill in its last columns, and resume" in said
        answer(max(Path("found/by-hand").glob("*.csv")), person)
        code, said = search("--resume")
    found = json.loads(Path("found/results.json").read_text(encoding="utf-8"))["discovery"]
    assert (found["verdict"], found["named"]) == ("named", ["plate_tilt"])


def leave_a_column_out(sheet: Path) -> None:
    """Type in the first result of all runs alone."""
    text = sheet.read_text(encoding="utf-8")
    head = "".join(line for line in text.splitlines(True) if line.startswith("#"))
    runs = pd.read_csv(sheet, comment="#", dtype=str).assign(**{"flank_angle [deg]": "20"})
    sheet.write_text(head + runs.to_csv(index=False), encoding="utf-8")


def answer(sheet: Path, person: EmulatedSimulator) -> None:
    """Type in what a program would give for the runs of a sheet."""
    head = "".join(
        line for line in sheet.read_text(encoding="utf-8").splitlines(True) if line.startswith("#")
    )
    runs = pd.read_csv(sheet, comment="#")
    points = [
        Point(
            (row["mu_gg [1]"], row["mu_gw [1]"], row["e_gg [1]"]),
            tuple((name, row[column]) for name, column in MECHANISMS.items() if row[column]),
            row["test"],
            int(row["seed"]),
        )
        for row in runs.to_dict("records")
    ]
    values = pd.DataFrame(person(points).values, columns=list(person.observables))
    typed = [column for column in runs if column.split(" ")[0] in person.observables]
    assert typed
    runs[typed] = values[[column.split(" ")[0] for column in typed]]
    sheet.write_text(head + runs.to_csv(index=False), encoding="utf-8")


def test_the_time_that_a_person_takes_is_not_forecast(study: Path) -> None:
    words = ("calibrate", study, "--scale", "paper", "--by-hand", "--dry-run", "--json")
    code, out, said = dem_warp(*words)
    assert code == 0, said
    assert json.loads(out)["seconds"] is None


def test_only_campaigns_and_searches_wait_for_a_person(study: Path) -> None:
    code, _, said = dem_warp("heap", study, "--scale", "bench", "--engine", "hand", "--out", "one")
    assert code == 2
    assert "only calibrate, plan, bridge and discover wait" in said

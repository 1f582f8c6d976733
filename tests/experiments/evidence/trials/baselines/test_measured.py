"""Trials with measured heaps, as other methods than the search meet them, and their records."""

from __future__ import annotations

import shutil
import zlib
from dataclasses import replace
from pathlib import Path

import pytest

from doe.discrepancy import Settings
from experiments.evidence.trials.baselines import benchmark_files, record
from experiments.evidence.trials.baselines.answers_table import file_of, read_answers
from experiments.evidence.trials.baselines.library import methods
from experiments.evidence.trials.baselines.measured import measured_problems, open_labels, opened_trials
from experiments.evidence.trials.declaration import Declaration, read_declaration
from experiments.evidence.trials.drawing import Plan
from experiments.evidence.trials.findings import (
    EVERYTHING,
    OUTLINED,
    PHOTOGRAPHS,
    VIEWS,
    Finding,
    findings_table,
    write_findings,
)
from experiments.evidence.trials.folder import Folder
from experiments.evidence.trials.generate import STUDY
from experiments.evidence.trials.truth import Kind, Label, Sealed, read_labels, write_labels, write_sealed
from experiments.io.errors import InputError

RECORDS = Path(benchmark_files.FOLDER).parents[1] / "record"
KEPT = RECORDS / "baselines"


def test_measured_trials_are_posed_as_the_search_has_them(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    settings = Settings(systematic=0.2)
    Declaration("trial", "bench", "2026-11-23", Plan(), settings, (), ()).write(folder.declared)
    write_sealed(
        folder.sealed, [Sealed(name, "alone", ("vibration",), "") for name in ("alone-001", "alone-002")]
    )
    folder.data.mkdir()
    shutil.copy(STUDY.with_name("tilted-bench.csv"), folder.measured("alone-001"))
    [problem] = measured_problems(tmp_path)  # the second has no heaps yet
    assert problem.trial == "alone-001"
    assert "vibration" not in problem.emulator.space.names
    assert problem.settings == settings
    # A plate that tilts by 5 degrees is hidden in these heaps, which the engine made.
    answer = methods(None)["lasso"](problem)
    assert answer.alarm
    assert set(answer.named) <= {"plate_tilt"}


@pytest.mark.parametrize("series", ["eighth", "ninth"])
def test_a_record_with_its_heaps_is_posed_as_its_folder_is(series: str) -> None:
    [problem] = measured_problems(RECORDS / series, count=1)
    assert problem.trial == "alone-001"
    # the search has no outlines with every observable
    assert set(problem.measured.observables) <= set(VIEWS[EVERYTHING])
    assert problem.measured.values["base"].shape[0] == 8
    assert problem.seed == zlib.crc32(b"alone-001.everything")
    assert problem.settings.resolvable == ("liquid_bridges", "plate_tilt", "rolling_torque")


def test_the_view_of_the_plan_is_what_methods_see(tmp_path: Path) -> None:
    with opened_trials(RECORDS / "eighth") as folder:
        shutil.copytree(folder.root, tmp_path, dirs_exist_ok=True)
    declaration = read_declaration(Folder(tmp_path).declared)
    seen = replace(declaration, plan=replace(declaration.plan, view=OUTLINED))
    seen.write(Folder(tmp_path).declared)
    [problem] = measured_problems(tmp_path, count=1)
    assert set(problem.measured.observables) == set(VIEWS[OUTLINED])
    assert problem.seed == zlib.crc32(b"alone-001.outlined")


def test_a_place_without_heaps_is_refused() -> None:
    with pytest.raises(InputError, match="needs measured heaps"):
        next(measured_problems(RECORDS / "seventh"))


@pytest.mark.parametrize("view", [EVERYTHING, OUTLINED])
def test_labels_are_open_of_what_the_search_has_analysed_and_of_nothing_else(
    view: str, tmp_path: Path
) -> None:
    folder, labels = (
        Folder(tmp_path),
        [Label(name, Kind.NULL, (0.5,), (), (), 1, "") for name in ("seen", "unseen")],
    )
    declare(folder, view)
    write_labels_of(folder, labels)
    with pytest.raises(InputError, match="needs findings"):
        open_labels(folder)
    rows = [Finding("seen", view, "none"), Finding("unseen", PHOTOGRAPHS, "none")]
    write_findings(folder.findings, findings_table(rows))
    assert open_labels(folder) == labels[:1]
    write_labels_of(folder, [replace(labels[0], seed=2)], seals=labels)
    with pytest.raises(InputError, match="must have the hash"):
        open_labels(folder)


def declare(folder: Folder, view: str) -> None:
    """Declare trials that are counted in a view."""
    Declaration("trial", "bench", "2026-11-23", Plan(view=view), Settings(), (), ()).write(folder.declared)


def write_labels_of(folder: Folder, labels: list[Label], seals: list[Label] | None = None) -> None:
    """Hide labels in a folder, and seal them, or others."""
    for place in (folder.hidden, folder.record):
        place.mkdir(exist_ok=True)
    write_labels(folder.hidden_labels, labels)
    write_sealed(folder.sealed, [Sealed(one.trial, "alone", (), one.hash) for one in seals or labels])


@pytest.mark.parametrize("view", [EVERYTHING, OUTLINED])
def test_findings_of_measured_trials_are_answers_of_the_search(view: str, tmp_path: Path) -> None:
    folder = Folder(tmp_path / "trials")
    rows = [
        Finding("alone-001", view, "named", "plate_tilt", True, q=120.0, degrees_of_freedom=60.0),
        Finding("alone-002", view, "unknown", "", True, q=180.0, degrees_of_freedom=60.0),
        Finding("alone-002", PHOTOGRAPHS, "none", "", False, q=10.0, degrees_of_freedom=20.0),
    ]
    declare(folder, view)
    write_findings(folder.findings, findings_table(rows))
    record.gather_search(folder, tmp_path / "record")
    named, unknown = read_answers(file_of(tmp_path / "record", "search")).to_dict("records")
    assert (named["trial"], named["named"], named["alarm"], named["score"]) == (
        "alone-001",
        "plate_tilt",
        True,
        2.0,
    )
    assert (unknown["trial"], unknown["named"], unknown["unknown"]) == ("alone-002", "", True)


@pytest.mark.parametrize("series", ["eighth", "ninth", "seventeenth"])
def test_the_records_of_measured_trials_have_the_searchs_findings(series: str, tmp_path: Path) -> None:
    kept = KEPT / series
    assert (kept / "labels.json").read_bytes() == (RECORDS / series / "labels.json").read_bytes()
    with opened_trials(RECORDS / series) as trials:
        record.gather_search(trials, tmp_path)
    assert file_of(tmp_path, "search").read_bytes() == file_of(kept, "search").read_bytes()
    shutil.copytree(kept, tmp_path / series)
    assert record.write_methods_page(tmp_path / series).read_bytes() == (kept / "README.md").read_bytes()
    assert set(record.read_record(kept)["trial"]) == {one.trial for one in read_labels(kept / "labels.json")}

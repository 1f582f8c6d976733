"""Trials with measured heaps, as other methods than the search meet them, and their records."""

import shutil
import zlib
from dataclasses import replace
from pathlib import Path

import pytest

from doe.discrepancy import Settings
from experiments.evidence.trials import findings, truth
from experiments.evidence.trials.analyses import read_data
from experiments.evidence.trials.baselines import benchmark_files, record_methods
from experiments.evidence.trials.baselines.answers_table import file_of, read_answers
from experiments.evidence.trials.baselines.measured_problems import (
    measured_problems,
    open_labels,
    opened_trials,
)
from experiments.evidence.trials.baselines.method_list import methods
from experiments.evidence.trials.declaration import Declaration, read_declaration
from experiments.evidence.trials.generate_trials import STUDY
from experiments.evidence.trials.trials_folder import Folder
from experiments.evidence.trials.truths import Plan
from experiments.io.errors import InputError
from experiments.studyfile import load_study

RECORDS = Path(benchmark_files.FOLDER).parents[1] / "record"
KEPT = RECORDS / "baselines"


def test_measured_trials_are_posed_as_the_search_has_them(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    settings = Settings(systematic=0.2)
    Declaration("trial", "bench", "2026-11-23", Plan(), settings, (), ()).write(folder.declared)
    truth.write_sealed(
        folder.sealed,
        [truth.Sealed(name, "alone", ("vibration",), "") for name in ("alone-001", "alone-002")],
    )
    folder.data.mkdir()
    shutil.copy(STUDY.with_name("tilted-bench.csv"), folder.measured("alone-001"))
    [problem] = measured_problems(tmp_path)  # the second has no heaps yet
    assert problem.trial == "alone-001"
    assert "vibration" not in problem.emulator.space.names
    assert problem.settings == settings
    # A plate that tilts by 5 degrees is hidden in these heaps, which the engine made.
    answer = methods(None)["BIC"](problem)
    assert answer.alarm
    assert set(answer.named) <= {"plate_tilt"}


def test_a_record_with_its_heaps_is_opened_as_its_folder_is() -> None:
    with opened_trials(RECORDS / "eleventh") as folder:
        sealed = truth.read_sealed(folder.sealed)
        assert all(folder.measured(one.trial).is_file() for one in sealed)
        study = load_study(STUDY, read_declaration(folder.declared).scale)
        measured, refused = read_data(folder, sealed[:1], study)
    assert not refused
    assert measured["alone-001"].values["base"].shape[0] == 8


@pytest.mark.parametrize("view", [findings.EVERYTHING, findings.OUTLINED])
def test_the_view_of_the_plan_is_what_methods_see(view: str, tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    declare(folder, view)
    write_labels_of(folder, [truth.Label("alone-001", truth.Kind.NULL, (0.5,), (), (), 1, "")])
    folder.data.mkdir()
    shutil.copy(STUDY.with_name("tilted-bench.csv"), folder.measured("alone-001"))
    [problem] = measured_problems(tmp_path, count=1)
    assert set(problem.measured.observables) <= set(findings.VIEWS[view])
    assert problem.seed == zlib.crc32(f"alone-001.{view}".encode())


def test_a_place_without_heaps_or_without_a_bank_is_refused(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    declare(folder, findings.EVERYTHING)
    write_labels_of(folder, [])
    with pytest.raises(InputError, match="needs measured heaps"):
        next(measured_problems(tmp_path))
    with pytest.raises(InputError, match="generate_trials bank"):
        next(measured_problems(RECORDS / "eleventh", count=1))


@pytest.mark.parametrize("view", [findings.EVERYTHING, findings.OUTLINED])
def test_labels_are_open_of_what_the_search_has_analysed_and_of_nothing_else(
    view: str, tmp_path: Path
) -> None:
    folder, labels = (
        Folder(tmp_path),
        [truth.Label(name, truth.Kind.NULL, (0.5,), (), (), 1, "") for name in ("seen", "unseen")],
    )
    declare(folder, view)
    write_labels_of(folder, labels)
    with pytest.raises(InputError, match="needs findings"):
        open_labels(folder)
    rows = [findings.Finding("seen", view, "none"), findings.Finding("unseen", findings.PHOTOGRAPHS, "none")]
    findings.write_findings(folder.findings, findings.findings_table(rows))
    assert open_labels(folder) == labels[:1]
    write_labels_of(folder, [replace(labels[0], seed=2)], seals=labels)
    with pytest.raises(InputError, match="must have the hash"):
        open_labels(folder)


def declare(folder: Folder, view: str) -> None:
    """Declare trials that are counted in a view."""
    Declaration("trial", "bench", "2026-11-23", Plan(view=view), Settings(), (), ()).write(folder.declared)


def write_labels_of(
    folder: Folder, labels: list[truth.Label], seals: list[truth.Label] | None = None
) -> None:
    """Hide labels in a folder, and seal them, or others."""
    for place in (folder.hidden, folder.record):
        place.mkdir(exist_ok=True)
    truth.write_labels(folder.hidden_labels, labels)
    truth.write_sealed(
        folder.sealed, [truth.Sealed(one.trial, "alone", (), one.hash) for one in seals or labels]
    )


@pytest.mark.parametrize("view", [findings.EVERYTHING, findings.OUTLINED])
def test_findings_of_measured_trials_are_answers_of_the_search(view: str, tmp_path: Path) -> None:
    folder = Folder(tmp_path / "trials")
    rows = [
        findings.Finding("alone-001", view, "named", "plate_tilt", True, q=120.0, degrees_of_freedom=60.0),
        findings.Finding("alone-002", view, "unknown", "", True, q=180.0, degrees_of_freedom=60.0),
        findings.Finding(
            "alone-002", findings.PHOTOGRAPHS, "none", "", False, q=10.0, degrees_of_freedom=20.0
        ),
    ]
    declare(folder, view)
    findings.write_findings(folder.findings, findings.findings_table(rows))
    record_methods.gather_search(folder, tmp_path / "record")
    named, unknown = read_answers(file_of(tmp_path / "record", "search")).to_dict("records")
    assert (named["trial"], named["named"], named["alarm"], named["score"]) == (
        "alone-001",
        "plate_tilt",
        True,
        2.0,
    )
    assert (unknown["trial"], unknown["named"], unknown["unknown"]) == ("alone-002", "", True)


@pytest.mark.parametrize("series", ["", *sorted(each.parent.name for each in KEPT.glob("*/answers"))])
def test_a_kept_record_is_written_again_to_the_same_text(series: str, tmp_path: Path) -> None:
    shutil.copytree(KEPT, tmp_path / KEPT.name)
    page = record_methods.write_methods_page(tmp_path / KEPT.name / series)
    assert page.read_bytes() == (KEPT / series / "README.md").read_bytes()


def test_the_record_of_measured_trials_has_the_searchs_findings(tmp_path: Path) -> None:
    with opened_trials(RECORDS / "seventeenth") as trials:
        record_methods.gather_search(trials, tmp_path)
    kept = KEPT / "seventeenth"
    assert file_of(tmp_path, "search").read_bytes() == file_of(kept, "search").read_bytes()
    labels = truth.read_labels(RECORDS / "seventeenth" / "labels.json")
    assert set(record_methods.read_record(kept)["trial"]) == {one.trial for one in labels}

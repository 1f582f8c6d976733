"""A record of a second reality shows what has been analysed, hides the rest, and can be gone on from."""

import io
import tarfile
from pathlib import Path

import pytest
from typer.testing import CliRunner

from doe.discrepancy import Settings, Verdict
from experiments.evidence.trials import truth
from experiments.evidence.trials.declaration import Declaration
from experiments.evidence.trials.findings import EVERYTHING, Finding, findings_table, write_findings
from experiments.evidence.trials.other_codes.generate_other import app, write_reality
from experiments.evidence.trials.record_trials import gather
from experiments.evidence.trials.run_trials import open_jobs
from experiments.evidence.trials.trial_heaps import unpack_heaps
from experiments.evidence.trials.trials_folder import HEAPS, LABELS, REALITY, Folder
from experiments.evidence.trials.trials_page import read_record, write_trials_page
from experiments.evidence.trials.truths import Declared, Plan
from experiments.io.errors import InputError

ANALYSED, MEASURED, UNTOUCHED = "alone-001", "alone-002", "alone-003"


def label_of(trial: str, *names: str) -> truth.Label:
    kind = truth.Kind.SINGLE if names else truth.Kind.NULL
    sizes = tuple((name, 3.5) for name in names)
    return truth.Label(trial, kind, (0.5, 0.5, 0.3), sizes, (2.0,) * len(names), 7, f"salt of {trial}")


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    """Three sealed trials: one was analysed, one more was measured."""
    folder = Folder(tmp_path / "trials")
    labels = [label_of(ANALYSED, "plate_tilt"), label_of(MEASURED), label_of(UNTOUCHED)]
    library = (Declared("plate_tilt", 0.0, 6.0, detectable=1.75),)
    Declaration("A study", "bench", "2026-11-23", Plan(), Settings(), library, ()).write(folder.declared)
    truth.write_sealed(
        folder.sealed, [truth.Sealed(label.trial, "alone", (), label.hash) for label in labels]
    )
    truth.write_labels(folder.hidden_labels, labels)
    write_reality(folder.record / REALITY)
    (folder.record / "runs.csv").write_text(
        "what,machine,warp,date,cases,seconds\nheaps,a core,Warp 1,2026-11-23,80,9.5\n"
    )
    folder.data.mkdir()
    for trial in (ANALYSED, MEASURED):
        folder.measured(trial).write_text(f"condition,replicate\n{trial},1\n")
    found = Finding(ANALYSED, EVERYTHING, str(Verdict.NAMED), "plate_tilt", True, 3.3, 3.0, 3.6)
    write_findings(folder.findings, findings_table([found]))
    return folder


def test_only_what_has_been_analysed_is_revealed(folder: Folder, tmp_path: Path) -> None:
    record = tmp_path / "record"
    gather(folder, record)
    assert [label.trial for label in truth.read_labels(record / LABELS)] == [ANALYSED]
    for path in record.iterdir():
        assert all(f"salt of {trial}".encode() not in path.read_bytes() for trial in (MEASURED, UNTOUCHED))
    page = write_trials_page(record).read_text(encoding="utf-8")
    assert "whose heaps LIGGGHTS makes" in page
    assert "1 of 3 trials" in page
    assert "| verdict so far |" in page
    assert (
        "| one mechanism above 1.5 gamma80: the right name | at least 92 % | 100.0 % (1 of 1, 3 to 100 %) |"
        in page
    )
    assert "`sjkr`" in page
    # a bent label is found out
    (record / LABELS).write_text((record / LABELS).read_text().replace("3.5", "3.6"))
    with pytest.raises(InputError, match="must have the hash"):
        read_record(record)


def test_a_label_that_is_not_there_reveals_nothing(folder: Folder, tmp_path: Path) -> None:
    truth.write_labels(folder.hidden_labels, [label_of(MEASURED), label_of(UNTOUCHED)])
    with pytest.raises(InputError, match="the sealed trial has no label"):
        gather(folder, tmp_path / "record")
    assert not (tmp_path / "record").exists()


def test_a_record_keeps_its_heaps_and_no_heap_is_made_without_labels(folder: Folder, tmp_path: Path) -> None:
    record = tmp_path / "record"
    gather(folder, record)
    once = (record / HEAPS).read_bytes()
    gather(folder, record)
    assert (record / HEAPS).read_bytes() == once
    elsewhere = Folder(tmp_path / "elsewhere")
    truth.write_sealed(elsewhere.sealed, truth.read_sealed(folder.sealed))
    assert unpack_heaps(record / HEAPS, elsewhere) == 2
    for trial in (ANALYSED, MEASURED):
        assert elsewhere.measured(trial).read_bytes() == folder.measured(trial).read_bytes()
    assert list(open_jobs(folder, truth.read_sealed(folder.sealed)[:2], [EVERYTHING])) == [
        f"{MEASURED}.{EVERYTHING}"
    ]
    folder.hidden_labels.unlink()
    refused = CliRunner().invoke(app, ["measure", str(folder.root)])
    assert refused.exit_code == 2
    assert "needs the labels of the sealed trials" in refused.output


def test_an_archive_of_anything_else_is_refused(folder: Folder, tmp_path: Path) -> None:
    archive = tmp_path / HEAPS
    archive.write_bytes(b"\xfd7zXZ no archive")
    with pytest.raises(InputError, match="must be an archive"):
        unpack_heaps(archive, folder)
    for name, size in (("../alone-001.csv", 5), (f"{ANALYSED}.csv", 2_000_000)):
        with tarfile.open(archive, "w:xz") as packed:
            entry = tarfile.TarInfo(name)
            entry.size = size
            packed.addfile(entry, io.BytesIO(b"0" * size))
        with pytest.raises(InputError, match="only heaps of sealed trials"):
            unpack_heaps(archive, folder)
    assert folder.measured(ANALYSED).read_text().startswith("condition")

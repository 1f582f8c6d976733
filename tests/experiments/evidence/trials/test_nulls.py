"""Alarms of open trials by the allowance, on the heaps that a record keeps."""

from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from doe.discrepancy import fit_emulator
from experiments.discover.search import Search
from experiments.evidence.trials import nulls
from experiments.evidence.trials.baselines.measured import opened_trials
from experiments.evidence.trials.declaration import read_declaration
from experiments.evidence.trials.desk import job_name, read_data
from experiments.evidence.trials.folder import Folder
from experiments.evidence.trials.generate import STUDY, bank_beside
from experiments.evidence.trials.truth import Kind, read_labels, read_sealed
from experiments.io.errors import InputError
from experiments.studyfile import load_study

EIGHTH = Path(nulls.__file__).parent / "record" / "eighth"


def test_a_strong_effect_is_an_alarm_and_none_is_none_until_the_allowance_covers_it() -> None:
    with opened_trials(EIGHTH) as folder:
        declaration = read_declaration(folder.declared)
        measured = nulls.read_nulls(folder, declaration, scale_known=True)
        labels = read_labels(folder.hidden_labels)
        quiet = {label.trial for label in labels if label.kind is Kind.NULL}
        strongest = max((one for one in labels if one.kind is Kind.SINGLE), key=lambda one: one.multiples)
        search = Search.of(load_study(STUDY, declaration.scale))
        sealed = [one for one in read_sealed(folder.sealed) if one.trial == strongest.trial]
        hidden, _ = read_data(folder, sealed, search.study)
    assert set(measured) == quiet
    assert all(one.calibration for one in measured.values())
    emulator = fit_emulator(search.read_bank(bank_beside(declaration.scale)))
    names = [*sorted(quiet)[:3], strongest.trial]
    heaps = {trial: {**measured, **hidden}[trial] for trial in names}
    alarms = {
        desk.settings.systematic: [
            nulls.raises_alarm(desk, job_name(trial, declaration.plan.view)) for trial in names
        ]
        for desk in nulls.desks(emulator, declaration, heaps, [0.1, 50.0])
    }
    assert alarms == {0.1: [False, False, False, True], 50.0: [False] * 4}


def test_the_table_counts_alarms_and_says_where() -> None:
    alarms = pd.DataFrame({0.1: [True, False, True, False], 0.2: [False] * 4}, index=list("abcd"))
    page = nulls.alarms_page(alarms)
    assert "| 0.1 | 2 of 4 | 50.0 % (6.8 to 93.2) | a, c |" in page
    assert "| 0.2 | 0 of 4 | 0.0 % (0.0 to 60.2) |  |" in page


def test_trials_without_heaps_are_refused() -> None:
    with (
        opened_trials(EIGHTH.with_name("fourteenth")) as folder,
        pytest.raises(InputError, match="needs heaps"),
    ):
        nulls.read_nulls(Folder(folder.root), read_declaration(folder.declared), scale_known=True)


def test_the_command_tells_a_folder_that_is_no_record(tmp_path: Path) -> None:
    words = [str(tmp_path), "--systematic", "0.1"]
    app = nulls.typer.Typer()
    app.command()(nulls.main)
    ended = CliRunner().invoke(app, words)
    assert ended.exit_code == 2
    assert "must be a folder of trials, or a record of them" in ended.output

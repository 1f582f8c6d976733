"""The released benchmark, the command that answers it, and the record of answers."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from experiments.evidence.trials.baselines import benchmark_files, method_tables, record_methods, run_methods
from experiments.evidence.trials.baselines.answers_table import add_answer, file_of, read_answers
from experiments.evidence.trials.baselines.benchmark_files import (
    Benchmark,
    Posed,
    load_answers,
    load_benchmark,
)
from experiments.evidence.trials.baselines.method_list import ALONE
from experiments.evidence.trials.baselines.protocol import Answer
from experiments.evidence.trials.score import auroc
from experiments.evidence.trials.truth import Kind, Label, write_labels
from experiments.io.errors import InputError

RECORDS = Path(benchmark_files.FOLDER).parents[1] / "record"
KEPT = RECORDS / "baselines"


@pytest.fixture(scope="module")
def released() -> Benchmark:
    return load_benchmark()


def test_the_release_is_small_and_every_trial_has_its_answer_apart(released: Benchmark) -> None:
    files = list(benchmark_files.FOLDER.iterdir())
    assert sum(file.stat().st_size for file in files) < 5_000_000
    labels = load_answers()
    assert [trial.name for trial in released.trials] == list(labels)
    for trial in released.trials:
        label, library = labels[trial.name], set(released.banks[trial.bank].space.names)
        hidden = set(label.mechanisms)
        assert hidden <= library
        assert (hidden <= set(trial.withheld)) == (label.kind in (Kind.NULL, Kind.WITHHELD))
        shape = 8, len(trial.measured.observables)
        assert {trial.measured.values[name].shape for name in trial.measured.conditions} == {shape}  # noqa: PD011


def test_files_of_no_benchmark_are_refused(tmp_path: Path, released: Benchmark) -> None:
    with pytest.raises(InputError, match="must be a file"):
        load_benchmark(tmp_path)
    np.savez(tmp_path / "trials.npz", trial=np.array(["a"]))
    with pytest.raises(InputError, match="needs the arrays"):
        load_benchmark(tmp_path)
    stray = Posed("t", 7, (), released.trials[0].measured)
    with pytest.raises(InputError, match="numbers of banks"):
        Benchmark(released.banks, released.rules, released.libraries, (stray,))


def test_the_command_goes_on_where_it_stopped(tmp_path: Path) -> None:
    command = [str(tmp_path), "--methods", "BIC", "--count"]
    app = run_methods.typer.Typer()
    app.command()(run_methods.main)
    for count in ("1", "2"):
        done = CliRunner().invoke(app, [*command, count])
        assert done.exit_code == 0, done.output
    answers = read_answers(file_of(tmp_path, "BIC"))
    assert list(answers["trial"]) == ["trial-001", "trial-002"]
    refused = CliRunner().invoke(app, [str(tmp_path), "--methods", "guessing"])
    assert refused.exit_code == 2
    assert "guessing" in refused.output


def _label(trial: str, kind: Kind, *names: str, multiple: float = 2.0) -> Label:
    return Label(trial, kind, (0.5,), tuple((n, 1.0) for n in names), tuple(multiple for _ in names), 1, "")


LABELS = [
    _label("n", Kind.NULL),
    _label("s", Kind.SINGLE, "a"),
    _label("w", Kind.SINGLE, "a", multiple=0.5),
    _label("p", Kind.PAIR, "a", "b"),
    _label("o", Kind.WITHHELD, "a"),
]
GOOD = {
    "n": Answer(0.1, False),
    "s": Answer(5.0, True, ("a",), outside=0.3),
    "w": Answer(0.2, False),
    "p": Answer(6.0, True, ("a", "b"), outside=0.2),
    "o": Answer(4.0, True, unknown=True, outside=7.0),
}
POOR = {
    "n": Answer(3.0, True, ("a",)),
    "s": Answer(5.0, True, ("a", "b"), tied=True),
    "w": Answer(0.2, False),
    "p": Answer(6.0, True, ("a",)),
    "o": Answer(4.0, True, ("b",)),
}


def _kept(folder: Path) -> None:
    write_labels(folder / "labels.json", LABELS)
    for method, answers in ((ALONE, GOOD), ("BIC", POOR)):
        for trial, answer in answers.items():
            add_answer(file_of(folder, method), trial, answer, 1.0)


def test_answers_are_judged_by_what_is_hidden(tmp_path: Path) -> None:
    _kept(tmp_path)
    table = record_methods.read_record(tmp_path)
    good, poor = (rows.set_index("trial") for _, rows in table.groupby("method", sort=False))
    assert list(good.index[good["right"]]) == ["n", "s", "p", "o"]
    assert not good["wrong"].any()
    assert list(poor.index[poor["right"]]) == []
    assert list(poor.index[poor["wrong"]]) == ["n", "o"]
    assert list(poor.index[poor["tied_right"]]) == ["s"]
    first, second = method_tables.summary(table).to_dict("records")
    assert (first["false alarms"], first["named"], first["not in the library: unknown"]) == (
        "0 of 1", "1 of 1", "1 of 1"
    )  # fmt: skip
    assert (second["false alarms"], second["in a tie"], second["a name for it"]) == (
        "1 of 1",
        "1 of 1",
        "1 of 1",
    )
    assert method_tables.power(table, "alarm").loc[0.5, "trials"] == 1
    [row] = method_tables.comparisons(table, ALONE).to_dict("records")
    assert row["no false alarm"].startswith("1 : 0 of 1")
    assert row["right answer"].startswith("4 : 0 of 4")


def test_what_was_declared_not_resolvable_may_be_named_where_it_is_hidden_and_no_answer_is_due() -> None:
    labels = {name: _label(name, Kind.UNRESOLVED, "a") for name in ("right", "wrong")}
    rows = [
        {"trial": "right", "alarm": True, "named": "a", "tied": False, "unknown": False},
        {"trial": "wrong", "alarm": True, "named": "b", "tied": False, "unknown": False},
    ]
    answers = pd.DataFrame(rows).assign(method="m")
    table = method_tables.judged(answers, labels)
    assert list(table["wrong"]) == [False, True]
    assert not method_tables.due(table).any()
    bound = method_tables.held(answers, ["b"])
    assert list(bound["named"]) == ["", "b"]
    assert list(bound["unknown"]) == [True, False]


def test_areas_and_paired_tests_are_those_of_the_textbook() -> None:
    assert auroc(np.array([3.0, 2.0]), np.array([1.0])) == 1.0
    assert auroc(np.array([1.0]), np.array([1.0])) == 0.5
    assert auroc(np.array([1.0, 4.0]), np.array([2.0, 3.0])) == 0.5
    # Ten trials that differ, one of them for the first: 2 (1 + 10) / 2^10.
    assert method_tables.Paired(1, 9, 50).p == pytest.approx(22.0 / 1024.0)
    assert method_tables.Paired(0, 0, 5).p == 1.0
    one, other = pd.Series({"a": True, "b": True, "c": False}), pd.Series({"b": False, "c": True, "d": True})
    assert method_tables.paired(one, other) == method_tables.Paired(1, 1, 2)

"""The score of the trials counts what it says, and its page shows it."""

import shutil
from pathlib import Path

import pandas as pd
import pytest

from doe.discrepancy import Verdict
from experiments.evidence.trials import score, trials_page
from experiments.evidence.trials.findings import (
    EVERYTHING,
    Finding,
    findings_table,
    read_findings,
    write_findings,
)
from experiments.evidence.trials.record_trials import gather
from experiments.evidence.trials.trials_folder import Folder
from experiments.evidence.trials.trials_page import write_trials_page
from experiments.evidence.trials.truth import Kind, Label, Sealed, write_sealed
from experiments.io.errors import InputError

RECORDS = Path(trials_page.__file__).with_name("record")


def label_of(kind: Kind, *names: str, multiple: float = 2.0) -> Label:
    sizes = tuple((name, 1.0) for name in names)
    return Label("", kind, (0.3, 0.3), sizes, (multiple,) * len(names), seed=1, salt="")


@pytest.mark.parametrize(
    ("label", "verdict", "named", "judgement"),
    [
        (label_of(Kind.NULL), Verdict.NONE, "", ""),
        (label_of(Kind.NULL), Verdict.NAMED, "drag", "wrong"),
        (label_of(Kind.SINGLE, "drag"), Verdict.NAMED, "drag", "right"),
        (label_of(Kind.SINGLE, "drag"), Verdict.NAMED, "twist", "wrong"),
        (label_of(Kind.SINGLE, "drag"), Verdict.NAMED, "drag twist", "wrong"),
        (label_of(Kind.SINGLE, "drag"), Verdict.TIE, "drag twist", "tied"),
        (label_of(Kind.SINGLE, "drag"), Verdict.TIE, "spread twist", ""),
        (label_of(Kind.SINGLE, "drag"), Verdict.UNKNOWN, "", ""),
        (label_of(Kind.PAIR, "drag", "twist"), Verdict.NAMED, "drag twist", "right"),
        (label_of(Kind.PAIR, "drag", "twist"), Verdict.NAMED, "drag", ""),
        (label_of(Kind.PAIR, "drag", "twist"), Verdict.NAMED, "drag spread", "wrong"),
        (label_of(Kind.WITHHELD, "drag"), Verdict.UNKNOWN, "", ""),
        (label_of(Kind.WITHHELD, "drag"), Verdict.NAMED, "twist", "wrong"),
        (label_of(Kind.OUTSIDE, "swollen"), Verdict.NAMED, "drag", "wrong"),
    ],
)
def test_a_verdict_is_judged_by_what_it_names(
    label: Label, verdict: Verdict, named: str, judgement: str
) -> None:
    table = findings_table([Finding("t", EVERYTHING, str(verdict), named)])
    [row] = score.scored(table, {"t": label}, [Sealed("t", "alone", (), "")]).to_dict("records")
    assert [name for name in ("right", "tied", "wrong") if row[name]] == ([judgement] if judgement else [])


def test_shares_have_the_intervals_of_clopper_and_pearson() -> None:
    # 0 of n: 1 - (0.05 / 2)^(1/n).
    assert score.Share(0, 42).interval == pytest.approx((0.0, 1.0 - 0.025 ** (1 / 42)))
    assert score.Share(42, 42).interval == pytest.approx((0.025 ** (1 / 42), 1.0))
    assert str(score.Share(0, 0)) == "no trials"


def ideal_trials() -> tuple[pd.DataFrame, dict[str, Label]]:
    """Return findings of an analysis that is right wherever it can be."""
    labels: dict[str, Label] = {f"null-{i}": label_of(Kind.NULL) for i in range(100)}
    labels |= {
        f"{name}-{i}": label_of(Kind.SINGLE, name, multiple=1.6 + i / 10)
        for name in "abcdefgh"
        for i in range(15)
    }
    labels |= {f"outside-{i}": label_of(Kind.OUTSIDE, "swollen") for i in range(60)}
    labels |= {f"pair-{i}": label_of(Kind.PAIR, "a", "b") for i in range(30)}
    return findings_table(ideal(name, label) for name, label in labels.items()), labels


def ideal(trial: str, label: Label) -> Finding:
    if label.kind is Kind.NULL:
        return Finding(trial, EVERYTHING, "none")
    if label.kind is Kind.OUTSIDE:
        return Finding(trial, EVERYTHING, "unknown", alarm=True)
    name, _, number = trial.rpartition("-")
    missed = (ord(name[0]) + int(number)) % 10 == 0  # a 90 % interval misses one in ten: 12 of these 120
    low, high = (1.1, 1.2) if missed else (0.9, 1.1)
    return Finding(trial, EVERYTHING, "named", " ".join(label.mechanisms), True, 1.0, low, high)


def aims_of(findings: pd.DataFrame, labels: dict[str, Label]) -> tuple[score.Aim, ...]:
    """Hold trials of another code's heaps against the aims; another method names 120."""
    table = score.scored(findings, labels, [Sealed(name, "all", (), "") for name in labels])
    return score.aims(table, table[table["kind"] == Kind.NULL], ("BIC", 120), foreign=True)


def test_an_analysis_that_is_right_passes_every_aim() -> None:
    found = aims_of(*ideal_trials())
    assert [aim.question for aim in found if aim.passed is not True] == []
    assert len(found) == 9


@pytest.mark.parametrize(
    ("of", "verdict", "named", "failed"),
    [
        (
            Kind.NULL,
            "named",
            "a",
            {
                "nothing hidden: alarms",
                "nothing hidden: alarms, with the series sealed together",
                "any trial: a wrong name",
            },
        ),
        (Kind.OUTSIDE, "named", "twist", {"outside the library: unknown", "any trial: a wrong name"}),
        (Kind.SINGLE, "tie", "a b", {"one mechanism above 1.5 gamma80: the right name"}),
        (Kind.PAIR, "named", "a c", {"two mechanisms: both named", "any trial: a wrong name"}),
        (Kind.PAIR, "crash", "", {"two mechanisms: both named", "analyses that crashed"}),
    ],
)
def test_an_analysis_that_is_wrong_fails_the_aims_that_it_misses(
    of: Kind, verdict: str, named: str, failed: set[str]
) -> None:
    findings, labels = ideal_trials()
    hit = findings["trial"].map(lambda name: labels[name].kind is of)
    findings = findings.assign(
        verdict=findings["verdict"].mask(hit, verdict),
        named=findings["named"].mask(hit, named),
        alarm=findings["alarm"] | hit,
    )
    assert {aim.question for aim in aims_of(findings, labels) if aim.passed is False} == failed


def test_a_strong_trial_ends_in_one_way() -> None:
    findings, labels = ideal_trials()
    one = findings["trial"] == "a-3"
    for verdict, named, column in (
        ("named", "b", "wrong"),
        ("tie", "a b", "tied"),
        ("tie", "b c", "tie of others"),
        ("none", "", "unseen"),
        ("crash", "", "crash"),
    ):
        changed = findings.assign(
            verdict=findings["verdict"].mask(one, verdict), named=findings["named"].mask(one, named)
        )
        ends = score.by_mechanism(score.scored(changed, labels, [])).drop(columns="trials")
        assert (ends.sum(axis=1) == 15).all()
        assert ends.loc["a", column] == 1


def test_unknown_has_the_area_of_its_misfits() -> None:
    findings, labels = ideal_trials()
    assert score.unknown_area(score.scored(findings, labels, [])) == ""  # as older records, without a score
    kinds = findings["trial"].map({trial: label.kind for trial, label in labels.items()})
    changed = findings.assign(misfit=kinds.map({Kind.OUTSIDE: 3.0, Kind.SINGLE: 1.0, Kind.PAIR: 2.0}))
    assert score.unknown_area(score.scored(changed, labels, [])).startswith("1.000")
    # half of what the library lacks raised no alarm: it is behind all the others
    changed.loc[kinds == Kind.OUTSIDE, "misfit"] = [3.0, float("nan")] * 30
    assert score.unknown_area(score.scored(changed, labels, [])).startswith("0.500")


def test_findings_without_a_misfit_are_read_as_older_ones(tmp_path: Path) -> None:
    table = findings_table([Finding("alone-001", EVERYTHING, "unknown", alarm=True, misfit=2.5)])
    write_findings(tmp_path / "new.csv", table)
    assert read_findings([tmp_path / "new.csv"]).loc[0, "misfit"] == 2.5
    table.drop(columns="misfit").to_csv(tmp_path / "old.csv", index=False, na_rep="nan")
    old = read_findings([tmp_path / "old.csv"])
    assert list(old) == list(table)
    assert old["misfit"].isna().all()


def test_a_kept_record_scores_as_its_page_says(tmp_path: Path) -> None:
    # all together: a page counts alarms of series that were sealed with it, and names of other methods
    shutil.copytree(RECORDS, tmp_path / "record")
    for series in ("eleventh", "twelfth", "seventeenth", "eighteenth", "nineteenth"):
        page = write_trials_page(tmp_path / "record" / series)
        assert page.read_text(encoding="utf-8") == (RECORDS / series / "README.md").read_text(
            encoding="utf-8"
        )


def test_trials_that_have_not_run_leave_a_record_as_it_is(tmp_path: Path) -> None:
    folder = Folder(tmp_path / "trials")
    write_sealed(folder.sealed, [])
    with pytest.raises(InputError, match="the trials have not run yet"):
        gather(folder, tmp_path / "record")
    assert not (tmp_path / "record").exists()

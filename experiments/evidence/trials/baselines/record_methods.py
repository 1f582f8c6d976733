"""Write the record of the methods: tables and one page, from their answers and the truths.

    python -m experiments.evidence.trials.baselines.record_methods out/baselines --out RECORD
    python -m experiments.evidence.trials.baselines.record_methods out/measured out/trials --out RECORD
    python -m experiments.evidence.trials.baselines.record_methods --out RECORD

The second is for measured trials, a folder of them or their record, with what the search found in them as its
answers. The last writes the page again from the files of the record; it includes records in its folders.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from doe.discrepancy import Verdict
from experiments.commands.console import clear_errors
from experiments.evidence.record_page import markdown_table, write_page
from experiments.evidence.trials.baselines import benchmark_files
from experiments.evidence.trials.baselines.answers_table import FOLDER, add_answer, file_of, read_answers
from experiments.evidence.trials.baselines.measured_problems import open_labels, opened_trials
from experiments.evidence.trials.baselines.method_list import ALONE, SEARCH, methods
from experiments.evidence.trials.baselines.method_tables import (
    areas,
    common,
    comparisons,
    held,
    judged,
    power,
    summary,
)
from experiments.evidence.trials.baselines.methods.search_method import Search
from experiments.evidence.trials.baselines.protocol import Answer, Method
from experiments.evidence.trials.baselines.side_by_side import side_by_side
from experiments.evidence.trials.declaration import read_declaration
from experiments.evidence.trials.findings import read_findings
from experiments.evidence.trials.trials_folder import DECLARED, LABELS, NOTES, PAGE, Folder
from experiments.evidence.trials.truth import Label, read_labels, write_labels
from experiments.io.errors import InputError
from experiments.io.files import copy_file

SERIES = Path(__file__).parents[1] / "record"
"""Records of the trials: labels and declaration of a series are read there where it is kept whole."""

INTRODUCTION = """# Methods of model criticism on the same bank and the same heaps

Every method gets the same bank of runs and the same heaps of all conditions. It answers with a score of its
alarm, an alarm at the level that it declares, names or none, and, if it has one, a score that what is missing
is not in the library. Only the *search* may ask the simulator for fresh runs; *search, bank alone* may not.
Hidden is nothing, one mechanism of the library at several multiples of its detectable size (*one effect*
below: of 1.5 or more), two of these, or what is not in the library: one that was taken out of it, or an
effect that it never had. *Wrong* is a name of what is not hidden. Seconds are of one core; fits of models
count with the method that first asks for them.
"""

AREAS = """## Areas under the curves

Of the alarm: something hidden against nothing hidden; weak effects are those below 1.5 detectable sizes. Of
*unknown*: what the library lacks against strong effects and pairs of it. In brackets 95 % (bootstrap over
trials).
"""

POWERS = """## Power

Share of trials of one mechanism with an alarm, by multiples of its detectable size, and then with its name.
Sizes that differ from trial to trial are classed up to 0.5, 1, 1.5, 2, 3 and beyond; a row has their mean.
"""

PAIRED = """Trials in which only the {0} is right : only the other, with McNemar's exact p value. *No false
alarm*: nothing hidden; *alarm*: something hidden; *right answer*: quiet, the right name, or unknown, whatever
is due (weak effects left out, and what was declared not resolvable).
"""

HELD = """## Held to the names that were declared

The search may name only what was declared resolvable beforehand ({0}).
Here the other methods are held to it, too: an answer with any other name is taken as *unknown*.
"""

OTHER_HEAPS = """## On other heaps

The same methods on other heaps, whose records are linked. *Wrong names* are of all trials; *right answer*:
trials in which only the {0} is right : only the method, with McNemar's exact p value, of those trials where
one answer is due.
"""


def gather(out: Path, record: Path, labels: Sequence[Label]) -> None:
    """Take answers and truths over into a record."""
    files = sorted((out / FOLDER).glob("*.csv"))
    if not files:
        raise InputError(str(out / FOLDER), "needs answers of methods", "none")
    for file in files:
        copy_file(file, record / FOLDER / file.name)
    if not (_series(record) / LABELS).is_file():
        write_labels(record / LABELS, labels)


def gather_search(folder: Folder, record: Path) -> None:
    """Write what the search found in measured trials, in the view of their plan, as answers of a method.

    A record of trials keeps Q of the base, which is the score, and of new ones that of *outside*.
    """
    findings, view = read_findings([folder.findings]), read_declaration(folder.declared).plan.view
    path = file_of(record, SEARCH)
    path.unlink(missing_ok=True)
    for row in findings[findings["view"] == view].itertuples():
        naming = row.verdict in (Verdict.NAMED, Verdict.TIE)
        answer = Answer(
            score=float(row.q / row.degrees_of_freedom),
            alarm=bool(row.alarm),
            named=tuple(row.named.split()) if naming else (),
            tied=row.verdict == Verdict.TIE,
            unknown=row.verdict == Verdict.UNKNOWN,
            outside=float(row.misfit),
        )
        add_answer(path, row.trial, answer, float("nan"))


def read_record(record: Path, allowed: Sequence[str] | None = None) -> pd.DataFrame:
    """Read the answers of a record, judged; only trials that every method has answered.

    With names that are allowed, methods are held to them.
    """
    labels: Mapping[str, Label] = {label.trial: label for label in read_labels(_truths(record))}
    tables = []
    for name in (SEARCH, *methods(None)):
        if (path := file_of(record, name)).is_file():
            tables.append(read_answers(path).assign(method=name))
    if not tables:
        raise InputError(str(record / FOLDER), "needs answers of methods", "none")
    answers = common(pd.concat(tables, ignore_index=True), [table["method"].iloc[0] for table in tables])
    return judged(answers if allowed is None else held(answers, allowed), labels)


def write_methods_page(record: Path) -> Path:
    """Write the page of a record from its files, its notes after the introduction."""
    table = read_record(record)
    notes = record / NOTES
    names = list(dict.fromkeys(table["method"]))
    reference = SEARCH if SEARCH in names else ALONE
    kinds = table.drop_duplicates("trial")["kind"].value_counts()
    counted = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
    alarm, named = (power(table, column).reset_index() for column in ("alarm", "named_right"))
    return write_page(
        record / PAGE,
        INTRODUCTION,
        notes.read_text(encoding="utf-8") if notes.is_file() else "",
        f"## Answers\n\n{table['trial'].nunique()} trials that every method has answered: {counted}.",
        markdown_table(summary(table)),
        markdown_table(_declared(names)),
        AREAS,
        markdown_table(areas(table)),
        POWERS,
        markdown_table(alarm.round(2)),
        markdown_table(named.round(2)),
        f"## The {reference} against each other method\n\n{PAIRED.format(reference)}",
        markdown_table(comparisons(table, reference)),
        *_held(record, reference),
        *_beside(record, table, reference),
    )


def _truths(record: Path) -> Path:
    """Find the labels of a record: in it, in the record of its series, or with the benchmark."""
    for path in (record / LABELS, _series(record) / LABELS):
        if path.is_file():
            return path
    return benchmark_files.FOLDER / benchmark_files.ANSWERS


def _series(record: Path) -> Path:
    """Return the folder that the record of the trials of the same name has."""
    return SERIES / record.name


def _held(record: Path, reference: str) -> list[str]:
    """Tables of methods held to the names of a declaration; empty without a declaration."""
    declared = next((p for p in (record / DECLARED, _series(record) / DECLARED) if p.is_file()), None)
    if declared is None:
        return []
    allowed = [effect.name for effect in read_declaration(declared).library if effect.resolvable]
    table = read_record(record, allowed)
    tables = [markdown_table(each) for each in (summary(table), comparisons(table, reference))]
    return [HELD.format(", ".join(allowed)), *tables]


def _beside(record: Path, table: pd.DataFrame, reference: str) -> list[str]:
    """Compare with the records in folders of a record; empty without any."""
    places = sorted(path.parent for path in record.glob(f"*/{FOLDER}"))
    if not places:
        return []
    links = {f"[{place.name}]({place.name}/{PAGE})": read_record(place) for place in places}
    found = side_by_side({"emulated": table} | links, reference)
    return [OTHER_HEAPS.format(reference), markdown_table(found)]


def _declared(names: list[str]) -> pd.DataFrame:
    known: dict[str, Method] = {SEARCH: Search(SEARCH, None), **methods(None)}
    rows = [
        {"method": name, "level of the alarm": known[name].level, "after": known[name].source}
        for name in names
    ]
    return pd.DataFrame(rows)


def main(
    record: Annotated[Path, typer.Option("--out", help="The record.")],
    out: Annotated[Path | None, typer.Argument(help="Answers; left out: those of the record.")] = None,
    folder: Annotated[
        Path | None, typer.Argument(help="Measured trials, or a record; left out: none.")
    ] = None,
    benchmark: Annotated[Path, typer.Option(help="Folder of the benchmark.")] = benchmark_files.FOLDER,
) -> None:
    """Write the record of the methods."""
    with clear_errors():
        if out is not None:
            if folder is None:
                gather(out, record, list(benchmark_files.load_answers(benchmark).values()))
            else:
                with opened_trials(folder) as trials:
                    gather(out, record, open_labels(trials))
                    gather_search(trials, record)
                    if not (_series(record) / DECLARED).is_file():
                        copy_file(trials.declared, record / DECLARED)
        print(write_methods_page(record))


if __name__ == "__main__":
    typer.run(main)

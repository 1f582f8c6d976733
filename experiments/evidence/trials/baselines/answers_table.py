"""Answers as they are kept: one file a method, one row a trial, added to as trials end."""

import csv
from dataclasses import fields
from pathlib import Path

import pandas as pd

from experiments.evidence.trials.baselines.protocol import Answer

COLUMNS = ("trial", *(field.name for field in fields(Answer)), "seconds")
FOLDER = "answers"
"""Folder of the files of a run."""


def file_of(out: Path, method: str) -> Path:
    """File of a method's answers."""
    return out / FOLDER / f"{method.replace(', ', '-').replace(' ', '-')}.csv"


def answered(path: Path) -> set[str]:
    """Trials that have an answer in a file."""
    return set(read_answers(path)["trial"]) if path.is_file() else set()


def add_answer(path: Path, trial: str, answer: Answer, seconds: float) -> None:
    """Add a row; the file is begun with a head."""
    path.parent.mkdir(parents=True, exist_ok=True)
    row = {
        "trial": trial,
        "score": f"{answer.score:.6g}",
        "alarm": answer.alarm,
        "named": " ".join(answer.named),
        "tied": answer.tied,
        "unknown": answer.unknown,
        "outside": f"{answer.outside:.6g}",
        "seconds": f"{seconds:.2f}",
    }
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        if not file.tell():
            writer.writeheader()
        writer.writerow(row)


def read_answers(path: Path) -> pd.DataFrame:
    """Read the answers of one method."""
    return pd.read_csv(path, dtype={"trial": str, "named": str}, keep_default_na=False, na_values=["nan"])

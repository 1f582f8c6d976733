"""The hidden truths of the trials, and their seals.

A truth is drawn, sealed by a hash that is published before anything is simulated, and kept from the analysis.
Whoever holds the revealed labels can check every seal: the salt makes a seal impossible to guess.
"""

import csv
import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from experiments.io.errors import InputError
from experiments.io.files import write_text

SEALED_WORDS = json.loads(Path(__file__).with_name("sealed_words.json").read_text(encoding="utf-8"))
"""Words of the sealed files by the words of the code: a seal holds every letter of its label."""


class Kind(StrEnum):
    """Kinds of trials, by what is hidden."""

    NULL = "null"
    """Nothing: the base model is the truth."""
    SINGLE = "single"
    """One mechanism of the library that should be resolvable."""
    UNRESOLVED = "unresolved"
    """One of the library that was declared not resolvable, and may not be named."""
    WITHHELD = "withheld"
    """One mechanism that the analysis does not have in its library, nor any of its like."""
    OUTSIDE = SEALED_WORDS["outside"]
    """An effect that the library never has."""
    PAIR = "pair"
    """Two mechanisms of the library."""


@dataclass(frozen=True)
class Label:
    """The truth of one trial; known to nobody before the end."""

    trial: str
    kind: Kind
    theta: tuple[float, ...]
    """True values of the study's factors, natural units."""
    sizes: tuple[tuple[str, float], ...]
    """Mechanisms in the truth, sorted by name, with their sizes in natural units."""
    multiples: tuple[float, ...]
    """Distance of each of these from its null in detectable ones, as they were stated beforehand; 0 where
    there was none."""
    seed: int
    """Root of the seeds of the trial's cases and of its camera."""
    salt: str
    """Random text that makes the seal impossible to guess."""

    @property
    def mechanisms(self) -> tuple[str, ...]:
        """Names of the mechanisms in the truth."""
        return tuple(name for name, _ in self.sizes)

    @property
    def record(self) -> dict[str, Any]:
        """The label as it is sealed and written: seals keep the name that the first had for multiples."""
        return {"strengths" if name == "multiples" else name: v for name, v in asdict(self).items()}

    @property
    def hash(self) -> str:
        """SHA-256 of everything in the label."""
        text = json.dumps(self.record, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()


@dataclass(frozen=True)
class Sealed:
    """Everything that is known of a trial beforehand."""

    trial: str
    part: str
    """Set of trials that it is run with."""
    withheld: tuple[str, ...]
    """Mechanisms that the analysis must do without."""
    hash: str
    """Seal of its label."""


_COLUMNS = ("trial", "part", "withheld", "sha256")


def write_sealed(path: Path, trials: Sequence[Sealed]) -> None:
    """Write what is known beforehand, one row a trial."""
    rows = [",".join((t.trial, t.part, " ".join(t.withheld), t.hash)) for t in trials]
    write_text(path, "\n".join((",".join(_COLUMNS), *rows)) + "\n")


def read_sealed(path: Path) -> tuple[Sealed, ...]:
    """Read what `write_sealed` wrote."""
    with path.open(newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        if tuple(reader.fieldnames or ()) != _COLUMNS:
            raise InputError(str(path), f"needs the columns {', '.join(_COLUMNS)}", reader.fieldnames)
        return tuple(
            Sealed(row["trial"], row["part"], tuple(row["withheld"].split()), row["sha256"]) for row in reader
        )


def write_labels(path: Path, labels: Sequence[Label]) -> None:
    """Write labels as JSON: floats keep every bit, so that their hashes can be checked."""
    write_text(path, json.dumps([label.record for label in labels], indent=1) + "\n")


def read_labels(path: Path) -> tuple[Label, ...]:
    """Read what `write_labels` wrote."""
    return tuple(_label(record) for record in json.loads(path.read_text(encoding="utf-8")))


def read_sealed_json(path: Path) -> Any:
    """Read a declaration or another file of a record, in the words of the code."""
    text = path.read_text(encoding="utf-8")
    return json.loads(text.replace(f'"{SEALED_WORDS["outside"]}s"', '"outside"'))


def opened(sealed: Sequence[Sealed], analysed: Iterable[str]) -> list[Sealed]:
    """Seals of the trials that have been analysed: no other label may be shown."""
    ended = set(analysed)
    return [trial for trial in sealed if trial.trial in ended]


def revealed(labels: Sequence[Label], sealed: Sequence[Sealed]) -> dict[str, Label]:
    """Labels by trial, each held to its seal."""
    by_trial = {label.trial: label for label in labels}
    for trial in sealed:
        if trial.trial not in by_trial:
            raise InputError(trial.trial, "the sealed trial has no label")
        if (found := by_trial[trial.trial].hash) != trial.hash:
            raise InputError(trial.trial, f"a label must have the hash {trial.hash} that sealed it", found)
    return {trial.trial: by_trial[trial.trial] for trial in sealed}


def _label(record: dict[str, Any]) -> Label:
    sizes = tuple((str(name), float(size)) for name, size in record["sizes"])
    return Label(
        trial=record["trial"],
        kind=Kind(record["kind"]),
        theta=tuple(record["theta"]),
        sizes=sizes,
        multiples=tuple(record["strengths"]),
        seed=record["seed"],
        salt=record["salt"],
    )

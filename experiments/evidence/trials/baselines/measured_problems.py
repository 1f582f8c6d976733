"""Measured trials for every method: a folder of them, or a record that keeps its heaps.

for problem in measured_problems(Path("experiments/evidence/trials/record/seventeenth"), bank):
    answer = method(problem)
"""

import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from doe.discrepancy import fit_emulator
from experiments.discover.search import Search
from experiments.evidence.trials.analyses import analysis_name, read_data
from experiments.evidence.trials.baselines.protocol import Problem
from experiments.evidence.trials.declaration import read_declaration
from experiments.evidence.trials.findings import VIEWS, read_findings
from experiments.evidence.trials.generate_trials import STUDY, bank_beside
from experiments.evidence.trials.trial_heaps import unpack_heaps
from experiments.evidence.trials.trials_folder import DECLARED, FINDINGS, HEAPS, LABELS, SEALED, Folder
from experiments.evidence.trials.truth import Label, opened, read_labels, read_sealed, revealed
from experiments.io.errors import InputError
from experiments.io.files import copy_file
from experiments.studyfile import load_study


@contextmanager
def opened_trials(place: Path) -> Iterator[Folder]:
    """Open a folder of trials, or a record: a folder with its files, for the time being.

    A record lies flat, and its heaps, where it keeps them, are packed.
    """
    if not (place / SEALED).is_file():
        if not Folder(place).sealed.is_file():
            raise InputError(
                str(place), "must be a folder of trials, or a record of them", "no sealed trials"
            )
        yield Folder(place)
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Folder(Path(name))
        for source, target in (
            (place / DECLARED, folder.declared),
            (place / SEALED, folder.sealed),
            (place / FINDINGS, folder.findings),
            (place / LABELS, folder.hidden_labels),
        ):
            copy_file(source, target)
        if (place / HEAPS).is_file():
            unpack_heaps(place / HEAPS, folder)
        yield folder


def measured_problems(place: Path, bank: Path | None = None, count: int | None = None) -> Iterator[Problem]:
    """Pose the first trials that have heaps, as the search has them in the view of their plan.

    The seed is the search's. Left out, the bank is that of the scale.
    """
    with opened_trials(place) as folder:
        declaration = read_declaration(folder.declared)
        view = declaration.plan.view
        study = load_study(STUDY, declaration.scale or None)
        sealed = [one for one in read_sealed(folder.sealed) if folder.measured(one.trial).exists()][:count]
        if not sealed:
            raise InputError(str(place), "needs measured heaps of sealed trials", "none")
        emulator = fit_emulator(Search.of(study).read_bank(bank or bank_beside(declaration.scale)))
        measured, _ = read_data(folder, sealed, study)
        for trial in sealed:
            if trial.trial in measured:
                job, known = analysis_name(trial.trial, view), emulator.without(*trial.withheld)
                heaps = measured[trial.trial].only(VIEWS[view])
                yield Problem(trial.trial, known, heaps, declaration.settings, zlib.crc32(job.encode()))


def open_labels(folder: Folder) -> list[Label]:
    """Labels of the trials that the search has analysed: no other may be shown."""
    for file in (folder.findings, folder.hidden_labels):
        if not file.is_file():
            raise InputError(str(file), "needs findings of the search, and the truths", "no such file")
    findings = read_findings([folder.findings])
    analysed = findings.loc[findings["view"] == read_declaration(folder.declared).plan.view, "trial"]
    labels = read_labels(folder.hidden_labels)
    return list(revealed(labels, opened(read_sealed(folder.sealed), analysed)).values())

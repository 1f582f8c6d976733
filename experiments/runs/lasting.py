"""Files of a run's folder that last over its runs: those of a search, as far as they serve the next study."""

from __future__ import annotations

from pathlib import Path

from doe.errors import RuleError
from experiments.cases.store.outputs import is_listed
from experiments.io.errors import InputError
from experiments.studyfile import Study

OUTCOMES, BANK = "outcomes.sqlite", "bank.npz"
"""Files of a search's folder beside its outputs: what was simulated, the library waves."""


def lasting_files(folder: Path, study: Study) -> dict[str, bool]:
    """Name the bank that runs made in a folder, and tell whether it serves a study; empty without one.

    A bank of another study may be removed: nothing that was simulated is lost, since it was made of the table
    of outcomes, which stays. Its rows are found by keys that hold all that determines them, as the stored
    cases are, so that it serves any study, and a search of the other one makes the bank of it again. A bank
    that neither lies beside such a table nor is listed was brought by a person, and is left alone.
    """
    path = folder / BANK
    if not path.is_file() or not ((folder / OUTCOMES).is_file() or is_listed(folder, BANK)):
        return {}
    # few folders hold one, and what reads it takes a second to load
    from experiments.discover.search import Search

    try:
        Search.of(study).read_bank(path)
    except (InputError, RuleError):
        return {BANK: False}
    return {BANK: True}

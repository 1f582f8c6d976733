"""A search for what a model lacks, in a folder: the bank, the analysis of measured heaps, the report."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from dem_warp.version import source_commit
from doe.discrepancy import Bank, Discovery, Fit, Measured, Outcomes, Point, drive
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.cases.store.outputs import sha256_of
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.maker import fingerprint_of, maker_of_today
from experiments.discover.search import Search
from experiments.io.errors import InputError
from experiments.io.files import replacing
from experiments.measurement.measured_file import read_measured
from experiments.report import HeapPicture, SolidHeap
from experiments.report.discovery import Terms, results_of, verdict_line, write_discovery
from experiments.report.discovery.compared_heaps import photograph, simulated_heaps, turned
from experiments.report.study_companion import companion_of
from experiments.runs.choices import Prepared
from experiments.runs.run_folder import BANK, OUTCOMES, Run, open_run
from experiments.studyfile import Study
from experiments.studyfile.mechanism_factor import MechanismFactor
from experiments.studyfile.observables import Instrument

SETTINGS = "settings.json"
"""File of the rules of a search, next to its report."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class SearchData:
    """Data and bank of a search."""

    measured: Path | None = None
    """File of measured heaps; None: only the bank is made."""
    bank: Path | None = None
    """Bank made earlier for the study; None: that of the folder, that next to the study, or a new one."""
    photographs_only: bool = False
    """Look only at what photographs show."""
    seed: int = 1
    """Seed of the bootstraps and of the fresh runs."""


@dataclass(frozen=True)
class SearchResult:
    """A search that has ended."""

    discovery: Discovery | None
    """Verdict and fits; None where only the bank was made."""
    terms: Terms
    page: Path
    """The report, or the bank."""

    def __str__(self) -> str:
        return f"{self.verdict or 'The bank is made.'} {self.page}"

    @property
    def verdict(self) -> str:
        """The verdict in one line; empty where only the bank was made."""
        return verdict_line(self.discovery, self.terms) if self.discovery else ""

    def to_dict(self) -> dict[str, Any]:
        """Everything that was found as JSON-able data."""
        return results_of(self.discovery, self.terms) if self.discovery else {}


class _ShownSimulator:
    """The engine of an open run: each of its batches is shown, and noted with its wall time."""

    def __init__(self, run: Run, engine: EngineSimulator, library: Sequence[MechanismFactor]) -> None:
        self.observables = engine.observables
        self.title = "bank"
        self._run, self._engine, self._library = run, engine, library

    def __call__(self, points: Sequence[Point]) -> Outcomes:
        """Return the observables of every point; raise `AwaitingRuns` where a person simulates them."""
        if self._run.is_by_hand:
            # few searches are; what reads their sheets takes a second to load
            from experiments.runs.by_hand import typed_points

            given = (self._run.study, self._library, self.observables, self._run.folder, self.title)
            return self._engine(points, person=partial(typed_points, *given))
        with self._run.batch(self.title, lambda: len(self._engine.table)) as progress:
            return self._engine(points, progress)


def run_search(prepared: Prepared, given: SearchData) -> SearchResult:
    """Look for what a study lacks, and write the report.

    Raise InputError when the study cannot be searched, the data or the bank break a rule, or the folder
    cannot be used; nothing is written then.
    """
    study = prepared.study
    companion, search = companion_of(study), Search.of(study)
    terms = Terms.of(search.library, study.measurable, study.factor_sections)
    bank, measured = known_bank(search, prepared.folder, given.bank), read_data(study, given)
    with (
        open_run("discover", prepared, "bank" if measured is None else "discover") as run,
        EngineSimulator(study, search.library, OutcomeTable(run.folder / OUTCOMES), run.workers) as engine,
    ):
        simulator = _ShownSimulator(run, engine, search.library)
        if bank is None:
            bank = search.make_bank(simulator, maker_of_today(source_commit(), engine.engine))
            with replacing(run.folder / BANK) as temporary:
                bank.save(temporary)
        made_from = {
            "data": sha256_of(given.measured) if given.measured else None,
            "photographs_only": given.photographs_only,
            "seed": given.seed,
        }
        if measured is None or given.measured is None:
            with run.publishing(**made_from) as drafts:
                search.settings.write(drafts / SETTINGS)
            return SearchResult(None, terms, run.folder / BANK)
        simulator.title = "fresh runs"
        found = drive(search.analysis(measured, bank, given.seed), simulator)
        provenance = _provenance(run, given, bank)
        pictures, solid = (
            ([], None) if run.is_by_hand else heaps_side_by_side(engine, found, terms, measured, given.seed)
        )
        further = companion.discovery_chapters(found, terms, given.measured)
        with run.publishing(**made_from) as drafts:
            search.settings.write(drafts / SETTINGS)
            page = write_discovery(
                found, study, terms, search.settings, drafts, pictures, provenance, further, solid
            )
        return SearchResult(found, terms, run.folder / page.relative_to(drafts))


def heaps_side_by_side(
    engine: EngineSimulator, found: Discovery, terms: Terms, measured: Measured, seed: int
) -> tuple[list[HeapPicture], SolidHeap | None]:
    """Draw a measured heap, if there is a photograph, that of the base, and that with the mechanism.

    The last of them can be turned, too; None for a test without a heap.
    """
    study = engine.study
    if found.base is None or not study.scene.leaves_a_heap:
        return [], None
    fitted = [condition.name for condition in study.conditions if not condition.held_out]
    training = [name for name in measured.conditions if name in fitted]
    condition = next((name for name in training if measured.pictures.get(name)), training[0])
    models = {"Calibrated base": found.base}
    if found.chosen is not None:
        models[f"With {terms.titles(found.chosen.mechanisms)}"] = found.chosen
    results = engine.heaps([_point(fit, condition, seed) for fit in models.values()])
    # simulated mechanisms have the azimuth 0: the heaps are shown as the camera sees them
    side = measured.views.get(condition, 0.0)
    results = [
        turned(result, 0.0 if fit.heading is None else fit.heading - side)
        for fit, result in zip(models.values(), results, strict=True)
    ]
    photographs = measured.pictures.get(condition, ())[:1]
    taken = [photograph(path, condition, study.measurement.fit) for path in photographs]
    drawn = simulated_heaps(dict(zip(models, results, strict=True)), condition, study.under(condition))
    shown = [picture for picture in taken if picture is not None] + drawn
    title = list(models)[-1]
    return shown, SolidHeap.of(f"{title}: a heap under the condition “{condition}”.", results[-1])


def known_bank(search: Search, folder: Path, named: Path | None = None) -> Bank | None:
    """Read the bank that is named, that of the folder, or that next to the study; None: it is to be made.

    Raise InputError when it is not a bank, or that of another study.
    """
    if named is not None:
        return search.read_bank(named)
    study = search.study
    shipped = study.file.with_name(f"bank-{study.scale}.npz" if study.scale else BANK)
    return next((search.read_bank(path) for path in (folder / BANK, shipped) if path.is_file()), None)


def read_data(study: Study, given: SearchData) -> Measured | None:
    """Read the measured heaps, as far as they are looked at; None where only the bank is wanted.

    Raise InputError when the file cannot be read or breaks a rule.
    """
    if given.measured is None:
        return None
    measured = read_measured(given.measured, study)
    for note in measured.notes:
        _log.warning("The data: %s", note)
    if not given.photographs_only:
        return measured
    shown = [each.name for each in study.measurable if each.instrument is Instrument.PHOTOGRAPH]
    if not set(shown) & set(measured.observables):
        problem = f"--photographs-only needs an observable that photographs show: {', '.join(shown)}"
        raise InputError(str(given.measured), problem, ", ".join(measured.observables))
    return measured.only(shown)


def _point(fit: Fit, condition: str, seed: int) -> Point:
    sizes = zip(fit.mechanisms, (size.value for size in fit.sizes), strict=True)
    return Point(fit.theta, tuple(sorted(sizes)), condition, seed)


def _provenance(run: Run, given: SearchData, bank: Bank) -> dict[str, Any]:
    return {
        **run.provenance,
        "engine": fingerprint_of(run.store.engine),
        "bank": dict(bank.maker) or None,
        "photographs only": given.photographs_only,
        "data": given.measured.name if given.measured else None,
        "batches": run.wall_times,
    }

"""A search for what a model lacks, in a folder: the bank, the analysis of measured heaps, its page."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dem_warp import Progress
from dem_warp.version import source_commit
from doe.discrepancy import Bank, Discovery, Fit, Measured, Outcomes, Point, drive
from experiments.cases import Workers, engine_of, open_folder, require_unused
from experiments.cases.store.folder import locked
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.cases.store.outputs import publishing, sha256_of
from experiments.cases.workers.own import THIS_MACHINE, watched_by
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.maker import fingerprint_of, maker_of_today
from experiments.discover.search import Search
from experiments.io.errors import InputError
from experiments.io.files import replacing
from experiments.journal.journal import Journal
from experiments.measurement.measured_file import read_measured
from experiments.report import HeapPicture, SolidHeap
from experiments.report.discovery import Terms, write_discovery
from experiments.report.discovery.compared_heaps import photograph, simulated_heaps, turned
from experiments.report.study_companion import Companion, companion_of
from experiments.runs.campaign import Watch, watching
from experiments.runs.lasting import BANK, OUTCOMES, lasting_files
from experiments.studyfile import Study
from experiments.studyfile.observables import Instrument

SETTINGS = "settings.json"
"""File of the rules of a search, beside its report."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Job:
    """Order of a command; its parts are parameters of `experiments.api.discover`."""

    study: Study
    measured: Path | None
    folder: Path
    bank: Path | None = None
    photographs_only: bool = False
    workers: Workers = THIS_MACHINE
    seed: int = 1


@dataclass(frozen=True)
class SearchResult:
    """End of a search."""

    discovery: Discovery | None
    """None where only the bank was made."""
    terms: Terms
    page: Path
    """The report, or the bank."""


class _Watched:
    """The engine, with a display for every wave."""

    def __init__(self, search: Search, job: Job, watch: Watch, journal: Journal) -> None:
        table, workers = OutcomeTable(job.folder / OUTCOMES), watched_by(job.workers, journal.glimpses)
        self.engine = EngineSimulator(search.study, search.library, table, workers, self._report)
        self.observables = self.engine.observables
        self.title = "library waves"
        self.waves: list[dict[str, Any]] = []
        self._watch, self._journal = watch, journal
        self._listener: Callable[[Progress], None] | None = None

    def __call__(self, points: Sequence[Point]) -> Outcomes:
        """Observables of every point."""
        started, before = time.perf_counter(), len(self.engine.table)
        with watching(self.title, self._watch, self._journal) as self._listener:
            outcomes = self.engine(points)
        seconds, simulated = time.perf_counter() - started, len(self.engine.table) - before
        self.waves.append({"wave": self.title, "simulated": simulated, "seconds": round(seconds, 1)})
        return outcomes

    def _report(self, progress: Progress) -> None:
        if self._listener is not None:
            self._listener(progress)


def run_search(job: Job, resume: bool = False, watch: Watch = lambda title: nullcontext()) -> SearchResult:
    """Look for what a study lacks, and write the report.

    Nothing is written before study, data and bank have been read without an error.

    Raises
    ------
    InputError
        When the study cannot be searched, the data or the bank break a rule, or the folder is in use.
    """
    if not resume:
        require_unused(job.folder, "; --resume goes on in it")
    companion, search = companion_of(job.study), Search.of(job.study)
    terms = Terms.of(search.library, job.study.measurable, job.study.factor_sections)
    bank = known_bank(job)
    measured = read_data(job)
    device = str(job.workers.described.get("device", ""))
    with (
        locked(job.folder, resume),
        Journal(job.folder, "discover", job.study, resume, device=device) as journal,
    ):
        for change in open_folder(job.folder, job.study, resume)[1]:
            _log.warning("The study has changed since the earlier run: %s", change)
        return _search(job, search, companion, terms, bank, measured, watch, journal)


def _search(
    job: Job,
    search: Search,
    companion: Companion,
    terms: Terms,
    bank: Bank | None,
    measured: Measured | None,
    watch: Watch,
    journal: Journal,
) -> SearchResult:
    """Simulate and analyse in an open folder, and make the outputs."""
    simulator = _Watched(search, job, watch, journal)
    with simulator.engine:
        if bank is None:
            maker = maker_of_today(source_commit(), simulator.engine.engine)
            bank = search.make_bank(simulator, maker)
            with replacing(job.folder / BANK) as temporary:
                bank.save(temporary)
        if measured is None:
            with _publishing(job) as drafts:
                search.settings.write(drafts / SETTINGS)
            return SearchResult(None, terms, job.folder / BANK)
        simulator.title, started = "fresh runs", time.perf_counter()
        found = drive(search.analysis(measured, bank, job.seed), simulator)
        waves = [*simulator.waves, {"wave": "analysis, its waves included", "seconds": _since(started)}]
        pictures, solid = heaps_side_by_side(simulator.engine, found, terms, measured, job)
    further = companion.discovery_chapters(found, terms, job.measured) if job.measured else ()
    made = _provenance(job, bank, waves)
    with _publishing(job) as drafts:
        search.settings.write(drafts / SETTINGS)
        page = write_discovery(
            found, job.study, terms, search.settings, drafts, pictures, made, further, solid
        )
    return SearchResult(found, terms, job.folder / page.relative_to(drafts))


def _publishing(job: Job) -> AbstractContextManager[Path]:
    data = sha256_of(job.measured) if job.measured else None
    made_from = {"data": data, "photographs_only": job.photographs_only, "seed": job.seed}
    return publishing(job.folder, job.study, lasting_files(job.folder, job.study), **made_from)


def heaps_side_by_side(
    engine: EngineSimulator, found: Discovery, terms: Terms, measured: Measured, job: Job
) -> tuple[list[HeapPicture], SolidHeap | None]:
    """Draw a measured heap, where there is a photograph, that of the base, and that with the mechanism.

    The last of them comes to be turned, too; None where it is no heap.
    """
    if found.base is None or not job.study.scene.leaves_a_heap:
        return [], None
    fitted = [condition.name for condition in job.study.conditions if not condition.held_out]
    training = [name for name in measured.conditions if name in fitted]
    condition = next((name for name in training if measured.pictures.get(name)), training[0])
    models = {"Calibrated base": found.base}
    if found.chosen is not None:
        models[f"With {terms.titles(found.chosen.mechanisms)}"] = found.chosen
    results = engine.heaps([_point(fit, condition, job.seed) for fit in models.values()])
    # simulated mechanisms have the azimuth 0: the heaps are shown as the camera sees them
    side = measured.views.get(condition, 0.0)
    results = [
        turned(result, 0.0 if fit.heading is None else fit.heading - side)
        for fit, result in zip(models.values(), results, strict=True)
    ]
    photographs = measured.pictures.get(condition, ())[:1]
    taken = [photograph(path, condition, job.study.measurement.fit) for path in photographs]
    drawn = simulated_heaps(dict(zip(models, results, strict=True)), condition, job.study.under(condition))
    shown = [picture for picture in taken if picture is not None] + drawn
    title = list(models)[-1]
    return shown, SolidHeap.of(f"{title}: a heap under the condition “{condition}”.", results[-1])


def known_bank(job: Job) -> Bank | None:
    """Read the bank that is named, that of the folder, or that beside the study; None: it is to be made.

    Raises
    ------
    InputError
        When it is no bank, or that of another study.
    """
    search = Search.of(job.study)
    beside = job.study.file.with_name(f"bank-{job.study.scale}.npz" if job.study.scale else BANK)
    if job.bank is not None:
        return search.read_bank(job.bank)
    return next((search.read_bank(path) for path in (job.folder / BANK, beside) if path.is_file()), None)


def read_data(job: Job) -> Measured | None:
    """Read what was measured, as far as it is looked at, and say what is to be known about it.

    None where only the library waves are wanted.

    Raises
    ------
    InputError
        When the file cannot be read or breaks a rule.
    """
    if job.measured is None:
        return None
    measured = read_measured(job.measured, job.study)
    for note in measured.notes:
        _log.warning("The data: %s", note)
    if not job.photographs_only:
        return measured
    shown = [each.name for each in job.study.measurable if each.instrument is Instrument.PHOTOGRAPH]
    if not set(shown) & set(measured.observables):
        rule = f"a search on photographs only needs what they show: one of {', '.join(shown)}"
        raise InputError(str(job.measured), rule, ", ".join(measured.observables))
    return measured.only(shown)


def _point(fit: Fit, condition: str, seed: int) -> Point:
    sizes = zip(fit.mechanisms, (size.value for size in fit.sizes), strict=True)
    return Point(fit.theta, tuple(sorted(sizes)), condition, seed)


def _provenance(job: Job, bank: Bank, waves: Sequence[dict[str, Any]]) -> dict[str, Any]:
    return {
        **job.workers.described,
        "commit": source_commit(),
        "engine": fingerprint_of(engine_of(job.study)),
        "bank": dict(bank.maker) or None,
        "photographs only": job.photographs_only,
        "data": job.measured.name if job.measured else None,
        "waves": list(waves),
    }


def _since(started: float) -> float:
    return round(time.perf_counter() - started, 1)

"""The generator of the trials, apart from the analysis: it draws and seals truths, and simulates their heaps.

    python -m experiments.evidence.trials.generate_trials bank out/trials/bank.npz --device cuda
    python -m experiments.evidence.trials.generate_trials seal out/trials --bank out/trials/bank.npz
    python -m experiments.evidence.trials.generate_trials measure out/trials --part alone --device cuda

The first makes a bank that knows outlines. The second writes what is known beforehand (``declared.json``,
``sealed.csv``) into FOLDER/record, to be published before the third runs, and the labels into FOLDER/hidden,
where no analysis looks. The third writes the file of measured heaps of every trial into FOLDER/data.
"""

import secrets
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from dem_warp.version import source_commit
from doe.discrepancy import Bank, Simulator, fit_emulator
from experiments.cases import Resources, open_workers
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.commands.console import clear_errors
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.maker import maker_of_today
from experiments.discover.mechanism_files import library_for
from experiments.discover.search import Search
from experiments.evidence.trials.analyses import run_together
from experiments.evidence.trials.declaration import (
    Declaration,
    declared_effects,
    read_declaration,
    with_names,
)
from experiments.evidence.trials.findings import VIEWS
from experiments.evidence.trials.other_codes.code_effects import DECLARED, OutsideSimulator
from experiments.evidence.trials.trial_camera import stated_scales
from experiments.evidence.trials.trial_heaps import cases_of, write_heaps
from experiments.evidence.trials.trials_folder import Folder, noted_run
from experiments.evidence.trials.truth import (
    Label,
    read_labels,
    read_sealed,
    revealed,
    write_labels,
    write_sealed,
)
from experiments.evidence.trials.truths import Declared, Plan, draw
from experiments.io.errors import InputError
from experiments.io.files import replacing
from experiments.io.toml_files import read_toml
from experiments.studyfile import Study, load_study

STUDY = Path(__file__).parents[2] / "studies" / "trial" / "study.toml"
"""The study that the trials are about."""

STEP_SHARE = 0.8
"""The generator's time step is this part of the study's."""

PIXEL_SHARE = 1.3
"""Its pictures have this many times the pixels of the study's."""

app = typer.Typer(help="Draw, seal and simulate blind trials.")


def bank_beside(scale: str) -> Path:
    """Find the bank that is kept for a scale of the trial study."""
    path = STUDY.with_name(f"bank-{scale}.npz" if scale else "bank.npz")
    if not path.is_file():
        hint = f"Make it with `python -m {__name__} bank`, and pass it by --bank."
        raise InputError(str(path), "no such bank is kept", hint=hint)
    return path


def generators_study(scale: str) -> Study:
    """Return the trial study with the generator's own time step and camera."""
    study = load_study(STUDY, scale or None)
    changes: dict[str, Any] = {
        "numerics": {"time_step_fraction": STEP_SHARE * study.numerics.time_step_fraction},
        "measurement": {"pixels": round(PIXEL_SHARE * study.measurement.pixels)},
    }
    return load_study(STUDY, scale or None, changes)


def seal_trials(
    folder: Folder, search: Search, bank: Bank, plan: Plan, seed: int, outside: Sequence[Declared]
) -> None:
    """Declare what the trials should show, draw the truths, and write seals and labels.

    The seed of the drawing must not be known to whoever knows the plan; `outside` is never in the library.
    """
    if folder.sealed.exists():
        raise InputError(str(folder.sealed), "the folder has sealed trials", hint="Choose another folder.")
    study = search.study
    seen = VIEWS[plan.view]
    emulator, known = fit_emulator(bank), stated_scales(seen)
    library = declared_effects(emulator, search.settings, plan.replicates, seen, known)
    today, settings = time.strftime("%Y-%m-%d"), with_names(search.settings, library)
    scale, foreign = study.scale or "", tuple(outside)
    declaration = Declaration(study.name, scale, today, plan, settings, library, foreign)
    rng = np.random.default_rng(seed)
    trials = draw(plan, study.factors, library, foreign, rng, lambda: rng.bytes(16).hex())
    declaration.write(folder.declared)
    write_sealed(folder.sealed, [sealed for _, sealed in trials])
    write_labels(folder.hidden_labels, [label for label, _ in trials])


def measure_trials(
    folder: Folder, labels: list[Label], declaration: Declaration, simulator: Simulator
) -> None:
    """Simulate all heaps of some trials in one call, and write each trial's file.

    The simulator knows the library and what is outside it.
    """
    conditions = [condition.name for condition in load_study(STUDY, declaration.scale or None).conditions]
    waves = [cases_of(label, conditions, declaration.plan.replicates) for label in labels]
    for label, wave, outcomes in zip(labels, waves, run_together(waves, simulator), strict=True):
        write_heaps(folder.measured(label.trial), label, wave, outcomes, simulator.observables)


@app.command(name="bank")
def make(
    file: Annotated[Path, typer.Argument(help="File of the bank; its cases are kept next to it.")],
    scale: Annotated[str, typer.Option(help="Scale of the trial study; left out: as written.")] = "",
    points: Annotated[int | None, typer.Option(help="Of the base; left out: as the study says.")] = None,
    mechanism_points: Annotated[int | None, typer.Option(help="Of each effect; left out: so, too.")] = None,
    device: Annotated[str | None, typer.Option(help="cpu, cuda, or several GPUs, as cuda:0,cuda:1.")] = None,
    workers: Annotated[int | None, typer.Option(help="Processes.")] = None,
) -> None:
    """Make a bank of all that the trial study sees, outlines included."""
    with clear_errors("Resume with the same command."):
        search = Search.of(load_study(STUDY, scale or None))
        numbers = search.settings
        if points is not None:
            numbers = replace(numbers, bank_points=points)
        if mechanism_points is not None:
            numbers = replace(numbers, bank_mechanism_points=mechanism_points)
        search = replace(search, settings=numbers)
        table = OutcomeTable(file.with_suffix(".sqlite"))
        with (
            open_workers(Resources(device, workers)) as simulators,
            EngineSimulator(search.study, search.library, table, simulators) as simulator,
        ):
            made = search.make_bank(simulator, maker_of_today(source_commit()))
        with replacing(file) as temporary:
            made.save(temporary)
        print(f"{len(made.reasons)} cases, {int((~made.finished).sum())} of them failed: {file}")


@app.command()
def seal(
    folder: Annotated[Path, typer.Argument(help="Folder of the trials.")],
    bank: Annotated[Path | None, typer.Option(help="Bank of the trial study; left out: its own.")] = None,
    scale: Annotated[str, typer.Option(help="Scale of the trial study; left out: as written.")] = "",
    plan: Annotated[Path | None, typer.Option(help="TOML file with numbers of trials.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the drawing; left out: a secret one.")] = None,
) -> None:
    """Draw the truths; write their seals, to be published, and their labels, to be kept."""
    with clear_errors():
        numbers = Plan(**read_toml(plan)[1]) if plan else Plan()
        place, search = Folder(folder), Search.of(load_study(STUDY, scale or None))
        waves = search.read_bank(bank or bank_beside(scale))
        seal_trials(place, search, waves, numbers, secrets.randbits(63) if seed is None else seed, DECLARED)
        print(f"{len(read_sealed(place.sealed))} trials sealed: {place.sealed}")


@app.command()
def measure(
    folder: Annotated[Path, typer.Argument(help="Folder of the trials.")],
    part: Annotated[str | None, typer.Option(help="Trials of one part; left out: all.")] = None,
    device: Annotated[str | None, typer.Option(help="cpu, cuda, or several GPUs, as cuda:0,cuda:1.")] = None,
    workers: Annotated[int | None, typer.Option(help="Processes.")] = None,
) -> None:
    """Simulate and measure the heaps of the trials."""
    with clear_errors("Resume with the same command."):
        place = Folder(folder)
        declaration = read_declaration(place.declared)
        sealed = [trial for trial in read_sealed(place.sealed) if part in (None, trial.part)]
        labels = list(revealed(read_labels(place.hidden_labels), sealed).values())
        study = generators_study(declaration.scale)
        table = OutcomeTable(place.hidden / "outcomes.sqlite")
        with (
            open_workers(Resources(device, workers)) as simulators,
            OutsideSimulator(study, library_for(study), table, simulators) as simulator,
            noted_run(place, f"heaps, {part or 'all'}", device, table),
        ):
            measure_trials(place, labels, declaration, simulator)
        print(f"{len(labels)} trials measured: {place.data}")


if __name__ == "__main__":
    app()

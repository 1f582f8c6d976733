"""Bench campaigns in the laws of LIGGGHTS, proven there: the exported input is run at the optimum.

    python -m experiments.evidence.accuracy.bridge.laws_of_liggghts --out DIR [--study FILE --scale bench]

Each study is calibrated by dem-warp in the laws of LIGGGHTS, with some changes; the card's own test is then
run in LIGGGHTS with fresh seeds. The angle is to be within a degree of the target, plus the noise of both.
"""

from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import typer

from doe import compare_means
from experiments import api
from experiments.bridge.source import read_source
from experiments.cases import OwnWorkers, open_folder, run_cases, with_engine
from experiments.commands.console import CaseProgress, clear_errors
from experiments.studyfile import Study, load_study

HERE = Path(__file__).parent

MARGIN = 1.0
"""Difference between the codes that does not matter [deg]."""

CHANGES: dict[str, Any] = {
    # columns of spheres tremble at 1 to 2 mm/s in these laws, and would never rest at 1 mm/s (docs/laws.md)
    "scene": {"lifted-cylinder": {"rest_speed": "3 mm/s"}},
    # heaps as small as these scatter by one or two degrees, as much as the friction moves them from step to
    # step: a point of the path is known to about .6 degrees from four, its noise from nine and those four
    "campaign": {
        "noise_floor": {"replicates": 9},
        "climb": {"replicates": 4},
        "surface": {"half_range_least": 0.8, "replicates": 4},
        "verification": {"replicates": 9},
    },
}
"""Changes to every study."""

COLUMNS = ("study", "target", "mean", "sd", "n", "difference", "low", "high", "met", "equivalent")


def in_laws(file: Path, scale: str | None, laws: str) -> Study:
    """Load a study in other laws, with the changes that they ask for."""
    return load_study(file, scale, CHANGES | {"solver": {"laws": laws}})


def prove(study: Study, folder: Path, laws: str, seeds: int, workers: int | None) -> dict[str, object]:
    """Calibrate a study, and run its card's test in LIGGGHTS; what is finished in the folder is kept."""
    named = f"{study.name}, laws {laws}"
    card = folder / "campaign" / "material.toml"
    if not card.is_file():
        resume = card.parent.is_dir()
        made = api.calibrate(
            study, card.parent, device="cpu", workers=workers, resume=resume, watch=CaseProgress
        ).campaign
        if made is None or made.optimum is None:
            return {"study": named, "met": False, "why": made and made.reason}
    source = read_source(card)
    there = with_engine(source.study, "liggghts")
    heaps = folder / "liggghts"
    store, _ = open_folder(heaps, there, resume=heaps.is_dir())
    table = pd.DataFrame([source.point] * seeds).assign(seed=range(1001, 1001 + seeds))
    with CaseProgress("LIGGGHTS") as progress:
        cases = run_cases(there, table, store, OwnWorkers(workers=workers), progress)
    good = cases[cases["status"] == "finished"].dropna(subset=[source.observable])
    test = compare_means(good[source.observable].to_numpy(), source.target, margin=MARGIN)
    low, high = test.interval
    met = low <= MARGIN and high >= -MARGIN
    numbers = (source.target.mean, test.a.mean, test.a.sd, test.a.n, test.difference, low, high)
    return dict(zip(COLUMNS, (named, *numbers, met, test.equivalent), strict=True))


def main(
    out: Annotated[Path, typer.Option(help="Folder of campaigns and heaps; it may have some of them.")],
    studies: Annotated[list[Path] | None, typer.Option("--study", help="Left out: those here.")] = None,
    scale: Annotated[str | None, typer.Option(help="Scale of the studies.")] = None,
    laws: Annotated[str, typer.Option(help="Name of a set of LIGGGHTS' laws.")] = "liggghts",
    seeds: Annotated[int, typer.Option(min=2, help="Heaps in LIGGGHTS.")] = 5,
    workers: Annotated[int | None, typer.Option(min=1, help="Cases at once. Left out: one a core.")] = None,
) -> None:
    """Prove every study, and write ``end_to_end.csv``."""
    rows = []
    for file in studies or sorted(HERE.glob("*.toml")):
        with clear_errors():
            study = in_laws(file, scale, laws)
            rows.append(prove(study, out / f"{file.stem}-{laws}", laws, seeds, workers))
        typer.echo(rows[-1])
    pd.DataFrame(rows).round(4).to_csv(out / "end_to_end.csv", index=False)


if __name__ == "__main__":
    typer.run(main)

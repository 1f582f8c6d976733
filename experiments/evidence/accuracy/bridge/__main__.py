"""Bridge cards of dem-warp to other codes: ``python -m experiments.evidence.accuracy.bridge --out DIR``.

Each grain has its study here. It is calibrated by dem-warp on the CPU (some minutes of a core), and its card
is bridged to each code by 12 runs, and verified by 5 fresh ones. What is finished in the folder is not run
again.
"""

import json
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from experiments import api
from experiments.commands.console import CaseProgress, clear_errors
from experiments.evidence.accuracy.bridge.laws_of_liggghts import in_laws

HERE = Path(__file__).parent

GRAINS = ("sphere", "elongated", "angular")


def main(
    out: Annotated[Path, typer.Option(help="Folder of all campaigns and bridges; it may have some of them.")],
    grains: Annotated[list[str] | None, typer.Option("--grain", help="One of the grains.")] = None,
    engines: Annotated[list[str] | None, typer.Option("--engine", help="Code to bridge to.")] = None,
    laws: Annotated[str | None, typer.Option(help="Set of contact laws. Left out: the studies' own.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Cases at once. Left out: one a core.")] = None,
) -> None:
    """Calibrate and bridge every grain, and write ``bridges.csv``."""
    rows = []
    for grain in grains or GRAINS:
        home = out / (f"{grain}-of-{laws}" if laws else grain)
        card = home / "material.toml"
        with clear_errors():
            if not card.is_file():
                file = HERE / f"{grain}.toml"
                study = in_laws(file, None, laws) if laws else file
                api.calibrate(
                    study, home, device="cpu", workers=workers, resume=home.is_dir(), watch=CaseProgress
                )
            for engine in engines or ["liggghts"]:
                folder = out / f"{home.name}-{engine}"
                found = api.bridge(
                    card,
                    folder,
                    engine=engine,
                    approximate=True,
                    workers=workers,
                    resume=folder.is_dir(),
                    watch=CaseProgress,
                )
                rows.append(_row(home.name, engine, found.to_dict()))
                typer.echo(json.dumps(rows[-1]))
    pd.DataFrame(rows).to_csv(out / "bridges.csv", index=False)


def _row(grain: str, engine: str, found: dict) -> dict[str, object]:
    """Numbers of a bridge for the record: angles in degrees."""
    fresh, target = found["fresh"], found["target"]
    row: dict[str, object] = {"grain": grain, "engine": engine, "outcome": found["outcome"]}
    row |= {"target": target["mean"], "target_sd": target["sd"], "target_n": target["n"]}
    for name in ("shift", "scale"):
        if name in found:
            low, high = found[f"{name}_interval"]
            row |= {name: found[name], f"{name}_low": low, f"{name}_high": high}
    row["noise"] = found.get("noise")
    row |= {f"card_{name}": value for name, value in found["card_point"].items()}
    row |= dict(found["point"] or {})
    if fresh is not None:
        row |= {"fresh_mean": fresh["a"]["mean"], "fresh_sd": fresh["a"]["sd"], "fresh_n": fresh["a"]["n"]}
        low, high = fresh["interval"]
        row |= {"difference": fresh["difference"], "difference_low": low, "difference_high": high}
    return {name: round(value, 4) if isinstance(value, float) else value for name, value in row.items()}


if __name__ == "__main__":
    typer.run(main)

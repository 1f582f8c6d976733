"""How much do the paper's 31 angles depend on what the paper does not say? One thing at a time.

    python -m experiments.studies.buckwheat.sensitivities --modulus-scale 10 --out out/sensitivities

Each variant of ``variants.toml`` is one batch of 31 runs, times the replicates; its angles go to NAME.csv. A
variant whose file is there is not run again, and heaps are kept: variants of the estimator take those of the
base. With --variant, several times if you like, only those run.
"""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import typer

from experiments.cases import Store, run_cases
from experiments.errors import StoreError
from experiments.files import write_text
from experiments.studies.buckwheat.replay import LEAST_RUNS, Replay
from experiments.studies.buckwheat.runs import DESIGNS
from experiments.studies.buckwheat.variants import BASE, Variant, chosen_variants, variants

SETTINGS = "settings.json"
"""File that says how all variants of a folder were simulated."""

COLUMNS = (
    "stage", "run", "replicate", "published", "seed", "status", "reason", "angle", "angle_se", "grain_count",
    "solid_fraction", "grains_lost", "simulated_time",
)  # fmt: skip
"""What is kept of a case."""


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """The 31 runs of every variant that was simulated, the base among them."""

    replays: dict[str, Replay]
    """By variant; each with enough angles for its analysis."""
    settings: dict[str, Any]
    """How they were simulated: scale, modulus_scale, replicates."""
    spoilt: tuple[str, ...] = ()
    """Variants of which too few cases gave an angle."""

    @classmethod
    def read(cls, folder: Path) -> Sensitivities | None:
        """Read what a folder holds; None without a base to compare with."""
        paths = {name: folder / f"{name}.csv" for name in variants()}
        found = {name: Replay(pd.read_csv(path)) for name, path in paths.items() if path.is_file()}
        replays = {name: replay for name, replay in found.items() if _is_usable(replay)}
        if BASE not in replays:
            return None
        settings = json.loads((folder / SETTINGS).read_text(encoding="utf-8"))
        return cls(replays, settings, tuple(name for name in found if name not in replays))

    @cached_property
    def shifts(self) -> pd.DataFrame:
        """By variant: shift of the mean angle [deg] and its se by seeds, bias, Spearman, rmse, rmse by table.

        The rmse [deg] has our own seed noise taken out; ``change`` is its change against the base. A variant
        that was not run has no numbers.
        """
        rows = {name: self._shift(name) if name in self.replays else {} for name in variants()}
        table = pd.DataFrame.from_dict(rows, orient="index").rename_axis("variant")
        known = [(v.group, v.title, v.candidate) for v in variants().values()]
        return pd.DataFrame(known, table.index, ["group", "title", "candidate"]).join(table)

    @cached_property
    def effects(self) -> pd.DataFrame:
        """By variant: shift of every screening effect [deg], and the standard error of one by seeds."""
        base = self.replays[BASE].effects
        rows = {}
        for name, replay in self.replays.items():
            found = replay.effects
            error = float(np.hypot(found["noise_se"].iloc[0], base["noise_se"].iloc[0]))
            rows[name] = {**(found["effect"] - base["effect"]), "se": 0.0 if name == BASE else error}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("variant")

    @cached_property
    def left_out(self) -> pd.DataFrame:
        """By table left out: the candidate of least rmse over the other two, and how it does on that one.

        Columns: chosen, rmse of the base and of the chosen over the two tables and on the one left out [deg].
        """
        candidates = [name for name in self.replays if variants()[name].candidate]
        rows = {}
        for stage in DESIGNS:
            rest = [other for other in DESIGNS if other != stage]
            best = min(candidates, key=lambda name: self._rmse(name, rest))
            rows[stage] = {
                "chosen": best,
                "base_rest": self._rmse(BASE, rest),
                "chosen_rest": self._rmse(best, rest),
                "base_left_out": self._rmse(BASE, [stage]),
                "chosen_left_out": self._rmse(best, [stage]),
            }
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("stage")

    def _shift(self, name: str) -> dict[str, float]:
        found, base = (self.replays[key] for key in (name, BASE))
        pair = found.runs.join(base.runs[["angle", "n"]].add_prefix("base_")).dropna(
            subset=["angle", "base_angle"]
        )
        ours, theirs = (
            pair["stage"].map(replay.heap_variance) / pair[count]
            for replay, count in ((found, "n"), (base, "base_n"))
        )
        every = found.agreement()
        return {
            "heaps": float(len(found.measured)),
            "failed": float(len(found.cases) - len(found.measured)),
            "shift": float((pair["angle"] - pair["base_angle"]).mean()),
            "se": 0.0 if name == BASE else float(np.sqrt((ours + theirs).sum()) / len(pair)),
            "bias": every.bias.value,
            "spearman": every.spearman.value,
            "rmse": self._rmse(name, DESIGNS),
            "change": self._rmse(name, DESIGNS) - self._rmse(BASE, DESIGNS),
            **{f"rmse_{stage}": self._rmse(name, [stage]) for stage in DESIGNS},
        }

    def _rmse(self, name: str, stages: tuple[str, ...] | list[str]) -> float:
        return self.replays[name].agreement(stages).rmse_without_own_noise.value


def _is_usable(replay: Replay) -> bool:
    """Whether every table has runs to compare, and the screening its effects."""
    runs = replay.runs.dropna(subset=["angle"])["stage"].value_counts()
    return "screening" in replay.analysed and all(runs.get(stage, 0) >= LEAST_RUNS for stage in DESIGNS)


def run_variant(
    variant: Variant, store: Store, settings: dict[str, Any], device: str | None = None
) -> pd.DataFrame:
    """Simulate the 31 runs of a variant as one batch.

    Parameters
    ----------
    variant
        What is changed.
    store
        Where heaps are kept.
    settings
        scale, modulus_scale (None: the scale's) and replicates.
    device
        ``"cpu"``, ``"cuda"``, ``"cuda:1"``; None: the engine's choice.

    Returns
    -------
    DataFrame
        A row a case, `COLUMNS`.
    """
    study = variant.load_study(settings["scale"], settings["modulus_scale"])
    cases = run_cases(study, variant.planned_cases(settings["replicates"]), store, device)
    return cases.reindex(columns=COLUMNS)


def open_settings(folder: Path, settings: dict[str, Any]) -> None:
    """Note in a folder how its variants are simulated.

    Raises
    ------
    StoreError
        When the folder holds variants that were simulated otherwise.
    """
    path = folder / SETTINGS
    if path.is_file() and (found := json.loads(path.read_text(encoding="utf-8"))) != settings:
        raise StoreError(
            f"all variants of a folder are simulated as one another: {found}", settings, str(path)
        )
    write_text(path, json.dumps(settings, indent=1) + "\n")


def main(
    variant: Annotated[list[str] | None, typer.Option(help="Name of a variant; left out: all.")] = None,
    scale: Annotated[str, typer.Option(help="Scale of the buckwheat study.")] = "paper",
    modulus_scale: Annotated[
        float | None, typer.Option(min=1.0, help="What the shear modulus is divided by.")
    ] = None,
    replicates: Annotated[int, typer.Option(min=1, help="Heaps of each run.")] = 1,
    device: Annotated[str | None, typer.Option(help="cpu, cuda or cuda:N.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of the results.")] = Path("out/sensitivities"),
) -> None:
    """Simulate variants that are not there yet, and print how the angles shift."""
    settings = {"scale": scale, "modulus_scale": modulus_scale, "replicates": replicates}
    wanted = chosen_variants(variant or [])
    open_settings(out, settings)
    for chosen in wanted:
        path = out / f"{chosen.name}.csv"
        if path.is_file():
            continue
        started = time.perf_counter()
        cases = run_variant(chosen, Store(out / "cases"), settings, device)
        write_text(path, cases.to_csv(index=False))
        print(f"{chosen.name}: {len(cases)} cases in {time.perf_counter() - started:.1f} s", flush=True)
    found = Sensitivities.read(out)
    if found is None:
        print(f"nothing to compare yet: the variant {BASE} is missing, or gave too few angles")
        return
    for table in (
        found.shifts.drop(columns=["group", "title"]).dropna(how="all"),
        found.effects,
        found.left_out,
    ):
        print(table.round(2).to_string(), end="\n\n")


if __name__ == "__main__":
    typer.run(main)

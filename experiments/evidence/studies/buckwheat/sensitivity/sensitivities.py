"""Sensitivity of the paper's 31 angles to what the paper does not say, one thing at a time."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from experiments.evidence.studies.buckwheat.replay.replay import LEAST_RUNS, Replay
from experiments.evidence.studies.buckwheat.replay.runs import DESIGNS
from experiments.evidence.studies.buckwheat.sensitivity.sensitivity_folder import SETTINGS
from experiments.evidence.studies.buckwheat.sensitivity.variants import BASE, variants


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """The 31 runs of every variant that was simulated, the base among them."""

    replays: dict[str, Replay]
    """By variant; each with enough angles for its analysis."""
    settings: dict[str, Any]
    """Settings of the simulations: scale, modulus_scale, replicates."""
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
        pair = found.runs.join(base.runs[["angle", "n"]].add_prefix("base_"))
        pair = pair.dropna(subset=["angle", "base_angle"])
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
    runs = replay.runs.dropna(subset=["angle"])["stage"].value_counts()
    return "screening" in replay.analysed and all(runs.get(stage, 0) >= LEAST_RUNS for stage in DESIGNS)

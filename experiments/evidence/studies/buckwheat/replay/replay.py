"""The paper's runs simulated again, analysed as the paper analyses its own, and held against them."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from doe import (
    Agreement,
    Comparison,
    ErrorTerm,
    Sample,
    ScreenResult,
    Surface,
    agreement,
    compare_means,
    fit_surface,
    pure_error,
    screen,
)
from experiments.evidence.studies.buckwheat.replay.runs import DESIGNS, STAGES, published_runs
from experiments.studies.buckwheat import paper

RUN = ["stage", "run"]
"""Labels of a run."""

ALL = "Tables 3, 5 and 6"
"""The 31 runs of all designs together."""


@dataclass(frozen=True, eq=False)
class Replay:
    """Simulated cases of the paper's runs."""

    cases: pd.DataFrame
    """A row a case: stage, run, replicate, angle [deg]; failed ones have no angle."""

    @cached_property
    def measured(self) -> pd.DataFrame:
        """The cases that gave an angle."""
        return self.cases[self.cases["angle"].notna()]

    @cached_property
    def runs(self) -> pd.DataFrame:
        """A row a run: stage, run, factors, published [deg]; angle, sd and n of its heaps, difference."""
        heaps = self.measured.groupby(RUN)["angle"].agg(["mean", "std", "count"])
        heaps = heaps.set_axis(["angle", "sd", "n"], axis=1)
        simulated = published_runs().set_index(RUN).loc[lambda runs: runs.index.isin(_labels(self.cases))]
        runs = simulated.join(heaps)
        runs["n"] = runs["n"].fillna(0).astype(int)
        return runs.assign(difference=runs["angle"] - runs["published"]).reset_index()

    def noise(self, stages: Iterable[str] = tuple(STAGES)) -> ErrorTerm:
        """Variance of one heap by its seed: pooled within settings (pure error), over some stages' runs.

        s^2 = sum over the settings of sum_j (x_ij - mean_i)^2, over the heaps less the settings. Runs of one
        stage with one setting, such as the centre of the composite design, are replicates too.
        """
        heaps = self.measured[self.measured["stage"].isin(list(stages))]
        setting = self.runs.assign(setting=_settings(self.runs)).set_index(RUN)["setting"]
        angles = heaps["angle"].reset_index(drop=True)
        return pure_error(pd.DataFrame({"setting": setting.loc[_labels(heaps)].to_numpy()}), angles)

    @cached_property
    def heap_variance(self) -> dict[str, float]:
        """Variance of one heap by its seed [deg^2], by stage: its own, or that of all where it has none."""
        own = {stage: self.noise([stage]) for stage in STAGES}
        every = self.noise()
        spare = every.mean_sq if every.df > 0 else 0.0
        return {stage: noise.mean_sq if noise.df > 0 else spare for stage, noise in own.items()}

    def agreement(self, stages: Iterable[str] = DESIGNS, reference_sd: float | None = None) -> Agreement:
        """Agreement with the published angles of some of `STAGES`, the seed noise of both known.

        That of a published angle is a standard deviation [deg]; None: the first of `published_noise`.
        """
        runs = self.runs[self.runs["stage"].isin(list(stages)) & self.runs["angle"].notna()]
        sd = published_noise()[0] if reference_sd is None else reference_sd
        return agreement(
            runs["angle"],
            runs["published"],
            runs["stage"].map(self.heap_variance) / runs["n"],
            sd**2,
            settings=_settings(runs),
            strata=runs["stage"].to_numpy(dtype=str),
        )

    @cached_property
    def agreement_table(self) -> pd.DataFrame:
        """Agreement by table and in all; every estimate with the ends of its 95 % interval."""
        groups = {title: (stage,) for stage, title in STAGES.items()} | {ALL: DESIGNS}
        rows = {name: self._agreement_row(stages) for name, stages in groups.items()}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("table")

    @cached_property
    def screening(self) -> ScreenResult:
        """Effects at the paper's screening runs, tested against the idle columns as the paper does."""
        cases = self._of("screening")
        design = paper.screening_design().select(cases["run"].tolist())
        return screen(design, cases["angle"].to_numpy(), error="dummies")

    @cached_property
    def effects(self) -> pd.DataFrame:
        """Effects [deg], F and p by factor: published (recomputed) and ours, with our seed noise's error."""
        ours, theirs = self.screening.table, paper.screening().table
        table = theirs[["effect", "F", "p", "rank"]].add_prefix("paper_")
        table = table.join(ours[["effect", "F", "p", "rank"]])
        noise_se = 2.0 * np.sqrt(self.heap_variance["screening"] / len(self.screening.response))
        return table.assign(noise_se=noise_se or np.nan).rename_axis("factor")

    @cached_property
    def surface(self) -> Surface:
        """Full quadratic at the paper's composite runs."""
        cases = self._of("composite")
        return fit_surface(paper.composite_design().select(cases["run"].tolist()), cases["angle"].to_numpy())

    @cached_property
    def anova(self) -> pd.DataFrame:
        """Analysis of variance of the full quadratic, published (recomputed) and ours, by source."""
        columns = ["df", "sum_sq", "F", "p"]
        theirs = paper.surface().anova[columns].add_prefix("paper_")
        return theirs.join(self.surface.anova[columns]).rename_axis("source")

    @cached_property
    def coefficients(self) -> pd.DataFrame:
        """Coded coefficients [deg] of the full quadratic with their standard errors."""
        fits = {"paper_": paper.surface(), "": self.surface}
        columns = {f"{name}coefficient": fit.coded_coefficients for name, fit in fits.items()}
        columns |= {f"{name}se": fit.fit.bse for name, fit in fits.items()}
        return pd.DataFrame(columns).rename_axis("term")

    @cached_property
    def verification(self) -> dict[str, Comparison]:
        """Heaps at the published optimum against the measured angle: the paper's three, and ours."""
        target = paper.measured()
        found = {"the paper": compare_means(Sample.of(paper.verification()), target, margin=2.0 * target.sd)}
        ours = self._of("verification")["angle"].to_numpy()
        if len(ours) >= 2:
            found["simulated again"] = compare_means(ours, target, margin=2.0 * target.sd)
        return found

    def _of(self, stage: str) -> pd.DataFrame:
        return self.measured[self.measured["stage"] == stage]

    def _agreement_row(self, stages: Iterable[str]) -> dict[str, float]:
        low, high = published_noise()
        found = self.agreement(stages, low)
        row: dict[str, float] = {"runs": found.runs}
        for name in ("rmse", "rmse_without_noise", "bias", "slope", "spearman"):
            estimate = getattr(found, name)
            row |= {name: estimate.value, f"{name}_low": estimate.low, f"{name}_high": estimate.high}
        row["rmse_without_own_noise"] = self.agreement(stages, 0.0).rmse_without_noise.value
        row["ceiling"] = found.spearman_ceiling.value
        row["ceiling_noisier"] = self.agreement(stages, high).spearman_ceiling.value
        return row


def published_noise() -> tuple[float, float]:
    """Return the deviations of the paper's replicates [deg]: composite centre (5), verification (3)."""
    centre = paper.surface().pure_error.mean_sq ** 0.5
    return float(centre), Sample.of(paper.verification()).sd


def _labels(cases: pd.DataFrame) -> pd.MultiIndex:
    return pd.MultiIndex.from_frame(cases[RUN])


def _settings(runs: pd.DataFrame) -> np.ndarray:
    names = [factor.name for factor in paper.factors()]
    return runs.groupby(["stage", *names], dropna=False, sort=False).ngroup().to_numpy()

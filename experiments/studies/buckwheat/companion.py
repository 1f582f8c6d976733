"""Companion of the buckwheat study: the paper's numbers next to a campaign's, and its misprints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import pandas as pd

from doe import ScreenResult, compare_means
from experiments.calibrate.campaign import Campaign
from experiments.calibrate.results import SurfaceResult
from experiments.report.kit.html import Chapter
from experiments.report.kit.numbers import enumeration, fixed
from experiments.report.kit.table import Column, Layout, Table, columns, make_table
from experiments.report.stage_tables import ERROR_PERCENT, differences_table, quality_of
from experiments.report.study_companion import Companion
from experiments.studies.buckwheat import paper

TEXT = (
    "The paper kept {kept} and chose {point}. Its numbers are recomputed here from the runs that it prints. "
    "Most printed results follow from them; the misprints below do not, or contradict the rest of the text."
)
MODELS = {"full": "quadratic", "reduced": "reduced"}
"""Names of the models in `paper.surface`."""

TEST = ("F", "p")
"""Columns of a test."""


class BuckwheatCompanion(Companion):
    """Numbers that the paper printed, and what follows from them."""

    def campaign_chapters(self, campaign: Campaign) -> Sequence[Chapter]:
        """Return the chapter on the paper's numbers, next to those of every stage that was reached."""
        reduced, tables = paper.surface("reduced"), {}
        settings = paper.published("settings")["value"]
        if campaign.screening is not None:
            tables["effects"] = _effects_table(campaign.screening.leading.screen)
        if campaign.climb is not None:
            tables["climb"] = _climb_table()
        if campaign.surface is not None:
            tables |= _surface_tables(campaign.surface)
        if campaign.verification is not None:
            test = compare_means(paper.verification(), paper.measured(), campaign.verification.leading.margin)
            tables["tests"] = differences_table({"the paper": test}, {"the paper": "deg"}, "paper-tests")
        tables["misprints"] = misprints_table()
        names = reduced.design.names
        point = enumeration(f"{name} = {fixed(float(settings[name]), 3)}" for name in names)
        return [
            Chapter(
                "paper", "The paper's numbers", tables, text=TEXT.format(kept=enumeration(names), point=point)
            )
        ]


def _effects_table(screen: ScreenResult) -> Table:
    """Lay out the tests of the effects, the campaign's strongest first."""
    frame = _with_paper(screen.table.sort_values("rank"), paper.screening().table)
    return make_table("paper-effects", frame, ["factor", *_tests()], "Tests of the effects on the angle.")


def _climb_table() -> Table:
    path = paper.published("steepest_climb").rename_axis("step")
    path = path.rename(columns={paper.RESPONSE: "angle", "relative_error_pct": "error_percent"})
    factors = [Column(name, name, "value") for name in path.columns.drop(["angle", "error_percent"])]
    shown: Layout = ["step", *factors, *columns("angle", "°", angle="angle"), ERROR_PERCENT]
    return make_table("paper-climb", path, shown, "The paper's climb.")


def _surface_tables(result: SurfaceResult) -> dict[str, Table]:
    """Lay out tests, quality and coefficients of both models; tests where the factors are the paper's."""
    own = {"full": result.leading.full, "reduced": result.leading.reduced}
    papers = {name: paper.surface(model) for name, model in MODELS.items()}
    tables = {}
    if set(result.design.names) == set(papers["full"].design.names):
        for name, surface in own.items():
            frame = _with_paper(surface.anova, _renamed(papers[name].anova, result.design.names))
            caption = f"Analysis of variance of the {name} model."
            tables[name] = make_table(
                f"paper-anova-{name}", frame.rename_axis("source"), ["source", *_tests()], caption
            )
    quality = quality_of(own).join(quality_of(papers).drop(columns="measure").add_prefix("paper_"))
    heads = {
        "full": "full",
        "reduced": "reduced",
        "paper_full": "paper, full",
        "paper_reduced": "paper, reduced",
    }
    shown: Layout = ["measure", *columns("share", **heads)]
    tables["quality"] = make_table("paper-quality", quality, shown, "Quality of the fits.")
    full, reduced = (papers[name].coefficients for name in MODELS)
    coefficients = pd.DataFrame({"full": full, "reduced": reduced}).loc[full.index]
    caption = "Coefficients of the paper's models, natural units."
    layout: Layout = ["term", *columns("sum", "°", full="full", reduced="reduced")]
    tables["coefficients"] = make_table(
        "paper-coefficients", coefficients.rename_axis("term"), layout, caption
    )
    return tables


def _with_paper(own: pd.DataFrame, published: pd.DataFrame) -> pd.DataFrame:
    tested = own.dropna(subset=["F"])
    return tested.join(published[list(TEST)].add_prefix("paper_"))


def _tests() -> list[Column]:
    return [
        Column("F", "F", "ratio"),
        Column("p", "p", "p"),
        Column("paper_F", "paper, F", "ratio"),
        Column("paper_p", "paper, p", "p"),
    ]


def _renamed(anova: pd.DataFrame, names: Sequence[str]) -> pd.DataFrame:
    """Write interactions in the order of the campaign's factors."""
    return anova.rename(index={f"{b}:{a}": f"{a}:{b}" for i, a in enumerate(names) for b in names[i + 1 :]})


def misprints_table() -> Table:
    """Lay out what the paper's own numbers contradict."""
    frame = pd.DataFrame([asdict(misprint) for misprint in paper.misprints()])
    return make_table("misprints", frame, list(frame), "Where the print and its own numbers differ.")


COMPANION = BuckwheatCompanion()

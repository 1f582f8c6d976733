"""The tables of responses: the target of each, what it buys, and what all of them leave open."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from doe import JointFit
from experiments.calibrate.campaign import Campaign
from experiments.calibrate.joint import direction_text, open_directions
from experiments.calibrate.results import ScreeningResult, SurfaceResult
from experiments.report.kit.numbers import term, unit_sign
from experiments.report.kit.sentences import say
from experiments.report.kit.table import Column, Layout, Table, columns, make_table
from experiments.studyfile.campaign import TARGET_SCENE, Direct, OptimumSettings, Response

DIRECT = ""
"""Scene of direct readings, which costs nothing."""


def goals_table(campaign: Campaign) -> Table:
    """Lay out every response: its target, and as far as they are known noise, fit and fresh cases."""
    rows = {response.name: _goal(campaign, response) for response in campaign.responses}
    rows |= {direct.name: _direct_goal(campaign, direct) for direct in campaign.direct}
    table = pd.DataFrame.from_dict(rows, orient="index").rename_axis("response")
    optimum = campaign.optimum
    marks: list[str] | None = None
    if optimum is not None and optimum.joint is not None:
        tests = optimum.joint.tests(optimum.point)
        table = table.join(tests[["fitted", "t", "p"]])
        apart = tests.index[~tests["agrees"]]
        marks = ["failed" if name in apart else "" for name in table.index]
    shown: Layout = [
        *("response", "scene", "unit"),
        *columns("free", target="target", sd="sd"),
        "n",
        *columns(
            "free",
            target_se="se",
            **({"model_sd": "sd of the model"} if campaign.direct else {}),
            noise="sd of one case",
            reduced="fit there, reduced model",
            fitted="full model",
        ),
        Column("t", "errors off", "ratio"),
        "p",
        Column("fresh", "fresh cases", "free"),
        Column("fresh_p", "p, no difference", "p"),
    ]
    note = "Scene: the study's own, or a further one by its name. The first response leads the climb."
    if campaign.direct:
        note += " " + say("note.direct")
    if "t" in table:
        note += (
            " There: at the chosen point. Errors off and p: the full model's fit less the target, over the "
            "errors of both together. The reduced model lacks the terms that are not significant."
        )
    return make_table("responses", table, shown, "Every response and its target.", note, marks)


def _goal(campaign: Campaign, response: Response) -> dict[str, Any]:
    name = response.name
    scene = "own" if response.scene == TARGET_SCENE else response.scene
    scene += ", held out" if response.held_out else ""
    facts: dict[str, Any] = {"scene": scene, "unit": unit_sign(response.unit)}
    if campaign.target is not None:
        sample = campaign.target.responses[name]
        facts |= {"target": sample.mean, "sd": sample.sd, "n": sample.n, "target_se": sample.se}
    if campaign.noise_floor is not None and not response.held_out:
        facts["noise"] = campaign.noise_floor.responses[name].sd
    if campaign.optimum is not None and campaign.surface is not None and not response.held_out:
        fit = campaign.surface.responses[name].final
        facts["reduced"] = float(fit.predict(campaign.optimum.point)["mean"].iloc[0])
    if campaign.verification is not None:
        test = campaign.verification.responses[name]
        facts |= {"fresh": test.a.mean, "fresh_p": test.p}
    return facts


def _direct_goal(campaign: Campaign, direct: Direct) -> dict[str, Any]:
    sample, optimum = direct.measured, campaign.optimum
    facts: dict[str, Any] = {"scene": f"direct, {direct.by}", "unit": unit_sign(direct.unit)}
    facts |= {"target": sample.mean, "sd": sample.sd, "n": sample.n, "target_se": sample.se}
    if optimum is not None:
        facts["reduced"] = optimum.settings[direct.factor]
    return facts | {"model_sd": direct.model_sd}


def response_tables(campaign: Campaign) -> dict[str, Table]:
    """Lay out what several responses buy together; empty where there is one, or none was fitted."""
    screening, surface = campaign.screening, campaign.surface
    joint = campaign.optimum.joint if campaign.optimum else None
    if joint is None or screening is None or surface is None:
        return {}
    return {
        "responses": goals_table(campaign),
        "shrinkage": _shrinkage_table(campaign, joint),
        "directions": _directions_table(joint, campaign.settings.optimum),
        "effects": _effects_table(screening, campaign.settings.selection.alpha),
        "surfaces": _surfaces_table(surface),
    }


def _shrinkage_table(campaign: Campaign, joint: JointFit) -> Table:
    scenes = {response.name: response.scene for response in campaign.responses}
    table = joint.shrinkage.copy()
    for column in ("share", "alone", "with_first"):
        table[column] *= 100.0
    costs = campaign.scene_costs
    costs["work"] = 100.0 * costs["grain_time"] / costs["grain_time"].sum()
    paid = {DIRECT}
    for name in table.index:
        scene = scenes.get(str(name), DIRECT)
        for column in ("cases", "simulated_time", "work"):
            table.loc[name, column] = 0.0 if scene in paid else costs.loc[scene, column]
        paid.add(scene)
    shown: Layout = [
        Column("response", "response added"),
        Column("share", "compatible with all so far", "free", "%"),
        Column("ratio", "over the row above", "free"),
        *columns("free", "%", alone="with it alone", with_first=f"with the {table.index[0]} and it"),
        Column("cases", "cases for it", "label"),
        Column("simulated_time", "simulated", "count", "s"),
        Column("work", "share of the work", "percent", "%"),
    ]
    caption = "What each response buys, and what it takes."
    return make_table("shrinkage", table, shown, caption, say("note.shrinkage"))


def _directions_table(joint: JointFit, settings: OptimumSettings) -> Table:
    table, left = joint.directions.copy(), open_directions(joint, settings).index
    table["span"] *= 100.0
    names = [factor.name for factor in joint.factors]
    table["moves"] = [direction_text(row) for _, row in joint.directions.iterrows()]
    table["open"] = np.where(table.index.isin(left), "open", "pinned down")
    shown: Layout = [
        Column("direction", "no.", "label"),
        "moves",
        *(Column(name, f"{name} coded", "coded") for name in names),
        Column("span", "span", "percent", "%"),
        Column("open", "verdict"),
    ]
    level, span = 100.0 * (1.0 - joint.alpha), 100.0 * settings.unidentified_span
    note = say("note.directions", level=level, span=span)
    marks = ["chosen" if direction in left else "" for direction in table.index]
    caption = "Directions of the factors, the best known first."
    return make_table("directions", table, shown, caption, note, marks)


def _effects_table(result: ScreeningResult, alpha: float) -> Table:
    screens = {name: found.screen for name, found in result.responses.items()}
    frames = {name: screen.table[["effect", "p"]].add_prefix(f"{name} ") for name, screen in screens.items()}
    table = pd.concat(frames.values(), axis=1).rename_axis("factor")
    shown: Layout = ["factor"]
    for name in screens:
        shown += [Column(f"{name} effect", name, "free"), Column(f"{name} p", "p", "p")]
    marks = ["strong" if row.filter(like=" p").min() < alpha else "" for _, row in table.iterrows()]
    note = f"Marked: p < {alpha:g} for one of them. Effects from low to high, in the response's unit."
    return make_table("response-effects", table, shown, "Effects on every response.", note, marks)


def _surfaces_table(result: SurfaceResult) -> Table:
    fits = {name: (fit.full, fit.reduced) for name, fit in result.responses.items()}
    rows = {
        name: {
            "cases": float(len(full.response)),
            "terms": ", ".join(reduced.coded_coefficients.index[1:]),
            "r2": reduced.r2,
            "r2_predicted": reduced.r2_predicted,
            "p_model": full.anova["p"]["model"],
            "p_lack": full.anova["p"]["lack of fit"],
        }
        for name, (full, reduced) in fits.items()
    }
    table = pd.DataFrame.from_dict(rows, orient="index").rename_axis("response")
    shown: Layout = [
        "response",
        Column("cases", "cases", "label"),
        Column("terms", "terms kept", write=_terms),
        *columns("ratio", r2="R², reduced", r2_predicted="R² predicted, reduced"),
        *columns("p", p_model="p of the full model", p_lack="p of its lack of fit"),
    ]
    return make_table("response-surfaces", table, shown, "Surfaces of the responses.")


def _terms(names: str) -> Markup:
    return Markup(", ").join(term(name) for name in names.split(", "))

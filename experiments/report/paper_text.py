"""Methods paragraph and table of a campaign, to be pasted into a paper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from dem_warp import EDEM
from experiments.calibrate.campaign import Campaign
from experiments.io.program_version import program_version
from experiments.report.kit.latex import latex_table, latex_text
from experiments.report.kit.markdown import markdown_table
from experiments.report.kit.numbers import enumeration, fixed, open_end, p_clause, quantity, significant
from experiments.report.kit.sentences import say
from experiments.report.kit.table import Layout, Table, columns, make_table
from experiments.report.study_facts import study_facts
from experiments.studyfile import Study
from experiments.studyfile.campaign import Direct, Response


@dataclass(frozen=True)
class Paste:
    """One text to be copied."""

    name: str
    title: str
    text: str


def pastes(campaign: Campaign, study: Study, provenance: Mapping[str, Any]) -> list[Paste]:
    """Write paragraph and table in Markdown and in LaTeX; none before a point was chosen."""
    if campaign.optimum is None:
        return []
    paragraph = methods_paragraph(campaign, study, provenance)
    return pastes_of(paragraph, paper_table(campaign, study), "contact-parameters")


def pastes_of(paragraph: str, table: Table, label: str) -> list[Paste]:
    """Write a paragraph and a table, which LaTeX knows by a label, in Markdown and in LaTeX."""
    return [
        Paste("methods-markdown", "Methods, as Markdown", f"{paragraph}\n"),
        Paste("methods-latex", "Methods, as LaTeX", f"{latex_text(paragraph)}\n"),
        Paste("table-markdown", "Table, as Markdown", markdown_table(table)),
        Paste("table-latex", "Table, as LaTeX (booktabs)", latex_table(table, label)),
    ]


def software(provenance: Mapping[str, Any]) -> str:
    """Name dem-warp with its version, and its commit where it is known."""
    commit = provenance.get("commit")
    return f"dem-warp {program_version()}" + (f" (commit {commit})" if commit else "")


def methods_paragraph(campaign: Campaign, study: Study, provenance: Mapping[str, Any]) -> str:
    """Say how the values were found, with the numbers that a referee asks for."""
    begin = f"The contact parameters were calibrated with {software(provenance)}."
    sentences = [begin, *simulated_sentences(study)]
    for part in (_designs, _choice, _verification):
        sentences += part(campaign, study)
    lost = len(campaign.failed_cases)
    sentences.append(say("methods.lost", count=len(campaign.cases), lost=lost or "none"))
    return " ".join(sentences)


def paper_table(campaign: Campaign, study: Study) -> Table:
    """Lay out ranges and values as a paper prints them."""
    optimum = campaign.optimum
    if optimum is None:
        raise ValueError("a campaign that chose no point has no values")
    rows = []
    for factor in study.factors:
        ends = _ends(optimum.ranges.loc[factor.name]) if factor.name in optimum.point else []
        rows.append(
            {
                "parameter": study.labels[factor.name],
                "symbol": factor.name,
                "unit": factor.unit or "1",
                "explored": f"{factor.low:g} to {factor.high:g}",
                "value": significant(optimum.settings[factor.name], 3),
                "compatible": " to ".join(ends) if ends else "not calibrated",
            }
        )
    shown: Layout = [
        *("parameter", "symbol", "unit"),
        *columns(explored="stated range", value="value", compatible="compatible range"),
    ]
    level = fixed(100.0 * campaign.settings.optimum.confidence, 0)
    caption, note = "Contact parameters, as calibrated.", say("note.paper", level=level)
    return make_table("paper", pd.DataFrame(rows), shown, caption, note)


def _ends(ends: pd.Series) -> list[str]:
    """Write both ends of a factor's range; those beyond which nothing was explored say so."""
    forms = {end: open_end(end) if ends[f"{end}_open"] else "{}" for end in ("low", "high")}
    return [form.format(significant(float(ends[end]), 3)) for end, form in forms.items()]


def simulated_sentences(study: Study) -> Iterator[str]:
    """Say what was simulated, and how its heaps were measured."""
    facts, density = study_facts(study), str(study.document["grain"].get("density", "as in the study"))
    test = facts.get("Test", f"a lifted cylinder ({facts.get('Tube')}; lifted at {facts.get('Lift')})")
    yield say("methods.test", test=test, grains=facts["Grains"], density=density.replace("^3", "³"))
    modulus = facts["Shear modulus"]
    softened = "was not softened" if modulus == "real" else f"was {modulus}"
    laws = "Hertz and Mindlin's law without slip, with EDEM's damping and rolling friction"
    if study.solver.laws != EDEM:
        laws = f"the laws of {facts['Contact laws']}"
    yield say("methods.laws", laws=laws, softened=softened, step=facts["Time step"])
    yield say("methods.angle", angle=facts["Angle"])


def _designs(campaign: Campaign, study: Study) -> Iterator[str]:
    screening, selection, climb = campaign.screening, campaign.selection, campaign.climb
    if screening is None or selection is None or climb is None or campaign.surface is None:
        return
    kind = campaign.settings.screening.design.replace("-", " ").title().replace(" ", "–")
    runs, cases, factors = len(screening.design.coded), len(screening.cases), len(campaign.factors)
    yield say("methods.screening", kind=kind, runs=runs, cases=cases, factors=factors)
    kept = enumeration(study.labels[name] for name in selection.kept)
    yield say("methods.climb", steps=len(climb.path), kept=kept)
    fit = campaign.surface.leading
    r2, predicted = fixed(fit.reduced.r2, 2), fixed(fit.reduced.r2_predicted, 2)
    runs, p = len(campaign.surface.design.coded), p_clause(fit.full.anova["p"]["lack of fit"])
    yield say("methods.surface", runs=runs, r2=r2, predicted=predicted, p=p)
    if (moved := campaign.fidelity) is not None:
        yield say("methods.moved", scale=moved.scale, runs=len(moved.cases))


def _choice(campaign: Campaign, study: Study) -> Iterator[str]:
    optimum, target = campaign.optimum, campaign.target
    if optimum is None or target is None:
        return
    units = {factor.name: factor.unit for factor in campaign.factors}
    values = enumeration(
        f"{study.labels[name]} {significant(value, 3)} {units[name]}".rstrip()
        for name, value in optimum.point.items()
    )
    source = "simulated with hidden values" if target.truth else "measured"
    aims = enumeration(
        f"{_words(one)} {_sample(target.responses[one.name], one)}, {source}" for one in campaign.responses
    )
    share = fixed(100.0 * optimum.region.fraction, 0)
    level = fixed(100.0 * campaign.settings.optimum.confidence, 0)
    yield say("methods.target", aims=aims)
    readings = [
        f"the {study.labels[one.factor]} by {one.by.replace('-', ' ')}, {_sample(one.measured, one)}"
        for one in campaign.direct
        if one.factor in optimum.point
    ]
    if readings:
        yield say("methods.direct", readings=enumeration(readings))
    yield say("methods.choice", values=values, share=share, level=level)


def _verification(campaign: Campaign, study: Study) -> Iterator[str]:
    if campaign.verification is None:
        return
    for response in campaign.responses:
        test, unit = campaign.verification.responses[response.name], response.unit
        level, ends = fixed(100.0 * (1.0 - test.alpha), 0), [quantity(end, unit) for end in test.interval]
        yield say(
            "methods.verification",
            what=_words(response),
            sample=_sample(test.a, response),
            difference=quantity(test.difference, unit),
            level=level,
            ends=" to ".join(ends),
            p=p_clause(test.p),
            margin=quantity(test.margin, unit),
            p_equivalence=p_clause(test.equivalence_p),
        )


def _sample(sample: Any, response: Response | Direct) -> str:
    mean, sd = quantity(sample.mean, response.unit), quantity(sample.sd, response.unit)
    return say("methods.sample", mean=mean, sd=sd, n=sample.n)


def _words(response: Response) -> str:
    return (
        "a repose angle of" if response.observable == "angle" else f"a {response.name.replace('_', ' ')} of"
    )

"""Verdict, cautions, values and texts to paste: from a campaign's own numbers, each printed once."""

import html
import re
from collections import Counter
from dataclasses import replace
from types import SimpleNamespace

import pytest
from analytic_heaps import AnalyticHeaps, twin_of_one_angle
from page_reader import Page

from experiments.calibrate import Campaign, calibrate
from experiments.report import render_page
from experiments.report.cautions import FEW_GRAINS, cautions
from experiments.report.kit.latex import latex_text
from experiments.report.kit.numbers import prose
from experiments.report.paper_text import methods_paragraph, paper_table, pastes
from experiments.report.verdict import verdict_sentence
from experiments.studyfile import Study

NUMBER = re.compile(r"(?<![\w.])[−-]?\d+\.\d+")
"""A number with decimals, as sentences have it."""


def caution_texts(campaign: Campaign, study: Study) -> str:
    return "\n".join(caution.text for caution in cautions(campaign, study))


def section_of(page: str, name: str) -> str:
    """Text of a section without its tables, charts and the numbers behind its decisions."""
    begin = page.index(f'<section id="{name}"')
    text = page[begin : page.index("</section>", begin)]
    text = re.sub(r"<(table|script|figure|details|pre)\b.*?</\1>", "", text, flags=re.S)
    return html.unescape(re.sub(r"<[^>]+>", " ", text))


def test_the_verdict_names_its_factors_in_words(campaign: Campaign) -> None:
    values = (f"{campaign.optimum.point[name]:.4g}" for name in ("E", "F"))
    words = "grain-grain static friction (E) {}, grain-steel static friction (F) {}".format(*values)
    assert campaign.reason.startswith(f"At {words} fresh cases gave angle")
    assert NUMBER.search(verdict_sentence(campaign)) is None


def test_a_summary_tells_each_number_once(page_text: str) -> None:
    text = section_of(page_text, "summary")
    numbers = Counter(NUMBER.findall(text))
    assert len(numbers) > 5
    assert [number for number, times in numbers.items() if times > 1] == []


@pytest.mark.parametrize("name", ["noise_floor", "climb", "surface", "optimum", "verification"])
def test_a_paragraph_does_not_repeat_what_a_decision_says(
    name: str, campaign: Campaign, page_text: str
) -> None:
    page = page_text
    begin = page.index(f'<section id="{name}"')
    chapter = page[begin : page.index("</section>", begin)]
    decided = " ".join(re.findall(r'<p class="outcome">(.*?)</p>', chapter, flags=re.S))
    # Decisions close a chapter.
    above = section_of(page, name).split(prose(campaign.stages[name].decisions[0].rule))[0]
    assert NUMBER.search(decided)
    assert not set(NUMBER.findall(decided)) & set(NUMBER.findall(above))


def test_cautions_come_before_the_values(page_text: str) -> None:
    texts = ("Target met; values not pinned.", "Before you use these values", "Enter these values")
    places = [page_text.index(text) for text in texts]
    assert places == sorted(places)


def test_a_bench_campaign_is_cautioned() -> None:
    study = twin_of_one_angle()
    text = caution_texts(calibrate(study, AnalyticHeaps()), study)
    assert "The target was simulated, not measured." in text
    assert f"fewer than {FEW_GRAINS} grains" in text
    assert "The shear modulus was softened." in text


def test_a_surface_that_predicts_poorly_is_cautioned(campaign: Campaign, study: Study) -> None:
    assert "predicts new runs poorly" not in caution_texts(campaign, study)
    found = campaign.surface.leading
    fit = SimpleNamespace(r2_predicted=0.17, r2_adjusted=found.reduced.r2_adjusted)
    surface = replace(campaign.surface, responses={"angle": replace(found, reduced=fit)})
    text = caution_texts(replace(campaign, surface=surface), study)
    assert "The surface of the angle predicts new runs poorly: its predicted R² is 0.17" in text


def test_a_campaign_at_full_size_is_not_cautioned_of_its_grains(campaign: Campaign, study: Study) -> None:
    assert f"fewer than {FEW_GRAINS}" in caution_texts(campaign, study)  # the analytic heaps say 400
    large = replace(campaign, cases=campaign.cases.assign(grain_count=2490.0))
    assert f"fewer than {FEW_GRAINS}" not in caution_texts(large, study)
    assert "softened" not in caution_texts(large, study)


def test_the_values_to_enter_are_those_of_every_factor(campaign: Campaign, study: Study, page) -> None:
    rows = {row[1][0]: row for row in page.rows("values")}
    assert list(rows)[:2] == ["E", "F"]
    assert {name: row[2][1] for name, row in rows.items()} == campaign.optimum.settings
    ranges = campaign.optimum.region.ranges
    assert [cell[1] for cell in rows["E"][4:6]] == [ranges["low"]["E"], ranges["high"]["E"]]
    assert rows["E"][4][0].startswith("≤ ")
    assert rows["E"][5][0].endswith(", not explored beyond")
    assert (rows["E"][-1][0], rows["A"][-1][0]) == ("calibrated, left open", "middle of its range")
    assert rows["A"][4][1] is None


def test_the_values_to_enter_hold_the_fixed_ones_and_the_simulated_modulus() -> None:
    study = twin_of_one_angle()
    page = Page(render_page(calibrate(study, AnalyticHeaps()), study))
    rows = {row[0][0]: row for row in page.rows("fixed-values")}
    case = study.case({}, 1)
    assert float(rows["grain, shear modulus"][1][0].removesuffix(" Pa")) == case.grain_material.shear_modulus
    assert f"divided by {study.numerics.modulus_scale:g}" in rows["grain, shear modulus"][2][0]
    assert rows["grain, density"][1][0] == "698 kg/m^3"
    assert {"wall, poisson ratio", "wall, density", "contact laws"} <= set(rows)
    assert rows["grain, sizes"][1][0] == "1 +- 0.05 of the shape, normal, cut at 3 sd"
    [modulus] = [row for row in page.rows("values") if row[1][0] == "B"]
    assert modulus[-1][0].endswith(f"enter it divided by {study.numerics.modulus_scale:g}, as simulated")


def test_the_paragraph_says_what_a_referee_asks(campaign: Campaign, study: Study) -> None:
    text = methods_paragraph(campaign, study, {"commit": "abc1234"})
    test, fit = campaign.verification.leading, campaign.surface.leading.reduced
    for part in (
        "dem-warp 0.1.0 (commit abc1234)",
        "35 mm wide, 110 mm high",
        "density 698 kg/m³",
        "Hertz and Mindlin's law without slip",
        "A Plackett–Burman design of 12 runs",
        f"predicted R² = {fit.r2_predicted:.2f}",
        f"n = {test.a.n}",
        f"{len(campaign.cases)} cases were simulated, of which none failed",
    ):
        assert part in text


def test_texts_to_paste_are_markdown_and_latex(campaign: Campaign, study: Study) -> None:
    by_name = {paste.name: paste.text for paste in pastes(campaign, study, {})}
    table = paper_table(campaign, study)
    rows = [line for line in by_name["table-markdown"].splitlines() if line.startswith("| ")]
    assert len(rows) == 2 + len(table.rows) == 10
    assert "| grain Poisson's ratio | A | 1 |" in by_name["table-markdown"]
    assert re.search(r"\| ≤ [\d.]+, not explored beyond to ≥ [\d.]+, not", by_name["table-markdown"])
    latex = by_name["table-latex"]
    assert latex.count(r" \\") == 1 + len(table.rows)
    assert latex.count(" & ") == 5 * (1 + len(table.rows))
    assert latex.index(r"\toprule") < latex.index(r"\midrule") < latex.index(r"\bottomrule")
    # Nothing that LaTeX takes for its own, or has no letter for.
    for text in (latex, by_name["methods-latex"]):
        assert text.isascii()
        assert re.search(r"(?<!\\)[%#_]", text) is None


def test_a_campaign_without_a_point_has_nothing_to_paste(campaign: Campaign, study: Study) -> None:
    assert pastes(replace(campaign, optimum=None), study, {}) == []


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("5 % of 30.1° ± 0.2°", r"5 \% of 30.1$^\circ$ $\pm$ 0.2$^\circ$"),
        ("R² < 1 & a_b {c} #2 $3", r"R$^2$ $<$ 1 \& a\_b \{c\} \#2 \$3"),
        ("~ ^ \\", r"\textasciitilde{} \textasciicircum{} \textbackslash{}"),
    ],
)
def test_latex_prints_a_text_as_it_stands(text: str, expected: str) -> None:
    assert latex_text(text) == expected

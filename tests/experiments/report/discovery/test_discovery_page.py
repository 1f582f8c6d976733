"""The page on a disagreement: well formed for every verdict, with the discovery's own numbers and words."""

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from discoveries import made_discovery
from page_reader import Page

from doe.discrepancy import Answer, Discovery, Interval, Question, Settings, Slip, Verdict
from experiments.report.discovery import Terms, render_discovery, verdict_sentence
from experiments.report.discovery.disagreement import conventions, misses, slip_sentences
from experiments.report.discovery.discovery_tables import SHOWN_PAIRS, data_table, shown_candidates
from experiments.report.discovery.discovery_verdict import changes, headline, next_step
from experiments.report.discovery.search_text import search_pastes
from experiments.report.discovery.terms import percent
from experiments.studyfile import Study

Pages = Callable[[Verdict], Any]


@pytest.mark.parametrize("verdict", Verdict)
def test_every_verdict_has_a_page_that_is_whole(verdict: Verdict, discovery_page: Pages) -> None:
    found, page = made_discovery(verdict), discovery_page(verdict)
    assert page.mismatches == []
    assert [name for name, count in Counter(page.ids).items() if count > 1] == []
    links = [link for link in page.links if not link.startswith("data:")]
    assert {link.removeprefix("#") for link in links if link.startswith("#")} <= set(page.ids)
    assert [link for link in links if not link.startswith("#")] == ["study-with.toml"]
    assert re.search(r"\b(nan|inf|None)\b", page.text) is None
    for note in found.notes:
        assert note in page.text
    assert found.effort.settings_sha256 in page.text


def test_a_named_effect_is_told_with_its_size_and_what_it_removed(terms: Terms) -> None:
    sentence = verdict_sentence(made_discovery(Verdict.NAMED), terms).replace("\u00a0", " ")
    assert sentence == (
        "Adding contact adhesion at 0.052 J/m² (90 % interval 0.041 to 0.064) removed 98 % (94 to 100 %) of"
        " the excess; held out, Q fell from 121 (98 to 143) to 11 (7.1 to 16). Do this next: Measure contact"
        " adhesion by itself."
    )


def test_no_share_is_told_of_an_excess_that_is_not_there(
    whole_study: Study, terms: Terms, discovery_page: Pages
) -> None:
    # A gap may be found by the fall of Q that a mechanism brings, though Q itself is within its noise.
    found = made_discovery(Verdict.TIE)
    assert found.base is not None
    quiet = replace(found, base=replace(found.base, q=found.base.degrees_of_freedom - 1.0))
    quiet_page = Page(render_discovery(quiet, whole_study, terms, Settings()))
    for page, words in ((discovery_page(Verdict.TIE), True), (quiet_page, False)):
        assert ("explained-chart" in page.charts) is words
        assert (page.rows("candidates")[0][2][1] is not None) is words
    sentence = verdict_sentence(replace(quiet, verdict=Verdict.UNKNOWN), terms)
    assert "Contact adhesion comes closest (it leaves Q = 48.3), but " in sentence


@pytest.mark.parametrize(
    ("clearest", "words"),
    [
        (Answer(Question.SIZE, 91.3, 73.7), "Q is 91.3 (limit 73.7)"),
        (
            Answer(Question.FALL, 14.2, 9.1, "plate_tilt"),
            "tilt of the plate would lower Q by 14.2 (limit of such a fall 9.1)",
        ),
        (
            Answer(Question.SCORES, 33.0, 25.2),
            "it lies along the effects of the library, whose squared scores sum to 33 (limit 25.2)",
        ),
    ],
)
def test_a_gap_is_told_by_the_test_that_sees_it(clearest: Answer, words: str, terms: Terms) -> None:
    found = made_discovery(Verdict.UNKNOWN)
    assert found.base is not None
    # Q itself lies within its limit, which must not be called beyond the noise.
    base = replace(found.base, q=43.8, q_limit=73.7, clearest=clearest)
    unknown = verdict_sentence(replace(found, base=base), terms)
    assert f"not by Q alone but in that {words}. " in unknown


def test_what_would_withdraw_a_name_is_the_fit_that_gave_it(terms: Terms) -> None:
    found = made_discovery(Verdict.NAMED)
    assert found.chosen is not None
    likely = replace(found, chosen=replace(found.chosen, p_value=0.31))
    words = changes(likely, terms, Settings(fit_level=0.1))
    wanted = f"makes, {percent(0.31)} disagree with it as much; were it less than {percent(0.1)},"
    assert any(wanted in sentence for sentence in words)


def test_the_page_shows_every_mechanism_and_the_first_pairs() -> None:
    found = made_discovery(Verdict.UNKNOWN)
    single = found.candidates[0]
    pairs = [replace(single, mechanisms=("plate_tilt", f"other_{number}")) for number in range(9)]
    several = replace(found, candidates=(*found.candidates, *pairs))
    assert shown_candidates(several) == [*found.candidates, *pairs[:SHOWN_PAIRS]]


def test_only_what_was_measured_stands_in_the_table_of_data(terms: Terms) -> None:
    table = data_table(made_discovery(Verdict.NOT_IDENTIFIABLE), terms)
    assert [column.key for column in table.columns] == ["observable", "base"]
    assert [row.cells[0].text for row in table.rows] == ["flank angle [°]", "heaps"]


def test_a_rise_of_the_held_out_gap_is_not_called_a_fall(terms: Terms) -> None:
    found = made_discovery(Verdict.NAMED)
    training, held_out = found.before_after
    turned = replace(held_out, before=held_out.after, after=held_out.before)
    assert "Q rose from 11" in verdict_sentence(replace(found, before_after=(training, turned)), terms)


def test_the_other_verdicts_name_nothing_as_missing(terms: Terms) -> None:
    none, unknown, tie, unclear = (
        verdict_sentence(made_discovery(verdict), terms)
        for verdict in (Verdict.NONE, Verdict.UNKNOWN, Verdict.TIE, Verdict.NOT_IDENTIFIABLE)
    )
    assert "agrees with the data" in none
    assert "comes closest" in unknown
    assert "contact adhesion at 0.052" in tie
    assert "liquid bridges at 0.034" in tie
    assert unclear == made_discovery(Verdict.NOT_IDENTIFIABLE).reason


def test_the_maps_show_the_residuals_of_both_models(discovery_page: Pages) -> None:
    found, page = made_discovery(Verdict.NAMED), discovery_page(Verdict.NAMED)
    assert found.base is not None
    assert found.chosen is not None
    for name, fit in (("residuals-before", found.base), ("residuals-after", found.chosen)):
        [drawn] = page.charts[name]["data"]
        shown = np.array([[float(t.rstrip("*").replace("−", "-")) if t != "–" else np.nan for t in row]
                          for row in drawn["text"]])  # fmt: skip
        # Written with one decimal.
        np.testing.assert_allclose(shown, fit.residuals, atol=0.0500001)
        assert len(drawn["y"]) == len(found.data.conditions)
        assert sum("*" in t for row in drawn["text"] for t in row) == int((fit.adjusted_p < 0.05).sum())


def test_only_what_was_measured_is_compared(discovery_page: Pages) -> None:
    found, page = made_discovery(Verdict.NAMED), discovery_page(Verdict.NAMED)
    drawn = {name: chart for name, chart in page.charts.items() if name.startswith("compared-")}
    assert len(drawn) == len(found.data.observables)
    for name, chart in drawn.items():
        column = found.data.observables.index(name.removeprefix("compared-"))
        measured = int(np.isfinite(found.data.means[:, column]).sum())
        assert [len(series["y"]["bdata"] if isinstance(series["y"], dict) else series["y"]) > 0
                for series in chart["data"]] == [True, True, True]  # fmt: skip
        assert len(chart["layout"]["xaxis"]["ticktext"]) == measured


def test_candidates_stand_in_their_order_with_their_judgement(discovery_page: Pages, terms: Terms) -> None:
    found = made_discovery(Verdict.NAMED)
    rows = discovery_page(Verdict.NAMED).rows("candidates")
    for row, candidate in zip(rows, found.candidates, strict=True):
        assert row[1][0] == terms.titles(candidate.mechanisms)
        assert row[2][1] == 100.0 * candidate.explained
        assert row[-1][0] == ("admitted" if candidate.admitted else candidate.objection)


def test_a_search_has_a_paragraph_and_a_table_to_paste(whole_study: Study, terms: Terms) -> None:
    found = made_discovery(Verdict.NAMED)
    by_name = {paste.name: paste.text for paste in search_pastes(found, whole_study, terms, {})}
    text = by_name["methods-markdown"]
    assert "fitted to 48 means of 12 observables under 4 conditions; 1 further condition was held out" in text
    assert f"{found.effort.bank_cases + found.effort.fresh_cases} cases were simulated." in text
    assert verdict_sentence(found, terms) in text
    assert by_name["table-latex"].isascii()
    assert search_pastes(made_discovery(Verdict.NOT_IDENTIFIABLE), whole_study, terms, {}) == []


def test_a_tie_names_what_would_settle_it_and_says_where_no_condition_does(
    whole_study: Study, terms: Terms
) -> None:
    found = made_discovery(Verdict.TIE)
    assert found.next_experiment is not None
    words = " ".join(changes(found, terms, Settings()))
    assert "8 more tests under the condition “wide” are expected to settle it" in words
    assert "in 84\N{NO-BREAK SPACE}% of such cases" in next_step(found, terms)
    every = replace(found.next_experiment, conditions=found.data.conditions)
    words = next_step(replace(found, next_experiment=every), terms)
    assert words.startswith("Repeat the test 8 times under each condition.")
    weak = replace(found, next_experiment=replace(every, chance=0.6))
    words = " ".join(changes(weak, terms, Settings()))
    assert "8 more tests under each condition are not expected to settle it." in words
    assert "refinement_points" in next_step(weak, terms)
    dried = next_step(replace(found, next_experiment=replace(every, without="liquid_bridges")), terms)
    assert dried.startswith("Take liquid bridges away, then repeat the test 8 times under each condition")
    assert "If nothing is missing then, it was liquid bridges." in dried
    assert "would in 60\N{NO-BREAK SPACE}% of such cases" in next_step(weak, terms)
    # the tie heads the page with it, and none of its names was refused
    page = Page(render_discovery(weak, whole_study, terms, Settings())).text
    assert page.count("More heaps alone are not expected to tell") == 2
    refused = [one for one in changes(weak, terms, Settings()) if "refused" in one]
    assert not any(terms.title(name) in one for name in found.named for one in refused)
    # then what each of the two would do by itself
    for name in found.named:
        assert terms.mechanisms[name].confirm in words


def test_a_slip_heads_the_page_only_where_the_verdict_hangs_on_it(whole_study: Study, terms: Terms) -> None:
    none, tie, named = (made_discovery(v) for v in (Verdict.NONE, Verdict.TIE, Verdict.NAMED))
    value = Slip(("height",), ("rough",), 5, 3.0, False, 361.0, 0.0)
    noted = replace(named, slips=(value,), without_slips=named)
    assert headline(noted, terms) == headline(named, terms)
    sentence = verdict_sentence(noted, terms)
    assert sentence.startswith(verdict_sentence(named, terms))
    assert "height of heap 5 under rough looks as if multiplied by 3" in sentence
    assert sentence.endswith("Without these values the verdict is the same.")
    assert next_step(noted, terms) == next_step(named, terms)
    heads = replace(tie, slips=(value,), without_slips=none)
    assert headline(heads, terms) == "A likely slip in the data"
    words = verdict_sentence(heads, terms)
    assert "With them: tie: contact adhesion and liquid bridges." in words
    assert words.endswith(verdict_sentence(none, terms))
    page = Page(render_discovery(heads, whole_study, terms, Settings()))
    assert next_step(heads, terms).startswith("Look at the data first")
    assert next_step(heads, terms) in page.text
    # what is missed may be that value
    unknown = made_discovery(Verdict.UNKNOWN)
    noted_unknown = replace(unknown, slips=(value,), without_slips=unknown, next_experiment=None)
    assert headline(noted_unknown, terms) == headline(unknown, terms)
    assert next_step(noted_unknown, terms).startswith("Look at the data first")
    # a unit makes the whole misfit, whatever verdict it gets
    unit = Slip(("r50", "fill_height"), none.data.conditions, None, 10.0, False, 27105.0, 28.0)
    gross = replace(unknown, slips=(unit,), without_slips=unknown)
    assert headline(gross, terms) == "A likely slip in the data"
    assert "r50 and fill height look as if multiplied by 10" in verdict_sentence(gross, terms)


def test_an_observable_that_is_off_everywhere_is_misread_or_moved(terms: Terms) -> None:
    unknown, none = (made_discovery(v) for v in (Verdict.UNKNOWN, Verdict.NONE))
    drag = Slip(("wall_drag",), none.data.conditions, None, None, False, 1496.0, 25.0)
    found = replace(unknown, slips=(drag,), without_slips=none)
    said = headline(found, terms)
    assert said == "Wall drag: misread, or moved by an effect on nothing else; another instrument decides"
    assert "Misread or moved: wall drag is far from all that the rest allows." in verdict_sentence(
        found, terms
    )
    assert "measure the same in a few more heaps with another instrument" in next_step(found, terms)
    both = replace(drag, observables=("t75", "t55"), factor=2.0)
    assert headline(replace(found, slips=(both,)), terms).startswith("T75 and t55: misread, or")
    # what a unit explains, or two columns exchanged, is a slip
    for slip in (replace(drag, factor=1000.0), replace(both, factor=None, exchanged=True)):
        assert headline(replace(found, slips=(slip,)), terms) == "A likely slip in the data"
    assert "A likely slip: t75 and t55 look exchanged" in verdict_sentence(
        replace(found, slips=(slip,)), terms
    )


def test_a_heap_that_is_none_of_the_others_is_told_once(terms: Terms) -> None:
    none = made_discovery(Verdict.NONE)
    heap = Slip(none.data.observables, ("wide",), 3, None, False, 254.0, 0.0)
    [words] = slip_sentences(replace(none, slips=(heap,), without_slips=none))
    assert words.startswith(
        "A likely slip: heap 3 under wide is none of the others. On average its values lie 16"
    )


def off_alike(found: Discovery, deviations: float) -> Discovery:
    """Let no mean be clear, and one observable be off alike; the closest model is refused for that."""
    assert found.base is not None
    data, quiet = found.data, np.where(np.isnan(found.data.means), np.nan, 0.1)
    quiet[::2] *= -1.0
    quiet[:, data.observables.index("t55")] = deviations
    closest = replace(
        found.base,
        mechanisms=("plate_tilt",),
        sizes=(Interval(1.2, 2.1, 3.1),),
        residuals=quiet,
        predicted=data.means - quiet * data.standard_errors,
        clearest=Answer(Question.COMMON, 48.6, 18.5),
    )
    return replace(found, closest=closest)


def test_an_unknown_that_is_off_alike_everywhere_names_the_observable_and_the_next_measurement(
    whole_study: Study, terms: Terms
) -> None:
    found = off_alike(made_discovery(Verdict.UNKNOWN), 1.4)
    # 1.4 of 0.01 s; of five such residuals the mean is off by 1.4 root 5 of its standard errors
    missed = "t55 is 0.014 s late in all conditions (3.1 standard errors of the mean)."
    assert misses(found, terms) == [missed]
    assert conventions(found, terms)[0].startswith("For t55: a start of the clock")
    page = Page(render_discovery(found, whole_study, terms, Settings()))
    assert "T55 is 0.014 s late in all conditions" in page.text
    assert "Measure t55 of a few more heaps" in page.text
    # a model that passes every rule, though another does, too, misses nothing
    passing = replace(found.candidates[0], admitted=True, objection="")
    assert misses(replace(found, candidates=(passing, *found.candidates[1:])), terms) == []
    # something is off though no observable stands out: the one that is off most is words
    assert len(misses(off_alike(found, 0.2), terms)) == 1


def test_the_summary_says_an_objection_once(whole_study: Study, terms: Terms) -> None:
    found = made_discovery(Verdict.UNKNOWN)
    objection = found.candidates[0].objection
    words = replace(found, reason=f"contact adhesion comes closest, but {objection}")
    text = render_discovery(words, whole_study, terms, Settings())
    summary = text[text.index('id="summary"') : text.index("What was simulated")]
    assert summary.count("comes closest, but") + summary.count("comes closest (") == 1
    assert not any("Contact adhesion was refused" in one for one in changes(words, terms, Settings()))


def test_models_of_two_effects_have_their_titles_in_the_next_experiment(terms: Terms) -> None:
    found = made_discovery(Verdict.NAMED)
    assert found.next_experiment is not None
    step = replace(found.next_experiment, separates=("plate_tilt + size_spread", "plate_tilt"))
    words = next_step(replace(found, next_experiment=step), terms)
    pair = "the model with tilt of the plate and spread of sizes from the model with tilt of the plate"
    assert pair in words
    assert words.startswith("To be surer, repeat the test")
    weak = next_step(replace(found, next_experiment=replace(step, chance=0.0)), terms)
    assert f"what would tell {pair}" in weak
    assert "epeat the test" not in weak


def test_a_mean_that_stands_out_of_a_model_that_lacks_nothing_is_told(terms: Terms) -> None:
    found = made_discovery(Verdict.NONE)
    assert found.base is not None
    assert "By itself" not in verdict_sentence(found, terms)
    residuals = found.base.residuals.copy()
    at = (found.data.conditions.index("wide"), found.data.observables.index("t55"))
    residuals[at] = 4.0
    words = verdict_sentence(replace(found, base=replace(found.base, residuals=residuals)), terms)
    assert "By itself t55 is" in words
    assert "under wide (4 standard deviations)" in words


def test_notes_are_told_in_words(whole_study: Study, terms: Terms) -> None:
    notes = (
        "readings of flank_angle scatter 2.0 times as much",
        "plate_tilt is not in the bank",
        "out/my_run",
    )
    found = replace(made_discovery(Verdict.NONE), notes=notes)
    text = render_discovery(found, whole_study, terms, Settings())
    assert "readings of flank angle scatter 2.0 times as much." in text
    assert f"{terms.title('plate_tilt')} is not in the bank." in text
    assert "out/my_run." in text  # the names of others stay

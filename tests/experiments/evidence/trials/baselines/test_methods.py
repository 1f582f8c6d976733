"""Each method on worlds whose truth is known: closed forms, sparse truths, a strong effect and none."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from scipy.special import logsumexp
from synthetic_world import CONDITIONS, OBSERVABLES, SETTINGS, emulator, measure

from doe.discrepancy.fitting.model_fit import weigh
from doe.errors import RuleError
from experiments.evidence.trials.baselines.method_list import ALONE, installed, methods
from experiments.evidence.trials.baselines.methods import inference, lisdd, sbmi
from experiments.evidence.trials.baselines.methods.contest import judged, prior_of_one
from experiments.evidence.trials.baselines.methods.model_evidence import log_evidence, smc
from experiments.evidence.trials.baselines.protocol import Answer, Problem
from experiments.io.errors import InputError

KNOWN = emulator().without("delta", "epsilon", "zeta", "twin")
REFUSING = ("Bayes factors", "BIC", "boosted trees")
NAMING = (*REFUSING, "LISDD")
SBI, SBMI = (pytest.param(name, marks=pytest.mark.library("sbi")) for name in ("sbi", "SBMI"))
EVERY = [{"sbi": SBI, "SBMI": SBMI}.get(name, name) for name in methods(None)]


@pytest.fixture(autouse=True)
def few_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inference, "POINTS", 1000)  # seven models need no more


@pytest.fixture(scope="module")
def nothing() -> Problem:
    return Problem("nothing", KNOWN, measure({}, 5), SETTINGS, 1)


@pytest.fixture(scope="module")
def strong() -> Problem:
    return Problem("strong", KNOWN, measure({"beta": 1.2}, 3), SETTINGS, 2)


@pytest.fixture(scope="module")
def foreign() -> Problem:
    return Problem("foreign", KNOWN.without("beta"), measure({"beta": 2.0}, 3), SETTINGS, 3)


@pytest.mark.parametrize("name", EVERY)
def test_no_method_raises_an_alarm_where_nothing_is_hidden(name: str, nothing: Problem) -> None:
    answer = methods(None)[name](nothing)
    assert not answer.alarm
    assert answer.named == ()


@pytest.mark.parametrize("name", [*NAMING, ALONE, SBI, SBMI])
def test_a_strong_effect_is_named(name: str, strong: Problem) -> None:
    answer = methods(None)[name](strong)
    assert answer.alarm
    assert (answer.named, answer.tied) == (("beta",), False)


@pytest.mark.parametrize("name", REFUSING)
def test_what_the_library_lacks_is_not_named_alone(name: str, foreign: Problem) -> None:
    answer = methods(None)[name](foreign)
    assert answer.alarm
    assert answer.unknown
    assert answer.named == ()


def test_the_bayes_factor_of_a_linear_model_is_the_closed_form() -> None:
    rng = np.random.default_rng(2)
    slopes = 20.0 * rng.standard_normal((30, 3))
    target = slopes @ [0.3, -0.2, 0.25] + rng.standard_normal(30)

    def found(columns: int) -> float:
        used = slopes[:, :columns]
        return float(
            np.mean(
                [
                    smc(
                        lambda x: -0.5 * ((target - x @ used.T) ** 2).sum(axis=1),
                        -np.ones(columns),
                        np.ones(columns),
                        np.random.default_rng(seed),
                    )[0]
                    for seed in range(4)
                ]
            )
        )

    def exact(columns: int) -> float:
        used = slopes[:, :columns]
        normal = used.T @ used
        left = target - used @ np.linalg.solve(normal, used.T @ target)
        # The posterior lies well inside the bounds, whose volume is 2 to the power of the parameters.
        _, logdet = np.linalg.slogdet(normal / (2.0 * np.pi))
        return float(-0.5 * left @ left - 0.5 * logdet - columns * np.log(2.0))

    # One run's logarithm scatters by 0.2 to 0.3; four of them, and a difference: 0.2, three of these.
    assert found(3) - found(2) == pytest.approx(exact(3) - exact(2), abs=0.6)


def test_the_evidence_on_the_emulator_is_its_integral(nothing: Problem) -> None:
    fitted = nothing.fitted()
    lower, upper = fitted.model.lower, fitted.model.upper
    # A box around the optimum holds the posterior.
    half = 4.0 * np.sqrt(np.diag(fitted.spread))
    low, high = np.maximum(fitted.x - half, lower), np.minimum(fitted.x + half, upper)
    x = np.random.default_rng(3).uniform(low, high, (600, len(low)))
    logs = np.array([-0.5 * weigh(fitted.stack, row).score for row in x])
    volume = np.log(np.prod((high - low) / (upper - lower)))
    constant = 0.5 * len(fitted.stack.target) * np.log(2.0 * np.pi)
    exact = logsumexp(logs) - np.log(len(x)) + volume - constant
    found = np.mean([log_evidence(fitted, np.random.default_rng(seed)) for seed in range(3)])
    weights = np.exp(logs - logsumexp(logs))
    error = np.sqrt(np.sum(weights**2))
    assert found == pytest.approx(exact, abs=3.0 * (error + 0.15))


def test_an_f_test_confirms_a_mechanism_that_acts_and_refuses_one_that_does_not(strong: Problem) -> None:
    assert lisdd.confirmed(strong, ("beta", "gamma")) == ("beta",)
    # of forecasts of each condition by the others those with the true mechanism are the best of the singles
    errors = {names: lisdd.forecast_error(strong.fitted(names)) for names in strong.singles}
    assert min(errors, key=errors.__getitem__) == ("beta",)


def test_a_condition_that_is_off_is_located(nothing: Problem) -> None:
    stack, blocks = nothing.stack(()), list(nothing.blocks)
    assert lisdd.located(stack, blocks).min() > 1e-3
    # ten standard deviations of a mean
    moved = (
        blocks[2].mean + 10.0 * np.sqrt(np.diag(stack.covariance(nothing.fitted().x)))[: len(blocks[2].mean)]
    )
    blocks[2] = replace(blocks[2], mean=moved)
    found = lisdd.located(stack, blocks)
    assert found.argmin() == 2
    assert found[2] < 1e-9


@pytest.mark.library("sbi")
def test_sbi_answers_alike_and_leaves_no_file_and_no_word(
    strong: Problem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import torch

    monkeypatch.setattr(inference, "POINTS", 300)
    monkeypatch.chdir(tmp_path)
    state = torch.random.get_rng_state()
    first, second = (methods(None)["sbi"](strong) for _ in range(2))
    assert first == second
    assert torch.equal(torch.random.get_rng_state(), state)
    assert list(tmp_path.iterdir()) == []
    assert capsys.readouterr() == ("", "")


def test_draws_of_a_network_are_of_every_model_by_its_prior(
    nothing: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inference, "POINTS", 600)
    drawn = inference.drawn_means(nothing, np.random.default_rng(7))
    pairs = (("alpha", "beta"), ("alpha", "gamma"), ("beta", "gamma"))
    assert drawn.models == ((), ("alpha",), ("beta",), ("gamma",), *pairs)
    shares = np.bincount(drawn.model) / len(drawn.model)
    np.testing.assert_allclose(shares, [1 / 2, *[1 / 12] * 6], atol=1e-3)
    assert drawn.means.shape == (len(drawn.model), len(nothing.stack(()).target))
    # two factors, and the sizes of those mechanisms alone that a model has
    sizes = np.isfinite(drawn.parameters[:, -3:])
    assert np.isfinite(drawn.parameters[:, :-3]).all()
    np.testing.assert_array_equal(sizes.sum(axis=1), np.array([0, 1, 1, 1, 2, 2, 2])[drawn.model])


@pytest.mark.library("sbi")
def test_grassmann_distributions_sum_to_one_over_all_binary_vectors() -> None:
    raw = np.random.default_rng(5).normal(0.0, 2.0, sbmi.MIXED * (1 + 2 * 4**2))
    every = np.array(list(np.ndindex(2, 2, 2, 2)), dtype=float)
    logs = sbmi.grassmann(inference.tensor(np.tile(raw, (16, 1))), inference.tensor(every))
    # single precision: 1e-7 each, 16 determinants of 4 by 4
    assert float(logs.exp().sum()) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.library("sbi")
def test_a_mixture_of_gaussians_leaves_out_the_parameters_that_a_model_lacks() -> None:
    rng, size = np.random.default_rng(6), 3
    raw = rng.standard_normal(sbmi.MIXED * (1 + size + size**2))
    logits, means, elements = np.split(raw, [sbmi.MIXED, sbmi.MIXED * (1 + size)])
    at = np.array([[0.3, np.nan, -0.8]])
    found = float(sbmi.gaussians(inference.tensor(raw[None]), inference.tensor(at))[0])
    factors = elements.reshape(-1, size, size)
    lower = np.tril(factors, -1) + np.array([np.diag(np.log1p(np.exp(np.diag(each)))) for each in factors])
    known = [0, 2]
    logs = [
        stats.multivariate_normal(mean[known], (each @ each.T)[np.ix_(known, known)]).logpdf(at[0, known])
        for mean, each in zip(means.reshape(-1, size), lower, strict=True)
    ]
    # single precision, and the least standard deviation of 1e-4 that the network adds
    assert found == pytest.approx(logsumexp(logits - logsumexp(logits) + logs), abs=2e-3)


def test_all_single_mechanisms_have_the_prior_of_all_pairs() -> None:
    assert {size: prior * {1: 6, 2: 15}[size] for size, prior in prior_of_one(6).items()} == {1: 0.5, 2: 0.5}


def test_without_sbi_the_message_says_what_to_install_and_the_others_go_on(
    nothing: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inference, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=re.escape("pip install 'dem-warp[sbi]'")):
        methods(None)["sbi"](nothing)
    assert list(installed(methods(None))) == [name for name in methods(None) if name not in ("sbi", "SBMI")]


def test_models_that_share_the_weight_are_a_tie_and_what_most_have_is_named(strong: Problem) -> None:
    weights = {("alpha",): 0.5, ("beta",): 0.5}
    shared = judged(strong, 9.0, 3.0, weights | {("alpha", "beta"): 0.0}, 20.0)
    # Neither fits better than the check: whichever is looked at, the answer is a tie or unknown.
    assert shared.unknown or (shared.named == ("alpha", "beta") and shared.tied)
    sure = judged(strong, 9.0, 3.0, {("beta",): 0.6, ("alpha", "beta"): 0.4}, 20.0)
    assert (sure.named, sure.tied) == (("beta",), False)
    assert judged(strong, 1.0, 3.0, weights, 20.0).named == ()


def test_an_answer_without_an_alarm_says_nothing_more() -> None:
    with pytest.raises(InputError, match="without an alarm"):
        Answer(0.0, False, named=("beta",))
    with pytest.raises(InputError, match="unknown"):
        Answer(1.0, True, named=("beta",), unknown=True)


def test_a_method_sees_neither_withheld_mechanisms_nor_values_that_were_not_measured() -> None:
    measured = measure({}, 5, conditions=CONDITIONS[:3]).only(OBSERVABLES[:6])
    problem = Problem("part", KNOWN.without("alpha"), measured, SETTINGS, 1)
    assert problem.singles == (("beta",), ("gamma",))
    assert len(problem.fitted().covariance) == 18
    with pytest.raises(RuleError):
        replace(problem, measured=measured.only(("nothing",)))

"""Simulation-based inference: a neural posterior of the model, and `sbi`'s test of misspecification.

Means are drawn from the base, from every mechanism and from every pair. A network learns which of these they
come from (Radev et al. 2021), by the neural posterior estimation of `sbi`. Its first layers make a summary of
the means. `sbi` tests by the maximum mean discrepancy between summaries whether the measured means are a draw
of the base (Schmitt et al. 2024): that is the alarm. A summary that was learned from all models knows the
directions of the mechanisms, which one of the base's factors need not see.

The posterior of the model gives the names, under the prior of the Bayes factors. The best model is checked as
theirs is (`contest`): the guide to `sbi` asks for a predictive check, and its own test has little power
against what no model fits, as the draws of a model spread over all its ranges.

`sbi` does not regularise summaries in training, as Schmitt et al. advise. The network learns anew for every
trial, since the noise is that of the trial's own replicates.
"""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import softmax

from doe.discrepancy.fitting.fitted_model import Stack
from experiments.evidence.trials.baselines.methods.contest import judged, prior_of_one
from experiments.evidence.trials.baselines.protocol import LEVEL, ODDS, Answer, Mechanisms, Problem
from experiments.io.errors import InputError

if TYPE_CHECKING:
    from sbi.neural_nets.estimators import CategoricalMassEstimator
    from torch import Tensor

EXTRA = "pip install 'dem-warp[sbi]'"
"""Command that installs what this method needs."""
POINTS, REPEATS = 3000, 5
"""Parameters that are drawn in all, and draws of the noise at each."""
HIDDEN, SUMMARIES = 100, 12
"""Units of the first layer, and numbers in a summary: twice the parameters of a model, or more."""
BATCH, RATE, PATIENCE = 500, 2e-3, 10
"""Draws in a step of training, its rate, and epochs without a gain that end it."""
REFERENCES = 400
"""Draws of the base that the measured summary is compared with, and draws of the distance under the base."""


class Sbi:
    """Neural posterior of the model, with a test of misspecification."""

    name = "sbi"
    source = "Radev et al. 2021; Schmitt et al. 2024; Boelts et al. 2025 (`sbi`)"
    level = f"{100 * LEVEL:g} % (draws of the base)"

    def __call__(self, problem: Problem) -> Answer:
        """Learn from draws, and look at the means."""
        require_sbi()
        rng = np.random.default_rng(problem.seed)
        base = problem.stack(())
        drawn = drawn_means(problem, rng)
        with quiet_torch(problem.seed):
            network = _trained(drawn)
            _, references = predicted_means(base, rng, REFERENCES)
            score, limit = _distance(network, base.target[None], references)
            posterior = _posterior(network, base.target, len(drawn.models))
        others = posterior[1:] / posterior[1:].sum()
        weights = {names: float(weight) for names, weight in zip(drawn.models[1:], others, strict=True)}
        return judged(problem, score, limit, weights, ODDS)


def is_installed() -> bool:
    """Return True where `sbi` can be imported."""
    return find_spec("sbi") is not None


def require_sbi() -> None:
    """Refuse to go on where `sbi` is not installed."""
    if not is_installed():
        raise InputError("--methods", f"simulation-based inference needs sbi: {EXTRA}", "not installed: sbi")


@dataclass(frozen=True, eq=False)
class Drawn:
    """Draws of several models."""

    models: tuple[Mechanisms, ...]
    """The base first."""
    means: np.ndarray
    """(draws, means)."""
    model: np.ndarray
    """Number of the model that each draw is of, (draws,)."""
    parameters: np.ndarray
    """Coded factors, and sizes of all mechanisms: NaN where a model has not got one, (draws, parameters)."""


def drawn_means(problem: Problem, rng: np.random.Generator) -> Drawn:
    """Draw from the base, every mechanism and every pair, of each by its prior probability."""
    names = problem.emulator.space.names
    models: tuple[Mechanisms, ...] = ((), *problem.singles, *combinations(names, 2))
    share = {0: 0.5} | {size: 0.5 * prior for size, prior in prior_of_one(len(names)).items()}
    counts = [max(round(POINTS * share[len(model)]), 1) for model in models]
    drawn = [
        predicted_means(problem.stack(model), rng, count, REPEATS)
        for model, count in zip(models, counts, strict=True)
    ]
    parameters, means = map(np.concatenate, zip(*drawn, strict=True))
    return Drawn(models, means, np.repeat(np.arange(len(models)), [len(x) for x, _ in drawn]), parameters)


def predicted_means(
    stack: Stack, rng: np.random.Generator, points: int, repeats: int = 1
) -> tuple[np.ndarray, np.ndarray]:
    """Means as the model has them at points in its ranges, with errors drawn so often at each.

    Returns
    -------
    (points * repeats, parameters), (points * repeats, means) array
        Parameters of all mechanisms, NaN for those that the model lacks.
    """
    size, space = len(stack.target), stack.model.emulator.space
    x = rng.uniform(stack.model.lower, stack.model.upper, (points, len(stack.model.lower)))
    noise = [rng.standard_normal((repeats, size)) @ np.linalg.cholesky(stack.covariance(row)).T for row in x]
    every = np.full((points, len(space.factors) + len(space.names)), np.nan)
    own = [len(space.factors) + space.names.index(name) for name in stack.model.mechanisms]
    every[:, [*range(len(space.factors)), *own]] = x
    means = stack.predict(x)[:, None] + np.array(noise)
    return np.repeat(every, repeats, axis=0), means.reshape(-1, size)


@contextmanager
def quiet_torch(seed: int) -> Iterator[None]:
    """Let torch draw from a seed of its own, and say nothing."""
    import torch

    with torch.random.fork_rng(devices=[]), warnings.catch_warnings(), redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        torch.manual_seed(seed)
        yield


class _NoTracker:
    """Tracker of a training that keeps nothing: that of `sbi` writes files into the working folder."""

    log_dir = None

    def log_metric(self, name: str, value: float, step: int | None = None) -> None: ...

    def log_metrics(self, metrics: dict[str, float], step: int | None = None) -> None: ...

    def log_params(self, params: dict[str, Any]) -> None: ...

    def add_figure(self, name: str, figure: object, step: int | None = None) -> None: ...

    def flush(self) -> None: ...


def _trained(drawn: Drawn) -> CategoricalMassEstimator:
    """Train the posterior of the model."""
    import torch
    from sbi.inference import NPE
    from sbi.neural_nets.embedding_nets import FCEmbedding
    from sbi.neural_nets.net_builders.categorial import build_categoricalmassestimator

    summary = FCEmbedding(drawn.means.shape[1], SUMMARIES, num_hiddens=HIDDEN)

    def build(models: Tensor, means: Tensor) -> CategoricalMassEstimator:
        return build_categoricalmassestimator(
            models,
            means,
            num_layers=1,
            num_hidden=HIDDEN // 2,
            num_categories_per_variable=torch.tensor([len(drawn.models)]),
            embedding_net=summary,
        )

    trainer = NPE(density_estimator=build, tracker=_NoTracker(), show_progress_bars=False)
    trainer.append_simulations(tensor(drawn.model[:, None]), tensor(drawn.means))
    network = trainer.train(training_batch_size=BATCH, learning_rate=RATE, stop_after_epochs=PATIENCE)
    return network.eval()


def _posterior(network: CategoricalMassEstimator, means: np.ndarray, count: int) -> np.ndarray:
    """Probabilities of the models by the network at the means (means,), (models,)."""
    import torch

    numbers = torch.arange(count, dtype=torch.float32)[:, None]
    with torch.no_grad():
        logs = network.log_prob(numbers, tensor(np.tile(means, (count, 1))))
    return np.asarray(softmax(logs.numpy().astype(float).ravel()))


def _distance(
    network: CategoricalMassEstimator, seen: np.ndarray, references: np.ndarray
) -> tuple[float, float]:
    """Discrepancy of what was seen from draws in the network's summaries, and its limit.

    Parameters
    ----------
    seen, references : (1, means), (draws, means) array

    Returns
    -------
    tuple
        In standard deviations from the mean under the model of the draws, and the quantile that this passes
        with the probability `LEVEL`.
    """
    import torch
    from sbi.diagnostics.misspecification import calc_misspecification_mmd

    with torch.no_grad():
        one, others = (network.net.embedding_net(tensor(means)) for means in (seen, references))
        # these are summaries already; sbi finds none itself in a network of discrete parameters
        _, (null, distance) = calc_misspecification_mmd(
            one, others, mode="x_space", n_shuffle=REFERENCES, max_samples=REFERENCES
        )
    centre, scale = float(null.mean()), float(null.std())
    limit = float(np.quantile(null.numpy(), 1.0 - LEVEL))
    return (float(distance) - centre) / scale, (limit - centre) / scale


def tensor(values: np.ndarray) -> Tensor:
    """Convert an array to single precision."""
    import torch

    return torch.as_tensor(values, dtype=torch.float32)

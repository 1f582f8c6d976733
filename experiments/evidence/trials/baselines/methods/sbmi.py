"""Simulation-based model inference: one network for the mechanisms that act and for their sizes.

Means are drawn from the prior of models as for `sbi`, with the parameters that they come from. A summary of
the means feeds a mixture of Grassmann distributions of the vector that says which mechanisms act, and, with
that vector, a mixture of Gaussians of all parameters, from which those of other mechanisms are marginalised
out. All are trained together (Schröder and Macke 2024, arXiv 2305.15174; written anew after their code).

The posterior odds of any mechanism raise the alarm and name as Bayes factors do, and the named model is
checked as theirs is. The network of a bank and library serves all its trials.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from experiments.evidence.trials.baselines.methods.contest import by_posterior
from experiments.evidence.trials.baselines.methods.inference import (
    BATCH,
    HIDDEN,
    PATIENCE,
    RATE,
    drawn_means,
    quiet_torch,
    require_sbi,
    tensor,
)
from experiments.evidence.trials.baselines.protocol import ODDS, Answer, Mechanisms, Problem

if TYPE_CHECKING:
    from torch import Tensor
    from torch.nn import ModuleDict

MIXED = 3
"""Distributions in each mixture."""
HELD = 0.1
"""Share of the draws that decides when training ends."""
FLOOR = 1e-4
"""Least surplus of a diagonal, and least standard deviation, as in the published code."""


@dataclass(frozen=True, eq=False)
class Network:
    """A trained network, and what it was trained on."""

    layers: ModuleDict
    models: tuple[Mechanisms, ...]
    present: Tensor
    """1 where a model has a mechanism, (models, mechanisms)."""
    centre: np.ndarray
    scale: np.ndarray


class Sbmi:
    """Joint posterior of mechanisms and parameters."""

    name = "SBMI"
    source = "Schröder and Macke 2024 (arXiv 2305.15174)"
    level = f"odds of {ODDS:g}"

    def __init__(self) -> None:
        self._learned: dict[Hashable, Network] = {}

    def __call__(self, problem: Problem) -> Answer:
        """Look at the measured means."""
        require_sbi()
        import torch

        if problem.key not in self._learned:
            with quiet_torch(problem.seed):
                self._learned[problem.key] = _learn(problem)
        network = self._learned[problem.key]
        layers, count = network.layers, len(network.models)
        with torch.no_grad():
            means = tensor((problem.stack(()).target - network.centre) / network.scale)
            raw = layers["acting"](layers["summary"](means[None])).expand(count, -1)
            found = torch.softmax(grassmann(raw, network.present), 0).numpy().astype(float)
        return by_posterior(problem, network.models, found)


def _learn(problem: Problem) -> Network:
    from torch import nn

    drawn = drawn_means(problem, np.random.default_rng(problem.seed))
    names = problem.emulator.space.names
    present = tensor(np.array([[name in model for name in names] for model in drawn.models]))
    centre, scale = drawn.means.mean(axis=0), drawn.means.std(axis=0)
    parts = [tensor((drawn.means - centre) / scale), present[drawn.model], tensor(drawn.parameters)]
    size, mixed, values = parts[0].shape[1], len(names), parts[2].shape[1]

    def layers(inputs: int, outputs: int) -> nn.Sequential:
        inner = (nn.Linear(inputs, HIDDEN), nn.ReLU(), nn.Linear(HIDDEN, HIDDEN), nn.ReLU())
        return nn.Sequential(*inner, nn.Linear(HIDDEN, outputs))

    net = nn.ModuleDict(
        {
            "summary": nn.Sequential(layers(size, HIDDEN), nn.ReLU()),
            "acting": layers(HIDDEN, MIXED * (1 + 2 * mixed**2)),
            "sizes": layers(HIDDEN + mixed, MIXED * (1 + values + values**2)),
        }
    )
    _train(net, parts)
    return Network(net.eval(), drawn.models, present, centre, scale)


def _train(net: ModuleDict, parts: list[Tensor]) -> None:
    """Train on draws until those that are held out gain no more."""
    import torch

    order = torch.randperm(len(parts[0]))
    held, rest = order[: round(HELD * len(order))], order[round(HELD * len(order)) :]
    steps = torch.optim.Adam(net.parameters(), lr=RATE)
    best, waited, state = np.inf, 0, net.state_dict()
    while waited < PATIENCE:
        for batch in rest[torch.randperm(len(rest))].split(BATCH):
            steps.zero_grad()
            loss(net, *(part[batch] for part in parts)).backward()
            torch.nn.utils.clip_grad_norm_(net.parameters(), 5.0)
            steps.step()
        with torch.no_grad():
            now = float(loss(net, *(part[held] for part in parts)))
        best, waited, gained = min(best, now), waited + 1, now < best
        if gained:
            waited, state = 0, {name: value.clone() for name, value in net.state_dict().items()}
    net.load_state_dict(state)


def loss(net: ModuleDict, means: Tensor, present: Tensor, parameters: Tensor) -> Tensor:
    """Mean of minus the logarithm of the joint posterior, at the models and parameters of draws."""
    import torch

    summary = net["summary"](means)
    raw = net["sizes"](torch.cat([summary, present], 1))
    joint = grassmann(net["acting"](summary), present) + gaussians(raw, parameters)
    return -joint.mean()


def grassmann(raw: Tensor, present: Tensor) -> Tensor:
    """Logarithm of mixtures of Grassmann distributions (Arai 2021) at binary vectors, (draws,).

    Parameters
    ----------
    raw : (draws, MIXED * (1 + 2 * mechanisms**2)) tensor
        Unnormalised logarithms of weights, and elements of B and C, whose rows become diagonally dominant:
        the inverse of each matrix of the distribution is B times the inverse of C, plus one.
    present : (draws, mechanisms) tensor
    """
    import torch

    draws, size = present.shape
    both = raw[:, MIXED:].view(draws, 2, MIXED, size, size)
    off = both * (1.0 - torch.eye(size))
    own = off.abs().sum(-1) + both.diagonal(dim1=-2, dim2=-1).relu() + FLOOR
    first, second = (off + torch.diag_embed(own)).unbind(1)
    sigma = torch.linalg.solve(first + second, second, left=False)
    signed = sigma * (2.0 * present - 1.0)[:, None, None] + torch.diag_embed(1.0 - present)[:, None]
    logs = torch.linalg.det(signed).clamp_min(1e-12).log()
    return torch.logsumexp(torch.log_softmax(raw[:, :MIXED], 1) + logs, 1)


def gaussians(raw: Tensor, parameters: Tensor) -> Tensor:
    """Logarithm of mixtures of Gaussians at parameters, those that are NaN marginalised out, (draws,)."""
    import torch

    draws, size = parameters.shape
    logits, means, elements = raw.split([MIXED, MIXED * size, MIXED * size**2], 1)
    factor = elements.view(draws, MIXED, size, size)
    own = torch.nn.functional.softplus(factor.diagonal(dim1=-2, dim2=-1)) + FLOOR
    factor = factor.tril(-1) + torch.diag_embed(own)
    # a parameter that a model lacks becomes a standard deviation of 1 without any correlation, at its mean
    known = (~parameters.isnan()).float()
    covariance = factor @ factor.mT * known[:, None, :, None] * known[:, None, None]
    normal = torch.distributions.MultivariateNormal(
        torch.zeros(size), covariance + torch.diag_embed(1.0 - known)[:, None], validate_args=False
    )
    left = (parameters.nan_to_num()[:, None] - means.view(draws, MIXED, size)) * known[:, None]
    without = 0.5 * np.log(2.0 * np.pi) * (1.0 - known).sum(1)
    return torch.logsumexp(torch.log_softmax(logits, 1) + normal.log_prob(left), 1) + without

"""Distance of the measured means from all that the base predicts, by a kernel: a test of misspecification.

Amortised inference warns by the maximum mean discrepancy between what was observed and what the prior
predicts (Gretton et al. 2012; Schmitt et al. 2024, which `sbi` follows): the means are drawn from the
base over the ranges of its factors, a Gaussian kernel has their median distance as its width, and the
distance of the measured means is compared with those of further draws. Without a network that learns
summaries the means are the summaries, each in its standard deviation. It names nothing.
"""

import numpy as np
from scipy.spatial.distance import cdist

from doe.discrepancy.fitting.fitted_model import Stack
from experiments.evidence.trials.baselines.protocol import LEVEL, Answer, Problem

DRAWS = 200
"""Number of draws from the prior."""


class Mmd:
    """Kernel distance from the prior's predictions."""

    name = "MMD"
    source = "Gretton et al. 2012; Schmitt et al. 2024"
    level = f"{100 * LEVEL:g} % (draws of the prior)"

    def __call__(self, problem: Problem) -> Answer:
        """Compare the means with draws."""
        stack = problem.stack(())
        drawn = predicted_means(stack, np.random.default_rng(problem.seed), DRAWS)
        p, distance = misspecified(stack.target, drawn)
        return Answer(score=distance, alarm=p < LEVEL)


def predicted_means(stack: Stack, rng: np.random.Generator, points: int, repeats: int = 1) -> np.ndarray:
    """Means as the model has them at points in its ranges, with errors drawn so often at each.

    Returns
    -------
    (points * repeats, means) array
    """
    size = len(stack.target)
    x = rng.uniform(stack.model.lower, stack.model.upper, (points, len(stack.model.lower)))
    noise = [rng.standard_normal((repeats, size)) @ np.linalg.cholesky(stack.covariance(row)).T for row in x]
    return np.asarray(stack.predict(x)[:, None] + np.array(noise)).reshape(-1, size)


def misspecified(seen: np.ndarray, drawn: np.ndarray) -> tuple[float, float]:
    """P value of one set of means (means,) among draws (draws, means), and its distance.

    The square of the discrepancy between one point and a sample is k(x, x) - 2 mean k(x, Y) + a constant;
    each draw's own is that from all others.
    """
    scale = drawn.std(axis=0)
    points, one = drawn / scale, (seen / scale)[None]
    among = cdist(points, points)
    width = float(np.median(among[np.triu_indices(len(points), 1)]))
    kernel = np.exp(-0.5 * (among / width) ** 2)
    others = (kernel.sum(axis=1) - 1.0) / (len(points) - 1)
    own = float(np.exp(-0.5 * (cdist(one, points) / width) ** 2).mean())
    p = (1.0 + float((others <= own).sum())) / (len(points) + 1.0)
    return p, 1.0 - own

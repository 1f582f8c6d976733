"""The methods by name."""

from collections.abc import Mapping

from experiments.evidence.trials.baselines.methods.bayes_factors import BayesFactors
from experiments.evidence.trials.baselines.methods.bic import Bic
from experiments.evidence.trials.baselines.methods.boosting import Boosting
from experiments.evidence.trials.baselines.methods.inference import Sbi, is_installed
from experiments.evidence.trials.baselines.methods.lisdd import Lisdd
from experiments.evidence.trials.baselines.methods.sbmi import Sbmi
from experiments.evidence.trials.baselines.methods.search_method import Search, Simulator
from experiments.evidence.trials.baselines.protocol import Method

SEARCH, ALONE = "search", "search, bank alone"
"""Names of the search with fresh runs, and without: what the others have."""


def methods(simulator: Simulator | None) -> dict[str, Method]:
    """List every method by name; the search with fresh runs where a simulator answers them."""
    found: list[Method] = [
        Search(ALONE, None),
        BayesFactors(),
        Bic(),
        Lisdd(),
        Boosting(),
        Sbi(),
        Sbmi(),
    ]
    if simulator is not None:
        found.insert(0, Search(SEARCH, simulator))
    return {method.name: method for method in found}


def installed(known: Mapping[str, Method]) -> dict[str, Method]:
    """Leave out the methods whose optional library is not installed."""
    return {name: each for name, each in known.items() if name not in (Sbi.name, Sbmi.name) or is_installed()}

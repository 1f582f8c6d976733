"""A design: every corner of the factors' ranges, as often as the runs allow."""

from collections.abc import Sequence
from itertools import islice, product

import pandas as pd

from doe import Design, DesignError, Factor


def corners(factors: Sequence[Factor], runs: int) -> Design:
    """Return the full factorial of two levels."""
    every = list(product((-1.0, 1.0), repeat=len(factors)))
    if runs % len(every):
        raise DesignError(f"corners: the runs must be a multiple of {len(every)}, got {runs}")
    rows = list(islice((row for _ in range(runs) for row in every), runs))
    labels = pd.RangeIndex(1, runs + 1, name="run")
    return Design(tuple(factors), pd.DataFrame(rows, index=labels, columns=[f.name for f in factors]))

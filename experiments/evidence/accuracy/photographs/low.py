"""Measure photograph-like pictures of low heaps, 6 to 15 degrees, which the other series hardly have.

python -m experiments.evidence.accuracy.photographs.low --first 980000 --heaps 60
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from itertools import count, islice

import cv2
import numpy as np

from experiments.evidence.accuracy.photographs.photographs_record import Row, figures, row_of
from experiments.evidence.accuracy.photographs.sampling import photograph_of_a_low_heap


def low_heap(seed: int) -> Row:
    """Row of a photograph of a low heap."""
    cv2.setNumThreads(1)
    return row_of(photograph_of_a_low_heap(seed), seed)[0]


def main() -> None:
    """Run the benchmark as a command."""
    parser = argparse.ArgumentParser(description="Measure photograph-like pictures of low heaps.")
    parser.add_argument("--first", type=int, default=980_000, help="first seed")
    parser.add_argument("--heaps", type=int, default=60)
    parser.add_argument("--workers", type=int, help="processes; left out: one a core")
    chosen = parser.parse_args()
    with ProcessPoolExecutor(chosen.workers) as pool:
        rows = list(pool.map(low_heap, islice(count(chosen.first), chosen.heaps), chunksize=4))
    ratios = [row["error"] / row["se"] for row in rows if row["outcome"] == "measured"]
    table = {f"low heaps{name}": value for name, value in figures(rows).items()}
    table["low heaps: error over standard error, root mean square"] = (
        f"{np.sqrt(np.mean(np.square(ratios))):.2f}"
    )
    print("\n".join(f"| {name} | {value} |" for name, value in table.items()))


if __name__ == "__main__":
    main()

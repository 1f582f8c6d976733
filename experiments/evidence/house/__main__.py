"""Print the counts of the house next to their limits; with --walk also those of a traced calibration.

python -m experiments.evidence.house [--walk]
"""

from __future__ import annotations

import sys

from experiments.evidence.house.counts import counts
from experiments.evidence.house.walk import walk


def main(arguments: list[str]) -> None:
    """Print the table."""
    rows = counts() + (walk() if "--walk" in arguments else [])
    width = max(len(row.what) for row in rows)
    for row in rows:
        over = "" if row.value <= row.limit else "  over the limit"
        print(f"{row.what:<{width}}  {row.value:>9,.6g}  of {row.limit:>7,.6g}{over}")


if __name__ == "__main__":
    main(sys.argv[1:])

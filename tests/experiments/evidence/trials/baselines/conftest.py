"""Lets the tests of the methods import `synthetic`, the world of the tests of `doe.discrepancy`."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[4] / "doe" / "discrepancy"))

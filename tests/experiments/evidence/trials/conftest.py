"""Lets the tests of the trials import `synthetic_world`, the world of the tests of `doe.discrepancy`."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[3] / "doe" / "discrepancy"))

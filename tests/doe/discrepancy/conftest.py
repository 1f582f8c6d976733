"""Make `synthetic_world`, next to this file, importable in the tests of doe.discrepancy."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

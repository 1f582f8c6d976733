"""Lets the tests of the search for missing mechanisms import `synthetic`, the world that lies beside them."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

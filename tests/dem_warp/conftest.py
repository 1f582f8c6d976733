"""Path of the engine tests, so that they can import `worlds`, the builders of small worlds."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

"""Settings of all processes of the tests: threads of linear algebra, compiled modules, rare collections."""

import gc
import os
import sys

# read when NumPy is loaded, here and in every process that a test starts
for _library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

# a module is compiled once, and not by each of some hundred processes
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# thousands of modules and syntax trees stay to the end: looking through them again and again frees nothing
gc.set_threshold(100_000, 50, 100)


def pytest_collection_finish() -> None:
    """Leave all that exists before the first test out of collections, also out of those of the product."""
    gc.freeze()

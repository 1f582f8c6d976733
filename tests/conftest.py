"""Threads of linear algebra: one for each of the processes that share the cores."""

import os

# read when NumPy is loaded, here and in every process that a test starts
for _library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

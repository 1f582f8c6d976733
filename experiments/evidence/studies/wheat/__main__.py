"""Wheat in four tests: one grain, seven data, a friction for each wall; each datum predicted by the others.

    python -m experiments.evidence.studies.wheat run --out out/wheat
    python -m experiments.evidence.studies.wheat run --scale bench --device cpu --out out/wheat-bench
    python -m experiments.evidence.studies.wheat page --out out/wheat

The first needs a GPU; the second has small tests for two cores; the third measures the simulated states and
writes the page. What a folder holds is not simulated again.
"""

from pathlib import Path

from experiments.evidence.studies.drum_commands import drum_commands

app = drum_commands("experiments.evidence.studies.wheat.wheat", __doc__, Path("out/wheat"))

if __name__ == "__main__":
    app()
